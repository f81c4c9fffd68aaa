//! Starts the process under Wine that has an FMU's library for Windows, exchanges calls with it, and says how it ended.

use std::ffi::{CString, c_char, c_void};
use std::io::{self, Read as _, Seek as _, Write as _};
use std::os::unix::process::{CommandExt as _, ExitStatusExt as _};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::ptr;
use std::sync::atomic::Ordering::{Acquire, Relaxed, Release, SeqCst};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, RwLock};
use std::time::{Duration, Instant};

use super::memory::{LOG, SharedMemory};
use crate::binding::mailbox;
use crate::wine::{WindowsBits, WineSetup};

/// So often does this side look before it lets others have the processor.
const SPINS: usize = 100;
/// Who waits longer than this sleeps: a call of that length is not made longer by it.
const AWAKE: Duration = Duration::from_millis(2);
/// A sleeper looks this often whether there is still somebody to wait for.
const LOOK: Duration = Duration::from_millis(10);
const SHORTEST_NAP: Duration = Duration::from_micros(50);
/// The first start after an update of Wine takes some seconds.
const START: Duration = Duration::from_secs(60);
/// A process that ends within this time before it answers is started once more.
const QUICK_END: Duration = Duration::from_secs(10);
/// A library that is unloaded gets this time.
const FAREWELL: Duration = Duration::from_secs(5);

/// The row that unloads the library and ends the program.
const QUIT: usize = 0x10001;

/// How much memory the two share: it takes no room until it is written, but addresses, of which 32 bits have few.
const fn memory_size(bits: WindowsBits) -> usize {
    match bits {
        WindowsBits::Bits64 => 1 << 30,
        WindowsBits::Bits32 => 1 << 27,
    }
}

type CancelCondition = Arc<dyn Fn() -> bool + Send + Sync>;

static CANCEL: RwLock<Option<CancelCondition>> = RwLock::new(None);

/// Gives up calls of FMUs under Wine from the moment on when this says true: their process is ended, and the call fails. It is asked every
/// 10 ms while one of them goes on.
pub fn cancel_wine_calls_when(condition: Arc<dyn Fn() -> bool + Send + Sync>) {
    *CANCEL.write().unwrap_or_else(PoisonError::into_inner) = Some(condition);
}

fn is_cancelled() -> bool {
    CANCEL.read().unwrap_or_else(PoisonError::into_inner).as_ref().is_some_and(|condition| condition())
}

/// What only the thread that makes a call uses.
#[derive(Debug)]
pub(super) struct ProcessConnection {
    child: Child,
    /// A byte wakes the other side; its end ends the other side.
    doorbell: ChildStdin,
}

/// A process under Wine.
#[derive(Debug)]
pub(super) struct WindowsProcess {
    pub memory: SharedMemory,
    /// Bytes of a pointer there.
    pub pointer_width: usize,
    connection: Mutex<ProcessConnection>,
    /// How it ended, in a sentence without a subject.
    end: OnceLock<String>,
    /// Texts that functions without an instance gave.
    texts: Mutex<Vec<CString>>,
}

impl WindowsProcess {
    /// Starts the process; no library is loaded yet.
    ///
    /// # Errors
    /// In a sentence, when it does not start.
    pub fn start(setup: &WineSetup) -> Result<Self, String> {
        let begin = Instant::now();
        // Where many start at once, Wine now and then ends before it runs the program.
        Self::try_start(setup).or_else(|why| match begin.elapsed() < QUICK_END {
            true => Self::try_start(setup),
            false => Err(why),
        })
    }

    fn try_start(setup: &WineSetup) -> Result<Self, String> {
        let failed = |error: io::Error| format!("Wine does not start: {error}");
        let memory = SharedMemory::new(memory_size(setup.bits)).map_err(failed)?;
        let errors = rustix::fs::memfd_create("trackside-wine", rustix::fs::MemfdFlags::CLOEXEC)
            .map_err(|error| failed(error.into()))?;
        let mut errors = std::fs::File::from(errors);
        let mut command: Command = setup.command();
        command.arg(&setup.host).arg(memory.windows_path()).stdin(Stdio::piped()).stdout(Stdio::null());
        // A signal from the terminal is for this program, which ends the run.
        command.stderr(errors.try_clone().map_err(failed)?).process_group(0);
        memory.header().turn.0.store(1, SeqCst);
        let mut child = command.spawn().map_err(failed)?;
        let Some(doorbell) = child.stdin.take() else {
            return Err("Wine does not start: it has no standard input".to_owned());
        };
        let process = WindowsProcess {
            memory,
            pointer_width: setup.bits.pointer_width(),
            connection: Mutex::new(ProcessConnection { child, doorbell }),
            end: OnceLock::new(),
            texts: Mutex::default(),
        };
        let started = process.await_answer(&mut process.lock_connection(), Some(START));
        if started {
            return Ok(process);
        }
        let mut said = String::new();
        let _ = errors.rewind().and_then(|()| errors.read_to_string(&mut said));
        let said =
            said.lines().rfind(|line| !line.trim().is_empty()).map(|line| format!(": {}", line.trim()));
        let end = process.end.get().map(String::as_str).unwrap_or_default();
        Err(format!("Wine {end}{}", said.unwrap_or_default()))
    }

    /// How the process ended, once it has.
    pub fn end(&self) -> Option<&str> {
        self.end.get().map(String::as_str)
    }

    pub fn lock_connection(&self) -> MutexGuard<'_, ProcessConnection> {
        self.connection.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives the turn to the other side and waits until it comes back; false when the process is gone.
    pub fn exchange(&self, connection: &mut ProcessConnection) -> bool {
        self.exchange_within(connection, None)
    }

    fn exchange_within(&self, connection: &mut ProcessConnection, limit: Option<Duration>) -> bool {
        if self.end.get().is_some() {
            return false;
        }
        let header = self.memory.header();
        header.turn.0.fetch_add(1, SeqCst);
        if header.asleep.0.load(SeqCst) != 0 {
            // A process that is gone is noticed while it is waited for.
            let _ = connection.doorbell.write(&[0]);
        }
        self.await_answer(connection, limit)
    }

    fn await_answer(&self, connection: &mut ProcessConnection, limit: Option<Duration>) -> bool {
        let turn = &self.memory.header().turn.0;
        let mine = || turn.load(Acquire).is_multiple_of(2);
        let begin = Instant::now();
        let mut looked = begin;
        loop {
            for _ in 0..SPINS {
                if mine() {
                    self.deliver_messages();
                    return true;
                }
                std::hint::spin_loop();
            }
            let elapsed = begin.elapsed();
            if elapsed < AWAKE {
                // On a busy machine the other side may wait for this processor.
                rustix::thread::sched_yield();
                continue;
            }
            self.deliver_messages();
            if looked.elapsed() > LOOK {
                looked = Instant::now();
                if let Ok(Some(status)) = connection.child.try_wait() {
                    self.deliver_messages();
                    let _ = self.end.set(self.describe_end(status));
                    return false;
                }
                let late = limit.is_some_and(|limit| elapsed > limit);
                if late || limit.is_none() && is_cancelled() {
                    let what = match limit {
                        Some(limit) => format!("did not answer within {} s and was ended", limit.as_secs()),
                        None => "did not return when the run had to end; its process under Wine was ended"
                            .to_owned(),
                    };
                    self.kill(connection, what);
                    return false;
                }
            }
            std::thread::sleep((elapsed / 100).clamp(SHORTEST_NAP, LOOK));
        }
    }

    fn kill(&self, connection: &mut ProcessConnection, what: String) {
        let _ = connection.child.kill();
        let _ = connection.child.wait();
        let _ = self.end.set(what);
    }

    fn describe_end(&self, status: ExitStatus) -> String {
        let note = &self.memory.header().exception.0;
        let exception = note.code.load(Acquire);
        let described = describe_exception(exception);
        if exception != 0 && note.unhandled.load(Acquire) != 0 {
            let address = note.address.load(Acquire);
            return format!("ended its process under Wine: {described} at address 0x{address:X}");
        }
        let after = if exception != 0 { format!(", after {described}") } else { String::new() };
        match (status.signal(), status.code()) {
            (Some(signal), _) => {
                format!("did not return: its process under Wine was ended by signal {signal}{after}")
            }
            (_, code) => {
                let code = code.unwrap_or_default();
                format!("did not return: its process under Wine ended with exit code {code}{after}")
            }
        }
    }

    /// Takes what the library logged to the mailboxes.
    fn deliver_messages(&self) {
        let header = self.memory.header();
        let written = header.log_written.0.load(Acquire);
        let mut read = header.log_read.0.load(Relaxed);
        while read != written {
            let Some(length) = self.deliver_message(read, written.wrapping_sub(read)) else {
                // What makes no sense is left out.
                read = written;
                break;
            };
            read = read.wrapping_add(length);
        }
        header.log_read.0.store(read, Release);
    }

    /// One message from a position on, with so many bytes behind it: its length.
    fn deliver_message(&self, position: u64, left: u64) -> Option<u64> {
        const HEAD: usize = 32;
        let mut head = [0; HEAD];
        self.memory.read_log(position, &mut head);
        let word = |place: usize| head[place..].first_chunk().map(|bytes| u32::from_ne_bytes(*bytes));
        let length = u64::from(word(0)?);
        let (category, text) = (word(16)? as usize, word(20)? as usize);
        let fits = length >= (HEAD + category + text) as u64 && length <= left.min(LOG as u64);
        let environment = u64::from_ne_bytes(*head[8..].first_chunk()?);
        let mut bytes = vec![0; fits.then_some(category + text)?];
        self.memory.read_log(position + HEAD as u64, &mut bytes);
        let (category, text) = bytes.split_at(category);
        let environment: *mut c_void = ptr::without_provenance_mut(usize::try_from(environment).ok()?);
        mailbox::take_log_bytes(environment, word(4)?.cast_signed(), category, text, word(24)? as usize);
        Some(length)
    }

    /// Keeps a text as long as the library.
    pub fn keep_text(&self, text: CString) -> *const c_char {
        let mut texts = self.texts.lock().unwrap_or_else(PoisonError::into_inner);
        texts.push(text);
        texts.last().map_or(ptr::null(), |text| text.as_ptr())
    }
}

impl Drop for WindowsProcess {
    fn drop(&mut self) {
        let mut connection = self.connection.lock().unwrap_or_else(PoisonError::into_inner);
        if self.end.get().is_some() {
            return;
        }
        // SAFETY: it is this side's turn, and nobody else has the process.
        unsafe { (*self.memory.header().call.get()).row = QUIT as u32 };
        self.exchange_within(&mut connection, Some(FAREWELL));
        self.kill(&mut connection, "has been ended".to_owned());
    }
}

/// An exception of Windows in words.
fn describe_exception(code: u32) -> String {
    let words = match code {
        0x8000_0003 => "a breakpoint",
        0xC000_0005 => "an access violation",
        0xC000_0006 => "a page that cannot be read",
        0xC000_001D => "an illegal instruction",
        0xC000_0025 => "an exception that cannot be continued",
        0xC000_008C => "an index out of bounds",
        0xC000_008E => "a floating-point division by zero",
        0xC000_0090 => "an invalid floating-point operation",
        0xC000_0091 => "a floating-point overflow",
        0xC000_0094 => "an integer division by zero",
        0xC000_0095 => "an integer overflow",
        0xC000_0096 => "a privileged instruction",
        0xC000_00FD => "a stack overflow",
        0xC000_0374 => "a damaged heap",
        0xC000_0409 => "a damaged stack",
        0xC06D_007E => "a DLL that is loaded late and missing",
        0xC06D_007F => "a function that is loaded late and missing",
        0xE06D_7363 => "an exception of C++ that nobody catches",
        _ => "an exception",
    };
    format!("{words} (0x{code:08X})")
}
