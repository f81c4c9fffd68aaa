//! Replays logs of real cars and prints what the estimator tells: `surfaces [NAME=VALUE ...]` with parameters of the FMU.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[path = "../tests/support/mod.rs"]
mod support;

use support::fit::{self, a_y, axles, scaled};
use support::log::{Log, dart, ferrari};
use support::replay::Fmu;
use vehicle::MagicFormula;

/// The curves nearest to some logs.
fn curves(logs: &[&Log]) -> [MagicFormula; 2] {
    let all: Vec<_> = logs.iter().map(|log| axles(log)).collect();
    [0, 1].map(|axle| fit::curve(&all.iter().flat_map(|both| both[axle].iter().copied()).collect::<Vec<_>>()))
}

/// The one factor of similarity with the least error of a_y over a whole log.
fn similarity(log: &Log, curves: &[MagicFormula; 2]) -> f64 {
    let cost = |factor: f64| -> f64 {
        let both = curves.map(|it| scaled(&it, factor, 1.0));
        let rows = (0..log.v_x.len()).filter(|k| log.ok[*k]);
        rows.map(|k| (a_y(log, k, &both) - log.a_y[k]).powi(2)).sum()
    };
    let factors = (20..131).map(|percent| f64::from(percent) * 0.01);
    factors.min_by(|a, b| cost(*a).total_cmp(&cost(*b))).expect("factors")
}

/// Prints what the estimator tells at a time [s].
fn print_row(fmu: &mut Fmu, curves: &[MagicFormula; 2], time: f64, mark: &str) {
    let means = fmu.relative(curves);
    let nominal = [
        curves[0].D,
        curves[1].D,
        curves[0].cornering_stiffness_per_load(),
        curves[1].cornering_stiffness_per_load(),
    ];
    print!("  {time:6.1} s {mark:3}");
    for ((name, mean), over) in ["D_f", "D_r", "K_f", "K_r"].iter().zip(means).zip(nominal) {
        print!(" {name} {mean:.2} +-{:.2}", fmu.get(&format!("std.{name}")) / over);
    }
    let alarm = if fmu.get("alarm") != 0.0 { "ALARM" } else { "" };
    println!(" factor {:.3} +-{:.3} {alarm}", fmu.get("factor"), fmu.get("std.factor"));
}

/// Replays a log, and prints rows of it and its errors.
fn print(name: &str, log: &Log, curves: &[MagicFormula; 2], settings: &[(&str, f64)]) {
    println!("{name}");
    let mut fmu = Fmu::of(log, curves, settings);
    let loads = log.car.body.static_loads();
    let peak = (loads[0] * curves[0].D + loads[1] * curves[1].D) / log.car.body.m;
    let factor = similarity(log, curves);
    let offline = curves.map(|it| scaled(&it, factor, 1.0));
    // Squares of errors of a_y, online, offline and nominal, after 500 rows that say something; of v_y, in all rows.
    let (mut said, mut a_y_errors, mut v_y_error) = (0, [0.0; 3], 0.0);
    let (mut after, mut counted) = (0.0, 0.0);
    for k in 0..log.v_x.len() {
        let [D_f, D_r, K_f, K_r] = fmu.relative(curves);
        let online = [scaled(&curves[0], D_f, K_f), scaled(&curves[1], D_r, K_r)];
        fmu.take(log, k);
        let says = log.ok[k] && a_y(log, k, curves).abs() > 0.5 * peak;
        said += usize::from(says);
        if log.ok[k] {
            v_y_error += (fmu.get("v_y") - log.v_y[k]).powi(2);
            counted += 1.0;
        }
        if log.ok[k] && said > 500 {
            for (sum, curves) in a_y_errors.iter_mut().zip([&online, &offline, curves]) {
                *sum += (a_y(log, k, curves) - log.a_y[k]).powi(2);
            }
            after += 1.0;
        }
        if says && said == 500 || k % (log.v_x.len() / 12) == 0 {
            let mark = if says && said == 500 { "5 s" } else { "" };
            print_row(&mut fmu, curves, k as f64 * log.period, mark);
        }
    }
    let [online, offline, nominal] = a_y_errors.map(|sum: f64| (sum / after).sqrt());
    println!(
        "  a_y after 5 s: online {online:.3}, similarity {factor:.2} {offline:.3}, nominal {nominal:.3} m/s2"
    );
    println!(
        "  alarm at {:.2} s since {:.2} s; informative {:.1} s; v_y {:.4} m/s",
        fmu.get("alarm_time"),
        fmu.get("alarm_since"),
        fmu.get("informative_time"),
        (v_y_error / counted).sqrt()
    );
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let settings: Vec<(&str, f64)> = words
        .iter()
        .filter_map(|word| word.split_once('=').map(|(name, value)| (name, value.parse().expect("a number"))))
        .collect();
    let rubber = [
        "circles_rubber_left",
        "circles_rubber_right",
        "ramp_rubber_left",
        "ramp_rubber_right",
        "free_moderate",
        "free_fast",
    ];
    let logs: Option<Vec<Log>> = rubber.iter().map(|name| dart(name)).collect();
    if let Some(logs) = logs {
        // As the baseline: the moderate free drive is left out.
        let fitted: Vec<&Log> =
            logs.iter().zip(rubber).filter(|(_, name)| *name != "free_moderate").map(|it| it.0).collect();
        let curves = curves(&fitted);
        println!("{curves:?}");
        let with = |defaults: &[(&'static str, f64)]| {
            let mut all: Vec<(&str, f64)> = defaults.to_vec();
            all.extend(&settings);
            all
        };
        let small = with(&[("model.alpha_f", 0.01), ("sensor.v_y", 0.01)]);
        for name in ["circles_tape_left", "circles_tape_right"] {
            if let Some(log) = dart(name) {
                print(name, &log, &curves, &small);
            }
        }
        for (name, log) in rubber.iter().zip(&logs) {
            print(name, log, &curves, &small);
        }
    }
    if let Some(log) = ferrari() {
        let curves = curves(&[&log]);
        println!("{curves:?}");
        let mut settings = settings.clone();
        settings.push(("sensor.a_y", 1.0));
        print("250 LM", &log, &curves, &settings);
    }
}
