//! Says why an MCAP recording cannot be played back.

use std::path::PathBuf;

/// Why an MCAP recording cannot be played back; messages count from 1 in each channel.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be read to its end.
    #[error("cannot read the recording {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// What is in the file cannot have been written like that.
    #[error("the recording {} is damaged: {source}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What the reader says.
        source: ::mcap::McapError,
    },
    /// The file is compressed in a way that is not known here.
    #[error(
        "the recording {} is compressed with {compression}: expected lz4, zstd or none; write it again with one \
         of these, such as `mcap compress --compression lz4`", path.display()
    )]
    Compression {
        /// The file.
        path: PathBuf,
        /// What the file says.
        compression: String,
    },
    /// The scenario names a time that messages do not have.
    #[error(
        "the time of the recording {} is `log_time` or `publish_time`, found `{found}`; it is MCAP, of which no \
         column is the time", path.display()
    )]
    Stamp {
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
        /// The column that was asked for.
        column: String,
        /// The topic.
        topic: String,
    },
    /// Messages of a column's channel are of a kind that cannot be read.
    #[error(
        "`{column}` of {} is in messages of the encoding `{encoding}`, which cannot be read here: expected protobuf \
         or json; convert the topic `{topic}` to one of these, or to CSV", path.display()
    )]
    Encoding {
        /// The file.
        path: PathBuf,
        /// The column that was asked for.
        column: String,
        /// The topic.
        topic: String,
        /// What the file says.
        encoding: String,
    },
    /// A channel does not say what its messages look like.
    #[error("the messages of `{topic}` in {} cannot be read: {what}", path.display())]
    Schema {
        /// The file.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// What is wrong.
        what: String,
    },
    /// What a column names is not a number.
    #[error(
        "`{column}` of {} is {found}: expected a number (or a boolean, or an enumeration)", path.display()
    )]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// The column that was asked for.
        column: String,
        /// What is there.
        found: String,
    },
    /// A channel has nothing to play back.
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
        /// Which of the topic's messages.
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
        /// Which of the topic's messages.
        numbers: [u64; 2],
        /// What was taken as the time.
        stamp: &'static str,
        /// The time stamp [s].
        time: f64,
        /// What else could be taken.
        other: &'static str,
    },
}

impl RecordingError {
    /// The word of the scenario that does not fit the file.
    #[must_use]
    pub fn word(&self) -> Option<&str> {
        match self {
            RecordingError::Stamp { found: word, .. }
            | RecordingError::Ambiguous { column: word, .. }
            | RecordingError::Encoding { column: word, .. }
            | RecordingError::NotANumber { column: word, .. } => Some(word),
            _ => None,
        }
    }
}
