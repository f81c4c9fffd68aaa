//! Reads what a scenario wants of an identification from drives under closed-loop control.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::collections::{BTreeMap, BTreeSet};

use drive_inference::likelihood::DriveNoise;
use drive_inference::regression::Weights;
use drive_inference::smoothing::Smoothing;
use drive_inference::{DriveOptions, Formulation, Noises};
use serde::Deserialize;
use tire_inference::parameters::Parameter;
use tire_inference::prior::Prior;
use vehicle::{Aero, Body, Vehicle};

use crate::config::{demand, plant, prior, rise, rising};

/// `task = "closed_loop"`.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClosedLoop {
    /// Masses and lengths; those of the demo car unless given.
    pub body: Body,
    /// Drag and downforce.
    pub aero: Aero,
    /// What the tires are found by.
    pub method: Formulation,
    /// What else is fitted, to compare.
    pub compare: Vec<Formulation>,
    /// Lowest and highest values of B, C, D, E of both axles.
    pub bounds: BTreeMap<Parameter, [f64; 2]>,
    /// θ_0: values of a typical tire; those of a lateral curve unless given.
    pub typical: BTreeMap<Parameter, f64>,
    /// λ_reg: how strongly each tire is drawn to the typical values, in units of the standard deviations of parameters that are uniform
    /// within the bounds.
    pub regularisation: f64,
    /// λ_sim: how strongly both tires are drawn to each other, in the same units.
    pub axle_coupling: f64,
    /// How residuals of fits to smoothed states count.
    pub weights: Weights,
    /// Whether fits to accelerations have three odd terms besides the tires.
    pub odd_terms: bool,
    /// Starts of fits to smoothed states.
    pub starts: usize,
    /// Noises, if they are known; they are estimated otherwise.
    pub noise: Option<KnownNoise>,
    /// How often EM may filter a recording to find the noises of the nominal car that smooths it; 0 does without.
    pub em_passes: usize,
    /// Whether uncertainties come from draws of the posterior of `method = "pem"`, which take about as long as the fit; else from the
    /// curvature of the likelihood.
    pub posterior: bool,
    /// Whether a normal distribution is fitted to the posterior by variational inference, and told with its k-hat beside the draws.
    pub svi: bool,
    /// Whether intervals come from profiles of the likelihood, which takes longer than the fit; else from its curvature.
    pub profile: bool,
    /// Times that are used [s], from and until; all of them unless given.
    pub windows: Vec<[f64; 2]>,
    /// Times that are not used, and on which the identified car has to predict what was measured.
    pub validate: Vec<HoldOut>,
    /// The node whose start values `tires.toml` sets.
    pub node: String,
    /// Turns the starts.
    pub seed: u64,
}

/// Times that are kept for validation.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HoldOut {
    /// Its name in the report.
    pub name: String,
    /// First time [s].
    pub from: f64,
    /// Last time [s].
    pub until: f64,
}

/// Standard deviations of noises that are known.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownNoise {
    /// Of the measured forward speed [m/s].
    v_x: f64,
    /// Of the measured speed to the left [m/s].
    v_y: f64,
    /// Of the measured yaw rate [rad/s].
    r: f64,
    /// Of the measured lateral acceleration [m/s²].
    a_y: f64,
    /// Of what the motion does besides the model; hardly anything unless given.
    process: Option<KnownProcess>,
}

/// Standard deviations of the random walks that states do besides the model, after one second.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownProcess {
    /// Of the forward speed [m/s].
    v_x: f64,
    /// Of the speed to the left [m/s].
    v_y: f64,
    /// Of the yaw rate [rad/s].
    r: f64,
    /// Of the longitudinal force that the inputs do not know [N].
    xi_x: f64,
}

impl Default for ClosedLoop {
    fn default() -> Self {
        let usual = DriveOptions::default();
        Self {
            body: Body::default(),
            aero: Aero::default(),
            method: usual.method,
            compare: usual.compare,
            bounds: BTreeMap::new(),
            typical: BTreeMap::new(),
            regularisation: usual.regularisation,
            axle_coupling: usual.axle_coupling,
            weights: usual.weights,
            odd_terms: usual.odd_terms,
            starts: usual.starts,
            noise: None,
            em_passes: usual.smoothing.em_passes,
            posterior: usual.posterior,
            svi: usual.svi,
            profile: usual.profile,
            windows: Vec::new(),
            validate: Vec::new(),
            node: plant(),
            seed: usual.seed,
        }
    }
}

impl ClosedLoop {
    /// Whether it makes sense.
    ///
    /// # Errors
    /// In words, with the key in backticks.
    pub(super) fn check(&self) -> Result<(), String> {
        let Body { m, I_zz, l_f, l_r, h } = self.body;
        for (name, value) in [("m", m), ("I_zz", I_zz), ("l_f", l_f), ("l_r", l_r)] {
            demand(value > 0.0 && value.is_finite(), name, "a positive number")?;
        }
        demand(h >= 0.0 && h.is_finite(), "h", "0 or above")?;
        let weight = |weight: f64| weight >= 0.0 && weight.is_finite();
        demand(weight(self.regularisation), "regularisation", "0 or above")?;
        demand(weight(self.axle_coupling), "axle_coupling", "0 or above")?;
        if let Weights::Variance { clamp } = self.weights {
            demand(
                clamp > 0.0 && clamp.is_finite(),
                "clamp",
                "a positive share of the mean variance",
            )?;
        }
        demand(self.starts >= 1, "starts", "1 or more")?;
        let pem = self.method == Formulation::PredictionError;
        demand(
            pem || !self.profile,
            "profile",
            "false, as only method = \"pem\" has a likelihood",
        )?;
        demand(
            pem && self.posterior || !self.svi,
            "svi",
            "false, as it is fitted to the posterior of method = \"pem\" alone",
        )?;
        self.check_tires()?;
        self.check_noise()?;
        self.check_times()
    }

    fn check_tires(&self) -> Result<(), String> {
        let shift = [Parameter::S_h, Parameter::S_v];
        for parameter in self.bounds.keys().chain(self.typical.keys()) {
            let name = parameter.name();
            if shift.contains(parameter) {
                return Err(format!("`{name}` is not fitted to drives; expected B, C, D or E"));
            }
        }
        rising(&self.bounds)?;
        for (parameter, [low, _]) in &self.bounds {
            let positive = *parameter == Parameter::E || *low > 0.0;
            demand(positive, parameter.name(), "bounds above 0")?;
        }
        for (parameter, value) in &self.typical {
            demand(value.is_finite(), parameter.name(), "a finite typical value")?;
        }
        Ok(())
    }

    fn check_noise(&self) -> Result<(), String> {
        let Some(KnownNoise { v_x, v_y, r, a_y, process }) = self.noise else { return Ok(()) };
        for (name, std) in [("v_x", v_x), ("v_y", v_y), ("r", r), ("a_y", a_y)] {
            let expected = "a positive standard deviation of its noise";
            demand(std > 0.0 && std.is_finite(), name, expected)?;
        }
        let Some(KnownProcess { v_x, v_y, r, xi_x }) = process else { return Ok(()) };
        for (name, std) in [("v_x", v_x), ("v_y", v_y), ("r", r), ("xi_x", xi_x)] {
            demand(std >= 0.0 && std.is_finite(), name, "a standard deviation of 0 or more")?;
        }
        Ok(())
    }

    fn check_times(&self) -> Result<(), String> {
        for [from, until] in &self.windows {
            if !rise(*from, *until) {
                return Err(format!(
                    "`windows`: expected two rising times, found {from} and {until}"
                ));
            }
        }
        let mut names = BTreeSet::new();
        for HoldOut { name, from, until } in &self.validate {
            if !rise(*from, *until) {
                return Err(format!("`{name}`: expected until after from = {from}, found {until}"));
            }
            if !names.insert(name) {
                return Err(format!(
                    "`{name}`: expected a name of its own for each time of validation, found it twice"
                ));
            }
        }
        Ok(())
    }

    /// What the library is asked for.
    pub fn options(&self) -> DriveOptions {
        DriveOptions {
            car: Vehicle { body: self.body, aero: self.aero, ..Vehicle::default() },
            method: self.method,
            compare: self.compare.clone(),
            prior: prior(Prior::lateral(), &self.bounds, &self.typical),
            regularisation: self.regularisation,
            axle_coupling: self.axle_coupling,
            weights: self.weights,
            odd_terms: self.odd_terms,
            starts: self.starts,
            seed: self.seed,
            noises: self.noise.map_or(Noises::Estimated, |noise| Noises::Known(noise.all())),
            smoothing: Smoothing { em_passes: self.em_passes },
            posterior: self.posterior,
            svi: self.svi,
            profile: self.profile,
        }
    }
}

impl KnownNoise {
    fn all(self) -> DriveNoise {
        let Self { v_x, v_y, r, a_y, process } = self;
        let noise = DriveNoise::of_sensors([v_x, v_y, r, a_y]);
        match process {
            Some(KnownProcess { v_x, v_y, r, xi_x }) => {
                DriveNoise { process: [v_x, v_y, r, xi_x], ..noise }
            }
            None => noise,
        }
    }
}
