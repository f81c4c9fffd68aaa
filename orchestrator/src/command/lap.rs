//! `trackside lap`: the fastest lap of a car on a track, with what each parameter is worth, and an interval from what is not known.

mod car_file;
mod drive_scenario;
mod driven_log;
pub mod position_log;
mod results;
mod setup_ranges;
mod variation;

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::{Error, escape_for_terminal};
use indicatif::ProgressBar;
use lap::{CarParameters, InteriorPointStatus, LapOptimum, LapOptions};
use lap_report::{FastestSetup, LapPage, LoggedLap, interval_text};
use numerics::convergence::OptimisationStatus;
use numerics::text::{format_lap_time, format_significant};
use orchestrator::relative_path::real_path;
use track::{TrackLine, TrackSurvey};

use self::car_file::CarFile;
use self::driven_log::DrivenLogArguments;
use self::results::{RESULT_FILES, write_lap_files};
use self::setup_ranges::SetupArguments;
use self::variation::VariationArguments;
use super::{print_text, print_to_stderr};

/// The largest track [B].
const LARGEST: u64 = 64 << 20;
/// Exit code of a lap that is not known to be the fastest.
const DOUBTFUL: u8 = 4;
/// Parameters whose worth is printed.
const PRINTED_PARAMETERS: usize = 10;

/// Arguments of `trackside lap`.
#[derive(Args)]
pub struct LapArguments {
    /// The car: a file of parameters, such as the one that plant and driver have.
    car: PathBuf,
    /// The track: a table of its line with widths.
    track: PathBuf,
    /// Sets a parameter of the car, such as body.m=1300 or "body.m=1300 kg".
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Nodes along the line [default: one every 4 m, from 200 to 2000].
    #[arg(long, value_name = "N")]
    nodes: Option<usize>,
    /// Way from the centre of gravity to an edge that is kept [m] [default: half of the wider track width and 0.15 m, or 0.9 m].
    #[arg(long, value_name = "M")]
    margin: Option<f64>,
    /// Way from the line to both edges [m], for a track without widths.
    #[arg(long, value_name = "M")]
    half_width: Option<f64>,
    /// Keeps the car on the line, as by a log: its speed alone is free.
    #[arg(long)]
    on_line: bool,
    /// Lets the body swing on springs and dampers: load moves as they pass it on, not at once.
    #[arg(long)]
    transients: bool,
    /// Highest speed at the beginning of an open track [m/s].
    #[arg(long, value_name = "V")]
    start_speed: Option<f64>,
    #[command(flatten)]
    variation: VariationArguments,
    #[command(flatten)]
    setup: SetupArguments,
    #[command(flatten)]
    log: DrivenLogArguments,
    /// The folder of the results [default: target/laps/CAR_TRACK].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Finds the lap, prints it and writes its files.
///
/// # Errors
/// When the car, the track or an option is wrong, or a file cannot be written.
pub fn run_lap_command(arguments: &LapArguments) -> Result<u8, Error> {
    let mut car_file = CarFile::read(&arguments.car, &arguments.set)?;
    car_file.parameters.set_transients(arguments.transients);
    let draws = arguments.variation.draws(&car_file)?;
    let ranges = arguments.setup.ranges(&car_file, draws.as_deref())?;
    let survey = read_track(&arguments.track)?;
    let line = TrackLine::from_survey(&survey)
        .map_err(|error| Error::invalid_input(format!("{}: {error}", arguments.track.display())))?;
    let log = arguments.log.read(&arguments.track, survey.plane)?;
    let (car, mut messages) = car_file.car()?;
    for message in &messages {
        print_to_stderr(&escape_for_terminal(message));
    }
    let mut warn = |warning: Option<String>| {
        if let Some(message) = warning.map(|warning| format!("warning: {warning}")) {
            print_to_stderr(&message);
            messages.push(message);
        }
    };
    let options = arguments.options(car.track_widths)?;
    let folder = arguments.out.clone().unwrap_or_else(|| default_folder(&arguments.car, &arguments.track));
    let logs = log.as_ref().map(|log| log.path.as_path());
    let inputs = [Some(arguments.car.as_path()), Some(&arguments.track), arguments.variation.file(), logs];
    check_output_folder(&folder, &inputs)?;
    let wrong = |error: lap::Error| track_error(&arguments.track, &error);
    let optimum = LapOptimum::find(&car, &line, &options).map_err(wrong)?;
    let corners = optimum.corners(line.is_closed());
    let is_found = optimum.status == InteriorPointStatus::Converged;
    warn(optimum.engine_warning(&car));
    let driven = log.as_ref().map(|log| log.fastest_lap(&line, &optimum)).transpose()?;
    let worth = match is_found {
        true => optimum.parameter_worth(&car_file.parameters, &line, &options, &corners).map_err(wrong)?,
        false => Vec::new(),
    };
    let interval_of = |lap: &LapOptimum, parameters: &CarParameters| {
        let Some(draws) = &draws else { return Ok(None) };
        let bar = ProgressBar::new(draws.len() as u64);
        let on_solved = || {
            bar.inc(1);
            true
        };
        let interval = lap.lap_time_interval(parameters, draws, &line, &options, on_solved);
        bar.finish_and_clear();
        interval.map(Some).map_err(|error| Error::invalid_input(error.to_string()))
    };
    let interval = if is_found { interval_of(&optimum, &car_file.parameters)? } else { None };
    let setup = match is_found && !ranges.is_empty() {
        true => {
            let parameters = &car_file.parameters;
            let before = ranges.iter().map(|range| range.key.value(parameters)).collect();
            let setup = optimum
                .fastest_setup(parameters, &ranges, &line, &options)
                .map_err(|error| Error::invalid_input(format!("--setup: {error}")))?;
            let (setup_car, _) = setup.parameters.car().map_err(Error::invalid_input)?;
            warn(setup.lap.engine_warning(&setup_car).map(|it| format!("with the fastest set-up {it}")));
            let interval = interval_of(&setup.lap, &setup.parameters)?;
            Some(FastestSetup { ranges, before, setup, interval })
        }
        false => None,
    };
    let page = LapPage {
        car: &file_name(&arguments.car),
        track: &file_name(&arguments.track),
        line: &line,
        optimum: &optimum,
        corners: &corners,
        worth: &worth,
        interval: interval.as_ref(),
        setup: setup.as_ref(),
        driven: driven.as_ref(),
        messages: &messages,
    };
    print_text(&summary(&page));
    for path in write_lap_files(&folder, &page, &car_file, &car, survey.plane)? {
        print_text(&format!("  {}\n", path.display()));
    }
    if !is_found {
        print_to_stderr(&format!(
            "error: the search did not converge after {} steps, with an error of {:.1e}: the lap is not the fastest; try --nodes with \
             another number, and look at the numbers of the car",
            optimum.iterations, optimum.optimality_error
        ));
        return Ok(DOUBTFUL);
    }
    if setup.is_some_and(|it| it.setup.status != OptimisationStatus::Converged) {
        print_to_stderr(
            "error: the search for the fastest set-up did not converge: there may be a faster one; try narrower ranges",
        );
        return Ok(DOUBTFUL);
    }
    Ok(0)
}

impl LapArguments {
    fn options(&self, track_widths: [f64; 2]) -> Result<LapOptions, Error> {
        let options = LapOptions {
            nodes: self.nodes,
            margin: self.margin.unwrap_or_else(|| LapOptions::usual_margin(track_widths)),
            half_width: self.half_width,
            keeps_line: self.on_line,
            start_speed: self.start_speed,
        };
        check_not_negative("--margin", options.margin)?;
        check_not_negative("--half-width", options.half_width.unwrap_or_default())?;
        Ok(options)
    }
}

/// Refuses a number of an option that is negative or not finite.
///
/// # Errors
/// When it is one.
pub fn check_not_negative(option: &str, number: f64) -> Result<(), Error> {
    match number.is_finite() && number >= 0.0 {
        true => Ok(()),
        false => {
            Err(Error::invalid_input(format!("{option}: expected a number of at least 0, found {number}")))
        }
    }
}

fn read_track(path: &Path) -> Result<TrackSurvey, Error> {
    let name = path.display();
    if track_file::is_road_file(path) {
        return Err(Error::invalid_input(format!(
            "{name}: expected a table of the track, found a file of roads"
        ))
        .with_help(format!("make a table of it: trackside track {name} --out track.csv")));
    }
    let bytes = diagnostics::read_bounded(path, LARGEST)
        .map_err(|error| Error::invalid_input(format!("the track {name} cannot be read: {error}")))?;
    TrackSurvey::from_table_text(&text_encoding::decode_text(&bytes))
        .map_err(|error| Error::invalid_input(format!("{name}: {error}")))
}

/// The folder is one, or can be, and no result goes over what was read.
fn check_output_folder(folder: &Path, inputs: &[Option<&Path>]) -> Result<(), Error> {
    let wrong = |message: String| Error::invalid_input(message).with_help("tell another folder: --out DIR");
    if folder.exists() && !folder.is_dir() {
        return Err(wrong(format!("{}: expected a folder, found a file", folder.display())));
    }
    for name in RESULT_FILES {
        let result = real_path(&folder.join(name));
        if inputs.iter().flatten().any(|input| real_path(input) == result) {
            return Err(wrong(format!(
                "{} would be overwritten by the results",
                folder.join(name).display()
            )));
        }
    }
    Ok(())
}

fn track_error(path: &Path, error: &lap::Error) -> Error {
    let message = Error::invalid_input(format!("{}: {error}", path.display()));
    match error {
        lap::Error::NoWidths => message.with_help(
            "add the columns left_m and right_m to the table, or tell --half-width; --on-line needs no widths",
        ),
        lap::Error::Narrow { .. } => message.with_help("tell a smaller --margin, or --on-line"),
        _ => message,
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// `target/laps/CAR_TRACK`. A car is often called `car.toml`: then the name of its folder tells which.
fn default_folder(car: &Path, track: &Path) -> PathBuf {
    let stem =
        |path: &Path| path.file_stem().map_or_else(String::new, |it| it.to_string_lossy().into_owned());
    let folder = car.canonicalize().ok().and_then(|path| path.parent().map(file_name));
    let car = match folder {
        Some(folder) if stem(car) == "car" => folder,
        _ => stem(car),
    };
    PathBuf::from(format!("target/laps/{car}_{}", stem(track)))
}

/// Lap time, corners and worth of parameters as text.
fn summary(page: &LapPage) -> String {
    let LapPage { optimum, line, .. } = page;
    let mut text = format!(
        "{}  {} on {}, {:.0} m, {} nodes{}\n",
        format_lap_time(optimum.lap_time, 3),
        escape_for_terminal(page.car),
        escape_for_terminal(page.track),
        line.length(),
        optimum.nodes.len(),
        if optimum.has_transients() { ", with transients" } else { "" }
    );
    if let Some(interval) = page.interval {
        text += &format!("  {}\n", interval_text(interval));
    }
    if let Some(LoggedLap { log, lap }) = page.driven {
        text += &format!(
            "  {} lap {} of {} in {}, {:+.3} s\n",
            format_lap_time(lap.lap_time, 3),
            lap.number,
            lap.count,
            escape_for_terminal(log),
            lap.lap_time - optimum.lap_time
        );
    }
    for (i, corner) in page.corners.iter().enumerate() {
        let node = &optimum.nodes[corner.apex];
        let speed = 3.6 * node.variables.v_x;
        text += &format!("  corner {:<3} at {:>5.0} m  {speed:>5.1} km/h", i + 1, node.s);
        if let Some(LoggedLap { lap, .. }) = page.driven {
            let (slowest, lost) = (3.6 * lap.slowest_speed(corner), lap.time_lost(optimum, corner));
            text += &format!("  log {slowest:>5.1} km/h  {lost:+.3} s");
        }
        text += "\n";
    }
    if let Some(setup) = page.setup {
        text += &setup_lines(setup, page);
    }
    if !page.worth.is_empty() {
        text += "  one percent more of        s per lap\n";
    }
    for worth in page.worth.iter().take(PRINTED_PARAMETERS) {
        text += &format!("    {:<22} {:>+11.4}\n", worth.name, worth.seconds_per_percent);
    }
    text
}

/// The fastest set-up, and how much faster it is.
fn setup_lines(setup: &FastestSetup, page: &LapPage) -> String {
    let (time, gain) = (format_lap_time(setup.setup.lap.lap_time, 3), setup.gain_text(page));
    let mut text = format!("  {time} with the fastest set-up, {gain}\n");
    for (k, range) in setup.ranges.iter().enumerate() {
        let [before, now, low, high] = [setup.before[k], setup.setup.values[k], range.low, range.high]
            .map(|it| format_significant(it, 4));
        text += &format!(
            "    {:<22} {before:>9} to {now:>9} {} in {low}..{high}\n",
            range.key.name, range.key.unit
        );
    }
    text
}
