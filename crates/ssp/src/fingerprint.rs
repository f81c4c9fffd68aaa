//! Tells whether two systems mean the same, however they are written.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

use sha2::{Digest as _, Sha256};

use crate::{
    Component, Connector, Dimension, Port, System, Transformation, Type, Unit, Value, Way,
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
        lines.extend(
            self.connections.iter().map(|it| {
                format!("connection {} {} {}", port(&it.from), port(&it.to), way(&it.way))
            }),
        );
        for input in &self.inputs {
            let mut to: Vec<_> =
                input.to.iter().map(|(to, it)| format!("{} {}", port(to), way(it))).collect();
            to.sort();
            lines.push(format!("input {} {to:?}", connector(&input.connector)));
        }
        for output in &self.outputs {
            let from = output.from.as_ref().map(|(from, it)| format!("{} {}", port(from), way(it)));
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
    let inside = |(place, folder): (usize, &&Path)| {
        let source = component.source.strip_prefix(folder).ok()?;
        // Most often it lies in the folder of the description.
        let folder = (place > 0).then(|| format!("{place}:").into());
        Some(folder.into_iter().chain(source.iter().map(|part| part.to_string_lossy())).collect())
    };
    let source: Option<Vec<Cow<str>>> = folders.iter().enumerate().find_map(inside);
    let source = source.unwrap_or_else(|| vec![component.source.to_string_lossy()]);
    let mut starts: Vec<_> = component
        .starts
        .iter()
        .map(|start| {
            let units = (unit(start.unit.as_deref()), unit(start.connector_unit.as_deref()));
            let (value, change) = (value(&start.value), transformation(&start.transformation));
            format!("{:?} {value} {units:?} {change}", start.variable)
        })
        .collect();
    starts.sort();
    let mut connectors: Vec<_> = component.connectors.iter().map(connector).collect();
    connectors.sort();
    let (name, implementation) = (&component.name, &component.implementation);
    format!("component {name:?} {source:?} {implementation} {starts:?} {connectors:?}")
}

fn connector(connector: &Connector) -> String {
    let sizes = connector.dimensions.iter().map(|size| match size {
        Dimension::Fixed(size) => size.to_string(),
        Dimension::Of(name) => format!("{name:?}"),
        Dimension::Open => "open".to_owned(),
    });
    let sizes: Vec<_> = sizes.collect();
    let carries = connector.carries.as_ref().map(|carries| match carries {
        Type::Float64 => "Float64".to_owned(),
        Type::Float32 => "Float32".to_owned(),
        Type::Integer(width) => format!("integer {} {}", width.bits, width.signed),
        Type::Boolean => "Boolean".to_owned(),
        Type::String => "String".to_owned(),
        Type::Enumeration(found) => format!("{:?}", found.as_ref().map(|it| (&it.name, &it.items))),
        Type::Binary { mime } => format!("Binary {mime:?}"),
        Type::Clock => "Clock".to_owned(),
    });
    let kind =
        crate::Kind::ALL.iter().find(|(_, kind)| *kind == connector.kind).map(|(word, _)| word);
    let unit = unit(connector.unit.as_deref());
    format!("{:?} {kind:?} {carries:?} {unit} {sizes:?}", connector.name)
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

fn way(way: &Way) -> String {
    let units = (unit(way.units.0.as_deref()), unit(way.units.1.as_deref()));
    let change = transformation(&way.transformation);
    format!("{change} {} {} {units:?}", way.suppress_unit_conversion, way.assumes_equal_units)
}
