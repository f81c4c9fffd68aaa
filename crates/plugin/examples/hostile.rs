//! A plugin that takes its configuration as a list of things to do, and does them with pointers and numbers that nobody should use.
//!
//! It lends nothing that is longer than it says: against that nobody has a remedy.
#![allow(unsafe_code, reason = "it is written as a careless plugin in C would be")]

use std::ffi::c_void;
use std::ptr::null;

use plugin::abi::{
    CallOutcome, Diagram, DiagramLayer, HostCallbacks, InputSignal, SignalColumn, Text, VERSION, Vtable,
};

/// What columns point into.
static NUMBERS: [f64; 8] = [0.0, 0.5, 1.0, -1.0, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, f64::MAX];

/// The bytes that are still to be done.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn next(&mut self) -> usize {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        usize::from(*first)
    }

    /// A part of the bytes, mostly; else no address, or a length that nothing has.
    fn text(&mut self) -> Text {
        let len = self.next();
        match len {
            255 => Text { data: null(), len: usize::MAX },
            254 => Text { data: null(), len: 5 },
            253 => Text { data: self.0.as_ptr(), len: usize::MAX },
            _ => {
                let (text, rest) = self.0.split_at((len % 32).min(self.0.len()));
                self.0 = rest;
                Text { data: text.as_ptr(), len: text.len() }
            }
        }
    }

    fn number(&mut self) -> f64 {
        NUMBERS[self.next() % 8]
    }

    /// An address and a length of numbers that are there, or of none.
    fn numbers(&mut self, len: usize) -> *const f64 {
        match self.next() % 8 {
            0 => null(),
            // Nobody reads numbers at odd addresses.
            1 => NUMBERS.as_ptr().wrapping_byte_add(1),
            at if at + len <= 8 => &raw const NUMBERS[at],
            // All lengths up to 8 are there from the start.
            _ => NUMBERS.as_ptr(),
        }
    }

    fn column(&mut self) -> SignalColumn {
        let (name, unit, len) = (self.text(), self.text(), self.next() % 9);
        let (time, values) = (self.numbers(len), self.numbers(len));
        // A length that nothing has goes with no address only, or one that is none of a number.
        let huge = time.is_null() && !values.is_aligned();
        SignalColumn { name, unit, time, values, len: if huge { usize::MAX } else { len } }
    }

    fn layer(&mut self) -> DiagramLayer {
        let (name, len) = (self.text(), self.next() % 9);
        let (shape, role) = (self.next() as u32, self.next() as u32);
        let (x, y, upper) = (self.numbers(len), self.numbers(len), self.numbers(len));
        DiagramLayer { name, shape, role, x, y, upper, len }
    }

    fn many<T>(&mut self, one: fn(&mut Self) -> T) -> Vec<T> {
        (0..self.next() % 4).map(|_| one(self)).collect()
    }
}

unsafe extern "C" fn work(config: Text, _: *const SignalColumn, _: usize, callbacks: *const HostCallbacks) {
    // SAFETY: the program lends all that it passes for the duration of the call.
    let (config, calls) = unsafe { (config.to_str_lossy(), &*callbacks) };
    let mut bytes = Bytes(config.as_bytes());
    while !bytes.0.is_empty() {
        let what = bytes.next() % 12;
        let context = if what == 11 { std::ptr::null_mut() } else { calls.context };
        // SAFETY: what is lent lives until the callback returns, and the context is the program's, or none.
        unsafe {
            match what {
                0 => _ = (calls.progress)(context, bytes.number(), bytes.text()),
                1..=3 => {
                    let (group, columns) = (bytes.text(), bytes.many(Bytes::column));
                    (calls.record)(context, group, columns.as_ptr(), columns.len());
                }
                4..=6 => {
                    let (group, layers) = (bytes.text(), bytes.many(Bytes::layer));
                    let diagram = Diagram {
                        title: bytes.text(),
                        axes: [bytes.text(), bytes.text()],
                        ranges: [[bytes.number(), bytes.number()], [bytes.number(), 1.0]],
                        layers: layers.as_ptr(),
                        count: layers.len(),
                    };
                    (calls.diagram)(context, group, &raw const diagram);
                }
                7 => (calls.file)(context, bytes.text(), bytes.text()),
                8 => (calls.done)(context, null()),
                _ => {
                    let (status, path) = (bytes.next() as u32 % 4, bytes.many(Bytes::text));
                    let (path, depth) = match bytes.next() {
                        0 => (null(), usize::MAX),
                        _ => (path.as_ptr(), path.len()),
                    };
                    let outcome = CallOutcome { status, path, depth, text: bytes.text() };
                    (calls.done)(context, &raw const outcome);
                }
            }
        }
    }
}

unsafe extern "C" fn needs(
    context: *mut c_void,
    take: unsafe extern "C" fn(*mut c_void, *const InputSignal, usize),
) {
    // SAFETY: no address with any length is what the program has to bear.
    unsafe { take(context, null(), 7) }
}

static TABLE: Vtable =
    Vtable { version: VERSION, check: Some(work), run: Some(work), needs: Some(needs), schema: None };

/// The entry point for the program.
#[unsafe(no_mangle)]
pub extern "C" fn trackside_plugin() -> *const Vtable {
    &raw const TABLE
}
