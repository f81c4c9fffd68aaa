//! Starts, watches and ends a guest process; and makes this process the guest of another.

use std::fs::File;
use std::io::{self, BufRead as _, BufReader, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::AtomicU8;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, getpid, getppid, set_parent_process_death_signal};

use crate::channel::{ChannelPacket, ProcessChannel};
use crate::memory::{NOTE, SharedMemory};

/// A guest that is asked to end gets this time.
const FAREWELL: Duration = Duration::from_secs(5);
const NAP: Duration = Duration::from_millis(1);

/// Why a guest does not answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoAnswerReason {
    /// Its process ended.
    #[error("its process ended with {0}")]
    Ended(ExitStatus),
    /// The host did not want to wait any longer, and ended it.
    #[error("its process was ended")]
    Cancelled,
    /// It wrote what no guest writes, and was ended.
    #[error("its process gave an answer without meaning, and was ended")]
    InvalidAnswer,
}

/// Where a guest writes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputStream {
    /// Standard output.
    Standard,
    /// Standard error.
    Error,
}

/// Gets a line that a guest wrote, or a part of a long one.
pub type OutputHandler = fn(OutputStream, &[u8]);

/// Longest part of a line that is passed on at once [bytes].
const LONGEST_LINE: u64 = 8 << 10;
/// What a guest that ended wrote is there within this time, unless it left a process behind.
const LAST_WORDS: Duration = Duration::from_millis(200);

/// A process that answers.
#[derive(Debug)]
pub struct IsolatedGuest {
    child: Child,
    channel: ProcessChannel,
    /// Hung up when all that the guest wrote was passed on.
    output: Receiver<()>,
    end: Option<NoAnswerReason>,
}

impl IsolatedGuest {
    /// Starts a guest with the memory as its standard input. What it writes goes to `pass_on`, so that it has nothing of the terminal of this
    /// process; without one it goes where the command says. It calls [`connect_to_host_process`] first, with the number of this process, which is its last argument. `numbers` may travel at
    /// once. The thread that calls this has to outlive the guest.
    ///
    /// # Errors
    /// When the program does not start, or the system cannot share memory.
    pub fn start(mut command: Command, numbers: usize, pass_on: Option<OutputHandler>) -> io::Result<Self> {
        if cfg!(not(target_os = "linux")) {
            return Err(io::Error::new(io::ErrorKind::Unsupported, "isolation needs Linux"));
        }
        let (memory, file) = SharedMemory::new(numbers)?;
        command.arg(getpid().to_string()).stdin(Stdio::from(file));
        if pass_on.is_some() {
            command.stdout(Stdio::piped()).stderr(Stdio::piped());
        }
        let mut child = command.spawn()?;
        let (open, output) = mpsc::channel();
        if let Some(pass_on) = pass_on {
            if let Some(pipe) = child.stdout.take() {
                pass_on_lines(pipe, OutputStream::Standard, pass_on, open.clone());
            }
            if let Some(pipe) = child.stderr.take() {
                pass_on_lines(pipe, OutputStream::Error, pass_on, open);
            }
        }
        Ok(IsolatedGuest { child, channel: ProcessChannel::new(memory, 0), output, end: None })
    }

    /// Asks, and waits for the answer: [`send_request`](Self::send_request) and [`receive_answer`](Self::receive_answer).
    ///
    /// # Errors
    /// When the guest has ended, or is ended.
    pub fn request_answer(
        &mut self,
        numbers: &[f64],
        bytes: &[u8],
        answer: &mut ChannelPacket,
        mut should_cancel: impl FnMut(&dyn Fn() -> [u8; NOTE]) -> bool,
    ) -> Result<(), NoAnswerReason> {
        self.send_request(numbers, bytes, &mut should_cancel)?;
        self.receive_answer(answer, should_cancel)
    }

    /// Asks. `should_cancel` is asked every 10 ms while the guest takes a long question, with the note of the guest; when it says true,
    /// the guest is ended.
    ///
    /// # Errors
    /// When the guest has ended, or is ended.
    pub fn send_request(
        &mut self,
        numbers: &[f64],
        bytes: &[u8],
        should_cancel: impl FnMut(&dyn Fn() -> [u8; NOTE]) -> bool,
    ) -> Result<(), NoAnswerReason> {
        self.exchange_watched(should_cancel, |channel, look| channel.send(numbers, bytes, look))
    }

    /// Waits for the answer to what was asked last. `should_cancel` is as in [`send_request`](Self::send_request).
    ///
    /// # Errors
    /// When the guest has ended, or is ended.
    pub fn receive_answer(
        &mut self,
        answer: &mut ChannelPacket,
        should_cancel: impl FnMut(&dyn Fn() -> [u8; NOTE]) -> bool,
    ) -> Result<(), NoAnswerReason> {
        self.exchange_watched(should_cancel, |channel, look| match channel.receive(answer, look)? {
            true => Ok(()),
            false => Err(NoAnswerReason::InvalidAnswer),
        })
    }

    /// Uses the channel while the guest is watched.
    fn exchange_watched(
        &mut self,
        mut should_cancel: impl FnMut(&dyn Fn() -> [u8; NOTE]) -> bool,
        exchange: impl FnOnce(
            &ProcessChannel,
            &mut dyn FnMut() -> Result<(), NoAnswerReason>,
        ) -> Result<(), NoAnswerReason>,
    ) -> Result<(), NoAnswerReason> {
        if let Some(end) = self.end {
            return Err(end);
        }
        let IsolatedGuest { child, channel, .. } = self;
        let mut look = || match child.try_wait() {
            Ok(Some(status)) => Err(NoAnswerReason::Ended(status)),
            _ if should_cancel(&|| read_guest_note(channel)) => Err(NoAnswerReason::Cancelled),
            _ => Ok(()),
        };
        exchange(channel, &mut look).inspect_err(|end| self.end_process(*end))
    }

    fn end_process(&mut self, end: NoAnswerReason) {
        self.end = Some(end);
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = self.output.recv_timeout(LAST_WORDS);
    }

    /// What the guest was doing when it wrote that last: bytes of its note.
    #[must_use]
    pub fn last_note(&self) -> [u8; NOTE] {
        read_guest_note(&self.channel)
    }

    /// Sends a last question, and waits some seconds until the guest has ended by itself. True when it did, with success.
    pub fn shut_down(&mut self, question: &[u8]) -> bool {
        if self.end.is_some() {
            return true;
        }
        let begin = Instant::now();
        let child = &mut self.child;
        let mut look = || match child.try_wait() {
            Ok(None) if begin.elapsed() < FAREWELL => Ok(()),
            _ => Err(()),
        };
        let asked = self.channel.send(&[], question, &mut look).is_ok();
        while asked && look().is_ok() {
            std::thread::sleep(NAP);
        }
        let ended = self.child.try_wait();
        self.end_process(NoAnswerReason::Cancelled);
        ended.is_ok_and(|status| status.is_some_and(|status| status.success()))
    }
}

/// Passes on what comes out of a pipe, in a thread that ends with it.
fn pass_on_lines(
    pipe: impl Read + Send + 'static,
    stream: OutputStream,
    pass_on: OutputHandler,
    open: Sender<()>,
) {
    std::thread::spawn(move || {
        let mut pipe = BufReader::new(pipe);
        let mut line = Vec::new();
        while (&mut pipe).take(LONGEST_LINE).read_until(b'\n', &mut line).is_ok_and(|length| length > 0) {
            pass_on(stream, &line);
            line.clear();
        }
        drop(open);
    });
}

/// The note at the other end of a channel.
fn read_guest_note(channel: &ProcessChannel) -> [u8; NOTE] {
    let mut note = [0; NOTE];
    let cells = channel.shared_memory().note_bytes();
    note.iter_mut().zip(cells).for_each(|(byte, cell)| *byte = cell.load(Relaxed));
    note
}

impl Drop for IsolatedGuest {
    fn drop(&mut self) {
        if self.end.is_none() {
            self.end_process(NoAnswerReason::Cancelled);
        }
    }
}

/// Makes this process the guest of `host`, the number of a process: it gets its end of the channel, ends when the host does, and has an
/// empty standard input.
///
/// # Errors
/// When standard input is no memory of a host.
pub fn connect_to_host_process(host: u32) -> io::Result<(ProcessChannel, &'static [AtomicU8; NOTE])> {
    // A host that is gone already cannot send its signal any more.
    set_parent_process_death_signal(Some(Signal::KILL))?;
    if !is_host_alive(host) {
        return Err(io::Error::other("its host has ended"));
    }
    let memory = SharedMemory::map_existing(rustix::stdio::stdin())?;
    // The note is written until the process ends, by handlers of signals, too.
    let note: &'static SharedMemory =
        Box::leak(Box::new(SharedMemory::map_existing(rustix::stdio::stdin())?));
    rustix::stdio::dup2_stdin(&File::open("/dev/null")?)?;
    Ok((ProcessChannel::new(memory, 1), note.note_bytes()))
}

/// Whether the process that started this one is still there. In namespaces of its own a process ends with its host, and does not see it.
#[must_use]
pub fn is_host_alive(host: u32) -> bool {
    if crate::sandbox::is_in_own_namespaces() {
        return true;
    }
    let parent = getppid().map(Pid::as_raw_nonzero);
    parent.is_some_and(|parent| i64::from(parent.get()) == i64::from(host))
}
