//! Controls the length of steps: divides communication steps into halves, where the error of the coupling or an FMU asks for it.

use diagnostics::{Error, rounded_time};
use recording::{AllVariables, NumberIndex, Row};
use serde::{Deserialize, Serialize};

use super::energy::EnergyErrorEstimator;
use super::part_error::SubstepError;
use super::summary::{ConnectionError, CouplingSummary, DivisionSummary};
use super::{CouplingAlgorithm, invalid_state_error};
use crate::clock::CommunicationClock;
use crate::exchange::{
    Exchange, ExchangeSnapshot, StepInterruption, check_failures, quoted_node_names,
    unsolved_loop_interruption,
};
use crate::system::{ErrorEstimate, NodeBody, NodePlan, StepDivision, System};

/// A communication step is halved at most so often [-].
const DEEPEST: u32 = 20;
const PARTS: u64 = 1 << DEEPEST;
/// The least size of a value without a nominal one, in its unit.
const LEAST: f64 = 1e-6;
/// Share of the tolerance that a step may take so that one of twice the length is tried [-].
const SAFE: f64 = 0.8;

/// A coupling whose steps are divided.
pub(super) struct StepControl {
    inner: Box<dyn CouplingAlgorithm>,
    division: StepDivision,
    /// The order of the algorithm [-].
    order: i32,
    nodes: Vec<usize>,
    /// The sources of the connected inputs, of numbers.
    sources: Vec<NumberIndex<AllVariables>>,
    energy: EnergyErrorEstimator,
    begin: Option<ExchangeSnapshot>,
    /// The row at the end of a part that was done as a whole.
    whole: Row<AllVariables>,
    memory: StepControllerState,
    /// The errors of the last part.
    errors: Vec<SubstepError>,
    summary: DivisionSummary,
}

/// What it remembers from one step to the next.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct StepControllerState {
    /// A part is a communication step halved so often.
    depth: u32,
    /// The largest size of each connected value so far, or of the power of each bond.
    sizes: Vec<f64>,
    inner: Vec<u8>,
}

impl StepControl {
    pub fn new(system: &System, division: StepDivision, inner: Box<dyn CouplingAlgorithm>) -> Self {
        let inputs = system.nodes.iter().flat_map(|node| {
            let links = node.connections.iter().zip(node.inputs.indices());
            links.map(|(link, input)| (system.columns[input].qualified_name(), link.source.index))
        });
        let (names, sources): (Vec<_>, Vec<_>) = inputs.unzip();
        let names = match division.control {
            None => Vec::new(),
            Some((ErrorEstimate::Richardson, _)) => names,
            Some((ErrorEstimate::Energy, _)) => division.bonds.iter().map(|bond| bond.name.clone()).collect(),
        };
        let sizes = match division.control {
            Some((ErrorEstimate::Richardson, _)) => {
                sources.iter().map(|source| smallest_error_scale(system, *source)).collect()
            }
            _ => vec![0.0; names.len()],
        };
        let error = |name| ConnectionError { name, ..ConnectionError::default() };
        let errors = names.into_iter().map(error).collect();
        let shortest = (f64::INFINITY, 0.0);
        StepControl {
            inner,
            order: system.coupling.algorithm.properties().order,
            nodes: (0..system.nodes.len()).collect(),
            sources,
            energy: EnergyErrorEstimator::new(division.bonds.clone()),
            division,
            begin: None,
            whole: system.columns.zero_row(),
            memory: StepControllerState { sizes, ..StepControllerState::default() },
            errors: Vec::new(),
            summary: DivisionSummary { shortest, errors, ..DivisionSummary::default() },
        }
    }

    /// Whether each part is done again in halves.
    fn has_half_step_check(&self) -> bool {
        matches!(self.division.control, Some((ErrorEstimate::Richardson, _)))
    }

    /// Whether a part can be done again.
    fn can_go_back(&self) -> bool {
        self.has_half_step_check() || self.division.halves_discarded
    }

    /// Whether a part that did not come to its end is done again in halves.
    fn can_repeat_after(&self, why: &StepInterruption) -> bool {
        match why {
            StepInterruption::Call { error, .. } => error.discarded && self.division.halves_discarded,
            StepInterruption::Value(_) => false,
            StepInterruption::Unsolved(_) => self.can_go_back(),
        }
    }

    /// Does the part from point `tick` of a clock on; its error, relative to what is allowed [-].
    fn do_substep(
        &mut self,
        exchange: &mut Exchange,
        clock: CommunicationClock,
        tick: u64,
        memory: &[u8],
    ) -> Result<f64, StepInterruption> {
        exchange.begin_substep(clock, tick);
        self.inner.step(exchange)?;
        let Some((estimate, tolerance)) = self.division.control else { return Ok(0.0) };
        let error = match estimate {
            ErrorEstimate::Energy => {
                self.energy.estimate_error(exchange, &mut self.memory.sizes, &mut self.errors)
            }
            ErrorEstimate::Richardson => {
                self.whole.copy_from(exchange.row());
                self.roll_back(exchange, memory)?;
                let halves = clock.refined_by(2);
                for half in [2 * tick, 2 * tick + 1] {
                    exchange.begin_substep(halves, half);
                    self.inner.step(exchange)?;
                }
                self.richardson_error(exchange.row())
            }
        };
        Ok(error / tolerance)
    }

    fn roll_back(&mut self, exchange: &mut Exchange, memory: &[u8]) -> Result<(), StepInterruption> {
        if let Some(begin) = &self.begin {
            exchange.restore_snapshot(begin)?;
        }
        match memory {
            [] => Ok(()),
            memory => self.inner.restore_from_bytes(memory).map_err(StepInterruption::Value),
        }
    }

    /// The largest error of a connected value relative to its size, from a part as a whole and in two halves (Richardson).
    fn richardson_error(&mut self, row: &Row<AllVariables>) -> f64 {
        let mut worst = 0.0_f64;
        self.errors.clear();
        for (source, size) in self.sources.iter().zip(&mut self.memory.sizes) {
            *size = size.max(row[*source].abs());
            let error = (self.whole[*source] - row[*source]).abs() / (2_f64.powi(self.order) - 1.0);
            let relative = if error == 0.0 { 0.0 } else { error / *size };
            worst = worst.max(relative);
            self.errors.push(SubstepError { absolute: error, relative });
        }
        worst
    }

    /// Takes a part that is done into account.
    fn record_substep(&mut self, begin: f64, length: f64) {
        for (summary, error) in self.summary.errors.iter_mut().zip(&self.errors) {
            summary.record_error(error.absolute, error.relative, begin);
        }
        self.summary.parts += 1;
        if length < self.summary.shortest.0 {
            self.summary.shortest = (length, begin);
        }
    }

    /// The depth of the part after one of this depth with this error, relative to what is allowed [-].
    fn next_depth(&self, depth: u32, error: f64) -> u32 {
        match self.division.control {
            Some((ErrorEstimate::Energy, _)) if error > 1.0 => (depth + 1).min(DEEPEST - 1),
            _ if error < SAFE / 2_f64.powi(self.order) => depth.saturating_sub(1),
            _ => depth,
        }
    }

    /// The FMUs that take steps of one length only.
    fn fixed_steps<'p>(plans: &'p [NodePlan]) -> impl Iterator<Item = usize> + 'p {
        plans.iter().enumerate().filter_map(|(place, plan)| match &plan.body {
            NodeBody::Fmu { fmu, .. } if !fmu.description.variable_step => Some(place),
            _ => None,
        })
    }
}

/// The least size of a value that errors are compared with: its nominal value. What grows from 0 has no size of its own yet.
fn smallest_error_scale(system: &System, source: NumberIndex<AllVariables>) -> f64 {
    let column = &system.columns[source];
    let nominal = system.nodes.iter().filter(|plan| plan.name == column.node).find_map(|plan| {
        let NodeBody::Fmu { fmu, .. } = &plan.body else { return None };
        let about = &fmu.description;
        about.variables[about.find_variable(&column.variable)?].nominal
    });
    nominal.map_or(LEAST, f64::abs).max(f64::MIN_POSITIVE)
}

/// The error of a step that cannot be divided any more.
fn too_short(begin: f64, error: f64) -> StepInterruption {
    let what = format!(
        "the error of the coupling at t = {} s is {error:.3} times the `tolerance`, also when the communication step is divided by {PARTS}",
        rounded_time(begin)
    );
    unsolved_loop_interruption(
        what,
        "look there for a jump of an output, or choose a larger `tolerance` in [coupling]",
    )
}

impl CouplingAlgorithm for StepControl {
    fn initialise(&mut self, exchange: &mut Exchange) -> Result<(), Error> {
        let fixed: Vec<_> = Self::fixed_steps(exchange.node_plans()).collect();
        if !fixed.is_empty() {
            let names = quoted_node_names(exchange, &fixed);
            let message = format!(
                "[coupling] divides communication steps, but {names} takes steps of one length only (canHandleVariableCommunicationStepSize)"
            );
            return Err(Error::invalid_input(message).with_help("leave out `tolerance` and `on_discard`"));
        }
        let stuck = exchange.nodes_without_rollback(&self.nodes);
        if self.can_go_back() && !stuck.is_empty() {
            let names = quoted_node_names(exchange, &stuck);
            let message = format!(
                "[coupling] repeats steps, but {names} cannot go back to the start of one (canGetAndSetFMUstate)"
            );
            return Err(Error::invalid_input(message).with_help(
                "the estimate `error = \"energy\"` repeats none; without `tolerance` and `on_discard` no step is divided",
            ));
        }
        if self.has_half_step_check() {
            check_failures(exchange, &self.nodes)?;
        }
        self.inner.initialise(exchange)
    }

    fn step(&mut self, exchange: &mut Exchange) -> Result<(), StepInterruption> {
        let (communication, tick) = (exchange.clock(), exchange.start_tick());
        let mut done = 0;
        while done < PARTS {
            // A part begins at a multiple of its length.
            let depth = self.memory.depth.max(DEEPEST - done.trailing_zeros().min(DEEPEST));
            let clock = communication.refined_by(1 << depth);
            let point = (tick << depth) + (done >> (DEEPEST - depth));
            let begin = clock.time_at(point);
            let mut memory = Vec::new();
            if self.can_go_back() {
                exchange.save_snapshot(&self.nodes, &mut self.begin)?;
                memory = self.inner.state_to_bytes();
            }
            let again = match self.do_substep(exchange, clock, point, &memory) {
                Ok(error) if error <= 1.0 || !self.has_half_step_check() => {
                    self.memory.depth = self.next_depth(depth, error);
                    None
                }
                // Both halves of the last parts are one step more.
                Ok(error) if depth + 1 >= DEEPEST => return Err(too_short(begin, error)),
                Ok(_) => Some(()),
                Err(why) if self.can_repeat_after(&why) && depth < DEEPEST => Some(()),
                Err(why) => return Err(why),
            };
            if again.is_some() {
                self.roll_back(exchange, &memory)?;
                self.memory.depth = depth + 1;
                self.summary.repeated += 1;
                continue;
            }
            done += PARTS >> depth;
            self.record_substep(begin, clock.step);
        }
        Ok(())
    }

    fn coupling_summary(&self) -> CouplingSummary {
        CouplingSummary { division: Some(self.summary.clone()), ..self.inner.coupling_summary() }
    }

    fn state_to_bytes(&self) -> Vec<u8> {
        let memory = StepControllerState { inner: self.inner.state_to_bytes(), ..self.memory.clone() };
        // Vectors of numbers always have bytes.
        postcard::to_stdvec(&memory).unwrap_or_default()
    }

    fn restore_from_bytes(&mut self, memory: &[u8]) -> Result<(), Error> {
        let memory: StepControllerState = postcard::from_bytes(memory).map_err(invalid_state_error)?;
        if memory.depth > DEEPEST || memory.sizes.len() != self.memory.sizes.len() {
            return Err(Error::invalid_input("the memory of the coupling is that of another system"));
        }
        self.memory = memory;
        if self.memory.inner.is_empty() {
            return Ok(());
        }
        self.inner.restore_from_bytes(&self.memory.inner)
    }
}
