//! Defines the errors of recordings of messages.

use std::path::PathBuf;

use crate::records::RecordDamage;

/// An error in an MCAP recording; messages count from 1 in each channel.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be read to its end.
    #[error("cannot read the recording {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The contents of the file are damaged.
    #[error("the recording {} is damaged: {source}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: RecordDamage,
    },
    /// The compression of the file is unknown.
    #[error(
        "the recording {} is compressed with {compression}: expected lz4, zstd or none; write it again with one \
         of these, such as `mcap compress --compression lz4`", path.display()
    )]
    Compression {
        /// The file.
        path: PathBuf,
        /// The file's word.
        compression: String,
    },
    /// A bag of ROS cannot be read.
    #[error("{}: {what}", path.display())]
    Bag {
        /// The file.
        path: PathBuf,
        /// What was expected, what was found, and what to do.
        what: String,
    },
    /// Messages do not say when they were measured.
    #[error(
        "not every message of `{topic}` in {} has a `header.stamp` or a `stamp`: leave `time` out, and each topic has the one \
         that it has, or say `time = \"log_time\"`", path.display()
    )]
    NoStamp {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
    },
    /// The scenario names a time stamp that messages lack.
    #[error(
        "the time of the recording {} is `header.stamp`, `log_time` or `publish_time`, found `{found}`; no column of it is \
         the time", path.display()
    )]
    TimeSource {
        /// The file.
        path: PathBuf,
        /// The word of the scenario.
        found: String,
    },
    /// Two channels have the topic of a column.
    #[error("`{column}` can be in either of two channels of {} with the topic `{topic}`; give them different topics", path.display())]
    Ambiguous {
        /// The file.
        path: PathBuf,
        /// The column of the scenario.
        column: String,
        /// The topic.
        topic: String,
    },
    /// The encoding of a column's channel is unknown.
    #[error(
        "`{column}` of {} is in messages of the encoding `{encoding}`, which cannot be read here: expected cdr, \
         ros1, protobuf or json; convert the topic `{topic}` to one of these, or to CSV", path.display()
    )]
    Encoding {
        /// The file.
        path: PathBuf,
        /// The column of the scenario.
        column: String,
        /// The topic.
        topic: String,
        /// The file's word.
        encoding: String,
    },
    /// The schema of a channel is missing or wrong.
    #[error("the messages of `{topic}` in {} cannot be read: {what}", path.display())]
    Schema {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// What is wrong.
        what: String,
    },
    /// A column names something other than a number.
    #[error(
        "`{column}` of {} is {found}: expected a number (or a boolean, or an enumeration)", path.display()
    )]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// The column of the scenario.
        column: String,
        /// The value in its place.
        found: String,
    },
    /// A channel has no message.
    #[error("there is no message of `{topic}` in {}", path.display())]
    Silent {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
    },
    /// A message cannot be read, or has no number where others have one.
    #[error("message {number} of `{topic}` in {}: {what}", path.display())]
    Message {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The number of the message in its topic.
        number: u64,
        /// What is wrong.
        what: String,
    },
    /// Two messages of a channel have the same time stamp.
    #[error(
        "messages {} and {} of `{topic}` in {} have the same {stamp} {time} s; remove repeated messages or take \
         time = \"{other}\"", numbers[0], numbers[1], path.display()
    )]
    Repeated {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The number of the message in its topic.
        numbers: [u64; 2],
        /// The time stamp in use.
        stamp: &'static str,
        /// The time stamp [s].
        time: f64,
        /// The other time stamp.
        other: &'static str,
    },
}

impl RecordingError {
    /// The word of the scenario that does not fit the file.
    #[must_use]
    pub fn offending_word(&self) -> Option<&str> {
        match self {
            RecordingError::TimeSource { found: word, .. }
            | RecordingError::Ambiguous { column: word, .. }
            | RecordingError::Encoding { column: word, .. }
            | RecordingError::NotANumber { column: word, .. } => Some(word),
            _ => None,
        }
    }
}
