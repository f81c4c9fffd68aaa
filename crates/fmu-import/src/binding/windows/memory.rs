//! Maps the memory that this process shares with the one under Wine, whose program has the same layout.

use std::cell::UnsafeCell;
use std::io;
use std::mem::offset_of;
use std::os::fd::{AsRawFd as _, OwnedFd};
use std::ptr;
use std::sync::atomic::{AtomicU32, AtomicU64};

use rustix::fs::{MemfdFlags, ftruncate, memfd_create};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

/// Room for log messages that nobody has read [bytes].
pub(super) const LOG: usize = 1 << 18;

/// What both sides write at once is on a line of the cache for itself.
#[repr(C, align(64))]
pub(super) struct CacheLine<T>(pub T);

/// The last exception in a call.
#[repr(C)]
pub(super) struct ExceptionNote {
    pub code: AtomicU32,
    /// Whether nobody handled it.
    pub unhandled: AtomicU32,
    pub address: AtomicU64,
}

/// Where an array of a call lies, from the begin of the memory on; 0 stands for null.
#[repr(C)]
pub(super) struct ArrayPlace {
    pub offset: u64,
    pub length: u64,
}

/// A call and its answer.
#[repr(C)]
pub(super) struct CallRecord {
    pub row: u32,
    pub status: i32,
    pub result: u64,
    pub size: u64,
    pub integers: [u64; 8],
    pub reals: [f64; 4],
    pub arrays: [ArrayPlace; 8],
}

#[repr(C)]
pub(super) struct Header {
    /// Whose turn it is: a count, which is even for this side.
    pub turn: CacheLine<AtomicU32>,
    /// Whether the other side waits for a byte.
    pub asleep: CacheLine<AtomicU32>,
    pub exception: CacheLine<ExceptionNote>,
    /// How much was ever written to the log, and read from it [bytes].
    pub log_written: CacheLine<AtomicU64>,
    pub log_read: CacheLine<AtomicU64>,
    /// Belongs to the side whose turn it is.
    pub call: UnsafeCell<CallRecord>,
}

const LOG_BEGIN: usize = 4096;
const _: () = assert!(offset_of!(Header, call) == 320 && size_of::<Header>() <= LOG_BEGIN);

/// Where arrays may lie.
pub(super) const DATA: usize = LOG_BEGIN + LOG;

/// Memory that takes no room until it is written.
#[derive(Debug)]
pub(super) struct SharedMemory {
    address: *mut u8,
    pub size: usize,
    file: OwnedFd,
}

// SAFETY: the mapping belongs to the process, and whoever calls has its turn.
unsafe impl Send for SharedMemory {}
// SAFETY: as above.
unsafe impl Sync for SharedMemory {}

impl SharedMemory {
    /// # Errors
    /// When the system has none.
    pub fn new(size: usize) -> io::Result<Self> {
        let file = memfd_create("trackside", MemfdFlags::CLOEXEC)?;
        ftruncate(&file, size as u64)?;
        let access = ProtFlags::READ | ProtFlags::WRITE;
        // SAFETY: the system chooses the address, so nothing else is there.
        let address = unsafe { mmap(ptr::null_mut(), size, access, MapFlags::SHARED, &file, 0) }?;
        Ok(SharedMemory { address: address.cast(), size, file })
    }

    /// The path by which a program under Wine opens it.
    pub fn windows_path(&self) -> String {
        format!(r"Z:\proc\{}\fd\{}", std::process::id(), self.file.as_raw_fd())
    }

    pub fn header(&self) -> &Header {
        // SAFETY: the header is at the begin of the mapping, and consists of what may change at any time and cells.
        unsafe { &*self.address.cast() }
    }

    /// A place behind the header.
    ///
    /// # Panics
    /// When it is outside.
    pub fn place(&self, offset: usize, bytes: usize) -> *mut u8 {
        assert!(offset.checked_add(bytes).is_some_and(|end| end <= self.size), "it is inside");
        // SAFETY: it is inside of the mapping.
        unsafe { self.address.add(offset) }
    }

    /// Copies from the log, in which positions count on and on.
    pub fn read_log(&self, position: u64, bytes: &mut [u8]) {
        for (position, byte) in (position..).zip(bytes) {
            let offset = LOG_BEGIN + (position % LOG as u64) as usize;
            // SAFETY: the log is inside of the mapping; the other side wrote this part before it said so.
            *byte = unsafe { self.place(offset, 1).read_volatile() };
        }
    }
}

impl Drop for SharedMemory {
    fn drop(&mut self) {
        // SAFETY: the mapping is that of `new`, and nothing refers to it any more.
        let _ = unsafe { munmap(self.address.cast(), self.size) };
    }
}
