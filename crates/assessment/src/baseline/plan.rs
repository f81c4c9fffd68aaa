//! A recording that the run is compared with, by columns.

use std::ops::Range;
use std::path::PathBuf;

use recording::{AllVariables, ColumnIndex};
use units::Unit;

/// A recording and the signals of the run that it is compared with.
#[derive(Debug, Clone)]
pub struct BaselinePlan {
    /// Its name.
    pub name: String,
    /// The recording.
    pub path: PathBuf,
    /// Place of the word that names it in the scenario.
    pub place: Range<usize>,
    /// The file that it is written in.
    pub file: PathBuf,
    /// Its line there, from 1 on.
    pub line: usize,
    /// First and last moment [s], if the scenario gives a window.
    pub during: Option<[f64; 2]>,
    /// The compared signals.
    pub signals: Vec<BaselineSignal>,
    /// Whether the scenario chooses the signals; without a choice the run must have all that the recording has.
    pub chosen: bool,
    /// Whether the scenario gives some of them tubes of their own.
    pub has_tubes: bool,
}

/// A signal of a baseline.
#[derive(Debug, Clone)]
pub struct BaselineSignal {
    /// `node.variable`.
    pub name: String,
    /// Its unit in the run.
    pub unit: Option<String>,
    /// Its column in the run.
    pub column: ColumnIndex<AllVariables>,
    /// Whether its values are equal or not, with nothing in between.
    pub exact: bool,
    /// Whether the scenario names it, so that the recording must have it.
    pub named: bool,
    /// The sizes of the tube.
    pub size: TubeSize,
}

/// Half sizes of the rectangle around each recorded value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TubeSize {
    /// Up and down, in the unit of the signal.
    pub absolute: f64,
    /// Up and down, as a share of the signal's range.
    pub relative: f64,
    /// To both sides [s].
    pub time: f64,
}

impl BaselineSignal {
    /// Factor and offset from the unit of the recording to that of the run.
    ///
    /// # Errors
    /// In words, when they are not of one dimension.
    pub fn conversion_from(&self, recorded: Option<&str>) -> Result<(f64, f64), String> {
        let (from, to) = (recorded.unwrap_or_default(), self.unit.as_deref().unwrap_or_default());
        if from == to {
            return Ok((1.0, 0.0));
        }
        let units = Unit::parse(from).ok().zip(Unit::parse(to).ok());
        let conversion = units.and_then(|(from, to)| Unit::conversion(&from, &to));
        let named = |unit: &str| match unit {
            "" => "without a unit".to_owned(),
            unit => format!("in [{unit}]"),
        };
        conversion.ok_or_else(|| format!("it was recorded {}, and is {} now", named(from), named(to)))
    }
}
