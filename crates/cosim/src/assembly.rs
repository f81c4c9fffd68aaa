//! Puts nodes together: from their variables and connections follow the order in which they step and the places of all values in the row.

use std::collections::{BTreeSet, HashSet};
use std::sync::Arc;

use fmu_import::description::{FmiType, Variable};
use fmu_import::{Causality, StorageType, Variability};
use recording::{
    AllVariables, Column, ColumnIndex, Columns, IntegerRange, NumberRange, TextRange, ValueKind,
    VariableDirection,
};

use crate::clock::StepBoundary;
use crate::extrapolation::ExtrapolationOrder;
use crate::order::ConnectionEdge;
use crate::system::{
    AcceptedValues, InputChain, InputSource, IntegerConnection, NodeBody, NodeIntegerColumns, NodePlan,
    NodeTextColumns, NumberConnection, VariableGroup, VariableGroups,
};

/// A variable of a node that can be connected or recorded.
#[derive(Debug, Clone)]
pub struct Port {
    /// Its name in the node.
    pub name: String,
    /// The kind in which its values travel.
    pub kind: ValueKind,
    /// The form of its values in an FMU.
    pub storage: StorageType,
    /// Its value reference in an FMU.
    pub reference: u32,
    /// Its place in an array, and the number of elements there.
    pub element: (usize, usize),
    /// Whether it is an input or a tunable parameter that changes at events only, of an FMU with event mode.
    pub discrete: bool,
    /// Whether it is a tunable parameter.
    pub tunable: bool,
    /// The value references of its clocks, of an FMU with event mode.
    pub clocks: Vec<u32>,
    /// Its unit.
    pub unit: Option<String>,
    /// One line about it.
    pub description: Option<String>,
    /// Its place among the variables of its FMU.
    pub place: usize,
    /// For outputs, the places of the inputs that they follow without a step in between; `None` means all.
    pub follows: Option<Arc<[usize]>>,
}

/// The kind in which values of a type travel and are recorded: enumerations are integers.
#[must_use]
pub fn recorded_kind(of: FmiType, form: StorageType) -> ValueKind {
    match of {
        FmiType::Real => ValueKind::Real,
        FmiType::Integer | FmiType::Enumeration if form == StorageType::Int64 => ValueKind::Int64,
        FmiType::Integer | FmiType::Enumeration if form == StorageType::UInt64 => ValueKind::UInt64,
        FmiType::Integer | FmiType::Enumeration => ValueKind::Integer,
        // A clock ticks or does not; nothing connects it.
        FmiType::Boolean | FmiType::Clock => ValueKind::Boolean,
        // Bytes are recorded as hexadecimal digits.
        FmiType::String | FmiType::Binary => ValueKind::String,
    }
}

/// Whether a variable is a parameter that may get other values during a run: between communication points, in event mode of FMUs that have
/// it (FMI 2.0.4, section 4.2.4; FMI 3.0, section 2.4.7.4).
#[must_use]
pub fn is_tunable(variable: &Variable) -> bool {
    (variable.causality, variable.variability) == (Causality::Parameter, Variability::Tunable)
}

/// Whether a variable of an FMU with event mode takes values at events only.
#[must_use]
pub fn is_discrete(variable: &Variable) -> bool {
    (is_tunable(variable) || variable.causality == Causality::Input)
        && variable.variability != Variability::Continuous
}

impl Port {
    /// The port of a real number without more, of a node that is no FMU. An output follows no input without a step in between.
    #[must_use]
    pub fn real(name: &str) -> Self {
        Port {
            name: name.to_owned(),
            kind: ValueKind::Real,
            storage: StorageType::Float64,
            reference: 0,
            element: (0, 1),
            discrete: false,
            tunable: false,
            clocks: Vec::new(),
            unit: None,
            description: None,
            place: 0,
            follows: Some(Arc::default()),
        }
    }

    /// The port of the variable at a place among those of an FMU that has event mode or has not.
    #[must_use]
    pub fn from_variable(variables: &[Variable], place: usize, event_mode: bool) -> Self {
        let variable = &variables[place];
        Port {
            name: variable.name.clone(),
            kind: recorded_kind(variable.kind, variable.storage),
            storage: variable.storage,
            reference: variable.reference,
            element: variable.element,
            discrete: event_mode && is_discrete(variable),
            tunable: is_tunable(variable),
            clocks: if event_mode { variable.clocks.clone() } else { Vec::new() },
            unit: variable.offset_free_unit_name(),
            description: variable.description.clone(),
            place,
            follows: variable.dependencies.clone(),
        }
    }
}

/// A connection to an input, whose value has no place in the row yet.
#[derive(Debug)]
pub struct ConnectionDefinition {
    /// The node that the value comes from.
    pub node: usize,
    /// Its output.
    pub output: usize,
    /// Which end of the step the value is taken at.
    pub at: StepBoundary,
    /// The way of a number; a text arrives unchanged.
    pub input_chain: Option<InputChain>,
    /// The extrapolation of the input within a step; without one it holds its value.
    pub extrapolation: Option<ExtrapolationOrder>,
}

/// A node whose values have no places in the row yet.
#[derive(Debug)]
pub struct NodeDefinition {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub body: NodeBody,
    /// Its outputs.
    pub outputs: Vec<Port>,
    /// Its inputs.
    pub inputs: Vec<Port>,
    /// The connection of each input.
    pub connections: Vec<Option<ConnectionDefinition>>,
}

impl NodeDefinition {
    /// Whether it hands on a value and does nothing else.
    #[must_use]
    pub fn is_connector(&self) -> bool {
        matches!(self.body, NodeBody::Inlet | NodeBody::Outlet)
    }
}

/// The inputs of a node that an output follows without a step in between, by their places; none when an output may follow all.
struct FeedthroughInputs(Option<HashSet<usize>>);

impl FeedthroughInputs {
    fn of_node(node: &NodeDefinition) -> Self {
        let (mut places, mut known) = (HashSet::new(), HashSet::new());
        for output in &node.outputs {
            let Some(inputs) = &output.follows else { return FeedthroughInputs(None) };
            // All elements of an array share one list.
            if known.insert(inputs.as_ptr()) {
                places.extend(inputs.iter().copied());
            }
        }
        FeedthroughInputs(Some(places))
    }

    fn contains(&self, input: &Port) -> bool {
        self.0.as_ref().is_none_or(|places| places.contains(&input.place))
    }
}

/// The connections between nodes, for their [order](crate::order).
#[must_use]
pub fn connection_edges(nodes: &[NodeDefinition]) -> Vec<ConnectionEdge> {
    let mut edges = Vec::new();
    let followed: Vec<_> = nodes.iter().map(FeedthroughInputs::of_node).collect();
    for (to, taker) in nodes.iter().enumerate() {
        let mut numbers = 0;
        for (input, (port, connection)) in taker.inputs.iter().zip(&taker.connections).enumerate() {
            let Some(ConnectionDefinition { node: from, output, at, input_chain, .. }) = connection else {
                continue;
            };
            let place = input_chain.is_some().then_some(numbers);
            numbers += usize::from(place.is_some());
            let giver = &nodes[*from];
            let needed = match (&giver.body, &taker.body) {
                (NodeBody::Inlet, _) | (_, NodeBody::Outlet) => true,
                // An inlet waits as its receivers would.
                (_, NodeBody::Inlet) => has_feedthrough_from_inlet(nodes, &followed, to),
                _ => followed[to].contains(port),
            };
            let given = &giver.outputs[*output].name;
            let label = format!("{}.{given} -> {}.{}", giver.name, taker.name, port.name);
            edges.push(ConnectionEdge {
                from: *from,
                to,
                output: *output,
                input,
                needed,
                at: *at,
                place,
                label,
            });
        }
    }
    edges
}

/// Whether an output of a node that an inlet leads to follows the value without a step in between.
fn has_feedthrough_from_inlet(
    nodes: &[NodeDefinition],
    followed: &[FeedthroughInputs],
    inlet: usize,
) -> bool {
    nodes.iter().zip(followed).any(|(node, followed)| {
        let fed =
            node.inputs.iter().zip(&node.connections).filter(|(_, connection)| {
                connection.as_ref().is_some_and(|connection| connection.node == inlet)
            });
        fed.into_iter().any(|(input, _)| followed.contains(input))
    })
}

/// Whether an output of the node between two connections follows the input without a step in between.
#[must_use]
pub fn has_feedthrough(nodes: &[NodeDefinition], before: &ConnectionEdge, behind: &ConnectionEdge) -> bool {
    let node = &nodes[before.to];
    let (output, input) = (&node.outputs[behind.output], &node.inputs[before.input]);
    output.follows.as_ref().is_none_or(|places| places.contains(&input.place))
}

/// Gives each output and each connected input its column in the row: all outputs come before all inputs.
#[must_use]
pub fn assign_columns(unplaced: Vec<NodeDefinition>) -> (Vec<NodePlan>, Columns<AllVariables>) {
    let mut columns = Columns::default();
    let sides = output_columns(&mut columns, &unplaced);
    let integers: Vec<_> = columns.integer_columns().map(|(_, number)| number).collect();
    let mut nodes = Vec::new();
    for (node, output) in unplaced.into_iter().zip(&sides) {
        let NodeDefinition { name, mut body, outputs, inputs, connections } = node;
        let (connected, connections): (Vec<_>, Vec<_>) = inputs
            .into_iter()
            .zip(connections)
            .filter_map(|(port, connection)| Some((port, connection?)))
            .unzip();
        if let NodeBody::Fmu { inputs, outputs: shown, .. } = &mut body {
            (*inputs, *shown) = (group_variables(&connected), group_variables(&outputs));
        }
        let input = match body {
            // What it takes is what it gives.
            NodeBody::Inlet | NodeBody::Outlet => None,
            _ => Some(PortColumns::add_columns(&mut columns, &name, &connected, VariableDirection::Input)),
        };
        let input = input.as_ref().unwrap_or(output);
        let mut plan = NodePlan {
            name,
            body,
            step_ratio: None,
            outputs: output.numbers,
            needed: output.numbers.indices().collect(),
            inputs: input.numbers,
            connections: Vec::new(),
            texts: NodeTextColumns {
                outputs: output.texts,
                inputs: input.texts,
                ..NodeTextColumns::default()
            },
            exact: NodeIntegerColumns {
                outputs: output.integers,
                numbers: integers[output.integers.positions()].to_vec(),
                inputs: input.integers,
                ..NodeIntegerColumns::default()
            },
            faults: Vec::new(),
        };
        for ConnectionDefinition { node, output, at, input_chain, extrapolation } in connections {
            // Types were compared: a number goes to a number and a text to a text.
            match (sides[node].ports[output], input_chain) {
                (ColumnIndex::Number(index), Some(input_chain)) => {
                    let source = InputSource { index, at };
                    plan.connections.push(NumberConnection { source, input_chain, extrapolation });
                }
                (ColumnIndex::Text(index), _) => plan.texts.connections.push(InputSource { index, at }),
                (ColumnIndex::Number(_), None) => unreachable!("a number goes to a text"),
            }
        }
        connect_int64(&mut plan, &columns);
        nodes.push(plan);
    }
    (nodes, columns)
}

/// The variables of ports that are read and written at once; the ports are in the order of their forms and of the file.
#[must_use]
pub fn group_variables(ports: &[Port]) -> VariableGroups {
    let mut found = VariableGroups::default();
    for port in ports {
        let is_text = port.kind == ValueKind::String;
        let groups = if is_text { &mut found.texts } else { &mut found.numbers };
        let one_more = |group: &mut VariableGroup| {
            if group.references.last() != Some(&port.reference) {
                group.references.push(port.reference);
                group.elements += port.element.1;
            }
            group.places.push(group.elements - port.element.1 + port.element.0);
        };
        let joins = |group: &&mut VariableGroup| {
            let same = group.references.last() == Some(&port.reference);
            let alike = (group.storage, group.discrete, group.tunable)
                == (port.storage, port.discrete, port.tunable)
                && group.clocks == port.clocks;
            alike && (same || !is_text)
        };
        match groups.last_mut().filter(joins) {
            Some(group) => one_more(group),
            None => {
                let mut group = VariableGroup {
                    storage: port.storage,
                    references: Vec::new(),
                    elements: 0,
                    discrete: port.discrete,
                    tunable: port.tunable,
                    clocks: port.clocks.clone(),
                    places: Vec::new(),
                    needed: true,
                };
                one_more(&mut group);
                groups.push(group);
            }
        }
    }
    found
}

/// Gives the outputs of all nodes their columns. Those of an input connector are inputs.
fn output_columns(columns: &mut Columns<AllVariables>, nodes: &[NodeDefinition]) -> Vec<PortColumns> {
    let connections = nodes.iter().flat_map(|node| node.connections.iter().flatten());
    let sources: BTreeSet<_> = connections.map(|connection| connection.node).collect();
    let sides = nodes.iter().enumerate().map(|(place, node)| {
        let NodeDefinition { name, body, outputs, connections, .. } = node;
        let is_used = connections.iter().any(Option::is_some) || sources.contains(&place);
        match body {
            // As for other inputs, a value that nobody gives is none.
            NodeBody::Inlet if !is_used => {
                PortColumns::add_columns(columns, name, &[], VariableDirection::Input)
            }
            NodeBody::Inlet => PortColumns::add_columns(columns, name, outputs, VariableDirection::Input),
            _ => PortColumns::add_columns(columns, name, outputs, VariableDirection::Output),
        }
    });
    sides.collect()
}

/// Finds the connections of a node with an integer of 64 bits at one end or at both. Where both have one and nothing changes it,
/// the integer itself is what the input has to accept, not its number.
fn connect_int64(plan: &mut NodePlan, columns: &Columns<AllVariables>) {
    let links = plan.connections.iter_mut().zip(plan.inputs.indices()).enumerate();
    for (place, (link, input)) in links {
        let source = columns.integer_index_of(link.source.index);
        let input = columns.integer_index_of(input);
        if source.is_none() && input.is_none() {
            continue;
        }
        let chain = &mut link.input_chain;
        let both = source.is_some() && input.is_some() && chain.is_identity();
        let as_it_is = both.then(|| std::mem::replace(&mut chain.accepts, AcceptedValues::Real));
        plan.exact.connections.push(IntegerConnection { place, source, input, as_it_is });
    }
}

/// The columns of one side of a node.
struct PortColumns {
    /// The column of each port.
    ports: Vec<ColumnIndex<AllVariables>>,
    numbers: NumberRange<AllVariables>,
    texts: TextRange<AllVariables>,
    integers: IntegerRange<AllVariables>,
}

impl PortColumns {
    fn add_columns(
        columns: &mut Columns<AllVariables>,
        node: &str,
        ports: &[Port],
        direction: VariableDirection,
    ) -> Self {
        let ends = |columns: &Columns<AllVariables>| {
            [columns.number_columns().len(), columns.text_columns().len(), columns.integer_columns().len()]
        };
        let [numbers, texts, integers] = ends(columns);
        let column = |port: &Port| Column {
            node: node.to_owned(),
            variable: port.name.clone(),
            direction,
            kind: port.kind,
            unit: port.unit.clone(),
            description: port.description.clone(),
        };
        let ports = ports.iter().map(|port| columns.push(column(port))).collect();
        let [numbers_end, texts_end, integers_end] = ends(columns);
        Self {
            ports,
            numbers: NumberRange::new(numbers..numbers_end),
            texts: TextRange::new(texts..texts_end),
            integers: IntegerRange::new(integers..integers_end),
        }
    }
}
