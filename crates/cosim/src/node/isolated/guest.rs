//! Runs one FMU for the host of this process, and answers until it is sent away.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use diagnostics::{Error, shown};
use fmu_import::{CallError, Fmu, Message, MessageLevel, OpenError};
use isolation::{Channel, Packet, Sandbox};
use scenario::plan::Ports;

use super::talk::{Answer, Done, Others, Question, Setup, Task};
use crate::node::refusal::Refusal;
use crate::node::{FmuNode, Node, NodeState};

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
        let question = postcard::from_bytes::<Question>(&talk.bytes);
        let question = question.map_err(|error| wrong(error.to_string()))?;
        if let Task::Leave = question.task {
            // The run is over, and nobody reads the note any more.
            fmu_import::share_call_notes(None);
            fmu_import::set_final_exit_code(Some(0));
            drop(served);
            let late = fmu_import::messages_while_freed();
            late.iter().for_each(|it| eprintln!("{}", shown(&format!("warning: {it}"))));
            return Ok(());
        }
        let end = matches!(question.task, Task::End);
        let done = answer(&mut served, question, &mut talk.numbers);
        let messages = served.as_mut().map(|served| served.node.messages());
        let mut messages = messages.unwrap_or_default();
        if end {
            let changed = fmu_import::process_state_changes().into_iter();
            messages.extend(changed.map(|what| Message::new(MessageLevel::Warning, "", &what)));
        }
        let answer = Answer { done, messages };
        tell(&channel, &talk, &answer, look)?;
    }
}

fn tell(
    channel: &Channel,
    talk: &Packet,
    answer: &Answer,
    look: impl FnMut() -> Result<(), Error>,
) -> Result<(), Error> {
    let bytes = postcard::to_stdvec(answer).map_err(|error| Error::input(error.to_string()))?;
    let shown = matches!(answer.done, Ok(Done::Shown(_)));
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
fn answer(
    served: &mut Option<Served>,
    question: Question,
    numbers: &mut Vec<f64>,
) -> Result<Done, Refusal> {
    if let Task::Open(setup) = question.task {
        let (opened, done) = open(*setup)?;
        *served = Some(opened);
        return Ok(done);
    }
    let Some(served) = served else {
        return Err(Refusal::Early(CallError::new("the node", "is not open yet")));
    };
    served.forget(&question.forget);
    if let Some(Others { integers, texts, courses }) = question.inputs {
        match courses {
            None => served.node.set(numbers)?,
            Some((courses, span)) if courses.iter().all(|(place, _)| *place < numbers.len()) => {
                served.node.set_courses(numbers, &courses, span)?;
            }
            Some(_) => return Err(CallError::new("the inputs", "are not as many").into()),
        }
        if !integers.is_empty() {
            served.node.set_integers(&integers)?;
        }
        served.node.set_texts(&texts)?;
    }
    match question.task {
        Task::Enter => served.node.initialise().map(Done::Entered),
        Task::Step(clock, tick) => {
            served.node.step(&clock, tick)?;
            Ok(served.show(numbers)?)
        }
        Task::Show => Ok(served.show(numbers)?),
        task => Ok(served.rest(task)?),
    }
}

impl Served {
    /// The numbers of saved states grow, so none is given twice.
    fn keep(&mut self, state: NodeState) -> Done {
        let number = self.states.last_key_value().map_or(0, |(last, _)| last + 1);
        self.states.insert(number, state);
        Done::State(number)
    }

    fn forget(&mut self, states: &[u64]) {
        states.iter().for_each(|state| drop(self.states.remove(state)));
    }

    fn show(&mut self, numbers: &mut Vec<f64>) -> Result<Done, CallError> {
        numbers.clear();
        numbers.resize(self.numbers, 0.0);
        let mut others = Others {
            integers: vec![0; self.integers],
            texts: vec![String::new(); self.texts],
            courses: None,
        };
        self.node.get(numbers)?;
        if self.integers > 0 {
            self.node.get_integers(&mut others.integers)?;
        }
        self.node.get_texts(&mut others.texts)?;
        Ok(Done::Shown(others))
    }

    fn rest(&mut self, task: Task) -> Result<Done, CallError> {
        let Served { node, states, .. } = self;
        let unknown = || CallError::new("the state", "is not one of this process");
        Ok(match task {
            Task::Ready => node.ready().map(|()| Done::Well)?,
            Task::End => node.end().map(|()| Done::Well)?,
            Task::Save => {
                let state = node.save()?;
                self.keep(state)
            }
            Task::Restore(state) => {
                node.restore(states.get(&state).ok_or_else(unknown)?)?;
                Done::Well
            }
            Task::Wait(seconds) => {
                // A time that no clock holds is longer than any limit.
                std::thread::sleep(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
                Done::Well
            }
            Task::Crash => std::process::abort(),
            Task::Tune(values, time) => node.tune(&values, time).map(|()| Done::Well)?,
            Task::Serialise(state) => {
                Done::Bytes(node.serialise(states.get(&state).ok_or_else(unknown)?)?)
            }
            Task::Derivatives(changes) => {
                let mut found = vec![0.0; self.numbers];
                let known = node.derivatives(&changes, &mut found)?;
                Done::Changes(known.then_some(found))
            }
            Task::Deserialise(bytes) => {
                let state = node.deserialise(&bytes)?;
                self.keep(state)
            }
            _ => Done::Well,
        })
    }
}

/// Makes the node, in a sandbox if it is to be in one.
fn open(setup: Setup) -> Result<(Served, Done), Refusal> {
    let early = |error: OpenError| Refusal::Early(CallError::new("opening", error.to_string()));
    let shut = |(read, write)| isolation::enter_sandbox(&Sandbox { read, write });
    let lacks = setup.sandbox.map(shut).unwrap_or_default();
    let fmu = Arc::new(Fmu::reopen(&setup.fmu).map_err(early)?);
    let Ports { numbers, texts } = &setup.outputs;
    let exact = numbers.iter().filter(|group| group.is_exact());
    let counts = [
        numbers.iter().map(|group| group.places.len()).sum(),
        exact.map(|group| group.places.len()).sum(),
        texts.iter().map(|group| group.places.len()).sum(),
    ];
    let ports = (setup.inputs, setup.outputs);
    let mut node = FmuNode::new(&fmu, &setup.name, setup.log, ports)?;
    node.prepare(setup.times, setup.tolerance, setup.starts)?;
    // The runtime of an FMU may have taken the signals.
    fmu_import::ignore_termination_signals();
    let (save, serialise, slopes) = (node.can_save(), node.can_serialise(), node.takes_slopes());
    let done = Done::Opened { save, serialise, slopes, lacks };
    let [numbers, integers, texts] = counts;
    Ok((Served { node, states: BTreeMap::new(), numbers, integers, texts }, done))
}
