//! Computes a fingerprint of a system that does not depend on how it is written.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

use sha2::{Digest as _, Sha256};

use crate::{
    ArrayDimension, Connector, FmuPort, SignalConversion, SspSystem, SspType, SspUnit, SspValue,
    SystemComponent, ValueTransformation,
};

impl SspSystem {
    /// A hash of all that a run depends on: components with their start values and connectors, connections, connectors of the
    /// system, start and stop. Names of files count, their contents do not.
    #[must_use]
    pub fn fingerprint(&self) -> String {
        // Archives inside it are unpacked to folders of their own, elsewhere each time.
        let folders: Vec<_> =
            std::iter::once(self.description_folder()).chain(self.unpacked_folders()).collect();
        let mut lines: Vec<String> =
            self.components.iter().map(|it| component_hash_text(it, &folders)).collect();
        let port = |port: &FmuPort| {
            let component = self.components.get(port.component);
            format!("{:?}.{:?}", component.map(|it| it.name.as_str()), port.variable)
        };
        lines.extend(self.connections.iter().map(|it| {
            format!("connection {} {} {}", port(&it.from), port(&it.to), conversion_hash_text(&it.conversion))
        }));
        for input in &self.inputs {
            let mut to: Vec<_> = input
                .to
                .iter()
                .map(|(to, it)| format!("{} {}", port(to), conversion_hash_text(it)))
                .collect();
            to.sort();
            lines.push(format!("input {} {to:?}", connector_hash_text(&input.connector)));
        }
        for output in &self.outputs {
            let from =
                output.from.as_ref().map(|(from, it)| format!("{} {}", port(from), conversion_hash_text(it)));
            lines.push(format!("output {} {from:?}", connector_hash_text(&output.connector)));
        }
        // Tools may write lists in another order.
        lines.sort();
        lines.push(format!("time {:?} {:?}", self.experiment.start, self.experiment.stop));
        let hash = Sha256::digest(lines.join("\n").as_bytes());
        hash.iter().fold(String::new(), |mut text, byte| {
            // Writing into a string cannot fail.
            let _ = write!(text, "{byte:02x}");
            text
        })
    }
}

fn component_hash_text(component: &SystemComponent, folders: &[&Path]) -> String {
    let inside = |(position, folder): (usize, &&Path)| {
        let source = component.source.strip_prefix(folder).ok()?;
        // Most often it lies in the folder of the description.
        let folder = (position > 0).then(|| format!("{position}:").into());
        Some(folder.into_iter().chain(source.iter().map(|part| part.to_string_lossy())).collect())
    };
    let source: Option<Vec<Cow<str>>> = folders.iter().enumerate().find_map(inside);
    let source = source.unwrap_or_else(|| vec![component.source.to_string_lossy()]);
    let mut start_values: Vec<_> = component
        .start_values
        .iter()
        .map(|start| {
            let units =
                (unit_hash_text(start.unit.as_deref()), unit_hash_text(start.connector_unit.as_deref()));
            let (value, change) =
                (value_hash_text(&start.value), transformation_hash_text(&start.transformation));
            format!("{:?} {value} {units:?} {change}", start.variable)
        })
        .collect();
    start_values.sort();
    let mut connectors: Vec<_> = component.connectors.iter().map(connector_hash_text).collect();
    connectors.sort();
    let (name, implementation) = (&component.name, &component.implementation);
    format!("component {name:?} {source:?} {implementation} {start_values:?} {connectors:?}")
}

fn connector_hash_text(connector: &Connector) -> String {
    let sizes = connector.dimensions.iter().map(|size| match size {
        ArrayDimension::Fixed(size) => size.to_string(),
        ArrayDimension::Of(name) => format!("{name:?}"),
        ArrayDimension::Open => "open".to_owned(),
    });
    let sizes: Vec<_> = sizes.collect();
    let data_type = connector.data_type.as_ref().map(|data_type| match data_type {
        SspType::Float64 => "Float64".to_owned(),
        SspType::Float32 => "Float32".to_owned(),
        SspType::Integer(width) => format!("integer {} {}", width.bits, width.signed),
        SspType::Boolean => "Boolean".to_owned(),
        SspType::String => "String".to_owned(),
        SspType::Enumeration(found) => {
            format!("{:?}", found.as_ref().map(|it| (&it.name, &it.items)))
        }
        SspType::Binary { mime } => format!("Binary {mime:?}"),
        SspType::Clock => "Clock".to_owned(),
    });
    let kind =
        crate::ConnectorKind::ALL.iter().find(|(_, kind)| *kind == connector.kind).map(|(word, _)| word);
    let unit = unit_hash_text(connector.unit.as_deref());
    format!("{:?} {kind:?} {data_type:?} {unit} {sizes:?}", connector.name)
}

fn unit_hash_text(unit: Option<&SspUnit>) -> String {
    let base = |unit: &SspUnit| unit.base.map(|base| (base.exponents, base.factor, base.offset));
    format!("{:?}", unit.map(|unit| (&unit.name, base(unit))))
}

fn value_hash_text(of: &SspValue) -> String {
    match of {
        SspValue::Real(real) => format!("{real:?}"),
        SspValue::Integer(integer) => integer.to_string(),
        SspValue::Boolean(truth) => truth.to_string(),
        SspValue::String(text) => format!("{text:?}"),
        SspValue::Enumeration(item) => format!("item {item:?}"),
        SspValue::Binary(bytes) => format!("{bytes:?}"),
        SspValue::Array { dimensions, elements } => {
            let elements: Vec<_> = elements.iter().map(value_hash_text).collect();
            format!("{dimensions:?} {elements:?}")
        }
    }
}

fn transformation_hash_text(of: &ValueTransformation) -> String {
    match of {
        ValueTransformation::Linear { factor, offset } => format!("{factor:?} {offset:?}"),
        ValueTransformation::Boolean(map) => format!("{map:?}"),
        ValueTransformation::Integer(map) => format!("{map:?}"),
        ValueTransformation::Enumeration(map) => format!("{map:?}"),
    }
}

fn conversion_hash_text(conversion: &SignalConversion) -> String {
    let units =
        (unit_hash_text(conversion.units.0.as_deref()), unit_hash_text(conversion.units.1.as_deref()));
    let change = transformation_hash_text(&conversion.transformation);
    format!("{change} {} {} {units:?}", conversion.suppress_unit_conversion, conversion.assumes_equal_units)
}
