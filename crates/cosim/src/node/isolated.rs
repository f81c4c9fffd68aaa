//! Steps an FMU in a process of its own, as a node: what it does wrong there, it does alone.

mod guest;
mod node;
mod protocol;

#[cfg(unix)]
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use archive::Folder;
use diagnostics::{Error, rounded, shown};
use fmu_import::{CallError, CrashNote, Fmu, Message, MessageLevel};
use isolation::{Guest, GuestEnd, NOTE, Packet};

pub use self::guest::serve;
use self::protocol::{Command, OtherValues, Outcome, Request, Response, SandboxPaths, Setup};
use super::refusal::Refusal;
use super::{InjectedFault, InstanceSettings, NodeState};
use crate::clock::Clock;
use crate::system::{Isolation, OnFailure, VariableGroups};

/// What processes for FMUs need of the program that starts them.
#[derive(Clone)]
pub struct Host {
    /// The program with its arguments, which has to call [`serve`] with the number that comes after them.
    pub program: (PathBuf, Vec<String>),
    /// A call of an FMU that lasts longer than this is reported.
    pub patience: Duration,
    /// Whether to wait no longer for any answer.
    pub give_up: Arc<dyn Fn() -> bool + Send + Sync>,
}

/// What may be behind a failure that the FMU does not have elsewhere.
const SANDBOXED: &str = "; it is isolated, in a sandbox: with `isolate = true`, `may_read` adds files that it may read, and `sandbox = false` lets it out";

/// An FMU in a process of its own, as a node.
pub(super) struct IsolatedNode {
    setup: Setup,
    isolation: Isolation,
    host: Host,
    guest: Guest,
    /// The folder that it works in; removed after the process has ended.
    scratch: Folder,
    /// Keeps its files there.
    _fmu: Arc<Fmu>,
    inputs: Values,
    /// Whether the FMU does not know them yet.
    has_new_inputs: bool,
    outputs: Values,
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
    talk: Packet,
    messages: Vec<Message>,
    lacks: Vec<String>,
}

/// The values of one side.
#[derive(Debug, Clone, Default)]
struct Values {
    numbers: Vec<f64>,
    others: OtherValues,
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
        isolation: &Isolation,
        host: &Host,
    ) -> Result<Self, Error> {
        let InstanceSettings { fmu, name, log, inputs, outputs, experiment, starts } = settings;
        let failed = |error: std::io::Error| {
            Error::component(name, "its process", None, format!("does not start: {error}"))
        };
        let scratch = Folder::new().map_err(failed)?;
        let place = fmu.location();
        let sandbox = isolation.sandbox.then(|| {
            let read = isolation.may_read.iter().cloned().chain([place.folder.clone()]);
            SandboxPaths { read: read.collect(), write: vec![scratch.path().to_owned()] }
        });
        let name = name.to_owned();
        let setup = Setup { name, fmu: place, log, inputs, outputs, experiment, starts, sandbox };
        let guest = start(&setup, &scratch, host).map_err(failed)?;
        let mut node = IsolatedNode {
            isolation: isolation.clone(),
            host: host.clone(),
            guest,
            scratch,
            _fmu: Arc::clone(fmu),
            inputs: Values::default(),
            has_new_inputs: false,
            outputs: Values::default(),
            has_outputs: false,
            frozen: false,
            injected: None,
            dropped: Arc::default(),
            can_save: false,
            takes_input_derivatives: false,
            talk: Packet::default(),
            messages: Vec::new(),
            lacks: Vec::new(),
            setup,
        };
        node.open().map_err(|refusal| node.refused(refusal))?;
        Ok(node)
    }

    fn refused(&self, refusal: Refusal) -> Error {
        let refusal = match refusal {
            // The place of its word did not travel.
            Refusal::Start(start, what) => {
                let known = self.setup.starts.iter().find(|known| known.name == start.name);
                Refusal::Start(known.map_or(start, |known| Box::new(known.clone())), what)
            }
            other => other,
        };
        refusal.into_error(&self.setup.name, self.setup.experiment.start)
    }

    fn open(&mut self) -> Result<(), Refusal> {
        let setup = Box::new(self.setup.clone());
        let opened = self.ask(Command::Open(setup)).map_err(|mut refusal| {
            if let Refusal::Early(error) | Refusal::Call(error) = &mut refusal
                && self.setup.sandbox.is_some()
            {
                error.what += SANDBOXED;
            }
            refusal
        })?;
        if let Outcome::Opened { can_save, takes_input_derivatives, lacks } = opened {
            self.can_save = can_save;
            self.takes_input_derivatives = takes_input_derivatives;
            self.lacks = lacks;
        }
        Ok(())
    }

    /// Asks the process, with the inputs that it does not know yet.
    fn ask(&mut self, command: Command) -> Result<Outcome, Refusal> {
        let inputs = std::mem::take(&mut self.has_new_inputs);
        self.has_outputs = false;
        let request = Request {
            dropped: std::mem::take(
                &mut self.dropped.lock().unwrap_or_else(PoisonError::into_inner),
            ),
            inputs: inputs.then(|| self.inputs.others.clone()),
            command,
        };
        // They are those of one step.
        self.inputs.others.extrapolation = None;
        let unfit = |error: postcard::Error| CallError::new("its process", error.to_string());
        let bytes = postcard::to_stdvec(&request).map_err(unfit)?;
        let numbers = if inputs { self.inputs.numbers.as_slice() } else { &[] };
        let IsolatedNode { guest, talk, host, isolation, .. } = self;
        let limit = isolation.call_limit.and_then(|limit| Duration::try_from_secs_f64(limit).ok());
        let begin = Instant::now();
        let late = || limit.is_some_and(|limit| begin.elapsed() > limit);
        let (name, mut next) = (&self.setup.name, host.patience);
        let give_up = |note: &dyn Fn() -> [u8; NOTE]| {
            if begin.elapsed() > next {
                report(name, &CrashNote::read(&note()), begin.elapsed());
                next *= 2;
            }
            late() || (host.give_up)()
        };
        guest.ask(numbers, &bytes, talk, give_up).map_err(|end| lost(guest, end, late()))?;
        let response = postcard::from_bytes::<Response>(&talk.bytes);
        let Response { outcome, messages } = response.map_err(unfit)?;
        self.messages.extend(messages);
        let outcome = outcome?;
        if let Outcome::Outputs(others) = outcome {
            std::mem::swap(&mut self.outputs.numbers, &mut self.talk.numbers);
            self.outputs.others = others;
            self.has_outputs = true;
            return Ok(Outcome::Done);
        }
        Ok(outcome)
    }

    fn call(&mut self, command: Command) -> Result<Outcome, CallError> {
        self.ask(command).map_err(|refusal| match refusal {
            Refusal::Early(error) | Refusal::Call(error) => error,
            Refusal::Start(start, what) => {
                CallError::new("its start value", format!("`{}`: {what}", start.name))
            }
        })
    }

    /// Goes on after a failure, if it may: with the outputs as they are, or from communication point `tick` on in a new process.
    ///
    /// # Errors
    /// With that failure when it may not, and with the next one when the new process fails, too.
    fn recover(&mut self, failure: CallError, clock: &Clock, tick: u64) -> Result<(), CallError> {
        if failure.terminated.is_some() || (self.host.give_up)() {
            return Err(failure);
        }
        let time = rounded(clock.at(tick));
        match self.isolation.on_failure {
            OnFailure::End => Err(failure),
            OnFailure::Hold => {
                self.log(format!(
                    "{failure} in the step from {time} s on; its outputs keep their values"
                ));
                self.frozen = true;
                Ok(())
            }
            OnFailure::Restart => {
                self.log(format!("{failure} in the step from {time} s on; it starts again there"));
                let again = self.restart(clock.at(tick)).and_then(|()| self.try_step(clock, tick));
                again.map_err(|mut error| {
                    error.what += ", after a restart in the same step";
                    error
                })
            }
        }
    }

    fn log(&mut self, what: String) {
        self.messages.push(Message::new(MessageLevel::Error, "", &what));
    }

    fn try_step(&mut self, clock: &Clock, tick: u64) -> Result<(), CallError> {
        match self.injected.take() {
            Some(InjectedFault::Wait(seconds)) => drop(self.call(Command::Wait(seconds))?),
            Some(InjectedFault::Crash) => {
                let crashed = self.call(Command::Crash).map(|_| ());
                return crashed.map_err(|error| {
                    CallError::new(
                        error.call,
                        format!("crashed, a fault of the scenario: {}", error.what),
                    )
                });
            }
            None => {}
        }
        self.call(Command::DoStep(*clock, tick)).map(|_| ())
    }

    /// Starts again at a time [s], with the start values and the inputs of this step.
    fn restart(&mut self, time: f64) -> Result<(), CallError> {
        let unstarted = |what: String| CallError::new("its process", what);
        self.setup.experiment.start = time;
        self.guest = start(&self.setup, &self.scratch, &self.host)
            .map_err(|error| unstarted(format!("does not start: {error}")))?;
        self.dropped = Arc::default();
        self.has_new_inputs = false;
        self.open().map_err(|refusal| unstarted(self.refused(refusal).to_string()))?;
        self.call(Command::EnterInitialization)?;
        self.has_new_inputs = true;
        self.call(Command::ExitInitialization)?;
        self.has_new_inputs = true;
        Ok(())
    }

    /// The number of a state in the process of now.
    fn number(&self, state: &NodeState) -> Result<u64, CallError> {
        let state = state.get::<RemoteState>()?;
        if !Arc::ptr_eq(&state.dropped, &self.dropped) {
            return Err(CallError::new("the state", "is that of another process"));
        }
        Ok(state.number)
    }

    fn remote_state(&self, outcome: &Outcome) -> Result<NodeState, CallError> {
        let Outcome::State(number) = *outcome else { return Err(unexpected()) };
        let dropped = Arc::clone(&self.dropped);
        Ok(NodeState::new(RemoteState { number, dropped }))
    }
}

impl Drop for IsolatedNode {
    fn drop(&mut self) {
        let request = Request { dropped: Vec::new(), inputs: None, command: Command::Exit };
        // The folder goes after the process.
        let left = postcard::to_stdvec(&request).is_ok_and(|bytes| self.guest.shut_down(&bytes));
        if !left {
            let name = &self.setup.name;
            let what = "did not end well after the run, whose results are complete";
            eprintln!("{}", shown(&format!("warning: `{name}` {what}")));
        }
    }
}

fn start(setup: &Setup, scratch: &Folder, host: &Host) -> std::io::Result<Guest> {
    let (program, arguments) = &host.program;
    let mut command = process::Command::new(program);
    command.args(arguments).current_dir(scratch.path()).env("TMPDIR", scratch.path());
    #[cfg(unix)]
    command.arg0("trackside");
    let count = |ports: &VariableGroups| {
        ports.numbers.iter().map(|group| group.places.len()).sum::<usize>()
    };
    Guest::start(command, count(&setup.inputs).max(count(&setup.outputs)))
}

/// Reports a call that goes on for long.
fn report(name: &str, CrashNote { call, time, .. }: &CrashNote, since: Duration) {
    let call = if call.is_empty() { "its process" } else { call };
    let at = time.map(|time| format!(" at t = {} s", rounded(time))).unwrap_or_default();
    let since = since.as_secs_f64();
    let text = format!("\nnode `{name}`: {call}{at} has been running for {since:.0} s");
    eprintln!("{}", shown(&text));
}

fn unexpected() -> CallError {
    CallError::new("its process", "gave an answer without meaning")
}

/// The error of a process that did not answer, with the call that it was in.
fn lost(guest: &Guest, end: GuestEnd, late: bool) -> CallError {
    let CrashNote { call, words, .. } = CrashNote::read(&guest.note());
    let what = match end {
        _ if !words.is_empty() => words,
        GuestEnd::Cancelled if late => {
            "did not return within `call_limit`; its process was ended".to_owned()
        }
        GuestEnd::Cancelled => {
            "did not return when the run had to end; its process was ended".to_owned()
        }
        end => format!("did not return: {end}"),
    };
    let call = if call.is_empty() { "its process".to_owned() } else { call };
    CallError::new(call, what)
}
