//! Names the parameters of a tire, and holds what is known of them before any data: bounds and a prior.
#![allow(
    non_snake_case,
    non_camel_case_types,
    reason = "symbols as in Pacejka, Tire and Vehicle Dynamics"
)]

use std::collections::BTreeMap;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use vehicle::MagicFormula;

/// How many parameters a curve has.
pub const COUNT: usize = 6;

/// A value for each parameter, in the order of [`Parameter`].
pub type Theta = [f64; COUNT];

/// A normal distribution of the parameters, such as what is known of them from elsewhere.
pub type Normal = numerics::normal::Normal<COUNT>;

/// A parameter of the Magic Formula, μ = D sin(C atan(Bx − E(Bx − atan Bx))) + S_v with x = slip + S_h.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Parameter {
    /// Stiffness factor [1/rad], or [-] for a slip ratio.
    B,
    /// Shape factor [-].
    C,
    /// Peak friction coefficient [-].
    D,
    /// Curvature factor [-].
    E,
    /// Horizontal shift, in the unit of the slip.
    S_h,
    /// Vertical shift of the friction coefficient [-].
    S_v,
}

impl Parameter {
    /// All of them, in the order of [`Theta`].
    pub const ALL: [Self; COUNT] = [Self::B, Self::C, Self::D, Self::E, Self::S_h, Self::S_v];

    /// The symbol.
    pub fn name(self) -> &'static str {
        ["B", "C", "D", "E", "S_h", "S_v"][self as usize]
    }
}

/// The curve with these parameters.
pub fn curve(theta: &Theta) -> MagicFormula {
    let [B, C, D, E, S_h, S_v] = *theta;
    MagicFormula { B, C, D, E, S_h, S_v }
}

/// The parameters of a curve.
pub fn theta(curve: &MagicFormula) -> Theta {
    let MagicFormula { B, C, D, E, S_h, S_v } = *curve;
    [B, C, D, E, S_h, S_v]
}

/// Writes values under the names of their parameters; fewer than all are the first ones.
///
/// # Errors
/// Those of the format.
pub fn by_parameter<S: Serializer, const N: usize>(
    values: &[f64; N],
    to: S,
) -> Result<S::Ok, S::Error> {
    to.collect_map(Parameter::ALL.iter().map(|parameter| parameter.name()).zip(values))
}

/// Reads values from under the names of their parameters; a shift that is not there is 0.
///
/// # Errors
/// When B, C, D or E is missing, and those of the format.
pub fn from_parameters<'de, D: Deserializer<'de>>(from: D) -> Result<Theta, D::Error> {
    let named = BTreeMap::<Parameter, f64>::deserialize(from)?;
    let mut theta = [0.0; COUNT];
    for (parameter, value) in theta.iter_mut().zip(Parameter::ALL).map(|(v, p)| (p, v)) {
        match named.get(&parameter) {
            Some(found) => *value = *found,
            None if parameter < Parameter::S_h => {
                let name = parameter.name();
                return Err(D::Error::custom(format!(
                    "expected a tire with B, C, D and E, found no `{name}`"
                )));
            }
            None => {}
        }
    }
    Ok(theta)
}

/// The box that every parameter stays in, borders included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest values.
    pub lower: Theta,
    /// Highest values.
    pub upper: Theta,
}

impl Default for Bounds {
    /// Table I of Goblirsch et al., "Bayesian Optimization-based Tire Parameter and Uncertainty Estimation for Real-World
    /// Data", IV 2025; the shifts, which it does not bound, ours.
    fn default() -> Self {
        Self { lower: [5.0, 1.0, 0.1, -1.0, -0.02, -0.1], upper: [40.0, 3.0, 2.0, 1.0, 0.02, 0.1] }
    }
}
