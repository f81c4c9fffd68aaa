//! A drive as the filter takes it: inputs with their rates, lengths of steps, and channels without their delays.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use vehicle::SingleTrackCar;

use crate::channel_delays::{PerChannel, channel_delays, channel_drifts};
use crate::recorded_input::{InterpolatedSegment, RecordedSegment};
use crate::unknowns::{DriveUnknowns, SHORTEST};
use preparation::{Drive, START_RELAXATION_LENGTH, SystematicError};

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
/// Time constant of the low-pass before the lateral acceleration is differentiated [s]: bodies roll at 1 to 2 Hz.
const ROLL_FILTER: f64 = 0.05;
/// What is left out at both ends of a recording with delays [s], so that costs with different delays are of the same rows.
const MARGIN: f64 = 0.25;

/// Errors for which samples are prepared. Delays are whole numbers of the usual step, so that no value is a mean of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PreparedDelays {
    /// In the middle of the drive [s].
    middle: PerChannel<f64>,
    /// By how much they grow with time [-].
    drift: PerChannel<f64>,
    /// The usual step [s].
    step: f64,
    /// Rows that are left out at both ends.
    margin: usize,
    /// Relaxation length that sub-steps are short enough for [m]. One that follows the lengths would make the cost leap from row to row
    /// while a fit changes them.
    pub shortest_relaxation: f64,
    /// The row from which on the friction is another one, counted over all recordings.
    pub friction_change_row: usize,
}

/// No delay, and any length.
impl Default for PreparedDelays {
    fn default() -> Self {
        let none = [0.0; 6];
        let (margin, shortest_relaxation) = (0, SHORTEST);
        Self { middle: none, drift: none, step: 1.0, margin, shortest_relaxation, friction_change_row: 0 }
    }
}

impl PreparedDelays {
    /// Those next to the delays among some unknowns, with steps for their relaxation lengths, or those that a fit starts from.
    pub fn nearest_to(
        DriveUnknowns { causes, friction_change_row, .. }: &DriveUnknowns,
        recordings: &[Drive],
    ) -> Self {
        let step = Drive::shortest_step(recordings);
        let lengths =
            SystematicError::TIRES.iter().map(|cause| causes[*cause]).filter(|length| *length > 0.0);
        let shortest_relaxation = lengths.reduce(f64::min).unwrap_or(START_RELAXATION_LENGTH).max(BRIEFEST);
        let margin = (MARGIN / step).ceil() as usize;
        let (middle, drift) = (channel_delays(causes), channel_drifts(causes));
        Self { middle, drift, step, margin, shortest_relaxation, friction_change_row: *friction_change_row }
    }

    /// Whether steps are short enough for the relaxation lengths among some unknowns, or nearly.
    pub fn is_valid_for(&self, at: &DriveUnknowns, recordings: &[Drive]) -> bool {
        self.shortest_relaxation < 1.5 * Self::nearest_to(at, recordings).shortest_relaxation
    }

    /// In rows, at a time after the middle of the drive [s].
    fn rows_at(&self, time: f64) -> PerChannel<isize> {
        std::array::from_fn(|i| ((self.middle[i] + self.drift[i] * time) / self.step).round() as isize)
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
    /// The values before these.
    pub before: [f64; 4],
    /// First and second derivative of the lateral acceleration behind a low-pass [m/s³, m/s⁴].
    pub roll: [f64; 2],
    /// Time after the middle of the drive [s].
    pub time: f64,
    /// Delays that are taken out of inputs and measurements [s].
    pub taken: PerChannel<f64>,
    /// Whether the friction is that after its change.
    pub after_change: bool,
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
    /// Rows of the recordings before this one.
    pub rows_before: usize,
    /// Time of the middle of the recording [s].
    pub middle: f64,
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

/// First and second derivative of a quantity behind two low-passes of first order; missing values repeat the one before.
fn filtered_derivatives(t: &[f64], values: &[f64]) -> [Vec<f64>; 2] {
    let start = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    let (mut last, mut slow, mut slower, mut rate) = (start, start, start, 0.0);
    let mut derivatives = [Vec::with_capacity(t.len()), Vec::with_capacity(t.len())];
    for (k, value) in values.iter().enumerate() {
        let h = if k > 0 { t[k] - t[k - 1] } else { 0.0 };
        let share = -(-h / ROLL_FILTER).exp_m1();
        last = if value.is_finite() { *value } else { last };
        slow += share * (last - slow);
        slower += share * (slow - slower);
        let now = (slow - slower) / ROLL_FILTER;
        derivatives[0].push(now);
        derivatives[1].push(if h > 0.0 { (now - rate) / h } else { 0.0 });
        rate = now;
    }
    derivatives
}

/// Moves each channel by its delay; rows that a channel does not reach are left out. `rows_before` are those of recordings before it.
pub fn prepare_drive(
    car: &SingleTrackCar,
    recording: &Drive,
    rows_before: usize,
    delays: &PreparedDelays,
) -> PreparedDrive {
    let body = &car.body;
    let [front, rear] = body.static_loads().map(|load| load * STIFFEST);
    let pole =
        (body.l_f * body.l_f * front + body.l_r * body.l_r * rear) / body.I_zz + (front + rear) / body.m;
    let len = recording.len();
    let first_row = delays.margin.min(len / 8);
    let end = len - first_row;
    let middle = 0.5 * (recording.t[0] + recording.t[len - 1]);
    let row = |k: usize, by: isize| k.saturating_add_signed(by).min(len - 1);
    let channels = [&recording.v_x, &recording.v_y, &recording.r, &recording.a_y];
    let measured = |k: usize, shifts: &PerChannel<isize>| -> [f64; 4] {
        std::array::from_fn(|i| channels[i][row(k, shifts[2 + i])])
    };
    let time = |k: usize| recording.t[k] - middle;
    let roll = filtered_derivatives(&recording.t, &recording.a_y);
    let sample = |k: usize| {
        let shifts = delays.rows_at(time(k));
        let [steering, force, ..] = shifts;
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
        PreparedSample {
            inputs: RecordedSegment::new(car, delta, F_x),
            h,
            substeps,
            measured: measured(k, &shifts),
            before: measured(k - 1, &shifts),
            roll: [0, 1].map(|derivative| roll[derivative][row(k, shifts[3])]),
            time: time(k),
            taken: shifts.map(|rows| if rows == 0 { 0.0 } else { rows as f64 * delays.step }),
            after_change: rows_before + k >= delays.friction_change_row,
        }
    };
    PreparedDrive {
        first: measured(first_row, &delays.rows_at(time(first_row))),
        samples: (first_row + 1..end).map(sample).collect(),
        first_row,
        rows_before,
        middle,
    }
}
