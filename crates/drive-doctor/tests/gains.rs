//! Asserts that the scale of a yaw rate and the radius of wheels are told of a log that was made with them, and not of one without.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use drive_doctor::{COURSE_CLOCK, CarData, Certainty, LogExamination, examine_log};
use preparation::DriveLog;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// What is wrong with a log: scale and offset of the yaw rate, noise of the course [rad], side of all turns.
struct Made {
    scale: f64,
    offset: f64,
    course_noise: f64,
    is_one_sided: bool,
    /// By how much the course is late [s].
    course_delay: f64,
}

const CLEAN: Made =
    Made { scale: 1.0, offset: 0.0, course_noise: 0.003, is_one_sided: false, course_delay: 0.0 };
const RADIUS: f64 = 0.31;
/// Slip of a driven axle by forward acceleration [s²/m].
const SLIP: f64 = 0.01;

/// 200 s at 50 Hz of a car without sideslip.
fn examined(made: &Made, seed: u64) -> LogExamination {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let phase = rng.random_range(0.0..6.0);
    let mut normal = |std: f64| -> f64 {
        let e: f64 = StandardNormal.sample(&mut rng);
        std * e
    };
    let (step, rows) = (0.02, 10_000);
    let (mut heading, mut columns) = (0.0, vec![Vec::new(); 8]);
    for k in 0..rows {
        let t = f64::from(k) * step;
        let a_x = 1.5 * (0.3 * t + phase).cos();
        let v_x = 20.0 + 5.0 * (0.3 * t + phase).sin();
        let wave = (0.45 * t).sin() + 0.4 * (1.3 * t + phase).sin();
        let r = if made.is_one_sided { 0.2 + 0.1 * wave } else { 0.3 * wave };
        let omega = v_x / RADIUS * (1.0 + SLIP * a_x);
        let row = [
            v_x + normal(0.02),
            normal(0.005),
            made.scale * r + made.offset + normal(0.004),
            a_x + normal(0.05),
            v_x * r + normal(0.1),
            heading + normal(made.course_noise),
            omega + normal(0.1),
            omega + normal(0.1),
        ];
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        heading += step * r;
    }
    let time: Vec<f64> = (0..rows).map(|k| f64::from(k) * step).collect();
    let names = ["v_x", "v_y", "r", "a_x", "a_y", "course", "omega_rl", "omega_rr"];
    let mut log = DriveLog::default();
    for (name, values) in names.into_iter().zip(columns) {
        let delay = if name == "course" { made.course_delay } else { 0.0 };
        log.insert(name, time.iter().map(|t| t + delay).collect(), values);
    }
    examine_log(&log, &CarData::default())
}

#[test]
fn the_scale_of_a_yaw_rate_is_told_with_its_interval() {
    let held = (0..20).filter(|seed| {
        let found = examined(&Made { scale: 1.04, offset: 0.01, ..CLEAN }, *seed);
        let it = found.findings.iter().find(|it| it.check == "r_scale");
        let it = it.unwrap_or_else(|| panic!("{seed}: {found:#?}"));
        assert_eq!(it.sure, Certainty::Certain, "{it:#?}");
        let [low, high] = it.interval.unwrap_or_default();
        assert!(high - low < 0.01, "{it:#?}");
        (low..high).contains(&0.04)
    });
    let held = held.count();
    assert!(held >= 17, "{held} of 20");
}

#[test]
fn a_right_yaw_rate_has_no_scale_whatever_the_noise_of_the_course() {
    for (seed, course_noise) in [(1, 0.003), (2, 0.03), (3, 0.1), (4, 0.3)] {
        let found = examined(&Made { course_noise, ..CLEAN }, seed);
        let scale = found.serious_findings().find(|it| it.check == "r_scale");
        assert!(scale.is_none(), "{course_noise}: {scale:#?}");
    }
}

#[test]
fn a_late_course_is_told_and_does_not_make_a_scale() {
    let found = examined(&CLEAN, 3);
    assert!(found.findings.iter().all(|it| it.check != "course_delay"), "{found:#?}");
    for course_delay in [0.1, 0.3] {
        let found = examined(&Made { course_delay, ..CLEAN }, 3);
        let it = found.findings.iter().find(|it| it.check == "course_delay");
        let it = it.unwrap_or_else(|| panic!("{course_delay}: {found:#?}"));
        assert!(it.value.is_some_and(|late| (late - course_delay).abs() < 0.01), "{it:#?}");
        assert!(found.serious_findings().all(|it| it.channels == ["course"]), "{found:#?}");
    }
}

#[test]
fn turns_to_one_side_do_not_tell_a_scale() {
    let made = Made { scale: 1.04, is_one_sided: true, ..CLEAN };
    let found = examined(&made, 1);
    assert!(found.serious_findings().all(|it| it.check != "r_scale"), "{found:#?}");
    for question in ["scale of the yaw rate", COURSE_CLOCK] {
        assert!(found.not_told.iter().any(|it| it.check == question), "{question}: {found:#?}");
    }
}

#[test]
fn wheels_tell_their_radius_without_the_slip_of_a_force() {
    let held = (0..20).filter(|seed| {
        let found = examined(&CLEAN, *seed);
        let [it] = &found.rolling[..] else { panic!("{found:#?}") };
        assert!(it.axle == "rear" && it.interval[1] - it.interval[0] < 2e-3, "{it:#?}");
        assert!((it.slip - SLIP).abs() < 2e-3, "{it:#?}");
        (it.interval[0]..it.interval[1]).contains(&RADIUS)
    });
    let held = held.count();
    assert!(held >= 17, "{held} of 20");
}
