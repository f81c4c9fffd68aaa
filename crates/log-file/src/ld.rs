//! Reads MoTeC `.ld` files, whose layout others found out: a header, a list of channels linked by addresses, and a block of numbers for
//! each channel.
//!
//! Header: `40 00 00 00`; at 8 the address of the first channel. Channel, little endian: addresses of the previous and the next one, of its
//! numbers, their count (4 bytes each); 2 bytes; class and size of a number, rate [Hz], offset, factor, divisor, decimals (2 bytes each); name
//! (32 bytes), short name (8), unit (12). Value = (number / divisor / 10^decimals + offset) * factor, where a factor or divisor of 0 means 1:
//! devices of the series M1 leave them so.

mod writer;

use std::collections::HashSet;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

use crate::{
    CHUNK_ROWS, ChannelKind, ChannelValues, ChunkCallback, ClockTime, Error, LogChannel, LogClock, LogReader,
    decode_text, find_or_add_clock, parse_logger_unit,
};
pub use writer::{LdChannel, LdSession, LdWriter, ld_names};

/// Whether a file begins like this.
pub fn is_ld(head: &[u8]) -> bool {
    head.starts_with(&[0x40, 0, 0, 0, 0, 0, 0, 0]) && head.len() >= HEADER
}

/// Bytes of the header that are looked at, and those of a channel [B].
const HEADER: usize = 16;
const CHANNEL: usize = 84;
/// Bytes from one channel to the next, as files have them [B].
const CHANNEL_BLOCK: usize = 124;

/// A MoTeC file.
pub struct LdLog {
    file: File,
    channels: Vec<LogChannel>,
    clocks: Vec<LogClock>,
    blocks: Vec<SampleBlock>,
    left_out: Vec<String>,
    warnings: Vec<String>,
    /// Channels with a factor or divisor of 0.
    unscaled: Vec<String>,
}

/// Where the numbers of a channel are, and what they mean.
#[derive(Clone, Copy)]
struct SampleBlock {
    at: u64,
    number: SampleFormat,
    divisor: f64,
    offset: f64,
    factor: f64,
}

/// How a number is stored.
#[derive(Clone, Copy)]
enum SampleFormat {
    I16,
    I32,
    F16,
    F32,
    F64,
}

impl SampleFormat {
    /// The storage of a class and a size: 0, 3, 5 and 6 are integers, 7 and 8 are floating point.
    fn from_class_and_size(class: u16, size: u16) -> Option<Self> {
        match (class, size) {
            (0 | 3 | 5 | 6, 2) => Some(Self::I16),
            (0 | 3 | 5 | 6, 4) => Some(Self::I32),
            (7, 2) => Some(Self::F16),
            (7, 4) => Some(Self::F32),
            (7 | 8, 8) => Some(Self::F64),
            _ => None,
        }
    }

    fn size_in_bytes(self) -> usize {
        match self {
            Self::I16 | Self::F16 => 2,
            Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn decode_sample(self, bytes: &[u8]) -> f64 {
        let two = || [bytes[0], bytes[1]];
        let four = || [bytes[0], bytes[1], bytes[2], bytes[3]];
        match self {
            Self::I16 => f64::from(i16::from_le_bytes(two())),
            Self::I32 => f64::from(i32::from_le_bytes(four())),
            Self::F16 => half::f16::from_le_bytes(two()).to_f64(),
            Self::F32 => f64::from(f32::from_le_bytes(four())),
            Self::F64 => bytes.try_into().map_or(f64::NAN, f64::from_le_bytes),
        }
    }
}

impl LdLog {
    /// Reads the list of channels.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut file = File::open(path)?;
        let length = file.metadata()?.len();
        let mut header = [0; HEADER];
        file.read_exact(&mut header)?;
        let mut ld = LdLog {
            file,
            channels: vec![],
            clocks: vec![],
            blocks: vec![],
            left_out: vec![],
            warnings: vec![],
            unscaled: vec![],
        };
        let (mut next, mut seen) = (u32_at(&header, 8), HashSet::new());
        while next != 0 {
            if !seen.insert(next) {
                ld.warnings.push(format!("the list of channels goes in a circle at byte {next}"));
                break;
            }
            if u64::from(next) + CHANNEL as u64 > length {
                let found = ld.channels.len();
                let what = "the list of channels leads behind the end of the file, to byte";
                ld.warnings.push(format!("{what} {next}: {found} channels before it are read"));
                break;
            }
            let mut bytes = [0; CHANNEL];
            ld.file.seek(SeekFrom::Start(next.into()))?;
            ld.file.read_exact(&mut bytes)?;
            ld.add_channel(&bytes, length);
            next = u32_at(&bytes, 4);
        }
        match ld.channels.is_empty() {
            false => Ok(ld),
            true => {
                let notes = [ld.left_out, ld.warnings].concat().join("; ");
                Err(Error::new(format!("expected channels in the MoTeC file, found none {notes}")))
            }
        }
    }

    /// Adds a channel, or says why it is left out.
    fn add_channel(&mut self, bytes: &[u8; CHANNEL], length: u64) {
        let at = u64::from(u32_at(bytes, 8));
        let [class, size, rate] = [18, 20, 22].map(|at| u16_at(bytes, at));
        let [offset, factor, divisor, decimals] = [24, 26, 28, 30].map(|at| u16_at(bytes, at) as i16);
        let name = decode_text(&bytes[32..64]);
        let Some(number) = SampleFormat::from_class_and_size(class, size) else {
            let what = format!("numbers of class {class} and {size} bytes, which is unknown here");
            return self.left_out.push(format!("`{name}` is left out: it has {what}"));
        };
        if rate == 0 {
            return self.left_out.push(format!("`{name}` is left out: its rate is 0"));
        }
        if factor == 0 || divisor == 0 {
            self.unscaled.push(name.clone());
        }
        let or_one = |it: i16| if it == 0 { 1 } else { it };
        let [factor, divisor] = [factor, divisor].map(or_one);
        let stated = u64::from(u32_at(bytes, 12));
        let rows = stated.min(length.saturating_sub(at) / number.size_in_bytes() as u64);
        if rows < stated {
            let what = format!("{rows} of {stated} values, the file ends behind them");
            self.warnings.push(format!("`{name}` has {what}"));
        }
        let clock = find_or_add_clock(&mut self.clocks, ClockTime::Rate(rate.into()), Some(rows));
        let (group, unit) = (String::new(), parse_logger_unit(&decode_text(&bytes[72..84])));
        self.channels.push(LogChannel { name, group, unit, clock, kind: ChannelKind::Number });
        let divisor = f64::from(divisor) * 10f64.powi(decimals.into());
        let [offset, factor] = [offset, factor].map(f64::from);
        self.blocks.push(SampleBlock { at, number, divisor, offset, factor });
    }
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

impl LogReader for LdLog {
    fn channels(&self) -> &[LogChannel] {
        &self.channels
    }

    fn clocks(&self) -> &[LogClock] {
        &self.clocks
    }

    fn read_chunks(&mut self, clock: usize, wanted: &[usize], take: ChunkCallback) -> Result<(), Error> {
        let rows = self.clocks[clock].rows.unwrap_or(0);
        let mut bytes = Vec::new();
        for first in (0..rows).step_by(CHUNK_ROWS) {
            let count = (rows - first).min(CHUNK_ROWS as u64) as usize;
            let mut stretch = Vec::with_capacity(wanted.len());
            for channel in wanted {
                let SampleBlock { at, number, divisor, offset, factor } = self.blocks[*channel];
                bytes.resize(count * number.size_in_bytes(), 0);
                self.file.seek(SeekFrom::Start(at + first * number.size_in_bytes() as u64))?;
                self.file.read_exact(&mut bytes)?;
                let value = |it: &[u8]| (number.decode_sample(it) / divisor + offset) * factor;
                stretch.push(ChannelValues::Numbers(
                    bytes.chunks_exact(number.size_in_bytes()).map(value).collect(),
                ));
            }
            if !take(&stretch) {
                break;
            }
        }
        Ok(())
    }

    fn skipped_contents(&self) -> Vec<String> {
        self.left_out.clone()
    }

    fn warnings(&self) -> Vec<String> {
        let unscaled = self.unscaled.first().map(|first| {
            let more = match self.unscaled.len() - 1 {
                0 => "has".to_owned(),
                more => format!("and {more} more have"),
            };
            format!("`{first}` {more} a factor or divisor of 0, which is read as 1")
        });
        self.warnings.iter().cloned().chain(unscaled).collect()
    }
}
