//! Restores the process state that a call of foreign code changed: rounding mode, locale, folder, umask, signals.

use std::ffi::{CStr, c_int, c_void};
use std::sync::{Mutex, PoisonError};

use super::floating_point::{floating_point_control, usual_control};
use super::process_end::is_guarded;

unsafe extern "C" {
    /// Defined in `process_state.c`, as the next three.
    fn trackside_before(before: *mut ProcessStateSnapshot);
    fn trackside_after(before: *const ProcessStateSnapshot) -> c_int;
    fn trackside_signals(mask: *mut SignalMask);
    fn trackside_after_rare(mask: *const SignalMask) -> c_int;
}

/// What any call may change, as it was before it in a program that is not guarded.
#[repr(C)]
pub(super) struct ProcessStateSnapshot {
    control: u64,
    locale: *mut c_void,
    x87: u32,
}

/// The signals that a thread holds back; room for the `sigset_t` of any system.
#[repr(C, align(8))]
struct SignalMask([u8; 128]);

/// What was changed: one bit for each row of [`WORDS`].
pub(super) type ProcessStateChanges = u32;

/// What was done, and what that would have changed.
const WORDS: [(&str, &str); 8] = [
    ("set how numbers are rounded", "the numbers of all other nodes"),
    ("had tiny numbers flushed to zero", "the numbers of all other nodes"),
    ("had calculations without a result end the program", "how all other nodes end"),
    ("set the locale", "how all other nodes read and write numbers"),
    ("set the current folder", "where all files lie"),
    ("set the permissions of new files", "all files of the run"),
    ("held signals back", "how the program can be ended"),
    ("took handlers of signals away", "what is told of crashes"),
];

impl ProcessStateSnapshot {
    /// What is so now; nothing in a guarded program, whose threads all have what it had in the beginning: reading that again would double
    /// the cost of a call.
    #[inline]
    pub(super) fn capture() -> Option<Self> {
        if is_guarded() {
            return None;
        }
        let mut before = ProcessStateSnapshot { control: 0, locale: std::ptr::null_mut(), x87: 0 };
        // SAFETY: the function writes the structure, which has the same layout there.
        unsafe { trackside_before(&raw mut before) };
        Some(before)
    }
}

fn snapshot_pointer(before: Option<&ProcessStateSnapshot>) -> *const ProcessStateSnapshot {
    before.map_or(std::ptr::null(), std::ptr::from_ref)
}

/// Puts back what is different now from before, which is said.
#[inline]
pub(super) fn restore_process_state(before: Option<&ProcessStateSnapshot>) -> ProcessStateChanges {
    // SAFETY: the function reads the structure, or what it noted itself.
    unsafe { trackside_after(snapshot_pointer(before)) }.cast_unsigned()
}

/// How the processor has to calculate after a call: as it did when the program was guarded, or else as it does now.
#[inline]
pub(super) fn expected_control() -> u64 {
    if is_guarded() { usual_control() } else { floating_point_control() }
}

/// Lets the processor calculate as it did before; what was different.
#[cold]
pub(super) fn restore_floating_point_control(control: u64) -> ProcessStateChanges {
    if is_guarded() {
        return restore_process_state(None);
    }
    let mut before = ProcessStateSnapshot::capture();
    if let Some(before) = &mut before {
        (before.control, before.x87) = (control & u64::from(u32::MAX), (control >> 32) as u32);
    }
    restore_process_state(before.as_ref())
}

/// All is looked at after so many first steps of an instance. Then it is only how the processor calculates, but for one step in
/// [`SELDOM`]: to ask for the locale costs as much as a short call.
const FIRST: u32 = 16;
const SELDOM: u32 = 64;

/// Counts the steps of an instance.
#[derive(Debug, Default)]
pub(super) struct StepCounter(u32);

impl StepCounter {
    /// What is so now, to be put back after the calls of a step.
    #[inline]
    pub(super) fn begin_step(&mut self) -> StepWatch {
        let is_thorough = self.is_next_thorough();
        self.count_step();
        match is_thorough {
            true => StepWatch::begin_thorough(),
            false => StepWatch { control: expected_control(), before: None, is_thorough },
        }
    }

    /// Whether all is looked at after the next step.
    #[inline]
    pub(super) fn is_next_thorough(&self) -> bool {
        self.0 < FIRST || self.0.is_multiple_of(SELDOM)
    }

    /// Counts a step.
    #[inline]
    pub(super) fn count_step(&mut self) {
        self.0 = self.0.wrapping_add(1);
    }
}

/// What was so before the calls of a step.
pub(super) struct StepWatch {
    control: u64,
    before: Option<ProcessStateSnapshot>,
    is_thorough: bool,
}

impl StepWatch {
    /// Puts back what another FMU may have left, and looks at all.
    #[inline(never)]
    fn begin_thorough() -> Self {
        let before = ProcessStateSnapshot::capture();
        restore_process_state(before.as_ref());
        StepWatch { control: 0, before, is_thorough: true }
    }

    /// Puts back what is different now, which is said.
    #[inline]
    pub(super) fn restore_changes(self) -> ProcessStateChanges {
        match !self.is_thorough && floating_point_control() == self.control {
            true => 0,
            false => self.restore_all_changes(),
        }
    }

    #[inline(never)]
    fn restore_all_changes(self) -> ProcessStateChanges {
        match self.is_thorough {
            true => restore_process_state(self.before.as_ref()),
            false => restore_floating_point_control(self.control),
        }
    }
}

/// Runs a rare call, and puts back what only such a call is looked at for; `alone` says that the process is somebody else's.
pub(super) fn run_and_restore_signals<T>(alone: bool, body: impl FnOnce() -> T) -> (T, ProcessStateChanges) {
    if alone {
        return (body(), 0);
    }
    let mut mask = SignalMask([0; 128]);
    // SAFETY: the function writes a set of signals, for which there is room.
    unsafe { trackside_signals(&raw mut mask) };
    let result = body();
    // SAFETY: the function reads what the other one wrote.
    (result, unsafe { trackside_after_rare(&raw const mask) }.cast_unsigned())
}

/// Puts the current folder and the permissions of new files back, which foreign code may have changed in any call, and keeps a sentence
/// for the report of the run. It is for moments before files are written: to look after each call would cost as much as a short one.
pub fn restore_folder_and_permissions() {
    let ((), changes) = run_and_restore_signals(false, || ());
    describe_changes(changes, c"code of an FMU or a plugin").for_each(report_process_change);
}

/// One sentence for each change, about the call that made it.
pub(super) fn describe_changes(changes: ProcessStateChanges, call: &CStr) -> impl Iterator<Item = String> {
    let call = call.to_string_lossy().into_owned();
    let rows = WORDS.iter().enumerate().filter(move |(bit, _)| changes >> bit & 1 == 1);
    rows.map(move |(_, (what, whose))| {
        format!("{call} {what}, which would have changed {whose}: it is put back")
    })
}

/// What foreign code of this process changed, until somebody takes it.
static ALL: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Keeps a sentence for the report of the run.
pub(super) fn report_process_change(sentence: String) {
    ALL.lock().unwrap_or_else(PoisonError::into_inner).push(sentence);
}

/// Takes what is to be told of foreign code that changed what belongs to the whole process, such as how numbers are rounded, which
/// was put back after the call. Each kind of change is told once for each node and plugin.
#[must_use]
pub fn take_process_change_reports() -> Vec<String> {
    std::mem::take(&mut ALL.lock().unwrap_or_else(PoisonError::into_inner))
}
