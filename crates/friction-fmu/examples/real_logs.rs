//! Replays logs of real cars and prints what the estimator tells: `real_logs [NAME=VALUE ...]` with parameters of the FMU.
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
    [0, 1].map(|axle| {
        fit::curve(&all.iter().flat_map(|both| both[axle].iter().copied()).collect::<Vec<_>>())
    })
}

fn print(name: &str, log: &Log, curves: &[MagicFormula; 2], settings: &[(&str, f64)]) {
    let mut fmu = Fmu::of(log, curves, settings);
    let peak = [0, 1].map(|axle| log.car.body.static_loads()[axle] * curves[axle].D);
    let peak = (peak[0] + peak[1]) / log.car.body.m;
    let (mut gated, mut errors, mut alarms) = (0, [0.0; 4], 0);
    println!("{name}");
    let every = (log.v_x.len() / 12).max(1);
    let mut best = (f64::INFINITY, 1.0);
    let mut told = false;
    for factor in (20..131).map(|k| f64::from(k) * 0.01) {
        let both = curves.map(|it| scaled(&it, factor, 1.0));
        let rows = (0..log.v_x.len()).filter(|k| log.ok[*k]);
        let sum: f64 = rows.map(|k| (a_y(log, k, &both) - log.a_y[k]).powi(2)).sum();
        if sum < best.0 {
            best = (sum, factor);
        }
    }
    let offline = curves.map(|it| scaled(&it, best.1, 1.0));
    let mut vy = [0.0; 2];
    for k in 0..log.v_x.len() {
        let [D_f, D_r, K_f, K_r] = fmu.relative(curves);
        let online = [scaled(&curves[0], D_f, K_f), scaled(&curves[1], D_r, K_r)];
        fmu.take(log, k);
        if log.ok[k] {
            gated += usize::from(a_y(log, k, curves).abs() > 0.5 * peak);
            if gated > 500 {
                let error = |curves| (a_y(log, k, curves) - log.a_y[k]).powi(2);
                errors[0] += error(&online);
                errors[1] += error(&offline);
                errors[2] += error(curves);
                errors[3] += 1.0;
            }
            vy[0] += (fmu.get("v_y") - log.v_y[k]).powi(2);
            vy[1] += 1.0;
        }
        let raised = fmu.get("alarm") != 0.0;
        alarms += usize::from(raised);
        let first = gated == 500 && !told;
        told |= first;
        if k % every == 0 || first {
            println!(
                "  {:6.1} s {} D_f {D_f:.2} +-{:.2} D_r {D_r:.2} +-{:.2} K_f {K_f:.2} +-{:.2} K_r {K_r:.2} +-{:.2} factor {:.3} +-{:.3} {}",
                k as f64 * log.period,
                if first { "5 s" } else { "   " },
                fmu.get("std.D_f") / curves[0].D,
                fmu.get("std.D_r") / curves[1].D,
                fmu.get("std.K_f") / curves[0].stiffness(),
                fmu.get("std.K_r") / curves[1].stiffness(),
                fmu.get("factor"),
                fmu.get("std.factor"),
                if raised { "ALARM" } else { "" }
            );
        }
    }
    let rms = |k: usize| (errors[k] / errors[3]).sqrt();
    println!(
        "  a_y rms after 5 s: online {:.3}, similarity {:.2} {:.3}, nominal {:.3}; alarm {alarms} rows, at {:.2} since {:.2}; informative {:.1} s; v_y rms {:.4}",
        rms(0),
        best.1,
        rms(1),
        rms(2),
        fmu.get("alarm_time"),
        fmu.get("alarm_since"),
        fmu.get("informative_time"),
        (vy[0] / vy[1]).sqrt()
    );
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let settings: Vec<(&str, f64)> = words
        .iter()
        .filter_map(|word| {
            word.split_once('=').map(|(name, value)| (name, value.parse().expect("a number")))
        })
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
        let fitted: Vec<&Log> = logs
            .iter()
            .zip(rubber)
            .filter(|(_, name)| *name != "free_moderate")
            .map(|it| it.0)
            .collect();
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
