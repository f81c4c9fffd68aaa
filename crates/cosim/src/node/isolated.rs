//! Steps an FMU in a process of its own, as a node: what it does wrong there, it does alone.

mod guest;
mod node;
mod protocol;

use std::io::Write as _;
#[cfg(unix)]
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use archive::TemporaryFolder;
use diagnostics::{Error, escape_for_terminal, print_to_stderr, rounded_time};
use fmu_import::{CallError, CrashNote, Fmu, FmuMessage, MessageLevel};
use isolation::{ChannelPacket, IsolatedGuest, NOTE, NoAnswerReason, OutputStream, Sandbox};

pub use self::guest::serve_host_process;
use self::protocol::{
    GuestCommand, GuestCommandOutcome, GuestRequest, GuestResponse, IsolatedNodeSetup, NonNumericValues,
};
use super::refusal::FmuRefusal;
use super::{InjectedFault, InstanceSettings, NodeState};
use crate::clock::CommunicationClock;
use crate::system::{FmuFailurePolicy, FmuIsolation, VariableGroups};

/// What processes for FMUs need of the program that starts them.
#[derive(Clone)]
pub struct FmuProcessOptions {
    /// The program with its arguments, which has to call [`serve_host_process`] with the number that comes after them.
    pub program: (PathBuf, Vec<String>),
    /// A call of an FMU that lasts longer than this is reported.
    pub patience: Duration,
    /// Whether to wait no longer for any answer.
    pub give_up: Arc<dyn Fn() -> bool + Send + Sync>,
}

/// What may be behind a failure that the FMU does not have elsewhere.
const SANDBOXED: &str = "; it is isolated, in a sandbox: with `isolate = true`, `may_read` adds files that it may read, `memory_limit` is the memory that it may have, and `sandbox = false` lets it out";

/// An FMU in a process of its own, as a node.
pub(super) struct IsolatedNode {
    setup: IsolatedNodeSetup,
    isolation: FmuIsolation,
    host: FmuProcessOptions,
    guest: IsolatedGuest,
    /// The folder that it works in; removed after the process has ended.
    scratch: TemporaryFolder,
    /// Keeps its files there.
    _fmu: Arc<Fmu>,
    inputs: NodeValues,
    /// Whether the FMU does not know them yet.
    has_new_inputs: bool,
    outputs: NodeValues,
    /// Whether they are those of now.
    has_outputs: bool,
    /// Whether the FMU failed, and its outputs stay as they are.
    frozen: bool,
    /// What it does in its next step.
    injected: Option<InjectedFault>,
    /// States that nobody needs any more.
    dropped: Arc<Mutex<Vec<u64>>>,
    can_save: bool,
    takes_input_derivatives: bool,
    talk: ChannelPacket,
    /// When it was asked last.
    request_begin: Instant,
    /// The step that was begun: whether its request was sent.
    begun_step: Option<Result<(), CallError>>,
    /// How long it was busy with what it was asked last.
    response_duration: Duration,
    messages: Vec<FmuMessage>,
    lacks: Vec<String>,
}

/// The values of one side.
#[derive(Debug, Clone, Default)]
struct NodeValues {
    numbers: Vec<f64>,
    others: NonNumericValues,
}

/// A state of a process, by its number.
struct RemoteState {
    number: u64,
    /// That of its process: a new one has another list.
    dropped: Arc<Mutex<Vec<u64>>>,
}

impl Drop for RemoteState {
    fn drop(&mut self) {
        self.dropped.lock().unwrap_or_else(PoisonError::into_inner).push(self.number);
    }
}

impl IsolatedNode {
    /// Starts the process and makes the instance there.
    ///
    /// # Errors
    /// When it does not start; when the library does not load, or the FMU makes no instance or refuses the experiment.
    pub fn new(
        settings: InstanceSettings,
        isolation: &FmuIsolation,
        host: &FmuProcessOptions,
    ) -> Result<Self, Error> {
        let InstanceSettings { fmu, name, log, inputs, outputs, experiment, starts } = settings;
        let failed = |error: std::io::Error| {
            Error::node_failure(name, "its process", None, format!("does not start: {error}"))
        };
        let scratch = TemporaryFolder::new().map_err(failed)?;
        let place = fmu.location();
        let sandbox = isolation.sandbox.then(|| {
            let read = isolation.may_read.iter().cloned().chain([place.folder.clone()]);
            let write = vec![scratch.folder_path().to_owned()];
            Sandbox { read: read.collect(), write, limits: isolation.limits }
        });
        let name = name.to_owned();
        let setup = IsolatedNodeSetup { name, fmu: place, log, inputs, outputs, experiment, starts, sandbox };
        let guest = start_fmu_process(&setup, &scratch, host).map_err(failed)?;
        let mut node = IsolatedNode {
            isolation: isolation.clone(),
            host: host.clone(),
            guest,
            scratch,
            _fmu: Arc::clone(fmu),
            inputs: NodeValues::default(),
            has_new_inputs: false,
            outputs: NodeValues::default(),
            has_outputs: false,
            frozen: false,
            injected: None,
            dropped: Arc::default(),
            can_save: false,
            takes_input_derivatives: false,
            talk: ChannelPacket::default(),
            request_begin: Instant::now(),
            begun_step: None,
            response_duration: Duration::ZERO,
            messages: Vec::new(),
            lacks: Vec::new(),
            setup,
        };
        node.open_in_process().map_err(|refusal| node.refusal_error(refusal))?;
        Ok(node)
    }

    fn refusal_error(&self, refusal: FmuRefusal) -> Error {
        let refusal = match refusal {
            // The place of its word did not travel.
            FmuRefusal::Start(start, what) => {
                let known = self.setup.starts.iter().find(|known| known.name == start.name);
                FmuRefusal::Start(known.map_or(start, |known| Box::new(known.clone())), what)
            }
            other => other,
        };
        refusal.into_error(&self.setup.name, self.setup.experiment.start)
    }

    fn open_in_process(&mut self) -> Result<(), FmuRefusal> {
        let setup = Box::new(self.setup.clone());
        let opened = self.send_command(GuestCommand::Open(setup)).map_err(|mut refusal| {
            if let FmuRefusal::Early(error) | FmuRefusal::Call(error) = &mut refusal
                && self.setup.sandbox.is_some()
            {
                error.what += SANDBOXED;
            }
            refusal
        })?;
        if let GuestCommandOutcome::Opened { can_save, takes_input_derivatives, lacks } = opened {
            self.can_save = can_save;
            self.takes_input_derivatives = takes_input_derivatives;
            self.lacks = lacks;
        }
        Ok(())
    }

    /// Asks the process, with the inputs that it does not know yet, and waits for its response.
    fn send_command(&mut self, command: GuestCommand) -> Result<GuestCommandOutcome, FmuRefusal> {
        self.send_request(command)?;
        self.receive_response()
    }

    /// Asks the process, with the inputs that it does not know yet.
    fn send_request(&mut self, command: GuestCommand) -> Result<(), CallError> {
        let inputs = std::mem::take(&mut self.has_new_inputs);
        self.has_outputs = false;
        let request = GuestRequest {
            dropped: std::mem::take(&mut self.dropped.lock().unwrap_or_else(PoisonError::into_inner)),
            inputs: inputs.then(|| self.inputs.others.clone()),
            command,
        };
        // They are those of one step.
        self.inputs.others.extrapolation = None;
        let bytes = postcard::to_stdvec(&request).map_err(unfit_message_error)?;
        self.request_begin = Instant::now();
        self.exchange_watched(|guest, values, _, should_cancel| {
            let numbers = if inputs { values } else { &[] };
            guest.send_request(numbers, &bytes, should_cancel)
        })
    }

    /// Waits for the response to the last request.
    fn receive_response(&mut self) -> Result<GuestCommandOutcome, FmuRefusal> {
        self.exchange_watched(|guest, _, talk, should_cancel| guest.receive_answer(talk, should_cancel))?;
        let response = postcard::from_bytes::<GuestResponse>(&self.talk.bytes);
        let GuestResponse { outcome, messages, duration } = response.map_err(unfit_message_error)?;
        self.messages.extend(messages);
        self.response_duration = duration;
        let outcome = outcome?;
        if let GuestCommandOutcome::Outputs(others) = outcome {
            std::mem::swap(&mut self.outputs.numbers, &mut self.talk.numbers);
            self.outputs.others = others;
            self.has_outputs = true;
            return Ok(GuestCommandOutcome::Done);
        }
        Ok(outcome)
    }

    /// Exchanges a message with the process, which may take as long as its isolation allows, and is reported where that is long.
    fn exchange_watched(
        &mut self,
        exchange: impl FnOnce(
            &mut IsolatedGuest,
            &[f64],
            &mut ChannelPacket,
            &mut dyn FnMut(&dyn Fn() -> [u8; NOTE]) -> bool,
        ) -> Result<(), NoAnswerReason>,
    ) -> Result<(), CallError> {
        let IsolatedNode { setup, guest, inputs, talk, host, isolation, request_begin: begin, .. } = self;
        let limit = isolation.call_limit.and_then(|limit| Duration::try_from_secs_f64(limit).ok());
        let late = || limit.is_some_and(|limit| begin.elapsed() > limit);
        let mut next = host.patience;
        let mut should_cancel = |note: &dyn Fn() -> [u8; NOTE]| {
            if begin.elapsed() > next {
                report_long_call(&setup.name, &CrashNote::from_note_bytes(&note()), begin.elapsed());
                next *= 2;
            }
            late() || (host.give_up)()
        };
        exchange(guest, &inputs.numbers, talk, &mut should_cancel)
            .map_err(|end| lost_process_error(guest, end, late()))
    }

    fn call_guest(&mut self, command: GuestCommand) -> Result<GuestCommandOutcome, CallError> {
        self.send_command(command).map_err(call_error)
    }

    /// Goes on after a failure, if it may: with the outputs as they are, or from communication point `tick` on in a new process.
    ///
    /// # Errors
    /// With that failure when it may not, and with the next one when the new process fails, too.
    fn recover_from_failure(
        &mut self,
        failure: CallError,
        clock: &CommunicationClock,
        tick: u64,
    ) -> Result<(), CallError> {
        if failure.terminated.is_some() || (self.host.give_up)() {
            return Err(failure);
        }
        let time = rounded_time(clock.time_at(tick));
        match self.isolation.on_failure {
            FmuFailurePolicy::End => Err(failure),
            FmuFailurePolicy::Hold => {
                self.log_message(format!(
                    "{failure} in the step from {time} s on; its outputs keep their values"
                ));
                self.frozen = true;
                Ok(())
            }
            FmuFailurePolicy::Restart => {
                self.log_message(format!("{failure} in the step from {time} s on; it starts again there"));
                let again =
                    self.restart_process(clock.time_at(tick)).and_then(|()| self.try_step(clock, tick));
                again.map_err(|mut error| {
                    error.what += ", after a restart in the same step";
                    error
                })
            }
        }
    }

    fn log_message(&mut self, what: String) {
        self.messages.push(FmuMessage::new(MessageLevel::Error, "", &what));
    }

    fn try_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.request_step(clock, tick)?;
        self.receive_response().map(drop).map_err(call_error)
    }

    /// Asks the process to step, after what it has to do by a fault.
    fn request_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        match self.injected.take() {
            Some(InjectedFault::Wait(seconds)) => drop(self.call_guest(GuestCommand::Wait(seconds))?),
            Some(InjectedFault::Crash) => {
                self.call_guest(GuestCommand::Crash).map_err(|error| {
                    CallError::new(error.call, format!("crashed, a fault of the scenario: {}", error.what))
                })?;
            }
            None => {}
        }
        self.send_request(GuestCommand::DoStep(*clock, tick))
    }

    /// Starts again at a time [s], with the start values and the inputs of this step.
    fn restart_process(&mut self, time: f64) -> Result<(), CallError> {
        let unstarted = |what: String| CallError::new("its process", what);
        self.setup.experiment.start = time;
        self.guest = start_fmu_process(&self.setup, &self.scratch, &self.host)
            .map_err(|error| unstarted(format!("does not start: {error}")))?;
        self.dropped = Arc::default();
        self.has_new_inputs = false;
        self.open_in_process().map_err(|refusal| unstarted(self.refusal_error(refusal).to_string()))?;
        self.call_guest(GuestCommand::EnterInitialization)?;
        self.has_new_inputs = true;
        self.call_guest(GuestCommand::ExitInitialization)?;
        self.has_new_inputs = true;
        Ok(())
    }

    /// The number of a state in the process of now.
    fn remote_state_number(&self, state: &NodeState) -> Result<u64, CallError> {
        let state = state.downcast_ref::<RemoteState>()?;
        if !Arc::ptr_eq(&state.dropped, &self.dropped) {
            return Err(CallError::new("the state", "is that of another process"));
        }
        Ok(state.number)
    }

    fn remote_state(&self, outcome: &GuestCommandOutcome) -> Result<NodeState, CallError> {
        let GuestCommandOutcome::State(number) = *outcome else {
            return Err(invalid_response_error());
        };
        let dropped = Arc::clone(&self.dropped);
        Ok(NodeState::new(RemoteState { number, dropped }))
    }
}

impl Drop for IsolatedNode {
    fn drop(&mut self) {
        let request = GuestRequest { dropped: Vec::new(), inputs: None, command: GuestCommand::Exit };
        // The folder goes after the process. One that is still busy with a step takes no request.
        let left = self.begun_step.is_none()
            && postcard::to_stdvec(&request).is_ok_and(|bytes| self.guest.shut_down(&bytes));
        if !left {
            let name = &self.setup.name;
            let what = "did not end well after the run, whose results are complete";
            print_to_stderr(&format!("warning: `{name}` {what}"));
        }
    }
}

fn start_fmu_process(
    setup: &IsolatedNodeSetup,
    scratch: &TemporaryFolder,
    host: &FmuProcessOptions,
) -> std::io::Result<IsolatedGuest> {
    let (program, arguments) = &host.program;
    let mut command = process::Command::new(program);
    command.args(arguments).current_dir(scratch.folder_path()).env("TMPDIR", scratch.folder_path());
    #[cfg(unix)]
    command.arg0("trackside");
    let count = |ports: &VariableGroups| ports.numbers.iter().map(|group| group.places.len()).sum::<usize>();
    IsolatedGuest::start(command, count(&setup.inputs).max(count(&setup.outputs)), Some(write_line))
}

/// Writes what an FMU wrote, without what steers a terminal.
fn write_line(stream: OutputStream, line: &[u8]) {
    let line = String::from_utf8_lossy(line);
    let line = escape_for_terminal(&line);
    // Where nobody reads, nothing is missed.
    let _ = match stream {
        OutputStream::Standard => std::io::stdout().write_all(line.as_bytes()),
        OutputStream::Error => std::io::stderr().write_all(line.as_bytes()),
    };
}

/// Reports a call that goes on for long.
fn report_long_call(name: &str, CrashNote { call, time, .. }: &CrashNote, since: Duration) {
    let call = if call.is_empty() { "its process" } else { call };
    let at = time.map(|time| format!(" at t = {} s", rounded_time(time))).unwrap_or_default();
    let since = since.as_secs_f64();
    let text = format!("\nnode `{name}`: {call}{at} has been running for {since:.0} s");
    print_to_stderr(&text);
}

/// The refusal of a call, as its error.
fn call_error(refusal: FmuRefusal) -> CallError {
    match refusal {
        FmuRefusal::Early(error) | FmuRefusal::Call(error) => error,
        FmuRefusal::Start(start, what) => {
            CallError::new("its start value", format!("`{}`: {what}", start.name))
        }
    }
}

fn unfit_message_error(error: postcard::Error) -> CallError {
    CallError::new("its process", error.to_string())
}

fn invalid_response_error() -> CallError {
    CallError::new("its process", "gave an answer without meaning")
}

/// The error of a process that did not answer, with the call that it was in.
fn lost_process_error(guest: &IsolatedGuest, end: NoAnswerReason, late: bool) -> CallError {
    let CrashNote { call, words, .. } = CrashNote::from_note_bytes(&guest.last_note());
    let what = match end {
        _ if !words.is_empty() => words,
        NoAnswerReason::Cancelled if late => {
            "did not return within `call_limit`; its process was ended".to_owned()
        }
        NoAnswerReason::Cancelled => {
            "did not return when the run had to end; its process was ended".to_owned()
        }
        end => format!("did not return: {end}"),
    };
    let call = if call.is_empty() { "its process".to_owned() } else { call };
    CallError::new(call, what)
}
