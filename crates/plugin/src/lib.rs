//! Lets the program call analyses that it was not built with: borrowed columns in, text out, over one exported symbol.
//!
//! A plugin is a `cdylib` with an [`Analysis`]:
//!
//! ```
//! use plugin::{Analysis, Host, Need, Request};
//!
//! struct Mean;
//!
//! impl Analysis for Mean {
//!     const NEEDS: &'static [Need] = &[Need::required("x", "", "what is averaged")];
//!
//!     fn run(request: &Request, _host: &mut dyn Host) -> Result<String, String> {
//!         let x = request.signal("x").ok_or("expected a signal `x`")?.values;
//!         Ok(format!(r#"{{"mean": {}}}"#, x.iter().sum::<f64>() / x.len() as f64))
//!     }
//! }
//!
//! plugin::export!(Mean);
//! # let x = plugin::Signal { name: "x", unit: "", time: &[0.0, 1.0], values: &[1.0, 3.0] };
//! # let request = Request { config: "", signals: vec![x] };
//! # assert_eq!(Mean::run(&request, &mut plugin::Silent), Ok(r#"{"mean": 2}"#.to_owned()));
//! ```
//!
//! Across the boundary go C structures only ([`abi`]), so program and plugin need not be built by the same compiler; both
//! state [`abi::VERSION`] and nothing is called when they differ. Slices are borrowed for the duration of a call and results
//! leave through callbacks, so nobody frees the other side's memory. A panic of a plugin ends its call, not the program.

pub mod abi;
mod diagram;
mod export;
#[cfg(feature = "load")]
mod load;

pub use diagram::{Diagram, Layer, Role, Shape};
#[doc(hidden)]
pub use export::vtable;
#[cfg(feature = "load")]
pub use load::{LoadError, Plugin, Wanted};

/// Samples of one signal. Both columns are of the same length, times [s] never fall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal<'a> {
    /// The name that the analysis knows it by.
    pub name: &'a str,
    /// The unit of the values.
    pub unit: &'a str,
    /// When each value holds [s].
    pub time: &'a [f64],
    /// The values.
    pub values: &'a [f64],
}

/// A signal that an analysis can be given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Need {
    /// Its name.
    pub name: &'static str,
    /// The unit that it is wanted in: the program converts. Empty when any will do.
    pub unit: &'static str,
    /// One line about it.
    pub description: &'static str,
    /// Whether the analysis cannot do without.
    pub required: bool,
}

impl Need {
    /// A signal that the analysis cannot do without.
    #[must_use]
    pub const fn required(
        name: &'static str,
        unit: &'static str,
        description: &'static str,
    ) -> Self {
        Self { name, unit, description, required: true }
    }

    /// A signal that the analysis uses if it is there.
    #[must_use]
    pub const fn optional(
        name: &'static str,
        unit: &'static str,
        description: &'static str,
    ) -> Self {
        Self { name, unit, description, required: false }
    }
}

/// What an analysis is asked to do.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Request<'a> {
    /// Its configuration, TOML.
    pub config: &'a str,
    /// The signals that it is given.
    pub signals: Vec<Signal<'a>>,
}

impl<'a> Request<'a> {
    /// The signal of this name.
    #[must_use]
    pub fn signal(&self, name: &str) -> Option<Signal<'a>> {
        self.signals.iter().find(|signal| signal.name == name).copied()
    }
}

/// What an analysis can tell the program while it runs.
pub trait Host {
    /// Tells which share of the work is done, 0 to 1, and what comes next. `false` asks the analysis to give up.
    fn progress(&mut self, share: f64, what: &str) -> bool;

    /// Adds signals to the recording, under the name of the group. They have equal lengths and the times of the first.
    fn record(&mut self, group: &str, signals: &[Signal]);

    /// Adds a diagram to the replay. Those of one group are shown together, the first one largest.
    fn diagram(&mut self, group: &str, diagram: &Diagram);

    /// Leaves a text file beside the report. The name has no folder in it.
    fn file(&mut self, name: &str, text: &str);
}

/// A host that takes everything and does nothing with it, for tests.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Host for Silent {
    fn progress(&mut self, _share: f64, _what: &str) -> bool {
        true
    }
    fn record(&mut self, _group: &str, _signals: &[Signal]) {}
    fn diagram(&mut self, _group: &str, _diagram: &Diagram) {}
    fn file(&mut self, _name: &str, _text: &str) {}
}

/// An analysis of signals.
pub trait Analysis {
    /// The signals that it can be given.
    const NEEDS: &'static [Need];

    /// Whether the configuration makes sense with these signals, which have no samples yet: asked before anything runs. A
    /// word in backticks in the message is pointed at in the user's file.
    ///
    /// # Errors
    /// With what was expected, what was found and what to do.
    fn check(_request: &Request) -> Result<(), String> {
        Ok(())
    }

    /// Analyses, and gives the result as JSON.
    ///
    /// # Errors
    /// With what went wrong; the program then counts the analysis as failed.
    fn run(request: &Request, host: &mut dyn Host) -> Result<String, String>;
}

/// Makes a library a plugin: exports the one symbol that the program looks for.
#[macro_export]
macro_rules! export {
    ($analysis:ty) => {
        /// What the program calls.
        #[unsafe(no_mangle)]
        pub extern "C" fn trackside_plugin() -> *const $crate::abi::Vtable {
            $crate::vtable::<$analysis>()
        }
    };
}
