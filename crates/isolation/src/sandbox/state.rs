//! Remembers whether this process lives in namespaces that it made.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

static IN_OWN_NAMESPACES: AtomicBool = AtomicBool::new(false);

pub(crate) fn is_in_own_namespaces() -> bool {
    IN_OWN_NAMESPACES.load(Relaxed)
}

pub(super) fn note_own_namespaces() {
    IN_OWN_NAMESPACES.store(true, Relaxed);
}
