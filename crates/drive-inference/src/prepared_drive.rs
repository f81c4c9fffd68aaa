//! A drive as the filter takes it: inputs with their rates, lengths of steps, and channels without their delays.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use vehicle::SingleTrackCar;

use crate::recorded_input::{InterpolatedSegment, RecordedSegment};
use crate::unknowns::SHORTEST;
use preparation::{Drive, START_RELAXATION_LENGTH, SystematicError, SystematicErrors};

/// Stiffness per load [1/rad] that no tire exceeds by much: with it, steps are short enough.
const STIFFEST: f64 = 90.0;
/// Longest step in units of the fastest pole.
const POLE_REACH: f64 = 1.7;
/// Shortest relaxation length that steps are made for [m]: one below is over before the next row.
const BRIEFEST: f64 = 0.1;
/// Longest sub-step [s]: over it an input that moves as fast as a driver turns is nearly a straight line.
const LONGEST_SUBSTEP: f64 = 0.0125;
/// Most that the steering turns in a sub-step [rad], as forces of tires bend with it.
const LONGEST_TRAVEL: f64 = 0.002;
/// What is left out at both ends of a recording with delays [s], so that costs with different delays are of the same rows.
const MARGIN: f64 = 0.25;

/// Errors for which samples are prepared. Delays are whole numbers of the usual step, so that no value is a mean of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreparedDelays {
    /// Of the steering angle and the longitudinal force [s].
    pub inputs: [f64; 2],
    /// Of v_x, v_y, r and a_y [s].
    pub sensors: [f64; 4],
    /// The same in rows: steering angle, longitudinal force, v_x, v_y, r, a_y.
    rows: [isize; 6],
    /// Rows that are left out at both ends.
    margin: usize,
    /// Relaxation length that sub-steps are short enough for [m]. One that follows the lengths would make the cost leap from row to row
    /// while a fit changes them.
    pub shortest_relaxation: f64,
}

/// No delay, and any length.
impl Default for PreparedDelays {
    fn default() -> Self {
        let (inputs, sensors, rows) = ([0.0; 2], [0.0; 4], [0; 6]);
        Self { inputs, sensors, rows, margin: 0, shortest_relaxation: SHORTEST }
    }
}

impl PreparedDelays {
    /// Those next to the delays among some causes, with steps for their relaxation lengths, or those that a fit starts from.
    pub fn nearest_to(causes: &SystematicErrors, recordings: &[Drive]) -> Self {
        let step = Drive::shortest_step(recordings);
        let rows = |cause: SystematicError| (causes[cause] / step).round() as isize;
        let rows = [
            rows(SystematicError::SteeringDelay),
            rows(SystematicError::ForceDelay),
            0,
            rows(SystematicError::SideslipDelay),
            rows(SystematicError::YawRateDelay),
            rows(SystematicError::AccelerationDelay),
        ];
        let seconds = rows.map(|rows| if rows == 0 { 0.0 } else { rows as f64 * step });
        let [steering, force, sensors @ ..] = seconds;
        let lengths =
            SystematicError::TIRES.iter().map(|cause| causes[*cause]).filter(|length| *length > 0.0);
        let shortest_relaxation = lengths.reduce(f64::min).unwrap_or(START_RELAXATION_LENGTH).max(BRIEFEST);
        let margin = (MARGIN / step).ceil() as usize;
        Self { inputs: [steering, force], sensors, rows, margin, shortest_relaxation }
    }

    /// Whether steps are short enough for the relaxation lengths among some causes, or nearly.
    pub fn is_valid_for(&self, causes: &SystematicErrors, recordings: &[Drive]) -> bool {
        self.shortest_relaxation < 1.5 * Self::nearest_to(causes, recordings).shortest_relaxation
    }
}

/// One row that is predicted.
#[derive(Clone, Copy)]
pub struct PreparedSample {
    /// The inputs since the row before.
    pub inputs: RecordedSegment,
    /// Time since the row before [s].
    pub h: f64,
    /// Sub-steps of the filter from there.
    pub substeps: usize,
    /// v_x, v_y, r and a_y.
    pub measured: [f64; 4],
}

/// A recording as the filter takes it.
#[derive(Clone)]
pub struct PreparedDrive {
    /// What the sensors show in the row before the first sample.
    pub first: [f64; 4],
    /// The rows after it.
    pub samples: Vec<PreparedSample>,
    /// Number of that first row in the recording.
    pub first_row: usize,
}

/// All recordings of one car.
#[derive(Clone)]
pub struct PreparedDrives {
    /// The car; its own tires are not used.
    pub car: SingleTrackCar,
    /// The drives.
    pub drives: Vec<PreparedDrive>,
    /// For which they are prepared.
    pub delays: PreparedDelays,
}

/// Moves each channel by its delay; rows that a channel does not reach are left out.
pub fn prepare_drive(car: &SingleTrackCar, recording: &Drive, delays: &PreparedDelays) -> PreparedDrive {
    let body = &car.body;
    let [front, rear] = body.static_loads().map(|load| load * STIFFEST);
    let pole =
        (body.l_f * body.l_f * front + body.l_r * body.l_r * rear) / body.I_zz + (front + rear) / body.m;
    let len = recording.len();
    let first_row = delays.margin.min(len / 8);
    let end = len - first_row;
    let [steering, force, shifts @ ..] = delays.rows;
    let row = |k: usize, by: isize| k.saturating_add_signed(by).min(len - 1);
    let channels = [&recording.v_x, &recording.v_y, &recording.r, &recording.a_y];
    let measured = |k: usize| -> [f64; 4] { std::array::from_fn(|i| channels[i][row(k, shifts[i])]) };
    let sample = |k: usize| {
        let h = recording.t[k] - recording.t[k - 1];
        let speed = recording.v_x[k - 1].max(vehicle::SLIP_SPEED_FLOOR);
        let substeps = (h * pole / (POLE_REACH * speed)).ceil().max(1.0) as usize;
        let substeps = substeps.max((h / LONGEST_SUBSTEP).ceil() as usize);
        let segment = |column: &[f64], by, interpolation| {
            InterpolatedSegment::of_column(recording, column, row(k, by), interpolation)
        };
        let delta = segment(&recording.delta, steering, recording.interpolation.delta);
        let F_x = segment(&recording.F_x, force, recording.interpolation.F_x);
        let substeps = substeps.max((delta.travel() / LONGEST_TRAVEL).ceil() as usize);
        PreparedSample { inputs: RecordedSegment::new(car, delta, F_x), h, substeps, measured: measured(k) }
    };
    PreparedDrive {
        first: measured(first_row),
        samples: (first_row + 1..end).map(sample).collect(),
        first_row,
    }
}
