//! Decodes primitive values of serialized messages: CDR (versions 1 and 2, both byte orders) and ROS 1.

use crate::definition::ScalarType;

/// A number of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DecodedNumber {
    /// Of integers and booleans.
    Integer(i128),
    /// Of 32 and 64 bits.
    Real(f64),
}

/// The rest of a message.
pub struct CdrReader<'d> {
    data: &'d [u8],
    at: usize,
    big: bool,
    /// The largest alignment; 1 where nothing is aligned.
    most: usize,
    /// Whether lengths stand before structures that may be extended, and before lists of what is no number.
    pub delimited: DelimiterRule,
}

/// Where the second version of CDR writes the length of what follows in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DelimiterRule {
    /// Nowhere.
    Nothing,
    /// Before lists of what is no number.
    Lists,
    /// Before structures, too.
    Structures,
}

/// How a message is serialized.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageEncoding {
    /// `cdr`, of ROS 2.
    Cdr,
    /// `ros1`.
    Ros1,
}

impl MessageEncoding {
    /// The encoding of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "cdr" => Some(MessageEncoding::Cdr),
            "ros1" => Some(MessageEncoding::Ros1),
            _ => None,
        }
    }
}

impl<'d> CdrReader<'d> {
    /// Reads the header, if there is one.
    ///
    /// # Errors
    /// When there is none, or it is of a form that is not read.
    pub fn new(encoding: MessageEncoding, data: &'d [u8]) -> Result<Self, String> {
        let plain = |data, big, most, delimited| CdrReader { data, at: 0, big, most, delimited };
        let MessageEncoding::Cdr = encoding else {
            return Ok(plain(data, false, 1, DelimiterRule::Nothing));
        };
        let Some((head, data)) = data.split_first_chunk::<4>() else {
            return Err(format!("expected the 4 bytes before a message in CDR, found {}", data.len()));
        };
        // The kinds of representation of DDS-XTypes 1.3, table 60; the last bit is that of the byte order.
        let big = head[1] & 1 == 0;
        match (head[0], head[1] & !1) {
            (0, 0x00) => Ok(plain(data, big, 8, DelimiterRule::Nothing)),
            (0, 0x06) => Ok(plain(data, big, 4, DelimiterRule::Lists)),
            (0, 0x08) => Ok(plain(data, big, 4, DelimiterRule::Structures)),
            (0, 0x02) => Err(parameter_list_error("PL_CDR")),
            (0, 0x0a) => Err(parameter_list_error("PL_CDR2")),
            _ => Err(format!(
                "expected a message in CDR, found one that begins with {:02x} {:02x}",
                head[0], head[1]
            )),
        }
    }

    /// The bytes that are left.
    pub fn remaining_bytes(&self) -> usize {
        self.data.len() - self.at
    }

    fn align_to(&mut self, bytes: usize) {
        let to = bytes.min(self.most);
        self.at = self.at.next_multiple_of(to).min(self.data.len());
    }

    fn take_bytes(&mut self, bytes: usize) -> Result<&'d [u8], String> {
        let taken = self.data[self.at..].get(..bytes).ok_or_else(|| {
            format!("it ends too early: expected {bytes} bytes more, found {}", self.remaining_bytes())
        })?;
        self.at += bytes;
        Ok(taken)
    }

    /// A number of its type.
    pub fn read_number(&mut self, scalar: ScalarType) -> Result<DecodedNumber, String> {
        let size = scalar.size_in_bytes();
        self.align_to(size.min(8));
        let mut bytes = [0; 16];
        let taken = self.take_bytes(size)?;
        if self.big {
            bytes.iter_mut().zip(taken.iter().rev()).for_each(|(to, from)| *to = *from);
        } else {
            bytes[..size].copy_from_slice(taken);
        }
        let unsigned = u128::from_le_bytes(bytes);
        Ok(match scalar {
            ScalarType::Bool => DecodedNumber::Integer(i128::from(unsigned != 0)),
            ScalarType::Integer { signed: false, .. } => DecodedNumber::Integer(unsigned as i128),
            ScalarType::Integer { bytes, signed: true } => {
                let unused = 128 - 8 * bytes as u32;
                DecodedNumber::Integer(((unsigned << unused) as i128) >> unused)
            }
            ScalarType::Single => DecodedNumber::Real(f32::from_bits(unsigned as u32).into()),
            ScalarType::Double => DecodedNumber::Real(f64::from_bits(unsigned as u64)),
            ScalarType::Quadruple => DecodedNumber::Real(f64::NAN),
        })
    }

    /// The number before a list or a text.
    pub fn read_length(&mut self) -> Result<usize, String> {
        match self.read_number(ScalarType::Integer { bytes: 4, signed: false })? {
            DecodedNumber::Integer(length) => Ok(length as usize),
            DecodedNumber::Real(_) => Ok(0),
        }
    }

    /// Skips so many numbers of a type.
    pub fn skip_numbers(&mut self, scalar: ScalarType, count: usize) -> Result<(), String> {
        if count > 0 {
            self.align_to(scalar.size_in_bytes().min(8));
            self.take_bytes(scalar.size_in_bytes().saturating_mul(count))?;
        }
        Ok(())
    }

    /// The bytes of a text; the zero behind them is none of them.
    pub fn read_text_bytes(&mut self) -> Result<&'d [u8], String> {
        let length = self.read_length()?;
        let bytes = self.take_bytes(length)?;
        Ok(match self.most {
            1 => bytes,
            _ => bytes.strip_suffix(&[0]).unwrap_or(bytes),
        })
    }

    /// A text of letters of 32 bits, as the writers of ROS 2 make it of one of 16 bits.
    pub fn wide_text(&mut self) -> Result<String, String> {
        let length = self.read_length()?;
        let bytes = self.take_bytes(length.saturating_mul(4))?;
        let (letters, _) = bytes.as_chunks::<4>();
        let letter = |bytes: &[u8; 4]| match self.big {
            true => u32::from_be_bytes(*bytes) as u16,
            false => u32::from_le_bytes(*bytes) as u16,
        };
        let letters = char::decode_utf16(letters.iter().map(letter));
        Ok(letters.map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER)).collect())
    }
}

fn parameter_list_error(name: &str) -> String {
    format!(
        "it is a list of parameters ({name}), which cannot be read here: expected CDR, plain or delimited; record the \
         topic by another middleware (RMW_IMPLEMENTATION), or convert the bag"
    )
}
