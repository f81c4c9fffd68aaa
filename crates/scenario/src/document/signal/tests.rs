//! Checks shapes, edges, phases and messages.

use super::*;

fn build(text: &str) -> Result<Signal, SignalError> {
    let part: Part = toml::from_str(text).unwrap_or_else(|error| panic!("{text}\n{error}"));
    part.build(1, 10.0)
}

fn signal(text: &str) -> Signal {
    build(text).unwrap_or_else(|error| panic!("{text}\n{error}"))
}

#[test]
fn shapes_have_their_values() {
    let sine_of_1 = 1_f64.sin();
    #[rustfmt::skip]
    let cases: &[(&str, &[(f64, f64)])] = &[
        ("constant = 2.5", &[(0.0, 2.5), (10.0, 2.5), (-1.0, 0.0)]),
        ("from = 1.0\nuntil = 2.0\nconstant = 3.0", &[(0.99, 0.0), (1.0, 3.0), (1.99, 3.0), (2.0, 0.0)]),
        ("from = 1.0\nuntil = 5.0\nfade_in = 2.0\nfade_out = 1.0\nconstant = 4.0", &[(1.0, 0.0), (2.0, 2.0), (3.0, 4.0), (4.0, 4.0), (4.75, 1.0), (5.0, 0.0)]),
        ("fade_out = 2.0\nconstant = 4.0", &[(8.0, 4.0), (9.0, 2.0), (10.0, 0.0), (11.0, 0.0)]),
        ("step = { at = 2.0, after = 5.0 }", &[(1.99, 0.0), (2.0, 5.0), (9.0, 5.0)]),
        ("from = 3.0\nstep = { at = 2.0, before = 1.0, after = 5.0 }", &[(2.0, 0.0), (3.0, 1.0), (4.9, 1.0), (5.0, 5.0)]),
        ("ramp = { start = 1.0, end = 3.0, before = 2.0, after = -2.0 }", &[(0.0, 2.0), (1.0, 2.0), (1.5, 1.0), (3.0, -2.0), (9.0, -2.0)]),
        ("sine = { amplitude = 2.0, frequency = 0.25, offset = 1.0 }", &[(0.0, 1.0), (1.0, 3.0), (2.0, 1.0), (3.0, -1.0)]),
        ("from = 1.0\nsine = { amplitude = 2.0, frequency = 0.0, phase = 1.0 }", &[(1.0, 2.0 * sine_of_1), (0.0, 0.0)]),
        ("chirp = { amplitude = 1.0, f_start = 0.0, f_end = 2.0, duration = 4.0 }", &[(0.0, 0.0), (1.0, 1.0), (2.0, 0.0), (4.125, 1.0), (4.5, 0.0)]),
        ("square = { amplitude = 2.0, period = 4.0, offset = 1.0 }", &[(0.0, 3.0), (1.9, 3.0), (2.0, -1.0), (3.9, -1.0), (4.0, 3.0)]),
        ("square = { amplitude = 2.0, period = 4.0, sharpness = 50.0 }", &[(0.0, 0.0), (1.0, 2.0), (3.0, -2.0)]),
        ("table = { time = [1.0, 2.0, 4.0], value = [5.0, 1.0, 3.0] }", &[(0.0, 5.0), (1.0, 5.0), (1.5, 3.0), (2.0, 1.0), (3.0, 2.0), (9.0, 3.0)]),
        ("table = { time = [1.0, 2.0], value = [5.0, 1.0], interpolation = \"hold\" }", &[(0.0, 5.0), (1.99, 5.0), (2.0, 1.0), (9.0, 1.0)]),
        ("part = [{ constant = 1.0 }, { from = 2.0, until = 3.0, constant = 10.0 }]", &[(1.0, 1.0), (2.0, 11.0), (3.0, 1.0)]),
    ];
    for (text, points) in cases {
        let signal = signal(text);
        for (time, expected) in *points {
            let value = signal.value_at(*time);
            assert!((value - expected).abs() < 1e-9, "{text}\n{time}: {value}");
        }
    }
}

/// A signal by its values.
fn shown(signal: &Signal) -> Vec<f64> {
    (0..20).map(|k| signal.value_at(0.1 * f64::from(k))).collect()
}

#[test]
fn a_multisine_reaches_its_peak_and_no_more() {
    for window in ["", "from = 1.0\nuntil = 4.0", "from = 2.0\nfade_in = 3.0\nfade_out = 4.0"] {
        for sine in [
            "peak = 0.5, frequencies = [0.3, 0.7, 1.9, 4.1]",
            "peak = 0.5, frequencies = [0.3, 0.7], weights = [1.0, 3.0], phases = [0.0, 1.0]",
            "peak = 0.5, frequencies = [0.05], phases = [0.0]",
        ] {
            let signal = signal(&format!("{window}\nmultisine = {{ {sine} }}"));
            let times = (0..100_000).map(|i| f64::from(i) * 1e-4);
            let peak = times.map(|t| signal.value_at(t).abs()).fold(0.0, f64::max);
            assert!((peak - 0.5).abs() < 2e-4, "{window} {sine}: {peak}");
        }
    }
}

#[test]
fn random_phases_depend_on_the_seed_and_the_name_alone() {
    let text = "multisine = { peak = 1.0, frequencies = [0.3, 0.7, 1.9] }";
    let part: Part = toml::from_str(text).expect(text);
    let fixed = text.replace(" }", ", seed = 4 }");
    let fixed: Part = toml::from_str(&fixed).expect(text);
    let build = |part: &Part, seed| part.build(seed, 10.0).expect(text);
    assert_eq!(shown(&build(&part, 4)), shown(&build(&part, 4)));
    assert_ne!(shown(&build(&part, 4)), shown(&build(&part, 5)));
    let named = |name| toml::from_str(&format!("name = \"{name}\"\n{text}")).expect(text);
    assert_ne!(shown(&build(&named("a.x"), 4)), shown(&build(&named("a.y"), 4)));
    assert_eq!(shown(&build(&fixed, 1)), shown(&build(&fixed, 2)));
    assert_eq!(shown(&build(&fixed, 1)), shown(&build(&part, 4)));
    let wave = "{ multisine = { peak = 1.0, frequencies = [0.3, 0.7] } }";
    let [one, two] = [format!("part = [{wave}]"), format!("part = [{wave}, {wave}]")]
        .map(|text| build(&toml::from_str(&text).expect(wave), 4).value_at(0.3));
    assert_ne!(two, 2.0 * one);
}

#[test]
fn edges_are_met_at_every_multiple_of_a_decimal_step() {
    let signal = signal("from = 0.3\nuntil = 0.7\nstep = { at = 0.2, before = 1.0, after = 2.0 }");
    for (step, expected) in [(29, 0.0), (30, 1.0), (49, 1.0), (50, 2.0), (69, 2.0), (70, 0.0)] {
        for rounding in [-1e-12, 0.0, 1e-12] {
            let time = f64::from(step) * 0.01 + rounding;
            assert_eq!(signal.value_at(time), expected, "{time}");
        }
    }
}

#[test]
fn errors_show_the_place() {
    #[rustfmt::skip]
    let cases = [
        ("name = \"a\"", "\"a\"", "no shape: expected one of constant"),
        ("name = \"a\"\nconstant = 1.0\nsine = { amplitude = 1.0, frequency = 1.0 }", "{ amplitude = 1.0, frequency = 1.0 }", "found `constant` and `sine`"),
        ("part = [{ from = 1.0 }]", "{ from = 1.0 }", "no shape"),
        ("part = [{ name = \"b\", constant = 1.0 }]", "\"b\"", "neither name nor unit"),
        ("part = [{ unit = \"m\", constant = 1.0 }]", "\"m\"", "neither name nor unit"),
        ("part = [{ part = [{ constant = 1.0 }] }]", "{ constant = 1.0 }", "a part has no parts"),
        ("constant = 2.0\npart = [{ constant = 1.0 }]", "2.0", "no `constant` of its own"),
        ("until = 2.0\npart = [{ constant = 1.0 }]", "2.0", "no `until` of its own"),
        ("constant = inf", "inf", "finite number for `constant`, found inf"),
        ("from = nan\nconstant = 1.0", "nan", "finite time [s] for `from`"),
        ("from = 2.0\nuntil = 1.5\nconstant = 1.0", "1.5", "after `from` at 2 s, found 1.5 s"),
        ("fade_in = -1.0\nconstant = 1.0", "-1.0", "`fade_in`, found -1"),
        ("until = 2.0\nfade_in = 1.5\nfade_out = 1.0\nconstant = 1.0", "1.5", "window of 2 s, found 2.5 s"),
        ("from = 9.0\nfade_out = 2.0\nconstant = 1.0", "2.0", "window of 1 s, found 2 s"),
        ("step = { at = nan, after = 1.0 }", "{ at = nan, after = 1.0 }", "step: expected a finite number for `at`"),
        ("ramp = { start = 2.0, end = 2.0, after = 1.0 }", "{ start = 2.0, end = 2.0, after = 1.0 }", "`end` after `start`"),
        ("sine = { amplitude = 1.0, frequency = -1.0 }", "{ amplitude = 1.0, frequency = -1.0 }", "at least 0 for `frequency`"),
        ("square = { amplitude = 1.0, period = -1.0 }", "{ amplitude = 1.0, period = -1.0 }", "above 0 for `period`, found -1"),
        ("chirp = { amplitude = 1.0, f_start = 1.0, f_end = 2.0, duration = 0.0 }", "{ amplitude = 1.0, f_start = 1.0, f_end = 2.0, duration = 0.0 }", "above 0 for `duration`"),
        ("table = { time = [], value = [] }", "{ time = [], value = [] }", "at least one"),
        ("table = { time = [1.0], value = [] }", "{ time = [1.0], value = [] }", "found 0 and 1"),
        ("table = { time = [1.0, 1.0], value = [1.0, 2.0] }", "{ time = [1.0, 1.0], value = [1.0, 2.0] }", "found 1 after 1"),
        ("multisine = { peak = 1.0, frequencies = [] }", "{ peak = 1.0, frequencies = [] }", "at least one of `frequencies`"),
        ("multisine = { peak = 1.0, frequencies = [1.0], weights = [] }", "{ peak = 1.0, frequencies = [1.0], weights = [] }", "in `weights` as in `frequencies`"),
        ("multisine = { peak = 1.0, frequencies = [0.0], phases = [0.0] }", "{ peak = 1.0, frequencies = [0.0], phases = [0.0] }", "zero in the whole window"),
    ];
    for (text, place, message) in cases {
        let error = build(text).expect_err(text);
        assert!(error.message.contains(message), "{text}\n{error:?}");
        let span = error.span.expect(text);
        assert_eq!(&text[span], place, "{text}\n{}", error.message);
    }
    for text in ["sine = { amplitude = 1.0, freq = 1.0 }", "konstant = 1.0"] {
        assert!(toml::from_str::<Part>(text).is_err(), "{text}");
    }
}
