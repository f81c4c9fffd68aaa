//! A race car on a track, if its recording is at hand.

use std::path::PathBuf;

use vehicle::{Aerodynamics, MagicFormula, VehicleBody};

use crate::samples::CurveSamples;
use crate::{Car, CurvePoints, DriveLog, OffsetSource, PreparationPipeline, PreparedRecording};

/// The recording of a 1964 Ferrari 250 LM that `scenarios/replay_250lm.toml` replays; `TRACKSIDE_DATA` names another
/// folder to look in.
fn path() -> PathBuf {
    let beside = || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("TRACKSIDE_DATA").map_or_else(beside, PathBuf::from);
    folder.join("revs_250lm.csv")
}

fn recording() -> Option<DriveLog<'static>> {
    let text = std::fs::read_to_string(path()).ok()?;
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next()?.split(',').collect();
    let rows: Vec<Vec<f64>> = lines.map(|l| l.split(',').filter_map(|v| v.parse().ok()).collect()).collect();
    let column = |name: &str| -> Option<Vec<f64>> {
        let i = names.iter().position(|n| *n == name)?;
        rows.iter().map(|row| row.get(i).copied()).collect()
    };
    let time = column("t_s")?;
    let mut recording = DriveLog::default();
    for (name, source) in [
        ("v_x", "vx_mps"),
        ("v_y", "vy_mps"),
        ("a_x", "ax_mps2"),
        ("a_y", "ay_mps2"),
        ("r", "yaw_rate_radps"),
        ("delta", "delta_rad"),
    ] {
        recording.insert(name, time.clone(), column(source)?);
    }
    Some(recording)
}

fn settings() -> PreparationPipeline {
    let body = VehicleBody { m: 982.0, I_zz: 1605.0, l_f: 1.33, l_r: 1.07, h: 0.45 };
    let aero = Aerodynamics { C_d: 0.0, ..Aerodynamics::default() };
    PreparationPipeline { car: Car { body, aero, ..Car::default() }, ..PreparationPipeline::default() }
}

fn prepared(settings: &PreparationPipeline) -> Option<PreparedRecording> {
    let Some(recording) = recording() else {
        println!("skipped: {} is not there", path().display());
        return None;
    };
    Some(settings.prepare(&recording).expect("the recording is complete"))
}

/// Root mean square distance of the points from the best curve of a coarse search.
fn residual(points: &CurveSamples) -> (f64, MagicFormula) {
    let cost = |tire: &MagicFormula| {
        let errors =
            points.slip.iter().zip(&points.force).map(|(s, f)| (f - tire.friction_coefficient(*s)).powi(2));
        (errors.sum::<f64>() / points.len() as f64).sqrt()
    };
    let mut best = MagicFormula { B: 12.0, C: 1.4, D: 1.1, E: 0.0, S_h: 0.0, S_v: 0.0 };
    let (mut lowest, mut step) = (cost(&best), 0.2);
    while step > 1e-3 {
        let before = lowest;
        for (i, sign) in (0..12).map(|k| (k / 2, if k % 2 == 0 { step } else { -step })) {
            let MagicFormula { B, C, D, E, S_h, S_v } = best;
            let mut theta = [B, C, D, E, S_h, S_v];
            theta[i] += sign * [12.0, 1.0, 1.0, 1.0, 0.02, 0.1][i];
            let [B, C, D, E, S_h, S_v] = theta;
            let trial = MagicFormula { B, C, D, E, S_h, S_v };
            if trial.C >= 1.0 && trial.E.abs() <= 1.0 && cost(&trial) < lowest {
                (lowest, best) = (cost(&trial), trial);
            }
        }
        if lowest >= before {
            step *= 0.5;
        }
    }
    (lowest, best)
}

#[test]
#[ignore = "needs logs of real cars"]
fn points_of_a_ferrari_250_lm() {
    let prepared = prepared(&settings()).expect("a log of TRACKSIDE_DATA");
    let report = &prepared.report;
    assert_eq!((report.lost.rows, report.lost.used, report.stretches.len()), (33_000, 33_000, 1));
    assert_eq!(report.held["a_y"], 3846);
    let [r, a_x, a_y, sideslip] = report.offsets;
    for offset in report.offsets {
        println!("{offset:?}");
        assert_eq!(offset.source, OffsetSource::Estimated);
    }
    // Two laps take 197 s and turn the car by 4 π: the sensor makes it 0.14 rad more, a bias of −0.0007 rad/s.
    assert!((r.value + 0.0007).abs() < 5e-4 && sideslip.value.abs() < 2e-3);
    assert!(a_x.value.abs() < 0.1 && a_y.value.abs() < 0.2);
    for (axle, reach, most) in [(&prepared.front, 0.14, 1.3), (&prepared.rear, 0.08, 1.3)] {
        let CurvePoints { samples, counts, .. } = &axle.lateral;
        let (rms, curve) = residual(samples);
        println!("{counts:?}\nrms {rms:.4}, {curve:?}");
        // Highest slip to both sides is at the limit of the tires, and is still there.
        let [low, high] = counts.slip_range.expect("there are points");
        assert!(low < -reach && high > reach, "{low} {high}");
        let mut forces: Vec<f64> = samples.force.iter().map(|f| f.abs()).collect();
        forces.sort_by(f64::total_cmp);
        // Single points of unsteady driving are beyond what the tires hold.
        assert!(forces[forces.len() * 99 / 100] < most);
        assert!(counts.outliers < 330, "more than 1 % are outliers");
        assert!(rms < 0.1, "the points are no curve");
    }
}

#[test]
#[ignore = "needs logs of real cars"]
fn mirrored_ferrari() {
    let recording = recording().expect("a log of TRACKSIDE_DATA");
    let mut mirrored = recording.clone();
    for name in ["v_y", "a_y", "r", "delta"] {
        let signal = recording.get(name).expect("it was put in");
        mirrored.insert(name, signal.time.to_vec(), signal.value.iter().map(|v| -v).collect());
    }
    let [a, b] = [&recording, &mirrored].map(|r| settings().prepare(r).expect("it is complete").rear.lateral);
    assert_eq!(a.samples.slip, b.samples.slip.iter().map(|s| -s).collect::<Vec<_>>());
    assert_eq!(a.samples.force, b.samples.force.iter().map(|s| -s).collect::<Vec<_>>());
}
