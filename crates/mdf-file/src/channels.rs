//! Reads the channels of a group from their blocks CN: plain ones, members of structures, elements of arrays.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::bytes::{Block, Bytes};
use crate::conversion::Conversion;
use crate::conversions::Conversions;
use crate::error::Error;
use crate::field::Field;
use crate::layout::{Axis, Channel, ChannelStorage, Kind, Store, Structure, Validity, Variable};
use crate::text::text;

/// How deep structures may be in each other.
const DEEPEST: usize = 16;
/// The most elements of an array that become channels.
const ELEMENTS: u64 = 4096;
/// The most elements of all arrays of a file.
const ALL_ELEMENTS: u64 = 1 << 18;

/// What the channels of a group have in common.
pub(crate) struct GroupText {
    pub name: String,
    pub index: usize,
}

/// Reads the channels of a file.
#[derive(Default)]
pub(crate) struct Channels {
    seen: HashSet<u64>,
    conversions: Conversions,
    elements: u64,
    /// Channels that are masters, with what they are.
    pub masters: HashMap<usize, Axis>,
}

/// A block CN with its texts.
struct ChannelBlock {
    block: Block,
    name: String,
    /// Its kind: 0 a value, 1 of any length, 2 master, 3 the number of the row as master, 5 up to a length, 6 the number of the row.
    kind: u8,
    data: u8,
    /// First byte, first bit, bits.
    place: [u32; 3],
}

/// An array as it is stored: its name's ending, bytes and invalidation bits from the first element on.
type Element = (String, u32, u32);

impl Channels {
    /// Reads a chain of channels into the structure.
    pub fn read(
        &mut self,
        bytes: &mut Bytes,
        first: u64,
        group: &GroupText,
        structure: &mut Structure,
    ) -> Result<(), Error> {
        self.chain(bytes, first, "", 0, group, structure)
    }

    fn chain(
        &mut self,
        bytes: &mut Bytes,
        first: u64,
        parent: &str,
        depth: usize,
        group: &GroupText,
        structure: &mut Structure,
    ) -> Result<(), Error> {
        let mut at = first;
        while at != 0 {
            if !self.seen.insert(at) || depth > DEEPEST {
                let text = "expected channels that end, found a circle or too deep structures";
                return Err(Error::new(at, text));
            }
            let block = bytes.block(at, &[b"##CN"])?;
            at = block.link(0);
            let own = text(bytes, block.link(2))?.unwrap_or_default();
            let name = match parent.is_empty() || own.starts_with(parent) {
                true => own,
                false => format!("{parent}.{own}"),
            };
            let channel = ChannelBlock {
                kind: block.u8(0)?,
                data: block.u8(2)?,
                place: [block.u32(4)?, block.u8(3)?.into(), block.u32(8)?],
                block,
                name,
            };
            self.channel(bytes, &channel, depth, group, structure)?;
        }
        Ok(())
    }

    /// One channel, with what it is composed of.
    fn channel(
        &mut self,
        bytes: &mut Bytes,
        channel: &ChannelBlock,
        depth: usize,
        group: &GroupText,
        structure: &mut Structure,
    ) -> Result<(), Error> {
        let composed = channel.block.link(1);
        let id = if composed == 0 { *b"    " } else { bytes.head(composed)?.id };
        let elements = match &id {
            b"##CA" => match self.elements(bytes, composed, structure, group)? {
                Ok(elements) => elements,
                Err(reason) => {
                    leave(structure, channel, &reason);
                    return Ok(());
                }
            },
            _ => vec![(String::new(), 0, 0)],
        };
        match self.add(bytes, channel, &elements, group, structure) {
            Ok(()) => {}
            // The bytes of a structure are those of its members.
            Err(_) if &id == b"##CN" && channel.data == 10 => {}
            Err(reason) => leave(structure, channel, &reason),
        }
        if &id == b"##CN" {
            self.chain(bytes, composed, &channel.name, depth + 1, group, structure)?;
        }
        Ok(())
    }

    /// Adds a channel for each element, or says why there is none.
    fn add(
        &mut self,
        bytes: &mut Bytes,
        channel: &ChannelBlock,
        elements: &[Element],
        group: &GroupText,
        structure: &mut Structure,
    ) -> Result<(), String> {
        let said = |error: Error| error.to_string();
        let read = self.conversions.read(bytes, channel.block.link(4)).map_err(said)?;
        let unit = text(bytes, channel.block.link(6)).map_err(said)?;
        let comment = text(bytes, channel.block.link(7)).map_err(said)?;
        let limit = structure.groups[group.index].values;
        let invalid_bytes = structure.groups[group.index].invalid;
        for (ending, byte, bit) in elements {
            let store = store(bytes, channel, *byte, limit)?;
            let kind = kind_of(&store, &read.conversion)?;
            let conversion = Arc::clone(&read.conversion);
            let valid = valid(&channel.block, *bit, invalid_bytes).map_err(said)??;
            let axis = match channel.block.u8(1).map_err(said)? {
                2 => Axis::Angle,
                3 => Axis::Distance,
                4 => Axis::Index,
                _ => Axis::Time,
            };
            if matches!(channel.kind, 2 | 3) && kind != Kind::Text {
                self.masters.insert(structure.channels.len(), axis);
            }
            structure.storages.push(ChannelStorage {
                group: group.index,
                store,
                conversion,
                valid,
            });
            structure.channels.push(Channel {
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
    fn elements(
        &mut self,
        bytes: &mut Bytes,
        at: u64,
        structure: &Structure,
        group: &GroupText,
    ) -> Result<Result<Vec<Element>, String>, Error> {
        let block = bytes.block(at, &[b"##CA"])?;
        let (storage, dimensions, flags) = (block.u8(1)?, block.u16(2)?, block.u32(4)?);
        let (stride, bits) = (block.u32(8)?.cast_signed(), block.u32(12)?);
        if storage != 0 {
            return Ok(Err("an array whose elements are groups of their own".to_owned()));
        }
        if block.link(0) != 0 {
            return Ok(Err("an array of structures or arrays".to_owned()));
        }
        let mut lengths = Vec::new();
        for dimension in 0..usize::from(dimensions) {
            lengths.push(block.u64(16 + 8 * dimension)?);
        }
        let count = lengths.iter().try_fold(1u64, |all, it| all.checked_mul(*it));
        let Some(count) = count.filter(|it| *it <= ELEMENTS && dimensions > 0) else {
            return Ok(Err(format!(
                "an array of {lengths:?} elements; at most {ELEMENTS} are read"
            )));
        };
        self.elements += count;
        if self.elements > ALL_ELEMENTS {
            return Err(Error::new(
                at,
                format!("expected at most {ALL_ELEMENTS} elements of arrays"),
            ));
        }
        let Some(stride) = u32::try_from(stride).ok().filter(|it| *it > 0 || count == 1) else {
            return Ok(Err(format!("an array whose elements are {stride} bytes apart")));
        };
        if count * u64::from(stride)
            > structure.groups[group.index].values as u64 + u64::from(stride)
        {
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
fn leave(structure: &mut Structure, channel: &ChannelBlock, reason: &str) {
    structure.notes.push(format!("channel `{}` is left out: {reason}", channel.name));
}

/// Where the values of an element are.
fn store(
    bytes: &mut Bytes,
    channel: &ChannelBlock,
    offset: u32,
    limit: usize,
) -> Result<Store, String> {
    let moved = |[byte, bit, bits]: [u32; 3]| {
        let byte = byte.checked_add(offset).ok_or("a value that leaves its record")?;
        Ok::<_, String>([byte, bit, bits])
    };
    let fixed = || inside(Field::new(channel.data, moved(channel.place)?)?, limit);
    match channel.kind {
        0 | 2 => Ok(Store::Fixed(fixed()?)),
        1 => {
            let offset = inside(Field::new(0, moved(channel.place)?)?, limit)?;
            let value = Field::new(channel.data, [0, 0, 0])
                .ok()
                .filter(Field::is_text)
                .ok_or("values of any length that are no texts")?;
            Ok(Store::Variable(Variable { offset, value, link: channel.block.link(5) }))
        }
        3 | 6 => Ok(Store::Row),
        5 => {
            let size = bytes.block(channel.block.link(5), &[b"##CN"]);
            let size = size.map_err(|error| error.to_string())?;
            let said = |error: Error| error.to_string();
            let place = [
                size.u32(4).map_err(said)?,
                size.u8(3).map_err(said)?.into(),
                size.u32(8).map_err(said)?,
            ];
            let value = fixed()?;
            let size = inside(Field::new(size.u8(2).map_err(said)?, place)?, limit)?;
            match value.is_text() && size.is_whole() {
                true => Ok(Store::Bounded(value, size)),
                false => Err("values up to a length that are no texts".to_owned()),
            }
        }
        4 => Err("a stream such as a film beside the file".to_owned()),
        other => Err(format!("the unknown type of channel {other}")),
    }
}

/// A field that lies in a record of so many bytes.
pub(crate) fn inside(field: Field, limit: usize) -> Result<Field, String> {
    match field.byte + field.bytes() <= limit {
        true => Ok(field),
        false => Err(format!(
            "its bytes {} to {} leave its record of {limit} bytes",
            field.byte,
            field.byte + field.bytes()
        )),
    }
}

/// What the values are after their conversion.
pub(crate) fn kind_of(store: &Store, conversion: &Conversion) -> Result<Kind, String> {
    let (texts, wide) = match store {
        Store::Fixed(field) => (field.is_text(), field.is_wide()),
        Store::Bounded(..) | Store::Variable(_) => (true, false),
        Store::Row => (false, false),
    };
    Ok(match conversion {
        Conversion::Identity if texts => Kind::Text,
        Conversion::Identity if wide => Kind::Integer,
        Conversion::Identity => Kind::Number,
        other if texts != other.takes_texts() => {
            return Err("a conversion that does not fit its type of data".to_owned());
        }
        Conversion::Translated(..) => Kind::Text,
        other if other.gives_texts() => Kind::Text,
        _ => Kind::Number,
    })
}

/// Which values of an element are valid.
fn valid(block: &Block, offset: u32, bytes: usize) -> Result<Result<Validity, String>, Error> {
    let flags = block.u32(12)?;
    if flags & 1 != 0 {
        return Ok(Ok(Validity::None));
    }
    if flags & 2 == 0 {
        return Ok(Ok(Validity::All));
    }
    let bit = block.u32(16)?.saturating_add(offset);
    Ok(if bit as usize / 8 < bytes {
        Ok(Validity::Unless(bit))
    } else {
        Err(format!("its invalidation bit {bit} is not in the {bytes} bytes of these bits"))
    })
}
