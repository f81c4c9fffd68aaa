//! Maps the memory that two processes share: a doorbell, a note, numbers and bytes.
#![expect(unsafe_code, reason = "mapping memory")]

use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::ptr;
use std::sync::atomic::Ordering::{Relaxed, SeqCst};
use std::sync::atomic::{AtomicU8, AtomicU32, AtomicU64};

use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, fstat, ftruncate, memfd_create};
use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

/// Bytes of the note, which stays when the guest dies: what it is doing, and its last words.
pub const NOTE: usize = 512;

/// More bytes than this are sent in pieces.
const BYTES: usize = 64 << 10;

/// Words of four bytes at the beginning, each on a cache line of its own as far as both sides write it at once.
const HEAD: usize = 256;
const TURN: usize = 0;
const ASLEEP: [usize; 2] = [64, 128];
const COUNT: usize = 192;
const LENGTH: usize = 196;
const MORE: usize = 200;

/// Memory that another process has mapped, too. All access is atomic, since the other side may write at any time.
#[derive(Debug)]
pub(crate) struct SharedMemory {
    address: *mut u8,
    length: usize,
    /// Numbers that there is place for.
    pub numbers: usize,
}

// SAFETY: the mapping belongs to the process, and all access to it is atomic.
unsafe impl Send for SharedMemory {}
// SAFETY: as above.
unsafe impl Sync for SharedMemory {}

impl SharedMemory {
    /// New memory with place for this many numbers, and the descriptor with which another process maps it.
    ///
    /// # Errors
    /// When the system has none.
    pub fn new(numbers: usize) -> io::Result<(Self, OwnedFd)> {
        let file = memfd_create("trackside", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?;
        ftruncate(&file, (HEAD + NOTE + 8 * numbers + BYTES) as u64)?;
        // Whoever touches memory that the other side took away ends with SIGBUS.
        fcntl_add_seals(&file, SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL)?;
        let memory = Self::map_existing(&file)?;
        Ok((memory, file))
    }

    /// Memory that another process made.
    ///
    /// # Errors
    /// When the descriptor is that of something else.
    pub fn map_existing(file: impl AsFd) -> io::Result<Self> {
        let length = usize::try_from(fstat(&file)?.st_size).unwrap_or(0);
        let numbers = length.checked_sub(HEAD + NOTE + BYTES).filter(|rest| rest % 8 == 0);
        let numbers = numbers.ok_or_else(|| io::Error::other("it is no memory of a host"))? / 8;
        let access = ProtFlags::READ | ProtFlags::WRITE;
        // SAFETY: the system chooses the address, so nothing else is there.
        let address = unsafe { mmap(ptr::null_mut(), length, access, MapFlags::SHARED, file, 0) }?;
        Ok(SharedMemory { address: address.cast(), length, numbers })
    }

    fn header_word(&self, place: usize) -> &AtomicU32 {
        // SAFETY: all places are multiples of four below HEAD, and the mapping begins at a page.
        unsafe { AtomicU32::from_ptr(self.address.add(place).cast()) }
    }

    /// Whose turn it is: a count, which is even for the host.
    pub fn turn_counter(&self) -> &AtomicU32 {
        self.header_word(TURN)
    }

    /// Whether a side sleeps until the bell rings.
    pub fn sleep_flag(&self, side: usize) -> &AtomicU32 {
        self.header_word(ASLEEP[side])
    }

    /// The note, which the guest writes.
    pub fn note_bytes(&self) -> &[AtomicU8; NOTE] {
        // SAFETY: the note lies behind the head, inside the mapping, and atomic bytes may change at any time.
        unsafe { &*self.address.add(HEAD).cast() }
    }

    fn number_cells(&self) -> &[AtomicU64] {
        // SAFETY: the numbers lie behind the note, inside the mapping; HEAD and NOTE are multiples of eight.
        unsafe { std::slice::from_raw_parts(self.address.add(HEAD + NOTE).cast(), self.numbers) }
    }

    fn byte_cells(&self) -> &[AtomicU8] {
        let begin = HEAD + NOTE + 8 * self.numbers;
        // SAFETY: the bytes lie behind the numbers, at the end of the mapping.
        unsafe { std::slice::from_raw_parts(self.address.add(begin).cast(), BYTES) }
    }

    /// Writes numbers, of which there may be as many as there is place for, and as many bytes as fit; the bytes that are left.
    pub fn write_message<'a>(&self, numbers: &[f64], bytes: &'a [u8]) -> &'a [u8] {
        let cells = self.number_cells();
        cells.iter().zip(numbers).for_each(|(cell, number)| cell.store(number.to_bits(), Relaxed));
        let (now, later) = bytes.split_at(bytes.len().min(BYTES));
        self.byte_cells().iter().zip(now).for_each(|(cell, byte)| cell.store(*byte, Relaxed));
        // Both are small enough for the words: whoever sends has looked.
        self.header_word(COUNT).store(numbers.len() as u32, Relaxed);
        self.header_word(LENGTH).store(now.len() as u32, Relaxed);
        self.header_word(MORE).store(u32::from(!later.is_empty()), SeqCst);
        later
    }

    /// Reads numbers, and appends bytes; whether more bytes are to come. None when the other side wrote nonsense.
    pub fn read_message(&self, numbers: &mut Vec<f64>, bytes: &mut Vec<u8>) -> Option<bool> {
        let length = |place| usize::try_from(self.header_word(place).load(SeqCst)).ok();
        let cells = self.number_cells().get(..length(COUNT)?)?;
        numbers.clear();
        numbers.extend(cells.iter().map(|cell| f64::from_bits(cell.load(Relaxed))));
        let cells = self.byte_cells().get(..length(LENGTH)?)?;
        bytes.extend(cells.iter().map(|cell| cell.load(Relaxed)));
        Some(length(MORE)? != 0)
    }
}

impl Drop for SharedMemory {
    fn drop(&mut self) {
        // SAFETY: the mapping is that of `map_existing`, and nothing refers to it any more.
        let _ = unsafe { munmap(self.address.cast(), self.length) };
    }
}
