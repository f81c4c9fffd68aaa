//! Guards the state of a call against foreign threads, nested callbacks and panics.
#![allow(unsafe_code, reason = "a pointer that went through foreign code becomes a reference here")]

use std::any::Any;
use std::cell::RefCell;
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{ThreadId, current};

/// The state that the callbacks of one call work on.
pub(super) struct CallGuard<T> {
    thread: ThreadId,
    foreign_thread: AtomicBool,
    inner: RefCell<GuardedState<T>>,
}

struct GuardedState<T> {
    state: T,
    panic: Option<Box<dyn Any + Send>>,
}

impl<T> CallGuard<T> {
    /// Guards the state of a call on this thread.
    pub fn new(state: T) -> Self {
        let inner = RefCell::new(GuardedState { state, panic: None });
        Self { thread: current().id(), foreign_thread: AtomicBool::new(false), inner }
    }

    /// The address that goes through the foreign code.
    pub fn context_pointer(&self) -> *mut c_void {
        (&raw const *self).cast_mut().cast()
    }

    /// Does the work of a callback, or gives `otherwise`: for a null context, on another thread, within another
    /// callback, and once a callback panicked. No panic leaves it.
    ///
    /// # Safety
    /// `context` is null or comes from [`CallGuard::context_pointer`] of a guard for the same type that has not ended.
    pub unsafe fn with_state<R>(context: *mut c_void, otherwise: R, work: impl FnOnce(&mut T) -> R) -> R {
        // SAFETY: as the caller promises. The reference is shared, also with other threads: until the thread is
        // known, only what all threads may read is.
        let Some(guard) = (unsafe { context.cast::<Self>().as_ref() }) else { return otherwise };
        if current().id() != guard.thread {
            guard.foreign_thread.store(true, Ordering::Relaxed);
            return otherwise;
        }
        let Ok(mut inner) = guard.inner.try_borrow_mut() else { return otherwise };
        if inner.panic.is_some() {
            return otherwise;
        }
        match catch_unwind(AssertUnwindSafe(|| work(&mut inner.state))) {
            Ok(result) => result,
            Err(panic) => {
                inner.panic = Some(panic);
                otherwise
            }
        }
    }

    /// The state after the call, and whether another thread tried to change it.
    ///
    /// # Panics
    /// When a callback panicked: its panic goes on here.
    pub fn finish(self) -> (T, bool) {
        let GuardedState { state, panic } = self.inner.into_inner();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
        (state, self.foreign_thread.into_inner())
    }
}
