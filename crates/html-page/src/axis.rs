//! Places values on an axis and finds round ones for its ticks.

/// An axis of a plot.
#[derive(Clone, Debug)]
pub struct Axis {
    label: String,
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Axis {
    /// A linear axis. Ends that are no numbers, or in the wrong order, become 0 to 1.
    pub fn linear(label: &str, low: f64, high: f64) -> Self {
        let (low, high) =
            if low < high && (high - low).is_finite() { (low, high) } else { (0.0, 1.0) };
        Self { label: label.into(), low, high, logarithmic: false }
    }

    /// A logarithmic axis of positive numbers.
    pub fn logarithmic(label: &str, low: f64, high: f64) -> Self {
        let (low, high) =
            if 0.0 < low && low < high && high.is_finite() { (low, high) } else { (0.1, 1.0) };
        Self { label: label.into(), low, high, logarithmic: true }
    }

    /// A linear axis about values, a twentieth wider than they are.
    pub fn about(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        let (low, high) =
            finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
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
    pub fn on_linear(&self, value: f64) -> f64 {
        if self.logarithmic { value.log10() } else { value }
    }

    /// What such an axis says.
    pub fn linear_label(&self) -> String {
        if self.logarithmic { format!("log10 of {}", self.label) } else { self.label.clone() }
    }

    /// Position between the ends, 0 to 1 inside.
    pub fn share(&self, value: f64) -> f64 {
        if self.logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Round values from end to end, with their text.
    pub fn ticks(&self, about: f64) -> Vec<(f64, String)> {
        if self.logarithmic {
            let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
            let round = decades.flat_map(|decade| {
                [1.0, 2.0, 5.0].map(|mantissa| mantissa * 10.0_f64.powi(decade))
            });
            let inside = round.filter(|tick| (self.low * 0.999..=self.high * 1.001).contains(tick));
            return inside.map(|tick| (tick, power(tick))).collect();
        }
        let rough = (self.high - self.low) / about;
        let decade = 10.0_f64.powf(rough.log10().floor());
        let step = decade
            * [1.0, 2.0, 5.0].into_iter().find(|&step| step * decade >= rough).unwrap_or(10.0);
        let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        (first..=last)
            .map(|k| k as f64 * step)
            .map(|tick| (tick, format!("{tick:.decimals$}")))
            .collect()
    }
}

/// A number of one digit, with an exponent where zeros would be many.
fn power(value: f64) -> String {
    let decade = value.log10().floor();
    match decade {
        -4.0..6.0 => format!("{value:.*}", (-decade).max(0.0) as usize),
        _ => format!("{value:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let texts = |axis: Axis| axis.ticks(5.0).into_iter().map(|tick| tick.1).collect::<Vec<_>>();
        assert_eq!(texts(Axis::linear("", 0.0, 1.0)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(texts(Axis::linear("", -130.0, 210.0)), ["-100", "0", "100", "200"]);
        assert_eq!(texts(Axis::linear("", 1.4981, 1.5024)), ["1.499", "1.500", "1.501", "1.502"]);
        assert_eq!(
            texts(Axis::logarithmic("", 1.0, 100.0)),
            ["1", "2", "5", "10", "20", "50", "100"]
        );
        assert_eq!(texts(Axis::logarithmic("", 3e-5, 3e-4)), ["5e-5", "0.0001", "0.0002"]);
    }

    #[test]
    fn ends_that_are_no_numbers_are_replaced() {
        for axis in
            [Axis::about("", []), Axis::linear("", f64::NAN, 1.0), Axis::logarithmic("", -1.0, 1.0)]
        {
            assert!(axis.low < axis.high);
        }
    }
}
