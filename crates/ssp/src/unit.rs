//! Parses units and enumerations that a file defines.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::Error;
use crate::error::mistake_error;
use crate::xml::XmlElement;

/// A unit by the name that a file gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct SspUnit {
    /// Its name.
    pub name: String,
    /// What it is in SI units; `None` when the file uses the name without a definition.
    pub base: Option<BaseUnit>,
}

/// A unit in SI units, section 4.4.2.1: `SI value = factor * value + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseUnit {
    /// Exponents of kg, m, s, A, K, mol, cd and rad.
    pub exponents: [i32; 8],
    /// Factor.
    pub factor: f64,
    /// Offset.
    pub offset: f64,
}

/// Names of the exponents of [`BaseUnit`].
pub const BASES: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

impl SspUnit {
    /// Factor and offset that make a value of `other` from a value of this unit: `factor * value + offset`.
    /// `None` when one of them is undefined, or when their dimensions differ.
    #[must_use]
    pub fn conversion_to(&self, other: &SspUnit) -> Option<(f64, f64)> {
        if self == other {
            return Some((1.0, 0.0));
        }
        let (from, to) = (self.base?, other.base?);
        if from.exponents != to.exponents {
            return None;
        }
        let (factor, offset) = (from.factor / to.factor, (from.offset - to.offset) / to.factor);
        (factor.is_finite() && offset.is_finite()).then_some((factor, offset))
    }
}

/// An enumeration by the name that a file gives it.
#[derive(Debug, Clone, PartialEq)]
pub struct Enumeration {
    /// Its name.
    pub name: String,
    /// Names and numbers of its items; empty when the file uses the name without a definition.
    pub items: Vec<(String, i64)>,
}

/// Units and enumerations of a file, section 4.4.
#[derive(Debug, Default)]
pub(crate) struct SspDefinitions {
    units: BTreeMap<String, Arc<SspUnit>>,
    enumerations: BTreeMap<String, Arc<Enumeration>>,
}

impl SspDefinitions {
    /// Reads what the outermost element of a file defines.
    pub(crate) fn read(root: XmlElement) -> Result<Self, Error> {
        let mut definitions = SspDefinitions::default();
        for element in root.listed_children("Units", "Unit")? {
            let unit = parse_unit_definition(element)?;
            let name = unit.name.clone();
            if definitions.units.insert(name, Arc::new(unit)).is_some() {
                return Err(duplicate_definition_error(element));
            }
        }
        for element in root.listed_children("Enumerations", "Enumeration")? {
            let enumeration = parse_enumeration_definition(element)?;
            let name = enumeration.name.clone();
            if definitions.enumerations.insert(name, Arc::new(enumeration)).is_some() {
                return Err(duplicate_definition_error(element));
            }
        }
        Ok(definitions)
    }

    /// The unit that an element names.
    pub(crate) fn unit_of_element(&self, element: XmlElement) -> Option<Arc<SspUnit>> {
        let name = element.attribute("unit").filter(|name| !name.is_empty())?;
        Some(self.units.get(name).map_or_else(
            || {
                let position = element.attribute_position("unit");
                element
                    .reading_notes()
                    .add_note(|| format!("{position}: the file does not define the unit `{name}`"));
                Arc::new(SspUnit { name: name.to_owned(), base: None })
            },
            Arc::clone,
        ))
    }

    /// The enumeration that an element names.
    pub(crate) fn enumeration_of_element(&self, element: XmlElement) -> Option<Arc<Enumeration>> {
        let name = element.attribute("name").filter(|name| !name.is_empty())?;
        Some(self.enumerations.get(name).map_or_else(
            || {
                let position = element.attribute_position("name");
                element
                    .reading_notes()
                    .add_note(|| format!("{position}: the file does not define the enumeration `{name}`"));
                Arc::new(Enumeration { name: name.to_owned(), items: Vec::new() })
            },
            Arc::clone,
        ))
    }
}

fn duplicate_definition_error(element: XmlElement) -> Error {
    let name = element.attribute("name").unwrap_or_default();
    let found = format!("a second <{}> called `{name}`", element.local_name());
    mistake_error(&element.attribute_position("name"), "a name of its own", found, "remove one of them")
}

fn parse_unit_definition(element: XmlElement) -> Result<SspUnit, Error> {
    element.note_unknown_content(&["BaseUnit"], &["name"]);
    let name = element.required_attribute("name")?.to_owned();
    let Some(base) = element.only_child("BaseUnit")? else {
        return Ok(SspUnit { name, base: None });
    };
    base.note_unknown_content(&[], &[&BASES[..], &["factor", "offset"]].concat());
    let mut exponents = [0; 8];
    for (exponent, name) in exponents.iter_mut().zip(BASES) {
        if let Some(text) = base.attribute(name) {
            let wrong = |_| base.wrong_attribute_error(name, "a whole number of -127 to 127");
            *exponent = text.trim().parse::<i8>().map_err(wrong)?.into();
        }
    }
    let factor = base.number_attribute("factor")?.unwrap_or(1.0);
    // Beyond these sizes conversions would overflow, or give 0.
    let is_size = |number: f64| (1e-150..=1e150).contains(&number.abs());
    if !is_size(factor) {
        return Err(
            base.wrong_attribute_error("factor", "a number of 1e-150 to 1e150, or such a negative one")
        );
    }
    let offset = base.number_attribute("offset")?.unwrap_or(0.0);
    if offset != 0.0 && !is_size(offset) {
        return Err(
            base.wrong_attribute_error("offset", "0 or a number of 1e-150 to 1e150, or such a negative one")
        );
    }
    Ok(SspUnit { name, base: Some(BaseUnit { exponents, factor, offset }) })
}

fn parse_enumeration_definition(element: XmlElement) -> Result<Enumeration, Error> {
    element.note_unknown_content(&["Item"], &["name"]);
    let name = element.required_attribute("name")?.to_owned();
    let mut items = Vec::new();
    for item in element.children_named("Item") {
        item.note_unknown_content(&[], &["name", "value"]);
        let value = item.required_attribute("value")?.trim().parse();
        let value = value.map_err(|_| item.wrong_attribute_error("value", "a whole number"))?;
        items.push((item.required_attribute("name")?.to_owned(), value));
    }
    Ok(Enumeration { name, items })
}
