//! Columns of an identification along its recording: states, slip angles, innovations, lateral acceleration.

use tire_inference::axles::{Axle, Axles};
use vehicle::{Input, State, Vehicle};

use crate::likelihood::{DriveNoise, Likelihood};
use crate::recording::Drive;
use crate::tires::Tires;

/// Columns of one recording, with a value for each of its rows. The first row, which starts the filter, has zero innovations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
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

impl Series {
    /// Measured lateral acceleration as it was expected from all before it, and from the other sensors at the same time [m/s²].
    pub fn a_y_expected<'a>(&'a self, recording: &'a Drive) -> impl Iterator<Item = f64> + 'a {
        let measured = recording.a_y.iter();
        measured.zip(&self.innovations[3]).map(|(measured, innovation)| measured - innovation)
    }
}

impl Series {
    fn push(&mut self, car: &Vehicle, recording: &Drive, k: usize, x: [f64; 4], e: [[f64; 2]; 4]) {
        let state = State { v_x: x[0], v_y: x[1], r: x[2], ..State::default() };
        let motion =
            car.evaluate(&state, &Input { F_x: recording.F_x[k], delta: recording.delta[k] });
        for i in 0..4 {
            self.states[i].push(x[i]);
            self.innovations[i].push(e[i][0]);
            self.whitened[i].push(e[i][1]);
        }
        self.slip.front.push(motion.alpha_f);
        self.slip.rear.push(motion.alpha_r);
        self.a_y.push(motion.a_y);
    }
}

/// The columns of all recordings of a likelihood.
pub fn series(
    car: &Vehicle,
    recordings: &[Drive],
    likelihood: &Likelihood,
    tires: &Tires,
    noise: &DriveNoise,
) -> Vec<Series> {
    let car = car.with_tires(tires.front.curve(), tires.rear.curve());
    let mut all = vec![Series::default(); recordings.len()];
    for (series, recording) in all.iter_mut().zip(recordings) {
        let [v_x, v_y, r, _] = recording.measured(0);
        series.push(&car, recording, 0, [v_x, v_y, r, 0.0], [[0.0; 2]; 4]);
    }
    likelihood.run(*tires, noise.variances(), |i, k, innovation, belief| {
        let e = std::array::from_fn(|j| {
            let residual = innovation.residual[j];
            [residual, residual / innovation.variance[j].sqrt()]
        });
        all[i].push(&car, &recordings[i], k, belief.x, e);
    });
    all
}

/// Smallest and largest of the slips that were reached, without the most extreme thousandth on either side.
pub fn slip_range(series: &[Series], axle: Axle) -> [f64; 2] {
    let mut slips: Vec<f64> = series.iter().flat_map(|s| s.slip[axle].iter().copied()).collect();
    slips.sort_by(f64::total_cmp);
    let margin = slips.len() / 1000;
    match (slips.get(margin), slips.iter().rev().nth(margin)) {
        (Some(low), Some(high)) => [*low, *high],
        _ => [0.0; 2],
    }
}
