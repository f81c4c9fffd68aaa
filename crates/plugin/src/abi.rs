//! Defines the C structures that cross the boundary between program and plugin.
//!
//! Any change here is another [`VERSION`]. Truth values are bytes, 0 or 1: foreign memory may hold others, which
//! no `bool` may. Enumerations are numbers for the same reason, functions of a table may be null. Arrays and texts
//! are borrowed for the duration of the call that passes them.
#![allow(unsafe_code, reason = "pointers of the other side become slices here")]

use std::borrow::Cow;
use std::ffi::c_void;

/// The version of this layout. It stands first in [`Vtable`], where every version of the program finds it.
pub const VERSION: u32 = 3;

/// The name of the function that a plugin exports: `extern "C" fn() -> *const Vtable`.
pub const SYMBOL: &[u8] = b"trackside_plugin\0";

/// A text in UTF-8, without a terminating zero.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Text {
    /// First byte; may be null or dangling when there is none.
    pub data: *const u8,
    /// Number of bytes.
    pub len: usize,
}

/// A signal.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct SignalColumn {
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

/// A signal that a plugin accepts.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct InputSignal {
    /// Its name.
    pub name: Text,
    /// The unit that the plugin expects it in.
    pub unit: Text,
    /// One line about it.
    pub description: Text,
    /// Not 0 when the plugin cannot do without it.
    pub required: u8,
}

/// A layer of a diagram.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct DiagramLayer {
    /// Its name.
    pub name: Text,
    /// A [`DiagramLayerShape`](crate::DiagramLayerShape) by its index; unknown ones are lines.
    pub shape: u32,
    /// A [`DiagramLayerRole`](crate::DiagramLayerRole) by its index; unknown ones are `Other`.
    pub role: u32,
    /// Abscissas of the points.
    pub x: *const f64,
    /// Ordinates of the points, or lower ends.
    pub y: *const f64,
    /// Upper ends of a band, else null.
    pub upper: *const f64,
    /// Number of points.
    pub len: usize,
}

/// A diagram.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Diagram {
    /// Its title.
    pub title: Text,
    /// Labels of the axes, x and y.
    pub axes: [Text; 2],
    /// The ends of the axes.
    pub ranges: [[f64; 2]; 2],
    /// The layers, from back to front.
    pub layers: *const DiagramLayer,
    /// Number of layers.
    pub count: usize,
}

/// The work is done; the text is the result.
pub const DONE: u32 = 0;
/// The configuration or the choice of signals is wrong.
pub const BAD_CONFIG: u32 = 1;
/// The work failed.
pub const FAILED: u32 = 2;

/// How a call ended.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CallOutcome {
    /// [`DONE`], [`BAD_CONFIG`] or [`FAILED`]; every other number is a failure.
    pub status: u32,
    /// The keys that lead to the wrong value, from the outermost on. Items of a list are numbers from 0 on.
    pub path: *const Text,
    /// Number of these keys.
    pub depth: usize,
    /// The result, or the message.
    pub text: Text,
}

/// The program's functions. A plugin calls them during a call that lends it these, on the thread of that call.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct HostCallbacks {
    /// Handed back with each call.
    pub context: *mut c_void,
    /// Takes the share of the work that is done and the next task; 0 asks the plugin to give up.
    pub progress: unsafe extern "C" fn(context: *mut c_void, share: f64, task: Text) -> u8,
    /// Takes signals for the recording: a group and its columns.
    pub record:
        unsafe extern "C" fn(context: *mut c_void, group: Text, columns: *const SignalColumn, count: usize),
    /// Takes a diagram and the group that it belongs to.
    pub diagram: unsafe extern "C" fn(context: *mut c_void, group: Text, diagram: *const Diagram),
    /// Takes a file: its name and its text.
    pub file: unsafe extern "C" fn(context: *mut c_void, name: Text, text: Text),
    /// Takes the outcome. The last call counts.
    pub done: unsafe extern "C" fn(context: *mut c_void, outcome: *const CallOutcome),
}

/// A function of a plugin: the configuration in TOML, its signals, and the program's functions.
pub type AnalysisFn = unsafe extern "C" fn(
    config: Text,
    columns: *const SignalColumn,
    count: usize,
    callbacks: *const HostCallbacks,
);

/// Describes the signals of a plugin: calls `take` with them.
pub type DescribeInputsFn = unsafe extern "C" fn(
    context: *mut c_void,
    take: unsafe extern "C" fn(*mut c_void, *const InputSignal, usize),
);

/// Describes the configuration of a plugin: calls `take` with its JSON schema, or does nothing.
pub type DescribeSchemaFn =
    unsafe extern "C" fn(context: *mut c_void, take: unsafe extern "C" fn(*mut c_void, Text));

/// The table that a plugin exports. It lives as long as the process.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Vtable {
    /// [`VERSION`] of the plugin. Nothing else is read when it differs from the program's.
    pub version: u32,
    /// Judges the configuration and calls `done`. Its columns have no samples. Never null.
    pub check: Option<AnalysisFn>,
    /// Analyses, and calls `done` with the result. Never null.
    pub run: Option<AnalysisFn>,
    /// Lists the signals. Never null.
    pub needs: Option<DescribeInputsFn>,
    /// Gives the JSON schema of the configuration; null without one.
    pub schema: Option<DescribeSchemaFn>,
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
    /// `data` is null or points to `len` bytes that live for `'a`.
    #[must_use]
    pub unsafe fn to_str_lossy<'a>(self) -> Cow<'a, str> {
        // SAFETY: as the caller promises.
        String::from_utf8_lossy(unsafe { borrow_array(self.data, self.len) })
    }

    /// Borrows the text, unless it is not UTF-8.
    ///
    /// # Safety
    /// As [`Text::to_str_lossy`].
    #[must_use]
    pub unsafe fn to_utf8<'a>(self) -> Option<&'a str> {
        // SAFETY: as the caller promises.
        std::str::from_utf8(unsafe { borrow_array(self.data, self.len) }).ok()
    }
}

/// Borrows an array. An address or a length that no array has gives an empty one.
///
/// # Safety
/// `data` is null or points to `len` initialised values that live for `'a`.
pub(crate) unsafe fn borrow_array<'a, T>(data: *const T, len: usize) -> &'a [T] {
    let bytes = len.checked_mul(size_of::<T>()).and_then(|bytes| isize::try_from(bytes).ok());
    if data.is_null() || !data.is_aligned() || bytes.is_none() {
        return &[];
    }
    // SAFETY: as the caller promises; what can be checked was.
    unsafe { std::slice::from_raw_parts(data, len) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_and_lengths_that_no_array_has_give_empty_ones() {
        let values = [1.0, 2.0];
        let (start, null) = (values.as_ptr(), std::ptr::null());
        let odd = start.wrapping_byte_add(1);
        for (data, len) in [(null, 0), (null, 2), (odd, 1), (start, usize::MAX), (start, 1 << 60)] {
            assert_eq!(unsafe { borrow_array::<f64>(data, len) }, &[] as &[f64]);
        }
        assert_eq!(unsafe { borrow_array(start, 2) }, values);
    }

    #[test]
    fn texts_are_read_as_they_are_or_with_replacements() {
        let broken = b"w\xf6rd";
        let broken = Text { data: broken.as_ptr(), len: broken.len() };
        unsafe {
            assert_eq!(Text::new("wörd").to_utf8(), Some("wörd"));
            assert_eq!((broken.to_utf8(), &*broken.to_str_lossy()), (None, "w\u{fffd}rd"));
            assert_eq!(Text { data: std::ptr::null(), len: 3 }.to_utf8(), Some(""));
        }
    }
}
