//! Runs one FMU for the host of this process, and answers until it is sent away.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use diagnostics::{Error, print_to_stderr};
use fmu_import::{CallError, Fmu, FmuMessage, MessageLevel, OpenError};
use isolation::{ChannelPacket, ProcessChannel, ProtectionMechanism};

use super::protocol::{
    GuestCommand, GuestCommandOutcome, GuestRequest, GuestResponse, IsolatedNodeSetup, NonNumericValues,
    StepPolynomials,
};
use crate::node::refusal::FmuRefusal;
use crate::node::{
    DirectionalDerivatives, ExtrapolatedInputs, FmuNode, Node, NodeState, Stateful, TunableParameters,
    TypedValues,
};
use crate::system::VariableGroups;

/// Serves `host`, the number of the process that started this one, until it asks this one to leave.
///
/// # Errors
/// When this process has no such host, or that has ended.
pub fn serve_host_process(host: u32) -> Result<(), Error> {
    let wrong = |what: String| Error::invalid_input(format!("isolated is for FMUs of a run: {what}"));
    let (channel, note) =
        isolation::connect_to_host_process(host).map_err(|error| wrong(error.to_string()))?;
    fmu_import::ignore_termination_signals();
    fmu_import::share_call_notes(Some(note));
    let look = || match isolation::is_host_alive(host) {
        true => Ok(()),
        false => Err(wrong("that has ended".to_owned())),
    };
    let (mut talk, mut served) = (ChannelPacket::default(), None);
    loop {
        channel.receive(&mut talk, look)?;
        let request = postcard::from_bytes::<GuestRequest>(&talk.bytes);
        let request = request.map_err(|error| wrong(error.to_string()))?;
        if let GuestCommand::Exit = request.command {
            // The run is over, and nobody reads the note any more.
            fmu_import::share_call_notes(None);
            fmu_import::set_final_exit_code(Some(0));
            drop(served);
            let late = fmu_import::messages_while_freed();
            late.iter().for_each(|it| print_to_stderr(&format!("warning: {it}")));
            return Ok(());
        }
        let end = matches!(request.command, GuestCommand::Terminate);
        let begin = Instant::now();
        let outcome = respond_to_request(&mut served, request, &mut talk.numbers);
        let duration = begin.elapsed();
        let messages = served.as_mut().map(|served| served.node.take_messages());
        let mut messages = messages.unwrap_or_default();
        if end {
            let changed = fmu_import::take_process_change_reports().into_iter();
            messages.extend(changed.map(|what| FmuMessage::new(MessageLevel::Warning, "", &what)));
        }
        let response = GuestResponse { outcome, messages, duration };
        send_response(&channel, &talk, &response, look)?;
    }
}

fn send_response(
    channel: &ProcessChannel,
    talk: &ChannelPacket,
    response: &GuestResponse,
    look: impl FnMut() -> Result<(), Error>,
) -> Result<(), Error> {
    let bytes = postcard::to_stdvec(response).map_err(|error| Error::invalid_input(error.to_string()))?;
    let shown = matches!(response.outcome, Ok(GuestCommandOutcome::Outputs(_)));
    let numbers = if shown { talk.numbers.as_slice() } else { &[] };
    channel.send(numbers, &bytes, look)
}

/// A node, its saved states by number, and how much it shows.
struct ServedNode {
    node: FmuNode,
    states: BTreeMap<u64, NodeState>,
    numbers: usize,
    integers: usize,
    texts: usize,
}

/// Does what is asked. `numbers` are those of the inputs at first, and those of the outputs when they are shown.
fn respond_to_request(
    served: &mut Option<ServedNode>,
    request: GuestRequest,
    numbers: &mut Vec<f64>,
) -> Result<GuestCommandOutcome, FmuRefusal> {
    if let GuestCommand::Open(setup) = request.command {
        let (opened, done) = open_node(*setup)?;
        *served = Some(opened);
        return Ok(done);
    }
    let Some(served) = served else {
        return Err(FmuRefusal::Early(CallError::new("the node", "is not open yet")));
    };
    served.drop_states(&request.dropped);
    if let Some(NonNumericValues { integers, texts, extrapolation }) = request.inputs {
        match extrapolation {
            None => served.node.set_inputs(numbers)?,
            Some(StepPolynomials { polynomials, span })
                if polynomials.iter().all(|it| it.place < numbers.len()) =>
            {
                served.node.set_extrapolated_inputs(numbers, &polynomials, span)?;
            }
            Some(_) => return Err(CallError::new("the inputs", "are not as many").into()),
        }
        if !integers.is_empty() {
            served.node.set_integers(&integers)?;
        }
        if !texts.is_empty() {
            served.node.set_texts(&texts)?;
        }
    }
    match request.command {
        GuestCommand::EnterInitialization => {
            served.node.begin_initialization().map(GuestCommandOutcome::Initialized)
        }
        GuestCommand::DoStep(clock, tick) => {
            served.node.do_step(&clock, tick)?;
            Ok(served.get_outputs(numbers)?)
        }
        GuestCommand::GetOutputs => Ok(served.get_outputs(numbers)?),
        command => Ok(served.run_command(command)?),
    }
}

impl ServedNode {
    /// The numbers of saved states grow, so none is given twice.
    fn keep_state(&mut self, state: NodeState) -> GuestCommandOutcome {
        let number = self.states.last_key_value().map_or(0, |(last, _)| last + 1);
        self.states.insert(number, state);
        GuestCommandOutcome::State(number)
    }

    fn drop_states(&mut self, states: &[u64]) {
        states.iter().for_each(|state| drop(self.states.remove(state)));
    }

    fn get_outputs(&mut self, numbers: &mut Vec<f64>) -> Result<GuestCommandOutcome, CallError> {
        numbers.clear();
        numbers.resize(self.numbers, 0.0);
        let mut others = NonNumericValues {
            integers: vec![0; self.integers],
            texts: vec![String::new(); self.texts],
            extrapolation: None,
        };
        self.node.get_outputs(numbers)?;
        if self.integers > 0 {
            self.node.get_integers(&mut others.integers)?;
        }
        self.node.get_texts(&mut others.texts)?;
        Ok(GuestCommandOutcome::Outputs(others))
    }

    fn run_command(&mut self, command: GuestCommand) -> Result<GuestCommandOutcome, CallError> {
        let ServedNode { node, states, .. } = self;
        let unknown = || CallError::new("the state", "is not one of this process");
        Ok(match command {
            GuestCommand::ExitInitialization => {
                node.exit_initialization().map(|()| GuestCommandOutcome::Done)?
            }
            GuestCommand::Terminate => node.terminate().map(|()| GuestCommandOutcome::Done)?,
            GuestCommand::Save => {
                let state = node.save_state()?;
                self.keep_state(state)
            }
            GuestCommand::Restore(state) => {
                node.restore_state(states.get(&state).ok_or_else(unknown)?)?;
                GuestCommandOutcome::Done
            }
            GuestCommand::Wait(seconds) => {
                // A time that no clock holds is longer than any limit.
                std::thread::sleep(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
                GuestCommandOutcome::Done
            }
            GuestCommand::Crash => std::process::abort(),
            GuestCommand::Tune(values, time) => {
                node.tune_parameters(&values, time).map(|()| GuestCommandOutcome::Done)?
            }
            GuestCommand::Serialise(state) => {
                GuestCommandOutcome::Bytes(node.serialise_state(states.get(&state).ok_or_else(unknown)?)?)
            }
            GuestCommand::DirectionalDerivatives(changes) => {
                let mut found = vec![0.0; self.numbers];
                let known = node.directional_derivatives(&changes, &mut found)?;
                GuestCommandOutcome::Derivatives(known.then_some(found))
            }
            GuestCommand::Deserialise(bytes) => {
                let state = node.deserialise_state(&bytes)?;
                self.keep_state(state)
            }
            _ => GuestCommandOutcome::Done,
        })
    }
}

/// Makes the node, in a sandbox if it is to be in one.
fn open_node(setup: IsolatedNodeSetup) -> Result<(ServedNode, GuestCommandOutcome), FmuRefusal> {
    let early = |error: OpenError| FmuRefusal::Early(CallError::new("opening", error.to_string()));
    let mechanisms = setup.sandbox.as_ref().map(isolation::enter_sandbox).unwrap_or_default();
    fmu_import::adopt_forked_process();
    let lacks = mechanisms.iter().filter_map(ProtectionMechanism::warning).collect();
    let fmu = Arc::new(Fmu::reopen(&setup.fmu).map_err(early)?);
    let VariableGroups { numbers, texts } = &setup.outputs;
    let exact = numbers.iter().filter(|group| group.is_int64());
    let counts = [
        numbers.iter().map(|group| group.places.len()).sum(),
        exact.map(|group| group.places.len()).sum(),
        texts.iter().map(|group| group.places.len()).sum(),
    ];
    let mut node = FmuNode::new(&fmu, &setup.name, setup.log, setup.inputs, setup.outputs)?;
    node.set_experiment_and_starts(setup.experiment, setup.starts)?;
    // The runtime of an FMU may have taken the signals.
    fmu_import::ignore_termination_signals();
    let outcome = GuestCommandOutcome::Opened {
        can_save: node.can_save(),
        takes_input_derivatives: node.can_set_input_derivatives(),
        lacks,
    };
    let [numbers, integers, texts] = counts;
    Ok((ServedNode { node, states: BTreeMap::new(), numbers, integers, texts }, outcome))
}
