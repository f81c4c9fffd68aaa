//! Writes pages that need nothing but a browser: a template and a style for light, dark and paper, and plots as SVG.
//!
//! A page is a template of askama that extends `base.html` of this crate and has a field `title`. All that stands in braces is escaped
//! by [`Xml`], but for [`Markup`].

mod axis;
mod escape;
pub mod filters;
mod plot;
mod svg;

use askama::Template;
pub use askama::filters::Safe;
pub use axis::Axis;

pub use escape::{Xml, escape};
pub use plot::{Class, Layer, Plot, Shape};
pub use svg::svg;

/// The style of all pages: texts, tables and plots.
const STYLE: &str = include_str!("../templates/style.css");

/// What is XML already, such as a plot.
pub type Markup = Safe<String>;

/// The text of a page.
#[must_use]
pub fn render(page: &impl Template) -> String {
    page.render().expect("writing into a string does not fail")
}
