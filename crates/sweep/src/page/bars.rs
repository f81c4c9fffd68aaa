//! Draws the effects on a result as bars with their intervals.

use std::fmt::Write as _;

use html_page::{Axis, escape};

use super::{grouped, with_unit};
use crate::statistics::Estimate;
use crate::summary::{Effect, Method, Output};

/// Values that are drawn; the rest is weaker.
const MOST: usize = 12;
/// Sizes [px]: of the figure, of the names beside the bars, of the numbers behind them, of a row, of the axis below.
const WIDTH: f64 = 520.0;
const NAMES: f64 = 190.0;
const NUMBERS: f64 = 88.0;
const ROW: f64 = 24.0;
const AXIS: f64 = 26.0;
/// Letters of a name that have room, of 7 px each.
const LETTERS: usize = 26;

/// The figure of a result.
pub fn write(html: &mut String, output: &Output) {
    let shown = &output.effects[..output.effects.len().min(MOST)];
    let height = ROW * shown.len() as f64 + AXIS;
    let axis = match output.method {
        Method::Indices => Axis::linear("", 0.0, 1.0),
        Method::Ranks => Axis::linear("", -1.0, 1.0),
    };
    let width = WIDTH - NAMES - NUMBERS;
    let place = |value: f64| NAMES + axis.share(value).clamp(0.0, 1.0) * width;
    let _ = write!(
        html,
        "<figure><figcaption><b>{}</b>{}</figcaption>\n<svg class=\"bars\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\">\n",
        escape(&with_unit(&output.name, output.unit.as_deref())),
        basis(output)
    );
    for (value, text) in axis.ticks(width, 50.0, |text| 7.0 * text.len() as f64) {
        let (x, bottom) = (place(value), height - AXIS);
        let _ = writeln!(
            html,
            "<path class=\"grid\" d=\"M{x:.1} 0V{bottom}\"/><text x=\"{x:.1}\" y=\"{}\">{text}</text>",
            height - 8.0
        );
    }
    for (row, effect) in shown.iter().enumerate() {
        let top = ROW * row as f64;
        let middle = top + 0.5 * ROW;
        let _ = writeln!(
            html,
            "<text class=\"name end\" x=\"{}\" y=\"{}\">{}<title>{}</title></text>",
            NAMES - 8.0,
            middle + 4.0,
            escape(&shortened(&effect.parameter, LETTERS)),
            escape(&effect.parameter)
        );
        if let Some(total) = effect.total {
            bar(html, &place, total, "total", [top + 3.0, ROW - 6.0]);
        }
        bar(html, &place, effect.estimate, "first", [top + 6.0, ROW - 12.0]);
        numbers(html, effect, middle);
    }
    html.push_str("</svg>\n");
    if let Some(more) = output.effects.len().checked_sub(MOST).filter(|more| *more > 0) {
        let _ = writeln!(html, "<figcaption>and {more} weaker</figcaption>");
    }
    html.push_str("</figure>\n");
}

/// A bar from 0 to a value, and a line over its interval.
fn bar(html: &mut String, place: &impl Fn(f64) -> f64, of: Estimate, class: &str, at: [f64; 2]) {
    let [from, to] = [place(0.0), place(of.value)];
    let [low, high] = of.interval.map(place);
    let (left, width, [top, height]) = (from.min(to), (to - from).abs(), at);
    let middle = if class == "total" { top + 1.0 } else { top + 0.5 * height };
    let _ = writeln!(
        html,
        "<rect class=\"{class}\" x=\"{left:.1}\" y=\"{top}\" width=\"{width:.1}\" height=\"{height}\"/>\
         <path class=\"whisker\" d=\"M{low:.1} {middle}H{high:.1}\"/>"
    );
}

fn numbers(html: &mut String, effect: &Effect, middle: f64) {
    let number = |estimate: Estimate| {
        let text = format!("{:.2}", estimate.value);
        if text == "-0.00" { "0.00".to_owned() } else { text.replace('-', "−") }
    };
    let both = match effect.total {
        Some(total) => format!("{} / {}", number(effect.estimate), number(total)),
        None => number(effect.estimate),
    };
    let _ = writeln!(
        html,
        "<text class=\"begin\" x=\"{}\" y=\"{}\">{both}</text>",
        WIDTH - NUMBERS + 4.0,
        middle + 4.0
    );
}

/// What the effects rest on, where something is left out.
fn basis(output: &Output) -> String {
    let kind = if output.method == Method::Indices { "blocks" } else { "variants" };
    match output.left_out {
        0 => String::new(),
        left_out => {
            let all = grouped((output.used + left_out) as u64);
            let left_out = grouped(left_out as u64);
            format!(" {left_out} of {all} {kind} left out: no result")
        }
    }
}

/// The end of a name that is too long, which says more than its beginning.
pub fn shortened(name: &str, letters: usize) -> String {
    let count = name.chars().count();
    if count <= letters {
        return name.to_owned();
    }
    std::iter::once('…').chain(name.chars().skip(count + 1 - letters)).collect()
}
