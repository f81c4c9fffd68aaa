//! Chooses the ends of an axis so that the viewer writes several numbers on it.

/// The viewer puts numbers at multiples of a power of ten, and needs some space for each: so many spaces fit into a plot among
/// five on a screen of 1080 pixels.
const SPACES: f64 = 7.0;
/// Numbers at least.
const NUMBERS: f64 = 3.0;
/// Space above and below the curves, as a share of their range.
const MARGIN: f64 = 0.05;
/// Space of a number at an edge, as a share of the distance of two numbers at most.
const EDGE: f64 = 0.15;

/// The ends of an axis for values from `low` to `high`.
pub(super) fn readable_axis_range([low, high]: [f64; 2]) -> [f64; 2] {
    let least = 1e-6 * low.abs().max(high.abs()).max(1e-6);
    let margin = MARGIN * (high - low).max(least);
    let (mut low, mut high) = (low - margin, high + margin);
    let step = 10.0_f64.powf(((high - low) / SPACES).log10().ceil());
    // A number at the very edge would be cut off.
    let edge = EDGE * step;
    let (mut first, mut last) = (((low + edge) / step).ceil(), ((high - edge) / step).floor());
    while last - first + 1.0 < NUMBERS {
        let above = (last + 1.0) * step + edge;
        let below = (first - 1.0) * step - edge;
        if above - high <= low - below {
            (last, high) = (last + 1.0, above);
        } else {
            (first, low) = (first - 1.0, below);
        }
    }
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_has_three_numbers_and_all_values() {
        for ends in [[45.0, 180.0], [79.86, 80.12], [-0.3, 0.9], [3.0, 3.0], [0.0, 0.0], [-1e-9, 7e5]] {
            let [low, high] = readable_axis_range(ends);
            assert!(low < ends[0] && ends[1] < high, "{ends:?}: {low} {high}");
            let exponent = ((high - low) / SPACES).log10().ceil();
            let step = 10.0_f64.powf(exponent);
            let numbers = (high / step).floor() - (low / step).ceil() + 1.0;
            assert!((3.0..=8.0).contains(&numbers), "{ends:?}: {low} {high} {numbers}");
        }
        assert_eq!(readable_axis_range([0.0, 40.0]), [-2.0, 42.0]);
    }
}
