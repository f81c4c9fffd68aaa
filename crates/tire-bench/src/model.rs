//! Evaluates a tire with temperature terms at the points of a bench.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use tire::{Coefficients, MfTire, Number, Tire, TireOperatingPoint};

use crate::condition::RevolutionMean;

/// What is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FittedChannel {
    /// F_x.
    Longitudinal,
    /// F_y.
    Lateral,
    /// M_z.
    Aligning,
}

impl FittedChannel {
    /// Its measured value at a point [N, N m].
    pub fn measured_value(self, point: &RevolutionMean) -> f64 {
        match self {
            Self::Longitudinal => point.sample.F_x,
            Self::Lateral => point.sample.F_y,
            Self::Aligning => point.sample.M_z,
        }
    }
}

/// What a term changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TermEffect {
    /// ln of the factor to the friction, over a feature.
    Friction(TermFeature),
    /// ln of the factor to the slip stiffness, over a feature.
    Stiffness(TermFeature),
    /// Lag of the force behind the slip [s].
    Lag,
    /// Relative growth of the slip angle with the slip ratio.
    Weight,
    /// ln of the factor to the slip ratio in F_y, over a feature.
    SlipRatio(TermFeature),
}

/// What a term depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TermFeature {
    Tread,
    Carcass,
    LoadSquare,
    Pressure,
    Camber,
    CamberLoad,
    Run,
    Time,
}

/// A term beyond the Magic Formula 6.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtensionTerm {
    /// Its key in the section `[BENCH_TERMS]` of a file.
    pub name: &'static str,
    /// The force that it changes.
    pub channel: FittedChannel,
    /// What it is.
    pub doc: &'static str,
    /// Standard deviation of its prior, whose mean is 0.
    pub std: f64,
    /// Whether it is beyond temperature and lag, which every fit has.
    pub extended: bool,
    pub(crate) effect: TermEffect,
}

macro_rules! terms {
    ($($name:literal $channel:ident $effect:expr, $std:literal, $extended:literal, $doc:literal;)+) => {
        /// All terms.
        pub const TERMS: &[ExtensionTerm] = &[$(ExtensionTerm {
            name: $name, channel: FittedChannel::$channel, effect: $effect, std: $std, extended: $extended, doc: $doc,
        },)+];
    };
}

use TermEffect::{Friction, Lag, SlipRatio, Stiffness, Weight};
use TermFeature::{Camber, CamberLoad, Carcass, LoadSquare, Pressure, Run, Time, Tread};

terms! {
    "TDX1" Longitudinal Friction(Tread), 0.1, false, "ln D_x over 10 K of the tread";
    "TKX1" Longitudinal Stiffness(Tread), 0.2, false, "ln K_x over 10 K of the tread";
    "TDX2" Longitudinal Friction(Carcass), 0.1, false, "ln D_x over 10 K of the carcass";
    "TKX2" Longitudinal Stiffness(Carcass), 0.2, false, "ln K_x over 10 K of the carcass";
    "TLX1" Longitudinal Lag, 0.02, false, "lag of F_x [s]";
    "EDX1" Longitudinal Friction(LoadSquare), 0.2, true, "ln D_x over dfz^2";
    "EKX1" Longitudinal Stiffness(LoadSquare), 0.3, true, "ln K_x over dfz^2";
    "EDX2" Longitudinal Friction(Camber), 1.0, true, "ln D_x over |camber|";
    "EKX2" Longitudinal Stiffness(Camber), 2.0, true, "ln K_x over |camber|";
    "EDX3" Longitudinal Friction(CamberLoad), 1.0, true, "ln D_x over dfz |camber|";
    "EKX3" Longitudinal Stiffness(CamberLoad), 2.0, true, "ln K_x over dfz |camber|";
    "EDX4" Longitudinal Friction(Time), 0.05, true, "ln D_x over 1000 s of a run";
    "EKX4" Longitudinal Stiffness(Time), 0.1, true, "ln K_x over 1000 s of a run";
    "EWX1" Longitudinal Weight, 1.0, true, "growth of the slip angle in F_x with slip ratio";
    "TDY1" Lateral Friction(Tread), 0.1, false, "ln D_y over 10 K of the tread";
    "TKY1" Lateral Stiffness(Tread), 0.2, false, "ln K_y over 10 K of the tread";
    "TDY2" Lateral Friction(Carcass), 0.1, false, "ln D_y over 10 K of the carcass";
    "TKY2" Lateral Stiffness(Carcass), 0.2, false, "ln K_y over 10 K of the carcass";
    "TLY1" Lateral Lag, 0.02, false, "lag of F_y [s]";
    "TDY3" Lateral Friction(Run), 0.05, false, "ln D_y of later runs";
    "TKY3" Lateral Stiffness(Run), 0.1, false, "ln K_y of later runs";
    "EDY1" Lateral Friction(LoadSquare), 0.2, true, "ln D_y over dfz^2";
    "EKY1" Lateral Stiffness(LoadSquare), 0.3, true, "ln K_y over dfz^2";
    "EDY2" Lateral Friction(Camber), 1.0, true, "ln D_y over |camber|";
    "EKY2" Lateral Stiffness(Camber), 2.0, true, "ln K_y over |camber|";
    "EDY3" Lateral Friction(CamberLoad), 1.0, true, "ln D_y over dfz |camber|";
    "EKY3" Lateral Stiffness(CamberLoad), 2.0, true, "ln K_y over dfz |camber|";
    "EDY4" Lateral Friction(Time), 0.05, true, "ln D_y over 1000 s of a run";
    "EKY4" Lateral Stiffness(Time), 0.1, true, "ln K_y over 1000 s of a run";
    "EWY1" Lateral Weight, 1.0, true, "growth of the slip angle in F_y with slip ratio";
    "EAY1" Lateral SlipRatio(Camber), 3.0, true, "ln of the slip ratio in F_y over |camber|";
    "EAY2" Lateral SlipRatio(Pressure), 0.5, true, "ln of the slip ratio in F_y over dpi";
}

/// How many terms there are.
pub(crate) const COUNT: usize = TERMS.len();

/// A tire with terms.
#[derive(Clone, Copy)]
pub(crate) struct ExtendedTireModel<T> {
    pub tire: MfTire<T>,
    pub terms: [T; COUNT],
    /// Where the terms of temperature are 0 [K].
    pub reference: f64,
}

impl<T: Number> ExtendedTireModel<T> {
    /// A force or moment at a point [N, N m].
    pub fn channel_value(&self, channel: FittedChannel, point: &RevolutionMean) -> T {
        let s = &point.sample;
        let nominal = self.tire.coefficients().FNOMIN.re();
        let dfz = s.F_z / nominal - 1.0;
        let dpi = s.pressure / self.tire.coefficients().NOMPRES.re() - 1.0;
        // The moment takes the lateral force along.
        let across = |it: FittedChannel| {
            it == channel || (channel == FittedChannel::Aligning && it == FittedChannel::Lateral)
        };
        let at = |feature: TermFeature| feature.feature_value(point, [dfz, dpi], self.reference);
        let zero = T::from(0.0);
        let (mut friction, mut stiffness) = ([zero; 2], [zero; 2]);
        let (mut kappa, mut alpha) = (T::from(s.kappa), T::from(s.alpha));
        for (term, c) in TERMS.iter().zip(self.terms) {
            let side = usize::from(term.channel == FittedChannel::Lateral);
            match term.effect {
                TermEffect::Friction(feature) => friction[side] += c * at(feature),
                TermEffect::Stiffness(feature) => stiffness[side] += c * at(feature),
                TermEffect::Lag if across(term.channel) => {
                    kappa -= c * if side == 0 { point.rate[0] } else { 0.0 };
                    alpha -= c * if side == 1 { point.rate[1] } else { 0.0 };
                }
                TermEffect::Weight if across(term.channel) => alpha *= c * s.kappa + 1.0,
                TermEffect::SlipRatio(feature) if across(term.channel) => {
                    kappa *= (c * at(feature)).exp();
                }
                TermEffect::Lag | TermEffect::Weight | TermEffect::SlipRatio(_) => {}
            }
        }
        let factors = [friction[0].exp(), friction[1].exp(), stiffness[0].exp(), stiffness[1].exp()];
        let slip = TireOperatingPoint {
            kappa,
            alpha,
            gamma: T::from(s.gamma),
            F_z: T::from(s.F_z),
            v_x: T::from(s.v_x),
            pressure: Some(T::from(s.pressure)),
            mu: T::from(1.0),
        };
        let tire = self.tire.with_scale_factors(factors);
        match channel {
            FittedChannel::Longitudinal => tire.F_xy(&slip)[0],
            FittedChannel::Lateral => tire.F_xy(&slip)[1],
            FittedChannel::Aligning => tire.F_xy_M_z(&slip)[2],
        }
    }
}

impl TermFeature {
    fn feature_value(self, point: &RevolutionMean, [dfz, dpi]: [f64; 2], reference: f64) -> f64 {
        // What was not measured has no effect.
        let warmer = |it: f64| if it.is_finite() { (it - reference) / 10.0 } else { 0.0 };
        let gamma = point.sample.gamma.abs();
        match self {
            Self::Tread => warmer(point.sample.temperature),
            Self::Carcass => warmer(point.carcass),
            Self::LoadSquare => dfz * dfz,
            Self::Pressure => dpi,
            Self::Camber => gamma,
            Self::CamberLoad => dfz * gamma,
            Self::Time => point.elapsed / 1000.0,
            Self::Run => {
                if point.sample.run > 0 {
                    1.0
                } else {
                    0.0
                }
            }
        }
    }
}

/// A model of plain numbers; `None` where the coefficients are of no tire.
pub(crate) fn plain_tire_model(
    coefficients: &Coefficients,
    terms: [f64; COUNT],
    reference: f64,
) -> Option<ExtendedTireModel<f64>> {
    MfTire::new(*coefficients).ok().map(|tire| ExtendedTireModel { tire, terms, reference })
}
