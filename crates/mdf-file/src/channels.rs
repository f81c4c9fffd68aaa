//! Reads the channels of a group from their blocks CN: plain ones, members of structures, elements of arrays.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::bytes::{FileByteReader, MdfBlock};
use crate::conversion::ValueConversion;
use crate::conversions::ConversionReader;
use crate::error::Error;
use crate::field::RecordField;
use crate::layout::{
    ChannelStorage, ChannelValueKind, FileStructure, MasterAxis, MdfChannel, ValueLocation, ValueValidity,
    VariableLengthValue,
};
use crate::text::read_text_block;

/// How deep structures may be in each other.
const DEEPEST: usize = 16;
/// The most elements of an array that become channels.
const ELEMENTS: u64 = 4096;
/// The most elements of all arrays of a file.
const ALL_ELEMENTS: u64 = 1 << 18;

/// What the channels of a group have in common.
pub(crate) struct GroupNameAndIndex {
    pub name: String,
    pub index: usize,
}

/// Reads the channels of a file.
#[derive(Default)]
pub(crate) struct ChannelReader {
    seen: HashSet<u64>,
    conversions: ConversionReader,
    elements: u64,
    /// Channels that are masters, with what they are.
    pub masters: HashMap<usize, MasterAxis>,
}

/// A block CN with its texts.
struct ChannelBlock {
    block: MdfBlock,
    name: String,
    /// Its kind: 0 a value, 1 of any length, 2 master, 3 the number of the row as master, 5 up to a length, 6 the number of the row.
    kind: u8,
    data: u8,
    /// First byte, first bit, bits.
    place: [u32; 3],
}

/// An array as it is stored: its name's ending, bytes and invalidation bits from the first element on.
type ArrayElement = (String, u32, u32);

impl ChannelReader {
    /// Reads a chain of channels into the structure.
    pub fn read_channels(
        &mut self,
        bytes: &mut FileByteReader,
        first: u64,
        group: &GroupNameAndIndex,
        structure: &mut FileStructure,
    ) -> Result<(), Error> {
        self.read_channel_chain(bytes, first, "", 0, group, structure)
    }

    fn read_channel_chain(
        &mut self,
        bytes: &mut FileByteReader,
        first: u64,
        parent: &str,
        depth: usize,
        group: &GroupNameAndIndex,
        structure: &mut FileStructure,
    ) -> Result<(), Error> {
        let mut at = first;
        while at != 0 {
            if !self.seen.insert(at) || depth > DEEPEST {
                let text = "expected channels that end, found a circle or too deep structures";
                return Err(Error::new(at, text));
            }
            let block = bytes.read_block(at, &[b"##CN"])?;
            at = block.link_at(0);
            let own = read_text_block(bytes, block.link_at(2))?.unwrap_or_default();
            let name = match parent.is_empty() || own.starts_with(parent) {
                true => own,
                false => format!("{parent}.{own}"),
            };
            let channel = ChannelBlock {
                kind: block.u8_at(0)?,
                data: block.u8_at(2)?,
                place: [block.u32_at(4)?, block.u8_at(3)?.into(), block.u32_at(8)?],
                block,
                name,
            };
            self.read_channel(bytes, &channel, depth, group, structure)?;
        }
        Ok(())
    }

    /// One channel, with what it is composed of.
    fn read_channel(
        &mut self,
        bytes: &mut FileByteReader,
        channel: &ChannelBlock,
        depth: usize,
        group: &GroupNameAndIndex,
        structure: &mut FileStructure,
    ) -> Result<(), Error> {
        let composed = channel.block.link_at(1);
        let id = if composed == 0 { *b"    " } else { bytes.read_block_header(composed)?.id };
        let elements = match &id {
            b"##CA" => match self.read_array_elements(bytes, composed, structure, group)? {
                Ok(elements) => elements,
                Err(reason) => {
                    note_skipped_channel(structure, channel, &reason);
                    return Ok(());
                }
            },
            _ => vec![(String::new(), 0, 0)],
        };
        match self.add_element_channels(bytes, channel, &elements, group, structure) {
            Ok(()) => {}
            // The bytes of a structure are those of its members.
            Err(_) if &id == b"##CN" && channel.data == 10 => {}
            Err(reason) => note_skipped_channel(structure, channel, &reason),
        }
        if &id == b"##CN" {
            self.read_channel_chain(bytes, composed, &channel.name, depth + 1, group, structure)?;
        }
        Ok(())
    }

    /// Adds a channel for each element, or says why there is none.
    fn add_element_channels(
        &mut self,
        bytes: &mut FileByteReader,
        channel: &ChannelBlock,
        elements: &[ArrayElement],
        group: &GroupNameAndIndex,
        structure: &mut FileStructure,
    ) -> Result<(), String> {
        let said = |error: Error| error.to_string();
        let read = self.conversions.read_conversion(bytes, channel.block.link_at(4)).map_err(said)?;
        let unit = read_text_block(bytes, channel.block.link_at(6)).map_err(said)?;
        let comment = read_text_block(bytes, channel.block.link_at(7)).map_err(said)?;
        let limit = structure.groups[group.index].values;
        let invalid_bytes = structure.groups[group.index].invalid;
        for (ending, byte, bit) in elements {
            let store = read_value_location(bytes, channel, *byte, limit)?;
            let kind = converted_value_kind(&store, &read.conversion)?;
            let conversion = Arc::clone(&read.conversion);
            let valid = read_validity(&channel.block, *bit, invalid_bytes).map_err(said)??;
            let axis = match channel.block.u8_at(1).map_err(said)? {
                2 => MasterAxis::Angle,
                3 => MasterAxis::Distance,
                4 => MasterAxis::Index,
                _ => MasterAxis::Time,
            };
            if matches!(channel.kind, 2 | 3) && kind != ChannelValueKind::Text {
                self.masters.insert(structure.channels.len(), axis);
            }
            structure.storages.push(ChannelStorage { group: group.index, store, conversion, valid });
            structure.channels.push(MdfChannel {
                name: format!("{}{ending}", channel.name),
                group: group.name.clone(),
                group_index: group.index,
                unit: unit.clone().or_else(|| read.unit.clone()),
                comment: comment.clone(),
                clock: 0,
                kind,
                is_master: false,
            });
        }
        Ok(())
    }

    /// The elements of an array, or why they are left out.
    fn read_array_elements(
        &mut self,
        bytes: &mut FileByteReader,
        at: u64,
        structure: &FileStructure,
        group: &GroupNameAndIndex,
    ) -> Result<Result<Vec<ArrayElement>, String>, Error> {
        let block = bytes.read_block(at, &[b"##CA"])?;
        let (storage, dimensions, flags) = (block.u8_at(1)?, block.u16_at(2)?, block.u32_at(4)?);
        let (stride, bits) = (block.u32_at(8)?.cast_signed(), block.u32_at(12)?);
        if storage != 0 {
            return Ok(Err("an array whose elements are groups of their own".to_owned()));
        }
        if block.link_at(0) != 0 {
            return Ok(Err("an array of structures or arrays".to_owned()));
        }
        let mut lengths = Vec::new();
        for dimension in 0..usize::from(dimensions) {
            lengths.push(block.u64_at(16 + 8 * dimension)?);
        }
        let count = lengths.iter().try_fold(1u64, |all, it| all.checked_mul(*it));
        let Some(count) = count.filter(|it| *it <= ELEMENTS && dimensions > 0) else {
            return Ok(Err(format!("an array of {lengths:?} elements; at most {ELEMENTS} are read")));
        };
        self.elements += count;
        if self.elements > ALL_ELEMENTS {
            return Err(Error::new(at, format!("expected at most {ALL_ELEMENTS} elements of arrays")));
        }
        let Some(stride) = u32::try_from(stride).ok().filter(|it| *it > 0 || count == 1) else {
            return Ok(Err(format!("an array whose elements are {stride} bytes apart")));
        };
        if count * u64::from(stride) > structure.groups[group.index].values as u64 + u64::from(stride) {
            return Ok(Err("an array that leaves its record".to_owned()));
        }
        // The last index runs fastest, unless the layout is inverse.
        let inverse = flags & 1 << 6 != 0;
        let element = |number: u64| {
            let (mut rest, mut places) = (number, vec![0; lengths.len()]);
            let order: Vec<_> = match inverse {
                true => (0..lengths.len()).collect(),
                false => (0..lengths.len()).rev().collect(),
            };
            for dimension in order {
                places[dimension] = rest % lengths[dimension];
                rest /= lengths[dimension];
            }
            let places: Vec<_> = places.iter().map(u64::to_string).collect();
            let number = number as u32;
            (format!("[{}]", places.join(",")), number * stride, number.saturating_mul(bits))
        };
        Ok(Ok((0..count).map(element).collect()))
    }
}

/// Notes that a channel is left out.
fn note_skipped_channel(structure: &mut FileStructure, channel: &ChannelBlock, reason: &str) {
    structure.notes.push(format!("channel `{}` is left out: {reason}", channel.name));
}

/// Where the values of an element are.
fn read_value_location(
    bytes: &mut FileByteReader,
    channel: &ChannelBlock,
    offset: u32,
    limit: usize,
) -> Result<ValueLocation, String> {
    let moved = |[byte, bit, bits]: [u32; 3]| {
        let byte = byte.checked_add(offset).ok_or("a value that leaves its record")?;
        Ok::<_, String>([byte, bit, bits])
    };
    let fixed = || check_field_in_record(RecordField::new(channel.data, moved(channel.place)?)?, limit);
    match channel.kind {
        0 | 2 => Ok(ValueLocation::Fixed(fixed()?)),
        1 => {
            let offset = check_field_in_record(RecordField::new(0, moved(channel.place)?)?, limit)?;
            let value = RecordField::new(channel.data, [0, 0, 0])
                .ok()
                .filter(RecordField::is_text)
                .ok_or("values of any length that are no texts")?;
            Ok(ValueLocation::Variable(VariableLengthValue { offset, value, link: channel.block.link_at(5) }))
        }
        3 | 6 => Ok(ValueLocation::Row),
        5 => {
            let size = bytes.read_block(channel.block.link_at(5), &[b"##CN"]);
            let size = size.map_err(|error| error.to_string())?;
            let said = |error: Error| error.to_string();
            let place = [
                size.u32_at(4).map_err(said)?,
                size.u8_at(3).map_err(said)?.into(),
                size.u32_at(8).map_err(said)?,
            ];
            let value = fixed()?;
            let size = check_field_in_record(RecordField::new(size.u8_at(2).map_err(said)?, place)?, limit)?;
            match value.is_text() && size.is_integer() {
                true => Ok(ValueLocation::Bounded(value, size)),
                false => Err("values up to a length that are no texts".to_owned()),
            }
        }
        4 => Err("a stream such as a film beside the file".to_owned()),
        other => Err(format!("the unknown type of channel {other}")),
    }
}

/// A field that lies in a record of so many bytes.
pub(crate) fn check_field_in_record(field: RecordField, limit: usize) -> Result<RecordField, String> {
    match field.byte + field.byte_length() <= limit {
        true => Ok(field),
        false => Err(format!(
            "its bytes {} to {} leave its record of {limit} bytes",
            field.byte,
            field.byte + field.byte_length()
        )),
    }
}

/// What the values are after their conversion.
pub(crate) fn converted_value_kind(
    store: &ValueLocation,
    conversion: &ValueConversion,
) -> Result<ChannelValueKind, String> {
    let (texts, wide) = match store {
        ValueLocation::Fixed(field) => (field.is_text(), field.is_wide()),
        ValueLocation::Bounded(..) | ValueLocation::Variable(_) => (true, false),
        ValueLocation::Row => (false, false),
    };
    Ok(match conversion {
        ValueConversion::Identity if texts => ChannelValueKind::Text,
        ValueConversion::Identity if wide => ChannelValueKind::Integer,
        ValueConversion::Identity => ChannelValueKind::Number,
        other if texts != other.has_text_input() => {
            return Err("a conversion that does not fit its type of data".to_owned());
        }
        ValueConversion::Translated(..) => ChannelValueKind::Text,
        other if other.has_text_output() => ChannelValueKind::Text,
        _ => ChannelValueKind::Number,
    })
}

/// Which values of an element are valid.
fn read_validity(
    block: &MdfBlock,
    offset: u32,
    bytes: usize,
) -> Result<Result<ValueValidity, String>, Error> {
    let flags = block.u32_at(12)?;
    if flags & 1 != 0 {
        return Ok(Ok(ValueValidity::None));
    }
    if flags & 2 == 0 {
        return Ok(Ok(ValueValidity::All));
    }
    let bit = block.u32_at(16)?.saturating_add(offset);
    Ok(if bit as usize / 8 < bytes {
        Ok(ValueValidity::Unless(bit))
    } else {
        Err(format!("its invalidation bit {bit} is not in the {bytes} bytes of these bits"))
    })
}
