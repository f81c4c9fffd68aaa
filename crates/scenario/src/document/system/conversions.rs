//! Translates the unit conversion, type conversion and transformation of an SSP connection into keys of `[[connect]]`.

use diagnostics::Error;
use fmu_import::description::{FmiType, Variable};
use ssp::{SignalConversion, ValueTransformation};
use units::Unit;

use super::error_at;

fn is_numeric(of: FmiType) -> bool {
    !matches!(of, FmiType::String | FmiType::Binary)
}

/// What stands in a connection besides its ends.
pub(super) fn conversion_keys(
    way: &SignalConversion,
    source: &Variable,
    target: &Variable,
) -> Result<String, Error> {
    let convert = match (source.kind, target.kind) {
        (a, b) if a == b => "",
        (FmiType::Boolean, FmiType::Integer) => "\nconvert = \"boolean_to_integer\"",
        (FmiType::Integer, FmiType::Boolean) => "\nconvert = \"integer_to_boolean\"",
        (FmiType::Enumeration, FmiType::Integer) => "\nconvert = \"enumeration_to_integer\"",
        (FmiType::Integer, FmiType::Enumeration) => "\nconvert = \"integer_to_enumeration\"",
        (FmiType::Integer, FmiType::Real) => "\nconvert = \"integer_to_real\"",
        (a, b) => {
            let message = format!("expected connectors of one type, found {a:?} and {b:?}");
            return Err(error_at(&way.position, message));
        }
    };
    if !is_numeric(target.kind) {
        return match way.transformation.is_identity() {
            true => Ok(String::new()),
            false => Err(error_at(&way.position, "expected numbers for a transformation, found texts")),
        };
    }
    let (factor, offset) = connection_unit_conversion(way, source, target)?;
    let transform = match &way.transformation {
        ValueTransformation::Linear { factor: f, offset: o } => {
            format!("factor = {:?}, offset = {:?}", f * factor, f * offset + o)
        }
        ValueTransformation::Boolean(map) => {
            let number = |truth: bool| f64::from(u8::from(truth));
            map_pairs_toml(map.iter().map(|(a, b)| [number(*a), number(*b)]))
        }
        ValueTransformation::Integer(map) => map_pairs_toml(map.iter().map(|(a, b)| [*a as f64, *b as f64])),
        ValueTransformation::Enumeration(map) => {
            let item = |variable: &Variable, name: &str| {
                let found = variable.items.iter().find(|item| item.name == *name);
                found.map(|item| item.value as f64).ok_or_else(|| {
                    error_at(&way.position, format!("`{}` has no item `{name}`", variable.name))
                })
            };
            let mapped = map.iter().map(|(a, b)| Ok([item(source, a)?, item(target, b)?]));
            map_pairs_toml(mapped.collect::<Result<Vec<_>, Error>>()?.into_iter())
        }
    };
    Ok(format!("\ntransform = {{ {transform} }}{convert}"))
}

fn map_pairs_toml(pairs: impl Iterator<Item = [f64; 2]>) -> String {
    let pairs: Vec<_> = pairs.map(|[from, to]| format!("[{from:?}, {to:?}]")).collect();
    format!("map = [{}]", pairs.join(", "))
}

/// The unit of a connector, or else that of the variable behind it, with a name for messages.
pub(super) fn connector_unit(of: Option<&ssp::SspUnit>, variable: &Variable) -> Option<(Unit, String)> {
    match of {
        Some(unit) => Some((variable.offset_free_unit(unit_from_ssp(unit)?), unit.name.clone())),
        None => Some((variable.dimension?, variable.unit.clone().unwrap_or_default())),
    }
}

pub(super) fn unit_from_ssp(unit: &ssp::SspUnit) -> Option<Unit> {
    let Some(base) = unit.base else { return Unit::parse(&unit.name).ok() };
    let exponents = base.exponents.map(|exponent| i8::try_from(exponent).unwrap_or(i8::MAX));
    // The reader of the system has refused what cannot convert.
    Unit::try_from_base(exponents, base.factor, base.offset).ok()
}

/// Factor and offset between the units of both ends; a unit that nobody knows is left as it is.
pub(super) fn connection_unit_conversion(
    way: &SignalConversion,
    source: &Variable,
    target: &Variable,
) -> Result<(f64, f64), Error> {
    let same = (1.0, 0.0);
    let (from, to) = &way.units;
    let units = (connector_unit(from.as_deref(), source), connector_unit(to.as_deref(), target));
    let (Some((a, from)), Some((b, to))) = units else { return Ok(same) };
    if way.suppress_unit_conversion || source.kind != FmiType::Real {
        return Ok(same);
    }
    let shifted = |unit: &Unit, it: &Variable| it.relative.unwrap_or(unit.offset) != 0.0;
    if source.relative.is_some() != target.relative.is_some() && (shifted(&a, source) || shifted(&b, target))
    {
        let (one, other) = (&source.name, &target.name);
        let message = format!(
            "`{one}` [{from}] and `{other}` [{to}]: one is a difference (relativeQuantity), the other a point on a scale with a shifted zero: connect two of one sort, or set suppressUnitConversion"
        );
        return Err(error_at(&way.position, message));
    }
    let found = Unit::conversion(&a, &b).ok_or_else(|| {
        let message = format!(
            "expected units of one dimension, found [{from}] ({}) and [{to}] ({}): correct one of them, or set suppressUnitConversion",
            a.dimension_text(),
            b.dimension_text()
        );
        error_at(&way.position, message)
    })?;
    match way.assumes_equal_units && found != same {
        true => Err(error_at(
            &way.position,
            format!(
                "expected equal units at both ends, found [{from}] and [{to}]: give the connectors between them units"
            ),
        )),
        false => Ok(found),
    }
}
