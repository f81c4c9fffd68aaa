//! Finds the fastest lap of the car, with an interval from what is not known of it, and lays the lap of a drive beside it.

use std::sync::atomic::{AtomicUsize, Ordering};

use drive_inference::progress::with_progress;
use lap::{DrivenLap, InteriorPointStatus, LapNode, LapOptimum, PositionSample};
use lap_report::{LapPage, LoggedLap, interval_text, lap_numbers, lap_page, lap_table};
use numerics::text::format_lap_time;
use plugin::{
    AnalysisRequest, AnalysisServices, Diagram, DiagramLayer, DiagramLayerRole, DiagramLayerShape,
    ResultSummary, ResultTable, Signal,
};
use preparation::Interpolation;
use serde::Serialize;
use serde_json::{Value, json};
use track::TrackLine;

use super::report_progress;
use crate::config::FastestLapConfig;

/// Rows of the table of parameters.
const PARAMETER_ROWS: usize = 10;

/// Positions of the ghost in the replay [1/s].
const GHOST_RATE: f64 = 50.0;

/// What the progress says during the search with draws.
const DRAWS_STAGE: &str = "finding the fastest laps of the draws";

/// What checks and the report read.
#[derive(Serialize)]
struct FastestLapResult {
    #[serde(flatten)]
    words: ResultSummary,
    #[serde(flatten)]
    numbers: Value,
}

/// Whether the signals have a position, or none.
///
/// # Errors
/// When there is half of one.
pub(super) fn check_position(request: &AnalysisRequest) -> Result<(), String> {
    match ["x", "y"].map(|name| request.find_signal(name).is_some()) {
        [true, true] | [false, false] => Ok(()),
        _ => Err("expected the signals x and y, or none of them, found one".to_owned()),
    }
}

/// Does `task = "fastest_lap"`.
///
/// # Errors
/// When the track is too narrow for the car, the drive has no lap on it, no draw has a lap, or the program asked to give up.
pub(super) fn find_fastest_lap(
    config: &FastestLapConfig,
    request: &AnalysisRequest,
    host: &mut dyn AnalysisServices,
) -> Result<Value, String> {
    report_progress(host, 0.0, "finding the fastest lap")?;
    let line = config.line().map_err(|error| error.to_string())?;
    let (car, mut messages) = config.car().map_err(|error| error.to_string())?;
    let parameters = config.car_parameters().map_err(|error| error.to_string())?;
    let draws = config.draws().map_err(|error| error.to_string())?;
    let options = config.options(&car);
    let told = |error: lap::Error| error.to_string();
    let optimum = LapOptimum::find(&car, &line, &options).map_err(told)?;
    messages.extend(optimum.engine_warning(&car));
    let has_converged = optimum.status == InteriorPointStatus::Converged;
    let corners = optimum.corners(line.is_closed());
    let driven = driven_lap(request, &line, &optimum)?;
    let (mut worth, mut interval) = (Vec::new(), None);
    if has_converged {
        report_progress(host, 0.1, "finding what parameters are worth")?;
        worth = optimum.parameter_worth(&parameters, &line, &options, &corners).map_err(told)?;
    }
    if let Some(draws) = draws.filter(|_| has_converged) {
        let done = AtomicUsize::new(0);
        let mut progress = |share: f64, what: &str| host.report_progress(share, what);
        let found = with_progress(&mut progress, |progress| {
            let on_solved = || {
                let share = (done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / draws.len() as f64;
                progress.report_stage(0.2 + 0.8 * share, DRAWS_STAGE).is_ok()
            };
            progress.report_stage(0.2, DRAWS_STAGE)?;
            Ok(optimum.lap_time_interval(&parameters, &draws, &line, &options, on_solved))
        });
        let found = found.map_err(|error| error.to_string())?;
        interval = Some(found.map_err(told)?);
    }
    let page = LapPage {
        car: "of the scenario",
        track: "of the scenario",
        line: &line,
        optimum: &optimum,
        corners: &corners,
        worth: &worth,
        interval: interval.as_ref(),
        setup: None,
        driven: driven.as_ref(),
        messages: &messages,
    };
    host.write_file("lap.html", &lap_page(&page));
    host.write_file("lap.csv", &lap_table(&optimum.nodes));
    add_speed_diagram(&page, host);
    record_driven_lap(&page, host);
    record_ghost(&page, host);
    let words = ResultSummary { summary: summary(&page), sound: has_converged, tables: tables(&page) };
    Ok(json!(FastestLapResult { words, numbers: lap_numbers(&page) }))
}

/// The fastest lap of the drive, if it has positions.
fn driven_lap(
    request: &AnalysisRequest,
    line: &TrackLine,
    optimum: &LapOptimum,
) -> Result<Option<LoggedLap>, String> {
    let Some((x, y)) = request.find_signal("x").zip(request.find_signal("y")) else { return Ok(None) };
    // Each coordinate may have times of its own.
    let ys = Interpolation::Linear.resample(y.time, y.values, x.time);
    let samples = x.time.iter().zip(x.values).zip(ys);
    let samples: Vec<PositionSample> =
        samples.map(|((t, x), y)| PositionSample { t: *t, position: [*x, y] }).collect();
    let lap = DrivenLap::find_fastest(&samples, line, optimum).map_err(|error| error.to_string())?;
    Ok(Some(LoggedLap { log: "the drive".to_owned(), lap }))
}

fn summary(page: &LapPage) -> Vec<String> {
    let LapPage { optimum, .. } = page;
    let time = format_lap_time(optimum.lap_time, 3);
    let mut sentences = vec![match optimum.status {
        InteriorPointStatus::Converged => format!("The fastest lap of this car takes {time}."),
        _ => format!("The search for the fastest lap did not converge; its last lap takes {time}."),
    }];
    if let Some(interval) = page.interval {
        sentences.push(format!("{}.", interval_text(interval)));
    }
    if let Some(LoggedLap { lap, .. }) = page.driven {
        let [driven, gap] = [lap.lap_time, (lap.lap_time - optimum.lap_time).abs()];
        sentences.push(format!(
            "Lap {} of {} was driven in {}, {gap:.3} s {}.",
            lap.number,
            lap.count,
            format_lap_time(driven, 3),
            if driven >= optimum.lap_time { "slower" } else { "faster" }
        ));
        sentences.extend(lap.doubts(page.line, optimum).into_iter().map(|doubt| format!("Note: {doubt}.")));
    }
    sentences
}

fn tables(page: &LapPage) -> Vec<ResultTable> {
    let corner = |(i, corner): (usize, &lap::Corner)| {
        let node = &page.optimum.nodes[corner.apex];
        let speed = format!("{:.1}", 3.6 * node.variables.v_x);
        let [driven, lost] = match page.driven {
            Some(LoggedLap { lap, .. }) => [
                format!("{:.1}", 3.6 * lap.slowest_speed(corner)),
                format!("{:+.3}", lap.time_lost(page.optimum, corner)),
            ],
            None => ["–", "–"].map(str::to_owned),
        };
        [format!("{}", i + 1), format!("{:.0}", node.s), speed, driven, lost]
    };
    let worth = page.worth.iter().take(PARAMETER_ROWS);
    let worth = worth.map(|worth| [worth.name.to_owned(), format!("{:+.4}", worth.seconds_per_percent)]);
    let corners = page.corners.iter().enumerate().map(corner);
    vec![
        ResultTable::new(["corner", "at [m]", "slowest [km/h]", "driven [km/h]", "lost [s]"], corners),
        ResultTable::new(["one percent more of", "s per lap"], worth),
    ]
}

/// The speed of the fastest lap over the station, and that of the drive.
fn add_speed_diagram(page: &LapPage, host: &mut dyn AnalysisServices) {
    let stations: Vec<f64> = page.optimum.nodes.iter().map(|node| node.s).collect();
    let fastest: Vec<f64> = page.optimum.nodes.iter().map(|node| node.variables.v_x).collect();
    let driven: Vec<f64> =
        page.driven.map_or_else(Vec::new, |driven| driven.lap.nodes.iter().map(|node| node.speed).collect());
    let layer = |name, role, y| DiagramLayer {
        name,
        shape: DiagramLayerShape::Line,
        role,
        x: &stations,
        y,
        upper: &[],
    };
    let mut layers = vec![layer("fastest lap", DiagramLayerRole::Reference, &fastest[..])];
    if !driven.is_empty() {
        layers.push(layer("driven", DiagramLayerRole::Plant, &driven[..]));
    }
    let diagram =
        Diagram { title: "Speed", axes: ["station [m]", "speed [m/s]"], ranges: [[f64::NAN; 2]; 2], layers };
    host.add_diagram("fastest lap", &diagram);
}

/// What the fastest lap does where the car is: its speed, its deviation from the line, and the time behind it.
fn record_driven_lap(page: &LapPage, host: &mut dyn AnalysisServices) {
    let Some(LoggedLap { lap, .. }) = page.driven else { return };
    let optimum = page.optimum;
    let time: Vec<f64> = lap.nodes.iter().map(|node| lap.begin + node.t).collect();
    let v_x: Vec<f64> = optimum.nodes.iter().map(|node| node.variables.v_x).collect();
    let n: Vec<f64> = optimum.nodes.iter().map(|node| node.variables.n).collect();
    let gap: Vec<f64> = (0..lap.nodes.len()).map(|k| lap.time_gap(optimum, k)).collect();
    let signal = |name, unit, values| Signal { name, unit, time: &time, values };
    let signals =
        [signal("v_x", "m/s", &v_x[..]), signal("n", "m", &n[..]), signal("time_gap", "s", &gap[..])];
    host.record_signals("fastest_lap", &signals);
}

/// The car of the fastest lap, which starts with the driven lap and is drawn beside the car of the drive.
fn record_ghost(page: &LapPage, host: &mut dyn AnalysisServices) {
    let Some(LoggedLap { lap, .. }) = page.driven else { return };
    let nodes = &page.optimum.nodes;
    let stamps: Vec<f64> = nodes.iter().map(|node| node.t).collect();
    let end = stamps.last().copied().unwrap_or_default();
    let moving = (0..=(GHOST_RATE * end) as usize).map(|frame| lap.begin + frame as f64 / GHOST_RATE);
    let time: Vec<f64> = (lap.begin > 0.0).then_some(0.0).into_iter().chain(moving).collect();
    // It waits at the start until the lap begins.
    let lap_time: Vec<f64> = time.iter().map(|t| (t - lap.begin).clamp(0.0, end)).collect();
    let values = |of: fn(&LapNode) -> f64| {
        let at_nodes: Vec<f64> = nodes.iter().map(of).collect();
        Interpolation::Linear.resample(&stamps, &at_nodes, &lap_time)
    };
    let x = values(|node| node.position[0]);
    let y = values(|node| node.position[1]);
    let psi = values(|node| node.psi);
    let signal = |name, unit, values| Signal { name, unit, time: &time, values };
    host.record_signals(
        "ghost",
        &[signal("X", "m", &x[..]), signal("Y", "m", &y[..]), signal("psi", "rad", &psi[..])],
    );
}
