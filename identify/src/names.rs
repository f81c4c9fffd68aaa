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
    verdict.words()
}

/// Class of the page's style for a verdict.
pub fn class(verdict: Verdict) -> &'static str {
    verdict.key()
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

/// What the data of a car that are not known do to bands.
pub const CAR_ADDED: &str = "All are widened by what is not known of the car.";
/// What parts of the drives that were not fitted do to bands.
pub const SCATTER_ADDED: &str =
    "All are widened to the scatter of parts of the drives that were not fitted.";

/// Where bands, densities and intervals come from: the statement of terminal, page, report and manual. `widened` is what makes them
/// wider than that, in a sentence; empty if nothing does.
pub fn origin(source: UncertaintySource, widened: &str) -> String {
    let shown = match source {
        UncertaintySource::Grid => "the exact posterior in the box, from a grid",
        UncertaintySource::Tempered => "draws from the posterior in the box",
        UncertaintySource::Importance | UncertaintySource::Svi => {
            "weighted draws from the posterior in the box"
        }
        UncertaintySource::Likelihood => {
            "a normal distribution in the box, as the curvature of the cost says"
        }
    };
    let gap = if widened.is_empty() { "" } else { " " };
    format!(
        "Bands and densities show {shown}; intervals are its middle 95 %, {WIDER}.{gap}{widened}"
    )
}

/// What intervals have besides.
const WIDER: &str = "or what the profile of the likelihood does not rule out where that is wider";

/// The box of the parameters that are fitted, in a sentence.
pub fn the_box(prior: &Prior) -> String {
    let of = |parameter: Parameter| {
        let [low, high] = prior.bounds.of(parameter);
        format!("{} {low} … {high}", parameter.name())
    };
    let free = Parameter::ALL.into_iter().filter(|parameter| prior.free[*parameter as usize]);
    format!("Box {}: {}.", prior.bounds.name(), free.map(of).collect::<Vec<_>>().join(", "))
}
