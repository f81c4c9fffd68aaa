//! Lists the loggers and programs whose text files are recognised, and what such a file does not say itself.

/// A kind of text file.
#[derive(Debug, PartialEq)]
pub(super) struct LoggerProfile {
    /// Its name, for people.
    pub name: &'static str,
    /// What all of its files have within their first [`HEAD`] bytes, in small letters.
    marks: &'static [&'static str],
    /// The lines between the titles and the rows, where the file has as many of them.
    pub below: &'static [HeaderLine],
    /// Titles of the time that counts when no other is named.
    pub time: &'static [&'static str],
    /// The unit of this time, where the file does not say it.
    pub time_unit: Option<&'static str>,
}

/// What a line between the titles and the rows has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum HeaderLine {
    Units,
    /// The sensor of each column.
    Sources,
    /// The format of the numbers of each column, such as `f8`.
    Types,
}

/// So many bytes tell the profile.
const HEAD: usize = 1 << 12;

const UNITS: &[HeaderLine] = &[HeaderLine::Units];

/// The first one whose marks a file has counts. Layouts are those of public files of each of them.
const PROFILES: [LoggerProfile; 12] = [
    LoggerProfile {
        name: "RaceChrono CSV v3",
        marks: &["racechrono", "format,3"],
        below: &[HeaderLine::Units, HeaderLine::Sources],
        time: &["timestamp", "elapsed_time"],
        time_unit: None,
    },
    // Its titles have unit and source: `Speed (m/s) *gps`.
    LoggerProfile {
        name: "RaceChrono CSV v2",
        marks: &["racechrono", "format,2"],
        below: &[],
        time: &["Time", "Timestamp"],
        time_unit: None,
    },
    LoggerProfile {
        name: "RaceChrono CSV",
        marks: &["created using racechrono"],
        below: UNITS,
        time: &["timestamp", "Timestamp", "Time"],
        time_unit: None,
    },
    LoggerProfile {
        name: "MoTeC i2 CSV",
        marks: &["motec csv file"],
        below: UNITS,
        time: &["Time"],
        time_unit: None,
    },
    LoggerProfile {
        name: "AiM Race Studio CSV",
        marks: &["aim csv file"],
        below: UNITS,
        time: &["Time"],
        time_unit: None,
    },
    LoggerProfile {
        name: "Harry's LapTimer CSV",
        marks: &["harry's", "laptimer", "time_lap"],
        below: &[],
        time: &["TIME", "TIME_LAP"],
        time_unit: None,
    },
    LoggerProfile {
        name: "INCA ASCII",
        marks: &["etasasciiitemfile"],
        below: &[HeaderLine::Types, HeaderLine::Units],
        time: &["time"],
        time_unit: None,
    },
    LoggerProfile {
        name: "rostopic CSV",
        marks: &["%time,field."],
        below: &[],
        time: &["%time"],
        time_unit: Some("ns"),
    },
    LoggerProfile {
        name: "TrackAddict CSV",
        marks: &["racerender data: trackaddict"],
        below: &[],
        time: &["Time"],
        time_unit: None,
    },
    LoggerProfile {
        name: "Torque CSV",
        marks: &["gps time", "device time"],
        below: &[],
        time: &["Device Time", "GPS Time"],
        time_unit: None,
    },
    LoggerProfile {
        name: "Accessport CSV",
        marks: &["ap info:["],
        below: &[],
        time: &["Time"],
        time_unit: None,
    },
    LoggerProfile {
        name: "BlueDriver CSV",
        marks: &["bluedriver data log"],
        below: &[],
        time: &["Time"],
        time_unit: None,
    },
];

/// The profile of a file that begins like this.
pub(super) fn detect_logger_profile(head: &[u8]) -> Option<&'static LoggerProfile> {
    let head = String::from_utf8_lossy(&head[..head.len().min(HEAD)]).to_ascii_lowercase();
    PROFILES.iter().find(|it| it.marks.iter().all(|mark| head.contains(mark)))
}
