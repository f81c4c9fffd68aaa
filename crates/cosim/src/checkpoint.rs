//! Holds all that a run needs to go on from a communication point: states of nodes, values, what connections remember.

mod compatibility;
mod rehearsal;
mod values;

use std::collections::HashMap;

use diagnostics::Error;
use fmu_import::CallError;
use recording::{AllVariables, Row};
use serde::{Deserialize, Serialize};

pub use self::compatibility::{CheckpointCompatibility, SystemFingerprint};
pub use self::rehearsal::{OutputDifference, output_differences, verify_checkpoint};
use self::values::MissingOutputs;
pub use self::values::{RowNames, RowValues};
use crate::coupling::CouplingAlgorithm;
use crate::exchange::{Exchange, call_failure_error, get_outputs};
use crate::extrapolation::ExtrapolatedInput;
use crate::node::{Node, NodeState, stateful_node};
use crate::system::{InputChainState, NodeBody, NodePlan, StartValue, System};

/// So many communication points after a checkpoint are remembered with it, so that one can see whether a run goes on in the same way.
pub const FOLLOWING: usize = 10;

/// A run at a communication point.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Checkpoint {
    /// The name of the run.
    pub name: String,
    /// The number of the communication point.
    pub tick: u64,
    /// Its time [s].
    pub time: f64,
    /// What the system is made of.
    pub fingerprint: SystemFingerprint,
    /// The values at the communication points after it.
    pub following: Vec<RowValues>,
    row_names: RowNames,
    values: RowValues,
    /// What the ways to inputs remember, by the names of the inputs.
    chains: Vec<(String, InputChainState)>,
    /// The last values of extrapolated inputs, by the names of the inputs.
    extrapolated: Vec<(String, ExtrapolatedInput)>,
    /// The states of FMUs and drivers by the names of their nodes; none when they do not leave the process.
    nodes: Vec<(String, Vec<u8>)>,
    coupling: Vec<u8>,
}

/// The states of FMUs and drivers by the names of their nodes.
pub type NodeStates = HashMap<String, NodeState>;

/// Finds the FMUs that cannot do what a checkpoint needs: save a state, and turn it into bytes, if it has to leave the process.
///
/// # Errors
/// With the names of those that cannot, and what works instead.
pub fn check_checkpoint_support(system: &System, in_bytes: bool) -> Result<(), Error> {
    let (mut none, mut no_bytes) = (Vec::new(), Vec::new());
    for plan in &system.nodes {
        let NodeBody::Fmu { fmu, .. } = &plan.body else { continue };
        let about = &fmu.description;
        match (about.state || about.serialised_state, about.serialised_state) {
            (false, _) => none.push(plan.name.as_str()),
            (true, false) if in_bytes => no_bytes.push(plan.name.as_str()),
            _ => {}
        }
    }
    if !none.is_empty() {
        let names = none.join("`, `");
        let message = format!(
            "a checkpoint needs FMUs that save their state, and `{names}` cannot (canGetAndSetFMUstate)"
        );
        let error = Error::invalid_input(message);
        return Err(error.with_help("let each end run from its beginning: scenarios that `extends` one"));
    }
    if no_bytes.is_empty() {
        return Ok(());
    }
    let names = no_bytes.join("`, `");
    let message = format!(
        "the file of a checkpoint needs states as bytes, and `{names}` cannot give them (canSerializeFMUstate)"
    );
    let error = Error::invalid_input(message);
    Err(error.with_help(
        "go on in the same process: trackside run WARMUP --checkpoint TIME --branch END [--branch END]",
    ))
}

impl Checkpoint {
    /// The run at communication point `tick`, with the states of its FMUs: as bytes, if they are to leave the process, or else beside it.
    ///
    /// # Errors
    /// When an FMU fails.
    pub fn capture(
        exchange: &mut Exchange,
        coupling: &dyn CouplingAlgorithm,
        name: &str,
        fingerprint: &SystemFingerprint,
        tick: u64,
        in_bytes: bool,
    ) -> Result<(Self, NodeStates), Error> {
        let time = exchange.clock().time_at(tick);
        let (mut states, mut nodes) = (NodeStates::new(), Vec::new());
        for (plan, node) in exchange.plans.iter().zip(exchange.nodes.iter_mut()) {
            if !plan.body.has_internal_state() {
                continue;
            }
            let failed = |error| call_failure_error(plan, error, time);
            let stateful = stateful_node(node.as_mut()).map_err(failed)?;
            let state = stateful.save_state().map_err(failed)?;
            if in_bytes {
                nodes.push((plan.name.clone(), stateful.serialise_state(&state).map_err(failed)?));
                // An FMU that knows of a state to go back to may remember more.
                continue;
            }
            states.insert(plan.name.clone(), state);
        }
        let chains = exchange.plans.iter().flat_map(|plan| {
            let inputs = plan.inputs.indices().map(|input| exchange.columns[input].qualified_name());
            let links = plan.connections.iter().map(|link| link.input_chain.saved_state());
            inputs.zip(links)
        });
        let checkpoint = Checkpoint {
            name: name.to_owned(),
            tick,
            time,
            fingerprint: fingerprint.clone(),
            following: Vec::new(),
            row_names: RowNames::of_system(exchange.plans, exchange.columns),
            values: RowValues::from_row(exchange.row()),
            chains: chains.collect(),
            extrapolated: exchange.extrapolated_inputs(),
            nodes,
            coupling: coupling.state_to_bytes(),
        };
        Ok((checkpoint, states))
    }

    /// Takes the values at the communication point after those that it has; whether it needs more.
    pub fn add_following_row(&mut self, row: &Row<AllVariables>) -> bool {
        if self.following.len() < FOLLOWING {
            self.following.push(RowValues::from_row(row));
        }
        self.following.len() < FOLLOWING
    }

    /// The values of a row of a system as the checkpoint has them, for the `index`-th communication point after it.
    #[must_use]
    pub fn following_row(
        &self,
        index: usize,
        system: &Row<AllVariables>,
        exchange: &Exchange,
    ) -> Option<Row<AllVariables>> {
        let mut row = system.clone();
        let missing = self.row_names.fill_row(self.following.get(index)?, exchange.columns, &mut row);
        missing.is_ok_and(|missing| missing.is_empty()).then_some(row)
    }

    /// Brings nodes that are initialised, or those that it was taken of, to the checkpoint; `states` are theirs in the latter case.
    ///
    /// # Errors
    /// When an FMU fails, or does not know its state, and when values are missing.
    pub fn restore(
        &self,
        exchange: &mut Exchange,
        coupling: &mut dyn CouplingAlgorithm,
        states: Option<&NodeStates>,
        fingerprint: &SystemFingerprint,
        compatibility: &CheckpointCompatibility,
    ) -> Result<(), Error> {
        let mut row = exchange.state.row.clone();
        let missing = self.row_names.fill_row(&self.values, exchange.columns, &mut row);
        let missing = missing.map_err(|what| self.corrupt_checkpoint_error(&what))?;
        let clock = exchange.clock();
        let chains = self.chains.iter().map(|(name, memory)| (name.as_str(), memory)).collect();
        let bytes: HashMap<&str, &[u8]> =
            self.nodes.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
        for (plan, node) in exchange.plans.iter_mut().zip(exchange.nodes.iter_mut()) {
            let name = plan.name.clone();
            let kept = states.and_then(|states| states.get(&name));
            let time = clock.time_at(self.tick);
            let failed = |error: CallError| call_failure_error(plan, error, time);
            match (plan.body.has_internal_state(), kept, bytes.get(name.as_str())) {
                (true, Some(state), _) => {
                    let stateful = stateful_node(node.as_mut()).map_err(failed)?;
                    stateful.restore_state(state).map_err(failed)?;
                }
                (true, None, Some(bytes)) => {
                    from_bytes(node.as_mut(), bytes).map_err(failed)?;
                }
                (true, None, None) => {
                    return Err(self.corrupt_checkpoint_error(&format!("it has no state of `{name}`")));
                }
                // A source knows nothing but its time.
                (false, ..) => from_bytes(node.as_mut(), &time.to_le_bytes()).map_err(failed)?,
            }
            self.restore_connections(plan, exchange.columns, &row, &chains)?;
            let tuned = compatibility.tuned.iter().filter(|(node, _)| *node == name);
            for (_, values) in tuned {
                tune_node_parameters(node.as_mut(), values, time)
                    .map_err(|error| call_failure_error(plan, error, time))?;
            }
        }
        exchange.state.row.copy_from(&row);
        exchange.restore_extrapolated_inputs(&self.extrapolated);
        read_missing(exchange, &missing, clock.time_at(self.tick))?;
        if fingerprint.has_same_coupling(&self.fingerprint) && !self.coupling.is_empty() {
            coupling
                .restore_from_bytes(&self.coupling)
                .map_err(|error| self.corrupt_checkpoint_error(&error.to_string()))?;
        }
        Ok(())
    }

    /// Lets the connections of a node remember.
    fn restore_connections(
        &self,
        plan: &mut NodePlan,
        columns: &recording::Columns<AllVariables>,
        row: &Row<AllVariables>,
        chains: &HashMap<&str, &InputChainState>,
    ) -> Result<(), Error> {
        for (link, input) in plan.connections.iter_mut().zip(plan.inputs.indices()) {
            let name = columns[input].qualified_name();
            let Some(memory) = chains.get(name.as_str()) else { continue };
            let recalled = link.input_chain.restore_state(memory, row[input]);
            recalled.map_err(|key| {
                self.corrupt_checkpoint_error(&format!(
                    "the effect `{key}` of `{name}` cannot remember what it has"
                ))
            })?;
        }
        Ok(())
    }

    /// The error of a checkpoint that is not whole.
    fn corrupt_checkpoint_error(&self, what: &str) -> Error {
        let Checkpoint { name, time, .. } = self;
        Error::invalid_input(format!("the checkpoint of `{name}` at {time} s is damaged: {what}"))
    }
}

/// Reads outputs that a row at a time [s] has no values of.
fn read_missing(exchange: &mut Exchange, missing: &MissingOutputs, time: f64) -> Result<(), Error> {
    if missing.is_empty() {
        return Ok(());
    }
    let mut row = exchange.state.row.clone();
    for (plan, node) in exchange.plans.iter().zip(exchange.nodes.iter_mut()) {
        if let NodeBody::Fmu { .. } = plan.body {
            get_outputs(plan, node.as_mut(), &mut row)
                .map_err(|error| call_failure_error(plan, error, time))?;
        }
    }
    for number in &missing.numbers {
        match exchange.columns.integer_index_of(*number) {
            Some(integer) => exchange.state.row.set_integer(integer, *number, row[integer]),
            None => exchange.state.row[*number] = row[*number],
        }
    }
    missing.texts.iter().for_each(|text| exchange.state.row[*text].clone_from(&row[*text]));
    Ok(())
}

fn from_bytes(node: &mut dyn Node, bytes: &[u8]) -> Result<(), CallError> {
    let stateful = stateful_node(node)?;
    let state = stateful.deserialise_state(bytes)?;
    stateful.restore_state(&state)
}

fn tune_node_parameters(node: &mut dyn Node, values: &[StartValue], time: f64) -> Result<(), CallError> {
    let none = || CallError::new("the node", "has no parameters");
    node.as_tunable_parameters().ok_or_else(none)?.tune_parameters(values, time)
}
