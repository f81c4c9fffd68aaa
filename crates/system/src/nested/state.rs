//! Copies the state of the scenario inside the FMU: its nodes, its values, and what its connections remember.

use cosim::exchange::ExchangeState;
use cosim::execution::Execution;
use cosim::extrapolation::ExtrapolatedInput;
use cosim::node::{NodeState, stateful_node};
use cosim::system::{InputChain, InputChainState, NodeBody, NodePlan};
use fmu_export::{FmiResult, Lifecycle, VariableValue, reject};
use fmu_import::CallError;
use serde::{Deserialize, Serialize};

use super::ScenarioInstance;
use crate::running::ScenarioExecution;

/// The nodes of an instance between two resets.
pub(crate) struct ScenarioGeneration {
    /// States of nodes with another number are those of other nodes.
    pub number: u64,
    pub running: ScenarioExecution,
}

impl ScenarioGeneration {
    /// Whether the importer may have states of all nodes, and the process holds them beside others of the same FMUs.
    pub fn can_restore_state(&mut self) -> bool {
        let Execution { nodes, system, .. } = &mut self.running.execution;
        let only_once =
            |plan: &NodePlan| matches!(&plan.body, NodeBody::Fmu { fmu, .. } if fmu.description.only_once);
        let can_save = nodes.iter_mut().all(|node| node.as_stateful().is_some_and(|it| it.can_save()));
        can_save && !system.nodes.iter().any(only_once)
    }
}

/// A state of an instance.
pub struct SavedInstance {
    course: Lifecycle,
    values: Vec<VariableValue>,
    inputs: Vec<Option<f64>>,
    stale: bool,
    /// Nothing before the initialisation.
    parts: Option<SavedNodes>,
}

/// A state of the nodes.
struct SavedNodes {
    number: u64,
    tick: u64,
    nodes: Vec<NodeState>,
    memory: ExchangeState,
    /// What sensor effects and faults remember, by node and connection.
    chains: Vec<Vec<InputChain>>,
    coupling: Vec<u8>,
}

/// A state as bytes.
#[derive(Serialize, Deserialize)]
struct SerialisedInstance {
    guid: String,
    course: Lifecycle,
    values: Vec<VariableValue>,
    inputs: Vec<Option<f64>>,
    stale: bool,
    parts: Option<SerialisedNodes>,
}

/// A state of the nodes as bytes.
#[derive(Serialize, Deserialize)]
struct SerialisedNodes {
    /// The first communication point [s].
    start: f64,
    tick: u64,
    nodes: Vec<Vec<u8>>,
    /// Its numbers, texts and integers.
    row: (Vec<f64>, Vec<String>, Vec<i128>),
    extrapolated: Vec<Vec<ExtrapolatedInput>>,
    coupling: Vec<u8>,
    /// What sensor effects and faults remember, by node and connection.
    chains: Vec<Vec<InputChainState>>,
}

/// The failure of a node's call, which does no harm to the instance.
fn reject_node_call<T>(plan: &NodePlan, error: &CallError) -> FmiResult<T> {
    reject(format!("`{}`: {} {}", plan.name, error.call, error.what))
}

impl ScenarioInstance {
    pub(crate) fn save_state(&mut self) -> FmiResult<SavedInstance> {
        let parts = match &mut self.parts {
            None => None,
            Some(ScenarioGeneration { number, running }) => {
                let nodes = running.execution.nodes.iter_mut().zip(&running.execution.system.nodes);
                let nodes = nodes
                    .map(|(node, plan)| {
                        let saved = stateful_node(node.as_mut()).and_then(|it| it.save_state());
                        saved.or_else(|error| reject_node_call(plan, &error))
                    })
                    .collect::<FmiResult<Vec<_>>>()?;
                let chains = running
                    .execution
                    .system
                    .nodes
                    .iter()
                    .map(|plan| plan.connections.iter().map(|it| it.input_chain.clone()).collect());
                let memory = running.execution.memory.clone();
                let (number, tick) = (*number, running.execution.tick);
                let (chains, coupling) = (chains.collect(), running.execution.coupling.state_to_bytes());
                Some(SavedNodes { number, tick, nodes, memory, chains, coupling })
            }
        };
        let (course, values, inputs) = (self.course.clone(), self.values.clone(), self.inputs.clone());
        Ok(SavedInstance { course, values, inputs, stale: self.stale, parts })
    }

    pub(crate) fn restore_state(&mut self, saved: &SavedInstance) -> FmiResult {
        match &saved.parts {
            None => self.parts = None,
            Some(parts) => {
                let number = parts.number;
                if self.parts.as_ref().is_none_or(|it| it.number != number) {
                    if self.retired.as_ref().is_none_or(|it| it.number != number) {
                        return reject("the state is that of an initialisation that is gone");
                    }
                    std::mem::swap(&mut self.parts, &mut self.retired);
                }
                let Some(ScenarioGeneration { running, .. }) = &mut self.parts else {
                    return Ok(());
                };
                let nodes =
                    running.execution.nodes.iter_mut().zip(&parts.nodes).zip(&running.execution.system.nodes);
                for ((node, state), plan) in nodes {
                    let restored = stateful_node(node.as_mut()).and_then(|it| it.restore_state(state));
                    restored.or_else(|error| reject_node_call(plan, &error))?;
                }
                let plans = running.execution.system.nodes.iter_mut().zip(&parts.chains);
                for (connection, chain) in
                    plans.flat_map(|(plan, chains)| plan.connections.iter_mut().zip(chains))
                {
                    connection.input_chain.clone_from(chain);
                }
                running.execution.tick = parts.tick;
                running.execution.memory.clone_from(&parts.memory);
                running.restore_coupling(&parts.coupling)?;
            }
        }
        self.course.clone_from(&saved.course);
        self.values.clone_from(&saved.values);
        self.inputs.clone_from(&saved.inputs);
        self.stale = saved.stale;
        Ok(())
    }

    pub(crate) fn state_to_bytes(&mut self, saved: &SavedInstance) -> FmiResult<Vec<u8>> {
        let parts = match (&saved.parts, &mut self.parts) {
            (None, _) => None,
            (Some(parts), Some(own)) if own.number == parts.number => {
                let running = &mut own.running;
                let nodes =
                    running.execution.nodes.iter_mut().zip(&parts.nodes).zip(&running.execution.system.nodes);
                let nodes = nodes.map(|((node, state), plan)| {
                    let bytes = stateful_node(node.as_mut()).and_then(|it| it.serialise_state(state));
                    bytes.or_else(|error| reject_node_call(plan, &error))
                });
                let nodes = nodes.collect::<FmiResult<_>>()?;
                let row = &parts.memory.row;
                let (numbers, texts) = (row.numbers().to_vec(), row.texts().to_vec());
                let (integers, start) = (row.integers().to_vec(), running.execution.system.clock.start);
                let (extrapolated, coupling) = (parts.memory.extrapolated.clone(), parts.coupling.clone());
                let chains = parts.chains.iter();
                let chains = chains.map(|chains| chains.iter().map(InputChain::saved_state).collect());
                let (tick, chains) = (parts.tick, chains.collect());
                let row = (numbers, texts, integers);
                Some(SerialisedNodes { start, tick, nodes, row, extrapolated, coupling, chains })
            }
            _ => return reject("the state is that of an initialisation that is gone"),
        };
        let SavedInstance { course, values, inputs, stale, .. } = saved;
        let (guid, stale) = (self.interface.guid.clone(), *stale);
        let (course, values, inputs) = (course.clone(), values.clone(), inputs.clone());
        let bytes = SerialisedInstance { guid, course, values, inputs, stale, parts };
        postcard::to_stdvec(&bytes).or_else(|error| reject(error.to_string()))
    }

    pub(crate) fn state_from_bytes(&mut self, bytes: &[u8]) -> FmiResult<SavedInstance> {
        let SerialisedInstance { guid, course, values, inputs, stale, parts } =
            postcard::from_bytes(bytes)
                .or_else(|error| reject(format!("these bytes are no FMU state: {error}")))?;
        if guid != self.interface.guid {
            let own = &self.interface.guid;
            return reject(format!("expected a state of {own}, found one of {guid}"));
        }
        let fits = values.len() == self.values.len()
            && inputs.len() == values.len()
            && values.iter().zip(&self.values).all(|(one, other)| one.kind() == other.kind());
        let impossible = "these bytes are no state that the FMU can be in";
        if !fits {
            return reject(impossible);
        }
        let Some(SerialisedNodes {
            start,
            tick,
            nodes,
            row: (numbers, texts, integers),
            extrapolated,
            coupling,
            chains,
        }) = parts
        else {
            return Ok(SavedInstance { course, values, inputs, stale, parts: None });
        };
        if self.parts.is_none() {
            // The nodes of another instance, or of before a reset: these have the same parameters and times.
            let before = (self.course.clone(), self.values.clone());
            self.course = course.clone();
            self.course.now = start;
            self.values.clone_from(&values);
            let assembled = self.assemble_nodes();
            (self.course, self.values) = before;
            self.parts = Some(assembled?);
        }
        let Some(ScenarioGeneration { number, running }) = &mut self.parts else {
            return reject(impossible);
        };
        let row = &running.execution.system.columns.zero_row();
        let sizes = [row.numbers().len(), row.texts().len(), row.integers().len()];
        let same = sizes == [numbers.len(), texts.len(), integers.len()]
            && nodes.len() == running.execution.nodes.len()
            && extrapolated.len() == nodes.len();
        if !same {
            return reject(impossible);
        }
        let nodes = running.execution.nodes.iter_mut().zip(&nodes).zip(&running.execution.system.nodes);
        let nodes = nodes.map(|((node, bytes), plan)| {
            let state = stateful_node(node.as_mut()).and_then(|it| it.deserialise_state(bytes));
            state.or_else(|error| reject_node_call(plan, &error))
        });
        let nodes = nodes.collect::<FmiResult<_>>()?;
        let mut memory = ExchangeState::new(&running.execution.system);
        let alike = |one: &[ExtrapolatedInput], other: &[ExtrapolatedInput]| {
            one.iter().map(|it| it.place).eq(other.iter().map(|it| it.place))
        };
        if !extrapolated.iter().zip(&memory.extrapolated).all(|(one, other)| alike(one, other)) {
            return reject(impossible);
        }
        memory.row.set_values(&numbers, Some(texts), &integers);
        memory.extrapolated = extrapolated;
        let Some(chains) = restored_chains(&running.execution.system.nodes, &chains, &memory) else {
            return reject(impossible);
        };
        let parts = Some(SavedNodes { number: *number, tick, nodes, memory, chains, coupling });
        Ok(SavedInstance { course, values, inputs, stale, parts })
    }
}

/// The ways to the inputs of nodes with what they remember; none when these are memories of others.
fn restored_chains(
    plans: &[NodePlan],
    memories: &[Vec<InputChainState>],
    memory: &ExchangeState,
) -> Option<Vec<Vec<InputChain>>> {
    let of_node = |(plan, memories): (&NodePlan, &Vec<InputChainState>)| {
        let links = plan.connections.iter().zip(plan.inputs.indices()).zip(memories);
        let chains = links.map(|((link, input), own)| {
            let mut chain = link.input_chain.clone();
            chain.restore_state(own, memory.row[input]).ok().map(|()| chain)
        });
        let chains = chains.collect::<Option<Vec<_>>>();
        chains.filter(|chains| chains.len() == plan.connections.len())
    };
    let all = plans.iter().zip(memories).map(of_node).collect::<Option<Vec<_>>>();
    all.filter(|all| all.len() == plans.len())
}
