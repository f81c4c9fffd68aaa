//! Collects the units and enumerations that an SSP export defines, each under a unique name.

use std::sync::Arc;

use fmu_import::Variable;
use fmu_import::description::{Storage, Type};
use ssp::{BaseUnit, Enumeration, Unit, Width};

/// What connectors name.
#[derive(Default)]
pub(super) struct Definitions {
    pub units: Vec<Arc<Unit>>,
    enumerations: Vec<Arc<Enumeration>>,
}

impl Definitions {
    /// The name under which a unit is defined. Two FMUs may mean different things by one name.
    pub fn unit(&mut self, node: &str, name: &str, unit: units::Unit) -> String {
        let exponents = unit.exponents.map(i32::from);
        let base = Some(BaseUnit { exponents, factor: unit.factor, offset: unit.offset });
        let mut name = name.to_owned();
        loop {
            match self.units.iter().find(|known| known.name == name) {
                Some(known) if known.base == base => return name,
                Some(_) => name = format!("{name} of {node}"),
                None => {
                    self.units.push(Arc::new(Unit { name: name.clone(), base }));
                    return name;
                }
            }
        }
    }

    /// The unit that is defined under a name.
    pub fn find(&self, name: Option<&str>) -> Option<&Unit> {
        self.units.iter().find(|unit| Some(unit.name.as_str()) == name).map(|unit| &**unit)
    }

    /// The type of a variable; none for a clock.
    pub fn carries(&mut self, node: &str, variable: &Variable) -> Option<ssp::Type> {
        let integer = |bits, signed| ssp::Type::Integer(Width { bits, signed });
        if variable.kind == Type::Enumeration && !variable.items.is_empty() {
            let items = variable.items.iter().map(|item| (item.name.clone(), item.value));
            return Some(self.enumeration(node, &variable.name, items.collect()));
        }
        Some(match variable.storage {
            Storage::Float64 => ssp::Type::Float64,
            Storage::Float32 => ssp::Type::Float32,
            Storage::Int8 => integer(8, true),
            Storage::UInt8 => integer(8, false),
            Storage::Int16 => integer(16, true),
            Storage::UInt16 => integer(16, false),
            Storage::Int32 => integer(32, true),
            Storage::UInt32 => integer(32, false),
            Storage::Int64 => integer(64, true),
            Storage::UInt64 => integer(64, false),
            Storage::Boolean => ssp::Type::Boolean,
            Storage::String => ssp::Type::String,
            Storage::Binary => ssp::Type::Binary { mime: "application/octet-stream".to_owned() },
            Storage::Clock => return None,
        })
    }

    fn enumeration(&mut self, node: &str, name: &str, items: Vec<(String, i64)>) -> ssp::Type {
        let known = self.enumerations.iter().find(|known| known.items == items).cloned();
        let found = known.unwrap_or_else(|| {
            let name = format!("{node}.{name}");
            let made = Arc::new(Enumeration { name, items });
            self.enumerations.push(Arc::clone(&made));
            made
        });
        ssp::Type::Enumeration(Some(found))
    }
}
