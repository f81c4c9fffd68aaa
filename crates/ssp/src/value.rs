//! Parses types of connectors and values of parameters.

use std::sync::Arc;

use crate::error::mistake;
use crate::limits::CELLS;
use crate::unit::Definitions;
use crate::xml::{self, Element};
use crate::{Enumeration, Error};

/// What a connector carries, section 4.5.1. `Real` and `Integer` of version 1.0 are `Float64` and `Int32`.
#[derive(Debug, Clone, PartialEq)]
pub enum Type {
    /// A floating point number of 64 bits.
    Float64,
    /// A floating point number of 32 bits.
    Float32,
    /// A whole number.
    Integer(Width),
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
pub struct Width {
    /// How many bits it has.
    pub bits: u32,
    /// Whether it can be negative.
    pub signed: bool,
}

impl Width {
    fn holds(self, value: i128) -> bool {
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
pub enum Value {
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
        elements: Vec<Value>,
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

const INTEGERS: [(&str, Width); 9] = [
    ("Integer", Width { bits: 32, signed: true }),
    ("Int8", Width { bits: 8, signed: true }),
    ("UInt8", Width { bits: 8, signed: false }),
    ("Int16", Width { bits: 16, signed: true }),
    ("UInt16", Width { bits: 16, signed: false }),
    ("Int32", Width { bits: 32, signed: true }),
    ("UInt32", Width { bits: 32, signed: false }),
    ("Int64", Width { bits: 64, signed: true }),
    ("UInt64", Width { bits: 64, signed: false }),
];

fn width(name: &str) -> Option<Width> {
    INTEGERS.iter().find(|(known, _)| *known == name).map(|(_, width)| *width)
}

/// The type that the element is.
pub(crate) fn read_type(element: Element, definitions: &Definitions) -> Type {
    match element.name() {
        "Float32" => {
            element.known(&[], &["unit"]);
            Type::Float32
        }
        "Boolean" => Type::Boolean,
        "String" => Type::String,
        "Enumeration" => Type::Enumeration(definitions.enumeration(element)),
        "Binary" => {
            let mime = element.attribute("mime-type").unwrap_or("application/octet-stream");
            Type::Binary { mime: mime.to_owned() }
        }
        "Clock" => Type::Clock,
        name => width(name).map_or_else(
            || {
                element.known(&[], &["unit"]);
                Type::Float64
            },
            Type::Integer,
        ),
    }
}

/// The value of a <Parameter>, section 6.2: its element, and what it says.
pub(crate) fn read_value<'a>(parameter: Element<'a>) -> Result<(Element<'a>, Value), Error> {
    let mut typed = parameter.children().filter(|child| TYPES.contains(&child.name()));
    let (Some(element), None) = (typed.next(), typed.next()) else {
        let name = parameter.attribute("name").unwrap_or_default();
        let expected = "one element such as <ssv:Real value=\"1.5\"/>";
        let found = format!("none or several in the parameter `{name}`");
        return Err(mistake(&parameter.position(), expected, found, "write one value"));
    };
    element.known(&["Value"], &["value", "unit", "name", "mime-type"]);
    let cells = cells(element)?;
    let dimensions = dimensions(parameter)?;
    let count = dimensions.iter().try_fold(1_usize, |all, size| all.checked_mul(*size));
    let count = count.filter(|count| *count <= CELLS);
    if count != Some(cells.len()) {
        let expected = count.map_or_else(|| format!("at most {CELLS} values"), values);
        let cure = "write one value, or a <Dimension size=\"...\"/> for each direction of an array";
        return Err(mistake(&element.position_of("value"), expected, values(cells.len()), cure));
    }
    let mut elements = Vec::with_capacity(cells.len());
    for (holder, text) in cells {
        elements.push(cell(holder, element.name(), text)?);
    }
    let single = dimensions.is_empty().then(|| elements.pop()).flatten();
    Ok((element, single.unwrap_or(Value::Array { dimensions, elements })))
}

fn values(count: usize) -> String {
    if count == 1 { "one value".to_owned() } else { format!("{count} values") }
}

fn dimensions(parameter: Element) -> Result<Vec<usize>, Error> {
    let mut sizes = Vec::new();
    for dimension in parameter.all("Dimension") {
        dimension.known(&[], &["size"]);
        let size = dimension.required("size")?.trim().parse();
        sizes.push(size.map_err(|_| dimension.wrong("size", "a whole number such as 3"))?);
    }
    Ok(sizes)
}

/// The texts of all elements of a value, each with the element that has it as its attribute `value`.
fn cells<'a>(element: Element<'a>) -> Result<Vec<(Element<'a>, &'a str)>, Error> {
    let children: Vec<_> = element.all("Value").collect();
    if children.is_empty() {
        let text = element.required("value")?;
        // Texts may have spaces in them: more than one of them stand in elements of their own.
        let whole = matches!(element.name(), "String" | "Enumeration" | "Binary");
        let cells = text.split_ascii_whitespace().map(|text| (element, text));
        return Ok(if whole { vec![(element, text)] } else { cells.collect() });
    }
    if element.attribute("value").is_some() {
        let found = format!("{} of <Value> as well", values(children.len()));
        let cure = "remove the attribute or the elements";
        return Err(mistake(
            &element.position_of("value"),
            "the attribute value alone",
            found,
            cure,
        ));
    }
    children.into_iter().map(|child| Ok((child, child.required("value")?))).collect()
}

fn cell(holder: Element, name: &str, text: &str) -> Result<Value, Error> {
    let wrong = |expected: &str| holder.wrong("value", expected);
    if let Some(width) = width(name) {
        let value = text.trim().parse().ok().filter(|value| width.holds(*value));
        return value
            .map(Value::Integer)
            .ok_or_else(|| wrong(&format!("a whole number of {name}")));
    }
    match name {
        "Boolean" => xml::truth(text).map(Value::Boolean).ok_or_else(|| wrong("true or false")),
        "String" => Ok(Value::String(text.to_owned())),
        "Enumeration" => Ok(Value::Enumeration(text.to_owned())),
        "Binary" => bytes(text.trim()).map(Value::Binary).ok_or_else(|| wrong("hexadecimal bytes")),
        _ => xml::number(text).map(Value::Real).ok_or_else(|| wrong("a number such as 1.5e-3")),
    }
}

fn bytes(text: &str) -> Option<Vec<u8>> {
    let digits: Option<Vec<u8>> = text.chars().map(|x| x.to_digit(16)?.try_into().ok()).collect();
    let digits = digits?;
    let pairs = digits.len().is_multiple_of(2).then(|| digits.chunks_exact(2))?;
    Some(pairs.map(|pair| pair[0] << 4 | pair[1]).collect())
}
