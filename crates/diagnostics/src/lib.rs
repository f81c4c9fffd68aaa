//! Text files and places in them go in; errors that point at words, and names that were probably meant, come out.
#![forbid(unsafe_code)]

mod bounded;
mod error;
mod excerpt;
mod mistakes;
mod origins;
mod printable;
mod shown;
mod source;
mod span;
pub mod suggest;
mod summary;
mod text_file;

pub use bounded::{read_bounded, read_text_bounded};
pub use error::{Error, Failure, Input, rounded, signal_name};
pub use mistakes::Mistakes;
pub use origins::Origins;
pub use printable::Printable;
pub use shown::{in_markdown, is_obeyed, shown};
pub use source::Source;
pub use span::Spanned;
pub use summary::summary;
pub use text_file::TextFile;
