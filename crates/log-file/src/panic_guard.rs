//! Converts errors and panics of format libraries into errors of this crate.

use std::cell::Cell;
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;

use crate::Error;

thread_local! {
    /// Whether panics of this thread are caught, so that nobody needs their message and backtrace.
    static CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// The result of work on a file of a format.
pub fn catch_panics<T, E: Display>(format: &str, work: impl FnOnce() -> Result<T, E>) -> Result<T, Error> {
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
    match worked {
        Ok(Ok(done)) => Ok(done),
        Ok(Err(error)) => Err(Error::new(format!("the {format} file cannot be read: {error}"))),
        Err(_) => Err(Error::new(format!("the {format} file is damaged"))),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn a_panic_of_a_library_is_an_error_and_shows_nothing() {
        static SHOWN: AtomicUsize = AtomicUsize::new(0);
        std::panic::set_hook(Box::new(|_| {
            SHOWN.fetch_add(1, Ordering::Relaxed);
        }));
        let damaged = || -> Result<(), String> { panic!("index out of bounds") };
        let error = catch_panics("Arrow", damaged).expect_err("it is damaged").to_string();
        assert_eq!((&*error, SHOWN.load(Ordering::Relaxed)), ("the Arrow file is damaged", 0));
        // Panics of others are shown as before.
        assert!(catch_unwind(|| panic!("ours")).is_err());
        assert_eq!(SHOWN.load(Ordering::Relaxed), 1);
    }
}
