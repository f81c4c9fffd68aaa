//! `trackside track`: the table of a track from the positions in a log or from a file of roads.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::{Error, escape_for_terminal};
use lap::{LoggedTrack, LoggedTrackOptions};
use numerics::text::format_lap_time;
use orchestrator::nofollow::write_without_following_links;
use orchestrator::relative_path::real_path;
use track::TrackSurvey;
use track_file::{RoadTrack, is_open_drive, is_road_file};

use super::lap::check_not_negative;
use super::lap::position_log::{PositionColumns, PositionLog};
use super::{print_text, print_to_stderr};

/// Positions that err by more are of no use for a line [m].
const MOST_NOISE: f64 = 10.0;

/// Width of a car where none is told [m].
const CAR_WIDTH: f64 = 2.0;

/// Least standard deviation of positions where none is told [m].
const LEAST_NOISE: f64 = 0.05;

/// Mean speed below which nobody laps [m/s].
const SLOWEST_SPEED: f64 = 1.0;

/// Arguments of `trackside track`.
#[derive(Args)]
pub struct TrackArguments {
    /// A log, the folder of a run, or roads: OpenDRIVE (`.xodr`) or OpenCRG (`.crg`).
    source: PathBuf,
    /// Roads of OpenDRIVE in the order of the drive, by their identifiers [default: the longest road and what follows it].
    #[arg(long, value_name = "ID,ID", value_delimiter = ',')]
    roads: Vec<String>,
    /// Columns of the position [default: plant.X,plant.Y, X,Y, x,y or latitude and longitude].
    #[arg(long, value_name = "X,Y")]
    position: Option<String>,
    /// Column of the time, where the format has none of its own [default: t, time, Time or timestamp].
    #[arg(long, value_name = "COLUMN")]
    time: Option<String>,
    /// Where a lap begins, in the units of the log [default: where most laps pass, and there where they are fastest].
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    start: Option<String>,
    /// Way from the line to both edges of the road [m] [default: as far as the laps went, where there are several].
    #[arg(long, value_name = "M")]
    half_width: Option<f64>,
    /// Width of the car, for which there was road in each lap [m] [default: 2].
    #[arg(long, value_name = "M")]
    car_width: Option<f64>,
    /// Standard deviation of the positions about the line at least: a larger one gives a smoother line [m] [default: 0.05].
    #[arg(long, value_name = "M")]
    noise: Option<f64>,
    /// The table of the track [default: target/tracks/SOURCE.csv].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Finds the track, prints what it was found from and writes its table.
///
/// # Errors
/// When the source or an option is wrong, there is no line, or the file cannot be written.
pub fn run_track_command(arguments: &TrackArguments) -> Result<u8, Error> {
    arguments.check()?;
    let out = arguments.out.clone().unwrap_or_else(|| default_table(&arguments.source));
    let survey = match is_road_file(&arguments.source) {
        true => track_from_roads(arguments, &out)?,
        false => track_from_log(arguments, &out)?,
    };
    if let Some(folder) = out.parent() {
        std::fs::create_dir_all(folder).map_err(|error| Error::output_failure(folder, error))?;
    }
    write_without_following_links(&out, survey.table_text())
        .map_err(|error| Error::output_failure(&out, error))?;
    print_text(&format!("  {}\n", out.display()));
    Ok(0)
}

fn check_is_other_file(out: &Path, source: &Path) -> Result<(), Error> {
    if real_path(out) == real_path(source) {
        return Err(Error::invalid_input(format!("{} would be overwritten by the track", out.display()))
            .with_help("tell another file: --out FILE"));
    }
    Ok(())
}

fn track_from_roads(arguments: &TrackArguments, out: &Path) -> Result<TrackSurvey, Error> {
    let path = &arguments.source;
    check_is_other_file(out, path)?;
    let mut track = track_file::read_road_file(path, &arguments.roads).map_err(|error| {
        let wrong = Error::invalid_input(format!("{}: {error}", path.display()));
        match error {
            track_file::Error::Fork { road, .. } => wrong.with_help(format!(
                "tell the roads of the track in the order of the drive: --roads {road},..."
            )),
            _ => wrong,
        }
    })?;
    arguments.set_half_width(&mut track.survey);
    print_text(&describe_roads(&track));
    for warning in &track.warnings {
        print_to_stderr(&escape_for_terminal(&format!("warning: {}: {warning}", path.display())));
    }
    Ok(track.survey)
}

/// The line, its roads, widths and heights.
fn describe_roads(track: &RoadTrack) -> String {
    let survey = &track.survey;
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let [low, high] =
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], it| [low.min(it), high.max(it)]);
        format!("{low:.1} to {high:.1}")
    };
    let mut text = format!("  {:.1} m, {}", track.length, if survey.closed { "closed" } else { "open" });
    if !track.roads.is_empty() {
        let many = if track.roads.len() > 1 { "s" } else { "" };
        text += &format!(", road{many} {}", track.roads.join(", "));
    }
    if let Some(widths) = &survey.widths {
        text += &format!("; {} m wide", range(&mut widths.iter().map(|[left, right]| left + right)));
    }
    if let Some(heights) = &survey.height {
        text += &format!("; at heights of {} m", range(&mut heights.iter().copied()));
    }
    if let Some(banks) = &survey.bank {
        text += &format!("; banked by {} deg", range(&mut banks.iter().map(|bank| bank.to_degrees())));
    }
    escape_for_terminal(&(text + "\n")).into_owned()
}

fn track_from_log(arguments: &TrackArguments, out: &Path) -> Result<TrackSurvey, Error> {
    let columns = PositionColumns {
        position: arguments.position.as_deref(),
        time: arguments.time.as_deref(),
        options: ["--position", "--time"],
    };
    let log = PositionLog::read(&arguments.source, &columns, None)?;
    check_is_other_file(out, &log.path)?;
    let options = LoggedTrackOptions {
        start: arguments.start(&log)?,
        half_car_width: 0.5 * arguments.car_width.unwrap_or(CAR_WIDTH),
        least_noise: arguments.noise.unwrap_or(LEAST_NOISE),
    };
    let mut track = LoggedTrack::find(&log.samples, &options)
        .map_err(|error| Error::invalid_input(format!("{}: {error}", log.path.display())))?;
    track.survey.plane = log.plane;
    print_text(&summary(&track));
    if track.laps.iter().any(|lap| lap.counts && lap.length < SLOWEST_SPEED * lap.lap_time) {
        print_to_stderr(
            "note: laps are driven at less than 1 m/s: is the time in another unit, such as milliseconds?",
        );
    }
    if track.survey.widths.is_none() && arguments.half_width.is_none() {
        print_to_stderr(
            "note: one lap does not tell how wide the road is: tell --half-width, here or with `trackside lap`, or keep to the line with --on-line",
        );
    } else if arguments.half_width.is_none() {
        print_to_stderr(
            "note: the widths are as far as the laps went: the road may be wider, and narrower where the positions err; --half-width tells it",
        );
    }
    arguments.set_half_width(&mut track.survey);
    Ok(track.survey)
}

impl TrackArguments {
    /// What `--half-width` says goes before the widths of the source.
    fn set_half_width(&self, survey: &mut TrackSurvey) {
        if let Some(half) = self.half_width {
            survey.widths = Some(vec![[half; 2]; survey.points.len()]);
        }
    }

    fn check(&self) -> Result<(), Error> {
        check_not_negative("--half-width", self.half_width.unwrap_or_default())?;
        check_not_negative("--car-width", self.car_width.unwrap_or_default())?;
        let noise = self.noise.unwrap_or_default();
        check_not_negative("--noise", noise)?;
        if noise > MOST_NOISE {
            let message = format!("--noise: expected at most {MOST_NOISE} m, found {noise}");
            return Err(Error::invalid_input(message));
        }
        let of_logs = [
            ("--position", self.position.is_some()),
            ("--time", self.time.is_some()),
            ("--start", self.start.is_some()),
            ("--car-width", self.car_width.is_some()),
            ("--noise", self.noise.is_some()),
        ];
        let unused = match is_road_file(&self.source) {
            true => of_logs.iter().find(|(_, is_told)| *is_told).map(|(name, _)| (*name, "of a log")),
            false => None,
        };
        let has_roads = !self.roads.is_empty() && !is_open_drive(&self.source);
        match unused.or(has_roads.then_some(("--roads", "of OpenDRIVE (.xodr)"))) {
            None => Ok(()),
            Some((name, what)) => {
                let source = self.source.display();
                Err(Error::invalid_input(format!("{name} is for a track {what}, and {source} is none")))
            }
        }
    }

    /// The start on the plane of the log [m].
    fn start(&self, log: &PositionLog) -> Result<Option<[f64; 2]>, Error> {
        let Some(told) = &self.start else { return Ok(None) };
        let numbers: Option<Vec<f64>> = told.split(',').map(|word| word.trim().parse().ok()).collect();
        let Some(&[x, y]) = numbers.as_deref() else {
            let message = format!("--start {told}: expected two numbers with a comma in between");
            return Err(Error::invalid_input(message));
        };
        Ok(Some(log.plane.map_or([x, y], |plane| plane.position(x, y))))
    }
}

/// The laps, and how well the line is known.
fn summary(track: &LoggedTrack) -> String {
    let mut text = String::new();
    for (i, lap) in track.laps.iter().enumerate() {
        text += &format!(
            "{}  lap {} from t = {:.2} s, {:.0} m{}\n",
            format_lap_time(lap.lap_time, 3),
            i + 1,
            lap.begin,
            lap.length,
            if lap.counts {
                ""
            } else {
                ", left out: of another length, beside the others, slow, or with a gap"
            }
        );
    }
    let counted = track.laps.iter().filter(|lap| lap.counts).count();
    text += &format!("  {:.1} m, ", track.length);
    text += &match counted {
        0 => "open, no place is passed twice".to_owned(),
        1 => "closed, the line of one lap".to_owned(),
        _ => format!("closed, the mean of {counted} laps, which are up to {:.2} m apart", track.spread),
    };
    text += &format!("; the positions lie {:.2} m beside the line of their lap\n", track.noise);
    escape_for_terminal(&text).into_owned()
}

/// `target/tracks/LOG.csv`, of a run by the name of its folder.
fn default_table(log: &Path) -> PathBuf {
    let stem = log.file_stem().unwrap_or(log.as_os_str()).to_string_lossy();
    PathBuf::from(format!("target/tracks/{stem}.csv"))
}
