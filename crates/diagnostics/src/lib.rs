//! Errors with source spans in text files, exit codes and remedies; suggestions for unknown names; escaping of foreign text.
#![forbid(unsafe_code)]

mod bounded;
mod error;
mod excerpt;
mod mistakes;
mod panic_guard;
mod printable;
mod record;
mod shown;
mod source;
mod source_map;
mod span;
mod standard_error;
pub mod suggest;
mod summary;
mod text_file;
mod utf8_path;

pub use bounded::{read_bounded, read_text_bounded};
pub use error::{Error, InputError, NodeFailure, rounded_time, signal_name};
pub use mistakes::ErrorCollector;
pub use panic_guard::catch_panics;
pub use printable::PrintableError;
pub use record::{ErrorPlace, ErrorRecord};
pub use shown::{escape_for_terminal, escape_markdown, is_terminal_control, shell_word};
pub use source::SourceFiles;
pub use source_map::SourceMap;
pub use span::Spanned;
pub use standard_error::{print_raw_to_stderr, print_to_stderr};
pub use summary::group_similar;
pub use text_file::TextFile;
pub use utf8_path::utf8_path;
