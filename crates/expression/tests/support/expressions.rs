//! What tries damaged conditions.

use std::path::Path;

use damage::FuzzTarget;
use expression::{
    ConditionMonitor, Expression, NumberIndex, ReadableRow, ResolvedSignal, SignalOperand, SignalUnit,
    TextIndex,
};
use units::Unit;

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "expressions",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../expression/tests/corpus/expressions"),
    sound,
    words: &[
        "abs", "sqrt", "sin", "cos", "tan", "atan", "exp", "ln", "sign", "deg", "rad", "isfinite", "atan2",
        "hypot", "min", "max", "mean", "rms", "std", "sum", "first", "last", "count", "quantile", "rating",
        "corridor", " and ", " or ", " not ", "||", "&&", "!", "==", "!=", "<=", ">=", "<", ">", "+", "-",
        "*", "/", "^", "(", ")", ",", "'", "\"", "`", " m", " km/h", " deg", " degC", " 1/s", " ms", "time",
        "pi", "true", "a.x", "b.x", "a.state", "r.either", "a.angle", "c.no", "0", "1e308", "1e-320", "0.5",
    ],
    own: None,
    attempt,
};

fn sound() -> Vec<Vec<u8>> {
    let texts = [
        "abs(a.x - b.x) < 0.3 m and a.flag == 0",
        "rms(a.x - b.x) / max(abs(b.x)) < 0.01",
        "a.state == 'armed' or not (b.x >= 2 km and time < 3 ms)",
        "quantile(abs(a.angle), 0.95) <= 5 deg",
        "3.0 m / a.x + -2 ^ 2 ^ 0.5 != hypot(b.flag, min(1, 2, 3))",
        "count(a.x > 2 m) > 3 && first(b.x) < last(b.x)",
        "`my node.a-b` * pi < exp(ln(sqrt(4))) || isfinite(tan(a.angle))",
        "r.either == 'x' and r.either != a.state",
        "atan2(a.x, b.x) < 10 deg",
        "std(a.flag) + mean(b.flag) < sum(sign(a.flag))",
        "rating(a.x, b.x) > 0.8 and rating_phase(abs(a.x), 2 km) > 0.5",
        "corridor(a.x, a.angle, b.x, 3 deg, 0.1 + 0.06 * abs(b.x), 5 deg) <= 1",
    ];
    texts.map(|text| text.as_bytes().to_vec()).to_vec()
}

/// Marks the rows of this target.
#[derive(Debug, Clone, PartialEq)]
struct Tried;

struct Row([f64; 5], [&'static str; 2]);

impl ReadableRow<Tried> for Row {
    fn number_at(&self, index: NumberIndex<Tried>) -> Option<f64> {
        self.0.get(index.position()).copied()
    }

    fn text_at(&self, index: TextIndex<Tried>) -> Option<&str> {
        self.1.get(index.position()).copied()
    }
}

fn signal(name: &str) -> Option<ResolvedSignal<Tried>> {
    let number = |place| SignalOperand::Number(NumberIndex::new(place));
    let known =
        |name: &str| SignalUnit::Known(Unit::parse(name).expect("a unit of the table"), name.to_owned());
    let (operand, unit) = match name {
        "a.x" => (number(0), known("m")),
        "b.x" => (number(1), known("km")),
        "a.angle" => (number(2), known("rad")),
        "a.flag" | "b.flag" => (number(3), SignalUnit::Plain),
        "my node.a-b" => (number(4), SignalUnit::Missing),
        "a.state" => (SignalOperand::Text(TextIndex::new(0)), SignalUnit::Plain),
        "r.either" => (SignalOperand::Either(NumberIndex::new(3), TextIndex::new(1)), SignalUnit::Plain),
        _ => return None,
    };
    Some(ResolvedSignal { operand, unit })
}

/// Reads the condition and judges some samples by it, the strange ones among them.
fn attempt(bytes: &[u8], _: &Path) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let expression = match Expression::parse(&text, &mut signal) {
        Ok(expression) => expression,
        Err(error) => {
            // A message underlines these letters.
            assert!(text.get(error.span.clone()).is_some(), "{:?} is no part of it", error.span);
            assert!(!error.message.is_empty());
            return false;
        }
    };
    let _ = (expression.signal_bounds(), expression.unit(), expression.is_condition());
    let _ = (expression.number_indices(), expression.text_indices(), expression.compared_unit());
    let numbers = [1.0, -2.5, 0.0, 1e308, f64::NAN, f64::INFINITY, 1e-320];
    let mut monitor = ConditionMonitor::new(expression, 0.1);
    for (tick, number) in numbers.into_iter().enumerate() {
        let row = Row([number, 1.0, -number, (tick % 2) as f64, 3.0], ["armed", "x"]);
        monitor.push_sample(tick as f64, &row);
    }
    let outcome = monitor.outcome();
    assert_eq!(outcome.samples, numbers.len() as u64);
    assert!(!(outcome.passed && outcome.nan), "what is no number passed");
    true
}
