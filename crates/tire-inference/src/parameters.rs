//! Names the parameters of a tire, and reads and writes their values.
#![allow(non_snake_case, non_camel_case_types, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use schemars::JsonSchema;
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, JsonSchema)]
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
    pub fn symbol(self) -> &'static str {
        ["B", "C", "D", "E", "S_h", "S_v"][self as usize]
    }
}

/// As a text: a path of keys has the names of texts only.
impl<'de> Deserialize<'de> for Parameter {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let name = String::deserialize(from)?;
        let found = Self::ALL.into_iter().find(|parameter| parameter.symbol() == name);
        found.ok_or_else(|| {
            let known = Self::ALL.map(|parameter| format!("`{}`", parameter.symbol())).join(", ");
            D::Error::custom(format!("unknown parameter `{name}`, expected one of {known}"))
        })
    }
}

/// The curve with these parameters.
pub fn magic_formula_from_theta(theta: &Theta) -> MagicFormula {
    let [B, C, D, E, S_h, S_v] = *theta;
    MagicFormula { B, C, D, E, S_h, S_v }
}

/// The parameters of a curve.
pub fn theta_from_magic_formula(curve: &MagicFormula) -> Theta {
    let MagicFormula { B, C, D, E, S_h, S_v } = *curve;
    [B, C, D, E, S_h, S_v]
}

/// Writes values under the names of their parameters; fewer than all are the first ones.
///
/// # Errors
/// Those of the format.
pub fn by_parameter<S: Serializer, const N: usize>(values: &[f64; N], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(Parameter::ALL.iter().map(|parameter| parameter.symbol()).zip(values))
}

/// Parameters of a tire as a configuration has them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tire {
    /// Stiffness factor [1/rad], or [-] for a slip ratio.
    B: f64,
    /// Shape factor [-].
    C: f64,
    /// Peak friction coefficient [-].
    D: f64,
    /// Curvature factor [-].
    E: f64,
    /// Horizontal shift, in the unit of the slip.
    #[serde(default)]
    S_h: f64,
    /// Vertical shift of the friction coefficient [-].
    #[serde(default)]
    S_v: f64,
}

impl From<Tire> for Theta {
    fn from(Tire { B, C, D, E, S_h, S_v }: Tire) -> Self {
        [B, C, D, E, S_h, S_v]
    }
}

impl From<Theta> for Tire {
    fn from([B, C, D, E, S_h, S_v]: Theta) -> Self {
        Self { B, C, D, E, S_h, S_v }
    }
}

/// Reads values from under the names of their parameters; a shift that is not there is 0.
///
/// # Errors
/// When B, C, D or E is missing, and those of the format.
pub fn from_parameters<'de, D: Deserializer<'de>>(from: D) -> Result<Theta, D::Error> {
    Tire::deserialize(from).map(Theta::from)
}

/// B, C, D and E of a tire without shifts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TireParameters<T = f64> {
    /// Stiffness factor [1/rad].
    pub B: T,
    /// Shape factor [-].
    pub C: T,
    /// Peak friction coefficient [-].
    pub D: T,
    /// Curvature factor [-].
    pub E: T,
}

impl<T> TireParameters<T> {
    /// Which ones these are.
    pub const PARAMETERS: [Parameter; 4] = [Parameter::B, Parameter::C, Parameter::D, Parameter::E];

    /// In the order of [`Parameter`].
    pub fn into_array(self) -> [T; 4] {
        [self.B, self.C, self.D, self.E]
    }
}

impl<T> From<[T; 4]> for TireParameters<T> {
    fn from([B, C, D, E]: [T; 4]) -> Self {
        Self { B, C, D, E }
    }
}

impl TireParameters {
    /// With shifts of 0.
    pub fn to_theta(&self) -> Theta {
        [self.B, self.C, self.D, self.E, 0.0, 0.0]
    }

    /// The curve with these parameters.
    pub fn to_magic_formula(&self) -> MagicFormula {
        magic_formula_from_theta(&self.to_theta())
    }

    /// Stiffness per unit of load, B C D [1/rad].
    pub fn stiffness(&self) -> f64 {
        self.B * self.C * self.D
    }
}
