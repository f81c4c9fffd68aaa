//! Writes pages that need nothing but a browser: a template and a style for light, dark and paper, and plots as SVG.
//!
//! A page is a template of askama that extends `base.html` of this crate and has a field `title`. All that stands in braces is escaped
//! by [`XmlEscaper`], but for [`Markup`].

mod axis;
mod equal_scale;
mod escape;
pub mod filters;
mod plot;
mod svg;

use askama::Template;
pub use askama::filters::Safe;
pub use axis::PlotAxis;

pub use equal_scale::{EqualScale, ScaledPlot};
pub use escape::{XmlEscaper, escape_xml, script_json};
pub use plot::{CssClass, Plot, PlotLabel, PlotLayer, PlotLayerShape};
pub use svg::plots_to_svg_file;

/// The style of all pages: texts, tables and plots.
const STYLE: &str = include_str!("../templates/style.css");

/// What is XML already, such as a plot.
pub type Markup = Safe<String>;

/// The text of a page.
#[must_use]
pub fn render_page(page: &impl Template) -> String {
    page.render().expect("writing into a string does not fail")
}
