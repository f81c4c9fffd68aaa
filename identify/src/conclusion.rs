//! Says what a test engineer can do with a result: which values to use, which not, and what to drive next.

use numerics::text::{decimals_for_std, format_significant};
use plugin::ResultTable;
use preparation::direction::ForceDirection;
use tire_inference::verdict::Identifiability;
use vehicle::{G, VehicleBody};

/// Half of the 95 % interval of an understeer gradient that is identified, at most [deg/g]: a tenth of a usual passenger car's 2 to 3 deg/g. A share of
/// the value has no meaning for a balance, which may be 0.
const BALANCE_TOLERANCE: f64 = 0.25;

/// A value as a test engineer knows it.
#[derive(Clone, Debug, PartialEq)]
pub struct EngineeringValue {
    /// As "front cornering stiffness".
    pub title: String,
    /// Its unit; empty of a number without one.
    pub unit: &'static str,
    /// The value.
    pub value: f64,
    /// Its 95 % interval.
    pub interval: [f64; 2],
    /// The verdict.
    pub verdict: Identifiability,
}

impl EngineeringValue {
    /// The cornering stiffness of an axle, `"front "`, from that over its load [1/rad]; without the load at rest [N] that ratio.
    pub fn cornering_stiffness(axle: &str, over_load: &Self, load: Option<f64>) -> Self {
        let over_load = over_load.clone();
        match load {
            Some(load) => {
                let kilonewtons = load / 1e3;
                Self {
                    title: format!("{axle}cornering stiffness"),
                    unit: "kN/rad",
                    ..over_load.scaled(kilonewtons)
                }
            }
            None => {
                Self { title: format!("{axle}cornering stiffness over load"), unit: "1/rad", ..over_load }
            }
        }
    }

    /// The understeer gradient from the cornering stiffnesses over load of both axles, whose errors count as independent.
    pub fn understeer_gradient([front, rear]: [&Self; 2]) -> Self {
        let degrees = |it: &Self| it.value.recip().to_degrees();
        let spread = |it: &Self| degrees(it) * (it.interval[1] - it.interval[0]) / 2.0 / it.value;
        let (value, half) = (degrees(front) - degrees(rear), spread(front).hypot(spread(rear)));
        let verdicts = [front.verdict, rear.verdict];
        let worst = [Identifiability::NotIdentifiable, Identifiability::Weak];
        let worst = worst.into_iter().find(|it| verdicts.contains(it)).unwrap_or(Identifiability::Identified);
        // The balance is a small difference of large numbers: what both axles tell may leave it open.
        let verdict = match worst {
            Identifiability::Identified if half.is_nan() || half > BALANCE_TOLERANCE => Identifiability::Weak,
            other => other,
        };
        Self {
            title: "balance: understeer gradient".to_owned(),
            unit: "deg/g",
            value,
            interval: [value - half, value + half],
            verdict,
        }
    }

    /// The same in a unit of which `factor` make one of the former.
    pub fn scaled(self, factor: f64) -> Self {
        Self { value: factor * self.value, interval: self.interval.map(|end| factor * end), ..self }
    }

    /// Decimals of the value and of the ends of its interval.
    fn decimals(&self) -> usize {
        // 95 % of a normal distribution are within 1.96 standard deviations.
        decimals_for_std(self.value, (self.interval[1] - self.interval[0]) / 3.92)
    }

    /// The value with its unit.
    pub fn value_text(&self) -> String {
        let places = self.decimals();
        format!("{:.places$} {}", self.value, self.unit).trim_end().to_owned()
    }

    /// The ends of its interval.
    pub fn interval_text(&self) -> String {
        let places = self.decimals();
        let ends =
            self.interval.map(|end| if end.is_finite() { format!("{end:.places$}") } else { "–".to_owned() });
        format!("{} … {}", ends[0], ends[1])
    }
}

/// What is known of the axles of a car, from cornering stiffness over load [1/rad] and peak friction, front and rear.
pub fn axle_values(
    stiffness: [EngineeringValue; 2],
    peaks: [EngineeringValue; 2],
    body: &VehicleBody,
) -> Vec<EngineeringValue> {
    const AXLES: [&str; 2] = ["front ", "rear "];
    let balance = EngineeringValue::understeer_gradient([&stiffness[0], &stiffness[1]]);
    let loads = axle_loads_at_rest(body);
    let stiffness = [0, 1]
        .map(|axle| EngineeringValue::cornering_stiffness(AXLES[axle], &stiffness[axle], Some(loads[axle])));
    let named = |(axle, peak)| EngineeringValue { title: format!("{axle}peak friction"), ..peak };
    stiffness.into_iter().chain(AXLES.into_iter().zip(peaks).map(named)).chain([balance]).collect()
}

/// The load of both axles at rest [N], front and rear.
pub fn axle_loads_at_rest(body: &VehicleBody) -> [f64; 2] {
    [body.l_r, body.l_f].map(|lever| body.m * G * lever / body.wheelbase())
}

/// What speaks against a result as a whole.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Reservation {
    /// Nothing.
    #[default]
    None,
    /// Something is likely wrong with the log.
    Log {
        /// What.
        finding: String,
        /// What to write or to do about it.
        correction: String,
    },
    /// No value holds.
    Refusal {
        /// Why.
        cause: String,
        /// What to drive or to do next, where that is known.
        remedy: Option<String>,
    },
}

impl Reservation {
    /// That of a log with an error that no fit makes up for.
    pub fn wrong_log(cause: String, correction: &str) -> Self {
        Self::Refusal { cause, remedy: Some(put_log_right(correction)) }
    }
}

fn put_log_right(correction: &str) -> String {
    format!("nothing yet. Put the log right first ({}), then identify again", first_sentence(correction))
}

/// What to do with a result.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Conclusion {
    /// The values.
    pub values: Vec<EngineeringValue>,
    /// What speaks against them as a whole.
    pub reservation: Reservation,
    /// Where no data are, as "the front curve beyond 9.1°".
    pub extrapolations: Vec<String>,
    /// What would tell the values that are not identified.
    pub drives: Vec<String>,
}

/// One of the three lines.
#[derive(Clone, Debug, PartialEq)]
pub struct ConclusionLine {
    /// As "You can use".
    pub head: &'static str,
    /// What.
    pub text: String,
}

/// How a verdict is shown beside what speaks against it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShownVerdict {
    /// Class of the style.
    pub class: &'static str,
    /// Words.
    pub words: &'static str,
}

impl Conclusion {
    /// The three lines.
    pub fn lines(&self) -> [ConclusionLine; 3] {
        let line = |head, text: String| ConclusionLine { head, text: format!("{text}.") };
        [
            line("You can use", self.usable()),
            line("You cannot use", self.unusable()),
            line("Drive this next", self.next_drive()),
        ]
    }

    /// The three lines as sentences.
    pub fn sentences(&self) -> impl Iterator<Item = String> {
        self.lines().into_iter().map(|ConclusionLine { head, text }| format!("{head}: {text}"))
    }

    fn usable(&self) -> String {
        let is_identified = |it: &&EngineeringValue| it.verdict == Identifiability::Identified;
        let named = |it: &EngineeringValue| format!("{} {}", it.title, it.value_text());
        let values: Vec<_> = self.values.iter().filter(is_identified).map(named).collect();
        match &self.reservation {
            Reservation::Refusal { .. } => "nothing of this result".to_owned(),
            _ if values.is_empty() => {
                "no value as a measurement; what is weak is a guess with its interval".to_owned()
            }
            Reservation::Log { .. } => {
                format!("{}, but only if the doctor is wrong about the log", values.join(", "))
            }
            Reservation::None => values.join(", "),
        }
    }

    fn unusable(&self) -> String {
        let mut parts = Vec::new();
        match &self.reservation {
            Reservation::Refusal { cause, .. } => return format!("any value. {}", first_sentence(cause)),
            Reservation::Log { finding, .. } => {
                parts.push(format!("anything unchecked: {}", first_sentence(finding)))
            }
            Reservation::None => {}
        }
        for verdict in [Identifiability::Weak, Identifiability::NotIdentifiable] {
            let of_verdict = self.values.iter().filter(|it| it.verdict == verdict);
            let titles: Vec<_> = of_verdict.map(|it| it.title.as_str()).collect();
            if !titles.is_empty() {
                parts.push(format!("{} ({})", titles.join(", "), verdict.to_display_text()));
            }
        }
        parts.extend(self.extrapolations.iter().cloned());
        if parts.is_empty() { "nothing is ruled out".to_owned() } else { parts.join("; ") }
    }

    fn next_drive(&self) -> String {
        match &self.reservation {
            Reservation::Log { correction, .. } => put_log_right(correction),
            Reservation::Refusal { remedy: Some(remedy), .. } => remedy.clone(),
            Reservation::Refusal { .. } => {
                "nothing before the cause is found; the failed tests say where to look".to_owned()
            }
            Reservation::None if self.drives.is_empty() => {
                "a manoeuvre that was not fitted, to see the values hold".to_owned()
            }
            Reservation::None => self.drives.join("; "),
        }
    }

    /// A verdict beside what speaks against it: nothing is green then.
    pub fn shown_verdict(&self, verdict: Identifiability) -> ShownVerdict {
        let words = match (&self.reservation, verdict) {
            (Reservation::Log { .. }, Identifiability::Identified) => "if the log is right",
            (Reservation::Refusal { .. }, Identifiability::Identified) => "not to be used",
            _ => return ShownVerdict { class: verdict.key(), words: verdict.to_display_text() },
        };
        ShownVerdict { class: Identifiability::Weak.key(), words }
    }

    /// The values as a table.
    pub fn table(&self) -> Option<ResultTable> {
        let row = |it: &EngineeringValue| {
            [
                it.title.clone(),
                it.value_text(),
                it.interval_text(),
                self.shown_verdict(it.verdict).words.to_owned(),
            ]
        };
        let head = ["value", "", "95 % interval", "verdict"];
        (!self.values.is_empty()).then(|| ResultTable::new(head, self.values.iter().map(row)))
    }
}

/// The first sentence of a text, without its stop.
pub fn first_sentence(text: &str) -> &str {
    let begins = |it: char| it.is_uppercase() || it.is_ascii_digit() || it == '`';
    let line = text.lines().next().unwrap_or_default();
    let end = line.match_indices(". ").find(|(at, _)| line[at + 2..].starts_with(begins));
    end.map_or(line, |(at, _)| &line[..at]).trim_end_matches('.')
}

/// A slip for a driver: an angle in degrees, a ratio in percent.
pub fn slip_text(direction: ForceDirection, slip: f64) -> String {
    match direction {
        ForceDirection::Lateral => format!("{}°", format_significant(slip.to_degrees(), 2)),
        ForceDirection::Longitudinal => format!("{} %", format_significant(100.0 * slip, 2)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stiffness(value: f64, verdict: Identifiability) -> EngineeringValue {
        EngineeringValue {
            title: String::new(),
            unit: "",
            value,
            interval: [value - 0.2, value + 0.2],
            verdict,
        }
    }

    #[test]
    fn stiffness_and_balance_are_those_of_the_textbook() {
        let body = VehicleBody { m: 1000.0, I_zz: 1000.0, l_f: 1.2, l_r: 1.8, h: 0.5 };
        let [front, rear] = axle_loads_at_rest(&body);
        assert!((front - 5886.0).abs() < 1e-9 && (front + rear - 9810.0).abs() < 1e-9);
        let over_load = [20.0, 25.0].map(|it| stiffness(it, Identifiability::Identified));
        let shown = EngineeringValue::cornering_stiffness("front ", &over_load[0], Some(front));
        assert_eq!(
            (shown.value_text().as_str(), shown.interval_text().as_str()),
            ("117.72 kN/rad", "116.54 … 118.90")
        );
        // m (l_r C_r - l_f C_f) / (L C_f C_r), in degrees for 9.81 m/s².
        let [c_f, c_r] = [20.0 * front, 25.0 * rear];
        let expected = body.m * (body.l_r * c_r - body.l_f * c_f) / (3.0 * c_f * c_r) * G;
        let gradient = EngineeringValue::understeer_gradient([&over_load[0], &over_load[1]]);
        assert!((gradient.value - expected.to_degrees()).abs() < 1e-9, "{gradient:?}");
        assert_eq!(gradient.verdict, Identifiability::Identified);
        let wide = |value| EngineeringValue {
            interval: [value - 5.0, value + 5.0],
            ..stiffness(value, Identifiability::Identified)
        };
        let open = EngineeringValue::understeer_gradient([&wide(20.0), &wide(20.5)]);
        assert_eq!(open.verdict, Identifiability::Weak, "{open:?}");
    }

    #[test]
    fn nothing_is_green_beside_what_contradicts_it() {
        let value = stiffness(20.0, Identifiability::Identified);
        let value = EngineeringValue::cornering_stiffness("front ", &value, None);
        let sound = Conclusion { values: vec![value], ..Conclusion::default() };
        let [usable, unusable, _] = sound.lines().map(|it| it.text);
        assert_eq!(
            (usable.as_str(), unusable.as_str()),
            ("front cornering stiffness over load 20.00 1/rad.", "nothing is ruled out.")
        );
        assert_eq!(sound.shown_verdict(Identifiability::Identified).class, "identified");
        let log = Reservation::Log {
            finding: "`r` is late. By 20 ms.".to_owned(),
            correction: "delay = 0.02".to_owned(),
        };
        let doubted = Conclusion { reservation: log, ..sound.clone() };
        assert_eq!(doubted.shown_verdict(Identifiability::Identified).class, "weak");
        let [usable, unusable, next] = doubted.lines().map(|it| it.text);
        assert!(
            usable.ends_with("only if the doctor is wrong about the log.") && next.contains("(delay = 0.02)")
        );
        assert_eq!(unusable, "anything unchecked: `r` is late.");
        let refusal = Reservation::Refusal {
            cause: "The model does not fit: cause unknown. 3 tests failed.".to_owned(),
            remedy: None,
        };
        let refused = Conclusion { reservation: refusal, ..sound };
        let [usable, unusable, _] = refused.lines().map(|it| it.text);
        assert_eq!(
            (usable.as_str(), unusable.as_str()),
            ("nothing of this result.", "any value. The model does not fit: cause unknown.")
        );
        assert_eq!(refused.shown_verdict(Identifiability::Identified).class, "weak");
    }
}
