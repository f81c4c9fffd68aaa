//! Flattens a hierarchy of systems: follows each connection back to its source.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::chain::{self, ChainConversion, ChainOrigin, ChainStep};
use crate::error::mistake_error;
use crate::limits::{CELLS, STATIONS};
use crate::parameters::ParameterAssignment;
use crate::tree::{ConnectionEdge, ConnectorRole, FmuInstance, SystemTree};
use crate::{
    Connection, Connector, ConnectorKind, Error, FmuPort, SignalConversion, SspUnit, SspValue, StartValue,
    SystemComponent, SystemInput, SystemOutput, ssd,
};

/// The parts of a system that follow from its instances.
#[derive(Debug, Default)]
pub(crate) struct FlatSystem {
    pub(crate) components: Vec<SystemComponent>,
    pub(crate) connections: Vec<Connection>,
    pub(crate) inputs: Vec<SystemInput>,
    pub(crate) outputs: Vec<SystemOutput>,
}

impl SystemTree<'_> {
    /// Makes the flat system whose outermost instance is `outer`.
    pub(crate) fn flatten(&self, outer: usize) -> Result<FlatSystem, Error> {
        self.check_distinct_names()?;
        let mut flat = FlatSystem::default();
        // Connectors of the system in the order of the file, each with its place among the inputs or outputs.
        let mut own: Vec<usize> = self.instances[outer].ports.values().map(|x| x.into).collect();
        own.sort_unstable();
        let mut inputs = BTreeMap::new();
        for &node in &own {
            let connector = to_public_connector(&self.nodes[node].connector);
            if self.is_input(node) {
                inputs.insert(node, flat.inputs.len());
                flat.inputs.push(SystemInput { connector, to: Vec::new() });
            } else {
                let from = self.output_source(node)?;
                flat.outputs.push(SystemOutput { connector, from });
            }
        }
        let mut cells = 0;
        for (component, fmu) in self.fmus.iter().enumerate() {
            let mut start_values = self.fmu_start_values(fmu)?;
            let mut ports: Vec<usize> = self.instances[fmu.instance].ports.values().map(|x| x.into).collect();
            ports.sort_unstable();
            for node in ports.iter().copied().filter(|node| self.nodes[*node].incoming.is_some()) {
                let variable = self.nodes[node].connector.name.to_string();
                let to = FmuPort { component, variable };
                let path = self.path_to_node(node)?;
                if let Some(start) = self.connected_start_value(&path, &to)? {
                    self.note_replaced_value(
                        start_values.insert(to.variable.clone(), start),
                        &to,
                        &start_values,
                    );
                }
                self.add_connection(&path, to, &inputs, &mut flat)?;
            }
            cells += start_values.values().map(value_count).sum::<usize>();
            if cells > CELLS {
                let expected = format!("at most {CELLS} elements in all start values");
                return Err(mistake_error(&fmu.position, expected, "more", "make arrays smaller"));
            }
            let connectors =
                ports.iter().map(|node| to_public_connector(&self.nodes[*node].connector)).collect();
            flat.components.push(SystemComponent {
                name: fmu.name.clone(),
                source: fmu.source.path(),
                display_path: fmu.source.display_path(),
                implementation: fmu.implementation.clone(),
                start_values: start_values.into_values().collect(),
                connectors,
                position: fmu.position.clone(),
            });
        }
        Ok(flat)
    }

    /// Section 5.2.3 allows two elements with the same names from outside to inside; a flat system needs different ones.
    fn check_distinct_names(&self) -> Result<(), Error> {
        let mut seen: BTreeMap<&str, &FmuInstance> = BTreeMap::new();
        for fmu in &self.fmus {
            if let Some(first) = seen.insert(&fmu.name, fmu) {
                let found = format!("`{}`, which {} is called as well", fmu.name, first.position);
                let expected = "a name that no other component has, with the systems around it";
                return Err(mistake_error(&fmu.position, expected, found, "rename one of them"));
            }
        }
        Ok(())
    }

    fn is_input(&self, node: usize) -> bool {
        let node = &self.nodes[node];
        match node.connector.kind {
            ConnectorKind::Input | ConnectorKind::Parameter | ConnectorKind::StructuralParameter => true,
            ConnectorKind::InOut | ConnectorKind::Unspecified => node.incoming.is_none(),
            ConnectorKind::Output
            | ConnectorKind::CalculatedParameter
            | ConnectorKind::Constant
            | ConnectorKind::Local => false,
        }
    }

    /// What leads to a connector of the outermost system.
    fn output_source(&self, node: usize) -> Result<Option<(FmuPort, SignalConversion)>, Error> {
        let path = self.path_to_node(node)?;
        if let Some(value) = &self.nodes[node].value {
            let (position, label) = (&value.position, self.qualified_connector_name(node));
            self.notes
                .add_note(|| format!("{position}: the value of `{label}` is ignored, since it is an output"));
        }
        let ConnectorRole::Component(component) = self.nodes[path[0]].role else { return Ok(None) };
        let variable = self.nodes[path[0]].connector.name.to_string();
        Ok(Some((FmuPort { component, variable }, self.path_conversion(&path)?)))
    }

    /// Adds the connection of a path, unless its beginning is connected to nothing.
    fn add_connection(
        &self,
        path: &[usize],
        to: FmuPort,
        inputs: &BTreeMap<usize, usize>,
        flat: &mut FlatSystem,
    ) -> Result<(), Error> {
        let origin = path[0];
        let conversion = self.path_conversion(path)?;
        if let ConnectorRole::Component(component) = self.nodes[origin].role {
            let variable = self.nodes[origin].connector.name.to_string();
            flat.connections.push(Connection { from: FmuPort { component, variable }, to, conversion });
        } else if let Some(input) = inputs.get(&origin) {
            flat.inputs[*input].to.push((to, conversion));
        } else {
            let (position, label) = (&conversion.position, self.qualified_connector_name(origin));
            self.notes.add_note(|| format!("{position}: nothing is connected to `{label}` from outside"));
        }
        Ok(())
    }

    /// All nodes on the way to this one, from the first one.
    fn path_to_node(&self, node: usize) -> Result<Vec<usize>, Error> {
        let mut path = vec![node];
        let mut at = node;
        while let Some(edge) = &self.nodes[at].incoming {
            at = edge.from;
            path.push(at);
            if matches!(self.nodes[at].role, ConnectorRole::Component(_)) {
                break;
            }
            if path.len() > STATIONS {
                return Err(self.endless_path_error(&path, edge));
            }
        }
        path.reverse();
        Ok(path)
    }

    /// Why a path does not end.
    fn endless_path_error(&self, path: &[usize], edge: &ConnectionEdge) -> Error {
        let mut seen = BTreeSet::new();
        if let Some(node) = path.iter().find(|node| !seen.insert(**node)) {
            let found = format!("a circle through `{}`", self.qualified_connector_name(*node));
            let expected = "connections that begin at a component";
            return mistake_error(&edge.position, expected, found, "remove one of them");
        }
        let expected = format!("at most {STATIONS} connectors on the way of a connection");
        mistake_error(&edge.position, expected, "one more", "connect more directly")
    }

    /// The edges between the nodes of a path.
    fn path_edges<'a>(
        &'a self,
        path: &'a [usize],
    ) -> impl Iterator<Item = (&'a ConnectionEdge, ChainStep<'a>)> {
        path[1..].iter().filter_map(|node| {
            let node = &self.nodes[*node];
            let edge = node.incoming.as_ref()?;
            let to = node.connector.unit.as_deref();
            let ConnectionEdge { transformation, suppress, inherits_before, position, .. } = edge;
            let (suppress, inherits_before) = (*suppress, *inherits_before);
            Some((edge, ChainStep { transformation, suppress, to, inherits_before, position }))
        })
    }

    fn path_conversion(&self, path: &[usize]) -> Result<SignalConversion, Error> {
        let (edges, steps): (Vec<_>, Vec<_>) = self.path_edges(path).unzip();
        let unit = |node: Option<&usize>| self.nodes[*node?].connector.unit.clone();
        let units = (unit(path.first()), unit(path.last()));
        let ChainConversion { transformation, suppress, assumes } =
            chain::compose_chain(ChainOrigin::Connector(units.0.as_deref()), &steps)?;
        let position = edges.last().map_or(&self.nodes[path[0]].connector.position, |edge| &edge.position);
        let position = position.clone();
        Ok(SignalConversion {
            transformation,
            suppress_unit_conversion: suppress,
            assumes_equal_units: assumes,
            units,
            position,
        })
    }

    /// What the bindings give the variables of an FMU directly.
    fn fmu_start_values(&self, fmu: &FmuInstance) -> Result<BTreeMap<String, StartValue>, Error> {
        let ports = &self.instances[fmu.instance].ports;
        let start_values = fmu.values.iter().map(|(variable, value)| {
            let node = ports.get(variable.as_str()).map(|ports| ports.into);
            let unit = node.and_then(|node| self.nodes[node].connector.unit.clone());
            Ok((variable.clone(), start_value(value, variable, value.unit.clone(), unit, &[])?))
        });
        start_values.collect()
    }

    /// The value that comes through a connection from a connector of a system. The connection gives the variable its value,
    /// so the first connector with a value counts.
    fn connected_start_value(&self, path: &[usize], to: &FmuPort) -> Result<Option<StartValue>, Error> {
        let stations = &path[..path.len() - 1];
        let Some(at) = stations.iter().position(|node| self.nodes[*node].value.is_some()) else {
            return Ok(None);
        };
        let Some(value) = &self.nodes[path[at]].value else { return Ok(None) };
        if matches!(self.nodes[path[0]].role, ConnectorRole::Component(_)) {
            let (position, label) = (&value.position, self.qualified_connector_name(path[at]));
            self.notes.add_note(|| {
                format!("{position}: the value of `{label}` is ignored, since a component gives it")
            });
            return Ok(None);
        }
        let steps: Vec<_> = self.path_edges(&path[at..]).map(|(_, step)| step).collect();
        let first = ChainStep {
            transformation: &value.transformation,
            suppress: value.suppress,
            to: self.nodes[path[at]].connector.unit.as_deref(),
            inherits_before: false,
            position: &value.position,
        };
        let steps: Vec<_> = std::iter::once(first).chain(steps).collect();
        let unit = path.last().and_then(|node| self.nodes[*node].connector.unit.clone());
        // Without a unit of its own, the value is in that of the connector that it is written for.
        let written = value.unit.clone().or(self.nodes[path[at]].connector.unit.clone());
        start_value(value, &to.variable, written, unit, &steps).map(Some)
    }

    /// Notes a value that lost against that of a connection.
    fn note_replaced_value(
        &self,
        before: Option<StartValue>,
        to: &FmuPort,
        start_values: &BTreeMap<String, StartValue>,
    ) {
        let (Some(before), Some(now)) = (before, start_values.get(&to.variable)) else { return };
        if before.value != now.value {
            let (fmu, variable) = (&self.fmus[to.component].name, &to.variable);
            self.notes.add_note(|| {
                format!(
                    "{}: the value of `{fmu}.{variable}` is replaced by that of its connection, {}",
                    before.position, now.position,
                )
            });
        }
    }
}

/// The start value of a variable, with the units of the value and of the connector; without steps, the value is for the
/// variable itself.
fn start_value(
    value: &Arc<ParameterAssignment>,
    variable: &str,
    written: Option<Arc<SspUnit>>,
    unit: Option<Arc<SspUnit>>,
    steps: &[ChainStep],
) -> Result<StartValue, Error> {
    let own = [ChainStep {
        transformation: &value.transformation,
        suppress: value.suppress,
        to: unit.as_deref(),
        inherits_before: false,
        position: &value.position,
    }];
    let steps = if steps.is_empty() { &own } else { steps };
    let ChainConversion { transformation, suppress, .. } =
        chain::compose_chain(ChainOrigin::Value(written.as_deref()), steps)?;
    let mut start = StartValue {
        variable: variable.to_owned(),
        value: SspValue::clone(&value.value),
        unit: written.clone().filter(|_| !suppress),
        connector_unit: unit.clone(),
        transformation,
        position: value.position.clone(),
    };
    let Some(after) = start.transformation.apply(&start.value) else {
        let found = format!("a transformation for {} on the way", start.transformation.purpose_text());
        let expected = "transformations for the type of the value";
        let cure = "use the transformation for the type of the value";
        return Err(mistake_error(&value.position, expected, found, cure));
    };
    // Nothing is left to convert: the transformation can be done here.
    if start.unit.is_none() || start.unit == unit {
        start.value = after;
        start.transformation = crate::ValueTransformation::IDENTITY;
    }
    Ok(start)
}

fn value_count(start: &StartValue) -> usize {
    match &start.value {
        SspValue::Array { elements, .. } => elements.len(),
        _ => 1,
    }
}

fn to_public_connector(connector: &ssd::SsdConnector) -> Connector {
    Connector {
        name: connector.name.to_string(),
        kind: connector.kind,
        data_type: connector.data_type.clone(),
        unit: connector.unit.clone(),
        dimensions: connector.dimensions.clone(),
        position: connector.position.clone(),
    }
}
