//! Places values on an axis and finds round ones for its ticks.

/// Space between two texts [px].
const CLEAR: f64 = 8.0;
/// An axis with more decades between its ticks would have none.
const MOST_DECADES: i32 = 300;

/// A value and its text.
pub type AxisTick = (f64, String);

/// An axis of a plot.
#[derive(Clone, Debug)]
pub struct PlotAxis {
    label: String,
    low: f64,
    high: f64,
    logarithmic: bool,
    /// Of an axis of names, those at 0, 1, 2, ...
    names: Vec<String>,
}

impl PlotAxis {
    /// A linear axis. Ends that are no numbers, or in the wrong order, become 0 to 1.
    pub fn linear(label: &str, low: f64, high: f64) -> Self {
        let (low, high) = if low < high && (high - low).is_finite() { (low, high) } else { (0.0, 1.0) };
        Self { label: label.into(), low, high, logarithmic: false, names: Vec::new() }
    }

    /// A logarithmic axis of positive numbers.
    pub fn logarithmic(label: &str, low: f64, high: f64) -> Self {
        let (low, high) = if 0.0 < low && low < high && high.is_finite() { (low, high) } else { (0.1, 1.0) };
        Self { label: label.into(), low, high, logarithmic: true, names: Vec::new() }
    }

    /// An axis of names at 0, 1, 2, ...
    pub fn of_names(label: &str, names: &[&str]) -> Self {
        let names = names.iter().map(|&name| name.to_owned()).collect::<Vec<_>>();
        let high = names.len() as f64 - 0.5;
        Self { label: label.into(), low: -0.5, high: high.max(0.5), logarithmic: false, names }
    }

    /// A linear axis about values, a twentieth wider than they are.
    pub fn around_values(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let space = 0.05 * (high - low).max(1e-9 * high.abs());
        Self::linear(label, low - space, high + space)
    }

    /// What it says.
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Lower end.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// Upper end.
    pub fn high(&self) -> f64 {
        self.high
    }

    /// A value on an axis that knows no logarithms.
    pub fn to_linear_scale(&self, value: f64) -> f64 {
        if self.logarithmic { value.log10() } else { value }
    }

    /// What such an axis says.
    pub fn linear_label(&self) -> String {
        if self.logarithmic { format!("log10 of {}", self.label) } else { self.label.clone() }
    }

    /// Position between the ends, 0 to 1 inside.
    pub fn relative_position(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Round values from end to end, with their texts, as many as fit a length [px] with `spacing` [px] between them and no text on
    /// another: `size` is that of a text [px].
    pub fn ticks(&self, length: f64, spacing: f64, size: impl Fn(&str) -> f64) -> Vec<AxisTick> {
        if !self.names.is_empty() {
            return self.name_ticks(length, size);
        }
        let room = |ticks: &Vec<AxisTick>| {
            ticks.windows(2).all(|pair| {
                let apart = (self.relative_position(pair[1].0) - self.relative_position(pair[0].0)) * length;
                apart >= 0.5 * (size(&pair[0].1) + size(&pair[1].1)) + CLEAR
            })
        };
        let most = (length / spacing).floor().max(1.0) as i32;
        let linear = (1..=most).rev().map(|about| self.linear_ticks(f64::from(about)));
        let logarithmic = self.logarithmic.then(|| {
            let fine = [&[1.0, 2.0, 5.0][..], &[1.0, 3.0]].map(|digits| self.logarithmic_ticks(1, digits));
            let coarse = (1..=MOST_DECADES).map(|every| self.logarithmic_ticks(every, &[1.0]));
            fine.into_iter().chain(coarse).filter(|ticks| ticks.len() > 1)
        });
        let found = logarithmic.into_iter().flatten().chain(linear).find(room);
        found.unwrap_or_default()
    }

    /// The names, cut to the room that each has; every other one where that is too little.
    fn name_ticks(&self, length: f64, size: impl Fn(&str) -> f64) -> Vec<AxisTick> {
        const LEAST: f64 = 20.0;
        let room = length / self.names.len() as f64;
        let every = ((LEAST + CLEAR) / room).ceil().max(1.0) as usize;
        let room = room * every as f64 - CLEAR;
        let cut = |name: &String| {
            let letters: Vec<char> = name.chars().collect();
            let mut shown = name.clone();
            for kept in (1..letters.len()).rev() {
                if size(&shown) <= room {
                    break;
                }
                // The end of a name says more than its beginning.
                shown = std::iter::once('…').chain(letters[letters.len() - kept..].iter().copied()).collect();
            }
            shown
        };
        let chosen = self.names.iter().enumerate().step_by(every);
        chosen.map(|(place, name)| (place as f64, cut(name))).collect()
    }

    /// Multiples of every so many powers of ten.
    fn logarithmic_ticks(&self, every: i32, digits: &[f64]) -> Vec<AxisTick> {
        let ends = [self.low.log10().floor() as i32, self.high.log10().ceil() as i32];
        let decades = (ends[0]..=ends[1]).filter(|decade| decade % every == 0);
        let round = decades.flat_map(|decade| digits.iter().map(move |digit| digit * 10.0_f64.powi(decade)));
        let inside = round.filter(|tick| (self.low * 0.999..=self.high * 1.001).contains(tick));
        inside.map(|tick| (tick, format_tick(tick))).collect()
    }

    /// Multiples of 1, 2 or 5 times a power of ten, hardly more than `about`.
    fn linear_ticks(&self, about: f64) -> Vec<AxisTick> {
        let rough = (self.high - self.low) / about;
        let decade = 10.0_f64.powf(rough.log10().floor());
        let step = decade * [1.0, 2.0, 5.0].into_iter().find(|&step| step * decade >= rough).unwrap_or(10.0);
        let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        let ticks = (first..=last).map(|k| k as f64 * step);
        ticks.map(|tick| (tick, format!("{tick:.decimals$}"))).collect()
    }
}

/// A number of one digit, with an exponent where zeros would be many.
fn format_tick(value: f64) -> String {
    let decade = value.log10().floor();
    match decade {
        -4.0..6.0 => format!("{value:.*}", (-decade).max(0.0) as usize),
        _ => format!("{value:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With letters 7 px wide.
    fn texts(axis: &PlotAxis, length: f64) -> Vec<String> {
        let ticks = axis.ticks(length, 55.0, |text| 7.0 * text.chars().count() as f64);
        ticks.into_iter().map(|tick| tick.1).collect()
    }

    #[test]
    fn ticks_are_round_and_inside() {
        let of = |axis: PlotAxis| texts(&axis, 300.0);
        assert_eq!(of(PlotAxis::linear("", 0.0, 1.0)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(of(PlotAxis::linear("", -130.0, 210.0)), ["-100", "0", "100", "200"]);
        assert_eq!(of(PlotAxis::linear("", 1.4981, 1.5024)), ["1.499", "1.500", "1.501", "1.502"]);
        assert_eq!(of(PlotAxis::logarithmic("", 1.0, 100.0)), ["1", "2", "5", "10", "20", "50", "100"]);
        assert_eq!(of(PlotAxis::logarithmic("", 3e-5, 3e-4)), ["5e-5", "0.0001", "0.0002"]);
        // No decade starts inside: round numbers between.
        assert_eq!(of(PlotAxis::logarithmic("", 2.1, 4.9)), ["3", "4"]);
    }

    #[test]
    fn names_are_cut_to_their_room() {
        let of = |names: &[&str], length| texts(&PlotAxis::of_names("", names), length);
        assert_eq!(of(&["dry", "wet"], 300.0), ["dry", "wet"]);
        assert_eq!(of(&["a long name of stock", "sport"], 120.0), ["… stock", "sport"]);
        assert_eq!(of(&["a", "b", "c", "d", "e"], 100.0), ["a", "c", "e"]);
    }

    #[test]
    fn no_text_stands_on_another() {
        for axis in [
            PlotAxis::logarithmic("", 1e-12, 1e9),
            PlotAxis::logarithmic("", 1e-150, 1e150),
            PlotAxis::logarithmic("", 0.9, 1.1),
            PlotAxis::linear("", -1.23e5, 1.24e5),
            PlotAxis::linear("", 0.000_123_1, 0.000_123_9),
            PlotAxis::linear("", 1e9, 1e9 + 3.0),
        ] {
            for length in [60.0, 130.0, 266.0, 1000.0] {
                let width = |text: &str| 7.0 * text.chars().count() as f64;
                let ticks = axis.ticks(length, 55.0, width);
                for pair in ticks.windows(2) {
                    let [a, b] = [&pair[0], &pair[1]].map(|tick| axis.relative_position(tick.0) * length);
                    let clear = b - a - 0.5 * (width(&pair[0].1) + width(&pair[1].1));
                    assert!(clear >= CLEAR, "{axis:?} {length} {ticks:?}");
                }
                assert!(length < 200.0 || !ticks.is_empty(), "{axis:?} {length}");
            }
        }
    }

    #[test]
    fn ends_that_are_no_numbers_are_replaced() {
        for axis in [
            PlotAxis::around_values("", []),
            PlotAxis::linear("", f64::NAN, 1.0),
            PlotAxis::logarithmic("", -1.0, 1.0),
        ] {
            assert!(axis.low < axis.high);
        }
    }
}
