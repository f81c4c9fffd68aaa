//! Reads the channels of MDF 2 and 3 from their blocks CN.

use super::Mdf3Reader;
use super::block::Mdf3Block;
use super::conversion::UnitConversion;
use crate::channels::{check_field_in_record, converted_value_kind};
use crate::conversion::ValueConversion;
use crate::error::Error;
use crate::field::RecordField;
use crate::layout::{ChannelStorage, ChannelValueKind, MasterAxis, MdfChannel, ValueLocation, ValueValidity};

impl Mdf3Reader<'_> {
    /// Adds a channel of the last group, or a note why it is left out.
    pub fn read_channel(&mut self, block: &Mdf3Block, group: &str, record: usize) -> Result<(), Error> {
        let name = match self.blocks.read_text_block(block.u32_at(218))? {
            Some(name) => name,
            None => block.text_at(26, 32),
        };
        let is_master = block.u16_at(24) == 1;
        match self.read_value_location(block, is_master, record) {
            Ok((store, read)) => self.add_channel(block, name, group, is_master, store, read),
            Err(reason) => {
                self.structure.notes.push(format!("channel `{name}` is left out: {reason}"));
                Ok(())
            }
        }
    }

    fn add_channel(
        &mut self,
        block: &Mdf3Block,
        name: String,
        group: &str,
        is_master: bool,
        store: ValueLocation,
        read: UnitConversion,
    ) -> Result<(), Error> {
        let (index, clock) = (self.structure.channels.len(), self.structure.clocks.len() - 1);
        let kind = match converted_value_kind(&store, &read.conversion) {
            Ok(kind) => kind,
            Err(reason) => {
                self.structure.notes.push(format!("channel `{name}` is left out: {reason}"));
                return Ok(());
            }
        };
        let description = Some(block.text_at(58, 128)).filter(|it| !it.is_empty());
        let comment: Vec<_> =
            [self.blocks.read_text_block(block.u32_at(20))?, description].into_iter().flatten().collect();
        let is_first = self.structure.clocks[clock].master.is_none();
        let is_master = is_master && is_first && kind != ChannelValueKind::Text;
        if is_master {
            let clock = &mut self.structure.clocks[clock];
            (clock.master, clock.axis) = (Some(index), MasterAxis::Time);
        }
        self.structure.storages.push(ChannelStorage {
            group: clock,
            store,
            conversion: read.conversion,
            valid: ValueValidity::All,
        });
        self.structure.channels.push(MdfChannel {
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
    fn read_value_location(
        &mut self,
        block: &Mdf3Block,
        is_master: bool,
        record: usize,
    ) -> Result<(ValueLocation, UnitConversion), String> {
        if block.u32_at(16) != 0 {
            return Err("an array of channels that are read by themselves".to_owned());
        }
        let mut read = self.read_conversion(block.u32_at(8))?;
        let (start, bits) = (u32::from(block.u16_at(186)), block.u16_at(188).into());
        if is_master && bits == 0 {
            // Times that are nowhere: rows follow each other by a time [s], which the field of the rate holds.
            let step = block.f64_at(210);
            let factor = if step == 0.0 { 1.0 } else { step };
            read.conversion = ValueConversion::Linear { offset: 0.0, factor }.into();
            return Ok((ValueLocation::Row, read));
        }
        let kind = self.mdf4_data_type(block.u16_at(190))?;
        let place = [start / 8 + u32::from(block.u16_at(226)), start % 8, bits];
        Ok((ValueLocation::Fixed(check_field_in_record(RecordField::new(kind, place)?, record)?), read))
    }

    /// The type of data of MDF 4 that is the same.
    fn mdf4_data_type(&self, kind: u16) -> Result<u8, String> {
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
