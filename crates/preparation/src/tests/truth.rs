//! The points are those of the tires that the car drove on.

use approx::assert_relative_eq;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use vehicle::{SingleTrackInput, slip_ratio};

use crate::tests::drive::{Instant, car, pipeline, record, simulate, symmetric};
use crate::{Car, OffsetSettings, PreparationPipeline, PreparedRecording, SignalFilters, ZeroPhaseFilter};

fn column<'a>(prepared: &'a PreparedRecording, stage: &str, name: &str) -> (&'a [f64], &'a [f64]) {
    let stage = prepared.stages.iter().find(|s| s.name == stage).expect("the stage was run");
    let column = stage.outputs.iter().find(|c| c.name == name).expect("the stage has the column");
    (&column.time, &column.values)
}

/// Filters that are narrow enough to follow a noiseless simulation.
fn narrow() -> SignalFilters {
    let filter = ZeroPhaseFilter::SavitzkyGolay { window: 0.025, order: 4 };
    SignalFilters {
        velocity: filter,
        acceleration: filter,
        yaw_rate: filter,
        steering: filter,
        wheels: filter,
    }
}

/// Offsets that are known to be none.
fn no_offsets() -> OffsetSettings {
    OffsetSettings {
        r: Some(0.0),
        a_x: Some(0.0),
        a_y: Some(0.0),
        sideslip: Some(0.0),
        ..OffsetSettings::default()
    }
}

#[test]
fn forces_are_those_of_the_plant_in_a_lane_change_at_the_limit() {
    let vehicle = car();
    let drive = simulate(&vehicle, 24.0, 1.0);
    let mut pipeline = pipeline(&vehicle);
    (pipeline.smooth, pipeline.offsets) = (narrow(), no_offsets());
    let prepared = pipeline.prepare(&record(&drive)).expect("the recording is complete");

    let most = |of: &dyn Fn(&Instant) -> f64| drive.iter().map(|i| of(i).abs()).fold(0.0, f64::max);
    let peak = vehicle.tire_f.peak_slip().expect("C is above 1");
    assert!(most(&|i| i.motion.alpha_f) > peak, "beyond the peak: {}", most(&|i| i.motion.alpha_f));
    assert!(most(&|i| i.motion.derivative.r) > 4.0, "unsteady: {}", most(&|i| i.motion.derivative.r));

    let expect = |name: &str, of: &dyn Fn(&Instant) -> f64, close: f64| {
        let (time, found) = column(&prepared, "axle forces and slips", name);
        assert!(time.len() > 2300);
        for (t, found) in time.iter().zip(found).skip(5).take(time.len() - 10) {
            let truth = of(&drive[(t / 0.0025).round() as usize]);
            assert!((found - truth).abs() < close, "{name} at {t} s: {found} instead of {truth}");
        }
    };
    expect("F_yf", &|i| i.motion.F_yf, 10.0);
    expect("F_yr", &|i| i.motion.F_yr, 2.0);
    expect("F_zf", &|i| i.motion.F_zf, 0.01);
    expect("F_zr", &|i| i.motion.F_zr, 0.01);
    expect("F_xf", &|i| i.motion.F_xf, 0.1);
    expect("F_xr", &|i| i.motion.F_xr, 0.1);
    expect("alpha_f", &|i| i.motion.alpha_f, 1e-4);
    expect("alpha_r", &|i| i.motion.alpha_r, 1e-6);
}

#[test]
fn points_lie_on_the_curves() {
    let vehicle = car();
    let mut pipeline = pipeline(&vehicle);
    (pipeline.smooth, pipeline.offsets) = (narrow(), no_offsets());
    let prepared =
        pipeline.prepare(&record(&simulate(&vehicle, 24.0, 1.0))).expect("the recording is complete");
    for (axle, tire) in [(&prepared.front, vehicle.tire_f), (&prepared.rear, vehicle.tire_r)] {
        assert!(axle.longitudinal.is_none());
        let samples = &axle.lateral.samples;
        for (slip, force) in samples.slip.iter().zip(&samples.force).skip(5).take(samples.len() - 10) {
            assert_relative_eq!(*force, tire.friction_coefficient(*slip), epsilon = 0.005);
        }
    }
}

#[test]
fn wheel_speeds_give_slip_ratios() {
    let vehicle = car();
    let drive = simulate(&vehicle, 24.0, 1.0);
    let mut recording = record(&drive);
    // Tires that slip by force over load over 20, on wheels of 0.3 m; the outer wheels are faster.
    let mut wheel = |name: &str, axle: usize, side: f64| {
        let omega = |i: &Instant| {
            let SingleTrackInput { delta, .. } = i.input;
            let (F_x, F_z) = [(i.motion.F_xf, i.motion.F_zf), (i.motion.F_xr, i.motion.F_zr)][axle];
            let v_y = i.state.v_y + vehicle.body.l_f * i.state.r;
            let v = [i.state.v_x * delta.cos() + v_y * delta.sin(), i.state.v_x][axle];
            (1.0 + F_x / F_z / 20.0) * v / 0.3 - side * 2.0 * i.state.r
        };
        recording.insert(name, drive.iter().map(|i| i.time).collect(), drive.iter().map(omega).collect());
    };
    wheel("omega_fl", 0, 1.0);
    wheel("omega_fr", 0, -1.0);
    wheel("omega_rl", 1, 1.0);
    wheel("omega_rr", 1, -1.0);
    let mut pipeline = pipeline(&vehicle);
    (pipeline.smooth, pipeline.offsets) = (narrow(), no_offsets());
    let prepared = pipeline.prepare(&recording).expect("the recording is complete");
    for (index, axle) in [&prepared.front, &prepared.rear].into_iter().enumerate() {
        let samples = &axle.longitudinal.as_ref().expect("all wheel speeds are there").samples;
        let [low, high] = samples.slip_range().expect("there are points");
        // The front wheels only brake.
        assert!(low < -0.005 && (index == 0 || high > 0.01), "{low} {high}");
        for (slip, force) in samples.slip.iter().zip(&samples.force).skip(5).take(samples.len() - 10) {
            assert_relative_eq!(*force, 20.0 * slip, epsilon = 0.02);
        }
    }
    assert_relative_eq!(slip_ratio(101.0, 0.3, 30.0), 0.01, max_relative = 1e-9);
}

#[test]
fn offsets_of_the_sensors_are_found_and_taken_off() {
    let vehicle = symmetric();
    let drive = simulate(&vehicle, 24.0, 1.0);
    let disturb = |name: &str, by: f64, recording: &mut crate::DriveLog| {
        let signal = recording.get(name).expect("it is there").clone();
        recording.insert(name, signal.time.into_owned(), signal.value.iter().map(|v| v + by).collect());
    };
    let mut recording = record(&drive);
    for (name, by) in [("r", 0.003), ("a_x", -0.1), ("a_y", 0.15)] {
        disturb(name, by, &mut recording);
    }
    let mut pipeline = pipeline(&vehicle);
    pipeline.smooth = narrow();
    pipeline.offsets = OffsetSettings { sideslip: Some(0.0), enough: 1.0, ..OffsetSettings::default() };
    let prepared = pipeline.prepare(&recording).expect("the recording is complete");
    for (offset, (by, close)) in
        prepared.report.offsets.iter().zip([(0.003, 1e-4), (-0.1, 1e-3), (0.15, 5e-3)])
    {
        assert!(offset.samples > 100, "{offset:?}");
        assert_relative_eq!(offset.value, by, epsilon = close);
    }
}

#[test]
fn noisy_sensors_scatter_about_the_curves() {
    let vehicle = symmetric();
    let mut recording = record(&simulate(&vehicle, 24.0, 1.0));
    let mut random = Pcg64::seed_from_u64(1);
    for (name, std) in
        [("v_x", 0.05), ("v_y", 0.03), ("a_x", 0.5), ("a_y", 0.5), ("r", 0.005), ("delta", 0.001)]
    {
        let noise = Normal::new(0.0, std).expect("it is positive");
        let signal = recording.get(name).expect("it is there").clone();
        let value = signal.value.iter().map(|v| v + noise.sample(&mut random)).collect();
        recording.insert(name, signal.time.into_owned(), value);
    }
    let car = Car { body: vehicle.body, aero: vehicle.aero, ..Car::default() };
    let settings = PreparationPipeline { car, offsets: no_offsets(), ..PreparationPipeline::default() };
    let prepared = settings.prepare(&recording).expect("the recording is complete");
    for (axle, tire) in [(&prepared.front, vehicle.tire_f), (&prepared.rear, vehicle.tire_r)] {
        let samples = &axle.lateral.samples;
        let part = |low: f64, high: f64| -> Vec<f64> {
            let inside = (0..samples.len()).filter(|&i| (low..high).contains(&samples.slip[i].abs()));
            let outward = |i: usize| {
                (samples.force[i] - tire.friction_coefficient(samples.slip[i])) * samples.slip[i].signum()
            };
            inside.map(outward).collect()
        };
        for (low, high) in [(0.005, 0.03), (0.03, 0.06), (0.06, 0.1)] {
            let error = part(low, high);
            assert!(error.len() > 20);
            let mean = error.iter().sum::<f64>() / error.len() as f64;
            assert!(mean.abs() < 0.02, "{mean} from {low} to {high}");
        }
    }
}
