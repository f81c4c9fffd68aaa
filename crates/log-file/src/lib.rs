//! Reads logs of data loggers, and writes those of MoTeC ([`LdWriter`]): a file goes in, channels over their clocks come out, a stretch of rows at a time.
//!
//! The format is told by the contents, never by the name: MDF 2 to 4, MoTeC `.ld`, VBOX `.vbo`, Parquet, Arrow (Feather), MAT. A reader holds no
//! more than a stretch of the wanted channels, whatever the size of the file; a MAT file, which may be packed as a whole, is held in memory and
//! may have at most [`mat_file::LIMIT`] bytes. What a damaged file says of sizes is held against the bytes that are there.
//!
//! ```
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("drive.vbo");
//! # std::fs::write(&path, "[header]\ntime\nvelocity kmh\n[column names]\ntime velocity\n[data]\n120000.00 36.0\n120000.10 37.0\n")?;
//! let mut log = log_file::LogFile::open(&path)?.expect("a log");
//! assert_eq!(log.channels()[1].unit.as_deref(), Some("km/h"));
//! let speed = log.read_all_rows(&[1])?;
//! assert_eq!(speed[0].number_at(0), Some(36.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod arrays;
mod arrow;
mod ld;
mod mat;
mod mdf;
mod panic_guard;
mod parquet;
mod vbo;

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

pub use ld::{LdChannel, LdSession, LdWriter, ld_names};
pub use mdf_file::ChannelValues;

/// A channel of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogChannel {
    /// Its name, as in the file.
    pub name: String,
    /// The group that it stands in; empty where a format has none.
    pub group: String,
    /// Its unit, as the file writes it.
    pub unit: Option<String>,
    /// The clock that its rows have, an index into [`LogReader::clocks`].
    pub clock: usize,
    /// What its values are.
    pub kind: ChannelKind,
}

/// What the values of a channel are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelKind {
    /// Numbers.
    Number,
    /// Texts.
    Text,
    /// Points of time as integers: so many in a second, counted from 1970 or from any other time.
    Stamp(i64),
}

/// What the rows of some channels have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct LogClock {
    /// Where their times are.
    pub time: ClockTime,
    /// The number of rows, where the file tells it before it is read.
    pub rows: Option<u64>,
}

/// The times of rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClockTime {
    /// The file does not tell: the user names the channel.
    Unknown,
    /// The values of this channel.
    Channel(usize),
    /// Row k is at k over this rate [Hz].
    Rate(f64),
}

/// Rows that a reader hands over at once.
pub const CHUNK_ROWS: usize = 1 << 14;

/// Takes a stretch of rows, the wanted channels in their order, and says whether it wants more.
pub type ChunkCallback<'t> = &'t mut dyn FnMut(&[ChannelValues]) -> bool;

/// The reader of one format.
pub trait LogReader {
    /// The channels, in the order of the file.
    fn channels(&self) -> &[LogChannel];

    /// The clocks that the channels refer to.
    fn clocks(&self) -> &[LogClock];

    /// Hands over the rows of some channels, all of one clock, in stretches of about [`CHUNK_ROWS`] rows.
    ///
    /// # Errors
    /// When the file cannot be read or is damaged where these channels are.
    fn read_chunks(&mut self, clock: usize, wanted: &[usize], take: ChunkCallback) -> Result<(), Error>;

    /// What the file has that is no channel, each with the reason.
    fn skipped_contents(&self) -> Vec<String>;

    /// Damage that was found up to now, one sentence each.
    fn warnings(&self) -> Vec<String>;
}

/// A log that is open.
pub struct LogFile {
    /// The name of its format.
    pub format: &'static str,
    source: Box<dyn LogReader>,
}

impl LogFile {
    /// Opens a file; nothing when it has none of these formats.
    ///
    /// # Errors
    /// When it cannot be read, or begins like one of these formats and is none.
    pub fn open(path: &Path) -> Result<Option<Self>, Error> {
        let mut head = Vec::new();
        File::open(path)?.take(HEAD).read_to_end(&mut head)?;
        let (format, source): (_, Box<dyn LogReader>) = match () {
            () if mdf_file::is_mdf(&head) => {
                let file = mdf::MdfLog::open(path)?;
                (file.format_name(), Box::new(file))
            }
            () if ld::is_ld(&head) => ("MoTeC ld", Box::new(ld::LdLog::open(path)?)),
            () if parquet::is_parquet(&head) => ("Parquet", Box::new(parquet::ParquetLog::open(path)?)),
            () if arrow::is_arrow(&head) => ("Arrow", Box::new(arrow::ArrowLog::open(path)?)),
            () if mat_file::is_mat(&head) => ("MAT", Box::new(mat::MatLog::open(path)?)),
            () if vbo::is_vbo(&head) => ("VBOX", Box::new(vbo::VboLog::open(path)?)),
            () => return Ok(None),
        };
        Ok(Some(LogFile { format, source }))
    }

    /// The channels, in the order of the file.
    #[must_use]
    pub fn channels(&self) -> &[LogChannel] {
        self.source.channels()
    }

    /// The clocks of the channels.
    #[must_use]
    pub fn clocks(&self) -> &[LogClock] {
        self.source.clocks()
    }

    /// What the file has that is no channel, each with the reason.
    #[must_use]
    pub fn skipped_contents(&self) -> Vec<String> {
        self.source.skipped_contents()
    }

    /// Damage that was found up to now.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        self.source.warnings()
    }

    /// Hands over the rows of some channels, as [`LogReader::read_chunks`] does.
    ///
    /// # Errors
    /// As there.
    pub fn read_chunks(&mut self, clock: usize, wanted: &[usize], take: ChunkCallback) -> Result<(), Error> {
        self.source.read_chunks(clock, wanted, take)
    }

    /// All rows of some channels of one clock.
    ///
    /// # Errors
    /// As [`LogReader::read_chunks`].
    pub fn read_all_rows(&mut self, wanted: &[usize]) -> Result<Vec<ChannelValues>, Error> {
        let mut all: Vec<ChannelValues> = Vec::new();
        let Some(clock) = wanted.first().and_then(|it| self.channels().get(*it)) else {
            return Ok(all);
        };
        self.source.read_chunks(clock.clock, wanted, &mut |stretch| {
            match all.is_empty() {
                true => all = stretch.to_vec(),
                false => all.iter_mut().zip(stretch).for_each(|(all, more)| all.append(more)),
            }
            true
        })?;
        if all.is_empty() {
            all = wanted.iter().map(|_| ChannelValues::Numbers(Vec::new())).collect();
        }
        Ok(all)
    }
}

/// So many bytes at the beginning tell the format [B].
const HEAD: u64 = 1 << 16;

/// Why a log cannot be read: what was expected, what was found, where, what to do.
#[derive(Debug)]
pub struct Error(String);

impl Error {
    pub(crate) fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Error {}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Self(format!("cannot be read: {error}"))
    }
}

/// The index of a clock with these properties, which is added where there is none.
fn find_or_add_clock(clocks: &mut Vec<LogClock>, time: ClockTime, rows: Option<u64>) -> usize {
    let clock = LogClock { time, rows };
    clocks.iter().position(|it| *it == clock).unwrap_or_else(|| {
        clocks.push(clock);
        clocks.len() - 1
    })
}

/// The text of bytes up to the first zero; what is no UTF-8 is read as Latin-1.
fn decode_text(bytes: &[u8]) -> String {
    let bytes = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    text_encoding::utf8_or_latin1(bytes).trim().to_owned()
}

/// The unit that loggers mean by a word: `G` is the acceleration of gravity, `C` a degree Celsius; none for `(null)`.
fn parse_logger_unit(text: &str) -> Option<String> {
    match text.trim() {
        "" | "(null)" | "null" | "-" => None,
        "G" | "g" => Some("g0".to_owned()),
        "C" => Some("degC".to_owned()),
        "F" => Some("degF".to_owned()),
        other => Some(other.to_owned()),
    }
}
