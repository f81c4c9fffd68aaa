//! Runs Python scripts in processes of their own, which answer questions.
//!
//! [`PythonProcess`] starts an interpreter with one of the files of `python/trackside`, and loads a script in it. A question and an answer
//! are a length, a number and contents. What the script prints comes by another way and is read with the answer.
#![forbid(unsafe_code)]

pub mod analysis;
mod error;
mod installation;
mod interpreter;
mod library;
mod printed_lines;
mod process;

pub use error::{PythonException, ScriptError};
pub use interpreter::{PythonInterpreter, missing_module, module_install_advice};
pub use library::PythonLibrary;
pub use process::PythonProcess;

/// The file that makes a script a model, and answers questions about it.
pub const MODEL_SERVER: &str = include_str!("../../../python/trackside/fmu.py");

/// The file that loads a script with an analysis, and hands over its signals.
pub const ANALYSIS_SERVER: &str = include_str!("../../../python/trackside/analysis.py");

/// The name of [`MODEL_SERVER`] in a folder with the script.
pub const MODEL_SERVER_PATH: &str = "trackside/fmu.py";

/// The name of the interface of a model in a folder with the script: JSON whose key `python` is the interpreter of the packing.
pub const MODEL_INTERFACE_PATH: &str = "interface.json";
