//! Chooses the time stamp of a topic: header, log or publish time.

use std::path::Path;

use ::mcap::records::MessageHeader;

use super::RecordingError;

/// The time stamp that counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeSource {
    /// When it was measured, as the message says: `header.stamp`, or `stamp`.
    Header,
    /// When it was recorded.
    Log,
    /// When it was published.
    Publish,
}

impl TimeSource {
    /// Nothing where each topic has the one that fits it.
    pub fn parse(path: &Path, word: Option<&str>) -> Result<Option<Self>, RecordingError> {
        match word {
            None => Ok(None),
            Some("header.stamp") => Ok(Some(TimeSource::Header)),
            Some("log_time") => Ok(Some(TimeSource::Log)),
            Some("publish_time") => Ok(Some(TimeSource::Publish)),
            Some(found) => Err(RecordingError::TimeSource { path: path.to_owned(), found: found.to_owned() }),
        }
    }

    /// Its name, and that of another one.
    pub fn name_and_alternative(self) -> (&'static str, &'static str) {
        match self {
            TimeSource::Header => ("header.stamp", "log_time"),
            TimeSource::Log => ("log_time", "publish_time"),
            TimeSource::Publish => ("publish_time", "log_time"),
        }
    }
}

/// All times of a row [ns].
#[derive(Debug, Clone, Copy)]
pub struct MessageTimes {
    pub log: i128,
    pub publish: i128,
    /// When it was measured, if it says so.
    pub header: Option<i128>,
}

impl MessageTimes {
    pub fn new(header: &MessageHeader, measured: Option<i128>) -> Self {
        MessageTimes { log: header.log_time.into(), publish: header.publish_time.into(), header: measured }
    }

    pub fn get(&self, stamp: TimeSource) -> Option<i128> {
        match stamp {
            TimeSource::Header => self.header,
            TimeSource::Log => Some(self.log),
            TimeSource::Publish => Some(self.publish),
        }
    }
}

/// A clock that is further away than this from that of the recorder is another one [ns]: of a simulation, of a sensor, or not set at all.
const NEAR: i128 = 1_000_000_000;

/// Judges, one row after another, whether the times of measurement can be those of a topic beside others that have none.
#[derive(Debug, Clone, Default)]
pub struct HeaderStampCheck {
    rows: u64,
    missing: bool,
    last: Option<i128>,
    /// The least and the most that they are before those of the recorder [ns].
    range: Option<(i128, i128)>,
    /// The rows of the first two that are the same, one behind the other.
    repeated: Option<[u64; 2]>,
}

impl HeaderStampCheck {
    pub fn add_row(&mut self, times: &MessageTimes) {
        self.rows += 1;
        let Some(header) = times.header else {
            self.missing = true;
            return;
        };
        if self.last == Some(header) {
            self.repeated.get_or_insert([self.rows - 1, self.rows]);
        }
        self.last = Some(header);
        let before = times.log - header;
        self.range = Some(match self.range {
            None => (before, before),
            Some((least, most)) => (least.min(before), most.max(before)),
        });
    }

    /// What speaks against them; nothing where they count.
    pub fn rejection_reason(&self) -> Option<String> {
        let (least, most) = self.range?;
        if self.missing {
            return Some("some messages have none".to_owned());
        }
        let far = if most > -least { most } else { least };
        if far.abs() > NEAR {
            let far = far as f64 / 1e9;
            let away = if far > 0.0 { "before" } else { "after" };
            return Some(format!("they are up to {:.3} s {away} log_time, so of another clock", far.abs()));
        }
        let [first, second] = self.repeated?;
        Some(format!("messages {first} and {second} have the same"))
    }

    /// Whether they count.
    pub fn is_accepted(&self) -> bool {
        self.range.is_some() && self.rejection_reason().is_none()
    }

    /// The least and the most that they are before those of the recorder [s].
    pub fn recorder_delay_range(&self) -> Option<(f64, f64)> {
        self.range.map(|(least, most)| (least as f64 / 1e9, most as f64 / 1e9))
    }
}
