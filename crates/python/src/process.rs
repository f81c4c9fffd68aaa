//! Starts a Python process, sends requests, and collects what it prints.

use std::ffi::{OsStr, OsString};
use std::io::{ErrorKind, PipeReader, Read as _};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::net::{SendFlags, send};
use rustix::process::{Pid, Signal, kill_process};

use crate::error::{PythonException, ScriptError};
use crate::interpreter::PythonInterpreter;
use crate::printed_lines::PrintedLines;

/// Length and number of a question or an answer [bytes].
const HEAD: usize = 5;
/// The largest answer: an interpreter that sends anything else has lost its way [bytes].
const LARGEST: usize = 1 << 30;
/// How long a script may take to end when nobody asks any more; `fmu.py` waits as long.
const GRACE: Duration = Duration::from_secs(2);
/// How long Python may take to say where it is.
const LOOK: Duration = Duration::from_millis(500);

/// The number of an answer that is what was asked for.
const DONE: u8 = 0;
/// Of one that is an exception.
const RAISED: u8 = 1;
/// Of one that is the planned end of a simulation.
const TERMINATED: u8 = 2;

/// A Python process with a script in it. It ends when this is dropped, and when this program ends.
#[derive(Debug)]
pub struct PythonProcess {
    child: Child,
    /// Both ways; nothing once it is closed.
    line: Option<UnixStream>,
    printed: PipeReader,
    said: PrintedLines,
    /// What came of the answer so far.
    answer: Vec<u8>,
}

impl PythonProcess {
    /// Starts `interpreter` with these arguments, of which the first is one of the files of `python/trackside`, behind the words of an `entrance`,
    /// such as that of a sandbox.
    ///
    /// # Errors
    /// When there is no such interpreter.
    pub fn start(
        interpreter: &PythonInterpreter,
        entrance: &[OsString],
        arguments: impl IntoIterator<Item = impl AsRef<OsStr>>,
    ) -> Result<Self, ScriptError> {
        let PythonInterpreter { path, reason } = interpreter;
        let failed = |error: std::io::Error| {
            ScriptError::Ended(format!(
                "expected Python, and {} ({reason}) does not start: {error}; install Python 3.8 or newer, or name one by the environment variable TRACKSIDE_PYTHON",
                path.display()
            ))
        };
        let (line, other) = UnixStream::pair().map_err(failed)?;
        let (printed, output) = std::io::pipe().map_err(failed)?;
        rustix::io::ioctl_fionbio(&printed, true).map_err(|error| failed(error.into()))?;
        let mut words = entrance.iter().map(OsString::as_os_str).chain([path.as_os_str()]);
        let mut command = Command::new(words.next().unwrap_or(path.as_os_str()));
        command.args(words);
        // No files beside the script: its folder may be that of somebody else, or vanish while it runs.
        command.arg("-B").args(arguments).env("PYTHONIOENCODING", "utf-8:backslashreplace");
        command.stdin(Stdio::from(OwnedFd::from(other)));
        command.stdout(output.try_clone().map_err(failed)?).stderr(output);
        let child = command.spawn().map_err(failed)?;
        let said = PrintedLines::default();
        Ok(PythonProcess { child, line: Some(line), printed, said, answer: Vec::new() })
    }

    /// What it printed since the last time, by lines.
    pub fn take_lines(&mut self) -> Vec<String> {
        self.collect_printed_output();
        self.said.take_lines()
    }

    /// Asks, and waits for the answer as long as `patience` lasts. A process that does not answer is ended.
    ///
    /// # Errors
    /// When the script raises an exception or ends the simulation; when its process ends or must be ended.
    pub fn request_answer(
        &mut self,
        number: u8,
        contents: &[&[u8]],
        patience: Duration,
    ) -> Result<&[u8], ScriptError> {
        self.send_request(number, contents)?;
        self.wait_for_answer(patience)
    }

    /// Waits for an answer, as [`request_answer`](Self::request_answer) does.
    ///
    /// # Errors
    /// As there.
    pub fn wait_for_answer(&mut self, patience: Duration) -> Result<&[u8], ScriptError> {
        match self.receive_answer(patience)? {
            Some(DONE) => Ok(self.answer_contents()),
            Some(number) => {
                let what = format!("answered with the number {number}, which means nothing");
                Err(self.kill_process(&what))
            }
            None => Err(self.abort_with_location(&format!("no answer within {} s", patience.as_secs_f64()))),
        }
    }

    /// Asks, and does not wait.
    ///
    /// # Errors
    /// When the process has ended.
    pub fn send_request(&mut self, number: u8, contents: &[&[u8]]) -> Result<(), ScriptError> {
        let length = contents.iter().map(|part| part.len()).sum::<usize>();
        let Ok(length) = u32::try_from(length) else {
            return Err(self.kill_process("expected less than 4 GiB to hand over, found more"));
        };
        self.answer.clear();
        let mut message = Vec::with_capacity(HEAD + length as usize);
        message.extend(length.to_le_bytes());
        message.push(number);
        contents.iter().for_each(|part| message.extend(*part));
        let mut rest = message.as_slice();
        while let Some(line) = self.line.as_ref().filter(|_| !rest.is_empty()) {
            // Not as usual files are written: the signal of a closed pipe would end the program around us.
            match send(line, rest, SendFlags::NOSIGNAL) {
                Ok(sent) => rest = &rest[sent..],
                Err(rustix::io::Errno::INTR) => {}
                // Why is told by how the process ended.
                Err(_) => return Err(self.process_ended_error()),
            }
        }
        if rest.is_empty() { Ok(()) } else { Err(self.process_ended_error()) }
    }

    /// The number of the next answer, whose contents are in [`answer_contents`](Self::answer_contents); nothing if there is none within `patience`.
    ///
    /// # Errors
    /// When it is an exception or the end of the simulation; when the process ends.
    pub fn receive_answer(&mut self, patience: Duration) -> Result<Option<u8>, ScriptError> {
        let until = Instant::now() + patience;
        while !self.is_complete()? {
            let Some(left) = until.checked_duration_since(Instant::now()) else { return Ok(None) };
            self.wait_for_data(left);
            self.read_answer_bytes()?;
        }
        self.collect_printed_output();
        let number = self.answer[4];
        match number {
            RAISED => Err(ScriptError::Exception(self.decode_exception())),
            TERMINATED => Err(ScriptError::Terminated(self.decode_exception().message)),
            _ => Ok(Some(number)),
        }
    }

    /// The contents of the last answer.
    #[must_use]
    pub fn answer_contents(&self) -> &[u8] {
        self.answer.get(HEAD..self.answer_length()).unwrap_or_default()
    }

    /// Goes on to the answer that follows without a question.
    pub fn discard_answer(&mut self) {
        let rest = self.answer.split_off(self.answer_length().min(self.answer.len()));
        self.answer = rest;
    }

    /// Where the answer ends that has begun.
    fn answer_length(&self) -> usize {
        let length = self.answer.first_chunk().map_or(0, |length| u32::from_le_bytes(*length));
        HEAD + length as usize
    }

    /// The exception in the answer.
    fn decode_exception(&self) -> PythonException {
        serde_json::from_slice(self.answer_contents()).unwrap_or_else(|_| PythonException {
            message: String::from_utf8_lossy(self.answer_contents()).into_owned(),
            file: None,
            line: None,
            function: None,
        })
    }

    /// Whether the answer is there.
    fn is_complete(&mut self) -> Result<bool, ScriptError> {
        let length = self.answer_length();
        if length > LARGEST {
            return Err(self.kill_process(&format!("announced an answer of {length} bytes")));
        }
        Ok(self.answer.len() >= length)
    }

    /// Waits until there is something to read.
    fn wait_for_data(&mut self, left: Duration) {
        let Some(line) = &self.line else { return };
        let mut files = [PollFd::new(line, PollFlags::IN), PollFd::new(&self.printed, PollFlags::IN)];
        // Once nobody can print any more, that alone would be told again and again.
        let count = if self.said.is_finished() { 1 } else { 2 };
        let left = Timespec::try_from(left).ok();
        // Interrupted by a signal it returns early.
        let _ = poll(&mut files[..count], left.as_ref());
        let prints = count == 2 && !files[1].revents().is_empty();
        if prints {
            self.collect_printed_output();
        }
    }

    /// Reads what came of the answer.
    fn read_answer_bytes(&mut self) -> Result<(), ScriptError> {
        let Some(line) = &mut self.line else { return Err(self.process_ended_error()) };
        let mut part = [0; 1 << 16];
        // What is there is read, and no more: another poll comes before the next part.
        match rustix::net::recv(&*line, part.as_mut_slice(), rustix::net::RecvFlags::DONTWAIT) {
            Ok((0, _)) => Err(self.process_ended_error()),
            Ok((count, _)) => {
                self.answer.extend(&part[..count]);
                Ok(())
            }
            Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) => Ok(()),
            Err(_) => Err(self.process_ended_error()),
        }
    }

    /// Takes what was printed so far.
    fn collect_printed_output(&mut self) {
        let mut part = [0; 1 << 14];
        while !self.said.is_finished() {
            match self.printed.read(&mut part) {
                Ok(0) => self.said.mark_finished(),
                Ok(count) => self.said.add_bytes(&part[..count]),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                Err(_) => self.said.mark_finished(),
            }
        }
    }

    /// The failure of a process that has ended by itself.
    fn process_ended_error(&mut self) -> ScriptError {
        self.line = None;
        let status = self.wait_for(GRACE);
        self.collect_printed_output();
        let how = match status {
            Some(status) => format!("the process of Python ended ({status})"),
            None => "Python answers no more".to_owned(),
        };
        let last = self.said.last_line();
        ScriptError::Ended(if last.is_empty() { how } else { format!("{how}: {last}") })
    }

    /// Ends the process, which does not do what it should; it says where it is before.
    #[must_use]
    pub fn abort_with_location(&mut self, what: &str) -> ScriptError {
        self.collect_printed_output();
        let before = self.said.line_count();
        let _ = kill_process(Pid::from_child(&self.child), Signal::USR1);
        let until = Instant::now() + LOOK;
        while self.said.traceback_location_after(before).is_none() && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(5));
            self.collect_printed_output();
        }
        // Python writes line by line, and the one that matters may not be the first.
        std::thread::sleep(Duration::from_millis(20));
        self.collect_printed_output();
        let place = self.said.traceback_location_after(before);
        self.kill_process(&place.map_or_else(|| what.to_owned(), |place| format!("{what}, at {place}")))
    }

    /// Ends the process at once.
    fn kill_process(&mut self, what: &str) -> ScriptError {
        self.line = None;
        // It may have ended meanwhile.
        let _ = self.child.kill();
        let _ = self.child.wait();
        self.collect_printed_output();
        ScriptError::Ended(format!("{what}; the process of Python was ended"))
    }

    /// Waits until the process ends, and ends it when it takes longer than that.
    fn wait_for(&mut self, patience: Duration) -> Option<ExitStatus> {
        let until = Instant::now() + patience;
        let mut pause = Duration::from_micros(200);
        while Instant::now() < until {
            if let Ok(Some(status)) = self.child.try_wait() {
                return Some(status);
            }
            // What it prints at its end must not hold it up.
            self.collect_printed_output();
            std::thread::sleep(pause);
            pause = (pause * 2).min(Duration::from_millis(10));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
        None
    }
}

impl Drop for PythonProcess {
    fn drop(&mut self) {
        self.line = None;
        self.wait_for(GRACE);
    }
}
