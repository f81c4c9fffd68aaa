//! Names quantities and verdicts for people.

use preparation::direction::Direction;
use tire_inference::parameters::Parameter;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::prior::Prior;
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

/// Where standard deviations, intervals, bands and densities come from, in a sentence.
pub fn uncertainty(source: UncertaintySource) -> &'static str {
    match source {
        UncertaintySource::Grid => {
            "Intervals, bands and densities are those of the exact posterior in the box, on a grid."
        }
        UncertaintySource::Tempered => {
            "Intervals, bands and densities are those of draws from the posterior in the box."
        }
        UncertaintySource::Importance | UncertaintySource::Svi => {
            "Intervals, bands and densities are those of weighted draws from the posterior in the box."
        }
        UncertaintySource::Likelihood => {
            "Intervals, bands and densities are those of a normal distribution in the box, as the curvature of the cost says."
        }
    }
}

/// The box of the parameters that are fitted, in a sentence.
pub fn the_box(prior: &Prior) -> String {
    let of = |parameter: Parameter| {
        let [low, high] = prior.bounds.of(parameter);
        format!("{} {low} … {high}", parameter.name())
    };
    let free = Parameter::ALL.into_iter().filter(|parameter| prior.free[*parameter as usize]);
    format!("Box {}: {}.", prior.bounds.name(), free.map(of).collect::<Vec<_>>().join(", "))
}
