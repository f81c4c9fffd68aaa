//! Gives all tasks signals that no car has: the answer is an error or a verdict, never a panic.

use std::panic::{AssertUnwindSafe, catch_unwind};

use plugin::{Analysis as _, AnalysisRequest, NullAnalysisServices, Signal};

use super::Identify;

const ROWS: usize = 300;
/// Step of the drive [s].
pub(super) const STEP: f64 = 0.02;

pub(super) const CAR: &str = "exact = true\nbody = { m = 780.0, I_zz = 1000.0, l_f = 1.4, l_r = 1.6, h = 0.35 }\naero = { rho = 1.225, area = 1.5, C_d = 0.3, C_lf = 0.0, C_lr = 0.0 }\nbrake_front_share = 0.6\n";

/// A car that weaves, by the steady state of a linear model.
pub(super) fn weaving_drive() -> Vec<(&'static str, Vec<f64>)> {
    let column = |of: &dyn Fn(f64) -> f64| (0..ROWS).map(|row| of(row as f64 * STEP)).collect();
    let (v_x, turn) = (20.0, |t: f64| 0.06 * (1.3 * t).sin() + 0.02 * (5.1 * t).cos());
    let r = move |t: f64| v_x * turn(t) / 3.0 / (1.0 + 0.002 * v_x * v_x);
    vec![
        ("v_x", column(&|t| v_x + 0.5 * (0.3 * t).sin())),
        ("v_y", column(&|t| 1.6 * r(t) - 0.02 * v_x * r(t))),
        ("r", column(&r)),
        ("a_x", column(&|t| 0.15 * (0.3 * t).cos())),
        ("a_y", column(&|t| v_x * r(t))),
        ("delta", column(&turn)),
        ("F_x", column(&|t| 780.0 * 0.15 * (0.3 * t).cos() + 110.0)),
    ]
}

/// A name, and what becomes of a column.
type ColumnDamage = (&'static str, fn(f64, usize) -> f64);

const DAMAGES: [ColumnDamage; 14] = [
    ("nothing", |value, _| value),
    ("0", |_, _| 0.0),
    ("a constant", |_, _| 0.7),
    ("1e-300", |_, _| 1e-300),
    ("1e300", |_, _| 1e300),
    ("both ends", |_, row| if row.is_multiple_of(2) { f64::MAX } else { f64::MIN }),
    ("a peak of 1e-320", |value, _| value * 1e-320),
    ("a peak of 1e-200", |value, _| value * 1e-200),
    ("a peak of 1e13", |value, _| value * 1e13),
    ("a peak of 1e200", |value, _| value * 1e200),
    ("one huge value", |value, row| if row == 100 { 1e300 } else { value }),
    ("gaps", |value, row| if row.is_multiple_of(7) { f64::NAN } else { value }),
    ("no numbers", |_, _| f64::NAN),
    ("infinite", |_, row| if row < 150 { f64::INFINITY } else { f64::NEG_INFINITY }),
];

/// Signals that are damaged together.
type SignalGroup = &'static [&'static str];

/// All that moves a car to its side.
const LATERAL: SignalGroup = &["v_y", "r", "a_y", "delta"];

/// Runs a task with each of these groups of signals damaged in each way.
fn run_with_damaged_signals(config: &str, signals: &[(&'static str, Vec<f64>)], groups: &[SignalGroup]) {
    let time: Vec<f64> = (0..ROWS).map(|row| row as f64 * STEP).collect();
    let mut fallen = Vec::new();
    for (what, damage) in DAMAGES {
        for group in groups {
            let damaged = |(name, values): &(&'static str, Vec<f64>)| {
                let change = |(row, value): (usize, &f64)| match group.contains(name) {
                    true => damage(*value, row),
                    false => *value,
                };
                (*name, values.iter().enumerate().map(change).collect::<Vec<_>>())
            };
            let columns: Vec<_> = signals.iter().map(damaged).collect();
            let lent = columns.iter().map(|(name, values)| Signal { name, unit: "", time: &time, values });
            let request = AnalysisRequest { config, signals: lent.collect() };
            let ran = catch_unwind(AssertUnwindSafe(|| Identify::run(&request, &mut NullAnalysisServices)));
            let is_sound = what == "nothing";
            assert!(!is_sound || matches!(ran, Ok(Ok(_))), "a sound drive is refused: {ran:?}");
            if ran.is_err() {
                fallen.push(format!("{what} in {group:?}"));
            }
        }
    }
    assert!(fallen.is_empty(), "{} panic: {}", fallen.len(), fallen.join("; "));
}

#[test]
fn the_doctor_survives_signals_that_no_car_has() {
    let groups: [SignalGroup; 8] =
        [&["v_x"], &["v_y"], &["r"], &["a_x"], &["a_y"], &["delta"], LATERAL, &["v_x", "r", "a_y"]];
    run_with_damaged_signals("task = \"doctor\"", &weaving_drive(), &groups);
}

#[test]
fn the_identification_of_curves_survives_signals_that_no_car_has() {
    let front = "drive_front_share = 0.0";
    let config = format!("task = \"tires\"\nmethods = [\"least_squares\"]\n[car]\n{CAR}{front}\n");
    run_with_damaged_signals(&config, &weaving_drive(), &[&["delta"], &["a_x"], LATERAL]);
}

#[test]
fn the_identification_in_a_closed_loop_survives_signals_that_no_car_has() {
    let signals: Vec<_> = weaving_drive().into_iter().filter(|(name, _)| *name != "a_x").collect();
    run_with_damaged_signals(&format!("task = \"closed_loop\"\n[car]\n{CAR}"), &signals, &[LATERAL]);
}

#[test]
fn the_fit_of_one_curve_survives_points_that_no_tire_has() {
    let column = |of: &dyn Fn(f64) -> f64| (0..ROWS).map(|row| of(row as f64 / 150.0 - 1.0)).collect();
    let slip = column(&|x| 0.2 * x);
    let force = column(&|x| 1.6 * (1.8 * (4.4 * x).atan()).sin() + 0.01 * (97.0 * x).sin());
    let config = "task = \"curve\"\ndirection = \"lateral\"\nmethods = [\"least_squares\"]";
    run_with_damaged_signals(config, &[("slip", slip), ("force", force)], &[&["slip"], &["force"]]);
}
