//! Writes pages that need nothing but a browser: a style for light, dark and paper, and plots as SVG.

mod axis;
mod escape;
mod plot;
mod svg;

pub use axis::Axis;
pub use escape::escape;
pub use plot::{Class, Layer, Plot, Shape};
pub use svg::svg;

/// The style of all pages: texts, tables and plots.
const STYLE: &str = include_str!("style.css");

/// A page of a title and a body, which is HTML. `style` is more CSS.
pub fn page(title: &str, style: &str, body: &str) -> String {
    let title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\"><head><meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/><title>{title}</title>\n\
         <style>\n{STYLE}{style}</style></head>\n<body>\n<h1>{title}</h1>\n{body}</body></html>\n"
    )
}
