//! Compares the filter's car with the plant's, its derivatives with differences, and its innovations with a filter of matrices.

use kalman::Gaussian;
use kalman::augmented::{AugmentedFilter, ColouredNoise, StateEstimate, ZeroOrderHold};
use nalgebra::{SMatrix, SVector};
use num_dual::Dual64;
use proptest::prelude::*;
use tire_inference::parameters::TireParameters;
use vehicle::{Aerodynamics, PlanarState, SingleTrackCar, SingleTrackInput, VehicleBody};

use super::*;
use crate::car::{CarInput, FilterCarParameters, SteadySlip, linearise_steady_slip};
use crate::likelihood::{DerivativeDirection, DriveLikelihood, DriveNoise, DriveUnknowns};
use crate::recorded_input::RecordedInput;
use crate::residual_rows::ResidualRows;
use crate::sensors::SensorModel;
use crate::tires::from_array;
use preparation::{ESTIMATED, SystematicError, SystematicErrors};

const TIRES: Tires = Tires {
    front: TireParameters { B: 18.0, C: 1.6, D: 1.5, E: 0.5 },
    rear: TireParameters { B: 25.0, C: 1.9, D: 1.7, E: 0.9 },
};

fn winged() -> SingleTrackCar {
    SingleTrackCar {
        aero: Aerodynamics { C_lf: 0.4, C_lr: 0.6, ..Aerodynamics::default() },
        ..SingleTrackCar::default()
    }
}

/// What holding an input does.
fn held(car: &SingleTrackCar, F_x: f64, delta: f64) -> CarInput<f64> {
    RecordedInput::new(car.brake_front_share, &SingleTrackInput { F_x, delta }, [0.0; 2])
        .with_force_factor(1.0)
}

fn exact(car: &SingleTrackCar) -> FilterCarParameters<f64> {
    FilterCarParameters::new(car, &SystematicErrors::default())
}

fn filter(
    car: &SingleTrackCar,
    noise: &DriveNoise,
) -> AugmentedFilter<SteadySlip<f64, false>, SensorModel<f64, false>, f64, 4, 4> {
    AugmentedFilter {
        process: SteadySlip { car: exact(car), tires: TIRES },
        measurement: SensorModel::new(&SystematicErrors::default()),
        process_noise: noise.variances().process,
        sensor_noise: noise.variances().sensor,
        coloured_noise: noise.coloured,
    }
}

/// Rates of v_x, v_y and r, and a_y, by the plant's own equations.
fn plant<T: vehicle::Number>(car: &SingleTrackCar, x: [T; 3], input: &SingleTrackInput) -> [T; 4] {
    let car = car.with_tires(TIRES.front.to_magic_formula(), TIRES.rear.to_magic_formula()).cast();
    let state = PlanarState { X: T::zero(), Y: T::zero(), psi: T::zero(), v_x: x[0], v_y: x[1], r: x[2] };
    let input = SingleTrackInput { F_x: input.F_x.into(), delta: input.delta.into() };
    let motion = car.evaluate(&state, &input);
    let rate = motion.derivative;
    [rate.v_x, rate.v_y, rate.r, motion.a_y]
}

proptest! {
    #[test]
    fn the_filters_car_is_the_plants(
        v_x in 0.5..60.0f64, v_y in -6.0..6.0f64, r in -1.5..1.5f64, F_x in -6e3..6e3f64,
        delta in -0.3..0.3f64,
    ) {
        let (car, input) = (winged(), SingleTrackInput { F_x, delta });
        let (held, tires, its) = (held(&car, F_x, delta), TIRES, exact(&car));
        let x = [v_x, v_y, r, 0.0];
        let expected = plant(&car, [v_x, v_y, r], &input);
        let linear = linearise_steady_slip::<_, false>(&its, &tires, &x, &held);
        for (found, expected) in linear.rates.into_iter().chain([linear.a_y]).zip(expected) {
            prop_assert!((found - expected).abs() <= 1e-11 * (1.0 + expected.abs()));
        }
        for j in 0..3 {
            let mut seeded = [v_x, v_y, r].map(Dual64::from);
            seeded[j].eps = 1.0;
            let by = plant(&car, seeded, &input).map(|rate| rate.eps);
            for (i, row) in linear.A.iter().chain([&linear.C]).enumerate() {
                prop_assert!((row[j] - by[i]).abs() <= 1e-9 * (1.0 + by[i].abs()), "{i} {j}");
            }
        }
        // A force that the inputs do not know acts like drag: differences, as the plant has no such force.
        let moved = |xi: f64| linearise_steady_slip::<_, false>(&its, &tires, &[v_x, v_y, r, xi], &held).rates;
        let (more, less) = (moved(1.0), moved(-1.0));
        for i in 0..3 {
            let by = 0.5 * (more[i] - less[i]);
            prop_assert!((linear.A[i][3] - by).abs() <= 1e-9 * (1.0 + by.abs()), "{i}");
        }
    }
}

proptest! {
    /// Tires whose friction falls with the load, on a road that is banked in turns.
    #[test]
    fn load_sensitivity_and_bank_are_those_of_the_plant(
        v_x in 5.0..60.0f64, v_y in -2.0..2.0f64, r in -1.5..1.5f64, F_x in -4e3..4e3f64,
        delta in -0.2..0.2f64, sensitivity in 0.0..0.3f64, bank in -0.1..0.1f64,
    ) {
        let (mut car, input) = (winged(), SingleTrackInput { F_x, delta });
        let mut causes = SystematicErrors::default();
        causes[SystematicError::LoadSensitivity] = sensitivity;
        causes[SystematicError::BankLeft] = bank;
        causes[SystematicError::BankRight] = bank;
        let its = FilterCarParameters::new(&car, &causes);
        let linear = linearise_steady_slip::<_, true>(&its, &TIRES, &[v_x, v_y, r, 0.0], &held(&car, F_x, delta));
        let state = PlanarState { v_x, v_y, r, ..PlanarState::default() };
        car = car.with_tires(TIRES.front.to_magic_formula(), TIRES.rear.to_magic_formula());
        let rest = car.body.static_loads();
        // The load that a steered axle's drag moves depends on its friction.
        for _ in 0..30 {
            let now = car.evaluate(&state, &input);
            car.tire_f.D = TIRES.front.D * (1.0 - sensitivity * (now.F_zf / rest[0] - 1.0));
            car.tire_r.D = TIRES.rear.D * (1.0 - sensitivity * (now.F_zr / rest[1] - 1.0));
        }
        let motion = car.evaluate(&state, &input);
        let pull = if r.abs() < 0.03 { linear.rates[1] - motion.derivative.v_y } else { vehicle::G * bank * r.signum() };
        let expected = [motion.derivative.v_x, motion.derivative.v_y + pull, motion.derivative.r, motion.a_y];
        for (found, expected) in linear.rates.into_iter().chain([linear.a_y]).zip(expected) {
            prop_assert!((found - expected).abs() <= 2e-3 * (1.0 + expected.abs()), "{found} {expected}");
        }
    }
}

/// A slalom with braking that takes both axles past their peaks, measured with a fixed pattern of errors.
fn recording(car: &SingleTrackCar, seconds: f64) -> Drive {
    let car = car.with_tires(TIRES.front.to_magic_formula(), TIRES.rear.to_magic_formula());
    let mut state = PlanarState { v_x: 22.0, ..PlanarState::default() };
    let mut recording = Drive::default();
    for k in 0..(100.0 * seconds) as usize {
        let t = 0.01 * k as f64;
        let input = SingleTrackInput {
            F_x: 3000.0 * (1.9 * t).sin() + 400.0,
            delta: 0.09 * (2.6 * t).sin() + 0.05 * (7.1 * t).sin() - 0.35 * state.r,
        };
        state = car.advance(&state, &input, 0.01, 0.002);
        let error = |j: f64| (1e4 * (j + 1.3) * (k as f64 + 0.7).sqrt()).sin();
        recording.t.push(t);
        recording.v_x.push(state.v_x + 0.07 * error(0.0));
        recording.v_y.push(state.v_y + 0.014 * error(1.0));
        recording.r.push(state.r + 0.014 * error(2.0));
        recording.a_y.push(car.evaluate(&state, &input).a_y + 0.14 * error(3.0));
        recording.F_x.push(input.F_x);
        recording.delta.push(input.delta);
    }
    recording
}

const NOISE: DriveNoise = DriveNoise {
    sensor: [0.05, 0.01, 0.01, 0.1],
    process: [2e-3, 3e-3, 1e-3, 200.0],
    coloured: [ColouredNoise::WHITE; 4],
};

#[test]
fn gradients_are_those_of_central_differences() {
    let theta = [20.0, 1.5, 1.4, 0.3, 21.0, 1.7, 1.6, 0.6];
    let (car, tires) = (winged(), from_array(theta));
    let likelihood = DriveLikelihood::new(&car, &[recording(&car, 3.0), recording(&car, 1.0)]);
    let exact = likelihood.evaluate_by_tires(&DriveUnknowns::new(&tires, &NOISE));
    // Four terms of the sum are added in another order.
    let cost = likelihood.cost(&DriveUnknowns::new(&from_array(theta), &NOISE));
    assert!((exact.cost - cost).abs() < 1e-13 * cost.abs());
    for i in 0..8 {
        let moved = |h: f64| {
            let mut theta = theta;
            theta[i] += h;
            likelihood.cost(&DriveUnknowns::new(&from_array(theta), &NOISE))
        };
        let h = 1e-5 * theta[i];
        // Richardson's extrapolation of two central differences: an error of fourth order.
        let difference = |h: f64| (moved(h) - moved(-h)) / (2.0 * h);
        let expected = (4.0 * difference(h) - difference(2.0 * h)) / 3.0;
        let allowed = 1e-6 * expected.abs() + 1e-12 * exact.cost.abs() / h;
        assert!((exact.gradient[i] - expected).abs() < allowed, "{i}: {} {expected}", exact.gradient[i]);
    }
    let by_noise = likelihood.evaluate_by_noise(&DriveUnknowns::new(&tires, &NOISE));
    for i in 0..8 {
        let moved = |h: f64| {
            let mut noise = NOISE;
            if i < 4 {
                noise.sensor[i] *= h.exp();
            } else {
                noise.process[i - 4] *= (1.0 + h).sqrt();
            }
            likelihood.cost(&DriveUnknowns::new(&tires, &noise))
        };
        let unit = if i < 4 { 1.0 } else { NOISE.process[i - 4].powi(-2) };
        let expected = unit * (moved(1e-5) - moved(-1e-5)) / 2e-5;
        let found = by_noise.gradient[i];
        assert!((found - expected).abs() < 1e-6 * expected.abs() + unit * 1e-6, "{i}: {found} {expected}");
    }
}

/// Errors that a careful engineer would not make, all at once.
fn errors() -> SystematicErrors {
    let mut causes = SystematicErrors::default();
    for cause in SystematicError::ALL {
        causes[cause] = 0.3 * cause.describe().std;
    }
    causes
}

/// Of every kind of filter: with errors alone, with noises that last, and with slips that relax as well.
#[test]
fn derivatives_by_errors_and_colours_are_those_of_differences() {
    let (car, mut rigid) = (winged(), errors());
    SystematicError::TIRES.iter().for_each(|cause| rigid[*cause] = 0.0);
    let coloured = [(0.0, 0.0), (0.6, 0.3), (0.9, 0.5), (0.8, 0.7)]
        .map(|(correlation, share)| ColouredNoise { correlation, share });
    let coloured = DriveNoise { coloured, ..NOISE };
    let recordings = [recording(&car, 3.0)];
    for (causes, noise) in [(rigid, NOISE), (rigid, coloured), (errors(), coloured)] {
        let at = DriveUnknowns { causes, noise, ..DriveUnknowns::new(&TIRES, &NOISE) };
        let likelihood = DriveLikelihood::with_delays(&car, &recordings, &at);
        let errors = SystematicError::ALL.into_iter().filter(|cause| causes[*cause] != 0.0);
        let colours = (0..4).filter(|i| noise.coloured[*i].share > 0.0);
        let directions: Vec<DerivativeDirection> =
            errors
                .map(DerivativeDirection::Error)
                .chain(colours.flat_map(|i| {
                    [DerivativeDirection::Correlation(i), DerivativeDirection::LastingShare(i)]
                }))
                .collect();
        let found = likelihood.residual_rows(&at, &directions).total_expansion();
        for (i, direction) in directions.iter().enumerate() {
            let moved = |share: f64| {
                let mut at = at;
                match *direction {
                    DerivativeDirection::Error(cause) => at.causes[cause] += share * cause.describe().std,
                    DerivativeDirection::Correlation(i) => at.noise.coloured[i].correlation += share,
                    DerivativeDirection::LastingShare(i) => at.noise.coloured[i].share += share,
                    DerivativeDirection::Tire(_) | DerivativeDirection::Noise(_) => {}
                }
                likelihood.cost(&at)
            };
            let difference = |h: f64| (moved(h) - moved(-h)) / (2.0 * h);
            let expected = (4.0 * difference(1e-4) - difference(2e-4)) / 3.0;
            let off = (found.gradient[i] - expected).abs();
            assert!(off < 1e-6 * expected.abs() + 1e-4, "{direction:?}: {} {expected}", found.gradient[i]);
        }
    }
}

/// Slips that follow within a hand's breadth and noises of which nothing lasts are hardly any.
#[test]
fn augmented_filters_end_in_the_base_one() {
    let car = winged();
    let recordings = [recording(&car, 3.0)];
    let likelihood = DriveLikelihood::new(&car, &recordings);
    let at = DriveUnknowns::new(&TIRES, &NOISE);
    let base = likelihood.cost(&at);
    let mut white = at;
    white.noise.coloured = [ColouredNoise { correlation: 0.5, share: 1e-12 }; 4];
    assert!((likelihood.cost(&white) - base).abs() < 1e-6 * base.abs());
    let mut short = at;
    SystematicError::TIRES.iter().for_each(|cause| short.causes[*cause] = 0.03);
    let shorter = likelihood.cost(&short);
    SystematicError::TIRES.iter().for_each(|cause| short.causes[*cause] = 0.06);
    let longer = likelihood.cost(&short);
    assert!((shorter - base).abs() < 0.7 * (longer - base).abs(), "{base} {shorter} {longer}");
}

#[test]
fn every_error_has_its_own_effect() {
    let car = winged();
    let recordings = [recording(&car, 4.0)];
    let at = DriveUnknowns::new(&TIRES, &NOISE);
    let likelihood = DriveLikelihood::with_delays(&car, &recordings, &at);
    let rigid: Vec<_> = SystematicError::ALL
        .into_iter()
        .filter(|cause| !SystematicError::TIRES.contains(cause))
        .map(DerivativeDirection::Error)
        .collect();
    assert_eq!(rigid.len(), ESTIMATED - 2);
    let information = likelihood.residual_rows(&at, &rigid).total_expansion().information;
    for i in 0..rigid.len() {
        assert!(information[(i, i)] > 0.0, "{:?}", rigid[i]);
        for j in 0..i {
            let both = information[(i, j)].powi(2);
            assert!(both < 0.9999 * information[(i, i)] * information[(j, j)]);
        }
    }
}

/// The filter against `kalman`, with the transition from differences of the integrated state: both covariances move with the
/// same linearisation but for the fifth order of the step, and measurements one by one are measurements at once.
#[test]
fn innovations_are_those_of_a_textbook_filter() {
    let car = winged();
    let recording = recording(&car, 1.0);
    let (filter, its) = (filter(&car, &NOISE), exact(&car));
    let start = [0.05f64, 0.01, 0.01, 300.0].map(|s| s * s);
    let [v_x, v_y, r, _] = recording.measurements_at(0);
    let mut estimate = StateEstimate { x: [v_x, v_y, r, 0.0], P: [[0.0; 4]; 4] };
    for (i, row) in estimate.P.iter_mut().enumerate() {
        row[i] = start[i];
    }
    let mut textbook = Gaussian {
        mean: SVector::from([v_x, v_y, r, 0.0]),
        cov: SMatrix::<f64, 4, 4>::from_diagonal(&SVector::from(start)),
    };
    let Q = SMatrix::from_diagonal(&SVector::from(NOISE.process.map(|s| 0.01 * s * s)));
    let R = SMatrix::from_diagonal(&SVector::from(NOISE.sensor.map(|s| s * s)));
    for k in 1..recording.len() {
        let held = held(&car, recording.F_x[k], recording.delta[k]);
        let flow = |x: SVector<f64, 4>| {
            vehicle::rk4_step(&vehicle::rk4_step(&x, 0.005, |x| rate(&its, x, &held)), 0.005, |x| {
                rate(&its, x, &held)
            })
        };
        let F = SMatrix::from_fn(|i, j| {
            let h = [1e-4, 1e-4, 1e-4, 1.0][j];
            let moved = |h: f64| {
                let mut x = textbook.mean;
                x[j] += h;
                flow(x)[i]
            };
            (moved(h) - moved(-h)) / (2.0 * h)
        });
        let prior = kalman::predict(&textbook, flow(textbook.mean), &F, &Q);
        let linear = linearise_steady_slip::<_, false>(&its, &TIRES, &prior.mean.into(), &held);
        let mut H = SMatrix::<f64, 4, 4>::zeros();
        for j in 0..4 {
            H[(j, j)] = if j < 3 { 1.0 } else { 0.0 };
            H[(3, j)] = linear.C[j];
        }
        let expected = SVector::from([prior.mean[0], prior.mean[1], prior.mean[2], linear.a_y]);
        let residual = SVector::from(recording.measurements_at(k)) - expected;
        let (after, corrected) = kalman::measurement_update(&prior, &residual, &H, &R).expect("a covariance");
        textbook = after;
        let innovation =
            filter.step(&mut estimate, &ZeroOrderHold(held), 0.01, 1, &recording.measurements_at(k));
        let squares = (0..4).map(|i| innovation.residual[i].powi(2) / innovation.variance[i]);
        let nis: f64 = squares.sum();
        assert!((nis - corrected.nis).abs() < 5e-3 * corrected.nis.max(1.0), "{k}: {nis} {}", corrected.nis);
    }
}

/// One step without measurements worth the name, against short Runge-Kutta steps, in the middle of a slide: off by less than a
/// fiftieth of the noise of good sensors, 3e-3 m/s and rad/s.
#[test]
fn predictions_are_those_of_short_steps() {
    let car = winged();
    let its = exact(&car);
    let filter = filter(&car, &DriveNoise { sensor: [1e6; 4], ..NOISE });
    for (v_x, steps) in [(8.0, 2), (15.0, 1), (25.0, 1), (60.0, 1)] {
        for slide in [-0.25, -0.1, 0.0, 0.05, 0.15] {
            let held = held(&car, -2000.0, 0.12);
            let x = [v_x, slide * v_x, 0.8, 150.0];
            let mut estimate = StateEstimate { x, P: [[0.0; 4]; 4] };
            filter.step(&mut estimate, &ZeroOrderHold(held), 0.01, steps, &[0.0; 4]);
            let mut expected = SVector::from(x);
            for _ in 0..100 {
                expected = vehicle::rk4_step(&expected, 1e-4, |x| rate(&its, x, &held));
            }
            for i in 0..3 {
                let off = estimate.x[i] - expected[i];
                assert!(off.abs() < 6e-5, "{v_x} {slide} {i}: {off}");
            }
        }
    }
}

#[test]
fn all_vectors_give_the_same_bits() {
    let likelihood = DriveLikelihood::new(&winged(), &[recording(&winged(), 1.0)]);
    let at = DriveUnknowns::new(&TIRES, &NOISE);
    let directions: [DerivativeDirection; 8] = std::array::from_fn(DerivativeDirection::Tire);
    let wide = likelihood.residual_rows(&at, &directions).to_evaluation();
    let scalar =
        ResidualRows::new(vec![likelihood.residuals_by_direction(&at, &directions)], 8).to_evaluation();
    assert_eq!(wide.cost, scalar.cost);
    assert_eq!(wide.gradient, scalar.gradient);
    assert_eq!(wide.information, scalar.information);
}

fn rate(car: &FilterCarParameters<f64>, x: &SVector<f64, 4>, held: &CarInput<f64>) -> SVector<f64, 4> {
    let [v_x, v_y, r] = linearise_steady_slip::<_, false>(car, &TIRES, &(*x).into(), held).rates;
    SVector::from([v_x, v_y, r, 0.0])
}

#[test]
fn unusable_recordings_say_where() {
    let good = recording(&SingleTrackCar::default(), 1.0);
    let identify = |recording: &Drive| {
        identify_tires(std::slice::from_ref(recording), &DriveOptions::default(), &mut |_, _| true)
            .expect_err("nothing to identify from")
            .to_string()
    };
    let mut short = good.clone();
    short.delta.pop();
    assert!(identify(&short).contains("expected 100 rows as in column t, found 99 in column delta"));
    let mut hole = good.clone();
    hole.r[7] = f64::NAN;
    assert!(identify(&hole).contains("column r, found NaN in row 7"));
    let mut still = good.clone();
    still.t[5] = still.t[4];
    assert!(identify(&still).contains("in row 5"));
    let nothing = crate::identify_tires(&[], &DriveOptions::default(), &mut |_, _| true);
    assert_eq!(nothing.err(), Some(Error::NoRecording));
}

#[test]
fn heavier_cars_need_no_other_steps() {
    // A body of other proportions, at a walking pace: the filter must not become unstable.
    let body = VehicleBody { m: 1500.0, I_zz: 1200.0, ..VehicleBody::default() };
    let car = SingleTrackCar { body, ..SingleTrackCar::default() };
    let mut slow = recording(&car, 1.0);
    slow.v_x.iter_mut().for_each(|v| *v = 2.0);
    slow.v_y.iter_mut().for_each(|v| *v = 0.0);
    slow.r.iter_mut().for_each(|v| *v = 0.0);
    let cost = DriveLikelihood::new(&car, &[slow]).cost(&DriveUnknowns::new(&TIRES, &NOISE));
    assert!(cost.is_finite(), "{cost}");
}
