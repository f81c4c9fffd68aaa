//! Tires and sideslip without v_y: of simulated cars whose truth is known, with sensors missing, and of real cars.

#![allow(non_snake_case, reason = "symbols as in the literature")]

use crate::support;

use drive_prediction::hidden::{
    BankMap, Error, EstimatorSetup, SensorChannel, SensorSignals, SideslipEstimate, SideslipFit,
    filter_sideslip, fit_sideslip_model, smooth_sideslip,
};
use rand::prelude::*;
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use vehicle::{G, VehicleBody};

const BODY: VehicleBody = VehicleBody { m: 1000.0, I_zz: 1400.0, l_f: 1.3, l_r: 1.1, h: 0.4 };
/// B, C, D of both axles: K is 16.4 and 19.8.
const TIRES: [[f64; 3]; 2] = [[11.0, 1.35, 1.1], [12.5, 1.35, 1.17]];
const STEP: f64 = 0.01;

/// What a simulated car did, and what its sensors showed.
struct Simulated {
    v_x: Vec<f64>,
    v_y: Vec<f64>,
    course: Vec<f64>,
    delta: Vec<f64>,
    a_x: Vec<f64>,
    speed: Vec<f64>,
    r: Vec<f64>,
    a_y: Vec<f64>,
}

/// A quantity that wanders, by its standard deviation and correlation time [s].
struct Wandering(f64, f64, f64);

impl Wandering {
    fn next(&mut self, h: f64, random: &mut Pcg64) -> f64 {
        let Self(value, std, time) = self;
        let keep = (-h / *time).exp();
        let white: f64 = random.sample(StandardNormal);
        *value = keep * *value + (1.0 - keep * keep).sqrt() * *std * white;
        *value
    }
}

/// Drives by turns left and right, harder and softer, at changing speed; equations of this test alone, with steps of 1 ms.
fn simulate(seed: u64, seconds: f64) -> Simulated {
    let mut random = Pcg64::seed_from_u64(seed);
    let VehicleBody { m, I_zz, l_f, l_r, h } = BODY;
    let L = l_f + l_r;
    let [mut grade, mut bank] = [Wandering(0.0, 0.04, 3.0), Wandering(0.0, 0.2, 4.0)];
    let mut slips = [0.0015, 0.0015, 0.0025].map(|std| Wandering(0.0, std, 2.0));
    let mut out = [const { Vec::new() }; 8];
    let (mut v_x, mut v_y, mut r, mut yaw) = (30.0, 0.0, 0.0, 0.3);
    let trim: f64 = 0.001;
    let dt = 1e-3;
    for k in 0..(seconds / dt) as usize {
        let t = k as f64 * dt;
        let wave = |period: f64| (std::f64::consts::TAU * t / period).sin();
        let pull = 3.0 * wave(13.0) + 1.5 * wave(5.3) - 0.08 * (v_x - 32.0);
        let hard = (0.75 + 0.25 * wave(31.0)) * (32.0_f64 / v_x.max(30.0)).powi(2);
        let delta = hard * (0.017 * wave(9.0) + 0.006 * wave(3.7) + 0.003 * wave(1.3));
        let [g, b] = [&mut grade, &mut bank].map(|it| it.next(dt, &mut random));
        let slip = [0, 1, 2].map(|i| slips[i].next(dt, &mut random));
        let loads = [G * l_r / L - pull * h / L, G * l_f / L + pull * h / L];
        let steer = delta + trim;
        let alpha = [
            steer - ((v_y + l_f * r) / v_x).atan() + slip[0] + slip[2],
            -((v_y - l_r * r) / v_x).atan() + slip[1] + slip[2],
        ];
        let pulled = pull + 8e-4 * v_x * v_x;
        let pulls = if pulled > 0.0 { [0.0, pulled] } else { [0.6 * pulled, 0.4 * pulled] };
        let force: [f64; 2] = std::array::from_fn(|i| {
            let [B, C, D] = TIRES[i];
            let left = 1.0 - (pulls[i] / (D * loads[i])).powi(2);
            loads[i] * left.sqrt() * D * (C * (B * alpha[i]).atan()).sin()
        });
        let front = force[0] * steer.cos();
        let a_y = front + force[1];
        if k % 10 == 0 {
            let mut noise = |std: f64| std * random.sample::<f64, _>(StandardNormal);
            let row = [v_x, v_y, yaw + v_y.atan2(v_x) + noise(0.01), delta, pull + noise(0.3)];
            let row = [row.as_slice(), &[v_x + noise(0.02), r + noise(4e-3), a_y + noise(0.8)]];
            out.iter_mut().zip(row.concat()).for_each(|(of, value)| of.push(value));
        }
        v_x += dt * (pull + r * v_y - g);
        v_y += dt * (a_y - v_x * r - b);
        r += dt * m * (l_f * front - l_r * force[1]) / I_zz;
        yaw += dt * r;
    }
    let [v_x, v_y, course, delta, a_x, speed, r, a_y] = out;
    Simulated { v_x, v_y, course, delta, a_x, speed, r, a_y }
}

impl Simulated {
    fn signals(&self) -> SensorSignals {
        SensorSignals::new(STEP, &self.delta)
            .with_a_x(&self.a_x)
            .with_channel(SensorChannel::Speed, &self.speed)
            .with_channel(SensorChannel::YawRate, &self.r)
            .with_channel(SensorChannel::LateralAcceleration, &self.a_y)
    }
}

/// RMS error of v_y [m/s] and the share inside the 95 % band, after the first two seconds.
fn judge(estimate: &SideslipEstimate, truth: &[f64]) -> [f64; 2] {
    let rows = 200..truth.len();
    let n = rows.len() as f64;
    let error = |row: usize| estimate.v_y[row] - truth[row];
    let squares: f64 = rows.clone().map(|row| error(row).powi(2)).sum();
    let inside = rows.filter(|row| error(*row).abs() < 1.96 * estimate.v_y_std[*row]).count();
    [(squares / n).sqrt(), inside as f64 / n]
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|it| it * it).sum::<f64>() / values.len() as f64).sqrt()
}

/// The simulated car's errors are of this size in estimates too.
fn setup() -> EstimatorSetup {
    let mut setup = EstimatorSetup::road_car(BODY);
    setup.disturbances.blind_slip = 0.0025;
    setup.disturbances.common_slip.std = 0.0025;
    setup
}

fn fitted(drive: &Simulated) -> SideslipFit {
    fit_sideslip_model(&setup(), &[drive.signals()], None, &mut |_| true).expect("it is a drive")
}

#[test]
#[ignore = "takes long: coverage of posteriors"]
fn v_y_and_tires_of_simulated_cars_are_found_within_their_intervals() {
    let seeds = 0..5;
    let count = f64::from(seeds.end as u32);
    let (mut held, mut causal, mut covered, mut back) = ([0.0; 2], 0.0, 0.0, [0.0; 2]);
    for seed in seeds {
        let drive = simulate(seed, 60.0);
        let fit = fitted(&drive);
        assert!(fit.converged, "seed {seed}");
        for (axle, [B, C, D]) in TIRES.into_iter().enumerate() {
            let K = fit.stiffness[axle];
            assert!((K.value / (B * C * D) - 1.0).abs() < 0.12, "seed {seed}: K {K:?}");
            let peak = fit.intervals[4 * axle + 2];
            // What hardly shows its peak says so by the width of its interval.
            let wide = peak.ends[1] > 1.3 * peak.ends[0];
            assert!(wide || (peak.value / D - 1.0).abs() < 0.1, "seed {seed}: D {peak:?}");
            let inside = |ends: [f64; 2], truth: f64| (ends[0]..ends[1]).contains(&truth);
            held[0] += f64::from(u8::from(inside(K.ends, B * C * D)));
            held[1] += f64::from(u8::from(inside(peak.ends, D)));
        }
        let [error, inside] = judge(&filter_sideslip(&setup(), &fit, &drive.signals(), None), &drive.v_y);
        assert!(error < 0.25 * rms(&drive.v_y), "seed {seed}: {error} of {}", rms(&drive.v_y));
        covered += inside / count;
        let [later, within] = judge(&smooth_sideslip(&setup(), &fit, &drive.signals(), None), &drive.v_y);
        causal += error / count;
        back = [back[0] + later / count, back[1] + within / count];
    }
    println!("held {held:?} of {}, covered {covered:.3}, smoothed {back:.3?}", 2.0 * count);
    // Of ten intervals of 95 % two or fewer miss in 99 of 100 cases.
    assert!(held[0] >= 8.0 && held[1] >= 8.0, "{held:?}");
    assert!(back[0] < causal, "smoothed {back:?}, causal {causal}");
    assert!((0.91..0.985).contains(&covered), "{covered}");
    assert!((0.90..0.985).contains(&back[1]), "{back:?}");
}

#[test]
fn sensors_may_be_missing_slow_or_interrupted() {
    let drive = simulate(11, 40.0);
    let thin = |values: &[f64]| -> Vec<f64> {
        let keep = |(row, value): (usize, &f64)| if row % 10 == 0 { *value } else { f64::NAN };
        values.iter().enumerate().map(keep).collect()
    };
    let mut holes = drive.r.clone();
    holes[2000..2100].fill(f64::NAN);
    let mut silent = drive.a_y.clone();
    silent[1500..2500].fill(f64::NAN);
    let base = SensorSignals::new(STEP, &drive.delta)
        .with_a_x(&drive.a_x)
        .with_channel(SensorChannel::Speed, &drive.speed);
    let cases = [
        ("no a_y", base.clone().with_channel(SensorChannel::YawRate, &drive.r)),
        (
            "yaw rate and a_y at 10 Hz",
            base.clone()
                .with_channel(SensorChannel::YawRate, &thin(&drive.r))
                .with_channel(SensorChannel::LateralAcceleration, &thin(&drive.a_y)),
        ),
        (
            "gaps",
            base.clone()
                .with_channel(SensorChannel::YawRate, &holes)
                .with_channel(SensorChannel::LateralAcceleration, &silent),
        ),
        (
            "no a_x",
            SensorSignals::new(STEP, &drive.delta)
                .with_channel(SensorChannel::Speed, &drive.speed)
                .with_channel(SensorChannel::YawRate, &drive.r)
                .with_channel(SensorChannel::LateralAcceleration, &drive.a_y),
        ),
    ];
    for (name, signals) in cases {
        let fit =
            fit_sideslip_model(&setup(), std::slice::from_ref(&signals), None, &mut |_| true).expect(name);
        let [error, inside] = judge(&filter_sideslip(&setup(), &fit, &signals, None), &drive.v_y);
        println!("{name}: {error:.4} m/s, {inside:.3}");
        assert!(error < 0.5 * rms(&drive.v_y), "{name}: {error} of {}", rms(&drive.v_y));
        assert!(inside > 0.8, "{name}: {inside}");
    }
}

#[test]
fn course_and_speed_over_ground_make_v_y_better() {
    let drive = simulate(5, 40.0);
    let fit = fitted(&drive);
    let mut course = vec![f64::NAN; drive.course.len()];
    let mut speed = course.clone();
    // 10 Hz, and a course that wraps.
    for row in (0..course.len()).step_by(10) {
        course[row] = drive.course[row].rem_euclid(std::f64::consts::TAU);
        speed[row] = drive.v_x[row].hypot(drive.v_y[row]);
    }
    let [without, _] = judge(&filter_sideslip(&setup(), &fit, &drive.signals(), None), &drive.v_y);
    let both = drive
        .signals()
        .with_channel(SensorChannel::Course, &course)
        .with_channel(SensorChannel::GroundSpeed, &speed);
    let [with, inside] = judge(&filter_sideslip(&setup(), &fit, &both, None), &drive.v_y);
    println!("without {without:.4}, with {with:.4} m/s, {inside:.3}");
    assert!(with < without, "{with}, without {without}");
    assert!(inside > 0.85, "{inside}");
}

#[test]
fn estimates_are_causal_and_do_not_see_v_y() {
    let drive = simulate(7, 30.0);
    let fit = fitted(&drive);
    let whole = filter_sideslip(&setup(), &fit, &drive.signals(), None);
    let part = filter_sideslip(&setup(), &fit, &drive.signals().first_rows(1500), None);
    assert_eq!(part.v_y, whole.v_y[..1500]);
    let seen = drive.signals().with_channel(SensorChannel::LateralSpeed, &drive.v_y);
    assert_eq!(filter_sideslip(&setup(), &fit, &seen, None).v_y, whole.v_y);
}

#[test]
fn what_cannot_be_fitted_is_told() {
    let drive = simulate(3, 10.0);
    let told = |signals: SensorSignals| {
        fit_sideslip_model(&setup(), &[signals], None, &mut |_| true).expect_err("it is no drive")
    };
    assert_eq!(fit_sideslip_model(&setup(), &[], None, &mut |_| true).expect_err("nothing"), Error::NoDrives);
    let blind = SensorSignals::new(STEP, &drive.delta).with_channel(SensorChannel::Speed, &drive.speed);
    assert_eq!(told(blind).to_string(), "drive 1: expected 200 values of yaw rate or more, found 0");
    let still = drive.signals().with_channel(SensorChannel::Speed, &vec![1.0; drive.v_x.len()]);
    assert_eq!(told(still), Error::TooSlow { drive: 1, least: 8.0 });
    let frozen = SensorSignals::new(0.0, &drive.delta);
    assert_eq!(told(frozen), Error::Step { drive: 1, step: 0.0 });
    assert!(BankMap::learn(&setup(), &fitted(&drive), &drive.signals()).is_none());
}

/// The first 220 s of the 250 LM say how it slides in the rest; figures as `examples/hidden_v_y.rs` has them.
#[test]
#[ignore = "needs logs of real cars"]
fn a_race_car_of_1964() {
    let column = support::columns(&support::folder(), "revs_250lm.csv").expect("a log of TRACKSIDE_DATA");
    let truth = support::lm().expect("a log of TRACKSIDE_DATA");
    let signals = SensorSignals::new(0.01, &column("delta_rad"))
        .with_a_x(&column("ax_mps2"))
        .with_channel(SensorChannel::Speed, &column("vx_mps"))
        .with_channel(SensorChannel::YawRate, &column("yaw_rate_radps"))
        .with_channel(SensorChannel::LateralAcceleration, &column("ay_mps2"))
        .without_repeats();
    let setup = EstimatorSetup::road_car(support::lm_body());
    let first = truth.motion.t.iter().filter(|t| **t < truth.motion.t[0] + 220.0).count();
    let training = signals.first_rows(first);
    let found = fit_sideslip_model(&setup, std::slice::from_ref(&training), None, &mut |_| true)
        .expect("it is a drive");
    assert!(found.converged);
    let map = BankMap::learn(&setup, &found, &training).expect("it is driven in laps");
    assert!((map.lap - 3100.0).abs() < 10.0, "{}", map.lap);
    let estimate = filter_sideslip(&setup, &found, &signals, Some(&map));
    let rows: Vec<usize> = (first..truth.row_count()).filter(|row| truth.counts[*row]).collect();
    let errors: Vec<f64> = rows.iter().map(|row| estimate.v_y[*row] - truth.motion.v_y[*row]).collect();
    let angles: Vec<f64> = rows
        .iter()
        .map(|row| {
            let of = |v_y: f64| v_y.atan2(truth.motion.v_x[*row]).to_degrees();
            of(estimate.v_y[*row]) - of(truth.motion.v_y[*row])
        })
        .collect();
    let inside =
        rows.iter().zip(&errors).filter(|(row, error)| error.abs() < 1.96 * estimate.v_y_std[**row]).count()
            as f64
            / rows.len() as f64;
    println!("v_y {:.4} m/s, sideslip {:.3} deg, {inside:.3} inside", rms(&errors), rms(&angles));
    assert!(rms(&errors) < 0.10, "{}", rms(&errors));
    assert!(rms(&angles) < 0.23, "{}", rms(&angles));
    assert!((0.93..=0.97).contains(&inside), "{inside}");
}
