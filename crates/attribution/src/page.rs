//! Writes `why.html`: an explanation as one page, with the graph of how the difference spreads.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use askama::Template;
use html_page::{Markup, escape_xml};

use crate::difference::{Difference, DifferenceScope};
use crate::explanation::Explanation;
use crate::text::{deviation_sentence, local_sentence};

/// The page.
pub const PAGE: &str = "why.html";
/// The same for programs.
pub const DATA: &str = "why.json";
/// Differences in the table; the rest is counted, and is in `why.json`.
const MOST: usize = 200;

#[derive(Template)]
#[template(path = "why.html")]
struct WhyPage<'a> {
    title: String,
    explanation: &'a Explanation,
    rows: Vec<DifferenceRow<'a>>,
    more: usize,
    causes: Vec<String>,
    spread: Vec<String>,
    local: Vec<String>,
    graph: Option<Markup>,
}

/// A line of the table of differences.
struct DifferenceRow<'a> {
    difference: &'a Difference,
    unit: String,
    /// What became of it in the experiments.
    role: &'static str,
}

impl Explanation {
    /// As a page that needs nothing but a browser.
    #[must_use]
    pub fn to_page(&self) -> String {
        let role = |difference: &Difference| match () {
            () if self.causes.iter().any(|it| it.differences.contains(&difference.id)) => "cause",
            () if self.without_effect.contains(&difference.id) => "no effect",
            () if difference.scope == DifferenceScope::None => "acts on no value",
            () => "",
        };
        let row = |difference| DifferenceRow {
            difference,
            unit: difference.unit.as_deref().map(units::display::unit_text).unwrap_or_default(),
            role: role(difference),
        };
        html_page::render_page(&WhyPage {
            title: "Why the runs differ".to_owned(),
            explanation: self,
            rows: self.differences.iter().take(MOST).map(row).collect(),
            more: self.differences.len().saturating_sub(MOST),
            causes: self.cause_sentences(),
            spread: self.spread.iter().map(deviation_sentence).collect(),
            local: self.local.iter().map(local_sentence).collect(),
            graph: (self.spread.len() > 1).then(|| html_page::Safe(self.spread_graph())),
        })
    }

    /// The nodes that differ, from left to right by their first times, and the connections between them.
    fn spread_graph(&self) -> String {
        const WIDTH: f64 = 150.0;
        const GAP: f64 = 60.0;
        const HEIGHT: f64 = 44.0;
        let mut times: Vec<f64> = self.spread.iter().map(|it| it.time).collect();
        times.dedup();
        let mut places = BTreeMap::new();
        let mut filled = vec![0_usize; times.len()];
        for deviation in &self.spread {
            let column = times.iter().position(|it| *it == deviation.time).unwrap_or_default();
            let place = (column as f64 * (WIDTH + GAP), filled[column] as f64 * (HEIGHT + 24.0));
            filled[column] += 1;
            places.insert(deviation.signal.node.as_str(), place);
        }
        let width = times.len() as f64 * (WIDTH + GAP);
        let height = filled.iter().max().copied().unwrap_or(1) as f64 * (HEIGHT + 24.0);
        let mut svg = format!(
            "<svg viewBox=\"-4 -4 {:.0} {:.0}\" style=\"max-width:{:.0}px\" role=\"img\"><defs><marker id=\"tip\" viewBox=\"0 0 8 8\" refX=\"8\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" orient=\"auto\"><path d=\"M0 0 L8 4 L0 8 z\" style=\"fill:currentColor;stroke:none\"/></marker></defs>",
            width + 8.0,
            height + 8.0,
            width + 8.0
        );
        for arrow in &self.arrows {
            let (Some(from), Some(to)) = (places.get(arrow.from.as_str()), places.get(arrow.to.as_str()))
            else {
                continue;
            };
            let forward = to.0 > from.0;
            let (start, end) =
                if forward { (from.0 + WIDTH, to.0) } else { (from.0 + WIDTH * 0.5, to.0 + WIDTH * 0.5) };
            let (y_start, y_end) = match forward {
                true => (from.1 + HEIGHT * 0.5, to.1 + HEIGHT * 0.5),
                false => (from.1 + HEIGHT, to.1 + HEIGHT),
            };
            let bend = if forward { (start + end) * 0.5 } else { end };
            let sag = if forward { 0.0 } else { 20.0 };
            // Writing into a string cannot fail.
            let _ = write!(
                svg,
                "<path d=\"M{start:.0} {y_start:.0} C{bend:.0} {:.0} {bend:.0} {:.0} {end:.0} {y_end:.0}\" style=\"fill:none;stroke:currentColor;stroke-width:1.2\" marker-end=\"url(#tip)\"/>",
                y_start + sag,
                y_end + sag
            );
        }
        for deviation in &self.spread {
            let Some((x, y)) = places.get(deviation.signal.node.as_str()) else { continue };
            let node = escape_xml(&deviation.signal.node);
            let _ = write!(
                svg,
                "<rect x=\"{x:.0}\" y=\"{y:.0}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" rx=\"6\" style=\"fill:none;stroke:currentColor\"/><text x=\"{:.0}\" y=\"{:.0}\" style=\"text-anchor:middle;fill:currentColor;font-size:14px\">{node}</text><text x=\"{:.0}\" y=\"{:.0}\" style=\"text-anchor:middle;fill:currentColor;font-size:11px\">from {} s: {}</text>",
                x + WIDTH * 0.5,
                y + 18.0,
                x + WIDTH * 0.5,
                y + 35.0,
                deviation.time,
                escape_xml(&deviation.signal.variable)
            );
        }
        svg + "</svg>"
    }
}
