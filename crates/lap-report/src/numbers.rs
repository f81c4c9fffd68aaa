//! Writes the numbers of a fastest lap as JSON.

use lap::{InteriorPointStatus, ParameterRange};
use numerics::convergence::OptimisationStatus;
use serde_json::{Value, json};

use crate::{LapPage, LoggedLap};

/// What a script reads of a lap.
pub fn lap_numbers(page: &LapPage) -> Value {
    let optimum = page.optimum;
    let status = match optimum.status {
        InteriorPointStatus::Converged => "converged",
        InteriorPointStatus::IterationLimit => "iteration limit",
        InteriorPointStatus::Stalled => "stalled",
    };
    let corner = |corner: &lap::Corner| {
        let node = |k: usize| optimum.nodes[k % optimum.nodes.len()].s;
        json!({
            "begin": node(corner.first), "apex": node(corner.apex), "end": node(corner.end),
            "v_x": optimum.nodes[corner.apex].variables.v_x,
        })
    };
    let worth = |worth: &lap::ParameterWorth| {
        json!({
            "name": worth.name, "value": worth.value, "unit": worth.unit,
            "seconds_per_percent": worth.seconds_per_percent, "by_corner": worth.by_corner,
        })
    };
    let interval = page.interval.map(|interval| {
        let [low, median, high] = [0.025, 0.5, 0.975].map(|share| interval.quantile(share));
        json!({
            "quantiles": [low, median, high],
            "low": low,
            "high": high,
            "lap_times": interval.lap_times,
            "unsolved": interval.unsolved,
            "first_failure": interval.first_failure,
        })
    });
    let setup = page.setup.map(|setup| {
        let parameter = |k: usize| {
            let ParameterRange { key, low, high } = setup.ranges[k];
            json!({
                "name": key.name, "unit": key.unit, "before": setup.before[k], "value": setup.setup.values[k],
                "low": low, "high": high,
            })
        };
        json!({
            "lap_time": setup.setup.lap.lap_time,
            "has_converged": setup.setup.status == OptimisationStatus::Converged,
            "searches": setup.setup.searches,
            "parameters": (0..setup.ranges.len()).map(parameter).collect::<Vec<_>>(),
            "seconds_faster": setup.seconds_faster(optimum),
            "seconds_faster_95_percent": setup.gain_interval(page.interval),
        })
    });
    let driven = page.driven.map(|LoggedLap { log, lap }| {
        let lost: Vec<f64> = page.corners.iter().map(|corner| lap.time_lost(optimum, corner)).collect();
        json!({
            "log": log, "lap": lap.number, "laps": lap.count, "lap_time": lap.lap_time,
            "time_lost_by_corner": lost,
            "time_gaps": (0..lap.nodes.len()).map(|k| lap.time_gap(optimum, k)).collect::<Vec<_>>(),
        })
    });
    json!({
        "car": page.car, "track": page.track,
        "lap_time": optimum.lap_time, "status": status,
        "iterations": optimum.iterations, "optimality_error": optimum.optimality_error,
        "nodes": optimum.nodes.len(), "transients": optimum.has_transients(), "length": page.line.length(),
        "corners": page.corners.iter().map(corner).collect::<Vec<_>>(),
        "worth": page.worth.iter().map(worth).collect::<Vec<_>>(),
        "interval": interval,
        "setup": setup,
        "driven": driven,
    })
}
