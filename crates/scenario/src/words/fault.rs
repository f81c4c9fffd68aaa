//! The words of `[[fault]]`.

use diagnostics::Spanned;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::fault::{Bias, FaultAction, FaultWords, Freeze, Gain, Value, for_each_fault};

macro_rules! fault {
    ($($key:ident: $words:ty,)*) => {
        /// A fault of a connected input, of one kind.
        ///
        /// ```toml
        /// [[fault]]
        /// input = "estimator.a_y"
        /// from = 2.0
        /// until = 3.0
        /// freeze = true
        /// ```
        #[derive(Debug, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct Fault {
            /// Input, `node.variable`.
            #[schemars(example = &"estimator.a_y")]
            pub input: Spanned<String>,
            /// Beginning of the fault [s].
            #[schemars(example = 2.0)]
            pub from: f64,
            /// End of the fault [s]; the end of the run without it.
            #[schemars(example = 3.0)]
            pub until: Option<f64>,
            $(
                #[allow(missing_docs, reason = "the words of the fault are documented with their type")]
                pub $key: Option<$words>,
            )*
        }

        impl Fault {
            /// The keys of all kinds.
            pub const KINDS: &[&str] = &[$(stringify!($key)),*];

            /// The actions of the given kinds.
            #[must_use]
            pub fn actions(&self) -> Vec<Box<dyn FaultAction>> {
                [$(self.$key.and_then(|words| words.action())),*].into_iter().flatten().collect()
            }
        }
    };
}
for_each_fault!(fault);
