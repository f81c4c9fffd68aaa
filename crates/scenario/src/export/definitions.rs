//! Collects the units and enumerations that an SSP export defines, each under a unique name.

use std::sync::Arc;

use fmu_import::Variable;
use fmu_import::description::{FmiType, StorageType};
use ssp::{BaseUnit, Enumeration, IntegerWidth, SspUnit};

/// What connectors name.
#[derive(Default)]
pub(super) struct SspDefinitions {
    pub units: Vec<Arc<SspUnit>>,
    enumerations: Vec<Arc<Enumeration>>,
}

impl SspDefinitions {
    /// The name under which a unit is defined. Two FMUs may mean different things by one name.
    pub fn define_unit(&mut self, node: &str, name: &str, unit: units::Unit) -> String {
        let exponents = unit.exponents.map(i32::from);
        let base = Some(BaseUnit { exponents, factor: unit.factor, offset: unit.offset });
        let mut name = name.to_owned();
        loop {
            match self.units.iter().find(|known| known.name == name) {
                Some(known) if known.base == base => return name,
                Some(_) => name = format!("{name} of {node}"),
                None => {
                    self.units.push(Arc::new(SspUnit { name: name.clone(), base }));
                    return name;
                }
            }
        }
    }

    /// The unit that is defined under a name.
    pub fn find_unit(&self, name: Option<&str>) -> Option<&SspUnit> {
        self.units.iter().find(|unit| Some(unit.name.as_str()) == name).map(|unit| &**unit)
    }

    /// The type of a variable; none for a clock.
    pub fn define_type(&mut self, node: &str, variable: &Variable) -> Option<ssp::SspType> {
        let integer = |bits, signed| ssp::SspType::Integer(IntegerWidth { bits, signed });
        if variable.kind == FmiType::Enumeration && !variable.items.is_empty() {
            let items = variable.items.iter().map(|item| (item.name.clone(), item.value));
            return Some(self.define_enumeration(node, &variable.name, items.collect()));
        }
        Some(match variable.storage {
            StorageType::Float64 => ssp::SspType::Float64,
            StorageType::Float32 => ssp::SspType::Float32,
            StorageType::Int8 => integer(8, true),
            StorageType::UInt8 => integer(8, false),
            StorageType::Int16 => integer(16, true),
            StorageType::UInt16 => integer(16, false),
            StorageType::Int32 => integer(32, true),
            StorageType::UInt32 => integer(32, false),
            StorageType::Int64 => integer(64, true),
            StorageType::UInt64 => integer(64, false),
            StorageType::Boolean => ssp::SspType::Boolean,
            StorageType::String => ssp::SspType::String,
            StorageType::Binary => ssp::SspType::Binary { mime: "application/octet-stream".to_owned() },
            StorageType::Clock => return None,
        })
    }

    fn define_enumeration(&mut self, node: &str, name: &str, items: Vec<(String, i64)>) -> ssp::SspType {
        let known = self.enumerations.iter().find(|known| known.items == items).cloned();
        let found = known.unwrap_or_else(|| {
            let name = format!("{node}.{name}");
            let made = Arc::new(Enumeration { name, items });
            self.enumerations.push(Arc::clone(&made));
            made
        });
        ssp::SspType::Enumeration(Some(found))
    }
}
