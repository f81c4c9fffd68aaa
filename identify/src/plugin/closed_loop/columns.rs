//! Shows in the recording what was found along each drive: states, slip angles, innovations, accelerations.

use drive_inference::{Drive, DriveIdentification};
use plugin::{AnalysisServices, Signal};
use tire_inference::axles::Axle;
use vehicle::SingleTrackCar;

use crate::plugin::closed_loop::ValidationDrive;

/// Names and units of the states of the nominal car.
const NOMINAL: [[&str; 3]; 6] = [
    ["v_x", "std_v_x", "m/s"],
    ["v_y", "std_v_y", "m/s"],
    ["r", "std_r", "rad/s"],
    ["xi_x", "std_xi_x", "N"],
    ["xi_y", "std_xi_y", "N"],
    ["xi_psi", "std_xi_psi", "N.m"],
];

/// Name, unit and values.
type NamedColumn = (&'static str, &'static str, Vec<f64>);

fn to_signal<'a>(time: &'a [f64], (name, unit, values): &'a NamedColumn) -> Signal<'a> {
    Signal { name, unit, time, values }
}

fn record_group(
    name: &str,
    time: &[f64],
    columns: impl IntoIterator<Item = NamedColumn>,
    host: &mut dyn AnalysisServices,
) {
    let columns: Vec<NamedColumn> = columns.into_iter().collect();
    host.record_signals(name, &columns.iter().map(|column| to_signal(time, column)).collect::<Vec<_>>());
}

/// Records everything, one drive after the other in the same columns.
pub(super) fn record_identification(
    car: &SingleTrackCar,
    recordings: &[Drive],
    found: &DriveIdentification,
    host: &mut dyn AnalysisServices,
) {
    let time: Vec<f64> = recordings.iter().flat_map(|recording| &recording.t).copied().collect();
    let all = |of: &dyn Fn(usize) -> Vec<f64>| (0..recordings.len()).flat_map(of).collect::<Vec<f64>>();
    let series = &found.series;
    let state = |i: usize| all(&|k| series[k].states[i].clone());
    let states = [("v_x", "m/s"), ("v_y", "m/s"), ("r", "rad/s"), ("xi_x", "N")];
    let states = states.into_iter().enumerate().map(|(i, (name, unit))| (name, unit, state(i)));
    record_group("states", &time, states, host);
    let slip = |axle: Axle| all(&|k| series[k].slip[axle].clone());
    let names = [("alpha_f", Axle::Front), ("alpha_r", Axle::Rear)];
    record_group("slip angles", &time, names.map(|(name, axle)| (name, "rad", slip(axle))), host);
    let white = |i: usize| all(&|k| series[k].whitened[i].clone());
    let names = ["v_x", "v_y", "r", "a_y"].into_iter().enumerate();
    record_group("whitened innovations", &time, names.map(|(i, name)| (name, "", white(i))), host);
    let accelerations = [
        ("a_y", "m/s2", all(&|k| series[k].a_y.clone())),
        ("a_y_expected", "m/s2", all(&|k| series[k].a_y_expected(&recordings[k]).collect())),
        ("a_y_reconstructed", "m/s2", all(&|k| found.smoothed[k].a_y.clone())),
        ("a_y_measured", "m/s2", all(&|k| recordings[k].a_y.clone())),
    ];
    record_group("lateral acceleration", &time, accelerations, host);
    record_smoothed_states(car, &time, recordings, found, host);
}

/// States of the nominal car, given all of each drive.
fn record_smoothed_states(
    car: &SingleTrackCar,
    time: &[f64],
    recordings: &[Drive],
    found: &DriveIdentification,
    host: &mut dyn AnalysisServices,
) {
    let states = || found.smoothed.iter().flat_map(|smoothed| &smoothed.states.states);
    let columns = NOMINAL.into_iter().enumerate().flat_map(|(i, [name, std, unit])| {
        [
            (name, unit, states().map(|state| state.mean[i]).collect()),
            (std, unit, states().map(|state| state.cov[(i, i)].max(0.0).sqrt()).collect()),
        ]
    });
    record_group("smoothed states", time, columns, host);
    let steering = recordings.iter().flat_map(|recording| &recording.delta);
    let slips: Vec<[f64; 2]> = states()
        .zip(steering)
        .map(|(state, delta)| car.body.slip_angles(state.mean[0], state.mean[1], state.mean[2], *delta))
        .collect();
    let slip = |axle: usize| slips.iter().map(|slip| slip[axle]).collect();
    record_group(
        "smoothed slip angles",
        time,
        [("alpha_f", "rad", slip(0)), ("alpha_r", "rad", slip(1))],
        host,
    );
}

/// Records a drive that was not used, as the identified car went and as it was measured.
pub(super) fn record_validation(validation: &ValidationDrive, host: &mut dyn AnalysisServices) {
    let ValidationDrive { name, recording, replay } = validation;
    let [v_x, v_y, r, a_y] = replay.columns.clone();
    let columns = [
        ("v_x", "m/s", v_x),
        ("v_x_measured", "m/s", recording.v_x.clone()),
        ("v_y", "m/s", v_y),
        ("v_y_measured", "m/s", recording.v_y.clone()),
        ("r", "rad/s", r),
        ("r_measured", "rad/s", recording.r.clone()),
        ("a_y", "m/s2", a_y),
        ("a_y_measured", "m/s2", recording.a_y.clone()),
    ];
    record_group(&format!("validation {name}"), &recording.t, columns, host);
}
