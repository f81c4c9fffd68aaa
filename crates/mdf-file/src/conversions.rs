//! Reads the conversions of a file from their blocks CC, each once.

use std::collections::HashMap;
use std::sync::Arc;

use crate::bytes::{FileByteReader, MdfBlock};
use crate::conversion::{ConversionTarget, ValueConversion};
use crate::error::Error;
use crate::formula::ConversionFormula;
use crate::text::read_text_block;

/// How deep tables may refer to other conversions.
const DEEPEST: usize = 16;

/// The most bytes of texts in all tables: many entries may refer to one long text.
const TEXTS: usize = 64 << 20;

/// The conversions that were read, by their place.
#[derive(Default)]
pub(crate) struct ConversionReader {
    known: HashMap<u64, UnitConversion>,
    depth: usize,
    /// Bytes of texts in tables.
    texts: usize,
}

/// A conversion with its unit.
#[derive(Clone)]
pub(crate) struct UnitConversion {
    pub conversion: Arc<ValueConversion>,
    pub name: Option<String>,
    pub unit: Option<String>,
}

impl ConversionReader {
    /// The conversion that a link leads to.
    pub fn read_conversion(&mut self, bytes: &mut FileByteReader, at: u64) -> Result<UnitConversion, Error> {
        if at == 0 {
            let conversion = Arc::new(ValueConversion::Identity);
            return Ok(UnitConversion { conversion, name: None, unit: None });
        }
        if let Some(known) = self.known.get(&at) {
            return Ok(known.clone());
        }
        if self.depth >= DEEPEST {
            let text = format!("expected at most {DEEPEST} conversions within each other");
            return Err(Error::new(at, text));
        }
        self.depth += 1;
        let read = self.read_conversion_block(bytes, at);
        self.depth -= 1;
        let read = read?;
        self.known.insert(at, read.clone());
        Ok(read)
    }

    fn read_conversion_block(
        &mut self,
        bytes: &mut FileByteReader,
        at: u64,
    ) -> Result<UnitConversion, Error> {
        let block = bytes.read_block(at, &[b"##CC"])?;
        let kind = block.u8_at(0)?;
        let numbers = ConversionParameters::from_block(&block)?;
        let conversion = match kind {
            0 => ValueConversion::Identity,
            1 => {
                ValueConversion::Linear { offset: numbers.parameter_at(0)?, factor: numbers.parameter_at(1)? }
            }
            2 => {
                let mut all = [0.0; 6];
                for (place, to) in all.iter_mut().enumerate() {
                    *to = numbers.parameter_at(place)?;
                }
                ValueConversion::Rational(all)
            }
            3 => {
                let formula = read_text_block(bytes, block.link_at(4))?.unwrap_or_default();
                let wrong = |error: String| {
                    Error::new(at, format!("the formula `{formula}` of a conversion: {error}"))
                };
                ValueConversion::Formula(ConversionFormula::parse(&formula).map_err(wrong)?)
            }
            4 | 5 => read_point_table(&block, &numbers, kind == 4)?,
            6 => read_range_table(&numbers)?,
            7 | 8 => self.read_lookup_table(bytes, &block, &numbers, kind == 7)?,
            9 | 10 => self.read_text_table(bytes, &block, &numbers, kind == 9)?,
            11 => self.read_bit_fields(bytes, &block)?,
            other => {
                let text = format!("expected a conversion of type 0 to 11, found {other}");
                return Err(Error::new(at, text));
            }
        };
        let (name, unit) =
            (read_text_block(bytes, block.link_at(0))?, read_text_block(bytes, block.link_at(1))?);
        Ok(UnitConversion { conversion: Arc::new(conversion), name, unit })
    }

    /// What a raw value means by a link: a text, or one more conversion.
    fn read_target(
        &mut self,
        bytes: &mut FileByteReader,
        at: u64,
    ) -> Result<(ConversionTarget, Option<String>), Error> {
        if at == 0 {
            return Ok((ConversionTarget::Itself, None));
        }
        if &bytes.read_block_header(at)?.id == b"##CC" {
            let read = self.read_conversion(bytes, at)?;
            return Ok((ConversionTarget::Scale(read.conversion), read.name));
        }
        Ok((ConversionTarget::Text(self.read_table_text(bytes, at)?.unwrap_or_default()), None))
    }

    /// A text of a table.
    fn read_table_text(&mut self, bytes: &mut FileByteReader, at: u64) -> Result<Option<String>, Error> {
        let found = read_text_block(bytes, at)?;
        self.texts += found.as_ref().map_or(0, String::len);
        if self.texts > TEXTS {
            let text = format!("expected at most {TEXTS} bytes of texts in conversions, found more");
            return Err(Error::new(at, text));
        }
        Ok(found)
    }

    /// Texts with their numbers, or with other texts.
    fn read_text_table(
        &mut self,
        bytes: &mut FileByteReader,
        block: &MdfBlock,
        numbers: &ConversionParameters,
        to_numbers: bool,
    ) -> Result<ValueConversion, Error> {
        let links = usize::from(block.u16_at(4)?);
        let mut read = |place: usize| self.read_table_text(bytes, block.link_at(4 + place));
        if to_numbers {
            let mut known = Vec::new();
            for place in 0..links {
                known.push((read(place)?.unwrap_or_default(), numbers.parameter_at(place)?));
            }
            return Ok(ValueConversion::FromTexts(known, numbers.parameter_at(links)?));
        }
        let mut known = Vec::new();
        for place in 0..links / 2 {
            known.push((read(2 * place)?.unwrap_or_default(), read(2 * place + 1)?));
        }
        let other = read(links / 2 * 2)?;
        Ok(ValueConversion::Translated(known, other))
    }

    /// Keys or spans with their meaning.
    fn read_lookup_table(
        &mut self,
        bytes: &mut FileByteReader,
        block: &MdfBlock,
        numbers: &ConversionParameters,
        keys: bool,
    ) -> Result<ValueConversion, Error> {
        let count = if keys { numbers.count } else { numbers.count / 2 };
        let mut targets = Vec::new();
        for place in 0..count {
            targets.push(self.read_target(bytes, block.link_at(4 + place))?.0);
        }
        let other = self.read_target(bytes, block.link_at(4 + count))?.0;
        if keys {
            let keys = targets.into_iter().enumerate();
            let keys = keys.map(|(place, target)| Ok((numbers.parameter_at(place)?, target)));
            return Ok(ValueConversion::from_keys(keys.collect::<Result<_, Error>>()?, other));
        }
        let spans = targets.into_iter().enumerate().map(|(place, target)| {
            Ok(([numbers.parameter_at(2 * place)?, numbers.parameter_at(2 * place + 1)?], target))
        });
        Ok(ValueConversion::Spans(spans.collect::<Result<_, Error>>()?, other))
    }

    fn read_bit_fields(
        &mut self,
        bytes: &mut FileByteReader,
        block: &MdfBlock,
    ) -> Result<ValueConversion, Error> {
        let mut parts = Vec::new();
        for place in 0..usize::from(block.u16_at(6)?) {
            let mask = block.u64_at(24 + 8 * place)?;
            let (target, name) = self.read_target(bytes, block.link_at(4 + place))?;
            parts.push((mask, name, target));
        }
        Ok(ValueConversion::Bits(parts))
    }
}

/// The numbers of a block CC.
struct ConversionParameters<'b> {
    block: &'b MdfBlock,
    count: usize,
}

impl<'b> ConversionParameters<'b> {
    fn from_block(block: &'b MdfBlock) -> Result<Self, Error> {
        Ok(Self { block, count: block.u16_at(6)?.into() })
    }

    fn parameter_at(&self, place: usize) -> Result<f64, Error> {
        if place >= self.count {
            let text =
                format!("expected at least {} numbers in a conversion, found {}", place + 1, self.count);
            return Err(Error::new(self.block.at, text));
        }
        self.block.f64_at(24 + 8 * place)
    }
}

fn read_point_table(
    block: &MdfBlock,
    numbers: &ConversionParameters,
    lines: bool,
) -> Result<ValueConversion, Error> {
    let pair = |place: usize| Ok([numbers.parameter_at(2 * place)?, numbers.parameter_at(2 * place + 1)?]);
    let points = (0..numbers.count / 2).map(pair).collect::<Result<Vec<_>, Error>>()?;
    ValueConversion::from_points(points, lines, block.at)
}

fn read_range_table(numbers: &ConversionParameters) -> Result<ValueConversion, Error> {
    let count = numbers.count / 3;
    let triple = |place: usize| {
        Ok([
            numbers.parameter_at(3 * place)?,
            numbers.parameter_at(3 * place + 1)?,
            numbers.parameter_at(3 * place + 2)?,
        ])
    };
    let ranges = (0..count).map(triple).collect::<Result<_, Error>>()?;
    Ok(ValueConversion::Ranges(ranges, numbers.parameter_at(3 * count)?))
}
