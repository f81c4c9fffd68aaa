//! Controls how the process exits: termination signals, an exit without destructors of foreign code, and exits by foreign code.

use std::ffi::{c_char, c_int};
use std::io::Write as _;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering::Relaxed};

use super::floating_point::note_usual_control;

unsafe extern "C" {
    /// Defined in `crash.c`, as the next five.
    fn trackside_guard_exit();
    fn trackside_adopt_process();
    fn trackside_complete(code: c_int);
    fn trackside_completed() -> c_int;
    fn trackside_leave(code: c_int) -> !;
    fn trackside_write_to(memory: *mut c_char);
    /// Defined in `interruption.c`, as the next two.
    fn trackside_catch_termination_signals();
    fn trackside_ignore_termination_signals();
    fn trackside_termination_signal() -> c_int;
}

/// Takes each end of the process for foreign code's, from here on, but that by [`exit_without_destructors`]: who crashed or called `exit` is told, and the
/// exit code is 3. An end by `_exit` is seen if the program exports `trackside_foreign_exit` as `_exit`. Remembers locale, current
/// folder and umask, to be put back after calls. Call it before there is any foreign code.
pub fn guard_exit() {
    // SAFETY: the function installs handlers that live as long as the program.
    unsafe { trackside_guard_exit() };
    note_usual_control();
    GUARDED.store(true, Relaxed);
}

/// Tells the handlers of crashes and exits that this process goes on for the one that set them up, which forked it.
pub fn adopt_forked_process() {
    // SAFETY: the function sets two numbers, before foreign code runs.
    unsafe { trackside_adopt_process() };
}

static GUARDED: AtomicBool = AtomicBool::new(false);

/// Whether the program is guarded, see [`guard_exit`].
#[inline]
pub(super) fn is_guarded() -> bool {
    GUARDED.load(Relaxed)
}

/// Says that all results are written: if foreign code crashes or exits from here on, that is told, and `code` is the exit code.
/// Without a code there are results to come.
pub fn set_final_exit_code(code: Option<u8>) {
    // SAFETY: the function writes a number that is read and written as a whole.
    unsafe { trackside_complete(code.map_or(-1, c_int::from)) };
}

/// The code of [`set_final_exit_code`].
#[must_use]
pub fn final_exit_code() -> Option<u8> {
    // SAFETY: the function reads a number that is written as a whole.
    u8::try_from(unsafe { trackside_completed() }).ok()
}

/// Ends the process with this exit code. Neither destructors of libraries nor threads of FMUs get in between.
pub fn exit_without_destructors(code: u8) -> ! {
    let _ = std::io::stdout().flush();
    // SAFETY: the function ends the process.
    unsafe { trackside_leave(code.into()) }
}

/// Notes SIGINT, SIGTERM and SIGHUP from here on, instead of an end; a second one ends the process at once. A runtime inside an
/// FMU may install handlers of its own; another call of this function takes the signals back.
pub fn catch_termination_signals() {
    // SAFETY: the function installs handlers that write a number.
    unsafe { trackside_catch_termination_signals() };
}

/// The number of the signal that asked the program to end, if one did.
#[must_use]
pub fn termination_signal() -> Option<u8> {
    // SAFETY: the function reads a number that is written as a whole.
    let signal = unsafe { trackside_termination_signal() };
    u8::try_from(signal).ok().filter(|signal| *signal != 0)
}

/// Ignores SIGINT, SIGTERM and SIGHUP from here on: another process ends this one.
pub fn ignore_termination_signals() {
    // SAFETY: the function installs handlers that do nothing.
    unsafe { trackside_ignore_termination_signals() };
}

/// Bytes of a note, see [`share_call_notes`].
const NOTE: usize = 512;
/// Where the name of the call begins, and the last words.
const CALL: usize = 8;
const WORDS: usize = 64;

/// What a process was doing when it ended.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CrashNote {
    /// The call that went on; empty between calls.
    pub call: String,
    /// The time at which it went on [s], once there is one.
    pub time: Option<f64>,
    /// What the process said when it ended; empty when it could say nothing.
    pub words: String,
}

impl CrashNote {
    /// Reads what [`share_call_notes`] wrote.
    #[must_use]
    pub fn from_note_bytes(bytes: &[u8; NOTE]) -> Self {
        let text = |bytes: &[u8]| {
            let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
            let text = String::from_utf8_lossy(&bytes[..end]);
            text.trim().replace(|letter: char| letter.is_control(), " ")
        };
        let time = bytes.first_chunk().map(|bytes| f64::from_ne_bytes(*bytes));
        CrashNote {
            call: text(&bytes[CALL..WORDS]),
            time: time.filter(|time| time.is_finite()),
            words: text(&bytes[WORDS..]),
        }
    }
}

static WRITTEN: AtomicBool = AtomicBool::new(false);

/// Whether another process reads the notes, see [`share_call_notes`].
#[inline]
pub(super) fn call_notes_are_shared() -> bool {
    WRITTEN.load(Relaxed)
}

/// Notes the call that goes on in this memory from here on, and the last words when the process ends, which then do not go to standard
/// error: another process reads them. With nothing, they go there again.
pub fn share_call_notes(memory: Option<&'static [AtomicU8; NOTE]>) {
    WRITTEN.store(memory.is_some(), Relaxed);
    let address = memory.map_or(std::ptr::null_mut(), |memory| memory.as_ptr().cast_mut().cast());
    // SAFETY: the memory lives as long as the process, and its bytes may change at any time.
    unsafe { trackside_write_to(address) };
}
