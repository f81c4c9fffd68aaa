//! What a run may do that its baseline did not.

use recording::{Column, ValueKind, VariableDirection};

use super::*;

const SIZE: TubeSize = TubeSize { absolute: 0.1, relative: 0.0, time: 0.0 };

fn column(variable: &str, kind: ValueKind, unit: Option<&str>) -> Column {
    Column {
        node: "plant".to_owned(),
        variable: variable.to_owned(),
        direction: VariableDirection::Output,
        kind,
        unit: unit.map(str::to_owned),
        description: None,
    }
}

/// The columns of the run: a speed, a gear, and a mode.
fn columns() -> Columns<AllVariables> {
    let v = column("v", ValueKind::Real, Some("m/s"));
    [v, column("gear", ValueKind::Integer, None), column("mode", ValueKind::String, None)]
        .into_iter()
        .collect()
}

fn plan() -> BaselinePlan {
    let columns = columns();
    let signal = |column: &Column| BaselineSignal {
        name: column.qualified_name(),
        unit: column.unit.clone(),
        column: columns.find(&column.qualified_name()).expect("a column"),
        exact: column.kind != ValueKind::Real,
        named: false,
        size: SIZE,
    };
    let signals = columns.iter().map(signal).collect();
    BaselinePlan {
        name: "as before".to_owned(),
        path: "golden/run.mcap".into(),
        place: 0..0,
        file: "case.toml".into(),
        line: 1,
        during: None,
        signals,
        chosen: false,
        has_tubes: false,
    }
}

/// The recording of a ramp, a gear that changes, and a mode.
fn golden() -> GoldenRecording {
    let of = |name: &str, unit: Option<&str>, values| GoldenColumn {
        name: name.to_owned(),
        unit: unit.map(str::to_owned),
        values,
    };
    let texts = ["off", "off", "on"].map(str::to_owned).to_vec();
    let columns = vec![
        of("plant.v", Some("m/s"), GoldenValues::Numbers(vec![0.0, 1.0, 2.0])),
        of("plant.gear", None, GoldenValues::Numbers(vec![1.0, 1.0, 2.0])),
        of("plant.mode", None, GoldenValues::Texts(texts)),
    ];
    GoldenRecording::new(vec![0.0, 0.5, 1.0], columns)
}

/// The recording with other columns.
fn changed(change: impl FnOnce(&mut Vec<GoldenColumn>)) -> GoldenRecording {
    let golden = golden();
    let mut columns = golden.columns().to_vec();
    change(&mut columns);
    GoldenRecording::new(golden.times, columns)
}

/// The outcome of a run with a step of 0.25 s whose values are as recorded, but for an edit of each row.
fn outcome(
    plan: BaselinePlan,
    golden: GoldenRecording,
    rows: u32,
    edit: impl Fn(u32, &mut f64, &mut f64),
) -> BaselineOutcome {
    let mut baselines = BaselineChecker::new(vec![(plan, golden)], &columns(), 0.25);
    for row in 0..rows {
        let time = f64::from(row) * 0.25;
        let (mut v, mut gear) = (2.0 * time, if time < 1.0 { 1.0 } else { 2.0 });
        edit(row, &mut v, &mut gear);
        let mode = if time < 1.0 { "off" } else { "on" };
        let row = Row::from_values(vec![v, gear], vec![mode.to_owned()]);
        baselines.push_row(0, time, &row).expect("it is kept");
    }
    baselines.outcomes().remove(0)
}

fn reason(outcome: &BaselineOutcome) -> String {
    outcome.to_verdict().reason.unwrap_or_default()
}

#[test]
fn the_same_run_with_another_step_passes() {
    let outcome = outcome(plan(), golden(), 5, |_, v, _| *v += 0.099);
    let verdict = outcome.to_verdict();
    assert!(verdict.passed, "{verdict:?}");
    assert_eq!((verdict.that.as_str(), verdict.during), ("3 signals as in golden/run.mcap", [0.0, 1.0]));
    assert_eq!(outcome.warnings, [""; 0]);
}

#[test]
fn the_first_and_the_worst_deviation_are_told() {
    let wrong = outcome(plan(), golden(), 5, |row, v, _| {
        *v += [0.0, 0.0, 0.2, 0.5, 0.0][row as usize];
    });
    let text = reason(&wrong);
    assert_eq!(
        text,
        "1 of 3 signals differ, first `plant.v` [m/s]: 1.2 outside of [0.9, 1.1] at 0.5 s; worst \
         2.0 outside of [1.4, 1.6] at 0.75 s"
    );
    let verdict = wrong.to_verdict();
    assert_eq!((verdict.at, verdict.value), (Some(0.75), Some(2.0)));
    let nan = outcome(plan(), golden(), 5, |row, v, _| {
        if row == 1 {
            *v = f64::NAN;
        }
    });
    assert!(reason(&nan).contains("NaN outside of [0.4, 0.6] at 0.25 s"), "{}", reason(&nan));
    let gear = outcome(plan(), golden(), 5, |row, _, gear| *gear += f64::from(u8::from(row == 3)));
    assert!(reason(&gear).contains("`plant.gear`: 2 instead of 1 at 0.75 s"), "{}", reason(&gear));
    let mut late = plan();
    late.signals[1].size.time = 0.25;
    let late = outcome(late, golden(), 5, |row, _, gear| *gear += f64::from(u8::from(row == 3)));
    assert!(late.to_verdict().passed, "{}", reason(&late));
}

#[test]
fn the_smallest_round_tube_that_holds_a_signal_is_told() {
    // The tube has a half height of 0.1 and more; what is needed is the distance from the curve.
    let edit = |row: u32, v: &mut f64, _: &mut f64| *v += [0.0, 0.0, 0.2, 0.512_3, 0.0][row as usize];
    let wrong = outcome(plan(), golden(), 5, edit);
    let [v, _, mode] = &wrong.signals[..] else { panic!("{wrong:?}") };
    let distance = v.distance.expect("a distance");
    assert_eq!((distance.first, distance.at), (0.5, 0.75));
    assert!((distance.largest.expect("a number") - 0.512_3).abs() < 1e-12, "{distance:?}");
    assert!((distance.half_height - 0.1).abs() < 1e-11, "{distance:?}");
    assert_eq!(v.tube, Some(RequiredTube { absolute: Some(0.52), time: None }));
    assert_eq!((mode.distance, mode.tube), (None, None));
    // With these sizes the same run passes.
    let mut wider = plan();
    for (signal, outcome) in wider.signals.iter_mut().zip(&wrong.signals) {
        let size = &mut signal.size;
        size.absolute = outcome.tube.and_then(|it| it.absolute).unwrap_or(size.absolute);
        size.time = outcome.tube.and_then(|it| it.time).unwrap_or(size.time);
    }
    let passed = outcome(wider, golden(), 5, edit);
    assert!(passed.to_verdict().passed, "{}", reason(&passed));
    // What is inside of its tube differs all the same; what no tube holds has none.
    let near = outcome(plan(), golden(), 5, |row, v, _| *v += if row == 2 { 0.05 } else { 0.0 });
    assert!(near.to_verdict().passed && near.signals[0].distance.is_some() && near.signals[0].tube.is_none());
    let nan = outcome(plan(), golden(), 5, |row, v, _| *v = if row == 1 { f64::NAN } else { *v });
    assert_eq!(nan.signals[0].distance.map(|it| it.largest), Some(None));
    assert_eq!(nan.signals[0].tube, None);
    // Gear 2 is recorded from 1 s on: a quarter of the run is no tolerance.
    let gear = outcome(plan(), golden(), 5, |row, _, gear| *gear += f64::from(u8::from(row == 3)));
    assert_eq!((gear.signals[1].passed, gear.signals[1].tube), (false, None));
}

#[test]
fn an_outcome_is_read_as_it_was_written() {
    let nan = outcome(plan(), golden(), 5, |row, v, _| *v = if row == 1 { f64::NAN } else { *v + 1.0 });
    let text = serde_json::to_string(&nan).expect("JSON");
    let read: BaselineOutcome = serde_json::from_str(&text).expect("an outcome");
    assert!(read.signals[0].first.is_some() && read.signals[0].worst.is_some_and(|it| it.value.is_nan()));
    assert_eq!(serde_json::to_string(&read).expect("JSON"), text);
}

#[test]
fn units_are_converted_or_told() {
    let in_unit = |unit: Option<&str>| {
        changed(|columns| {
            columns[0].unit = unit.map(str::to_owned);
            columns[0].values = GoldenValues::Numbers(vec![0.0, 3.6, 7.2]);
        })
    };
    let same = outcome(plan(), in_unit(Some("km/h")), 5, |_, _, _| {});
    assert!(same.to_verdict().passed, "{}", reason(&same));
    for (unit, says) in [
        (Some("N"), "it was recorded in [N], and is in [m/s] now"),
        (None, "it was recorded without a unit, and is in [m/s] now"),
    ] {
        let other = outcome(plan(), in_unit(unit), 5, |_, _, _| {});
        assert!(reason(&other).contains(says), "{}", reason(&other));
    }
}

#[test]
fn what_is_missing_is_told() {
    let short = outcome(plan(), golden(), 3, |_, _, _| {});
    assert!(reason(&short).contains("the run ends at 0.500 s, before the recording"), "{}", reason(&short));
    let long = outcome(plan(), golden(), 9, |_, _, _| {});
    assert!(long.to_verdict().passed && long.warnings[0].contains("golden/run.mcap ends at 1 s, the rest"));
    let mut window = plan();
    window.during = Some([0.5, 2.0]);
    let window = outcome(window, golden(), 9, |_, _, _| {});
    assert!(reason(&window).contains("the recording is from 0.000 s to 1.000 s, the window from 0.500 s"));
    let fewer = changed(|columns| drop(columns.remove(0)));
    let fewer_signals = outcome(plan(), fewer.clone(), 5, |_, _, _| {});
    assert!(fewer_signals.to_verdict().passed);
    assert!(fewer_signals.warnings[0].contains("so not compared: plant.v"), "{:?}", fewer_signals.warnings);
    let mut named = plan();
    named.signals[0].named = true;
    let named = outcome(named, fewer, 5, |_, _, _| {});
    assert!(
        reason(&named).contains("`plant.v` [m/s]: the recording has no such signal"),
        "{}",
        reason(&named)
    );
    let more = changed(|columns| columns[0].name = "plant.u".to_owned());
    let lost = outcome(plan(), more, 5, |_, _, _| {});
    assert!(reason(&lost).contains("the run has no plant.u, which the recording has"), "{}", reason(&lost));
    let infinite = changed(|columns| columns[0].values = GoldenValues::Numbers(vec![0.0, f64::NAN, 2.0]));
    let infinite = outcome(plan(), infinite, 5, |_, _, _| {});
    assert!(reason(&infinite).contains("it is NaN in the recording at 0.500 s"), "{}", reason(&infinite));
}
