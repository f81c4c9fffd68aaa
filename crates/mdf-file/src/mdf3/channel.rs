//! Reads the channels of MDF 2 and 3 from their blocks CN.

use super::Reader;
use super::block::Block;
use super::conversion::UnitConversion;
use crate::channels::{inside, kind_of};
use crate::conversion::Conversion;
use crate::error::Error;
use crate::field::Field;
use crate::layout::{Axis, Channel, ChannelStorage, Kind, Store, Validity};

impl Reader<'_> {
    /// Adds a channel of the last group, or a note why it is left out.
    pub fn channel(&mut self, block: &Block, group: &str, record: usize) -> Result<(), Error> {
        let name = match self.blocks.text(block.u32(218))? {
            Some(name) => name,
            None => block.text(26, 32),
        };
        let is_master = block.u16(24) == 1;
        match self.stored(block, is_master, record) {
            Ok((store, read)) => self.add(block, name, group, is_master, store, read),
            Err(reason) => {
                self.structure.notes.push(format!("channel `{name}` is left out: {reason}"));
                Ok(())
            }
        }
    }

    fn add(
        &mut self,
        block: &Block,
        name: String,
        group: &str,
        is_master: bool,
        store: Store,
        read: UnitConversion,
    ) -> Result<(), Error> {
        let (index, clock) = (self.structure.channels.len(), self.structure.clocks.len() - 1);
        let kind = match kind_of(&store, &read.conversion) {
            Ok(kind) => kind,
            Err(reason) => {
                self.structure.notes.push(format!("channel `{name}` is left out: {reason}"));
                return Ok(());
            }
        };
        let description = Some(block.text(58, 128)).filter(|it| !it.is_empty());
        let comment: Vec<_> =
            [self.blocks.text(block.u32(20))?, description].into_iter().flatten().collect();
        let is_first = self.structure.clocks[clock].master.is_none();
        let is_master = is_master && is_first && kind != Kind::Text;
        if is_master {
            let clock = &mut self.structure.clocks[clock];
            (clock.master, clock.axis) = (Some(index), Axis::Time);
        }
        self.structure.storages.push(ChannelStorage {
            group: clock,
            store,
            conversion: read.conversion,
            valid: Validity::All,
        });
        self.structure.channels.push(Channel {
            name,
            group: group.to_owned(),
            group_index: clock,
            unit: read.unit,
            comment: (!comment.is_empty()).then(|| comment.join("\n")),
            clock,
            kind,
            is_master,
        });
        Ok(())
    }

    /// Where the values are, and what they mean.
    fn stored(
        &mut self,
        block: &Block,
        is_master: bool,
        record: usize,
    ) -> Result<(Store, UnitConversion), String> {
        if block.u32(16) != 0 {
            return Err("an array of channels that are read by themselves".to_owned());
        }
        let mut read = self.conversion(block.u32(8))?;
        let (start, bits) = (u32::from(block.u16(186)), block.u16(188).into());
        if is_master && bits == 0 {
            // Times that are nowhere: rows follow each other by a time [s], which the field of the rate holds.
            let step = block.f64(210);
            let factor = if step == 0.0 { 1.0 } else { step };
            read.conversion = Conversion::Linear { offset: 0.0, factor }.into();
            return Ok((Store::Row, read));
        }
        let kind = self.kind(block.u16(190))?;
        let place = [start / 8 + u32::from(block.u16(226)), start % 8, bits];
        Ok((Store::Fixed(inside(Field::new(kind, place)?, record)?), read))
    }

    /// The type of data of MDF 4 that is the same.
    fn kind(&self, kind: u16) -> Result<u8, String> {
        let own = u8::from(self.big_values);
        Ok(match kind {
            0 => own,
            1 => 2 + own,
            2 | 3 => 4 + own,
            // Latin-1, or UTF-8 as some tools write it.
            7 => 7,
            8 => 10,
            9 => 1,
            10 => 3,
            11 | 12 => 5,
            13 => 0,
            14 => 2,
            15 | 16 => 4,
            4..=6 => return Err("floating-point numbers of VAX".to_owned()),
            other => return Err(format!("the unknown type of data {other}")),
        })
    }
}
