//! Takes values out of records: integers of any bits and either order of bytes, floating-point numbers, texts.

use crate::text::{decoded, latin};

/// Where a value is in a record, and how it is stored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Field {
    /// Its first byte.
    pub byte: usize,
    /// The lowest bit within that.
    pub bit: u32,
    /// Its length.
    pub bits: u32,
    pub form: Form,
    /// Whether the highest byte comes first.
    pub big: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    Unsigned,
    Signed,
    Float,
    Text(Coding),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coding {
    Latin,
    Utf8,
    Utf16,
    /// A mark at the beginning tells it.
    Marked,
}

impl Field {
    /// The field of a channel, or why it cannot be read.
    pub fn new(kind: u8, [byte, bit, bits]: [u32; 3]) -> Result<Self, String> {
        let big = matches!(kind, 1 | 3 | 5 | 9);
        let form = match kind {
            0 | 1 => Form::Unsigned,
            2 | 3 => Form::Signed,
            4 | 5 => Form::Float,
            6 => Form::Text(Coding::Latin),
            7 => Form::Text(Coding::Utf8),
            8 | 9 => Form::Text(Coding::Utf16),
            17 => Form::Text(Coding::Marked),
            10 => return Err("bytes without a meaning".to_owned()),
            11 | 12 => return Err("media such as pictures or sound".to_owned()),
            13 | 14 => return Err("dates of CANopen".to_owned()),
            15 | 16 => return Err("complex numbers".to_owned()),
            other => return Err(format!("the unknown type of data {other}")),
        };
        let sound = match form {
            Form::Float => matches!(bits, 16 | 32 | 64),
            Form::Text(_) => bits % 8 == 0 && bit == 0,
            _ => (1..=64).contains(&bits),
        };
        if !sound || bit > 7 {
            return Err(format!(
                "a value of {bits} bits from bit {bit} on, which its type does not have"
            ));
        }
        Ok(Self { byte: byte as usize, bit, bits, form, big })
    }

    /// The bytes that it takes of a record.
    pub fn bytes(&self) -> usize {
        (self.bit as usize + self.bits as usize).div_ceil(8)
    }

    /// Whether it is an integer that a double may round.
    pub fn is_wide(&self) -> bool {
        match self.form {
            Form::Unsigned => self.bits > 53,
            Form::Signed => self.bits > 54,
            _ => false,
        }
    }

    /// Whether its values are integers.
    pub fn is_whole(&self) -> bool {
        matches!(self.form, Form::Unsigned | Form::Signed)
    }

    pub fn is_text(&self) -> bool {
        matches!(self.form, Form::Text(_))
    }

    /// Its bits in a record, with zeros above.
    fn raw(&self, record: &[u8]) -> u64 {
        let bytes = record.get(self.byte..).unwrap_or_default();
        let bytes = bytes.get(..self.bytes()).unwrap_or_default();
        let add = |all: u128, byte: &u8| all << 8 | u128::from(*byte);
        let all = match self.big {
            true => bytes.iter().fold(0, add),
            false => bytes.iter().rev().fold(0, add),
        };
        (all >> self.bit) as u64 & (u64::MAX >> (64 - self.bits))
    }

    /// Its integer.
    pub fn integer(&self, record: &[u8]) -> i128 {
        let raw = self.raw(record);
        match self.form {
            Form::Signed => {
                let above = 64 - self.bits;
                i128::from((raw << above).cast_signed() >> above)
            }
            _ => i128::from(raw),
        }
    }

    /// Its number, as a double.
    pub fn number(&self, record: &[u8]) -> f64 {
        match (self.form, self.bits) {
            (Form::Float, 64) => f64::from_bits(self.raw(record)),
            (Form::Float, 32) => f64::from(f32::from_bits(self.raw(record) as u32)),
            (Form::Float, _) => half(self.raw(record) as u16),
            (Form::Unsigned, _) => self.raw(record) as f64,
            (Form::Signed, _) => self.integer(record) as f64,
            (Form::Text(_), _) => f64::NAN,
        }
    }

    /// Its text, of at most so many bytes.
    pub fn text(&self, record: &[u8], most: usize) -> String {
        let bytes = record.get(self.byte..).unwrap_or_default();
        self.decoded(&bytes[..bytes.len().min(self.bytes()).min(most)])
    }

    /// The text of bytes, up to the first zero.
    pub fn decoded(&self, bytes: &[u8]) -> String {
        let Form::Text(coding) = self.form else { return String::new() };
        let narrow = |bytes: &[u8]| bytes.iter().position(|it| *it == 0).unwrap_or(bytes.len());
        match coding {
            Coding::Latin => latin(&bytes[..narrow(bytes)]),
            Coding::Utf8 => decoded(&bytes[..narrow(bytes)]),
            Coding::Utf16 => wide(bytes, self.big),
            Coding::Marked => match bytes {
                [0xff, 0xfe, rest @ ..] => wide(rest, false),
                [0xfe, 0xff, rest @ ..] => wide(rest, true),
                [0xef, 0xbb, 0xbf, rest @ ..] => decoded(&rest[..narrow(rest)]),
                _ => decoded(&bytes[..narrow(bytes)]),
            },
        }
    }
}

fn wide(bytes: &[u8], big: bool) -> String {
    let pair = |it: &[u8]| match big {
        true => u16::from_be_bytes([it[0], it[1]]),
        false => u16::from_le_bytes([it[0], it[1]]),
    };
    let units = bytes.chunks_exact(2).map(pair).take_while(|it| *it != 0);
    let characters = char::decode_utf16(units);
    characters.map(|it| it.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

/// A floating-point number of 16 bits (IEEE 754 binary16).
fn half(raw: u16) -> f64 {
    let (exponent, fraction) = (i32::from(raw >> 10 & 31), f64::from(raw & 1023));
    let size = match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1024.0 + fraction) * 2f64.powi(exponent - 25),
    };
    if raw >> 15 == 1 { -size } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(kind: u8, byte: u32, bit: u32, bits: u32) -> Field {
        Field::new(kind, [byte, bit, bits]).expect("a field")
    }

    #[test]
    fn integers_of_any_bits_are_exact() {
        let record = [0b1010_0000, 0b0000_0110, 0xff, 0x01, 2, 3, 4, 5, 6, 7, 8, 0x80];
        assert_eq!(field(0, 0, 5, 6).integer(&record), 0b11_0101);
        assert_eq!(field(2, 0, 5, 6).integer(&record), -11);
        assert_eq!(field(1, 3, 0, 16).integer(&record), 0x0102);
        assert_eq!(field(0, 3, 0, 64).integer(&record), 0x0807_0605_0403_0201);
        // Nine bytes: 64 bits from bit 4 on.
        assert_eq!(field(0, 3, 4, 64).integer(&record), 0x0080_7060_5040_3020_u64.into());
        assert_eq!(field(3, 11, 0, 8).integer(&record), -128);
    }

    #[test]
    fn numbers_of_all_lengths_are_doubles() {
        assert_eq!(field(4, 0, 0, 16).number(&[0x00, 0xc5]), -5.0);
        assert_eq!(field(5, 0, 0, 16).number(&[0x00, 0x01]), 2f64.powi(-24));
        assert_eq!(field(4, 0, 0, 16).number(&[0x00, 0x7c]), f64::INFINITY);
        assert_eq!(field(5, 0, 0, 32).number(&1.5f32.to_be_bytes()), 1.5);
        assert_eq!(field(4, 0, 0, 64).number(&0.1f64.to_le_bytes()), 0.1);
    }

    #[test]
    fn texts_of_all_codings_end_at_a_zero() {
        let of = |kind: u8, bytes: &[u8]| field(kind, 0, 0, 8 * bytes.len() as u32).text(bytes, 99);
        assert_eq!(of(6, b"\xb0C\0x"), "°C");
        assert_eq!(of(7, "°C\0x".as_bytes()), "°C");
        assert_eq!(of(8, b"a\0\xb0\0\0\0x\0"), "a°");
        assert_eq!(of(9, b"\0a\0\xb0\0"), "a°");
        assert_eq!(of(17, b"\xfe\xff\0a"), "a");
    }

    #[test]
    fn what_no_type_has_is_refused() {
        assert!(Field::new(0, [0, 0, 65]).is_err() && Field::new(0, [0, 0, 0]).is_err());
        assert!(Field::new(4, [0, 0, 24]).is_err() && Field::new(0, [0, 8, 8]).is_err());
        assert!(Field::new(10, [0, 0, 8]).is_err() && Field::new(99, [0, 0, 8]).is_err());
    }
}
