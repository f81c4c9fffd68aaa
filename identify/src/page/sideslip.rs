//! Writes the page of an estimated v_y: how good it is where it was measured, its course with bands, and the tires.

use askama::Template;
use drive_prediction::score::BAND;
use html_page::{Markup, Plot, PlotAxis};

use crate::assessment::{ParameterInterval, SideslipScore, SideslipTrace};
use crate::conclusion::Conclusion;
use crate::page::filters;

/// The size of a figure [px].
const SIZE: [f64; 2] = [1000.0, 280.0];

#[derive(Template)]
#[template(path = "sideslip.html")]
struct SideslipPage<'a> {
    title: &'static str,
    summary: &'a [String],
    conclusion: &'a Conclusion,
    score: Option<SideslipScore>,
    plots: Vec<Markup>,
    parameters: &'a [ParameterInterval],
}

/// The page.
pub fn render_sideslip_page(
    parameters: &[ParameterInterval],
    score: Option<SideslipScore>,
    stretches: &[(String, SideslipTrace)],
    summary: &[String],
    conclusion: &Conclusion,
) -> String {
    let stretches = stretches.iter().filter(|(_, rows)| !rows.is_empty());
    let plots = stretches.map(|(name, rows)| sideslip_plot(rows).figure_with_legend(name)).collect();
    let title = "Sideslip without a sensor";
    html_page::render_page(&SideslipPage { title, summary, conclusion, score, plots, parameters })
}

/// v_y over time with its band, and as it was measured.
fn sideslip_plot(rows: &SideslipTrace) -> Plot {
    let band: Vec<_> =
        rows.iter().map(|(t, v_y, std, _)| (*t, [v_y - BAND[0] * std, v_y + BAND[0] * std])).collect();
    let heights = band.iter().flat_map(|it| it.1);
    let times = rows.iter().map(|it| it.0);
    let mut plot = Plot::new(
        SIZE,
        PlotAxis::around_values("time [s]", times),
        PlotAxis::around_values("v_y [m/s]", heights),
    );
    plot.add_band(&band, "c1", "95 % band");
    plot.add_line(&rows.iter().map(|it| (it.0, it.1)).collect::<Vec<_>>(), "c1", "estimated");
    if rows.iter().any(|it| it.3.is_finite()) {
        plot.add_line(&rows.iter().map(|it| (it.0, it.3)).collect::<Vec<_>>(), "truth", "measured, not used");
    }
    plot
}
