//! Reads tracks from the files of simulators: road networks of OpenDRIVE, and surfaces of OpenCRG.
//!
//! Everything is in SI units and radians; the axes are those of the file, with z up.
#![forbid(unsafe_code)]
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets, which rustdoc takes for links")]

mod cross_section;
mod open_crg;
mod open_drive;
mod plausibility;
mod road_route;
mod road_stretch;

use std::path::Path;

use track::{TrackLine, TrackSurvey};

/// Largest file that is read [B]: its tree in memory is ten times as large.
const LARGEST: u64 = 256 << 20;
/// Points that make a line.
const LEAST_POINTS: usize = 4;
/// Curvature that no road has [1/m]: the line has a kink where it jumps to other lanes.
const KINK: f64 = 0.5;

/// Whether a file is one of OpenDRIVE or OpenCRG, by its name.
pub fn is_road_file(path: &Path) -> bool {
    is_open_drive(path) || has_extension(path, "crg")
}

/// Whether a file is one of OpenDRIVE, by its name.
pub fn is_open_drive(path: &Path) -> bool {
    has_extension(path, "xodr")
}

fn has_extension(path: &Path, expected: &str) -> bool {
    path.extension().is_some_and(|it| it.eq_ignore_ascii_case(expected))
}

/// Reads the track of a file, of OpenDRIVE along these roads, or where none are named along the longest road and what follows it.
///
/// # Errors
/// When the file is none, has no such roads, or the way forks.
pub fn read_road_file(path: &Path, roads: &[String]) -> Result<RoadTrack, Error> {
    let size =
        std::fs::metadata(path).map_err(|error| Error::File(format!("cannot be read: {error}")))?.len();
    if size > LARGEST {
        return Err(Error::File(format!("has {size} B, expected at most {LARGEST} B")));
    }
    match is_open_drive(path) {
        true => open_drive::read_open_drive(path, roads),
        false => open_crg::read_open_crg(path),
    }
}

/// A track out of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct RoadTrack {
    /// Its line and edges.
    pub survey: TrackSurvey,
    /// Length of the line [m].
    pub length: f64,
    /// The roads that it consists of, by their identifiers, in the order of the drive; none of OpenCRG.
    pub roads: Vec<String>,
    /// What the file has and the reader leaves out, or takes for something else.
    pub warnings: Vec<String>,
}

impl RoadTrack {
    /// A track with these warnings, and one more where its line has a kink.
    fn new(survey: TrackSurvey, roads: Vec<String>, mut warnings: Vec<String>) -> Result<Self, Error> {
        let line = TrackLine::from_survey(&survey).map_err(|error| Error::File(error.to_string()))?;
        let kink = line.knot_stations().find(|s| line.curvature_at(*s).abs() > KINK);
        if let Some(s) = kink {
            let radius = 1.0 / line.curvature_at(s).abs();
            warnings.push(format!(
                "the line has a bend of {radius:.1} m radius at s = {s:.0} m: does the road jump there?"
            ));
        }
        Ok(RoadTrack { survey, length: line.length(), roads, warnings })
    }
}

/// Why there is no track.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file is none.
    #[error("{0}")]
    File(String),
    /// No road has a lane for driving.
    #[error("expected a road with lanes for driving, found none")]
    NoLanes,
    /// A road that is asked for.
    #[error("expected roads of the file, found `{road}`; it has {known}")]
    UnknownRoad {
        /// Its identifier.
        road: String,
        /// Identifiers in the file.
        known: String,
    },
    /// Two roads that are asked for do not follow each other.
    #[error("road {to} does not follow road {from}; {next}")]
    NotLinked {
        /// The road before.
        from: String,
        /// The road that does not follow it.
        to: String,
        /// What does.
        next: String,
    },
    /// The way goes on in several directions.
    #[error("behind road {road} the way goes on to roads {next}")]
    Fork {
        /// The road before.
        road: String,
        /// The roads behind it.
        next: String,
    },
    /// A road whose line or lanes are not finite.
    #[error("road {road}: expected positions and widths that are finite numbers")]
    NotFinite {
        /// Its identifier.
        road: String,
    },
    /// The line jumps.
    #[error(
        "the line jumps by {gap:.1} m from x = {x:.1} m, y = {y:.1} m on: roads that follow one another do not meet there"
    )]
    Gap {
        /// Where it does [m].
        x: f64,
        /// Where it does [m].
        y: f64,
        /// How far [m].
        gap: f64,
    },
    /// A track that is no line.
    #[error("expected at least {least} points at a distance of {spacing} m, found a track of {length:.1} m")]
    Short {
        /// Least number of points.
        least: usize,
        /// Distance of points [m].
        spacing: f64,
        /// Length of the track [m].
        length: f64,
    },
    /// Numbers of single precision do not tell the bends of a line this far from the origin.
    #[error("expected positions within {most} m of the origin, found {found:.0} m; move the map there")]
    Far {
        /// Largest coordinate [m].
        most: f64,
        /// Largest coordinate in the map [m].
        found: f64,
    },
}
