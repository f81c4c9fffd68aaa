//! Computes a fingerprint of a system that does not depend on how it is written.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

use sha2::{Digest as _, Sha256};

use crate::{
    Component, Connector, Dimension, Port, SignalConversion, System, Transformation, Type, Unit,
    Value,
};

impl System {
    /// A hash of all that a run depends on: components with their start values and connectors, connections, connectors of the
    /// system, start and stop. Names of files count, their contents do not.
    #[must_use]
    pub fn fingerprint(&self) -> String {
        // Archives inside it are unpacked to folders of their own, elsewhere each time.
        let folders: Vec<_> = std::iter::once(self.folder()).chain(self.folders()).collect();
        let mut lines: Vec<String> =
            self.components.iter().map(|it| component(it, &folders)).collect();
        let port = |port: &Port| {
            let component = self.components.get(port.component);
            format!("{:?}.{:?}", component.map(|it| it.name.as_str()), port.variable)
        };
        lines.extend(self.connections.iter().map(|it| {
            format!("connection {} {} {}", port(&it.from), port(&it.to), conversion(&it.conversion))
        }));
        for input in &self.inputs {
            let mut to: Vec<_> = input
                .to
                .iter()
                .map(|(to, it)| format!("{} {}", port(to), conversion(it)))
                .collect();
            to.sort();
            lines.push(format!("input {} {to:?}", connector(&input.connector)));
        }
        for output in &self.outputs {
            let from =
                output.from.as_ref().map(|(from, it)| format!("{} {}", port(from), conversion(it)));
            lines.push(format!("output {} {from:?}", connector(&output.connector)));
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

fn component(component: &Component, folders: &[&Path]) -> String {
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
            let units = (unit(start.unit.as_deref()), unit(start.connector_unit.as_deref()));
            let (value, change) = (value(&start.value), transformation(&start.transformation));
            format!("{:?} {value} {units:?} {change}", start.variable)
        })
        .collect();
    start_values.sort();
    let mut connectors: Vec<_> = component.connectors.iter().map(connector).collect();
    connectors.sort();
    let (name, implementation) = (&component.name, &component.implementation);
    format!("component {name:?} {source:?} {implementation} {start_values:?} {connectors:?}")
}

fn connector(connector: &Connector) -> String {
    let sizes = connector.dimensions.iter().map(|size| match size {
        Dimension::Fixed(size) => size.to_string(),
        Dimension::Of(name) => format!("{name:?}"),
        Dimension::Open => "open".to_owned(),
    });
    let sizes: Vec<_> = sizes.collect();
    let data_type = connector.data_type.as_ref().map(|data_type| match data_type {
        Type::Float64 => "Float64".to_owned(),
        Type::Float32 => "Float32".to_owned(),
        Type::Integer(width) => format!("integer {} {}", width.bits, width.signed),
        Type::Boolean => "Boolean".to_owned(),
        Type::String => "String".to_owned(),
        Type::Enumeration(found) => format!("{:?}", found.as_ref().map(|it| (&it.name, &it.items))),
        Type::Binary { mime } => format!("Binary {mime:?}"),
        Type::Clock => "Clock".to_owned(),
    });
    let kind = crate::ConnectorKind::ALL
        .iter()
        .find(|(_, kind)| *kind == connector.kind)
        .map(|(word, _)| word);
    let unit = unit(connector.unit.as_deref());
    format!("{:?} {kind:?} {data_type:?} {unit} {sizes:?}", connector.name)
}

fn unit(unit: Option<&Unit>) -> String {
    let base = |unit: &Unit| unit.base.map(|base| (base.exponents, base.factor, base.offset));
    format!("{:?}", unit.map(|unit| (&unit.name, base(unit))))
}

fn value(of: &Value) -> String {
    match of {
        Value::Real(real) => format!("{real:?}"),
        Value::Integer(integer) => integer.to_string(),
        Value::Boolean(truth) => truth.to_string(),
        Value::String(text) => format!("{text:?}"),
        Value::Enumeration(item) => format!("item {item:?}"),
        Value::Binary(bytes) => format!("{bytes:?}"),
        Value::Array { dimensions, elements } => {
            let elements: Vec<_> = elements.iter().map(value).collect();
            format!("{dimensions:?} {elements:?}")
        }
    }
}

fn transformation(of: &Transformation) -> String {
    match of {
        Transformation::Linear { factor, offset } => format!("{factor:?} {offset:?}"),
        Transformation::Boolean(map) => format!("{map:?}"),
        Transformation::Integer(map) => format!("{map:?}"),
        Transformation::Enumeration(map) => format!("{map:?}"),
    }
}

fn conversion(conversion: &SignalConversion) -> String {
    let units = (unit(conversion.units.0.as_deref()), unit(conversion.units.1.as_deref()));
    let change = transformation(&conversion.transformation);
    format!(
        "{change} {} {} {units:?}",
        conversion.suppress_unit_conversion, conversion.assumes_equal_units
    )
}
