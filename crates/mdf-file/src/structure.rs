//! Reads what a file says of itself: its version, its start, its groups of channels.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::bytes::{Block, Bytes};
use crate::channels::{Channels, GroupText};
use crate::error::Error;
use crate::identification::{EMPTY_ROWS, Identification};
use crate::layout::{Axis, Clock, Group, Start, Structure};
use crate::mdf3;
use crate::stream::{Listing, listed};
use crate::text::text;

/// The longest record [B].
const RECORD: usize = 64 << 20;

/// What a file says of itself.
pub(crate) fn read(bytes: &mut Bytes) -> Result<Structure, Error> {
    let identification = Identification::read(bytes)?;
    if identification.version < 400 {
        return mdf3::read(bytes, &identification);
    }
    let header = bytes.block(64, &[b"##HD"])?;
    let mut structure = identification.structure();
    structure.comment = text(bytes, header.link(5))?;
    let nanoseconds = header.u64(0)?;
    if nanoseconds != 0 {
        structure.start = Some(Start { nanoseconds, is_local: header.u8(12)? & 1 != 0 });
    }
    let mut reader = Reader {
        structure,
        seen: HashSet::new(),
        channels: Channels::default(),
        at: HashMap::new(),
        remote: Vec::new(),
    };
    let mut at = header.link(0);
    while at != 0 {
        let block = reader.next(bytes, at, b"##DG", "groups of data")?;
        reader.data(bytes, &block)?;
        at = block.link(0);
    }
    reader.finish(bytes)
}

struct Reader {
    structure: Structure,
    /// Blocks of chains that were read.
    seen: HashSet<u64>,
    channels: Channels,
    /// Groups by their block.
    at: HashMap<u64, usize>,
    /// For each group the block of the group that has its master.
    remote: Vec<u64>,
}

/// A block CG.
struct GroupBlock {
    block: Block,
    number: u64,
    flags: u16,
    values: usize,
    invalid: usize,
}

impl Reader {
    /// The next block of a chain, which must not have been there before.
    fn next(
        &mut self,
        bytes: &mut Bytes,
        at: u64,
        id: &[u8; 4],
        what: &str,
    ) -> Result<Block, Error> {
        if !self.seen.insert(at) {
            return Err(Error::new(at, format!("expected {what} that end, found a circle")));
        }
        bytes.block(at, &[id])
    }

    /// A block DG: groups of channels with common data.
    fn data(&mut self, bytes: &mut Bytes, data: &Block) -> Result<(), Error> {
        let number_bytes = data.u8(0)?;
        if !matches!(number_bytes, 0 | 1 | 2 | 4 | 8) {
            let text =
                format!("expected record numbers of 0, 1, 2, 4 or 8 bytes, found {number_bytes}");
            return Err(Error::new(data.at, text));
        }
        let (mut all, mut at) = (Vec::new(), data.link(1));
        while at != 0 {
            let block = self.next(bytes, at, b"##CG", "groups of channels")?;
            at = block.link(0);
            all.push(group_block(block)?);
        }
        if number_bytes == 0 && all.len() > 1 {
            let text =
                format!("expected one group in data without record numbers, found {}", all.len());
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
            let rows = group_block.block.u64(8)?;
            if group_block.values + group_block.invalid == 0
                && number_bytes == 0
                && rows > EMPTY_ROWS
            {
                let text = format!("expected at most {EMPTY_ROWS} rows without data, found {rows}");
                return Err(Error::new(group_block.block.at, text));
            }
            let group = Group {
                data: data.link(2),
                raw: None,
                number_bytes: number_bytes.into(),
                number: group_block.number,
                mixed: Arc::clone(&mixed),
                variable: Arc::clone(&variable),
                values: group_block.values,
                invalid: group_block.invalid,
                rows: Some(rows),
            };
            self.group(bytes, group, group_block)?;
        }
        Ok(())
    }

    /// A group with its channels.
    fn group(
        &mut self,
        bytes: &mut Bytes,
        group: Group,
        group_block: &GroupBlock,
    ) -> Result<(), Error> {
        let block = &group_block.block;
        let name = match text(bytes, block.link(2))? {
            Some(name) => Some(name),
            None if block.link(3) != 0 => {
                let source = bytes.block(block.link(3), &[b"##SI"])?;
                text(bytes, source.link(0))?
            }
            None => None,
        };
        let index = self.structure.groups.len();
        self.at.insert(block.at, index);
        self.remote.push(if group_block.flags & 8 != 0 { block.link(6) } else { 0 });
        self.structure.groups.push(group);
        let (first, text) = (block.link(1), GroupText { name: name.unwrap_or_default(), index });
        self.channels.read(bytes, first, &text, &mut self.structure)
    }

    /// Gives each channel its clock.
    fn finish(mut self, bytes: &mut Bytes) -> Result<Structure, Error> {
        if self.structure.uncounted {
            self.count(bytes)?;
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
            self.structure.clocks.push(Clock { master: None, axis: Axis::Index, rows: it.rows });
        }
        for (place, channel) in self.structure.channels.iter_mut().enumerate() {
            channel.clock = clocks[homes[channel.group_index]];
            let Some(axis) = self.channels.masters.get(&place) else { continue };
            let clock = &mut self.structure.clocks[channel.clock];
            // Of several masters the time counts.
            if clock.master.is_none() || (*axis == Axis::Time && clock.axis != Axis::Time) {
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
    fn count(&mut self, bytes: &mut Bytes) -> Result<(), Error> {
        let open_end = self.structure.open_end;
        for group in &mut self.structure.groups {
            if group.is_mixed() {
                group.rows = None;
                continue;
            }
            let apart = Some((group.values as u64, group.invalid as u64));
            let found = listed(bytes, group.data, &Listing { open_end, apart })?;
            let record = match found.invalid {
                Some(_) => group.values,
                None => group.number_bytes + group.record(),
            };
            group.rows = Some(found.values.length.checked_div(record as u64).unwrap_or(0));
        }
        Ok(())
    }
}

fn group_block(block: Block) -> Result<GroupBlock, Error> {
    let flags = block.u16(16)?;
    let (values, invalid) = (block.u32(24)? as usize, block.u32(28)? as usize);
    // In a group of values of any length these two are one count of bytes.
    let is_variable = flags & 1 != 0;
    if !is_variable && values.saturating_add(invalid) > RECORD {
        let text =
            format!("expected records of at most {RECORD} bytes, found {values} and {invalid}");
        return Err(Error::new(block.at, text));
    }
    let number = block.u64(0)?;
    Ok(GroupBlock { block, number, flags, values, invalid })
}
