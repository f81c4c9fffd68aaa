//! Writes a fastest lap: its nodes as a table, its numbers as JSON, and its page.

use std::path::{Path, PathBuf};

use diagnostics::Error;
use lap::{InteriorPointStatus, LapCar, LapNode, ParameterRange};
use lap_report::{LapPage, LoggedLap};
use numerics::convergence::OptimisationStatus;
use orchestrator::nofollow;
use serde_json::json;
use track::LocalPlane;

use super::car_file::CarFile;
use super::drive_scenario::drive_files;

/// A column of the table.
struct LapColumn {
    name: &'static str,
    value: fn(&LapNode) -> f64,
}

/// Names of all files of a lap.
pub const RESULT_FILES: [&str; 6] =
    ["lap.html", "lap.csv", "lap.json", "set.toml", "drive.toml", "setup.toml"];

/// Columns that a track without widths has not.
const EDGE_COLUMNS: [&str; 2] = ["left_m", "right_m"];

const fn column(name: &'static str, value: fn(&LapNode) -> f64) -> LapColumn {
    LapColumn { name, value }
}

/// The first four make the table a track of its own: the driven line, with the road beside it.
const COLUMNS: [LapColumn; 22] = [
    column("x_m", |it| it.position[0]),
    column("y_m", |it| it.position[1]),
    column("left_m", |it| it.edges.map_or(f64::NAN, |edges| edges[0])),
    column("right_m", |it| it.edges.map_or(f64::NAN, |edges| edges[1])),
    column("s [m]", |it| it.s),
    column("t [s]", |it| it.t),
    column("psi [rad]", |it| it.psi),
    column("n [m]", |it| it.variables.n),
    column("xi [rad]", |it| it.variables.xi),
    column("v_x [m/s]", |it| it.variables.v_x),
    column("v_y [m/s]", |it| it.variables.v_y),
    column("r [rad/s]", |it| it.variables.r),
    column("delta [rad]", |it| it.variables.delta),
    column("F_x [N]", |it| it.variables.F_x),
    column("delta_rate [rad/s]", |it| it.variables.delta_rate),
    column("F_x_rate [N/s]", |it| it.variables.F_x_rate),
    column("kappa_f [1]", |it| it.variables.kappa_f),
    column("kappa_r [1]", |it| it.variables.kappa_r),
    column("alpha_f [rad]", |it| it.alphas[0]),
    column("alpha_r [rad]", |it| it.alphas[1]),
    column("a_x [m/s2]", |it| it.a_x),
    column("a_y [m/s2]", |it| it.variables.a_y),
];

/// Writes `lap.html`, `lap.csv` and `lap.json`, of a lap that is the fastest also the files that drive it, and returns
/// where they are.
///
/// # Errors
/// When the folder or a file cannot be written.
pub fn write_lap_files(
    folder: &Path,
    page: &LapPage,
    car_file: &CarFile,
    car: &LapCar,
    plane: Option<LocalPlane>,
) -> Result<Vec<PathBuf>, Error> {
    std::fs::create_dir_all(folder).map_err(|error| Error::output_failure(folder, error))?;
    let mut texts = vec![
        ("lap.html", lap_report::lap_page(page)),
        ("lap.csv", plane.map_or_else(String::new, |plane| plane.comment()) + &table(&page.optimum.nodes)),
        ("lap.json", format!("{:#}\n", numbers(page))),
    ];
    if page.optimum.status == InteriorPointStatus::Converged {
        texts.extend(drive_files(folder, car_file, car, page));
    }
    if let Some(setup) = page.setup {
        let line = |(range, value): (&ParameterRange, &f64)| format!("{} = {value:?}\n", range.key.name);
        let lines: String = setup.ranges.iter().zip(&setup.setup.values).map(line).collect();
        texts.push(("setup.toml", format!("# The fastest set-up, in SI units.\n{lines}")));
    }
    let mut paths = Vec::with_capacity(texts.len());
    for (name, text) in texts {
        let path = folder.join(name);
        nofollow::write_without_following_links(&path, text)
            .map_err(|error| Error::output_failure(&path, error))?;
        paths.push(path);
    }
    Ok(paths)
}

fn table(nodes: &[LapNode]) -> String {
    let has_edges = nodes.iter().all(|node| node.edges.is_some());
    let is_there = |column: &&LapColumn| has_edges || !EDGE_COLUMNS.contains(&column.name);
    let columns: Vec<&LapColumn> = COLUMNS.iter().filter(is_there).collect();
    let names: Vec<&str> = columns.iter().map(|column| column.name).collect();
    let mut text = names.join(",") + "\n";
    for node in nodes {
        let fields: Vec<String> =
            columns.iter().map(|column| format!("{:?}", (column.value)(node))).collect();
        text += &(fields.join(",") + "\n");
    }
    text
}

/// The 2.5 %, 50 % and 97.5 % quantiles of the lap time [s].
fn quantiles(interval: &lap::LapTimeInterval) -> [f64; 3] {
    [0.025, 0.5, 0.975].map(|share| interval.quantile(share))
}

fn numbers(page: &LapPage) -> serde_json::Value {
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
        json!({
            "quantiles": quantiles(interval),
            "lap_times": interval.lap_times,
            "unsolved": interval.unsolved,
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
        "nodes": optimum.nodes.len(), "length": page.line.length(),
        "corners": page.corners.iter().map(corner).collect::<Vec<_>>(),
        "worth": page.worth.iter().map(worth).collect::<Vec<_>>(),
        "interval": interval,
        "setup": setup,
        "driven": driven,
    })
}
