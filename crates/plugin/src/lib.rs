//! Lets the program call analyses that it was not built with: signals and a configuration go in; a result in JSON,
//! recorded signals, diagrams and files come out.
//!
//! A plugin is a `cdylib` with an [`Analysis`]:
//!
//! ```
//! use plugin::{Analysis, AnalysisError, AnalysisRequest, AnalysisServices, InputSignal};
//!
//! struct Mean;
//!
//! impl Analysis for Mean {
//!     const INPUTS: &'static [InputSignal] = &[InputSignal::required("x", "", "the averaged signal")];
//!
//!     fn run(request: &AnalysisRequest, _host: &mut dyn AnalysisServices) -> Result<String, AnalysisError> {
//!         let x = request.find_signal("x").ok_or("expected a signal `x`")?.values;
//!         Ok(format!(r#"{{"mean": {}}}"#, x.iter().sum::<f64>() / x.len() as f64))
//!     }
//! }
//!
//! plugin::export!(Mean);
//! # let x = plugin::Signal { name: "x", unit: "", time: &[0.0, 1.0], values: &[1.0, 3.0] };
//! # let request = AnalysisRequest { config: "", signals: vec![x] };
//! # assert_eq!(Mean::run(&request, &mut plugin::NullAnalysisServices), Ok(r#"{"mean": 2}"#.to_owned()));
//! ```
//!
//! A configuration is a struct with `serde::Deserialize`. [`AnalysisRequest::read_config`] reads it, and a [`ConfigError`]
//! carries the key that is wrong, so that the program points at it in the user's file:
//!
//! ```
//! use plugin::{AnalysisRequest, ConfigError};
//!
//! #[derive(serde::Deserialize)]
//! #[serde(deny_unknown_fields)]
//! struct Config { window: f64 }
//!
//! fn check(request: &AnalysisRequest) -> Result<(), ConfigError> {
//!     let Config { window } = request.read_config()?;
//!     if window > 0.0 {
//!         return Ok(());
//!     }
//!     Err(ConfigError::at_key("window", format!("expected a time above 0 s, found {window}")))
//! }
//!
//! let check = |config| check(&AnalysisRequest { config, signals: Vec::new() }).map_err(|error| error.to_string());
//! assert_eq!(check("window = 0.5"), Ok(()));
//! assert_eq!(check("window = 0.0"), Err("window: expected a time above 0 s, found 0".to_owned()));
//! assert!(check("windw = 0.5").is_err_and(|error| error.starts_with("windw: unknown field")));
//! ```
//!
//! # The boundary
//!
//! C structures cross it and nothing else ([`abi`]), so program and plugin need not be built by the same compiler. Both
//! state [`abi::VERSION`], and nothing is called when they differ.
//!
//! - **Memory**: slices are borrowed for the duration of a call and results leave through callbacks. Neither side frees
//!   the other's memory. Whatever can be checked is: null, lengths, alignment, UTF-8, numbers of enumerations.
//! - **Panics** of a plugin end its call with a message. A panic of the program inside of a callback is kept until the
//!   plugin has returned and goes on then. Both need `panic = "unwind"`, the default.
//! - **Threads**: a plugin calls back on the thread of the call. The program ignores other threads and fails the call.
//! - **Life**: the library stays loaded until the process ends. Its threads may outlive each call.
//!
//! # Features
//!
//! `load`: the side of the program, `Plugin` and `LoadError`. A plugin does without. In the registry this crate is `trackside-plugin`; the name
//! in code stays.
//!
//! # Tests and memory
//!
//! `cargo test -p plugin` calls the example `mean` across the boundary, with valgrind too where it is installed. With a
//! nightly toolchain, `cargo +nightly miri test -p plugin` checks the rules of references and initialisation too.

pub mod abi;
mod analysis;
mod c_views;
mod config;
mod diagram;
mod error;
mod export;
mod file;
#[cfg(feature = "load")]
mod load;
mod result_summary;
mod signal;

pub use analysis::{Analysis, AnalysisRequest, AnalysisServices, NullAnalysisServices};
pub use config::from_toml;
pub use diagram::{Diagram, DiagramLayer, DiagramLayerRole, DiagramLayerShape};
pub use error::{AnalysisError, ConfigError};
#[doc(hidden)]
pub use export::vtable;
pub use file::ConfigFile;
#[cfg(feature = "load")]
pub use load::{LoadError, OwnedInputSignal, Plugin};
pub use result_summary::{ResultSummary, ResultTable, ResultTableRow};
pub use signal::{InputSignal, Signal};

/// Makes a library a plugin: exports the one symbol that the program looks for.
#[macro_export]
macro_rules! export {
    ($analysis:ty) => {
        /// The entry point for the program.
        #[unsafe(no_mangle)]
        pub extern "C" fn trackside_plugin() -> *const $crate::abi::Vtable {
            $crate::vtable::<$analysis>()
        }
    };
}
