//! Builds a system from FMUs and nodes of a program: their variables are connected by name.

use std::sync::Arc;

use diagnostics::Error;
use diagnostics::suggest::unknown_name;
use fmu_import::description::{FmiType, Variable};
use fmu_import::{Causality, Fmu, Value};
use recording::ValueKind;
use units::Unit;

use crate::assembly::{
    ConnectionDefinition, NodeDefinition, Port, assign_columns, connection_edges, has_feedthrough, is_tunable,
};
use crate::clock::{CommunicationClock, StepBoundary};
use crate::effect::EffectChain;
use crate::execution::Execution;
use crate::extrapolation::ExtrapolationOrder;
use crate::node::{self, Node};
use crate::order::{ConnectionGraph, StepOrder};
use crate::system::FmuTolerance;
use crate::system::{
    AcceptedValues, Algorithm, CouplingPlan, InputChain, LoopIteration, NodeBody, NodePlan, StartValue,
    System, VariableGroups,
};

/// For each node the one that the program brings; none for an FMU.
type CustomNodes = Vec<Option<Box<dyn Node>>>;

/// A system that is being built. Nodes step in the order of the flow, and else in that in which they were added.
pub struct SystemBuilder {
    clock: CommunicationClock,
    coupling: CouplingPlan,
    nodes: Vec<NodeDefinition>,
    own: CustomNodes,
}

/// How the value of an output gets to an input.
#[derive(Debug, Default)]
pub struct ConnectionOptions {
    /// The end of the step at which the value is taken; without it that of the coupling algorithm.
    pub at: Option<StepBoundary>,
    /// The extrapolation of the input within a step; without one it holds its value.
    pub extrapolation: Option<ExtrapolationOrder>,
    /// Sensor effects on the way.
    pub effects: EffectChain,
}

impl SystemBuilder {
    /// A system without nodes, which steps by a coupling algorithm.
    #[must_use]
    pub fn new(clock: CommunicationClock, algorithm: Algorithm) -> Self {
        let coupling = CouplingPlan { algorithm, ..CouplingPlan::default() };
        SystemBuilder { clock, coupling, nodes: Vec::new(), own: Vec::new() }
    }

    /// The solution of loops.
    pub fn set_loop_iteration(&mut self, iteration: LoopIteration) -> &mut Self {
        self.coupling.iteration = iteration;
        self
    }

    /// Adds an FMU with start values by name.
    ///
    /// # Errors
    /// When there is a node of this name, or no such variable.
    pub fn add_fmu(
        &mut self,
        name: &str,
        fmu: &Arc<Fmu>,
        starts: &[(&str, Value)],
    ) -> Result<&mut Self, Error> {
        let about = &fmu.description;
        let variables = &about.variables;
        let port = |place: usize| Port::from_variable(variables, place, about.event_mode);
        let sorted = |places: Vec<usize>| {
            let mut ports: Vec<_> = places.into_iter().map(port).collect();
            ports.sort_by_key(|port| port.storage);
            ports
        };
        let travels = |place: &usize| about.event_mode || variables[*place].kind != FmiType::Clock;
        let tunable = (0..variables.len()).filter(|place| is_tunable(&variables[*place]));
        let inputs = about.indices_with_causality(Causality::Input).chain(tunable).filter(travels).collect();
        let outputs = about.indices_with_causality(Causality::Output).filter(travels).collect();
        let starts = starts.iter().map(|(variable, value)| start_value(name, variables, variable, value));
        let body = NodeBody::Fmu {
            fmu: Arc::clone(fmu),
            starts: starts.collect::<Result<_, _>>()?,
            inputs: VariableGroups::default(),
            outputs: VariableGroups::default(),
            log: false,
            tolerance: FmuTolerance::default(),
            isolation: None,
        };
        self.insert_node(name, body, sorted(inputs), sorted(outputs), None)
    }

    /// Adds a node of the program, whose inputs and outputs are real numbers of these names.
    ///
    /// # Errors
    /// When there is a node of this name.
    pub fn add_node(
        &mut self,
        name: &str,
        node: Box<dyn Node>,
        inputs: &[&str],
        outputs: &[&str],
    ) -> Result<&mut Self, Error> {
        let port = |(place, name): (usize, &&str)| Port { place, ..Port::real(name) };
        let inputs = inputs.iter().enumerate().map(port).collect();
        let outputs = outputs.iter().enumerate().map(port).collect();
        self.insert_node(name, NodeBody::Own, inputs, outputs, Some(node))
    }

    fn insert_node(
        &mut self,
        name: &str,
        body: NodeBody,
        inputs: Vec<Port>,
        outputs: Vec<Port>,
        own: Option<Box<dyn Node>>,
    ) -> Result<&mut Self, Error> {
        if self.nodes.iter().any(|node| node.name == name) {
            return Err(Error::invalid_input(format!("there are two nodes called `{name}`")));
        }
        let connections = inputs.iter().map(|_| None).collect();
        let name = name.to_owned();
        self.nodes.push(NodeDefinition { name, body, outputs, inputs, connections });
        self.own.push(own);
        Ok(self)
    }

    /// Says that an output follows an input of the same node without a step in between, `node.output` and `node.input`: a node of the program has
    /// none of these unless it says so.
    ///
    /// # Errors
    /// When there is no such output or input.
    pub fn declare_feedthrough(&mut self, output: &str, input: &str) -> Result<&mut Self, Error> {
        let (node, output) = self.find_port(output, false)?;
        let (_, input) = self.find_port(input, true)?;
        let place = self.nodes[node].inputs[input].place;
        let follows = &mut self.nodes[node].outputs[output].follows;
        if let Some(places) = follows {
            *follows = Some(places.iter().copied().chain([place]).collect());
        }
        Ok(self)
    }

    /// Connects an output to an input, both by `node.variable`. Units are converted.
    ///
    /// # Errors
    /// When there is no such output or input, when the input is connected already, and when types or units do not fit.
    pub fn connect(&mut self, output: &str, input: &str) -> Result<&mut Self, Error> {
        self.connect_with(output, input, ConnectionOptions::default())
    }

    /// The same with more on the way.
    ///
    /// # Errors
    /// As of [`connect`](Self::connect).
    pub fn connect_with(
        &mut self,
        output: &str,
        input: &str,
        options: ConnectionOptions,
    ) -> Result<&mut Self, Error> {
        let (from, given) = self.find_port(output, false)?;
        let (to, taken) = self.find_port(input, true)?;
        if self.nodes[to].connections[taken].is_some() {
            return Err(Error::invalid_input(format!("`{input}` is connected twice")));
        }
        let (giver, taker) = (&self.nodes[from], &self.nodes[to]);
        let ports = [&giver.outputs[given], &taker.inputs[taken]];
        let [source, target] = ports.map(|port| port.kind);
        if source != target && [source, target].contains(&ValueKind::String) {
            let message = format!("cannot connect `{output}` to `{input}`: a text is no number");
            return Err(Error::invalid_input(message));
        }
        let unfit =
            |what: String| Error::invalid_input(format!("cannot connect `{output}` to `{input}`: {what}"));
        let (factor, offset) = unit_conversion(ports[0], ports[1]).map_err(unfit)?;
        let input_chain = accepted_values(taker, ports[1]).map(|accepts| InputChain {
            factor,
            offset,
            map: Vec::new(),
            effects: options.effects,
            faults: Vec::new(),
            accepts,
        });
        let default = self.coupling.algorithm.properties().default_at;
        let at = options.at.unwrap_or(default);
        let extrapolation = options.extrapolation;
        let connection = ConnectionDefinition { node: from, output: given, at, input_chain, extrapolation };
        self.nodes[to].connections[taken] = Some(connection);
        Ok(self)
    }

    /// The node and the output or input of a name.
    fn find_port(&self, name: &str, is_input: bool) -> Result<(usize, usize), Error> {
        let mut known = Vec::new();
        for (place, node) in self.nodes.iter().enumerate() {
            let side = if is_input { &node.inputs } else { &node.outputs };
            for (port, it) in side.iter().enumerate() {
                let full = format!("{}.{}", node.name, it.name);
                if full == name {
                    return Ok((place, port));
                }
                known.push(full);
            }
        }
        let what = if is_input { "input" } else { "output" };
        Err(unknown_name(what, name, known.iter().map(String::as_str)).into_error())
    }

    /// The system, and the nodes that the program brings, by their places.
    ///
    /// # Errors
    /// When connections form a loop that the coupling algorithm does not solve.
    pub(crate) fn build_system(self) -> Result<(System, CustomNodes), Error> {
        let SystemBuilder { clock, coupling, nodes, own } = self;
        let all = connection_edges(&nodes);
        let graph = ConnectionGraph {
            nodes: nodes.len(),
            edges: &all,
            is_connector: &|_| false,
            follows: &|before, behind| has_feedthrough(&nodes, before, behind),
        };
        let order =
            StepOrder::of_graph(&graph, coupling.algorithm.properties().solves_loops).map_err(|cycle| {
                let labels: Vec<_> = cycle.iter().map(|edge| all[*edge].label.as_str()).collect();
                let message = format!("these connections form a loop: {}", labels.join(", "));
                Error::invalid_input(message)
                    .with_help("take one of them at the start of the step, or choose the algorithm `Iterate`")
            })?;
        let (coupling, order) = order.into_coupling(coupling);
        let (nodes, columns): (Vec<NodePlan>, _) = assign_columns(nodes);
        let system = System {
            coupling,
            clock,
            announced_stop: Some(clock.announced_stop()),
            tolerance: None,
            nodes,
            order,
            columns,
            warnings: Vec::new(),
        };
        Ok((system, own))
    }

    /// Makes the nodes and initialises them.
    ///
    /// # Errors
    /// When connections form a loop that the coupling algorithm does not solve; when an FMU does not load, or refuses something; when the
    /// initialisation fails.
    pub fn build(self) -> Result<Execution, Error> {
        let (mut system, own) = self.build_system()?;
        let mut nodes = node::instantiate_nodes(&mut system, None)?;
        for (node, own) in nodes.iter_mut().zip(own) {
            if let Some(own) = own {
                *node = own;
            }
        }
        let mut execution = Execution::new(system, nodes);
        execution.initialise()?;
        Ok(execution)
    }
}

/// The start value of a variable of an FMU.
fn start_value(node: &str, variables: &[Variable], name: &str, value: &Value) -> Result<StartValue, Error> {
    let found = variables.iter().find(|variable| variable.name == name);
    let Some(Variable { reference, storage, element, causality, .. }) = found else {
        let known = variables.iter().map(|variable| variable.name.as_str());
        return Err(unknown_name(&format!("variable of `{node}`"), name, known).into_error());
    };
    Ok(StartValue {
        name: name.to_owned(),
        reference: *reference,
        storage: *storage,
        element: *element,
        causality: *causality,
        value: value.clone(),
        place: None,
    })
}

/// Factor and offset from the unit of an output to that of an input.
fn unit_conversion(output: &Port, input: &Port) -> Result<(f64, f64), String> {
    let (Some(from), Some(to)) = (&output.unit, &input.unit) else { return Ok((1.0, 0.0)) };
    if from == to {
        return Ok((1.0, 0.0));
    }
    let units = Unit::parse(from).ok().zip(Unit::parse(to).ok());
    let conversion = units.and_then(|(from, to)| Unit::conversion(&from, &to));
    conversion.ok_or_else(|| format!("[{from}] cannot be converted to [{to}]"))
}

/// The values that an input of a node accepts; none for a text.
fn accepted_values(node: &NodeDefinition, input: &Port) -> Option<AcceptedValues> {
    let items = match &node.body {
        NodeBody::Fmu { fmu, .. } => fmu.description.variables[input.place].items.clone(),
        _ => Vec::new(),
    };
    match input.kind {
        ValueKind::String => None,
        ValueKind::Real => Some(AcceptedValues::Real),
        ValueKind::Boolean => Some(AcceptedValues::Boolean),
        _ if items.is_empty() => Some(AcceptedValues::Integer(input.storage)),
        _ => Some(AcceptedValues::Enumeration(items)),
    }
}

#[cfg(test)]
mod tests;
