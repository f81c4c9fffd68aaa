//! Shows checks on the page: a table, and what they compare over time.

use std::fmt::Write as _;

use assessment::check::Verdict;
use expression::{TracePoint, Traced};
use html_page::{Axis, Plot, escape};

/// Sizes of pictures [px]: of failed checks, and of passed ones.
const WIDE: [f64; 2] = [1080.0, 280.0];
const SMALL: [f64; 2] = [350.0, 190.0];

/// The table of the checks, and their pictures; those of failed ones are larger and come first.
pub(super) fn write(html: &mut String, checks: &[Verdict]) {
    if checks.is_empty() {
        return;
    }
    html.push_str("<h2>Checks</h2>\n");
    write_table(html, checks);
    let (passed, failed): (Vec<_>, Vec<_>) = checks.iter().partition(|check| check.passed);
    failed.into_iter().filter_map(|check| picture(check, WIDE)).for_each(|it| html.push_str(&it));
    let passed: String = passed.into_iter().filter_map(|check| picture(check, SMALL)).collect();
    if !passed.is_empty() {
        let _ = writeln!(html, "<div class=\"grid\">\n{passed}</div>");
    }
}

/// A row for each check.
pub(super) fn write_table(html: &mut String, checks: &[Verdict]) {
    if checks.is_empty() {
        return;
    }
    html.push_str(
        "<table class=\"checks\">\n<tr><th>Check</th><th></th><th>Worst value</th><th>Limit</th><th>Unit</th><th>At [s]</th>\
         <th>First deviation [s]</th><th>Window [s]</th></tr>\n",
    );
    for check in checks {
        let reason = check.reason.as_deref().map_or_else(String::new, |reason| {
            format!("<br/><span class=\"reason\">{}</span>", escape(reason))
        });
        let (class, word) = if check.passed { ("pass", "passed") } else { ("fail", "FAILED") };
        let [from, to] = check.during;
        let _ = writeln!(
            html,
            "<tr><td>{}<br/><code>{}</code>{reason}</td><td class=\"verdict {class}\">{word}</td>\
             <td class=\"number\">{}</td><td class=\"number\">{}</td><td>{}</td><td class=\"number\">{}</td>\
             <td class=\"number\">{}</td><td class=\"number\">{from} to {to}</td></tr>",
            escape(&check.name),
            escape(&check.that),
            number(check.value),
            number(check.limit),
            escape(check.unit.as_deref().unwrap_or_default()),
            time(check.at),
            time(check.first),
        );
    }
    html.push_str("</table>\n");
}

/// What a check compares over its window, if that is more than a moment.
fn picture(check: &Verdict, size: [f64; 2]) -> Option<String> {
    let points = check.trace.points();
    let seen = points.iter().filter(|point| point.value.iter().all(|it| it.is_finite()));
    if seen.count() < 2 {
        return None;
    }
    let [from, to] = check.during;
    let limits = points.iter().flat_map(|point| point.limit);
    let (label, limit) = match check.trace.of() {
        Traced::Sides => ("left side", "limit"),
        Traced::Reduced => ("quantity", "limit"),
        Traced::Margins => ("margin", "violated below"),
    };
    let title = check.unit.as_ref().map_or(label.to_owned(), |unit| format!("{label} [{unit}]"));
    let y = Axis::about(&title, points.iter().flat_map(|point| point.value).chain(limits));
    let mut plot = Plot::new(size, Axis::linear("time [s]", from, to), y);
    plot.line(&outline(points, |point| point.value), "c0", label);
    if points.iter().any(|point| point.limit[0].is_finite()) {
        plot.dashes(&outline(points, |point| point.limit), "limit", limit);
    }
    if let Some(first) = check.first {
        plot.mark(first, "poor", "first deviation");
    }
    let worst = match check.trace.of() {
        Traced::Sides | Traced::Reduced => check.value,
        Traced::Margins => check.margin,
    };
    if let (Some(at), Some(value)) = (check.at, worst) {
        let class = if check.passed { "c1" } else { "poor" };
        plot.dots(&[(at, value)], 4.5, class, "worst");
    }
    let that = format!("<p class=\"that\"><code>{}</code></p>\n", escape(&check.that));
    Some(format!("<div>\n{}{that}</div>\n", plot.figure(&check.name)))
}

/// The line through the lowest and the highest value of each point.
fn outline(points: &[TracePoint], of: fn(&TracePoint) -> [f64; 2]) -> Vec<(f64, f64)> {
    let mut line = Vec::with_capacity(2 * points.len());
    for point in points {
        let [low, high] = of(point);
        line.push((point.time, low));
        if low != high {
            line.push((point.time, high));
        }
    }
    line
}

/// As many digits as a person compares.
fn number(value: Option<f64>) -> String {
    match value {
        None => String::new(),
        Some(value) if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) => {
            format!("{value:.3e}")
        }
        Some(value) => format!("{value:.4}"),
    }
}

fn time(time: Option<f64>) -> String {
    time.map(|time| format!("{time:.3}")).unwrap_or_default()
}
