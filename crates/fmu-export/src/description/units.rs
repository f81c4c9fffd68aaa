//! Writes the units of a description, with the units in which people read.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{self, Write};

use super::{DescribedVariable, XmlEscaped};
use crate::unit::{self, Unit};
use crate::variable::{VariableKind, VariableRow};

/// Units in which people read what is computed in the unit on the left.
const DISPLAY_UNITS: [(&str, &str); 7] = [
    ("rad", "deg"),
    ("rad/s", "deg/s"),
    ("rad/s2", "deg/s2"),
    ("m/s", "km/h"),
    ("K", "degC"),
    ("Pa", "bar"),
    ("J", "kWh"),
];

pub(super) fn write_units(out: &mut dyn Write, rows: &[DescribedVariable]) -> fmt::Result {
    let mut units = BTreeMap::<&str, BTreeSet<&str>>::new();
    for DescribedVariable { row, .. } in rows.iter().filter(|variable| has_unit(variable)) {
        units.entry(row.unit).or_default().extend(display_unit(row));
    }
    if units.is_empty() {
        return Ok(());
    }
    writeln!(out, "  <UnitDefinitions>")?;
    for (name, displayed) in units {
        writeln!(out, r#"    <Unit name="{}">"#, XmlEscaped(name))?;
        // A name that is not understood is written without base unit; `problems` reports it.
        if let Ok(unit) = Unit::parse(name) {
            write_base_unit(out, &unit)?;
            for display in displayed {
                write_display_unit(out, &unit, display)?;
            }
        }
        writeln!(out, "    </Unit>")?;
    }
    writeln!(out, "  </UnitDefinitions>")
}

fn write_base_unit(out: &mut dyn Write, unit: &Unit) -> fmt::Result {
    write!(out, "      <BaseUnit")?;
    for (base, exponent) in unit::BASE.iter().zip(unit.exponents) {
        if exponent != 0 {
            write!(out, r#" {base}="{exponent}""#)?;
        }
    }
    if unit.factor != 1.0 {
        write!(out, r#" factor="{}""#, unit.factor)?;
    }
    if unit.offset != 0.0 {
        write!(out, r#" offset="{}""#, unit.offset)?;
    }
    writeln!(out, "/>")
}

/// Value in the display unit = factor * value in the unit + offset (FMI 2.0, section 2.2.2).
fn write_display_unit(out: &mut dyn Write, unit: &Unit, display: &str) -> fmt::Result {
    let conversion = Unit::parse(display).ok().and_then(|to| Unit::conversion(unit, &to));
    let Some((factor, offset)) = conversion else { return Ok(()) };
    write!(out, r#"      <DisplayUnit name="{}" factor="{factor}""#, XmlEscaped(display))?;
    if offset != 0.0 {
        write!(out, r#" offset="{offset}""#)?;
    }
    writeln!(out, "/>")
}

pub(super) fn has_unit(DescribedVariable { row, kind, .. }: &DescribedVariable) -> bool {
    *kind == VariableKind::Real && !row.unit.is_empty()
}

/// The unit that a variable is shown in, unless it is the one that it is in.
pub(super) fn display_unit(row: &VariableRow) -> Option<&'static str> {
    let usual = DISPLAY_UNITS.iter().find(|(from, _)| *from == row.unit).map(|(_, to)| *to);
    row.display_unit.or(usual).filter(|display| *display != row.unit)
}
