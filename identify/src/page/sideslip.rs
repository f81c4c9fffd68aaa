//! Writes the page of an estimated v_y: how good it is where it was measured, its course with bands, and the tires.

use std::fmt::Write;

use drive_prediction::score::BAND;
use html_page::{Axis, Plot, escape};
use numerics::text::significant;

use crate::assessment::{ParameterInterval, SideslipScore, SideslipTrace};
use crate::names::{class, words};

/// The size of a figure [px].
const SIZE: [f64; 2] = [1000.0, 280.0];

/// The page.
pub fn page(
    told: &[ParameterInterval],
    score: Option<SideslipScore>,
    shown: &[(String, SideslipTrace)],
    summary: &[String],
) -> String {
    let mut html: String = summary.iter().map(|it| format!("<p>{}</p>\n", escape(it))).collect();
    if let Some(score) = score {
        let _ = writeln!(
            html,
            "<table>\n<tr><th>v_y [m/s]</th><th>Sideslip [deg]</th><th>In the 95 % band</th><th>Rows</th></tr>\n<tr><td class=\"number\">{}</td>\
             <td class=\"number\">{}</td><td>{:.1} %</td><td>{}</td></tr>\n</table>",
            significant(score.v_y, 3),
            significant(score.sideslip.to_degrees(), 3),
            100.0 * score.coverage,
            score.rows
        );
    }
    for (name, rows) in shown.iter().filter(|(_, rows)| !rows.is_empty()) {
        let band: Vec<_> = rows
            .iter()
            .map(|(t, v_y, std, _)| (*t, [v_y - BAND[0] * std, v_y + BAND[0] * std]))
            .collect();
        let heights = band.iter().flat_map(|it| it.1);
        let times = rows.iter().map(|it| it.0);
        let mut plot =
            Plot::new(SIZE, Axis::about("time [s]", times), Axis::about("v_y [m/s]", heights));
        plot.band(&band, "c1", "95 % band");
        plot.line(&rows.iter().map(|it| (it.0, it.1)).collect::<Vec<_>>(), "c1", "estimated");
        if rows.iter().any(|it| it.3.is_finite()) {
            plot.line(
                &rows.iter().map(|it| (it.0, it.3)).collect::<Vec<_>>(),
                "truth",
                "measured, not used",
            );
        }
        html.push_str(&plot.figure(name));
    }
    html.push_str("<h2>The car</h2>\n<table>\n<tr><th>Parameter</th><th>Value</th><th>95 % interval</th><th>Verdict</th></tr>\n");
    for it in told {
        let _ = writeln!(
            html,
            "<tr><th>{}</th><td class=\"number\">{}</td><td class=\"number\">{} to {}</td><td class=\"{}\">{}</td></tr>",
            escape(&it.name),
            significant(it.value, 4),
            significant(it.interval[0], 4),
            significant(it.interval[1], 4),
            class(it.verdict),
            words(it.verdict)
        );
    }
    html.push_str("</table>\n");
    html_page::page("Sideslip without a sensor", "", &html)
}
