//! Holds a loaded library: in this process, or one for Windows under Wine.

use super::windows::WindowsLibrary;

/// A loaded library, in which functions are found by name.
pub(super) enum LibraryHandle {
    /// Its code runs in this process.
    Native(libloading::Library),
    /// Its functions forward calls to a process under Wine.
    Windows(WindowsLibrary),
}

impl LibraryHandle {
    /// The address of a function, by its name.
    pub(super) fn find_address(&self, symbol: &str) -> Option<*const ()> {
        match self {
            // SAFETY: the address is looked at, not called.
            LibraryHandle::Native(library) => unsafe { library.get::<*const ()>(symbol) }.ok().map(|it| *it),
            LibraryHandle::Windows(library) => library.find_function(symbol),
        }
    }

    /// A function by its name.
    ///
    /// # Safety
    /// The function of this name must be of type `T`, which is one of pointers to functions.
    pub(super) unsafe fn find_function<T: Copy>(&self, symbol: &str) -> Option<T> {
        const { assert!(size_of::<T>() == size_of::<*const ()>()) };
        let address = self.find_address(symbol)?;
        // SAFETY: as for this function; one that forwards calls has the type that FMI gives the one of this name.
        Some(unsafe { std::mem::transmute_copy(&address) })
    }

    /// Whether the library has a function, also one that nobody calls.
    pub(super) fn has_function(&self, symbol: &str) -> bool {
        match self {
            LibraryHandle::Native(_) => self.find_address(symbol).is_some(),
            LibraryHandle::Windows(library) => library.has_function(symbol),
        }
    }

    /// Runs calls of functions that take no instance.
    pub(super) fn run_without_instance<T>(&self, body: impl FnOnce() -> T) -> T {
        match self {
            LibraryHandle::Native(_) => body(),
            LibraryHandle::Windows(library) => library.run_without_instance(body),
        }
    }

    /// How the process of the library ended, if it has one of its own, and that is gone.
    pub(super) fn process_end(&self) -> Option<&str> {
        match self {
            LibraryHandle::Native(_) => None,
            LibraryHandle::Windows(library) => library.process_end(),
        }
    }
}
