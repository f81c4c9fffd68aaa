//! Checks EM against likelihoods, textbook formulas and noises that are known.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;

use super::*;
use crate::dense::{LinearSystemCase, arbitrary_cases, dense_noises, diagonal_cases};
use crate::{Gaussian, filter_forward, smooth_recording};

fn expected<const N: usize, const M: usize>(
    steps: &[LinearStep<N, M>],
    p: &NoiseParameters<N, M>,
    joint_R: bool,
) -> NoiseMoments<N, M> {
    let mut filtered = CorrectedRecording::empty(p.start);
    filtered.filter_into(steps, p, joint_R).expect("covariances");
    expected_noise_moments(steps, &filtered, p, joint_R)
}

fn likelihood<const N: usize, const M: usize>(steps: &[LinearStep<N, M>], p: &NoiseParameters<N, M>) -> f64 {
    filter_forward(steps, p).expect("covariances").log_likelihood
}

/// A stable system of three states and two sensors that swing, and noises as given.
fn record(length: usize, p: &NoiseParameters<3, 2>, seed: u64) -> Vec<LinearStep<3, 2>> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut normal =
        |L: &SMatrix<f64, 3, 3>| L * Vector3::from_fn(|_, _| rng.sample::<f64, _>(StandardNormal));
    let (Q, R) = (p.Q.cholesky().expect("Q").l(), p.R.cholesky().expect("R").l().to_homogeneous());
    let mut x = p.start.mean + normal(&p.start.cov.cholesky().expect("P").l());
    let mut sample = |k: usize| {
        let (sin, cos) = (0.1 * k as f64).sin_cos();
        let H = SMatrix::<f64, 2, 3>::new(1.0, 0.3 * sin, 0.0, 0.0, 1.0, 1.0 + 0.5 * cos);
        let F = Matrix3::new(0.9, 0.2, 0.1 * sin, -0.2, 0.8, 0.0, 0.0, 0.1, 0.7 + 0.2 * cos);
        let b = Vector3::new(0.1 * sin, 0.0, 0.2);
        let y = H * x + normal(&R).xy();
        x = F * x + b + normal(&Q);
        LinearStep { y, H, F, b }
    };
    (0..length).map(&mut sample).collect()
}

fn noises(Q: [f64; 3], R: [f64; 2]) -> NoiseParameters<3, 2> {
    NoiseParameters {
        start: Gaussian { mean: Vector3::zeros(), cov: Matrix3::identity() },
        Q: Matrix3::from_diagonal(&Vector3::from(Q)),
        R: Matrix2::from_diagonal(&Vector2::from(R)),
    }
}

const TRUTH: ([f64; 3], [f64; 2]) = ([0.3, 0.1, 0.5], [0.2, 0.6]);
const GUESS: ([f64; 3], [f64; 2]) = ([3.0, 0.02, 5.0], [2.0, 0.05]);

/// Largest difference of the logarithms of two sets of variances.
fn apart<const D: usize>(a: &SMatrix<f64, D, D>, b: &SMatrix<f64, D, D>) -> f64 {
    a.diagonal().zip_map(&b.diagonal(), |a, b| (a / b).ln().abs()).max()
}

/// The moments of w, and of each component of v over the steps that measured it, by the formula of Shumway and Stoffer.
fn textbook(steps: &[LinearStep<3, 2>], p: &NoiseParameters<3, 2>) -> (Matrix3<f64>, Vector2<f64>) {
    let s = smooth_recording(steps, &filter_forward(steps, p).expect("covariances")).expect("covariances");
    let (mut Q, mut R, mut measured) = (Matrix3::zeros(), Vector2::zeros(), Vector2::zeros());
    for (k, step) in steps.iter().enumerate() {
        let e = step.y - step.H * s.states[k].mean;
        let led = (step.H * s.states[k].cov * step.H.transpose()).diagonal();
        for i in (0..2).filter(|i| !step.y[*i].is_nan()) {
            R[i] += e[i] * e[i] + led[i];
            measured[i] += 1.0;
        }
        if let Some(next) = s.states.get(k + 1) {
            let d = next.mean - step.F * s.states[k].mean - step.b;
            let cross = s.lag_one[k] * step.F.transpose();
            let led = step.F * s.states[k].cov * step.F.transpose();
            Q += d * d.transpose() + next.cov - cross - cross.transpose() + led;
        }
    }
    (Q / (steps.len() - 1) as f64, R.component_div(&measured))
}

/// A covariance of the rank that `kept` tells.
fn of_rank(C: &Matrix3<f64>, kept: [bool; 3]) -> Matrix3<f64> {
    let L = C.cholesky().expect("a covariance").l();
    L * Matrix3::from_diagonal(&Vector3::from(kept.map(|kept| f64::from(u8::from(kept))))) * L.transpose()
}

/// The same from all noises as one vector, and of v as a matrix.
fn dense_moments(steps: &[LinearStep<3, 2>], p: &NoiseParameters<3, 2>) -> NoiseMoments<3, 2> {
    let (mean, cov) = dense_noises(steps, p);
    let (T, second) = (steps.len(), &mean * mean.transpose() + &cov);
    let of_w = |k: usize| second.fixed_view::<3, 3>(3 + 3 * k, 3 + 3 * k).into_owned();
    let of_v = |k: usize| second.fixed_view::<2, 2>(3 * T + 2 * k, 3 * T + 2 * k).into_owned();
    NoiseMoments {
        start: Gaussian {
            mean: p.start.mean + mean.fixed_rows::<3>(0),
            cov: cov.fixed_view::<3, 3>(0, 0).into_owned(),
        },
        Q: (0..T - 1).map(of_w).sum::<Matrix3<f64>>() / (T - 1) as f64,
        R: (0..T).map(of_v).sum::<Matrix2<f64>>() / T as f64,
        transitions: T - 1,
        measured: [T; 2],
    }
}

proptest! {
    /// The textbook inverts the predicted covariances, which loses their condition number times the rounding of 1e-16 of states whose
    /// variance is below 10; that number is below 1e3 where no F shrinks a state to nothing.
    #[test]
    fn moments_are_those_of_the_textbook(
        (mut steps, mut p) in diagonal_cases(12), (_, other) in arbitrary_cases(1), kept in any::<[bool; 3]>(),
    ) {
        for step in &mut steps {
            step.F = Matrix3::identity() + 0.2 * step.F;
        }
        steps[0].y = Vector2::new(0.5, -0.5);
        p.Q = of_rank(&other.Q, kept);
        let (Q, R) = textbook(&steps, &p);
        let moments = expected(&steps, &p, false);
        prop_assert!((moments.Q - Q).amax() <= 1e-12, "{} {}", moments.Q, Q);
        prop_assert!((moments.R.diagonal() - R).amax() <= 1e-12, "{} {}", moments.R, R);
    }

    /// With a predicted covariance that is singular as well; nothing is inverted but the covariance of all measurements, whose
    /// condition number is below 1e3.
    #[test]
    fn moments_are_those_of_all_noises_as_one_vector(
        (mut steps, p) in arbitrary_cases(6), kept in any::<[[bool; 3]; 2]>(),
    ) {
        let start = Gaussian { cov: of_rank(&p.start.cov, kept[0]), ..p.start };
        let p = NoiseParameters { start, Q: of_rank(&p.Q, kept[1]), ..p };
        let dense = dense_moments(&steps, &p);
        // The sensitivity of what was not measured is of no account.
        for step in &mut steps {
            for i in (0..2).filter(|i| step.y[*i].is_nan()) {
                step.H.row_mut(i).fill(f64::NAN);
            }
        }
        let moments = expected(&steps, &p, true);
        prop_assert!((moments.Q - dense.Q).amax() <= 1e-12, "{} {}", moments.Q, dense.Q);
        prop_assert!((moments.R - dense.R).amax() <= 1e-12, "{} {}", moments.R, dense.R);
        prop_assert!((moments.start.mean - dense.start.mean).amax() <= 1e-12);
        prop_assert!((moments.start.cov - dense.start.cov).amax() <= 1e-12);
    }

    #[test]
    fn slopes_are_differences_of_the_likelihood((steps, p) in arbitrary_cases(12)) {
        let moments = expected(&steps, &p, true);
        let slope_Q = log_variance_slope(&CovarianceStructure::Full, &p.Q, &moments.Q, &[moments.transitions; 3]);
        let slope_R = log_variance_slope(&CovarianceStructure::Full, &p.R, &moments.R, &moments.measured);
        let h: f64 = 1e-5;
        let scaled = |i: usize, s: f64| {
            // Half the logarithm of the variance on each side of the matrix.
            let mut p = p;
            let unit = (0.5 * s * h).exp();
            let (of_Q, of_R) = (|j| if j == i { unit } else { 1.0 }, |j| if j + 3 == i { unit } else { 1.0 });
            p.Q = maximise::scale_covariance(&p.Q, &Vector3::from_fn(|j, _| of_Q(j)));
            p.R = maximise::scale_covariance(&p.R, &Vector2::from_fn(|j, _| of_R(j)));
            likelihood(&steps, &p)
        };
        for i in 0..5 {
            let difference = (scaled(i, 1.0) - scaled(i, -1.0)) / (2.0 * h);
            let slope = if i < 3 { slope_Q[i] } else { slope_R[i - 3] };
            prop_assert!((slope - difference).abs() <= 1e-6 * (1.0 + slope.abs()), "{}: {} {}", i, slope, difference);
        }
    }

    #[test]
    fn no_step_of_a_full_em_loses_likelihood((steps, p) in arbitrary_cases(15)) {
        rises(&EmSettings { Q: CovarianceStructure::Full, R: CovarianceStructure::Full, ..EmSettings::default() }, &steps, &p)?;
    }

    #[test]
    fn no_step_of_a_diagonal_em_loses_likelihood((steps, p) in diagonal_cases(15)) {
        let floor = (Vector3::new(1e-3, 0.5, 1e-3), Vector2::new(0.3, 1e-3));
        let em = EmSettings { floor_Q: floor.0, floor_R: floor.1, ..EmSettings::default() };
        let found = rises(&em, &steps, &p)?;
        prop_assert!((0..3).all(|i| found.parameters.Q[(i, i)] >= floor.0[i]));
        prop_assert!((0..2).all(|i| found.parameters.R[(i, i)] >= floor.1[i]));
    }

    #[test]
    fn units_do_not_matter((steps, p) in arbitrary_cases(15)) {
        // Forces in N instead of kN and the like: states by `u`, measurements by `w`.
        let (u, w) = (Vector3::new(1e3, 1.0, 1e-3), Vector2::new(1.0, 1e2));
        let U = Matrix3::from_diagonal(&u);
        let V = Matrix3::from_diagonal(&u.map(f64::recip));
        let W = Matrix2::from_diagonal(&w);
        let scaled: Vec<_> = steps.iter().map(|s| LinearStep { y: w.component_mul(&s.y), H: W * s.H * V, F: U * s.F * V, b: U * s.b }).collect();
        let start = Gaussian { mean: U * p.start.mean, cov: U * p.start.cov * U };
        let q = NoiseParameters { start, Q: U * p.Q * U, R: W * p.R * W };
        let em = EmSettings { Q: CovarianceStructure::Full, R: CovarianceStructure::Full, max_evaluations: 12, ..EmSettings::default() };
        let floors = (Vector3::repeat(1e-2), Vector2::repeat(1e-2));
        let em = EmSettings { floor_Q: floors.0, floor_R: floors.1, ..em };
        let em_scaled = EmSettings { floor_Q: U * U * floors.0, floor_R: W * W * floors.1, ..em };
        let a = em.fit(&steps, &p).expect("covariances");
        let b = em_scaled.fit(&scaled, &q).expect("covariances");
        prop_assert_eq!(a.log_likelihood.len(), b.log_likelihood.len());
        prop_assert!((V * b.parameters.Q * V - a.parameters.Q).amax() <= 1e-7 * a.parameters.Q.amax());
prop_assert!((a.slope_R - b.slope_R).amax() <= 1e-6 * (1.0 + a.slope_R.amax()));
    }

    #[test]
    fn order_of_states_does_not_matter((steps, p) in arbitrary_cases(15)) {
        let T = Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0);
        let turn = |C: &Matrix3<f64>| T * C * T.transpose();
        let turned: Vec<_> = steps.iter().map(|s| LinearStep { H: s.H * T.transpose(), F: turn(&s.F), b: T * s.b, ..*s }).collect();
        let start = Gaussian { mean: T * p.start.mean, cov: turn(&p.start.cov) };
        let q = NoiseParameters { start, Q: turn(&p.Q), R: p.R };
        let em = EmSettings { Q: CovarianceStructure::Full, R: CovarianceStructure::Full, max_evaluations: 12, ..EmSettings::default() };
        let floor = Vector3::repeat(1e-2);
        let em = EmSettings { floor_Q: floor, floor_R: floor.xy(), ..em };
        let a = em.fit(&steps, &p).expect("covariances").parameters;
        let b = em.fit(&turned, &q).expect("covariances").parameters;
        prop_assert!((turn(&a.Q) - b.Q).amax() <= 1e-7 * a.Q.amax());
        prop_assert!((a.R - b.R).amax() <= 1e-7 * a.R.amax());
    }
}

/// Two states become one: their predicted covariance has no inverse.
#[test]
fn a_noise_that_leaves_a_prediction_singular_is_no_error() {
    let known = NoiseParameters { Q: Matrix3::zeros(), ..noises(TRUTH.0, TRUTH.1) };
    let still = |k: usize| LinearStep {
        y: Vector2::new((k as f64).sin(), (k as f64).cos()),
        H: SMatrix::<f64, 2, 3>::new(1.0, 0.0, 0.0, 0.0, 1.0, 1.0),
        F: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0),
        b: Vector3::zeros(),
    };
    let steps: Vec<_> = (0..30).map(still).collect();
    let filtered = filter_forward(&steps, &known).expect("covariances");
    assert!(matches!(smooth_recording(&steps, &filtered), Err(PassError::Prior { .. })));
    let em = EmSettings { Q: CovarianceStructure::Fixed, ..EmSettings::default() };
    let found = em.fit(&steps, &known).expect("covariances");
    assert_eq!((found.status, found.violations.len()), (EmStatus::Converged, 0));
    assert!(found.slope_R.amax() < 0.1, "{}", found.slope_R);
}

/// Fits with all of the start free, and checks the properties that hold for any data.
fn rises(
    em: &EmSettings<3, 2>,
    steps: &[LinearStep<3, 2>],
    p: &NoiseParameters<3, 2>,
) -> Result<EmEstimate<3, 2>, TestCaseError> {
    let mut em = EmSettings { start: InitialStateUpdate::MeanAndCovariance, max_evaluations: 60, ..*em };
    if em.Q == CovarianceStructure::Full {
        (em.floor_Q, em.floor_R) = (Vector3::repeat(1e-2), Vector2::repeat(1e-2));
    }
    let found = em.fit(steps, p).expect("covariances");
    prop_assert_eq!(&found.violations, &Vec::new());
    for pair in found.log_likelihood.windows(2) {
        prop_assert!(pair[1] - pair[0] >= -1e-9 * pair[0].abs(), "{:?}", pair);
    }
    prop_assert!(found.parameters.Q.cholesky().is_some() && found.parameters.R.cholesky().is_some());
    let last = found.log_likelihood.last().expect("a guess");
    // To rounding: a joint R that is diagonal is filtered at once in EM, one by one elsewhere.
    let other = likelihood(steps, &found.parameters);
    prop_assert!((last - other).abs() <= 1e-13 * (1.0 + other.abs()), "{} {}", last, other);
    Ok(found)
}

#[test]
fn noises_that_are_known_are_found() {
    let (truth, guess) = (noises(TRUTH.0, TRUTH.1), noises(GUESS.0, GUESS.1));
    let steps = record(4000, &truth, 1);
    let found =
        EmSettings { tolerance: 1e-6, ..EmSettings::default() }.fit(&steps, &guess).expect("covariances");
    assert_eq!(found.status, EmStatus::Converged);
    assert!(found.slope_Q.amax() < 0.1 && found.slope_R.amax() < 0.1, "{found:?}");
    // Four standard errors of about 5 %.
    assert!(apart(&found.parameters.Q, &truth.Q) < 0.2, "{}", found.parameters.Q);
    assert!(apart(&found.parameters.R, &truth.R) < 0.2, "{}", found.parameters.R);
    let gain = found.log_likelihood.last().expect("a guess") - likelihood(&steps, &truth);
    // Twice the gain over the truth is χ² with five degrees of freedom: 20.5 at one in a thousand.
    assert!((0.0..10.3).contains(&gain), "{gain}");
}

#[test]
fn noises_that_belong_together_are_found() {
    let mut truth = noises(TRUTH.0, TRUTH.1);
    (truth.Q[(0, 2)], truth.Q[(2, 0)]) = (0.25, 0.25);
    (truth.R[(0, 1)], truth.R[(1, 0)]) = (-0.2, -0.2);
    let mut steps = record(4000, &truth, 2);
    for k in (0..4000).step_by(7) {
        steps[k].y[k % 2] = f64::NAN;
    }
    let em =
        EmSettings { Q: CovarianceStructure::Full, R: CovarianceStructure::Full, ..EmSettings::default() };
    let found = em.fit(&steps, &noises(GUESS.0, GUESS.1)).expect("covariances");
    assert_eq!((found.status, found.violations.len()), (EmStatus::Converged, 0));
    assert!((found.parameters.Q - truth.Q).amax() < 0.1, "{}", found.parameters.Q);
    assert!((found.parameters.R - truth.R).amax() < 0.1, "{}", found.parameters.R);
}

#[test]
fn looking_ahead_finds_the_same_maximum_with_less_work() {
    let steps = record(1000, &noises(TRUTH.0, TRUTH.1), 3);
    let em = EmSettings { tolerance: 1e-8, max_evaluations: 5000, ..EmSettings::default() };
    let guess = noises([300.0, 1e-3, 5e-3], [1e-3, 40.0]);
    let plain = EmSettings { accelerate: false, ..em }.fit(&steps, &guess).expect("covariances");
    let ahead = em.fit(&steps, &guess).expect("covariances");
    assert_eq!((plain.status, ahead.status), (EmStatus::Converged, EmStatus::Converged));
    assert_eq!((plain.violations.len(), ahead.violations.len()), (0, 0));
    assert!(apart(&plain.parameters.Q, &ahead.parameters.Q) < 1e-3);
    assert!(apart(&plain.parameters.R, &ahead.parameters.R) < 1e-3);
    let evaluations = (ahead.evaluations, plain.evaluations);
    assert!(4 * ahead.evaluations <= plain.evaluations, "{evaluations:?}");
}

#[test]
fn what_is_locked_stays_and_what_is_held_by_its_floor_says_so() {
    let steps = record(1000, &noises(TRUTH.0, TRUTH.1), 4);
    let guess = noises(GUESS.0, GUESS.1);
    let em = EmSettings {
        Q: CovarianceStructure::Diagonal([true, false, true]),
        R: CovarianceStructure::Fixed,
        floor_Q: Vector3::new(1e-9, 1e-9, 9.0),
        ..EmSettings::default()
    };
    let found = em.fit(&steps, &guess).expect("covariances");
    assert_eq!(found.status, EmStatus::Converged);
    assert_eq!((found.parameters.R, found.parameters.Q[(1, 1)]), (guess.R, guess.Q[(1, 1)]));
    assert_eq!((found.slope_R, found.slope_Q[1]), (Vector2::zeros(), 0.0));
    assert_eq!(found.parameters.Q[(2, 2)], 9.0);
    assert!(found.slope_Q[2] < -10.0, "{}", found.slope_Q);
    assert_eq!(found.parameters.start, guess.start);
}

#[test]
fn a_start_is_found_when_it_is_free() {
    let truth = NoiseParameters {
        start: Gaussian { mean: Vector3::new(30.0, -20.0, 10.0), cov: Matrix3::identity() * 1e-4 },
        ..noises(TRUTH.0, TRUTH.1)
    };
    let steps = record(200, &truth, 5);
    let guess = noises(TRUTH.0, TRUTH.1);
    let em =
        EmSettings { Q: CovarianceStructure::Fixed, R: CovarianceStructure::Fixed, ..EmSettings::default() };
    for start in [InitialStateUpdate::Mean, InitialStateUpdate::MeanAndCovariance] {
        let found = EmSettings { start, ..em }.fit(&steps, &guess).expect("covariances");
        assert_eq!(found.status, EmStatus::Converged);
        let error = (found.parameters.start.mean - truth.start.mean).amax();
        assert!(error < 3.0, "{start:?}: {error}");
        let narrower = found.parameters.start.cov.trace() < guess.start.cov.trace();
        assert_eq!(narrower, start == InitialStateUpdate::MeanAndCovariance);
    }
}

#[test]
fn limits_and_stops_are_reported() {
    let steps = record(300, &noises(TRUTH.0, TRUTH.1), 6);
    for max_evaluations in 1..6 {
        let em = EmSettings { max_evaluations, ..EmSettings::default() };
        let found = em.fit(&steps, &noises(GUESS.0, GUESS.1)).expect("covariances");
        assert_eq!((found.status, found.evaluations), (EmStatus::EvaluationLimit, max_evaluations));
    }
    let mut left = 2;
    let go_on = || {
        left -= 1;
        left >= 0
    };
    let found = EmSettings::default().fit_while(&steps, &noises(GUESS.0, GUESS.1), go_on);
    assert_eq!(found.expect("covariances").status, EmStatus::Stopped);
}

#[test]
fn guesses_and_options_that_do_not_fit_are_errors() {
    let (steps, mut p): LinearSystemCase =
        (record(5, &noises(TRUTH.0, TRUTH.1), 7), noises(TRUTH.0, TRUTH.1));
    let em = EmSettings::default();
    let floorless = EmSettings { floor_R: Vector2::new(1.0, 0.0), ..em };
    assert_eq!(floorless.fit(&steps, &p), Err(EmError::Floor("R")));
    assert_eq!(em.fit(&steps[..1], &p), Err(PassError::TooShort { steps: 1 }.into()));
    (p.Q[(0, 1)], p.Q[(1, 0)]) = (0.01, 0.01);
    assert_eq!(em.fit(&steps, &p), Err(EmError::NotDiagonal("Q")));
    assert!(EmSettings { Q: CovarianceStructure::Full, ..em }.fit(&steps, &p).is_ok());
}
