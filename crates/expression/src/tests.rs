//! Checks values, verdicts and messages of conditions.

use std::f64::consts::PI;

use super::*;

mod agreement;
mod dimensions;
mod memory;
mod traces;

const COLUMNS: [&str; 8] =
    ["a.x", "a.y", "b.x", "plant.tyre.f[1,2]", "plant.der(v)", "plant.der(c.v[3])", "my node.a-b", "a.on"];

/// Marks the rows of these tests.
#[derive(Debug, Clone, PartialEq)]
struct Tested;

struct TestedRow<'a>(&'a [f64], &'a [String]);

impl ReadableRow<Tested> for TestedRow<'_> {
    fn number_at(&self, index: NumberIndex<Tested>) -> Option<f64> {
        self.0.get(index.position()).copied()
    }

    fn text_at(&self, index: TextIndex<Tested>) -> Option<&str> {
        self.1.get(index.position()).map(String::as_str)
    }
}

fn parse(text: &str) -> Result<Expression<Tested>, ParseError> {
    parse_in(text, &[])
}

/// Parses with these units of signals; the others are plain numbers.
fn parse_in(text: &str, units: &[(&str, &str)]) -> Result<Expression<Tested>, ParseError> {
    Expression::parse(text, &mut |name| {
        let operand = operand(name)?;
        let unit = match units.iter().find(|(signal, _)| *signal == name) {
            None => SignalUnit::Plain,
            Some((_, "")) => SignalUnit::Missing,
            Some((_, unit)) => SignalUnit::Known(Unit::parse(unit).expect("a unit"), (*unit).to_owned()),
        };
        Some(ResolvedSignal { operand, unit })
    })
}

fn operand(name: &str) -> Option<SignalOperand<Tested>> {
    match name {
        "r.number" => Some(SignalOperand::Either(NumberIndex::new(0), TextIndex::new(0))),
        "r.text" => Some(SignalOperand::Either(NumberIndex::new(0), TextIndex::new(0))),
        "a.state" => Some(SignalOperand::Text(TextIndex::new(0))),
        "b.state" => Some(SignalOperand::Text(TextIndex::new(1))),
        _ => {
            COLUMNS.iter().position(|column| *column == name).map(NumberIndex::new).map(SignalOperand::Number)
        }
    }
}

/// The outcome over samples of `a.x` at 0, 1, 2 ... s; `a.y` is its negative, `b.x` is 2, `a.state`
/// and `b.state` say what `a.x` and `b.x` are.
fn run(text: &str, tolerance: f64, samples: &[f64]) -> ConditionOutcome {
    let expression = parse(text).unwrap_or_else(|error| panic!("{text}: {error:?}"));
    let mut monitor = ConditionMonitor::new(expression, tolerance);
    for (time, x) in samples.iter().enumerate() {
        let texts = [format!("it's {x}"), "it's 2".to_owned()];
        let numbers = [*x, -x, 2.0, 30.0, 40.0, 50.0, 60.0, 1.0];
        monitor.push_sample(time as f64, &TestedRow(&numbers, &texts));
    }
    monitor.outcome()
}

#[test]
fn precedence_functions_and_names_are_those_of_mathematics() {
    #[rustfmt::skip]
    let cases = [
        ("1 + 2 * 3", 7.0),
        ("(1 + 2) * 3", 9.0),
        ("2 - 3 - 4", -5.0),
        ("8 / 4 / 2", 1.0),
        ("-2^2", -4.0),
        ("2^3^2", 512.0),
        ("2^-1 * 4", 2.0),
        ("2 - -3", 5.0),
        ("2.5e-3 * 1E3 + .5", 3.0),
        ("sin(pi / 6)", 0.5),
        ("deg(pi) + rad(180)", 360.0),
        ("atan2(1, -1)", 0.75 * PI),
        ("hypot(3, 4)", 5.0),
        ("min(3, 1, 2) + max(3, 1, 2)", 4.0),
        ("sign(-3) + sign(0) + 10 * sign(2)", 9.0),
        ("ln(exp(2)) + sqrt(16) + abs(-1)", 7.0),
        ("tan(atan(0.5)) + cos(0)", 1.5),
        ("plant.tyre.f[1,2] + plant.der(v) - plant.der(c.v[3])", 20.0),
        ("`my node.a-b`-a.on", 59.0),
        ("time + a.x", 5.0),
        ("1 + (1 < 2) + (2 < 1) + not 1", 2.0),
        ("isfinite(1) + isfinite(1/0) + isfinite(0/0)", 1.0),
    ];
    for (text, expected) in cases {
        let outcome = run(&format!("({text}) == 0"), 0.0, &[5.0]);
        let value = outcome.value.expect(text);
        assert!((value - expected).abs() < 1e-12, "{text}: {value}");
    }
}

#[test]
fn conditions_hold_at_every_sample_and_show_the_worst() {
    let samples = [1.0, -3.0, 2.0];
    #[rustfmt::skip]
    let cases = [
        ("a.x < 3", 0.0, true, 1.0, 2.0),
        ("a.x < 2", 0.0, false, 0.0, 2.0),
        ("a.x <= 2", 0.0, true, 0.0, 2.0),
        ("a.x < 2", 0.5, true, 0.5, 2.0),
        ("a.x > -2", 0.0, false, -1.0, 1.0),
        ("a.x >= -2", 1.0, true, 0.0, 1.0),
        ("a.x > -2", 1.0, false, 0.0, 1.0),
        ("abs(a.x) == 2", 0.5, false, -0.5, 0.0),
        ("abs(a.x) == 2", 1.0, true, 0.0, 0.0),
        ("a.x != 0", 0.5, true, 0.5, 0.0),
        ("a.x != 1", 0.0, false, 0.0, 0.0),
        ("a.x < 3 and a.x > -4", 0.0, true, 1.0, 1.0),
        ("a.x < 3 && a.x > -2", 0.0, false, -1.0, 1.0),
        ("a.x < 1.5 or a.y < 0", 0.0, true, 1.0, 0.0),
        ("a.x < 0 || a.y < -1", 0.0, false, 0.0, 0.0),
        ("not a.x > 3", 0.0, true, 1.0, 2.0),
        ("not a.x > 1", 0.0, false, -1.0, 2.0),
        ("not a.x > 1", 1.5, true, 0.5, 2.0),
        ("!(a.x > 3 or a.x < -4)", 0.0, true, 1.0, 1.0),
        ("not (a.x < 3 and a.x > -4)", 0.0, false, -2.0, 0.0),
        ("time < 1.5 or a.x > 0", 0.0, true, 0.5, 1.0),
    ];
    for (text, tolerance, passed, margin, at) in cases {
        let outcome = run(text, tolerance, &samples);
        assert_eq!(outcome.passed, passed, "{text} {outcome:?}");
        assert_eq!(outcome.margin, Some(margin), "{text} {outcome:?}");
        assert_eq!(outcome.at, Some(at), "{text} {outcome:?}");
        assert_eq!((outcome.samples, outcome.nan), (3, false), "{text}");
    }
}

#[test]
fn texts_are_equal_or_not() {
    for (text, passed, at) in [
        ("a.state == \"it's 2\"", false, Some(0.0)),
        ("a.state != 'it is 2'", true, Some(0.0)),
        ("'it' == 'it'", true, Some(0.0)),
        ("a.state == b.state", false, Some(0.0)),
        ("a.state == b.state or a.x != 2", true, Some(0.0)),
        ("not (a.state != b.state) or time < 1", true, Some(0.0)),
        ("(a.state) != (b.state)", false, Some(1.0)),
        ("mean(a.state == b.state) == 0.5", true, None),
        ("last(a.state == b.state) and not first(a.state == b.state)", true, None),
    ] {
        let outcome = run(text, 0.0, &[1.0, 2.0]);
        assert_eq!(outcome.passed, passed, "{text} {outcome:?}");
        assert!(!outcome.nan && (at.is_none() || outcome.at == at), "{text} {outcome:?}");
    }
    let outcome = run("a.state == b.state", 9.0, &[1.0]);
    assert_eq!((outcome.passed, outcome.margin, outcome.value), (false, None, None));
}

#[test]
fn both_sides_of_the_deciding_comparison_are_shown() {
    #[rustfmt::skip]
    let cases = [
        ("a.x < b.x + 1", 2.0, 3.0),
        ("a.x < 9 and abs(a.x) <= 3", 3.0, 3.0),
        ("max(abs(a.x)) > 1", 3.0, 1.0),
    ];
    for (text, value, limit) in cases {
        let outcome = run(text, 0.0, &[1.0, -3.0, 2.0]);
        assert_eq!((outcome.value, outcome.limit), (Some(value), Some(limit)), "{text}");
    }
}

#[test]
fn reductions_run_over_the_window() {
    let samples = [4.0, 1.0, 3.0, 2.0];
    #[rustfmt::skip]
    let cases = [
        ("max(a.x)", 4.0, Some(0.0)),
        ("min(a.x)", 1.0, Some(1.0)),
        ("max(max(a.x, 1))", 4.0, Some(0.0)),
        ("mean(a.x)", 2.5, None),
        ("sum(a.x)", 10.0, None),
        ("rms(a.x)", 7.5_f64.sqrt(), None),
        ("std(a.x)", 1.25_f64.sqrt(), None),
        ("first(a.x)", 4.0, Some(0.0)),
        ("last(a.x)", 2.0, Some(3.0)),
        ("count(a.x >= 2)", 3.0, None),
        ("mean(a.x > 1.5 and a.x < 3.5)", 0.5, None),
        ("quantile(a.x, 0)", 1.0, None),
        ("quantile(a.x, 0.5)", 2.5, None),
        ("quantile(a.x, 0.9)", 3.7, None),
        ("quantile(a.x, 1)", 4.0, None),
        ("max(abs(a.x - b.x)) / (last(time) - first(time))", 2.0 / 3.0, None),
        ("max(max(a.x), 3 + min(a.x))", 4.0, None),
        ("max(-abs(a.y))", -1.0, Some(1.0)),
    ];
    for (text, expected, at) in cases {
        let expression = parse(text).expect(text);
        assert!(expression.is_reduction() && !expression.is_condition(), "{text}");
        let outcome = run(&format!("{text} == 0"), 0.0, &samples);
        let value = outcome.value.expect(text);
        assert!((value - expected).abs() < 1e-12, "{text}: {value}");
        assert_eq!(outcome.at, at, "{text}");
    }
}

#[test]
fn reductions_decide_with_the_tolerance() {
    #[rustfmt::skip]
    let cases = [
        ("max(a.x) > 3", 0.0, false, -1.0),
        ("max(a.x) > 3", 1.5, true, 0.5),
        ("mean(a.x - b.x) / max(abs(b.x)) < 1", 0.0, true, 1.25),
        ("max(a.x) < 3 and min(a.x) > 0.75", 0.0, true, 0.25),
        // The tolerance is not for what is counted.
        ("count(a.x > 1.5) == 1", 0.5, true, 0.5),
    ];
    for (text, tolerance, passed, margin) in cases {
        let outcome = run(text, tolerance, &[1.0, 2.0]);
        assert_eq!(outcome.passed, passed, "{text} {outcome:?}");
        let found = outcome.margin.expect(text);
        assert!((found - margin).abs() < 1e-12, "{text} {outcome:?}");
    }
}

#[test]
fn nan_fails_whatever_the_condition() {
    let samples = [1.0, f64::NAN, 1.0];
    for text in [
        "a.x < 2",
        "not a.x < 2",
        "a.x != 2",
        "a.x < 2 or b.x == 2",
        "b.x == 2 or a.x < 2",
        "max(a.x, b.x) == 2",
        "a.x^0 == 1",
        "sqrt(-b.x) < 1 or a.x < 2",
        "max(a.x) < 2",
        "first(a.x) < 2",
        "count(a.x < 2) > 0",
        "quantile(a.x, 0.1) < 2",
        "min(b.x) > 0 and mean(a.x) < 2",
    ] {
        let outcome = run(text, 0.0, &samples);
        assert!(!outcome.passed && outcome.nan, "{text} {outcome:?}");
        let first = if text.contains("sqrt") { 0.0 } else { 1.0 };
        assert_eq!(outcome.at, Some(first), "{text}");
    }
    assert!(run("count(not isfinite(a.x)) == 1", 0.0, &samples).passed);
    assert!(!run("isfinite(a.x)", 0.0, &samples).passed);
}

#[test]
fn infinities_are_compared_and_a_window_without_samples_fails() {
    let outcome = run("a.x <= 1/0 and a.x > 0", 0.0, &[f64::INFINITY]);
    assert!(outcome.passed && !outcome.nan, "{outcome:?}");
    for text in ["a.x == a.x", "max(a.x) == max(a.x)", "1 < 2"] {
        let outcome = run(text, 0.0, &[]);
        assert!(!outcome.passed && !outcome.nan && outcome.samples == 0, "{text}");
    }
}

#[test]
fn conditions_and_numbers_are_told_apart() {
    #[rustfmt::skip]
    let cases = [
        ("a.x < 1", true),
        ("not a.on", true),
        ("a.on and a.x < 1", true),
        ("(a.x < 1)", true),
        ("isfinite(a.x)", true),
        ("a.state == 'on'", true),
        ("a.x + 1", false),
        ("max(a.x < 1)", false),
    ];
    for (text, condition) in cases {
        assert_eq!(parse(text).expect(text).is_condition(), condition, "{text}");
    }
}

/// Text, the place of the mistake, and parts of the message and of the help.
#[rustfmt::skip]
const MISTAKES: &[(&str, &str, &str, &str)] = &[
    ("a.x < a.z", "a.z", "unknown signal `a.z`", ""),
    ("speed < 3", "speed", "unknown signal", "node.variable"),
    ("`my node` < 3", "`my node`", "unknown signal `my node`", ""),
    ("rms < 3", "rms", "unknown signal", "`rms(...)`"),
    ("peak(a.x) < 3", "peak", "unknown function `peak`", "quantile"),
    ("maxx(a.x) < 3", "maxx", "unknown function `maxx`", "did you mean `max`?"),
    ("max(a.x) < b.x", "b.x", "`max(a.x)` is one for the window", "`max(b.x)`"),
    ("rms(a.x) < time", "time", "one value per sample", "two checks"),
    ("max(mean(a.x)) < 1", "mean(a.x)", "and so does", "one argument"),
    ("mean(abs(max(a.x))) < 1", "max(a.x)", "and so does", ""),
    ("0 < a.x < 1", "<", "one comparison at a time", "a < b and b < c"),
    ("a.x = 1", "=", "found `=`", "`==`"),
    ("a.x & 1", "&", "found `&`", "`&&`"),
    ("a.x < 1 2", "2", "expected an operator or the end, found `2`", ""),
    ("a.x <", "", "found the end", ""),
    ("(a.x < 1", "", "expected an operator or `)`", ""),
    ("abs(a.x < 1", "", "expected `,` or `)`", ""),
    ("a.x < )", ")", "expected a number", ""),
    ("atan2(a.x) < 1", "atan2(a.x)", "2 argument(s) for `atan2`, found 1", ""),
    ("mean(a.x, 1) < 1", "mean(a.x, 1)", "one argument for `mean`, found 2", ""),
    ("quantile(a.x, 2) < 1", "quantile(a.x, 2)", "from 0 to 1", "95 %"),
    ("rating(a.x) > 0.8", "rating(a.x)", "expected a signal and its reference", "18571"),
    ("rating(a.x, max(a.y)) > 0", "max(a.y)", "and so does what is inside", ""),
    ("corridor(a.x, a.y) < 1", "corridor(a.x, a.y)", "`(x, y, x_ref, y_ref, dx, dy)`", "abs(x_ref)"),
    ("ratings(a.x, a.y) > 0", "ratings", "unknown function", "did you mean `rating`?"),
    ("a.x < 1e999", "1e999", "finite number", ""),
    ("a.x < .", ".", "finite number", ""),
    ("`a.x < 1", "`a.x < 1", "closing backtick", ""),
    ("a.state < 'on'", "a.state < 'on'", "`==` and `!=`", ""),
    ("a.state == 1", "a.state == 1", "a text with a number", "'1'"),
    ("a.x == 'on'", "a.x == 'on'", "a text with a number", ""),
    ("a.state", "a.state", "is a text", "=="),
    ("not a.state", "a.state", "is a text", "=="),
    ("-'on' < 1", "'on'", "is a text", ""),
    ("abs(a.state) < 1", "a.state", "is a text", "=="),
    ("last(a.state) == 'on'", "a.state", "is a text", "a.state == "),
    ("a.x < 1 and a.state", "a.state", "is a text", "=="),
    ("a.state + 1 < 2", "a.state", "is a text", "=="),
    ("a.state == 'on", "'on", "closing quote", ""),
    ("a.x ≤ 1", "≤", "found `≤`", ""),
    ("", "", "found the end", ""),
];

#[test]
fn errors_name_the_place_and_help() {
    for (text, place, message, help) in MISTAKES {
        let error = parse(text).expect_err(text);
        assert!(error.message.contains(message), "{text}: {error:?}");
        assert!(error.help.clone().unwrap_or_default().contains(help), "{text}: {error:?}");
        assert_eq!(&text[error.span.clone()], *place, "{text}: {error:?}");
        let unknown = message.starts_with("unknown signal");
        assert_eq!(error.unknown.is_some(), unknown, "{text}: {error:?}");
    }
}

#[test]
fn a_hostile_text_is_refused() {
    for (piece, closing) in [("(", ""), ("-", ""), ("not ", ""), ("2^", ""), ("abs(", "")] {
        for count in [398, 100_000] {
            let error = parse(&format!("{}{closing}", piece.repeat(count)));
            assert!(error.is_err(), "{piece}");
        }
    }
}

#[test]
fn a_result_is_a_text_where_it_is_compared_with_one() {
    for (text, texts, numbers) in [
        ("r.text == 'on'", 1, 0),
        ("'on' == r.text", 1, 0),
        ("(r.text) != a.state", 2, 0),
        ("'on' == (r.text) and r.number < 1", 1, 1),
        ("r.number == 1", 0, 1),
        ("abs(r.number) < r.number", 0, 2),
    ] {
        let expression = parse(text).expect(text);
        assert_eq!(expression.text_indices().len(), texts, "{text}");
        assert_eq!(expression.number_indices().len(), numbers, "{text}");
    }
    for text in ["r.text < 'on'", "r.text + 'on' == 1", "'on' <= r.text"] {
        assert!(parse(text).is_err(), "{text}");
    }
}

#[test]
fn the_unit_of_a_comparison_is_that_of_its_values() {
    let units = [("a.x", "m/s"), ("a.y", "m/s"), ("b.x", "deg")];
    for (text, unit) in [
        ("abs(a.y / a.x) < 0.5 deg", Some("rad")),
        ("0.5 deg > abs(a.y / a.x)", Some("deg")),
        ("abs(a.y / a.x + b.x) < 0.5 deg", Some("rad")),
        ("b.x < 0.5 rad", Some("deg")),
        ("a.x < 100 km/h", Some("m/s")),
        ("a.y / a.x < 2", None),
    ] {
        assert_eq!(parse_in(text, &units).expect(text).compared_unit(), unit, "{text}");
    }
}
