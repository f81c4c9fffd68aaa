//! Describes what a file holds: channels, the clocks that they have, and where their values are.

use std::collections::HashMap;
use std::sync::Arc;

use crate::conversion::ValueConversion;
use crate::field::RecordField;

/// A channel of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct MdfChannel {
    /// Its name, as in the file. Elements of arrays have their place behind it: `pressure[1,2]`, from 0 on.
    pub name: String,
    /// What its group is called: the name of the acquisition, or that of its source; empty where the file has none.
    pub group: String,
    /// The place of its group in the file.
    pub group_index: usize,
    /// Its unit, as the file writes it.
    pub unit: Option<String>,
    /// What the file says about it.
    pub comment: Option<String>,
    /// The clock that its rows have, an index into [`crate::MdfFile::clocks`].
    pub clock: usize,
    /// What its values are, after their conversion.
    pub kind: ChannelValueKind,
    /// Whether it is the time, angle or distance of its clock.
    pub is_master: bool,
}

/// What the values of a channel are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelValueKind {
    /// Numbers that a double holds, integers among them.
    Number,
    /// Integers of up to 64 bits, which a double may round.
    Integer,
    /// Texts.
    Text,
}

/// What the rows of some channels have in common.
#[derive(Clone, Debug, PartialEq)]
pub struct MdfClock {
    /// The channel with the place of each row, an index into [`crate::MdfFile::channels`]; without one, rows have a number only.
    pub master: Option<usize>,
    /// What the master is.
    pub axis: MasterAxis,
    /// The number of rows, where it is known without reading all data: only a file that was not finalised and mixes groups hides it.
    pub rows: Option<u64>,
}

/// What a master channel is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MasterAxis {
    /// Time [s].
    Time,
    /// Angle [rad].
    Angle,
    /// Distance [m].
    Distance,
    /// The number of a row.
    Index,
}

/// When the measurement began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StartTime {
    /// Since 1970 [ns].
    pub nanoseconds: u64,
    /// Whether that is local time of an unknown place; else it is UTC.
    pub is_local: bool,
}

/// Where the values of a channel are.
#[derive(Clone, Debug)]
pub(crate) struct ChannelStorage {
    /// The group, an index into [`FileStructure::groups`].
    pub group: usize,
    pub store: ValueLocation,
    pub conversion: Arc<ValueConversion>,
    pub valid: ValueValidity,
}

#[derive(Clone, Debug)]
pub(crate) enum ValueLocation {
    /// In the record.
    Fixed(RecordField),
    /// In the record, with as many bytes as another field tells.
    Bounded(RecordField, RecordField),
    /// Anywhere else: the record has the offset there.
    Variable(VariableLengthValue),
    /// Nowhere: the number of the row.
    Row,
}

/// A channel of values of any length.
#[derive(Clone, Debug)]
pub(crate) struct VariableLengthValue {
    /// The field of the offset.
    pub offset: RecordField,
    /// How the value is stored.
    pub value: RecordField,
    /// The block of the values: data, or a group of the same stream; 0 for none.
    pub link: u64,
}

/// Which values are valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ValueValidity {
    All,
    None,
    /// Those without this bit, counted from the byte behind the values.
    Unless(u32),
}

/// A group of channels with common records.
#[derive(Clone, Debug)]
pub(crate) struct ChannelGroup {
    /// The link to its data.
    pub data: u64,
    /// In MDF 2 and 3 the length of the data, which has no head of a block.
    pub raw: Option<u64>,
    /// Bytes of the number in front of each record.
    pub number_bytes: usize,
    /// That number.
    pub number: u64,
    /// All groups of the same data by their numbers: the length of a record, nothing where it stands in front of each.
    pub mixed: Arc<HashMap<u64, Option<usize>>>,
    /// Groups of values of any length by their block: their numbers.
    pub variable: Arc<HashMap<u64, u64>>,
    /// Bytes of values of a record.
    pub values: usize,
    /// Bytes of invalidation bits of a record.
    pub invalid: usize,
    /// Rows that it has by the file.
    pub rows: Option<u64>,
}

impl ChannelGroup {
    /// The bytes of a record.
    pub fn record_bytes(&self) -> usize {
        self.values + self.invalid
    }

    /// Whether other records stand between its own.
    pub fn has_mixed_records(&self) -> bool {
        self.mixed.len() > 1
    }
}

/// All about a file but its data.
#[derive(Debug, Default)]
pub(crate) struct FileStructure {
    /// Hundred times the version of the format.
    pub version: u16,
    pub channels: Vec<MdfChannel>,
    /// Where their values are, one for each.
    pub storages: Vec<ChannelStorage>,
    pub clocks: Vec<MdfClock>,
    pub groups: Vec<ChannelGroup>,
    pub start: Option<StartTime>,
    pub comment: Option<String>,
    pub notes: Vec<String>,
    /// Whether the file was left as it was during the measurement.
    pub open_end: bool,
    /// Whether its counts of rows are wrong.
    pub uncounted: bool,
}
