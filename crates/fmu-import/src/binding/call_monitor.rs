//! Records the call of foreign code that is running, for the hang watchdog and the crash handler.

use std::cell::Cell;
use std::ffi::{CStr, CString, c_char};
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU32, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, Once, PoisonError, Weak};
use std::time::{Duration, Instant};

use super::process_end::call_notes_are_shared;
use super::process_state::{self, ProcessStateChanges, ProcessStateSnapshot};

unsafe extern "C" {
    /// Defined in `crash.c`, as the next one.
    fn trackside_copy_note(note: *const CallNote);
    fn trackside_watch_crashes();
    /// Defined in `libraries.c`.
    fn trackside_note_libraries(who: *const c_char, kind: *const c_char);
}

/// What the handler of `crash.c` reads when the program dies.
#[repr(C)]
#[derive(Debug)]
struct CallNote {
    /// From `CString::into_raw`.
    who: *mut c_char,
    /// What is called: an FMU or a plugin.
    kind: *const c_char,
    /// The name of the call that is going on, null between calls.
    call: AtomicPtr<c_char>,
    /// The bits of the time at which it goes on [s], NaN as long as there is none.
    time: AtomicU64,
}

/// What an instance, a library or a plugin is doing.
#[derive(Debug)]
pub(super) struct CallMonitor {
    note: CallNote,
    calls: AtomicU64,
    /// Whether a call that lasts long is worth a word.
    watched: bool,
    /// What it changed around itself and has been told.
    told: AtomicU32,
}

// SAFETY: the activity owns the name, and the kind is static; nobody writes either.
unsafe impl Send for CallMonitor {}
// SAFETY: as above, and all else is atomic.
unsafe impl Sync for CallMonitor {}

/// The name without what a terminal would obey: the handler writes it as it is.
fn harmless(who: &str) -> String {
    let show = |character: char| match character.is_control() {
        true => character.escape_unicode().to_string(),
        false => character.to_string(),
    };
    who.chars().map(show).collect()
}

/// The activities of all instances of the process.
static ALL: Mutex<Vec<Weak<CallMonitor>>> = Mutex::new(Vec::new());

/// The note of the call around another one, which counts again when that one ends, in whatever way.
pub(super) struct NoteGuard(*const CallNote);

impl Drop for NoteGuard {
    #[inline]
    fn drop(&mut self) {
        swap_current_note(self.0);
    }
}

impl NoteGuard {
    /// The note that counts now, which counts again when this is dropped.
    #[inline]
    pub(super) fn take() -> Self {
        NoteGuard(ENTERED.get())
    }
}

thread_local! {
    /// The note of the call that this thread is in. It needs no begin and no end, so a handler of signals may read it.
    static ENTERED: Cell<*const CallNote> = const { Cell::new(ptr::null()) };
}

/// That of the call which was entered or returned to last.
static LATEST: AtomicPtr<CallNote> = AtomicPtr::new(ptr::null_mut());

/// Lets this thread be in the call of a note, or in none; the note of the call around it comes back: an FMU may host another.
#[inline]
fn swap_current_note(note: *const CallNote) -> *const CallNote {
    let outer = ENTERED.replace(note);
    LATEST.store(note.cast_mut(), Relaxed);
    if call_notes_are_shared() {
        // SAFETY: the note lives until the call ends; null is none.
        unsafe { trackside_copy_note(note) };
    }
    outer
}

/// For `crash.c`.
#[unsafe(no_mangle)]
extern "C" fn trackside_entered() -> *const CallNote {
    ENTERED.get()
}

/// For `crash.c`.
#[unsafe(no_mangle)]
extern "C" fn trackside_latest() -> *const CallNote {
    LATEST.load(Relaxed)
}

impl CallMonitor {
    /// The activity of an FMU; `who` is how messages call it.
    pub(super) fn new(who: &str) -> Arc<Self> {
        Self::with_kind(who, c"FMU", true)
    }

    fn with_kind(who: &str, kind: &'static CStr, watched: bool) -> Arc<Self> {
        let note = CallNote {
            who: CString::new(harmless(who)).unwrap_or_default().into_raw(),
            kind: kind.as_ptr(),
            call: AtomicPtr::new(ptr::null_mut()),
            time: AtomicU64::new(f64::NAN.to_bits()),
        };
        let activity =
            Arc::new(CallMonitor { note, calls: AtomicU64::new(0), watched, told: AtomicU32::new(0) });
        let mut all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|other| other.strong_count() > 0);
        all.push(Arc::downgrade(&activity));
        activity
    }

    /// Says at what simulated time [s] the calls from here on happen.
    #[inline]
    pub(super) fn set_time(&self, time: f64) {
        self.note.time.store(time.to_bits(), Relaxed);
    }

    /// Runs a call of the FMU, and puts back what it changes around itself; what of that is not told yet comes with the result.
    pub(super) fn monitor_call<T>(
        &self,
        call: &'static CStr,
        body: impl FnOnce() -> T,
    ) -> (T, Option<ProcessStateChanges>) {
        self.begin_call(call);
        let before = ProcessStateSnapshot::capture();
        let outer = self.mark_as_current();
        let result = body();
        drop(outer);
        let changes = process_state::restore_process_state(before.as_ref());
        self.end_call();
        (result, if changes == 0 { None } else { self.take_unreported_changes(changes) })
    }

    /// The number of the call that was made last, and the bits of the time of now.
    pub(super) fn call_and_time(&self) -> (u64, u64) {
        (self.calls.load(Relaxed), self.note.time.load(Relaxed))
    }

    /// Notes that a call begins.
    #[inline]
    pub(super) fn begin_call(&self, call: &'static CStr) {
        self.note.call.store(call.as_ptr().cast_mut(), Relaxed);
        // One thread calls at a time, so nothing is lost between these two.
        self.calls.store(self.calls.load(Relaxed).wrapping_add(1), Relaxed);
    }

    /// Notes that no call goes on.
    #[inline]
    pub(super) fn end_call(&self) {
        self.note.call.store(ptr::null_mut(), Relaxed);
    }

    /// Lets this thread work for the FMU until the result is dropped, which has to be before the activity is.
    #[inline]
    pub(super) fn mark_as_current(&self) -> NoteGuard {
        NoteGuard(swap_current_note(&raw const self.note))
    }

    /// The same among many calls, until the next one or until the note from before them counts again. Nobody else reads the notes.
    #[inline]
    pub(super) fn become_current(&self, _until: &NoteGuard) {
        let note = &raw const self.note;
        ENTERED.set(note);
        LATEST.store(note.cast_mut(), Relaxed);
    }

    /// Looks at memory of the FMU, with a note for the case that there is none. It calls nobody, so nothing changes around it.
    pub(super) fn run_memory_access<T>(&self, what: &'static CStr, body: impl FnOnce() -> T) -> T {
        self.note.call.store(what.as_ptr().cast_mut(), Relaxed);
        let outer = self.mark_as_current();
        let result = body();
        drop(outer);
        self.note.call.store(ptr::null_mut(), Relaxed);
        result
    }

    /// Runs a call that loads a library or makes an instance, after which more is looked at.
    pub(super) fn monitor_load_or_instantiate<T>(
        &self,
        call: &'static CStr,
        body: impl FnOnce() -> T,
    ) -> (T, Option<ProcessStateChanges>) {
        let alone = GUEST.load(Relaxed);
        let ((result, changes), more) =
            process_state::run_and_restore_signals(alone, || self.monitor_call(call, body));
        let more = if more == 0 { None } else { self.take_unreported_changes(more) };
        (result, changes.or(more).map(|_| changes.unwrap_or(0) | more.unwrap_or(0)))
    }

    /// Those changes that have not been told; they are from here on.
    #[cold]
    pub(super) fn take_unreported_changes(
        &self,
        changes: ProcessStateChanges,
    ) -> Option<ProcessStateChanges> {
        let told = self.told.fetch_or(changes, Relaxed);
        Some(changes & !told).filter(|news| *news != 0)
    }

    /// Tells changes of a call that no instance is there to tell.
    #[cold]
    pub(super) fn report_process_changes(&self, changes: ProcessStateChanges, call: &'static CStr) {
        let who = self.owner_name().to_string_lossy();
        if !GUEST.load(Relaxed) {
            let sentences = process_state::describe_changes(changes, call);
            sentences.for_each(|it| process_state::report_process_change(format!("{who}: {it}")));
        }
    }

    /// Puts down all libraries that were loaded since the last time as those of this FMU or plugin.
    pub(super) fn register_libraries(&self) {
        if !GUEST.load(Relaxed) {
            // SAFETY: both texts live as long as the activity; they are copied, or static.
            unsafe { trackside_note_libraries(self.note.who, self.note.kind) };
        }
    }

    pub(super) fn owner_name(&self) -> &CStr {
        // SAFETY: the name is a C string that lives as long as the activity.
        unsafe { CStr::from_ptr(self.note.who) }
    }

    /// The number of the call that is going on, and what it is; nothing between calls.
    fn running_call(&self) -> Option<(u64, String)> {
        let call = self.note.call.load(Relaxed);
        if call.is_null() {
            return None;
        }
        // SAFETY: only the names of calls are ever stored, which live as long as the program.
        let call = unsafe { CStr::from_ptr(call) }.to_string_lossy();
        let time = f64::from_bits(self.note.time.load(Relaxed));
        // As in other messages: without the rounding error of a product.
        let rounded = (time * 1e9).round() / 1e9;
        let at = if time.is_nan() { String::new() } else { format!(" at t = {rounded} s") };
        let who = self.owner_name().to_string_lossy();
        Some((self.calls.load(Relaxed), format!("{who}: {call}{at}")))
    }
}

impl Drop for CallMonitor {
    fn drop(&mut self) {
        // SAFETY: the name comes from `CString::into_raw`, and nobody uses it after this.
        drop(unsafe { CString::from_raw(self.note.who) });
    }
}

/// Runs a call of a plugin, with a note for the case that it ends the program. `who` is how messages call the plugin.
pub fn call_plugin<T>(who: &str, call: &'static CStr, body: impl FnOnce() -> T) -> T {
    install_crash_handler();
    // It tells its progress itself.
    let activity = CallMonitor::with_kind(who, c"plugin", false);
    let (result, changes) = activity.monitor_load_or_instantiate(call, body);
    activity.register_libraries();
    changes.into_iter().for_each(|changes| activity.report_process_changes(changes, call));
    result
}

/// Forgets the libraries that are gone.
pub(super) fn forget_unloaded_libraries() {
    if !GUEST.load(Relaxed) {
        // SAFETY: without a name the function only forgets.
        unsafe { trackside_note_libraries(ptr::null(), ptr::null()) };
    }
}

/// The calls of foreign code that are going on: whose, which, at what time, and a number that no other call of it has.
#[must_use]
pub fn active_calls() -> Vec<(u64, String)> {
    let all = ALL.lock().unwrap_or_else(PoisonError::into_inner).clone();
    all.iter().filter_map(Weak::upgrade).filter_map(|activity| activity.running_call()).collect()
}

/// Whether the signals of the process are somebody else's.
static GUEST: AtomicBool = AtomicBool::new(false);

/// Leaves the signals of the process alone from here on, for a library in a program of others: crashes are not reported.
pub fn disable_crash_handlers() {
    GUEST.store(true, Relaxed);
}

/// Lets the program say which call of which FMU it dies in.
pub(super) fn install_crash_handler() {
    static WATCHED: Once = Once::new();
    if GUEST.load(Relaxed) {
        return;
    }
    // SAFETY: the function installs handlers that live as long as the program.
    WATCHED.call_once(|| unsafe { trackside_watch_crashes() });
}

/// Looking more often than this costs more than anybody gains.
const SHORTEST: Duration = Duration::from_millis(10);

/// Reports each call of an FMU in this process that has gone on for `patience`, and again each time that it has gone on
/// for twice as long. A thread of its own does that until the process ends.
pub fn start_watchdog(patience: Duration, report: impl Fn(&str) + Send + 'static) {
    let look = move || {
        // By instance: the call that was seen, since when, and when it is reported next.
        let mut seen: Vec<(*const CallMonitor, u64, Instant, Duration)> = Vec::new();
        loop {
            std::thread::sleep(patience.clamp(SHORTEST, Duration::from_secs(1)) / 2);
            let all = ALL.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let mut still = Vec::new();
            for activity in all.iter().filter_map(Weak::upgrade).filter(|it| it.watched) {
                let Some((call, what)) = activity.running_call() else { continue };
                let address = Arc::as_ptr(&activity);
                let known = seen.iter().find(|known| (known.0, known.1) == (address, call));
                let first = (address, call, Instant::now(), patience.max(SHORTEST));
                let mut entry = known.copied().unwrap_or(first);
                let elapsed = entry.2.elapsed();
                if elapsed >= entry.3 {
                    report(&format!("{what} has been running for {:.0} s", elapsed.as_secs_f64()));
                    entry.3 *= 2;
                }
                still.push(entry);
            }
            seen = still;
        }
    };
    // Without the thread the run is the same, only nobody reports.
    let _ = std::thread::Builder::new().name("watch".to_owned()).spawn(look);
}
