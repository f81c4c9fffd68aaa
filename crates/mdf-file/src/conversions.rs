//! Reads the conversions of a file from their blocks CC, each once.

use std::collections::HashMap;
use std::sync::Arc;

use crate::bytes::{Block, Bytes};
use crate::conversion::{Conversion, Target};
use crate::error::Error;
use crate::formula::Formula;
use crate::text::text;

/// How deep tables may refer to other conversions.
const DEEPEST: usize = 16;

/// The most bytes of texts in all tables: many entries may refer to one long text.
const TEXTS: usize = 64 << 20;

/// The conversions that were read, by their place.
#[derive(Default)]
pub(crate) struct Conversions {
    known: HashMap<u64, UnitConversion>,
    depth: usize,
    /// Bytes of texts in tables.
    texts: usize,
}

/// A conversion with its unit.
#[derive(Clone)]
pub(crate) struct UnitConversion {
    pub conversion: Arc<Conversion>,
    pub name: Option<String>,
    pub unit: Option<String>,
}

impl Conversions {
    /// The conversion that a link leads to.
    pub fn read(&mut self, bytes: &mut Bytes, at: u64) -> Result<UnitConversion, Error> {
        if at == 0 {
            let conversion = Arc::new(Conversion::Identity);
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
        let read = self.block(bytes, at);
        self.depth -= 1;
        let read = read?;
        self.known.insert(at, read.clone());
        Ok(read)
    }

    fn block(&mut self, bytes: &mut Bytes, at: u64) -> Result<UnitConversion, Error> {
        let block = bytes.block(at, &[b"##CC"])?;
        let kind = block.u8(0)?;
        let numbers = Numbers::of(&block)?;
        let conversion = match kind {
            0 => Conversion::Identity,
            1 => Conversion::Linear { offset: numbers.at(0)?, factor: numbers.at(1)? },
            2 => {
                let mut all = [0.0; 6];
                for (place, to) in all.iter_mut().enumerate() {
                    *to = numbers.at(place)?;
                }
                Conversion::Rational(all)
            }
            3 => {
                let formula = text(bytes, block.link(4))?.unwrap_or_default();
                let wrong = |error: String| {
                    Error::new(at, format!("the formula `{formula}` of a conversion: {error}"))
                };
                Conversion::Formula(Formula::read(&formula).map_err(wrong)?)
            }
            4 | 5 => points(&block, &numbers, kind == 4)?,
            6 => ranges(&numbers)?,
            7 | 8 => self.table(bytes, &block, &numbers, kind == 7)?,
            9 | 10 => self.texts(bytes, &block, &numbers, kind == 9)?,
            11 => self.bits(bytes, &block)?,
            other => {
                let text = format!("expected a conversion of type 0 to 11, found {other}");
                return Err(Error::new(at, text));
            }
        };
        let (name, unit) = (text(bytes, block.link(0))?, text(bytes, block.link(1))?);
        Ok(UnitConversion { conversion: Arc::new(conversion), name, unit })
    }

    /// What a raw value means by a link: a text, or one more conversion.
    fn target(&mut self, bytes: &mut Bytes, at: u64) -> Result<(Target, Option<String>), Error> {
        if at == 0 {
            return Ok((Target::Itself, None));
        }
        if &bytes.head(at)?.id == b"##CC" {
            let read = self.read(bytes, at)?;
            return Ok((Target::Scale(read.conversion), read.name));
        }
        Ok((Target::Text(self.text(bytes, at)?.unwrap_or_default()), None))
    }

    /// A text of a table.
    fn text(&mut self, bytes: &mut Bytes, at: u64) -> Result<Option<String>, Error> {
        let found = text(bytes, at)?;
        self.texts += found.as_ref().map_or(0, String::len);
        if self.texts > TEXTS {
            let text =
                format!("expected at most {TEXTS} bytes of texts in conversions, found more");
            return Err(Error::new(at, text));
        }
        Ok(found)
    }

    /// Texts with their numbers, or with other texts.
    fn texts(
        &mut self,
        bytes: &mut Bytes,
        block: &Block,
        numbers: &Numbers,
        to_numbers: bool,
    ) -> Result<Conversion, Error> {
        let links = usize::from(block.u16(4)?);
        let mut read = |place: usize| self.text(bytes, block.link(4 + place));
        if to_numbers {
            let mut known = Vec::new();
            for place in 0..links {
                known.push((read(place)?.unwrap_or_default(), numbers.at(place)?));
            }
            return Ok(Conversion::FromTexts(known, numbers.at(links)?));
        }
        let mut known = Vec::new();
        for place in 0..links / 2 {
            known.push((read(2 * place)?.unwrap_or_default(), read(2 * place + 1)?));
        }
        let other = read(links / 2 * 2)?;
        Ok(Conversion::Translated(known, other))
    }

    /// Keys or spans with their meaning.
    fn table(
        &mut self,
        bytes: &mut Bytes,
        block: &Block,
        numbers: &Numbers,
        keys: bool,
    ) -> Result<Conversion, Error> {
        let count = if keys { numbers.count } else { numbers.count / 2 };
        let mut targets = Vec::new();
        for place in 0..count {
            targets.push(self.target(bytes, block.link(4 + place))?.0);
        }
        let other = self.target(bytes, block.link(4 + count))?.0;
        if keys {
            let keys = targets.into_iter().enumerate();
            let keys = keys.map(|(place, target)| Ok((numbers.at(place)?, target)));
            return Ok(Conversion::keys(keys.collect::<Result<_, Error>>()?, other));
        }
        let spans = targets.into_iter().enumerate().map(|(place, target)| {
            Ok(([numbers.at(2 * place)?, numbers.at(2 * place + 1)?], target))
        });
        Ok(Conversion::Spans(spans.collect::<Result<_, Error>>()?, other))
    }

    fn bits(&mut self, bytes: &mut Bytes, block: &Block) -> Result<Conversion, Error> {
        let mut parts = Vec::new();
        for place in 0..usize::from(block.u16(6)?) {
            let mask = block.u64(24 + 8 * place)?;
            let (target, name) = self.target(bytes, block.link(4 + place))?;
            parts.push((mask, name, target));
        }
        Ok(Conversion::Bits(parts))
    }
}

/// The numbers of a block CC.
struct Numbers<'b> {
    block: &'b Block,
    count: usize,
}

impl<'b> Numbers<'b> {
    fn of(block: &'b Block) -> Result<Self, Error> {
        Ok(Self { block, count: block.u16(6)?.into() })
    }

    fn at(&self, place: usize) -> Result<f64, Error> {
        if place >= self.count {
            let text = format!(
                "expected at least {} numbers in a conversion, found {}",
                place + 1,
                self.count
            );
            return Err(Error::new(self.block.at, text));
        }
        self.block.f64(24 + 8 * place)
    }
}

fn points(block: &Block, numbers: &Numbers, lines: bool) -> Result<Conversion, Error> {
    let pair = |place: usize| Ok([numbers.at(2 * place)?, numbers.at(2 * place + 1)?]);
    let points = (0..numbers.count / 2).map(pair).collect::<Result<Vec<_>, Error>>()?;
    Conversion::points(points, lines, block.at)
}

fn ranges(numbers: &Numbers) -> Result<Conversion, Error> {
    let count = numbers.count / 3;
    let triple = |place: usize| {
        Ok([numbers.at(3 * place)?, numbers.at(3 * place + 1)?, numbers.at(3 * place + 2)?])
    };
    let ranges = (0..count).map(triple).collect::<Result<_, Error>>()?;
    Ok(Conversion::Ranges(ranges, numbers.at(3 * count)?))
}
