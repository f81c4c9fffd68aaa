//! Names quantities and verdicts for people.

use preparation::direction::Direction;
use tire_inference::verdict::Verdict;

/// The order of rows.
pub const ORDER: [&str; 9] = ["B", "C", "D", "E", "S_h", "S_v", "K", "peak", "peak_slip"];

/// A verdict in words.
pub fn words(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Identified => "identified",
        Verdict::Weak => "weak",
        Verdict::NotIdentifiable => "not identifiable",
    }
}

/// Class of the page's style for a verdict.
pub fn class(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Identified => "identified",
        Verdict::Weak => "weak",
        Verdict::NotIdentifiable => "not_identifiable",
    }
}

/// A quantity in words, with its unit.
pub fn describe(name: &str, direction: Direction) -> String {
    let what = match name {
        "B" => "stiffness factor",
        "C" => "shape factor",
        "D" => "peak factor",
        "E" => "curvature factor",
        "S_h" => "horizontal shift",
        "S_v" => "vertical shift",
        "K" => "stiffness B C D",
        "peak" => "highest friction coefficient",
        "peak_slip" => "slip at the peak",
        _ => "",
    };
    format!("{what} [{}]", unit(name, direction))
}

/// The unit of a quantity: slip angles are in radians, slip ratios are numbers.
pub fn unit(name: &str, direction: Direction) -> &'static str {
    match (direction, name) {
        (Direction::Lateral, "B" | "K") => "1/rad",
        (Direction::Lateral, "S_h" | "peak_slip") => "rad",
        _ => "–",
    }
}
