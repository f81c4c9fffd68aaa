//! Runs one FMU for the host of this process, and answers until it is sent away.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use diagnostics::{Error, shown};
use fmu_import::{CallError, Fmu, Message, MessageLevel, OpenError};
use isolation::{Channel, Packet, Sandbox};

use super::protocol::{
    Command, OtherValues, Outcome, Request, Response, SandboxPaths, Setup, StepPolynomials,
};
use crate::node::refusal::Refusal;
use crate::node::{
    DirectionalDerivatives, ExtrapolatedInputs, FmuNode, Node, NodeState, Stateful,
    TunableParameters, TypedValues,
};
use crate::system::VariableGroups;

/// Serves `host`, the number of the process that started this one, until it asks this one to leave.
///
/// # Errors
/// When this process has no such host, or that has ended.
pub fn serve(host: u32) -> Result<(), Error> {
    let wrong = |what: String| Error::input(format!("isolated is for FMUs of a run: {what}"));
    let (channel, note) =
        isolation::become_guest(host).map_err(|error| wrong(error.to_string()))?;
    fmu_import::ignore_termination_signals();
    fmu_import::share_call_notes(Some(note));
    let look = || match isolation::has_host(host) {
        true => Ok(()),
        false => Err(wrong("that has ended".to_owned())),
    };
    let (mut talk, mut served) = (Packet::default(), None);
    loop {
        channel.receive(&mut talk, look)?;
        let request = postcard::from_bytes::<Request>(&talk.bytes);
        let request = request.map_err(|error| wrong(error.to_string()))?;
        if let Command::Exit = request.command {
            // The run is over, and nobody reads the note any more.
            fmu_import::share_call_notes(None);
            fmu_import::set_final_exit_code(Some(0));
            drop(served);
            let late = fmu_import::messages_while_freed();
            late.iter().for_each(|it| eprintln!("{}", shown(&format!("warning: {it}"))));
            return Ok(());
        }
        let end = matches!(request.command, Command::Terminate);
        let outcome = respond(&mut served, request, &mut talk.numbers);
        let messages = served.as_mut().map(|served| served.node.messages());
        let mut messages = messages.unwrap_or_default();
        if end {
            let changed = fmu_import::process_state_changes().into_iter();
            messages.extend(changed.map(|what| Message::new(MessageLevel::Warning, "", &what)));
        }
        let response = Response { outcome, messages };
        send(&channel, &talk, &response, look)?;
    }
}

fn send(
    channel: &Channel,
    talk: &Packet,
    response: &Response,
    look: impl FnMut() -> Result<(), Error>,
) -> Result<(), Error> {
    let bytes = postcard::to_stdvec(response).map_err(|error| Error::input(error.to_string()))?;
    let shown = matches!(response.outcome, Ok(Outcome::Outputs(_)));
    let numbers = if shown { talk.numbers.as_slice() } else { &[] };
    channel.send(numbers, &bytes, look)
}

/// A node, its saved states by number, and how much it shows.
struct Served {
    node: FmuNode,
    states: BTreeMap<u64, NodeState>,
    numbers: usize,
    integers: usize,
    texts: usize,
}

/// Does what is asked. `numbers` are those of the inputs at first, and those of the outputs when they are shown.
fn respond(
    served: &mut Option<Served>,
    request: Request,
    numbers: &mut Vec<f64>,
) -> Result<Outcome, Refusal> {
    if let Command::Open(setup) = request.command {
        let (opened, done) = open(*setup)?;
        *served = Some(opened);
        return Ok(done);
    }
    let Some(served) = served else {
        return Err(Refusal::Early(CallError::new("the node", "is not open yet")));
    };
    served.drop_states(&request.dropped);
    if let Some(OtherValues { integers, texts, extrapolation }) = request.inputs {
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
        Command::EnterInitialization => {
            served.node.begin_initialization().map(Outcome::Initialized)
        }
        Command::DoStep(clock, tick) => {
            served.node.do_step(&clock, tick)?;
            Ok(served.get_outputs(numbers)?)
        }
        Command::GetOutputs => Ok(served.get_outputs(numbers)?),
        command => Ok(served.run(command)?),
    }
}

impl Served {
    /// The numbers of saved states grow, so none is given twice.
    fn keep(&mut self, state: NodeState) -> Outcome {
        let number = self.states.last_key_value().map_or(0, |(last, _)| last + 1);
        self.states.insert(number, state);
        Outcome::State(number)
    }

    fn drop_states(&mut self, states: &[u64]) {
        states.iter().for_each(|state| drop(self.states.remove(state)));
    }

    fn get_outputs(&mut self, numbers: &mut Vec<f64>) -> Result<Outcome, CallError> {
        numbers.clear();
        numbers.resize(self.numbers, 0.0);
        let mut others = OtherValues {
            integers: vec![0; self.integers],
            texts: vec![String::new(); self.texts],
            extrapolation: None,
        };
        self.node.get_outputs(numbers)?;
        if self.integers > 0 {
            self.node.get_integers(&mut others.integers)?;
        }
        self.node.get_texts(&mut others.texts)?;
        Ok(Outcome::Outputs(others))
    }

    fn run(&mut self, command: Command) -> Result<Outcome, CallError> {
        let Served { node, states, .. } = self;
        let unknown = || CallError::new("the state", "is not one of this process");
        Ok(match command {
            Command::ExitInitialization => node.exit_initialization().map(|()| Outcome::Done)?,
            Command::Terminate => node.terminate().map(|()| Outcome::Done)?,
            Command::Save => {
                let state = node.save()?;
                self.keep(state)
            }
            Command::Restore(state) => {
                node.restore(states.get(&state).ok_or_else(unknown)?)?;
                Outcome::Done
            }
            Command::Wait(seconds) => {
                // A time that no clock holds is longer than any limit.
                std::thread::sleep(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
                Outcome::Done
            }
            Command::Crash => std::process::abort(),
            Command::Tune(values, time) => node.tune(&values, time).map(|()| Outcome::Done)?,
            Command::Serialise(state) => {
                Outcome::Bytes(node.serialise(states.get(&state).ok_or_else(unknown)?)?)
            }
            Command::DirectionalDerivatives(changes) => {
                let mut found = vec![0.0; self.numbers];
                let known = node.directional_derivatives(&changes, &mut found)?;
                Outcome::Derivatives(known.then_some(found))
            }
            Command::Deserialise(bytes) => {
                let state = node.deserialise(&bytes)?;
                self.keep(state)
            }
            _ => Outcome::Done,
        })
    }
}

/// Makes the node, in a sandbox if it is to be in one.
fn open(setup: Setup) -> Result<(Served, Outcome), Refusal> {
    let early = |error: OpenError| Refusal::Early(CallError::new("opening", error.to_string()));
    let shut = |SandboxPaths { read, write }| isolation::enter_sandbox(&Sandbox { read, write });
    let lacks = setup.sandbox.map(shut).unwrap_or_default();
    let fmu = Arc::new(Fmu::reopen(&setup.fmu).map_err(early)?);
    let VariableGroups { numbers, texts } = &setup.outputs;
    let exact = numbers.iter().filter(|group| group.is_exact());
    let counts = [
        numbers.iter().map(|group| group.places.len()).sum(),
        exact.map(|group| group.places.len()).sum(),
        texts.iter().map(|group| group.places.len()).sum(),
    ];
    let mut node = FmuNode::new(&fmu, &setup.name, setup.log, setup.inputs, setup.outputs)?;
    node.prepare(setup.experiment, setup.starts)?;
    // The runtime of an FMU may have taken the signals.
    fmu_import::ignore_termination_signals();
    let outcome = Outcome::Opened {
        can_save: node.can_save(),
        takes_input_derivatives: node.takes_input_derivatives(),
        lacks,
    };
    let [numbers, integers, texts] = counts;
    Ok((Served { node, states: BTreeMap::new(), numbers, integers, texts }, outcome))
}
