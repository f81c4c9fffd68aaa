//! The keys of `[[fault]]`, a fault that is injected into an input or into the calls of an FMU.

use std::ops::Range;

use cosim::fault::{FaultAction, FaultKind};
use cosim::for_each_fault;
use cosim::quantity::InputUnit;
use diagnostics::Spanned;
use schemars::JsonSchema;
use serde::Deserialize;

macro_rules! fault {
    ($($key:ident: $words:ty,)*) => {
        /// A fault of a connected input, or of the calls of an FMU; of one kind.
        ///
        /// ```toml
        /// [[fault]]
        /// input = "estimator.a_y"
        /// from = 2.0
        /// until = 3.0
        /// freeze = true
        ///
        /// [[fault]]
        /// node = "estimator"
        /// from = 4.0
        /// crash = true
        /// ```
        #[derive(Debug, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct Fault {
            /// Input, `node.variable`, whose value the fault changes.
            #[schemars(example = &"estimator.a_y")]
            pub input: Option<Spanned<String>>,
            /// FMU whose calls fail, instead of an input.
            #[schemars(example = &"estimator")]
            pub node: Option<Spanned<String>>,
            /// Beginning of the fault [s]: the steps that begin there or later have it.
            #[schemars(example = 2.0)]
            pub from: Spanned<f64>,
            /// End of the fault [s]; the end of the run without it.
            #[schemars(example = 3.0)]
            pub until: Option<f64>,
            /// Of a node: the share of its steps that have the fault, from 0 to 1; all of them without it. Which ones follows from the
            /// `seed`, the name of the node and the kind of the fault.
            #[schemars(example = 0.1)]
            pub probability: Option<Spanned<f64>>,
            /// Of a node: a communication step is refused, as by an FMU that returns `fmi2Discard`. Shorter steps are done.
            #[schemars(example = true)]
            pub discard: Option<bool>,
            /// Of a node: a step lasts longer by this time [s] by the clock.
            #[schemars(example = 0.02)]
            pub late: Option<Spanned<f64>>,
            /// Of a node: these of its outputs are NaN after a step. `*` stands for any letters.
            #[schemars(example = &["v_x", "std.*"])]
            pub nan: Option<Spanned<Vec<String>>>,
            /// Of a node: it fails as if it crashed. The process of an isolated FMU really ends.
            #[schemars(example = true)]
            pub crash: Option<bool>,
            $(
                #[allow(missing_docs, reason = "the words of the fault are documented with their type")]
                pub $key: Option<Spanned<$words>>,
            )*
        }

        impl Fault {
            /// The keys of all kinds for a node.
            pub const OF_NODES: &[&str] = &["discard", "late", "nan", "crash"];

            /// The keys of all kinds for an input.
            pub const KINDS: &[&str] = &[$(stringify!($key)),*];

            /// The actions of the given kinds on an input with this unit.
            ///
            /// # Errors
            /// The place of a number whose own unit does not fit, and a message.
            pub fn actions(
                &self,
                input: InputUnit,
            ) -> Result<Vec<Box<dyn FaultAction>>, (Range<usize>, String)> {
                let actions = [$(self.$key.as_ref().map(|words| {
                    words.get_ref().build_action(input).map_err(|message| (words.span(), message))
                })),*];
                let given = actions.into_iter().flatten();
                Ok(given.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
            }
        }
    };
}
for_each_fault!(fault);
