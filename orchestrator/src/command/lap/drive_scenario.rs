//! Writes the scenario that drives a fastest lap: the plant of the car, and the driver with the line and its speeds.

use std::path::Path;

use lap::LapCar;
use lap_report::LapPage;
use orchestrator::relative_path::{real_path, relative_path};

use super::car_file::CarFile;

/// First words of the scenario, and of what `--set` said.
pub const DRIVE_HEAD: &str = "# Drives the fastest lap";
pub const SET_HEAD: &str = "# What --set said";

/// Share of the speeds of the lap that the driver takes at first.
const SHARE: f64 = 0.95;
/// Least share that a sweep tries.
const LEAST_SHARE: f64 = 0.7;
/// Step [s].
const STEP: f64 = 1e-3;

/// What the driver measures of the car.
const MEASURED: [&str; 6] = ["X", "Y", "psi", "v_x", "v_y", "r"];
/// What it commands.
const COMMANDED: [&str; 2] = ["delta", "F_x"];

/// Diagrams that every drive has.
const DIAGRAMS: &str = r#"
[[view.plot]]
title = "Speed"
unit = "km/h"
signals = [{ signal = "plant.v_x", label = "car" }, { signal = "driver.v_ref", label = "share of the fastest lap" }]

[[view.plot]]
title = "Way from the line"
signals = [{ signal = "driver.lateral_deviation" }]

[[view.xy_plot]]
title = "g-g diagram"
x = { label = "a_y, positive to the left [m/s2]", range = [-20.0, 20.0] }
y = { label = "a_x [m/s2]", range = [-20.0, 20.0] }
circle = 9.81
points = [{ label = "car", x = "plant.a_y", y = "plant.a_x" }]
"#;

/// The names of the files of a drive, and their texts: the scenario, and what `--set` said of the car.
pub fn drive_files(
    folder: &Path,
    car_file: &CarFile,
    car: &LapCar,
    page: &LapPage,
) -> Vec<(&'static str, String)> {
    let mut parameters = vec![path_from(folder, car_file.path())];
    let mut files = Vec::new();
    if !car_file.settings.is_empty() {
        let lines = car_file.settings.iter().map(|(key, value)| format!("{} = {value:?}\n", key.name));
        let head = format!("{SET_HEAD}, in SI units.\n");
        parameters.push("set.toml".to_owned());
        files.push(("set.toml", head + &lines.collect::<String>()));
    }
    files.push(("drive.toml", scenario_text(&parameters, car, page)));
    files
}

fn scenario_text(parameters: &[String], car: &LapCar, page: &LapPage) -> String {
    let LapPage { optimum, line, .. } = page;
    let first = &optimum.nodes[0];
    let [x, y] = first.position;
    let (psi, v_x) = (first.psi, SHARE * first.variables.v_x);
    let parameters = toml::Value::from(parameters.to_vec());
    let title = toml::Value::from(format!("The fastest lap of {} on {}, driven", page.car, page.track));
    // The driver comes in on a first lap of a closed track, and has a second one for each that a sweep may slow down.
    let laps = if line.is_closed() { 2 } else { 1 };
    let stop = (f64::from(laps) * optimum.lap_time / LEAST_SHARE + 2.0).ceil();
    let has_axles = car.track_widths.iter().all(|width| *width > 0.0);
    let (plant, model) = match has_axles {
        true => ("plant-dual-fmu", ""),
        false => ("plant-fmu", ", tires.combined = true"),
    };
    let (l_f, l_r) = (car.body.l_f, car.body.l_r);
    let half_width = 0.5 * car.track_widths[0].max(car.track_widths[1]);
    let measured = MEASURED.map(|name| connection("plant", "driver", name, ""));
    let commanded = COMMANDED.map(|name| connection("driver", "plant", name, "at = \"start\"\n"));
    let connections = commanded.concat() + &measured.concat();
    let track = track_tables(first.edges.is_some(), line.is_closed(), half_width);
    format!(
        r#"{DRIVE_HEAD} in the plant: `trackside run drive.toml`. `trackside sweep drive.toml` finds the largest share
# of its speeds with which the car stays on the track.
title = {title}

[time]
step = {STEP:?}  # [s]
stop = {stop:?}  # [s]

[[fmu]]
name = "plant"
crate = "{plant}"
parameters = {parameters}
unused = "tell"
start = {{ start.X = {x:?}, start.Y = {y:?}, start.psi = {psi:?}, start.v_x = {v_x:?}{model} }}

[[fmu]]
name = "driver"
crate = "driver-fmu"
parameters = {parameters}
unused = "tell"
start = {{ track.csv = {{ text_of = "lap.csv" }}, profile.share = {SHARE:?}, steering.gain = 0.1, steering.lookahead = 20.0 }}

[[check]]
name = "it laps"
that = "max(driver.lap) >= {laps}"

{track}[view]
distance = "driver.s"

[view.pose]
x = "plant.X"
y = "plant.Y"
heading = "plant.psi"
steer = "plant.delta"
speed = "plant.v_x"
axles = [{l_f:?}, {:?}]

[[sweep.vary]]
name = "driver.profile.share"
uniform = [{LEAST_SHARE:?}, 1.0]

[sweep.search]
limit = "largest"
tolerance = 0.01

[sweep.collect]
lap_time = "last(driver.lap_time)"
{connections}{DIAGRAMS}"#,
        -l_r
    )
}

fn connection(from: &str, to: &str, name: &str, more: &str) -> String {
    format!("\n[[connect]]\nfrom = \"{from}.{name}\"\nto = \"{to}.{name}\"\n{more}")
}

/// The check of the edges and their picture, where the track has them.
fn track_tables(has_edges: bool, is_closed: bool, half_width: f64) -> String {
    if !has_edges {
        return String::new();
    }
    format!(
        r#"[[check]]
name = "its wheels stay on the track"
that = "driver.edge_distance > {half_width:?}"

[view.track]
path = "lap.csv"
center = ["x_m", "y_m"]
widths = ["left_m", "right_m"]
closed = {is_closed}

"#
    )
}

/// A path as a file of the folder names it.
fn path_from(folder: &Path, file: &Path) -> String {
    let file = real_path(file);
    relative_path(&real_path(folder), &file).unwrap_or_else(|| file.to_string_lossy().into_owned())
}
