//! Smoothed states of a drive by the nominal car (Rauch–Tung–Striebel, with noises by EM); lumped disturbances stand for the errors of its
//! linear tires.

use kalman::{
    EmError, EmEstimate, EmSettings, Gaussian, NoiseParameters, NonlinearModel, SmoothedRecording,
    filter_forward, linearise_along_trajectory, linearise_by_extended_filter, smooth_recording,
    transition_matrix,
};
use nalgebra::{SMatrix, SVector};
use serde::Serialize;
use vehicle::{NominalCar, SingleTrackCar};

use crate::likelihood::DriveNoise;
use preparation::Drive;

/// Stiffness per load of the nominal car [1/rad]: a guess, which only decides what ξ has to make up for.
const NOMINAL_STIFFNESS: f64 = 50.0;
/// Growth of the standard deviations of v_x, v_y, r, ξ_x, ξ_y and ξ_ψ in one second [m/s, m/s, rad/s, N, N, N m]. The last two
/// have to follow a tire through its peak within some ten samples.
const PROCESS_STD: [f64; 6] = [1e-2, 0.06, 0.01, 600.0, 6000.0, 12_000.0];
/// What the nominal car's lateral acceleration is off by where steering jumps on tires that slide [m/s²].
const A_Y_MODEL_STD: f64 = 0.25;
/// Standard deviation of the disturbances before any data [N, N, N m].
const START_STD_XI: f64 = 2000.0;
/// Gain of a step of EM for each sample [nat] that ends it.
const EM_TOLERANCE: f64 = 1e-5;

/// A car of linear tires with the masses and lengths of this one.
pub fn nominal_car(car: &SingleTrackCar) -> NominalCar {
    let [C_f, C_r] = car.body.static_loads().map(|load| load * NOMINAL_STIFFNESS);
    let vehicle::VehicleBody { m, I_zz, l_f, l_r, .. } = car.body;
    NominalCar { m, I_zz, l_f, l_r, C_f, C_r }
}

struct DriveModel<'a> {
    car: NominalCar,
    recording: &'a Drive,
}

impl NonlinearModel<6, 4> for DriveModel<'_> {
    fn transition(&self, k: usize, x: &SVector<f64, 6>) -> (SVector<f64, 6>, SMatrix<f64, 6, 6>) {
        let drive = self.recording;
        let h = drive.t[k + 1] - drive.t[k];
        let after = self.car.advance(x, drive.F_x[k + 1], drive.delta[k + 1], h);
        (after, transition_matrix(&self.car.state_jacobian(x), h))
    }

    fn measurement(&self, k: usize, x: &SVector<f64, 6>) -> (SVector<f64, 4>, SMatrix<f64, 4, 6>) {
        (self.car.measurement(x, self.recording.delta[k]), self.car.measurement_jacobian(x))
    }
}

/// How states are smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmootherOptions {
    /// How often expectation and maximisation (EM) may filter a recording to find the noises of the nominal car; 0 leaves them
    /// at what suits most drives.
    pub em_passes: usize,
}

impl Default for SmootherOptions {
    fn default() -> Self {
        Self { em_passes: 60 }
    }
}

/// A recording as the nominal car explains it: v_x, v_y [m/s], r [rad/s], ξ_x, ξ_y [N] and ξ_ψ [N m].
#[derive(Clone, Debug)]
pub struct SmoothedDrive {
    /// States, given all of the recording.
    pub states: SmoothedRecording<6>,
    /// Lateral acceleration that the smoothed states mean, with ξ_y as a virtual force sensor [m/s²].
    pub a_y: Vec<f64>,
    /// What is reported of it.
    pub report: SmoothingReport,
}

/// How a recording was smoothed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SmoothingReport {
    /// Variances that v_x, v_y, r, ξ_x, ξ_y and ξ_ψ gain in one step, as assumed or as found by EM [squares of m/s, m/s, rad/s,
    /// N, N, N m].
    pub Q: [f64; 6],
    /// Variances of measured v_x, v_y, r and a_y, likewise [squares of m/s, m/s, rad/s, m/s²].
    pub R: [f64; 4],
    /// Logarithm of the density of the recording, linearised along its smoothed states.
    pub log_likelihood: f64,
    /// Root mean square difference of the lateral acceleration of smoothed states and the measured one [m/s²].
    pub a_y_rmse: f64,
    /// How Q and R were found, if they were.
    pub em: Option<EmReport>,
}

/// How EM went.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EmReport {
    /// Whether a step of it gained less than the tolerance before the limit of passes.
    pub converged: bool,
    /// How often the recording was filtered.
    pub passes: usize,
    /// Steps ahead that were taken back.
    pub rejected: usize,
    /// Steps after which the recording was less probable, by more than rounding explains: pass, and fall [nat].
    pub violations: Vec<(usize, f64)>,
    /// Log-likelihood of each estimate that was gone through, linearised along the filtered states of the first guess.
    pub log_likelihood: Vec<f64>,
}

impl From<&EmEstimate<6, 4>> for EmReport {
    fn from(found: &EmEstimate<6, 4>) -> Self {
        Self {
            converged: found.status == kalman::EmStatus::Converged,
            passes: found.evaluations,
            rejected: found.rejected,
            violations: found.violations.iter().map(|v| (v.evaluation, v.fall)).collect(),
            log_likelihood: found.log_likelihood.clone(),
        }
    }
}

/// States of the nominal car along a recording, given all of it. `go_on` is asked before each step of EM.
///
/// # Errors
///
/// [`EmError::Pass`] if a covariance is lost on the way.
pub fn smooth_states(
    car: &SingleTrackCar,
    recording: &Drive,
    noise: &DriveNoise,
    options: &SmootherOptions,
    go_on: impl FnMut() -> bool,
) -> Result<SmoothedDrive, EmError> {
    let drive = DriveModel { car: nominal_car(car), recording };
    let measured: Vec<SVector<f64, 4>> =
        (0..recording.len()).map(|k| recording.measurements_at(k).into()).collect();
    let mut parameters = filter_parameters(recording, noise);
    let mut steps = linearise_by_extended_filter(&drive, &measured, &parameters)?;
    let mut em = None;
    if options.em_passes > 0 {
        let tolerance = EM_TOLERANCE * recording.len() as f64;
        let search = EmSettings { tolerance, max_evaluations: options.em_passes, ..EmSettings::default() };
        let found = search.fit_while(&steps, &parameters, go_on)?;
        em = Some(EmReport::from(&found));
        parameters = found.parameters;
        steps = linearise_by_extended_filter(&drive, &measured, &parameters)?;
    }
    let first = smooth_recording(&steps, &filter_forward(&steps, &parameters)?)?;
    // Tangents along the smoothed states instead of the filtered ones: the most probable trajectory to second order.
    let trajectory: Vec<_> = first.states.iter().map(|state| state.mean).collect();
    let steps = linearise_along_trajectory(&drive, &measured, &trajectory);
    let filtered = filter_forward(&steps, &parameters)?;
    let smoothed = smooth_recording(&steps, &filtered)?;
    let states = smoothed.states.iter().enumerate();
    let a_y: Vec<f64> = states.map(|(k, x)| drive.car.measurement(&x.mean, recording.delta[k])[3]).collect();
    let report = SmoothingReport {
        Q: parameters.Q.diagonal().into(),
        R: parameters.R.diagonal().into(),
        log_likelihood: filtered.log_likelihood,
        a_y_rmse: rmse(&a_y, &recording.a_y),
        em,
    };
    Ok(SmoothedDrive { states: smoothed, a_y, report })
}

/// Root mean square of the differences of two columns.
pub fn rmse(a: &[f64], b: &[f64]) -> f64 {
    let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (square / a.len() as f64).sqrt()
}

fn filter_parameters(recording: &Drive, noise: &DriveNoise) -> NoiseParameters<6, 4> {
    let h = (recording.t[recording.len() - 1] - recording.t[0]) / (recording.len() - 1) as f64;
    let diagonal =
        |std: [f64; 6], h: f64| SMatrix::from_diagonal(&SVector::from(std.map(|std| std * std * h)));
    let [v_x, v_y, r, _] = recording.measurements_at(0);
    let [s_x, s_y, s_r, s_a] = noise.sensor;
    let sensor = SVector::from([s_x, s_y, s_r, s_a.hypot(A_Y_MODEL_STD)]);
    NoiseParameters {
        start: Gaussian {
            mean: [v_x, v_y, r, 0.0, 0.0, 0.0].into(),
            cov: diagonal([s_x, s_y, s_r, START_STD_XI, START_STD_XI, START_STD_XI], 1.0),
        },
        Q: diagonal(PROCESS_STD, h),
        R: SMatrix::from_diagonal(&sensor.component_mul(&sensor)),
    }
}
