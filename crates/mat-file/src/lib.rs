//! Reads MAT files: bytes go in; named real arrays and texts come out, with structs made flat (`data.FX`, `channel(2).name`).
//!
//! Versions 5 (`save -v6` and `-v7`) and 4 (`save -v4`) of either byte order are read, as MathWorks describe them in "MAT-File Format",
//! and version 7.3, which is HDF5, and plain HDF5 with `hdf5-pure`. What is neither numbers nor text, such as function handles, is listed in
//! [`MatFile::skipped`] with the reason. Hostile files end in an [`Error`]: all sizes are held against the bytes that are there,
//! unpacked ones against [`LIMIT`].
//!
//! ```
//! let mut file = Vec::new();
//! // Version 4: type, rows, columns, no imaginary part, length of the name; the name; the numbers.
//! for number in [0i32, 1, 2, 0, 2] {
//!     file.extend(number.to_le_bytes());
//! }
//! file.extend(b"v\0");
//! file.extend([1.5f64, 2.5].iter().flat_map(|it| it.to_le_bytes()));
//! let found = mat_file::read_mat_file(&file)?;
//! let speed = found.numeric_array("v").expect("numbers");
//! assert_eq!((&speed.shape[..], &speed.values[..]), (&[1, 2][..], &[1.5, 2.5][..]));
//! # Ok::<(), mat_file::Error>(())
//! ```
#![forbid(unsafe_code)]

mod bytes;
mod cell;
mod version4;
mod version5;
mod version73;

use std::fmt;

/// The most bytes that a file may hold when it is unpacked, and the most bytes of its numbers as doubles [B].
pub const LIMIT: usize = 1 << 30;

/// Why a sparse matrix is left out.
const SPARSE: &str = "a sparse matrix: write it with full()";

/// Why an object is left out.
const OBJECT: &str =
    "an object, such as a string, table or timetable: write plain arrays, cells of characters, structs";

/// What a file holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MatFile {
    /// Numbers and texts in the order of the file. Fields of structs have the path to them as name.
    pub variables: Vec<MatVariable>,
    /// Names of what was left out, each with the reason.
    pub skipped: Vec<(String, String)>,
}

/// A variable, or a field of a struct.
#[derive(Clone, Debug, PartialEq)]
pub struct MatVariable {
    /// Its name: `FX`, `data.FX`, `run(2).FX` (elements from 1 on), `names{2}` for a cell that does not hold texts alone.
    pub name: String,
    /// What it holds.
    pub value: MatValue,
}

/// What a variable holds.
#[derive(Clone, Debug, PartialEq)]
pub enum MatValue {
    /// Real numbers of any class; logical ones are 0 and 1. Integers above 2^53 are rounded.
    Numbers(NumericArray),
    /// Rows of characters, without spaces at their ends; or the texts of a cell.
    Texts(Vec<String>),
}

/// An array of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct NumericArray {
    /// Length along each dimension, at least two.
    pub shape: Vec<usize>,
    /// Column after column.
    pub values: Vec<f64>,
}

impl NumericArray {
    /// Whether it is one row, one column, or one number.
    #[must_use]
    pub fn is_vector(&self) -> bool {
        self.shape.iter().filter(|length| **length != 1).count() <= 1
    }
}

impl MatFile {
    /// What a name stands for.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&MatValue> {
        self.variables.iter().find(|it| it.name == name).map(|it| &it.value)
    }

    /// The numbers of a name.
    #[must_use]
    pub fn numeric_array(&self, name: &str) -> Option<&NumericArray> {
        match self.get(name)? {
            MatValue::Numbers(array) => Some(array),
            MatValue::Texts(_) => None,
        }
    }

    /// The texts of a name.
    #[must_use]
    pub fn text_rows(&self, name: &str) -> Option<&[String]> {
        match self.get(name)? {
            MatValue::Texts(texts) => Some(texts),
            MatValue::Numbers(_) => None,
        }
    }
}

/// Why a file cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// The byte where it goes wrong, from 0; in packed parts that of the unpacked part. HDF5 has none.
    pub at: Option<usize>,
    /// What was expected, what was found, what to do.
    pub text: String,
}

impl Error {
    fn new(at: usize, text: impl Into<String>) -> Self {
        Self { at: Some(at), text: text.into() }
    }

    fn without_offset(text: impl Into<String>) -> Self {
        Self { at: None, text: text.into() }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.at {
            Some(at) => write!(f, "byte {at}: {}", self.text),
            None => f.write_str(&self.text),
        }
    }
}

impl std::error::Error for Error {}

/// Whether the bytes begin as a MAT file of any version does, or as HDF5.
#[must_use]
pub fn is_mat(bytes: &[u8]) -> bool {
    is_hdf5(bytes)
        || bytes.starts_with(b"MATLAB ")
        || version5::header_byte_order(bytes).is_some()
        || version4::is_version4(bytes)
}

fn is_hdf5(bytes: &[u8]) -> bool {
    const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
    // MATLAB puts 512 bytes of its own before it.
    [0, 512].iter().any(|at| bytes.get(*at..).is_some_and(|it| it.starts_with(SIGNATURE)))
}

/// Reads a file.
///
/// # Errors
/// When it is no MAT file, ends early, states sizes that its bytes do not hold, or needs more than [`LIMIT`].
pub fn read_mat_file(bytes: &[u8]) -> Result<MatFile, Error> {
    if is_hdf5(bytes) {
        return version73::read_version73(bytes);
    }
    if bytes.starts_with(b"MATLAB 7.3") {
        let what =
            "expected HDF5 in a MAT file of version 7.3, found its head alone: was the file copied whole?";
        return Err(Error::new(512, what));
    }
    if let Some(order) = version5::header_byte_order(bytes) {
        return version5::read_version5(bytes, order);
    }
    if version4::is_version4(bytes) {
        return version4::read_version4(bytes);
    }
    Err(Error::new(
        0,
        "expected a MAT file (`MATLAB 5.0 MAT-file` and `IM` or `MI` at byte 126, or HDF5), found something else",
    ))
}
