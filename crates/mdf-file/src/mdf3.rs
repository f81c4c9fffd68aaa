//! Reads what a file of MDF 2 or 3 says of itself: its start, its groups of channels. Its records are read as those of MDF 4 are.
//!
//! Layout by the specification of MDF 3.3 (Vector, ETAS): blocks of two letters, a length and fields at fixed places, linked by
//! addresses of 32 bits; the records of a block DG stand in one piece, each with no number of its group, one in front, or one at both ends.

mod block;
mod channel;
mod conversion;

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::bytes::FileByteReader;
use crate::error::Error;
use crate::identification::{EMPTY_ROWS, FileIdentification};
use crate::layout::{ChannelGroup, FileStructure, MasterAxis, MdfClock, StartTime};
use block::{Mdf3Block, Mdf3BlockReader};

/// What a file says of itself.
pub(crate) fn read_mdf3_structure(
    bytes: &mut FileByteReader,
    identification: &FileIdentification,
) -> Result<FileStructure, Error> {
    let size = bytes.size;
    let mut blocks = Mdf3BlockReader::new(bytes)?;
    let header = blocks.read_block(64, b"HD", 164)?;
    let structure = FileStructure {
        start: read_start_time(&header),
        comment: blocks.read_text_block(header.u32_at(8))?,
        ..identification.empty_structure()
    };
    let mut reader = Mdf3Reader {
        big_values: identification.big_values,
        conversions: HashMap::new(),
        seen: HashSet::new(),
        blocks,
        structure,
        size,
    };
    let mut at = header.u32_at(4);
    while at != 0 {
        let block = reader.read_chained_block(at, b"DG", 24)?;
        reader.read_data_group(&block)?;
        at = block.u32_at(4);
    }
    Ok(reader.structure)
}

/// The start in UTC, since 3.20; before, the local date and time.
fn read_start_time(header: &Mdf3Block) -> Option<StartTime> {
    let nanoseconds = header.u64_at(164);
    if nanoseconds != 0 {
        return Some(StartTime { nanoseconds, is_local: false });
    }
    let numbers = |text: String| -> Option<[i64; 3]> {
        let parts: Vec<_> = text.split(':').map(|it| it.trim().parse().ok()).collect();
        parts.into_iter().collect::<Option<Vec<_>>>()?.try_into().ok()
    };
    let [day, month, year] = numbers(header.text_at(18, 10))?;
    let [hour, minute, second] = numbers(header.text_at(28, 8))?;
    if !(1..=31).contains(&day) || !(1..=12).contains(&month) || !(1970..=2262).contains(&year) {
        return None;
    }
    // Years that begin in March have their leap day at the end (Hinnant, "chrono-compatible low-level date algorithms").
    let year = if month > 2 { year } else { year - 1 };
    let days_in_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let days = year * 365 + year / 4 - year / 100 + year / 400 + days_in_year - 719_468;
    let seconds = days * 86_400 + hour * 3600 + minute * 60 + second;
    let nanoseconds = u64::try_from(seconds).ok()?.checked_mul(1_000_000_000)?;
    Some(StartTime { nanoseconds, is_local: true })
}

struct Mdf3Reader<'b> {
    blocks: Mdf3BlockReader<'b>,
    /// The length of the file [B].
    size: u64,
    /// Whether values without an order of their own have their highest byte first.
    big_values: bool,
    structure: FileStructure,
    /// Blocks of chains that were read.
    seen: HashSet<u32>,
    /// Conversions by their block, or why they cannot be read.
    conversions: HashMap<u32, Result<conversion::UnitConversion, String>>,
}

impl Mdf3Reader<'_> {
    /// The next block of a chain, which must not have been there before.
    fn read_chained_block(&mut self, at: u32, id: &[u8; 2], least: usize) -> Result<Mdf3Block, Error> {
        if !self.seen.insert(at) {
            let name = String::from_utf8_lossy(id);
            let text = format!("expected a chain of blocks {name} that ends, found a circle");
            return Err(Error::new(at.into(), text));
        }
        self.blocks.read_block(at.into(), id, least)
    }

    /// A block DG: groups of channels with common data.
    fn read_data_group(&mut self, data: &Mdf3Block) -> Result<(), Error> {
        let numbers = usize::from(data.u16_at(22));
        if numbers > 2 {
            let text = format!("expected 0, 1 or 2 numbers for each record, found {numbers}");
            return Err(Error::new(data.at, text));
        }
        let (mut all, mut at) = (Vec::new(), data.u32_at(8));
        while at != 0 {
            let group = self.read_chained_block(at, b"CG", 26)?;
            at = group.u32_at(4);
            all.push(group);
        }
        // The number behind a record is a part of it for us.
        let record = |it: &Mdf3Block| usize::from(it.u16_at(20)) + numbers.saturating_sub(1);
        let mixed: HashMap<_, _> =
            all.iter().map(|it| (u64::from(it.u16_at(16) & 0xff), Some(record(it)))).collect();
        if all.len() > 1 && (numbers == 0 || mixed.len() < all.len()) {
            let text = "expected groups with record numbers of their own, found none or one twice";
            return Err(Error::new(data.at, text));
        }
        let mixed = Arc::new(mixed);
        let stated = all.iter().map(|it| u64::from(it.u32_at(22)) * (record(it) + numbers.min(1)) as u64);
        let begin = u64::from(data.u32_at(16));
        let there = self.size.saturating_sub(begin);
        let open = self.structure.uncounted;
        let length = if open { there } else { stated.sum::<u64>().min(there) };
        for block in &all {
            let stride = record(block) + numbers.min(1);
            let rows = match u64::from(block.u32_at(22)) {
                _ if open && all.len() > 1 => None,
                _ if open => Some(there.checked_div(stride as u64).unwrap_or(0)),
                rows if stride == 0 && rows > EMPTY_ROWS => {
                    let text = format!("expected at most {EMPTY_ROWS} rows without data, found {rows}");
                    return Err(Error::new(block.at, text));
                }
                rows => Some(rows),
            };
            self.structure.groups.push(ChannelGroup {
                data: begin,
                raw: Some(length),
                number_bytes: numbers.min(1),
                number: u64::from(block.u16_at(16) & 0xff),
                mixed: Arc::clone(&mixed),
                variable: Arc::default(),
                values: record(block),
                invalid: 0,
                rows,
            });
            self.read_channel_group(block, usize::from(block.u16_at(20)), rows)?;
        }
        Ok(())
    }

    /// A group with its channels, and its clock. The first line of its comment is its name.
    fn read_channel_group(
        &mut self,
        block: &Mdf3Block,
        record: usize,
        rows: Option<u64>,
    ) -> Result<(), Error> {
        let comment = self.blocks.read_text_block(block.u32_at(12))?.unwrap_or_default();
        let name = comment.lines().next().unwrap_or_default().trim().to_owned();
        self.structure.clocks.push(MdfClock { master: None, axis: MasterAxis::Index, rows });
        let mut at = block.u32_at(8);
        while at != 0 {
            let channel = self.read_chained_block(at, b"CN", 218)?;
            self.read_channel(&channel, &name, record)?;
            at = channel.u32_at(4);
        }
        Ok(())
    }
}
