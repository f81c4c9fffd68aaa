//! Reads what a file says of itself: its version, its start, its groups of channels.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::bytes::{FileByteReader, MdfBlock};
use crate::channels::{ChannelReader, GroupNameAndIndex};
use crate::error::Error;
use crate::identification::{EMPTY_ROWS, FileIdentification};
use crate::layout::{ChannelGroup, FileStructure, MasterAxis, MdfClock, StartTime};
use crate::mdf3;
use crate::stream::{BlockListOptions, list_data_blocks};
use crate::text::read_text_block;

/// The longest record [B].
const RECORD: usize = 64 << 20;

/// What a file says of itself.
pub(crate) fn read_file_structure(bytes: &mut FileByteReader) -> Result<FileStructure, Error> {
    let identification = FileIdentification::read(bytes)?;
    if identification.version < 400 {
        return mdf3::read_mdf3_structure(bytes, &identification);
    }
    let header = bytes.read_block(64, &[b"##HD"])?;
    let mut structure = identification.empty_structure();
    structure.comment = read_text_block(bytes, header.link_at(5))?;
    let nanoseconds = header.u64_at(0)?;
    if nanoseconds != 0 {
        structure.start = Some(StartTime { nanoseconds, is_local: header.u8_at(12)? & 1 != 0 });
    }
    let mut reader = StructureReader {
        structure,
        seen: HashSet::new(),
        channels: ChannelReader::default(),
        at: HashMap::new(),
        remote: Vec::new(),
    };
    let mut at = header.link_at(0);
    while at != 0 {
        let block = reader.read_chained_block(bytes, at, b"##DG", "groups of data")?;
        reader.read_data_group(bytes, &block)?;
        at = block.link_at(0);
    }
    reader.assign_clocks(bytes)
}

struct StructureReader {
    structure: FileStructure,
    /// Blocks of chains that were read.
    seen: HashSet<u64>,
    channels: ChannelReader,
    /// Groups by their block.
    at: HashMap<u64, usize>,
    /// For each group the block of the group that has its master.
    remote: Vec<u64>,
}

/// A block CG.
struct GroupBlock {
    block: MdfBlock,
    number: u64,
    flags: u16,
    values: usize,
    invalid: usize,
}

impl StructureReader {
    /// The next block of a chain, which must not have been there before.
    fn read_chained_block(
        &mut self,
        bytes: &mut FileByteReader,
        at: u64,
        id: &[u8; 4],
        what: &str,
    ) -> Result<MdfBlock, Error> {
        if !self.seen.insert(at) {
            return Err(Error::new(at, format!("expected {what} that end, found a circle")));
        }
        bytes.read_block(at, &[id])
    }

    /// A block DG: groups of channels with common data.
    fn read_data_group(&mut self, bytes: &mut FileByteReader, data: &MdfBlock) -> Result<(), Error> {
        let number_bytes = data.u8_at(0)?;
        if !matches!(number_bytes, 0 | 1 | 2 | 4 | 8) {
            let text = format!("expected record numbers of 0, 1, 2, 4 or 8 bytes, found {number_bytes}");
            return Err(Error::new(data.at, text));
        }
        let (mut all, mut at) = (Vec::new(), data.link_at(1));
        while at != 0 {
            let block = self.read_chained_block(bytes, at, b"##CG", "groups of channels")?;
            at = block.link_at(0);
            all.push(group_block(block)?);
        }
        if number_bytes == 0 && all.len() > 1 {
            let text = format!("expected one group in data without record numbers, found {}", all.len());
            return Err(Error::new(data.at, text));
        }
        let is_variable = |it: &&GroupBlock| it.flags & 1 != 0;
        let length = |it: &GroupBlock| (it.flags & 1 == 0).then_some(it.values + it.invalid);
        let mixed: HashMap<_, _> = all.iter().map(|it| (it.number, length(it))).collect();
        if mixed.len() < all.len() {
            let text = "expected groups with record numbers of their own, found a number twice";
            return Err(Error::new(data.at, text));
        }
        let variable = all.iter().filter(is_variable).map(|it| (it.block.at, it.number)).collect();
        let (mixed, variable) = (Arc::new(mixed), Arc::new(variable));
        for group_block in all.iter().filter(|it| !is_variable(it)) {
            let rows = group_block.block.u64_at(8)?;
            if group_block.values + group_block.invalid == 0 && number_bytes == 0 && rows > EMPTY_ROWS {
                let text = format!("expected at most {EMPTY_ROWS} rows without data, found {rows}");
                return Err(Error::new(group_block.block.at, text));
            }
            let group = ChannelGroup {
                data: data.link_at(2),
                raw: None,
                number_bytes: number_bytes.into(),
                number: group_block.number,
                mixed: Arc::clone(&mixed),
                variable: Arc::clone(&variable),
                values: group_block.values,
                invalid: group_block.invalid,
                rows: Some(rows),
            };
            self.read_channel_group(bytes, group, group_block)?;
        }
        Ok(())
    }

    /// A group with its channels.
    fn read_channel_group(
        &mut self,
        bytes: &mut FileByteReader,
        group: ChannelGroup,
        group_block: &GroupBlock,
    ) -> Result<(), Error> {
        let block = &group_block.block;
        let name = match read_text_block(bytes, block.link_at(2))? {
            Some(name) => Some(name),
            None if block.link_at(3) != 0 => {
                let source = bytes.read_block(block.link_at(3), &[b"##SI"])?;
                read_text_block(bytes, source.link_at(0))?
            }
            None => None,
        };
        let index = self.structure.groups.len();
        self.at.insert(block.at, index);
        self.remote.push(if group_block.flags & 8 != 0 { block.link_at(6) } else { 0 });
        self.structure.groups.push(group);
        let (first, text) = (block.link_at(1), GroupNameAndIndex { name: name.unwrap_or_default(), index });
        self.channels.read_channels(bytes, first, &text, &mut self.structure)
    }

    /// Gives each channel its clock.
    fn assign_clocks(mut self, bytes: &mut FileByteReader) -> Result<FileStructure, Error> {
        if self.structure.uncounted {
            self.count_rows(bytes)?;
        }
        let groups = &self.structure.groups;
        // A group with its master elsewhere has the clock of that group, if it has its rows.
        let home = |group: usize| {
            let other = self.at.get(&self.remote[group]).copied();
            other
                .filter(|it| self.remote[*it] == 0 && groups[*it].rows == groups[group].rows)
                .unwrap_or(group)
        };
        let homes: Vec<_> = (0..groups.len()).map(home).collect();
        let mut clocks = vec![usize::MAX; groups.len()];
        for (group, it) in groups.iter().enumerate().filter(|(group, _)| homes[*group] == *group) {
            clocks[group] = self.structure.clocks.len();
            self.structure.clocks.push(MdfClock { master: None, axis: MasterAxis::Index, rows: it.rows });
        }
        for (place, channel) in self.structure.channels.iter_mut().enumerate() {
            channel.clock = clocks[homes[channel.group_index]];
            let Some(axis) = self.channels.masters.get(&place) else { continue };
            let clock = &mut self.structure.clocks[channel.clock];
            // Of several masters the time counts.
            if clock.master.is_none() || (*axis == MasterAxis::Time && clock.axis != MasterAxis::Time) {
                (clock.master, clock.axis) = (Some(place), *axis);
            }
        }
        for (index, clock) in self.structure.clocks.iter().enumerate() {
            if let Some(master) = clock.master {
                let channel = &mut self.structure.channels[master];
                debug_assert_eq!(channel.clock, index);
                channel.is_master = true;
            }
        }
        Ok(self.structure)
    }

    /// Counts rows by the data, where the file does not tell them.
    fn count_rows(&mut self, bytes: &mut FileByteReader) -> Result<(), Error> {
        let open_end = self.structure.open_end;
        for group in &mut self.structure.groups {
            if group.has_mixed_records() {
                group.rows = None;
                continue;
            }
            let apart = Some((group.values as u64, group.invalid as u64));
            let found = list_data_blocks(bytes, group.data, &BlockListOptions { open_end, apart })?;
            let record = match found.invalid {
                Some(_) => group.values,
                None => group.number_bytes + group.record_bytes(),
            };
            group.rows = Some(found.values.length.checked_div(record as u64).unwrap_or(0));
        }
        Ok(())
    }
}

fn group_block(block: MdfBlock) -> Result<GroupBlock, Error> {
    let flags = block.u16_at(16)?;
    let (values, invalid) = (block.u32_at(24)? as usize, block.u32_at(28)? as usize);
    // In a group of values of any length these two are one count of bytes.
    let is_variable = flags & 1 != 0;
    if !is_variable && values.saturating_add(invalid) > RECORD {
        let text = format!("expected records of at most {RECORD} bytes, found {values} and {invalid}");
        return Err(Error::new(block.at, text));
    }
    let number = block.u64_at(0)?;
    Ok(GroupBlock { block, number, flags, values, invalid })
}
