//! Identifies the tires of both axles from a drive under closed-loop control, and tells what was found.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use plugin::{Host, Request, Signal};
use serde_json::{Map, Value, json};

use super::go_on;
use crate::closed_loop::{Identified, Options, Recording, Series, identify};
use crate::config::ClosedLoop;
use crate::direction::Direction;
use crate::start_values::{self, Tire};

/// The signals that are needed: what was measured, and the inputs that acted.
const SIGNALS: [&str; 6] = ["v_x", "v_y", "r", "a_y", "F_x", "delta"];

/// The recording that the signals make.
///
/// # Errors
/// When one is missing, or they are not at the same times.
pub(super) fn recording(request: &Request) -> Result<Recording, String> {
    let mut columns = Vec::new();
    let mut time: &[f64] = &[];
    for name in SIGNALS {
        // Without backticks: what is missing cannot be pointed at.
        let missing = || format!("a drive under closed-loop control needs the signal '{name}'");
        let signal = request.signal(name).ok_or_else(missing)?;
        if !columns.is_empty() && signal.time != time {
            return Err(format!(
                "expected all signals at the same times, found `{name}` at others"
            ));
        }
        time = signal.time;
        columns.push(signal.values.to_vec());
    }
    let mut columns = columns.into_iter();
    let mut next = || columns.next().unwrap_or_default();
    let [v_x, v_y, r, a_y, F_x, delta] = std::array::from_fn(|_| next());
    Ok(Recording { t: time.to_vec(), v_x, v_y, r, a_y, F_x, delta })
}

/// Does `task = "closed_loop"`.
///
/// # Errors
/// When the recording cannot be used, no start leads anywhere, or the program asked to give up.
pub(super) fn closed_loop(
    config: &ClosedLoop,
    request: &Request,
    host: &mut dyn Host,
) -> Result<Value, String> {
    let recording = recording(request)?;
    go_on(host, 0.0, "smoothing")?;
    let options = Options { seed: config.seed, profile: config.profile, ..Options::default() };
    let options = Options { car: config.car(), ..options };
    let drive = std::slice::from_ref(&recording);
    let mut progress = |share, what: &str| host.progress(share, what);
    let found = identify(drive, &options, &mut progress).map_err(|error| error.to_string())?;
    if let Some(series) = found.series.first() {
        record(&recording, series, host);
    }
    let tire = |tire, estimate| {
        let (node, direction) = (config.node.as_str(), Direction::Lateral);
        Tire { node, tire, estimate, direction }
    };
    let tires = [tire("tire_f", &found.front), tire("tire_r", &found.rear)];
    host.file("tires.toml", &start_values::write(&tires));
    Ok(report(&found))
}

fn report(found: &Identified) -> Value {
    let axles = json!({ "front": found.front, "rear": found.rear });
    let mut result = Map::from_iter([("pem".to_owned(), axles)]);
    result.insert("innovations".to_owned(), json!(found.innovations));
    result.insert("noise".to_owned(), json!(found.noise));
    result.insert("covariance".to_owned(), json!(found.covariance));
    result.insert("formulations".to_owned(), json!(found.formulations));
    result.insert("seconds".to_owned(), json!(found.seconds));
    result.into()
}

/// Shows states, slips, innovations and the lateral acceleration of the identified tires against the measured one.
fn record(recording: &Recording, series: &Series, host: &mut dyn Host) {
    let time = &recording.t;
    let mut group = |name, columns: &[(&str, &str, &[f64])]| {
        let signal = |&(name, unit, values): &_| Signal { name, unit, time, values };
        host.record(name, &columns.iter().map(signal).collect::<Vec<_>>());
    };
    let [v_x, v_y, r, xi_x] = &series.states;
    group(
        "states",
        &[("v_x", "m/s", v_x), ("v_y", "m/s", v_y), ("r", "rad/s", r), ("xi_x", "N", xi_x)],
    );
    let [front, rear] = &series.slip;
    group("slip angles", &[("alpha_f", "rad", front), ("alpha_r", "rad", rear)]);
    let [e_v_x, e_v_y, e_r, e_a_y] = &series.whitened;
    group(
        "whitened innovations",
        &[("v_x", "", e_v_x), ("v_y", "", e_v_y), ("r", "", e_r), ("a_y", "", e_a_y)],
    );
    group(
        "lateral acceleration",
        &[("a_y", "m/s2", &series.a_y), ("a_y_measured", "m/s2", &recording.a_y)],
    );
}
