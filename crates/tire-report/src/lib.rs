//! Says what a tire is like: key figures, and a page with its curves; of two tires, side by side.
#![forbid(unsafe_code)]

mod figures;
mod page;

use tire::MfTire;

pub use figures::{KeyFigure, format_four_digits, key_figures};
pub use page::tire_page;

/// A tire with what it is called.
#[derive(Clone, Debug)]
pub struct NamedTire {
    /// Its name, such as that of its file.
    pub name: String,
    /// The tire.
    pub tire: MfTire,
    /// What reading it told.
    pub messages: Vec<String>,
}
