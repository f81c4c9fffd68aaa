//! `trackside track`: the line of a track from the positions in a log, with the laps that it was found from.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::{Error, escape_for_terminal};
use lap::{LoggedTrack, LoggedTrackOptions};
use numerics::text::format_lap_time;
use orchestrator::nofollow::write_without_following_links;
use orchestrator::relative_path::real_path;

use super::lap::check_not_negative;
use super::lap::position_log::{PositionColumns, PositionLog};
use super::{print_text, print_to_stderr};

/// Positions that err by more are of no use for a line [m].
const MOST_NOISE: f64 = 10.0;

/// Mean speed below which nobody laps [m/s].
const SLOWEST_SPEED: f64 = 1.0;

/// Arguments of `trackside track`.
#[derive(Args)]
pub struct TrackArguments {
    /// A log, or the folder of a run.
    log: PathBuf,
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
    /// Width of the car, for which there was road in each lap [m].
    #[arg(long, value_name = "M", default_value_t = 2.0)]
    car_width: f64,
    /// Standard deviation of the positions about the line at least: a larger one gives a smoother line [m].
    #[arg(long, value_name = "M", default_value_t = 0.05)]
    noise: f64,
    /// The table of the track [default: target/tracks/LOG.csv].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Finds the track, prints its laps and writes its table.
///
/// # Errors
/// When the log or an option is wrong, it has no line, or the file cannot be written.
pub fn run_track_command(arguments: &TrackArguments) -> Result<u8, Error> {
    arguments.check()?;
    let columns = PositionColumns {
        position: arguments.position.as_deref(),
        time: arguments.time.as_deref(),
        options: ["--position", "--time"],
    };
    let log = PositionLog::read(&arguments.log, &columns, None)?;
    let out = arguments.out.clone().unwrap_or_else(|| default_table(&arguments.log));
    if real_path(&out) == real_path(&log.path) {
        return Err(Error::invalid_input(format!("{} would be overwritten by the track", out.display()))
            .with_help("tell another file: --out FILE"));
    }
    let options = LoggedTrackOptions {
        start: arguments.start(&log)?,
        half_car_width: 0.5 * arguments.car_width,
        least_noise: arguments.noise,
    };
    let mut track = LoggedTrack::find(&log.samples, &options)
        .map_err(|error| Error::invalid_input(format!("{}: {error}", log.path.display())))?;
    track.survey.plane = log.plane;
    if let Some(half) = arguments.half_width {
        track.survey.widths = Some(vec![[half; 2]; track.survey.points.len()]);
    }
    print_text(&summary(&track));
    if track.laps.iter().any(|lap| lap.counts && lap.length < SLOWEST_SPEED * lap.lap_time) {
        print_to_stderr(
            "note: laps are driven at less than 1 m/s: is the time in another unit, such as milliseconds?",
        );
    }
    if track.survey.widths.is_none() {
        print_to_stderr(
            "note: one lap does not tell how wide the road is: tell --half-width, here or with `trackside lap`, or keep to the line with --on-line",
        );
    } else if arguments.half_width.is_none() {
        print_to_stderr(
            "note: the widths are as far as the laps went: the road may be wider, and narrower where the positions err; --half-width tells it",
        );
    }
    if let Some(folder) = out.parent() {
        std::fs::create_dir_all(folder).map_err(|error| Error::output_failure(folder, error))?;
    }
    write_without_following_links(&out, track.survey.table_text())
        .map_err(|error| Error::output_failure(&out, error))?;
    print_text(&format!("  {}\n", out.display()));
    Ok(0)
}

impl TrackArguments {
    fn check(&self) -> Result<(), Error> {
        check_not_negative("--half-width", self.half_width.unwrap_or_default())?;
        check_not_negative("--car-width", self.car_width)?;
        check_not_negative("--noise", self.noise)?;
        if self.noise > MOST_NOISE {
            let message = format!("--noise: expected at most {MOST_NOISE} m, found {}", self.noise);
            return Err(Error::invalid_input(message));
        }
        Ok(())
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
