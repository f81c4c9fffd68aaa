//! Reads the conversions of MDF 2 and 3 from their blocks CC.

use std::sync::Arc;

use super::Mdf3Reader;
use super::block::Mdf3Block;
use crate::conversion::{ConversionTarget, ValueConversion};
use crate::error::Error;
use crate::formula::ConversionFormula;

/// A conversion with its unit.
#[derive(Clone)]
pub(super) struct UnitConversion {
    pub conversion: Arc<ValueConversion>,
    pub unit: Option<String>,
}

/// Bytes in front of the parameters of a block CC.
const HEAD: usize = 46;

impl Mdf3Reader<'_> {
    /// The conversion that a link leads to, read once.
    pub fn read_conversion(&mut self, at: u32) -> Result<UnitConversion, String> {
        if at == 0 {
            return Ok(UnitConversion { conversion: Arc::new(ValueConversion::Identity), unit: None });
        }
        if let Some(known) = self.conversions.get(&at) {
            return known.clone();
        }
        let read = self.read_conversion_block(at).map_err(|error| error.to_string());
        self.conversions.insert(at, read.clone());
        read
    }

    fn read_conversion_block(&mut self, at: u32) -> Result<UnitConversion, Error> {
        let block = self.blocks.read_block(at.into(), b"CC", HEAD)?;
        let unit = Some(block.text_at(22, 20)).filter(|it| !it.is_empty());
        let (kind, count) = (block.u16_at(42), usize::from(block.u16_at(44)));
        let needed = HEAD
            + match kind {
                0 => 16,
                1 | 2 => 16 * count,
                6 | 9 => 48,
                7 | 8 => 56,
                11 => 40 * count,
                12 => 20 * count,
                _ => 0,
            };
        let block = match needed > block.block_length() {
            true => self.blocks.read_oversized_block(block.at, needed)?,
            false => block,
        };
        let numbers = |count: usize| (0..count).map(|it| block.f64_at(HEAD + 8 * it));
        let conversion = match kind {
            0 => match [block.f64_at(HEAD), block.f64_at(HEAD + 8)] {
                [0.0, 1.0] => ValueConversion::Identity,
                [offset, factor] => ValueConversion::Linear { offset, factor },
            },
            1 | 2 => read_point_table(&block, count, kind == 1)?,
            6..=8 => read_formula(&block, &closed_form(kind, &numbers(7).collect::<Vec<_>>())?)?,
            9 => {
                let mut all = [0.0; 6];
                all.iter_mut().zip(numbers(6)).for_each(|(to, it)| *to = it);
                ValueConversion::Rational(all)
            }
            10 => read_formula(&block, &block.text_at(HEAD, block.block_length()))?,
            11 => read_text_table(&block, count),
            12 => self.read_text_ranges(&block, count)?,
            // Dates and times of CANopen are bytes without a conversion.
            132 | 133 | 0xffff => ValueConversion::Identity,
            other => {
                let text = format!("expected a conversion of type 0 to 2 or 6 to 12, found {other}");
                return Err(Error::new(block.at, text));
            }
        };
        Ok(UnitConversion { conversion: Arc::new(conversion), unit })
    }

    /// Ranges with their texts; the first entry is the text of all other values.
    fn read_text_ranges(&mut self, block: &Mdf3Block, count: usize) -> Result<ValueConversion, Error> {
        let mut spans = Vec::new();
        let mut other = ConversionTarget::Text(String::new());
        for entry in 0..count {
            let at = HEAD + 20 * entry;
            let text = self.blocks.read_text_block(block.u32_at(at + 16))?.unwrap_or_default();
            match entry {
                0 => other = default_target(text),
                // Both ends belong to a range, also of numbers that are not whole.
                _ => spans
                    .push(([block.f64_at(at), block.f64_at(at + 8).next_up()], ConversionTarget::Text(text))),
            }
        }
        Ok(ValueConversion::Spans(spans, other))
    }
}

/// What all other values mean: a text, or a formula in quotes, such as `"2*{X}+1"`.
fn default_target(text: String) -> ConversionTarget {
    let scale = text.split('"').nth(1).filter(|it| it.contains("{X}"));
    let scale = scale.and_then(|it| ConversionFormula::parse(&it.replace("{X}", "X")).ok());
    scale.map_or(ConversionTarget::Text(text), |it| {
        ConversionTarget::Scale(ValueConversion::Formula(it).into())
    })
}

fn read_formula(block: &Mdf3Block, text: &str) -> Result<ValueConversion, Error> {
    let wrong = |error| Error::new(block.at, format!("the formula `{text}` of a conversion: {error}"));
    ConversionFormula::parse(text).map(ValueConversion::Formula).map_err(wrong)
}

/// The function of a polynomial (6), exponential (7) or logarithmic (8) conversion with the parameters P1 to P7.
fn closed_form(kind: u16, numbers: &[f64]) -> Result<String, Error> {
    let parameters: Vec<_> = numbers.iter().map(|it| format!("({it:?})")).collect();
    let [p1, p2, p3, p4, p5, p6, p7] = &parameters[..] else { return Ok(String::new()) };
    let function = if kind == 7 { "exp" } else { "ln" };
    match () {
        () if kind == 6 => Ok(format!("({p2}-{p4}*(X-{p5}-{p6}))/({p3}*(X-{p5}-{p6})-{p1})")),
        () if numbers[3] == 0.0 => Ok(format!("{function}(((X-{p7})*{p6}-{p3})/{p1})/{p2}")),
        () if numbers[0] == 0.0 => Ok(format!("{function}(({p3}/(X-{p7})-{p6})/{p4})/{p5}")),
        () => Err(Error::without_offset(format!(
            "expected P1 or P4 of an exponential or logarithmic conversion to be 0, found {} and {}",
            numbers[0], numbers[3]
        ))),
    }
}

/// A table of values, with straight lines between them or not.
fn read_point_table(block: &Mdf3Block, count: usize, lines: bool) -> Result<ValueConversion, Error> {
    let pair = |it: usize| [block.f64_at(HEAD + 16 * it), block.f64_at(HEAD + 16 * it + 8)];
    ValueConversion::from_points((0..count).map(pair).collect(), lines, block.at)
}

/// A table of texts; all other values have none.
fn read_text_table(block: &Mdf3Block, count: usize) -> ValueConversion {
    let entry = |it: usize| {
        let at = HEAD + 40 * it;
        (block.f64_at(at), ConversionTarget::Text(block.text_at(at + 8, 32)))
    };
    ValueConversion::from_keys((0..count).map(entry).collect(), ConversionTarget::Text(String::new()))
}
