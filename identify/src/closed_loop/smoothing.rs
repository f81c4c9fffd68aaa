//! Smooths the states of a drive with the nominal car, whose lumped disturbances stand for all that its linear tires leave out.

use kalman::{
    Em, Gaussian, Model, Parameters, Smoothed, extended, forward, linearise, smooth, transition,
};
use nalgebra::{SMatrix, SVector};
use vehicle::{NominalCar, Vehicle};

use super::recording::Recording;
use super::{Error, Noise};

/// Stiffness per load of the nominal car [1/rad]: a guess, which only decides what ξ has to make up for.
const NOMINAL_STIFFNESS: f64 = 50.0;
/// Growth of the standard deviations of v_x, v_y, r, ξ_x, ξ_y and ξ_ψ in one second [m/s, m/s, rad/s, N, N, N m]. The last two
/// have to follow a tire through its peak within some ten samples.
const PROCESS_STD: [f64; 6] = [1e-2, 0.06, 0.01, 600.0, 6000.0, 12_000.0];
/// What the nominal car's lateral acceleration is off by where steering jumps on tires that slide [m/s²].
const A_Y_MODEL_STD: f64 = 0.25;
/// Standard deviation of the disturbances before any data [N, N, N m].
const START_STD_XI: f64 = 2000.0;

/// A car of linear tires with the masses and lengths of this one.
pub fn nominal(car: &Vehicle) -> NominalCar {
    let [C_f, C_r] = car.body.static_loads().map(|load| load * NOMINAL_STIFFNESS);
    let vehicle::Body { m, I_zz, l_f, l_r, .. } = car.body;
    NominalCar { m, I_zz, l_f, l_r, C_f, C_r }
}

struct Drive<'a> {
    car: NominalCar,
    recording: &'a Recording,
}

impl Model<6, 4> for Drive<'_> {
    fn transition(&self, k: usize, x: &SVector<f64, 6>) -> (SVector<f64, 6>, SMatrix<f64, 6, 6>) {
        let drive = self.recording;
        let h = drive.t[k + 1] - drive.t[k];
        let after = self.car.advance(x, drive.F_x[k + 1], drive.delta[k + 1], h);
        (after, transition(&self.car.jacobian(x), h))
    }

    fn measurement(&self, k: usize, x: &SVector<f64, 6>) -> (SVector<f64, 4>, SMatrix<f64, 4, 6>) {
        (self.car.measurement(x, self.recording.delta[k]), self.car.measurement_jacobian(x))
    }
}

/// How states are smoothed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Smoothing {
    /// Most passes in which expectation and maximisation adapt the noises of the nominal car; 0 leaves them as they are.
    pub em_passes: usize,
}

/// States of the nominal car along a recording, given all of it.
pub fn smoothed(
    car: &Vehicle,
    recording: &Recording,
    index: usize,
    noise: &Noise,
    options: &Smoothing,
) -> Result<Smoothed<6>, Error> {
    let failed = |source| Error::Smoothing { recording: index, source };
    let drive = Drive { car: nominal(car), recording };
    let measured: Vec<SVector<f64, 4>> =
        (0..recording.len()).map(|k| recording.measured(k).into()).collect();
    let mut parameters = parameters(recording, noise);
    let mut steps = extended(&drive, &measured, &parameters).map_err(failed)?;
    if options.em_passes > 0 {
        let em = Em { max_evaluations: options.em_passes, ..Em::default() };
        if let Ok(estimate) = em.fit(&steps, &parameters) {
            parameters = estimate.parameters;
            steps = extended(&drive, &measured, &parameters).map_err(failed)?;
        }
    }
    let first = smooth(&steps, &forward(&steps, &parameters).map_err(failed)?).map_err(failed)?;
    // Tangents along the smoothed states instead of the filtered ones: the most probable trajectory to second order.
    let trajectory: Vec<_> = first.states.iter().map(|state| state.mean).collect();
    let steps = linearise(&drive, &measured, &trajectory);
    smooth(&steps, &forward(&steps, &parameters).map_err(failed)?).map_err(failed)
}

fn parameters(recording: &Recording, noise: &Noise) -> Parameters<6, 4> {
    let h = (recording.t[recording.len() - 1] - recording.t[0]) / (recording.len() - 1) as f64;
    let diagonal = |std: [f64; 6], h: f64| {
        SMatrix::from_diagonal(&SVector::from(std.map(|std| std * std * h)))
    };
    let [v_x, v_y, r, _] = recording.measured(0);
    let [s_x, s_y, s_r, s_a] = noise.sensor;
    let sensor = SVector::from([s_x, s_y, s_r, s_a.hypot(A_Y_MODEL_STD)]);
    Parameters {
        start: Gaussian {
            mean: [v_x, v_y, r, 0.0, 0.0, 0.0].into(),
            cov: diagonal([s_x, s_y, s_r, START_STD_XI, START_STD_XI, START_STD_XI], 1.0),
        },
        Q: diagonal(PROCESS_STD, h),
        R: SMatrix::from_diagonal(&sensor.component_mul(&sensor)),
    }
}
