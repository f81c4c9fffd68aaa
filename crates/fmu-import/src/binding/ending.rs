//! Ends the program: on request, without the destructors of foreign code, and never by foreign code unnoticed.

use std::ffi::c_int;
use std::io::Write as _;

unsafe extern "C" {
    /// Defined in `crash.c`, as the next three.
    fn trackside_guard_exit();
    fn trackside_complete(code: c_int);
    fn trackside_completed() -> c_int;
    fn trackside_leave(code: c_int) -> !;
    /// Defined in `interruption.c`, as the next one.
    fn trackside_note_requests();
    fn trackside_requested_end() -> c_int;
}

/// Takes each end of the process for foreign code's, from here on, but that by [`leave`]: who crashed or called `exit` is told, and the
/// exit code is 3. An end by `_exit` is seen if the program exports `trackside_foreign_exit` as `_exit`. Remembers locale, current
/// folder and umask, to be put back after calls. Call it before there is any foreign code.
pub fn guard_exit() {
    // SAFETY: the function installs handlers that live as long as the program.
    unsafe { trackside_guard_exit() };
}

/// Says that all results are written: if foreign code crashes or exits from here on, that is told, and `code` is the exit code.
/// Without a code there are results to come.
pub fn complete(code: Option<u8>) {
    // SAFETY: the function writes a number that is read and written as a whole.
    unsafe { trackside_complete(code.map_or(-1, c_int::from)) };
}

/// The code of [`complete`].
#[must_use]
pub fn completed() -> Option<u8> {
    // SAFETY: the function reads a number that is written as a whole.
    u8::try_from(unsafe { trackside_completed() }).ok()
}

/// Ends the process with this exit code. Neither destructors of libraries nor threads of FMUs get in between.
pub fn leave(code: u8) -> ! {
    let _ = std::io::stdout().flush();
    // SAFETY: the function ends the process.
    unsafe { trackside_leave(code.into()) }
}

/// Notes SIGINT, SIGTERM and SIGHUP from here on, instead of an end; a second one ends the process at once. A runtime inside an
/// FMU may install handlers of its own; another call of this function takes the signals back.
pub fn note_requests_to_end() {
    // SAFETY: the function installs handlers that write a number.
    unsafe { trackside_note_requests() };
}

/// The number of the signal that asked the program to end, if one did.
#[must_use]
pub fn requested_end() -> Option<u8> {
    // SAFETY: the function reads a number that is written as a whole.
    let signal = unsafe { trackside_requested_end() };
    u8::try_from(signal).ok().filter(|signal| *signal != 0)
}
