//! Lays out what crosses the boundary between the program and a plugin, in C's terms.
//!
//! Any change here is another [`VERSION`].
#![allow(unsafe_code, reason = "pointers of the other side become slices here")]

use std::ffi::c_void;

use crate::Signal;

/// The version of this layout. It stands first in [`Vtable`], where every version of the program finds it.
pub const VERSION: u32 = 2;

/// The name of the function that a plugin exports: `extern "C" fn() -> *const Vtable`.
pub const SYMBOL: &[u8] = b"trackside_plugin\0";

/// A borrowed text in UTF-8, without a terminating zero.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Text {
    /// First byte; may be dangling when there is none.
    pub data: *const u8,
    /// Number of bytes.
    pub len: usize,
}

/// A borrowed signal.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Column {
    /// Its name.
    pub name: Text,
    /// Its unit.
    pub unit: Text,
    /// Times [s].
    pub time: *const f64,
    /// Values.
    pub values: *const f64,
    /// Number of samples.
    pub len: usize,
}

/// A signal that a plugin can be given.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Need {
    /// Its name.
    pub name: Text,
    /// The unit that it is wanted in.
    pub unit: Text,
    /// One line about it.
    pub description: Text,
    /// Whether the plugin cannot do without.
    pub required: bool,
}

/// A borrowed layer of a diagram.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Layer {
    /// Its name.
    pub name: Text,
    /// A [`Shape`](crate::Shape), by its place.
    pub shape: u32,
    /// A [`Role`](crate::Role), by its place.
    pub role: u32,
    /// Where the points are.
    pub x: *const f64,
    /// Their heights, or lower ends.
    pub y: *const f64,
    /// Upper ends of a band, else null.
    pub upper: *const f64,
    /// Number of points.
    pub len: usize,
}

/// A borrowed diagram.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Diagram {
    /// Its title.
    pub title: Text,
    /// What the axes show, x and y.
    pub axes: [Text; 2],
    /// The ends of the axes.
    pub ranges: [[f64; 2]; 2],
    /// What is drawn, from back to front.
    pub layers: *const Layer,
    /// Number of layers.
    pub count: usize,
}

/// What a plugin can call while one of its functions is called, and only then.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Callbacks {
    /// Handed back with each call.
    pub context: *mut c_void,
    /// Takes a share done and what comes next; `false` asks to give up.
    pub progress: unsafe extern "C" fn(context: *mut c_void, share: f64, what: Text) -> bool,
    /// Takes signals for the recording: a group and its columns.
    pub record: unsafe extern "C" fn(
        context: *mut c_void,
        group: Text,
        columns: *const Column,
        count: usize,
    ),
    /// Takes a diagram and the group that it belongs to.
    pub diagram: unsafe extern "C" fn(context: *mut c_void, group: Text, diagram: *const Diagram),
    /// Takes a file: its name and what it says.
    pub file: unsafe extern "C" fn(context: *mut c_void, name: Text, text: Text),
    /// Takes the outcome: whether it went well, and the result or what went wrong. Called once, last.
    pub done: unsafe extern "C" fn(context: *mut c_void, well: bool, text: Text),
}

/// A function of a plugin: the configuration, its signals, and whom to tell.
pub type Call = unsafe extern "C" fn(
    config: Text,
    columns: *const Column,
    count: usize,
    callbacks: *const Callbacks,
);

/// What a plugin exports. It lives as long as the library is loaded.
#[repr(C)]
pub struct Vtable {
    /// [`VERSION`] of the plugin. Nothing else is looked at when it differs from the program's.
    pub version: u32,
    /// Calls `done` with whether the configuration makes sense. It is given columns without samples.
    pub check: Call,
    /// Analyses, and calls `done` with the result.
    pub run: Call,
    /// Calls `take` with the signals that it can be given, which are borrowed until that returns.
    pub needs: unsafe extern "C" fn(
        context: *mut c_void,
        take: unsafe extern "C" fn(*mut c_void, *const Need, usize),
    ),
}

impl Text {
    /// Lends a text.
    #[must_use]
    pub fn new(text: &str) -> Self {
        Self { data: text.as_ptr(), len: text.len() }
    }

    /// Borrows the text; bytes that are not UTF-8 are replaced.
    ///
    /// # Safety
    /// `data` points to `len` bytes that live for `'a`, or `len` is 0.
    #[must_use]
    pub unsafe fn get<'a>(self) -> std::borrow::Cow<'a, str> {
        // SAFETY: as the caller promises.
        String::from_utf8_lossy(unsafe { slice(self.data, self.len) })
    }
}

/// Borrows `len` values, none from a null pointer.
///
/// # Safety
/// `data` is null, or points to `len` values that live for `'a`.
pub(crate) unsafe fn slice<'a, T>(data: *const T, len: usize) -> &'a [T] {
    if data.is_null() || len == 0 {
        return &[];
    }
    // SAFETY: as the caller promises.
    unsafe { std::slice::from_raw_parts(data, len) }
}

/// Calls `work` with the signals that columns hold.
///
/// # Safety
/// `columns` is null, or points to `count` columns, which live as long as the call, and so does what they point to.
pub(crate) unsafe fn with_signals<T>(
    columns: *const Column,
    count: usize,
    work: impl FnOnce(Vec<Signal>) -> T,
) -> T {
    // SAFETY: as the caller promises; so below.
    let columns = unsafe { slice(columns, count) };
    // SAFETY: see above.
    let text = |text: Text| unsafe { text.get() };
    let names: Vec<_> =
        columns.iter().map(|column| (text(column.name), text(column.unit))).collect();
    let signals = columns.iter().zip(&names).map(|(column, (name, unit))| Signal {
        name,
        unit,
        // SAFETY: see above.
        time: unsafe { slice(column.time, column.len) },
        // SAFETY: see above.
        values: unsafe { slice(column.values, column.len) },
    });
    work(signals.collect())
}
