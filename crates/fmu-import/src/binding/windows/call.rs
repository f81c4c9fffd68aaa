//! Writes the arguments of a call into shared memory, and takes what it gave from there.

use std::ffi::{CStr, c_char};
use std::sync::MutexGuard;

use super::memory::{ArrayPlace, CallRecord, DATA};
use super::process::{ProcessConnection, WindowsProcess};
use super::{LOST, TOO_LARGE};
use crate::binding::mailbox::report_refused_call;
use crate::binding::{ERROR, FmiStatus};

/// Behind each array that an FMU fills stand so many bytes of whoever lends it, see `guarded_buffer.rs`: they go there and come back with it.
pub(super) const GUARD: usize = 64;
const ALIGNMENT: usize = 16;

/// An array that the other side fills.
#[derive(Clone, Copy)]
struct Output {
    local: *mut u8,
    offset: usize,
    bytes: usize,
}

/// A call in the making. Integers, reals and arrays have the order that the other side takes them in.
pub(super) struct RemoteCall<'a> {
    process: &'a WindowsProcess,
    connection: MutexGuard<'a, ProcessConnection>,
    /// Where there is room for the next array.
    end: usize,
    integers: usize,
    reals: usize,
    arrays: usize,
    outputs: [Option<Output>; 6],
    /// The bytes of all arrays when there is no room for them.
    excess: Option<usize>,
}

impl<'a> RemoteCall<'a> {
    pub fn new(process: &'a WindowsProcess) -> Self {
        let connection = process.lock_connection();
        RemoteCall {
            process,
            connection,
            end: DATA,
            integers: 0,
            reals: 0,
            arrays: 0,
            outputs: [None; 6],
            excess: None,
        }
    }

    fn record(&mut self) -> &mut CallRecord {
        // SAFETY: it is this side's turn, and the lock is for this thread alone.
        unsafe { &mut *self.process.memory.header().call.get() }
    }

    pub fn integer(mut self, value: u64) -> Self {
        let place = self.integers;
        self.record().integers[place] = value;
        self.integers += 1;
        self
    }

    pub fn real(mut self, value: f64) -> Self {
        let place = self.reals;
        self.record().reals[place] = value;
        self.reals += 1;
        self
    }

    /// Room for so many bytes, with a guard behind them; nothing when there is no room.
    fn reserve(&mut self, bytes: usize) -> Option<usize> {
        let offset = self.end.next_multiple_of(ALIGNMENT);
        let end = bytes.checked_add(offset + GUARD).filter(|end| *end <= self.process.memory.size);
        let Some(end) = end.filter(|_| self.excess.is_none()) else {
            self.excess = Some(bytes.saturating_add(self.excess.unwrap_or(self.end - DATA)));
            return None;
        };
        self.end = end;
        Some(offset)
    }

    /// Room for the next array of the call.
    fn add_array(&mut self, bytes: usize) -> Option<usize> {
        let place = self.arrays;
        self.arrays += 1;
        let offset = self.reserve(bytes)?;
        self.record().arrays[place] = ArrayPlace { offset: offset as u64, length: bytes as u64 };
        Some(offset)
    }

    /// Adds bytes.
    pub fn bytes(mut self, bytes: &[u8]) -> Self {
        if let Some(offset) = self.add_array(bytes.len()) {
            let place = self.process.memory.place(offset, bytes.len());
            // SAFETY: there is room, in memory of nobody else.
            unsafe { place.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        }
        self
    }

    /// Adds a text, or null.
    ///
    /// # Safety
    /// The text is null, or ends with NUL.
    pub unsafe fn text(mut self, text: *const c_char) -> Self {
        if text.is_null() {
            let place = self.arrays;
            self.record().arrays[place] = ArrayPlace { offset: 0, length: 0 };
            self.arrays += 1;
            return self;
        }
        // SAFETY: as for this function.
        self.bytes(unsafe { CStr::from_ptr(text) }.to_bytes_with_nul())
    }

    /// Adds an array that the FMU reads.
    ///
    /// # Safety
    /// There are so many values.
    pub unsafe fn input<T: Copy>(self, values: *const T, count: usize) -> Self {
        if count == 0 {
            return self.bytes(&[]);
        }
        // SAFETY: as for this function; values of the types of FMI have no gaps.
        self.bytes(unsafe { std::slice::from_raw_parts(values.cast(), count * size_of::<T>()) })
    }

    /// Adds an array of texts or binaries, whose offsets take the place of pointers.
    pub fn parts<'b>(mut self, parts: impl ExactSizeIterator<Item = &'b [u8]>) -> Self {
        let Some(offset) = self.add_array(parts.len() * size_of::<u64>()) else { return self };
        for (index, part) in parts.enumerate() {
            let Some(at) = self.reserve(part.len()) else { return self };
            let memory = &self.process.memory;
            // SAFETY: there is room for both, in memory of nobody else.
            unsafe {
                memory.place(at, part.len()).copy_from_nonoverlapping(part.as_ptr(), part.len());
                memory.place(offset + 8 * index, 8).cast::<u64>().write(at as u64);
            }
        }
        self
    }

    /// Adds sizes, as the other side has them.
    pub fn sizes(self, sizes: &[usize]) -> Self {
        let width = self.process.pointer_width;
        let bytes: Vec<u8> =
            sizes.iter().flat_map(|size| size.to_le_bytes().into_iter().take(width)).collect();
        self.bytes(&bytes)
    }

    /// Adds an array that the FMU fills.
    ///
    /// # Safety
    /// There is room for so many values and the guard behind them.
    pub unsafe fn output<T: Copy>(mut self, values: *mut T, count: usize) -> Self {
        let bytes = count * size_of::<T>();
        if let Some(offset) = self.add_array(bytes) {
            let place = self.process.memory.place(offset, bytes + GUARD);
            // SAFETY: there are the array and its guard, and there is room for both.
            unsafe { place.copy_from_nonoverlapping(values.cast(), bytes + GUARD) };
            self.add_output(Output { local: values.cast(), offset, bytes });
        }
        self
    }

    /// Adds an array of pointers or sizes as the other side has them; its guard is that of `values`.
    ///
    /// # Safety
    /// As of [`output`](Self::output).
    pub unsafe fn words<T: Copy>(mut self, values: *mut T, count: usize) -> Self {
        let bytes = count * self.process.pointer_width;
        if let Some(offset) = self.add_array(bytes) {
            // SAFETY: the guard stands behind the values.
            let guard = unsafe { values.add(count) }.cast::<u8>();
            let place = self.process.memory.place(offset, bytes + GUARD);
            // SAFETY: there is room, in memory of nobody else.
            unsafe {
                place.write_bytes(0, bytes);
                place.add(bytes).copy_from_nonoverlapping(guard, GUARD);
            }
            self.add_output(Output { local: guard, offset: offset + bytes, bytes: 0 });
        }
        self
    }

    fn add_output(&mut self, output: Output) {
        if let Some(free) = self.outputs.iter_mut().find(|it| it.is_none()) {
            *free = Some(output);
        }
    }

    /// Makes the call; its status.
    pub fn run(&mut self, row: usize) -> FmiStatus {
        if let Some(excess) = self.excess {
            report_refused_call(&format!(
                "the call takes {excess} bytes, for which the memory shared with Wine has no room"
            ));
            return ERROR;
        }
        let end = self.end.next_multiple_of(ALIGNMENT) as u64;
        let size = self.process.memory.size as u64;
        let record = self.record();
        (record.row, record.result, record.size) = (row as u32, end, size);
        if !self.process.exchange(&mut self.connection) {
            return LOST;
        }
        for Output { local, offset, bytes } in self.outputs.iter().flatten() {
            let place = self.process.memory.place(*offset, bytes + GUARD);
            // SAFETY: the array and its guard were lent.
            unsafe { local.copy_from_nonoverlapping(place, bytes + GUARD) };
        }
        match self.record().status {
            TOO_LARGE => {
                report_refused_call("what it gave has no room in the memory shared with Wine");
                ERROR
            }
            status => status,
        }
    }

    /// A number or an address that the call gave.
    pub fn result(&mut self) -> u64 {
        self.record().result
    }

    /// The bytes that an array of pointers stood for after the call; nothing for null.
    pub fn packed(&self, count: usize) -> Vec<Option<Vec<u8>>> {
        let (memory, mut at) = (&self.process.memory, self.end.next_multiple_of(ALIGNMENT));
        let take = |_| {
            let head = at.checked_add(8).filter(|end| *end <= memory.size)?;
            // SAFETY: it is inside, and a multiple of 8.
            let length = unsafe { memory.place(at, 8).cast::<u64>().read() };
            at = head;
            let length = usize::try_from(length).ok().filter(|length| *length <= memory.size - at)?;
            // SAFETY: the bytes are inside, and nobody writes them now.
            let bytes = unsafe { std::slice::from_raw_parts(memory.place(at, length), length) }.to_vec();
            at = (at + length).next_multiple_of(8);
            Some(bytes)
        };
        (0..count).map(take).collect()
    }
}
