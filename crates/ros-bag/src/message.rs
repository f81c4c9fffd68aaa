//! Deserializes messages by their definition into a tree of values.

use crate::cdr::{CdrReader, DelimiterRule, Encoding, WireNumber};
use crate::definition::{Definition, Type};

/// Lists of up to so many elements are read; longer ones are counted.
pub const LONGEST: usize = 64;
/// So many values of a message are read at most; lists behind them are counted.
const MOST: usize = 1 << 16;

/// What stands in a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Of integers and booleans.
    Integer(i128),
    /// Of 32 and 64 bits.
    Real(f64),
    /// What is no UTF-8 has U+FFFD in its place.
    Text(String),
    /// The fields of a structure.
    Struct(Vec<Value>),
    /// The elements of a list.
    List(Vec<Value>),
    /// A list of so many elements, which are not read.
    Long(usize),
}

impl Value {
    /// What lies on a way of fields and elements.
    #[must_use]
    pub fn get(&self, way: &[usize]) -> Option<&Value> {
        way.iter().try_fold(self, |value, index| match value {
            Value::Struct(values) | Value::List(values) => values.get(*index),
            _ => None,
        })
    }
}

impl Definition {
    /// Reads a message.
    ///
    /// # Errors
    /// When it does not fit the definition.
    pub fn read(&self, encoding: Encoding, data: &[u8]) -> Result<Value, String> {
        let wire = CdrReader::new(encoding, data)?;
        let mut reader = Reader { definition: self, wire, read: 0 };
        let value = reader.value(&Type::Struct(self.root()), true)?;
        let left = reader.wire.left();
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

struct Reader<'d> {
    definition: &'d Definition,
    wire: CdrReader<'d>,
    /// The values that were kept.
    read: usize,
}

impl Reader<'_> {
    /// The next value; without `keep` it is skipped.
    fn value(&mut self, kind: &Type, keep: bool) -> Result<Value, String> {
        self.read += usize::from(keep);
        match kind {
            Type::Scalar(scalar) => Ok(match self.wire.number(*scalar)? {
                WireNumber::Integer(number) => Value::Integer(number),
                WireNumber::Real(number) => Value::Real(number),
            }),
            Type::Text => {
                let bytes = self.wire.text()?;
                let text =
                    if keep { String::from_utf8_lossy(bytes).into_owned() } else { String::new() };
                Ok(Value::Text(text))
            }
            Type::WideText => self.wire.wide_text().map(Value::Text),
            Type::Struct(index) => {
                if self.wire.delimited == DelimiterRule::Structures {
                    self.wire.length()?;
                }
                let definition = self.definition;
                // Structures of nothing may lie in each other billions of times.
                if definition.structs[*index].least_bytes == 0 {
                    return Ok(Value::Struct(Vec::new()));
                }
                let mut values = Vec::new();
                for field in &definition.structs[*index].fields {
                    let value = self.value(&field.kind, keep)?;
                    if keep {
                        values.push(value);
                    }
                }
                Ok(Value::Struct(values))
            }
            Type::Array(inner, count) => {
                self.delimiter(inner)?;
                self.list(inner, *count, keep)
            }
            Type::Sequence(inner) => {
                self.delimiter(inner)?;
                let count = self.wire.length()?;
                self.list(inner, count, keep)
            }
        }
    }

    /// The length in bytes before a list of what is no number.
    fn delimiter(&mut self, inner: &Type) -> Result<(), String> {
        if self.wire.delimited != DelimiterRule::Nothing && !matches!(inner, Type::Scalar(_)) {
            self.wire.length()?;
        }
        Ok(())
    }

    fn list(&mut self, inner: &Type, count: usize, keep: bool) -> Result<Value, String> {
        let keep = keep && count <= LONGEST && self.read < MOST;
        let least = self.definition.least_bytes(inner);
        if least.saturating_mul(count) > self.wire.left() {
            return Err(format!(
                "it ends too early: expected a list of {count} elements, found {} bytes",
                self.wire.left()
            ));
        }
        match inner {
            Type::Scalar(scalar) if !keep => self.wire.skip(*scalar, count)?,
            // What takes no bytes is no signal either, and there may be billions of it.
            _ if least == 0 => {}
            _ if !keep => (0..count).try_for_each(|_| self.value(inner, false).map(drop))?,
            _ => {
                let values = (0..count).map(|_| self.value(inner, true));
                return values.collect::<Result<_, _>>().map(Value::List);
            }
        }
        Ok(Value::Long(count))
    }
}
