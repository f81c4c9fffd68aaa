//! Reads what a scenario wants of the identification: the part `[analysis.config]` of its file.

mod closed_loop;

use std::collections::BTreeMap;

pub use closed_loop::{ClosedLoop, HoldOut};
use preparation::direction::Direction;
use preparation::{Pipeline, Shift};
use serde::Deserialize;
use tire_inference::fit::{Constraints, FitOptions, SlipNoise};
use tire_inference::noise::NoiseModel;
use tire_inference::parameters::{COUNT, Parameter, Theta, from_parameters};
use tire_inference::prior::Prior;
use tire_inference::regularisation::Regularisation;
use tire_inference::settings::{Method, Settings};
use tire_inference::synthetic::Excitation;
use tire_inference::variational::Optimiser;
use tire_inference::variational::adam::Adam;

use crate::prior_from_file::Files;

/// What is to be done.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "task", rename_all = "snake_case")]
pub enum Config {
    /// Identify the tires of a car from what it did.
    Tires(Box<Tires>),
    /// Identify the tires of both axles from a drive under closed-loop control.
    ClosedLoop(Box<ClosedLoop>),
    /// Identify one curve from slips and forces.
    Curve(Box<OneCurve>),
    /// Tell from which excitation on each parameter is identified.
    ExcitationStudy(Excitation),
    /// Tell which parameter matters at which slip.
    SensitivityStudy(Sensitivity),
}

impl Config {
    /// Reads TOML.
    ///
    /// # Errors
    /// In words, with the key in backticks.
    pub fn read(text: &str) -> Result<Self, String> {
        let config: Self = toml::from_str(text).map_err(|error| error.message().to_owned())?;
        match &config {
            Self::Tires(tires) => tires.check()?,
            Self::ClosedLoop(drive) => drive.check()?,
            Self::Curve(curve) => {
                demand(!curve.methods.is_empty(), "methods", "`least_squares` at least")?;
                check_svi(&curve.svi)?;
                curve.fit.check("fit")?;
                curve.files.check(&["curve"])?;
            }
            Self::ExcitationStudy(study) => {
                let slips = study.levels.iter().all(|&level| level > 0.0 && level.is_finite());
                demand(slips && !study.levels.is_empty(), "levels", "slips above 0")?;
                demand(study.samples >= 10, "samples", "10 or more")?;
                demand(study.slip_std >= 0.0, "slip_std", "0 or above")?;
                demand(study.force_std > 0.0, "force_std", "a positive number")?;
            }
            Self::SensitivityStudy(Sensitivity { spread, limit, count, .. }) => {
                demand(*spread > 0.0 && *spread < 1.0, "spread", "a share between 0 and 1")?;
                demand(*limit > 0.0 && limit.is_finite(), "limit", "a slip above 0")?;
                demand(*count >= 1, "count", "1 or more")?;
            }
        }
        Ok(config)
    }
}

fn demand(holds: bool, key: &str, expected: &str) -> Result<(), String> {
    if holds { Ok(()) } else { Err(format!("`{key}`: expected {expected}")) }
}

/// Whether these are two rising numbers.
fn rise(low: f64, high: f64) -> bool {
    low < high && low.is_finite() && high.is_finite()
}

fn rising(bounds: &BTreeMap<Parameter, [f64; 2]>) -> Result<(), String> {
    for (parameter, [low, high]) in bounds {
        if !rise(*low, *high) {
            let name = parameter.name();
            return Err(format!(
                "expected two rising numbers for the bounds of `{name}`, found {low} and {high}"
            ));
        }
    }
    Ok(())
}

/// What is known before any data: the usual prior in other bounds, with other typical values.
fn prior(
    usual: Prior,
    bounds: &BTreeMap<Parameter, [f64; 2]>,
    typical: &BTreeMap<Parameter, f64>,
) -> Prior {
    let mut within = usual.bounds;
    bounds.iter().for_each(|(&parameter, &range)| within.set(parameter, range));
    let mut prior = usual.within(within);
    for (&parameter, &value) in typical {
        prior.centre[parameter as usize] = value;
    }
    prior
}

fn check_svi(svi: &Optimiser) -> Result<(), String> {
    let Optimiser::Adam(Adam { step, steps, batch, .. }) = svi else { return Ok(()) };
    demand(*step > 0.0 && step.is_finite(), "step", "a number above 0")?;
    demand(*steps > 0, "steps", "1 or more")?;
    demand(*batch != Some(0), "batch", "1 or more")
}

/// `task = "tires"`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tires {
    /// From signals to points.
    #[serde(default)]
    pub prepare: Pipeline,
    /// How the lateral curves are identified.
    #[serde(default)]
    pub lateral: Curve,
    /// How the longitudinal curves are identified.
    #[serde(default)]
    pub longitudinal: Curve,
    /// How the values are found.
    #[serde(default = "methods")]
    pub methods: Vec<Method>,
    /// How the method `svi` raises its bound.
    #[serde(default)]
    pub svi: Optimiser,
    /// λ_sim: how strongly front and rear lateral curves are drawn to each other, in units of the standard deviations of parameters that
    /// are uniform within the bounds.
    #[serde(default)]
    pub axle_coupling: f64,
    /// The node whose start values `tires.toml` sets.
    #[serde(default = "plant")]
    pub node: String,
    /// Texts that the scenario hands over.
    #[serde(default)]
    pub files: Files,
    /// Of random numbers.
    #[serde(default)]
    pub seed: u64,
}

fn methods() -> Vec<Method> {
    vec![Method::LeastSquares, Method::NelderMead]
}

fn plant() -> String {
    "plant".to_owned()
}

impl Tires {
    fn check(&self) -> Result<(), String> {
        demand(!self.methods.is_empty(), "methods", "`least_squares` at least")?;
        let weight = self.axle_coupling;
        demand(weight >= 0.0 && weight.is_finite(), "axle_coupling", "0 or above")?;
        check_svi(&self.svi)?;
        self.prepare.check().map_err(|error| error.to_string())?;
        self.lateral.check("lateral")?;
        self.longitudinal.check("longitudinal")?;
        self.files.check(&["front", "rear", "front_x", "rear_x"])
    }
}

/// `task = "curve"`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OneCurve {
    /// Which force.
    pub direction: Direction,
    /// How the curve is identified.
    #[serde(default)]
    pub fit: Curve,
    /// Whether S_h and S_v are fitted too; they are 0 otherwise.
    #[serde(default)]
    pub shifts: bool,
    /// How the values are found.
    #[serde(default = "methods")]
    pub methods: Vec<Method>,
    /// Texts that the scenario hands over.
    #[serde(default)]
    pub files: Files,
    /// How the method `svi` raises its bound.
    #[serde(default)]
    pub svi: Optimiser,
    /// Of random numbers.
    #[serde(default)]
    pub seed: u64,
}

impl OneCurve {
    /// The shift that is known beforehand.
    pub fn shift(&self) -> Option<Shift> {
        (!self.shifts).then_some(Shift { S_h: 0.0, S_v: 0.0, K: f64::NAN, samples: 0 })
    }
}

/// What is known of a curve and how it is fitted.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Curve {
    /// Lowest and highest values; those of the literature unless given.
    pub bounds: BTreeMap<Parameter, [f64; 2]>,
    /// Typical values, which parameters are held at that the data cannot tell.
    pub typical: BTreeMap<Parameter, f64>,
    /// Whether they are held there.
    pub hold: Hold,
    /// Limits of the stiffness B C D.
    pub stiffness: Option<[f64; 2]>,
    /// Limits of the slip at the peak.
    pub peak_slip: Option<[f64; 2]>,
    /// How residuals count: what the noise is taken to be.
    pub loss: NoiseModel,
    /// Standard deviation of the noise of the slip.
    pub slip_std: Option<f64>,
    /// λ_reg: how strongly the fit is drawn to the typical values, in units of the standard deviations of parameters that are uniform within
    /// the bounds.
    pub regularisation: f64,
    /// Starts of the fit.
    pub starts: Option<usize>,
}

/// Whether parameters that the data cannot tell are held at their typical values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// Yes.
    #[default]
    NotIdentifiable,
    /// No: everything is fitted.
    Nothing,
}

impl Curve {
    fn check(&self, direction: &str) -> Result<(), String> {
        rising(&self.bounds).map_err(|error| format!("{direction}: {error}"))?;
        if !(self.regularisation >= 0.0 && self.regularisation.is_finite()) {
            let found = self.regularisation;
            return Err(format!("{direction}: `regularisation` is {found}, expected 0 or above"));
        }
        if !self.loss.is_valid() {
            return Err(format!("{direction}: `loss`: expected finite numbers above 0"));
        }
        if self.loss != NoiseModel::Square && self.slip_std.is_some() {
            return Err(format!(
                "{direction}: `slip_std` goes with normal noise only, not with this `loss`"
            ));
        }
        if self.starts == Some(0) {
            return Err(format!("{direction}: `starts` is 0, expected 1 or more"));
        }
        Ok(())
    }

    /// The settings for points whose shift was found beforehand, or is to be found with the rest; the noise is yet to be settled.
    pub fn settings(&self, direction: Direction, shift: Option<Shift>, seed: u64) -> Settings {
        let usual = Settings::new(direction);
        let mut prior = prior(usual.prior, &self.bounds, &self.typical);
        match shift {
            Some(Shift { S_h, S_v, .. }) => {
                prior.centre[Parameter::S_h as usize] = S_h;
                prior.centre[Parameter::S_v as usize] = S_v;
            }
            None => prior.free = [true; COUNT],
        }
        let regularisation = Regularisation::towards_typical(&prior, self.regularisation);
        Settings {
            prior,
            constraints: Constraints { stiffness: self.stiffness, peak_slip: self.peak_slip },
            regularisation,
            slip_noise: self.slip_std.map(SlipNoise::new),
            hold: self.hold == Hold::NotIdentifiable,
            options: FitOptions {
                starts: self.starts.unwrap_or(usual.options.starts),
                seed,
                ..usual.options
            },
            ..usual
        }
    }
}

/// `task = "sensitivity_study"`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensitivity {
    /// The tire.
    #[serde(deserialize_with = "from_parameters")]
    pub tire: Theta,
    /// Half the range of each parameter over its value.
    pub spread: f64,
    /// Largest slip.
    pub limit: f64,
    /// How many slips.
    pub count: usize,
}

impl Default for Sensitivity {
    /// Table II and Fig. 4 of the paper.
    fn default() -> Self {
        let tire = Excitation::default().truth;
        Self { tire, spread: 0.1, limit: 1.0, count: 100 }
    }
}
