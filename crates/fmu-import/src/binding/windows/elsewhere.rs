//! Stands for libraries for Windows on systems without Wine, where none is ever loaded.

use std::convert::Infallible;
use std::path::Path;
use std::sync::Arc;

/// No library.
pub(super) struct WindowsLibrary(Infallible);

impl WindowsLibrary {
    pub fn load(_: &Path) -> Result<Self, String> {
        Err("Wine runs libraries for Windows on Linux only".to_owned())
    }

    pub fn find_function(&self, _: &str) -> Option<*const ()> {
        match self.0 {}
    }

    pub fn has_function(&self, _: &str) -> bool {
        match self.0 {}
    }

    pub fn run_without_instance<T>(&self, _: impl FnOnce() -> T) -> T {
        match self.0 {}
    }

    pub fn process_end(&self) -> Option<&str> {
        match self.0 {}
    }
}

/// Needed on Linux only.
pub fn cancel_wine_calls_when(_: Arc<dyn Fn() -> bool + Send + Sync>) {}
