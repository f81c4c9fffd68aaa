//! Columns of an identification along its recording: states, slip angles, innovations, lateral acceleration.

use tire_inference::axles::{Axle, Axles};
use vehicle::{PlanarState, SingleTrackCar, SingleTrackInput};

use crate::likelihood::{DriveLikelihood, DriveUnknowns};
use preparation::Drive;

/// Columns of one recording, with a value for each of its rows. The first row, which starts the filter, has zero innovations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IdentificationSeries {
    /// States after each measurement: v_x, v_y [m/s], r [rad/s], ξ_x [N].
    pub states: [Vec<f64>; 4],
    /// Slip angles of both axles [rad].
    pub slip: Axles<Vec<f64>>,
    /// Innovations of v_x, v_y, r and a_y, each given those before it [m/s, m/s, rad/s, m/s²].
    pub innovations: [Vec<f64>; 4],
    /// The same over their standard deviations: white, with variance 1, if model and noises are right.
    pub whitened: [Vec<f64>; 4],
    /// Lateral acceleration of the identified tires at the state [m/s²].
    pub a_y: Vec<f64>,
}

impl IdentificationSeries {
    /// Measured lateral acceleration as it was expected from all before it, and from the other sensors at the same time [m/s²].
    pub fn a_y_expected<'a>(&'a self, recording: &'a Drive) -> impl Iterator<Item = f64> + 'a {
        let measured = recording.a_y.iter();
        measured.zip(&self.innovations[3]).map(|(measured, innovation)| measured - innovation)
    }
}

impl IdentificationSeries {
    /// A recording before anything is known of its states: they are as measured.
    fn from_measurements(recording: &Drive) -> Self {
        let zero = vec![0.0; recording.len()];
        let Drive { v_x, v_y, r, .. } = recording.clone();
        Self {
            states: [v_x, v_y, r, zero.clone()],
            slip: Axles::from_fn(|_| zero.clone()),
            innovations: std::array::from_fn(|_| zero.clone()),
            whitened: std::array::from_fn(|_| zero.clone()),
            a_y: zero,
        }
    }

    /// What follows from the states under the true inputs.
    fn fill_derived_columns(&mut self, car: &SingleTrackCar, recording: &Drive) {
        for k in 0..recording.len() {
            let [v_x, v_y, r] = [0, 1, 2].map(|i| self.states[i][k]);
            let state = PlanarState { v_x, v_y, r, ..PlanarState::default() };
            let input = SingleTrackInput { F_x: recording.F_x[k], delta: recording.delta[k] };
            let motion = car.evaluate(&state, &input);
            self.slip.front[k] = motion.alpha_f;
            self.slip.rear[k] = motion.alpha_r;
            self.a_y[k] = motion.a_y;
        }
    }
}

/// The columns of all recordings of a likelihood. Rows that it leaves out have no innovations.
pub fn identification_series(
    car: &SingleTrackCar,
    recordings: &[Drive],
    likelihood: &DriveLikelihood,
    at: &DriveUnknowns,
) -> Vec<IdentificationSeries> {
    let DriveUnknowns { tires, causes, .. } = at;
    let car =
        causes.corrected_car(car).with_tires(tires.front.to_magic_formula(), tires.rear.to_magic_formula());
    let mut all: Vec<IdentificationSeries> =
        recordings.iter().map(IdentificationSeries::from_measurements).collect();
    likelihood.visit_innovations(at, |i, k, innovation, state| {
        for (j, (residual, value)) in innovation.residual.iter().zip(state).enumerate() {
            all[i].states[j][k] = *value;
            all[i].innovations[j][k] = *residual;
            all[i].whitened[j][k] = residual / innovation.variance[j].sqrt();
        }
    });
    for (series, recording) in all.iter_mut().zip(recordings) {
        series.fill_derived_columns(&car, &causes.corrected_inputs(recording));
    }
    all
}

/// Smallest and largest of the slips that were reached, without the most extreme thousandth on either side.
pub fn slip_range(series: &[IdentificationSeries], axle: Axle) -> [f64; 2] {
    let mut slips: Vec<f64> = series.iter().flat_map(|s| s.slip[axle].iter().copied()).collect();
    slips.sort_by(f64::total_cmp);
    let margin = slips.len() / 1000;
    match (slips.get(margin), slips.iter().rev().nth(margin)) {
        (Some(low), Some(high)) => [*low, *high],
        _ => [0.0; 2],
    }
}
