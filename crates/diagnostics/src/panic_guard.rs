//! Catches panics of libraries that read damaged files, without their message and backtrace.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

thread_local! {
    /// Whether panics of this thread are caught, so that nobody needs their message and backtrace.
    static CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// The result of work that a library may panic in; nothing when it did.
pub fn catch_panics<T>(work: impl FnOnce() -> T) -> Option<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let other = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !CAUGHT.get() {
                other(panic);
            }
        }));
    });
    let outer = CAUGHT.replace(true);
    let worked = catch_unwind(AssertUnwindSafe(work));
    CAUGHT.set(outer);
    worked.ok()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn a_panic_of_a_library_shows_nothing() {
        static SHOWN: AtomicUsize = AtomicUsize::new(0);
        std::panic::set_hook(Box::new(|_| {
            SHOWN.fetch_add(1, Ordering::Relaxed);
        }));
        let damaged = || -> u8 { panic!("index out of bounds") };
        assert_eq!((catch_panics(damaged), SHOWN.load(Ordering::Relaxed)), (None, 0));
        // Panics of others are shown as before.
        assert!(catch_unwind(|| panic!("ours")).is_err());
        assert_eq!(SHOWN.load(Ordering::Relaxed), 1);
    }
}
