//! Names quantities for people.

use preparation::direction::ForceDirection;
use tire_inference::parameters::Parameter;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::prior::Prior;
use tire_inference::quantity::Quantity;

/// A quantity in words, with its unit.
pub fn quantity_description(quantity: Quantity, direction: ForceDirection) -> String {
    let what = match quantity {
        Quantity::B => "stiffness factor",
        Quantity::C => "shape factor",
        Quantity::D => "peak factor",
        Quantity::E => "curvature factor",
        Quantity::S_h => "horizontal shift",
        Quantity::S_v => "vertical shift",
        Quantity::K => "stiffness B C D",
        Quantity::Peak => "highest friction coefficient",
        Quantity::PeakSlip => "slip at the peak",
    };
    format!("{what} [{}]", quantity_unit(quantity, direction))
}

/// The unit of a quantity: slip angles are in radians, slip ratios are numbers.
pub fn quantity_unit(quantity: Quantity, direction: ForceDirection) -> &'static str {
    match (direction, quantity) {
        (ForceDirection::Lateral, Quantity::B | Quantity::K) => "1/rad",
        (ForceDirection::Lateral, Quantity::S_h | Quantity::PeakSlip) => "rad",
        _ => "–",
    }
}

/// What the data of a car that are not known do to bands.
pub const CAR_ADDED: &str = "All are widened by what is not known of the car.";
/// What parts of the drives that were not fitted do to bands.
pub const SCATTER_ADDED: &str = "All are widened to the scatter of parts of the drives that were not fitted.";

/// Where bands, densities and intervals come from: the statement of terminal, page, report and manual. `widened` is what makes them
/// wider than that, in a sentence; empty if nothing does.
pub fn describe_uncertainty_source(source: UncertaintySource, widened: &str) -> String {
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
    format!("Bands and densities show {shown}; intervals are its middle 95 %, {WIDER}.{gap}{widened}")
}

/// What intervals have besides.
const WIDER: &str = "or what the profile of the likelihood does not rule out where that is wider";

/// The box of the parameters that are fitted, in a sentence.
pub fn describe_bounds(prior: &Prior) -> String {
    let of = |parameter: Parameter| {
        let [low, high] = prior.bounds.range(parameter);
        format!("{} {low} … {high}", parameter.symbol())
    };
    let free = Parameter::ALL.into_iter().filter(|parameter| prior.free[*parameter as usize]);
    format!("Box {}: {}.", prior.bounds.preset_name(), free.map(of).collect::<Vec<_>>().join(", "))
}
