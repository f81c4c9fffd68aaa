//! The keys of `[[connect]]`, a connection from an output to an input.

use std::ops::Range;

use cosim::clock::StepBoundary;
use cosim::effect::SensorEffect;
use cosim::extrapolation::ExtrapolationOrder;
use cosim::for_each_effect;
use diagnostics::Spanned;
use schemars::JsonSchema;
use serde::Deserialize;

macro_rules! connect {
    ($($key:ident: $words:ty,)*) => {
        /// A connection from an output to an input. Units are converted; types only with `convert`. Sensor effects act in the
        /// order delay, gain, bias, noise, quantise, hold, dropout.
        ///
        /// ```toml
        /// [[connect]]
        /// from = "plant.a_y"
        /// to = "estimator.a_y"
        /// noise = { std = 0.1 }
        /// delay = 0.015
        /// ```
        #[derive(Debug, Clone, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct Connect {
            /// Output, `node.variable`; an array as a whole, or an element such as `node.y[2]`. Or a terminal, `node.terminal`.
            #[schemars(example = &"plant.a_y")]
            pub from: Spanned<String>,
            /// Input, `node.variable`; an array as a whole, or an element such as `node.u[1,2]`. Or a terminal: its members are
            /// connected to those of the other terminal, in the direction that each has. An input with a connection of its own keeps
            /// that one.
            #[schemars(example = &"estimator.a_y")]
            pub to: Spanned<String>,
            /// End of the step at which the value is taken. Without it, the algorithm decides: with `gauss_seidel` the end for
            /// FMUs and the start for signals and tables.
            #[schemars(example = &"start")]
            pub at: Option<Spanned<StepBoundary>>,
            /// Course of a continuous input within a step. Without a word it holds its value, and with the coupling `iterate` it goes
            /// evenly to the value at the end.
            #[schemars(with = "Option<ExtrapolationOrder>", example = &"linear")]
            pub extrapolate: Option<Spanned<ExtrapolationOrder>>,
            /// Unit of the end that has none, or one that cannot be read. Only one end may lack its unit.
            #[schemars(example = &"km/h")]
            pub unit: Option<Spanned<String>>,
            /// What becomes of the number, in place of a conversion of units.
            pub transform: Option<Spanned<Transform>>,
            /// Type conversion. Type conversions are explicit.
            #[schemars(example = &"boolean_to_integer")]
            pub convert: Option<Spanned<Convert>>,
            $(
                #[allow(missing_docs, reason = "the words of the effect are documented with their type")]
                pub $key: Option<Spanned<$words>>,
            )*
            /// Whether the input is the negative of the output: flows of two terminals, whose sum is 0.
            #[serde(skip)]
            #[schemars(skip)]
            pub inverted: bool,
        }

        impl Connect {
            /// The keys of all sensor effects.
            pub const EFFECTS: &[&str] = &[$(stringify!($key)),*];

            /// A connection with nothing on its way.
            #[must_use]
            pub fn plain(from: Spanned<String>, to: Spanned<String>) -> Self {
                Connect {
                    from,
                    to,
                    at: None,
                    extrapolate: None,
                    unit: None,
                    transform: None,
                    convert: None,
                    $($key: None,)*
                    inverted: false,
                }
            }

            /// The sensor effects of the connection: key, place and words.
            #[must_use]
            pub fn effects(&self) -> Vec<(&'static str, Range<usize>, &dyn SensorEffect)> {
                let mut effects: Vec<(_, _, &dyn SensorEffect)> = Vec::new();
                $(effects.extend(
                    self.$key.as_ref().map(|it| (stringify!($key), it.span(), it.get_ref() as _)),
                );)*
                effects
            }
        }
    };
}
for_each_effect!(connect);

/// What becomes of a number in place of a conversion of units, from the first step and in the initialisation: `factor * value +
/// offset`, then the other number of a pair of `map`.
///
/// ```toml
/// [[connect]]
/// from = "sensor.counts"
/// to = "controller.pressure"
/// transform = { factor = 12.5, offset = -100.0 }
/// ```
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Transform {
    /// Factor [unit of the input / unit of the output].
    #[serde(default = "one")]
    #[schemars(example = 12.5)]
    pub factor: f64,
    /// Added after that, in the unit of the input.
    #[serde(default)]
    #[schemars(example = -100.0)]
    pub offset: f64,
    /// Numbers that become others, each with the one that it becomes. All others stay. Boolean values are 0 and 1.
    #[serde(default)]
    #[schemars(example = [[0.0, 1.0], [1.0, 0.0]])]
    pub map: Vec<[f64; 2]>,
}

fn one() -> f64 {
    1.0
}

/// A change of type on a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Convert {
    /// False is 0, true is 1.
    BooleanToInteger,
    /// 0 is false, 1 is true, any other value ends the run.
    IntegerToBoolean,
    /// The value of the item.
    EnumerationToInteger,
    /// The item with this value; a value without an item ends the run.
    IntegerToEnumeration,
    /// The same number, which a Real holds exactly.
    IntegerToReal,
}
