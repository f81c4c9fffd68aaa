//! Parses types of connectors and values of parameters.

use std::sync::Arc;

use crate::error::mistake_error;
use crate::limits::CELLS;
use crate::unit::SspDefinitions;
use crate::xml::{self, XmlElement};
use crate::{Enumeration, Error};

/// What a connector carries, section 4.5.1. `Real` and `Integer` of version 1.0 are `Float64` and `Int32`.
#[derive(Debug, Clone, PartialEq)]
pub enum SspType {
    /// A floating point number of 64 bits.
    Float64,
    /// A floating point number of 32 bits.
    Float32,
    /// A whole number.
    Integer(IntegerWidth),
    /// A truth value.
    Boolean,
    /// A text.
    String,
    /// An item of an enumeration.
    Enumeration(Option<Arc<Enumeration>>),
    /// Bytes.
    Binary {
        /// What they are.
        mime: String,
    },
    /// A clock.
    Clock,
}

/// The size of a whole number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IntegerWidth {
    /// How many bits it has.
    pub bits: u32,
    /// Whether it can be negative.
    pub signed: bool,
}

impl IntegerWidth {
    fn can_hold(self, value: i128) -> bool {
        let (low, high) = if self.signed {
            (-(1_i128 << (self.bits - 1)), (1_i128 << (self.bits - 1)) - 1)
        } else {
            (0, (1_i128 << self.bits) - 1)
        };
        (low..=high).contains(&value)
    }
}

/// A value of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum SspValue {
    /// A floating point number.
    Real(f64),
    /// A whole number.
    Integer(i128),
    /// A truth value.
    Boolean(bool),
    /// A text.
    String(String),
    /// The name of an item of an enumeration. Its number depends on the variable that gets it.
    Enumeration(String),
    /// Bytes.
    Binary(Vec<u8>),
    /// An array, row by row.
    Array {
        /// How many elements there are in each direction.
        dimensions: Vec<usize>,
        /// The elements.
        elements: Vec<SspValue>,
    },
}

/// Names of the elements that are types.
pub(crate) const TYPES: [&str; 16] = [
    "Real",
    "Float64",
    "Float32",
    "Integer",
    "Int8",
    "UInt8",
    "Int16",
    "UInt16",
    "Int32",
    "UInt32",
    "Int64",
    "UInt64",
    "Boolean",
    "String",
    "Enumeration",
    "Binary",
];

const INTEGERS: [(&str, IntegerWidth); 9] = [
    ("Integer", IntegerWidth { bits: 32, signed: true }),
    ("Int8", IntegerWidth { bits: 8, signed: true }),
    ("UInt8", IntegerWidth { bits: 8, signed: false }),
    ("Int16", IntegerWidth { bits: 16, signed: true }),
    ("UInt16", IntegerWidth { bits: 16, signed: false }),
    ("Int32", IntegerWidth { bits: 32, signed: true }),
    ("UInt32", IntegerWidth { bits: 32, signed: false }),
    ("Int64", IntegerWidth { bits: 64, signed: true }),
    ("UInt64", IntegerWidth { bits: 64, signed: false }),
];

fn integer_width(name: &str) -> Option<IntegerWidth> {
    INTEGERS.iter().find(|(known, _)| *known == name).map(|(_, width)| *width)
}

/// The type that the element is.
pub(crate) fn parse_type(element: XmlElement, definitions: &SspDefinitions) -> SspType {
    match element.local_name() {
        "Float32" => {
            element.note_unknown_content(&[], &["unit"]);
            SspType::Float32
        }
        "Boolean" => SspType::Boolean,
        "String" => SspType::String,
        "Enumeration" => SspType::Enumeration(definitions.enumeration_of_element(element)),
        "Binary" => {
            let mime = element.attribute("mime-type").unwrap_or("application/octet-stream");
            SspType::Binary { mime: mime.to_owned() }
        }
        "Clock" => SspType::Clock,
        name => integer_width(name).map_or_else(
            || {
                element.note_unknown_content(&[], &["unit"]);
                SspType::Float64
            },
            SspType::Integer,
        ),
    }
}

/// The value of a <Parameter>, section 6.2: its element, and what it says.
pub(crate) fn parse_parameter_value<'a>(
    parameter: XmlElement<'a>,
) -> Result<(XmlElement<'a>, SspValue), Error> {
    let mut typed = parameter.standard_children().filter(|child| TYPES.contains(&child.local_name()));
    let (Some(element), None) = (typed.next(), typed.next()) else {
        let name = parameter.attribute("name").unwrap_or_default();
        let expected = "one element such as <ssv:Real value=\"1.5\"/>";
        let found = format!("none or several in the parameter `{name}`");
        return Err(mistake_error(&parameter.position(), expected, found, "write one value"));
    };
    element.note_unknown_content(&["Value"], &["value", "unit", "name", "mime-type"]);
    let cells = value_cells(element)?;
    let dimensions = parse_dimensions(parameter)?;
    let count = dimensions.iter().try_fold(1_usize, |all, size| all.checked_mul(*size));
    let count = count.filter(|count| *count <= CELLS);
    if count != Some(cells.len()) {
        let expected = count.map_or_else(|| format!("at most {CELLS} values"), format_value_count);
        let cure = "write one value, or a <Dimension size=\"...\"/> for each direction of an array";
        return Err(mistake_error(
            &element.attribute_position("value"),
            expected,
            format_value_count(cells.len()),
            cure,
        ));
    }
    let mut elements = Vec::with_capacity(cells.len());
    for (holder, text) in cells {
        elements.push(parse_cell(holder, element.local_name(), text)?);
    }
    let single = dimensions.is_empty().then(|| elements.pop()).flatten();
    Ok((element, single.unwrap_or(SspValue::Array { dimensions, elements })))
}

fn format_value_count(count: usize) -> String {
    if count == 1 { "one value".to_owned() } else { format!("{count} values") }
}

fn parse_dimensions(parameter: XmlElement) -> Result<Vec<usize>, Error> {
    let mut sizes = Vec::new();
    for dimension in parameter.children_named("Dimension") {
        dimension.note_unknown_content(&[], &["size"]);
        let size = dimension.required_attribute("size")?.trim().parse();
        sizes.push(size.map_err(|_| dimension.wrong_attribute_error("size", "a whole number such as 3"))?);
    }
    Ok(sizes)
}

/// The texts of all elements of a value, each with the element that has it as its attribute `value`.
fn value_cells<'a>(element: XmlElement<'a>) -> Result<Vec<(XmlElement<'a>, &'a str)>, Error> {
    let children: Vec<_> = element.children_named("Value").collect();
    if children.is_empty() {
        let text = element.required_attribute("value")?;
        // Texts may have spaces in them: more than one of them stand in elements of their own.
        let whole = matches!(element.local_name(), "String" | "Enumeration" | "Binary");
        let cells = text.split_ascii_whitespace().map(|text| (element, text));
        return Ok(if whole { vec![(element, text)] } else { cells.collect() });
    }
    if element.attribute("value").is_some() {
        let found = format!("{} of <Value> as well", format_value_count(children.len()));
        let cure = "remove the attribute or the elements";
        return Err(mistake_error(
            &element.attribute_position("value"),
            "the attribute value alone",
            found,
            cure,
        ));
    }
    children.into_iter().map(|child| Ok((child, child.required_attribute("value")?))).collect()
}

fn parse_cell(holder: XmlElement, name: &str, text: &str) -> Result<SspValue, Error> {
    let wrong = |expected: &str| holder.wrong_attribute_error("value", expected);
    if let Some(width) = integer_width(name) {
        let value = text.trim().parse().ok().filter(|value| width.can_hold(*value));
        return value.map(SspValue::Integer).ok_or_else(|| wrong(&format!("a whole number of {name}")));
    }
    match name {
        "Boolean" => xml::parse_bool(text).map(SspValue::Boolean).ok_or_else(|| wrong("true or false")),
        "String" => Ok(SspValue::String(text.to_owned())),
        "Enumeration" => Ok(SspValue::Enumeration(text.to_owned())),
        "Binary" => {
            parse_hex_bytes(text.trim()).map(SspValue::Binary).ok_or_else(|| wrong("hexadecimal bytes"))
        }
        _ => xml::parse_number(text).map(SspValue::Real).ok_or_else(|| wrong("a number such as 1.5e-3")),
    }
}

fn parse_hex_bytes(text: &str) -> Option<Vec<u8>> {
    let digits: Option<Vec<u8>> = text.chars().map(|x| x.to_digit(16)?.try_into().ok()).collect();
    let digits = digits?;
    let pairs = digits.len().is_multiple_of(2).then(|| digits.chunks_exact(2))?;
    Some(pairs.map(|pair| pair[0] << 4 | pair[1]).collect())
}
