//! Writes rows as a MoTeC `.ld` file for i2: a header, a block for each channel, and the numbers of each channel in one piece.
//!
//! The places of the header's blocks are those that MoTeC's own devices use; what others found out of the header is filled in. The numbers of all
//! channels grow at once: each channel has room for the most rows there may be, which is closed at the end where fewer came.

use std::collections::HashSet;
use std::fs::File;
use std::os::unix::fs::FileExt as _;
use std::path::Path;

use super::CHANNEL_BLOCK;
use crate::Error;

/// What a file says about its drive. A text that is too long for its field is cut, at 63 letters, the comment at 1023.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LdSession {
    /// The driver.
    pub driver: String,
    /// The vehicle.
    pub vehicle: String,
    /// The place, such as a track.
    pub venue: String,
    /// The event that the drive belongs to.
    pub event: String,
    /// Its part of the event.
    pub session: String,
    /// Anything else.
    pub comment: String,
}

/// A channel that is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LdChannel {
    /// Its name, of at most [`LdWriter::NAME`] letters.
    pub name: String,
    /// Its unit, such as `m/s^2`; it gets MoTeC's word for it.
    pub unit: String,
    /// Whether its numbers are integers of 32 bits with a sign; else they are floating point of 32 bits.
    pub is_integer: bool,
}

/// Writes rows as a file.
pub struct LdWriter {
    file: File,
    integers: Vec<bool>,
    /// Rows that there is room for, those that were written and those that wait.
    room: u32,
    written: u32,
    waiting: u32,
    /// The numbers of each channel that wait.
    numbers: Vec<Vec<u8>>,
}

/// Places of blocks [B].
const EVENT: usize = 0x6e2;
const VENUE: usize = 0x1336;
const VEHICLE: usize = 0x1f54;
const CHANNELS: usize = 0x3448;

/// Bytes of a number, of either kind.
const NUMBER: u64 = 4;
/// Rows that wait before they are written together.
const BATCH: u32 = 1024;

impl LdWriter {
    /// The most letters of a name: its field has 32 bytes, and a zero behind the name.
    pub const NAME: usize = 31;

    /// Begins a file of at most so many rows, which follow each other at a rate [Hz].
    ///
    /// # Errors
    /// When it cannot be written, or would be longer than its addresses reach, 4 GiB.
    pub fn create(
        path: &Path,
        session: &LdSession,
        channels: &[LdChannel],
        rate: u16,
        rows: u32,
    ) -> Result<Self, Error> {
        let data = CHANNELS + channels.len() * CHANNEL_BLOCK;
        let end = data as u64 + channels.len() as u64 * u64::from(rows) * NUMBER;
        if end > u32::MAX.into() {
            return Err(Error::new(format!(
                "expected at most 4 GiB of a MoTeC file, found {} channels of {rows} rows, {end} bytes: leave some out",
                channels.len()
            )));
        }
        let mut head = ld_file_header(session, channels.len());
        for (place, channel) in channels.iter().enumerate() {
            head.extend(ld_channel_block(channel, place, channels.len(), rate));
        }
        let file = File::options().read(true).write(true).create(true).truncate(true).open(path)?;
        file.write_all_at(&head, 0)?;
        Ok(Self {
            file,
            integers: channels.iter().map(|it| it.is_integer).collect(),
            room: rows,
            written: 0,
            waiting: 0,
            numbers: vec![Vec::new(); channels.len()],
        })
    }

    /// Takes a row: a number for each channel. Integers are rounded, and cut at the ends of 32 bits.
    ///
    /// # Errors
    /// When there is no room for it, or rows cannot be written.
    pub fn write_row(&mut self, values: impl IntoIterator<Item = f64>) -> Result<(), Error> {
        if self.written + self.waiting >= self.room {
            return Err(Error::new(format!("expected at most {} rows, found more", self.room)));
        }
        for ((numbers, is_integer), value) in self.numbers.iter_mut().zip(&self.integers).zip(values) {
            match is_integer {
                true => numbers.extend((value.round() as i32).to_le_bytes()),
                false => numbers.extend((value as f32).to_le_bytes()),
            }
        }
        self.waiting += 1;
        if self.waiting >= BATCH { self.flush_rows() } else { Ok(()) }
    }

    fn flush_rows(&mut self) -> Result<(), Error> {
        for (place, numbers) in self.numbers.iter_mut().enumerate() {
            let at =
                channel_data_offset(self.integers.len(), place, self.room) + u64::from(self.written) * NUMBER;
            self.file.write_all_at(numbers, at)?;
            numbers.clear();
        }
        self.written += std::mem::take(&mut self.waiting);
        Ok(())
    }

    /// Writes the rows that wait, and closes the room that is left.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn finish(mut self) -> Result<(), Error> {
        self.flush_rows()?;
        let channels = self.integers.len();
        let mut bytes = vec![0; 1 << 20];
        for place in 0..channels {
            let [from, to] = [self.room, self.written].map(|rows| channel_data_offset(channels, place, rows));
            let (mut done, length) = (0, u64::from(self.written) * NUMBER);
            while done < length && from != to {
                let part = &mut bytes[..(length - done).min(1 << 20) as usize];
                self.file.read_exact_at(part, from + done)?;
                self.file.write_all_at(part, to + done)?;
                done += part.len() as u64;
            }
            let block = (CHANNELS + place * CHANNEL_BLOCK) as u64;
            self.file.write_all_at(&(to as u32).to_le_bytes(), block + 8)?;
            self.file.write_all_at(&self.written.to_le_bytes(), block + 12)?;
        }
        Ok(self.file.set_len(channel_data_offset(channels, channels, self.written))?)
    }
}

/// Where the numbers of a channel begin, when each has room for so many rows.
fn channel_data_offset(channels: usize, place: usize, rows: u32) -> u64 {
    (CHANNELS + channels * CHANNEL_BLOCK) as u64 + place as u64 * u64::from(rows) * NUMBER
}

/// Puts a text into its field, Latin-1 with a zero behind it.
fn put_text(all: &mut [u8], at: usize, length: usize, text: &str) {
    let bytes = text.chars().map(|it| u8::try_from(it).unwrap_or(b'?'));
    all[at..at + length - 1].iter_mut().zip(bytes).for_each(|(to, byte)| *to = byte);
}

/// All in front of the channels.
fn ld_file_header(session: &LdSession, channels: usize) -> Vec<u8> {
    let mut all = vec![0; CHANNELS];
    let data = CHANNELS + channels * CHANNEL_BLOCK;
    // The version of the device, 4.20, and what is always there: ticks in a second, an unknown one, and a mark without which i2 Pro does not
    // open a file, all as other writers have them.
    let numbers = [
        (0, 0x40),
        (8, CHANNELS as u32),
        (12, data as u32),
        (0x24, EVENT as u32),
        (0x42, 1_000_000),
        (0x46, 8004),
        (0x52, 0x0080_01a4),
        (0x56, channels as u32),
        (0x5a, 0x0001_0064),
        (0x5de, 0x000c_81a4),
        (EVENT + 1152, VENUE as u32),
        (VENUE + 1098, VEHICLE as u32),
    ];
    for (at, number) in numbers {
        all[at..at + 4].copy_from_slice(&number.to_le_bytes());
    }
    // A run has no date.
    let texts = [
        (0x4a, 8, "ADL"),
        (0x5e, 16, "01/01/1970"),
        (0x7e, 16, "00:00:00"),
        (0x9e, 64, &*session.driver),
        (0xde, 64, &*session.vehicle),
        (0x15e, 64, &*session.venue),
        (0x5e4, 64, &*session.session),
        (0x624, 64, &*session.comment),
        (EVENT, 64, &*session.event),
        (EVENT + 64, 64, &*session.session),
        (EVENT + 128, 1024, &*session.comment),
        (VENUE, 64, &*session.venue),
        (VEHICLE, 64, &*session.vehicle),
    ];
    for (at, length, text) in texts {
        put_text(&mut all, at, length, text);
    }
    all
}

/// The block of a channel, yet without the place and the count of its numbers.
fn ld_channel_block(channel: &LdChannel, place: usize, channels: usize, rate: u16) -> Vec<u8> {
    let mut all = vec![0; CHANNEL_BLOCK];
    let at = |place: usize| (CHANNELS + place * CHANNEL_BLOCK) as u32;
    let before = if place > 0 { at(place - 1) } else { 0 };
    let next = if place + 1 < channels { at(place + 1) } else { 0 };
    all[..4].copy_from_slice(&before.to_le_bytes());
    all[4..8].copy_from_slice(&next.to_le_bytes());
    // A number of the channel, then class and size of its numbers, rate, offset, factor, divisor, decimals.
    let class = if channel.is_integer { 5 } else { 7 };
    let numbers = [0x2ee1 + place as u16, class, NUMBER as u16, rate, 0, 1, 1, 0];
    for (at, number) in numbers.into_iter().enumerate() {
        all[16 + 2 * at..][..2].copy_from_slice(&number.to_le_bytes());
    }
    put_text(&mut all, 32, 32, &channel.name);
    put_text(&mut all, 64, 8, &channel.name);
    put_text(&mut all, 72, 12, motec_unit(&channel.unit));
    all
}

/// MoTeC's word for a unit.
fn motec_unit(unit: &str) -> &str {
    match unit {
        "m/s2" | "m/s^2" | "m/s²" => "m/s/s",
        "rad/s2" | "rad/s^2" | "rad/s²" => "rad/s/s",
        "g0" => "G",
        "degC" | "°C" => "C",
        "degF" | "°F" => "F",
        "°" => "deg",
        "°/s" => "deg/s",
        "N.m" | "N*m" | "N m" => "Nm",
        "1" => "",
        other => other,
    }
}

/// Names that fit a file: those that are too long keep their end, which says most, and no two are the same.
#[must_use]
pub fn ld_names(names: &[String]) -> Vec<String> {
    let fits = |it: &&String| it.chars().count() <= LdWriter::NAME;
    let mut taken: HashSet<String> = names.iter().filter(fits).map(|it| it.to_lowercase()).collect();
    let short = |name: &String| {
        if fits(&name) {
            return name.clone();
        }
        let end = |letters: usize| -> String {
            let skipped = name.chars().count() - letters;
            name.chars().skip(skipped).collect()
        };
        let found = (1..).map(|turn| match turn {
            1 => end(LdWriter::NAME),
            _ => {
                let number = format!("~{turn}");
                end(LdWriter::NAME - number.len()) + &number
            }
        });
        let mut free = found.filter(|it| taken.insert(it.to_lowercase()));
        free.next().unwrap_or_default()
    };
    names.iter().map(short).collect()
}
