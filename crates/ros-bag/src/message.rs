//! Deserializes messages by their definition into a tree of values.

use crate::cdr::{CdrReader, DecodedNumber, DelimiterRule, MessageEncoding};
use crate::definition::{FieldType, MessageDefinition};

/// Lists of up to so many elements are read; longer ones are counted.
pub const LONGEST: usize = 64;
/// So many values of a message are read at most; lists behind them are counted.
const MOST: usize = 1 << 16;

/// What stands in a message.
#[derive(Clone, Debug, PartialEq)]
pub enum MessageValue {
    /// Of integers and booleans.
    Integer(i128),
    /// Of 32 and 64 bits.
    Real(f64),
    /// What is no UTF-8 has U+FFFD in its place.
    Text(String),
    /// The fields of a structure.
    Struct(Vec<MessageValue>),
    /// The elements of a list.
    List(Vec<MessageValue>),
    /// A list of so many elements, which are not read.
    Long(usize),
}

impl MessageValue {
    /// What lies on a way of fields and elements.
    #[must_use]
    pub fn get_at_path(&self, way: &[usize]) -> Option<&MessageValue> {
        way.iter().try_fold(self, |value, index| match value {
            MessageValue::Struct(values) | MessageValue::List(values) => values.get(*index),
            _ => None,
        })
    }
}

impl MessageDefinition {
    /// Reads a message.
    ///
    /// # Errors
    /// When it does not fit the definition.
    pub fn decode_message(&self, encoding: MessageEncoding, data: &[u8]) -> Result<MessageValue, String> {
        let wire = CdrReader::new(encoding, data)?;
        let mut reader = ValueDecoder { definition: self, wire, read: 0 };
        let value = reader.read_value(&FieldType::Struct(self.root_struct_index()), true)?;
        let left = reader.wire.remaining_bytes();
        // Writers fill a message up to a multiple of 4 bytes.
        if self.assumed && left > 3 {
            return Err(format!(
                "{left} bytes are left over, so its type is of another release than the definition that is known here; \
                 `ros2 bag convert` writes a bag with definitions where that release is installed"
            ));
        }
        Ok(value)
    }
}

struct ValueDecoder<'d> {
    definition: &'d MessageDefinition,
    wire: CdrReader<'d>,
    /// The values that were kept.
    read: usize,
}

impl ValueDecoder<'_> {
    /// The next value; without `keep` it is skipped.
    fn read_value(&mut self, kind: &FieldType, keep: bool) -> Result<MessageValue, String> {
        self.read += usize::from(keep);
        match kind {
            FieldType::Scalar(scalar) => Ok(match self.wire.read_number(*scalar)? {
                DecodedNumber::Integer(number) => MessageValue::Integer(number),
                DecodedNumber::Real(number) => MessageValue::Real(number),
            }),
            FieldType::Text => {
                let bytes = self.wire.read_text_bytes()?;
                let text = if keep { String::from_utf8_lossy(bytes).into_owned() } else { String::new() };
                Ok(MessageValue::Text(text))
            }
            FieldType::WideText => self.wire.wide_text().map(MessageValue::Text),
            FieldType::Struct(index) => {
                if self.wire.delimited == DelimiterRule::Structures {
                    self.wire.read_length()?;
                }
                let definition = self.definition;
                // Structures of nothing may lie in each other billions of times.
                if definition.structs[*index].least_bytes == 0 {
                    return Ok(MessageValue::Struct(Vec::new()));
                }
                let mut values = Vec::new();
                for field in &definition.structs[*index].fields {
                    let value = self.read_value(&field.kind, keep)?;
                    if keep {
                        values.push(value);
                    }
                }
                Ok(MessageValue::Struct(values))
            }
            FieldType::Array(inner, count) => {
                self.skip_list_delimiter(inner)?;
                self.read_list(inner, *count, keep)
            }
            FieldType::Sequence(inner) => {
                self.skip_list_delimiter(inner)?;
                let count = self.wire.read_length()?;
                self.read_list(inner, count, keep)
            }
        }
    }

    /// The length in bytes before a list of what is no number.
    fn skip_list_delimiter(&mut self, inner: &FieldType) -> Result<(), String> {
        if self.wire.delimited != DelimiterRule::Nothing && !matches!(inner, FieldType::Scalar(_)) {
            self.wire.read_length()?;
        }
        Ok(())
    }

    fn read_list(&mut self, inner: &FieldType, count: usize, keep: bool) -> Result<MessageValue, String> {
        let keep = keep && count <= LONGEST && self.read < MOST;
        let least = self.definition.min_encoded_bytes(inner);
        if least.saturating_mul(count) > self.wire.remaining_bytes() {
            return Err(format!(
                "it ends too early: expected a list of {count} elements, found {} bytes",
                self.wire.remaining_bytes()
            ));
        }
        match inner {
            FieldType::Scalar(scalar) if !keep => self.wire.skip_numbers(*scalar, count)?,
            // What takes no bytes is no signal either, and there may be billions of it.
            _ if least == 0 => {}
            _ if !keep => (0..count).try_for_each(|_| self.read_value(inner, false).map(drop))?,
            _ => {
                let values = (0..count).map(|_| self.read_value(inner, true));
                return values.collect::<Result<_, _>>().map(MessageValue::List);
            }
        }
        Ok(MessageValue::Long(count))
    }
}
