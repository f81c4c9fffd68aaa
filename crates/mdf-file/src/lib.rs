//! Reads measurement files of ASAM MDF 2, 3 and 4 (`.dat`, `.mdf`, `.mf4`), and writes those of MDF 4.
//!
//! A [`MdfFile`] has channels over clocks: what is sampled together has one clock, with a time, an angle or a distance as master. Values come
//! converted to what they mean ([`ChannelValueKind`]), a stretch of rows at a time ([`MdfFile::visit_rows`]) or all at once ([`MdfFile::read_columns`]). Plain and packed
//! data (deflate, transposed or not), lists of blocks, columns of their own (4.2), mixed groups, invalidation bits, texts of any
//! length, structures, arrays and all conversions are read, and the same
//! of MDF 2 and 3 as far as these have it. What is left out, such as pictures, is in [`MdfFile::warnings`] with the reason.
//!
//! Memory is bound by a block of the file and by what is wanted, whatever the size of the file; texts in mixed groups take 16 bytes each
//! as well. Damaged files end in an [`Error`]: all lengths are held against the bytes that are there.
//!
//! ```
//! use mdf_file::{ChannelValues, MdfCell, MdfColumn, MdfColumnType, MdfDescription, MdfFile, MdfWriter};
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("drive.mf4");
//! let speed = MdfColumn { name: "speed".into(), unit: Some("m/s".into()), comment: None, kind: MdfColumnType::Real };
//! let mut writer = MdfWriter::create(&path, &MdfDescription::default(), &[speed])?;
//! writer.write_row(0.0, &[MdfCell::Real(12.5)])?;
//! writer.write_row(0.1, &[MdfCell::Real(12.6)])?;
//! writer.finish()?;
//!
//! let mut file = MdfFile::open(&path)?;
//! assert_eq!(file.channels()[1].unit.as_deref(), Some("m/s"));
//! let read = file.read_columns(&[1])?;
//! assert_eq!(read[0].times, [0.0, 0.1]);
//! assert_eq!(read[0].values, [ChannelValues::Numbers(vec![12.5, 12.6])]);
//! # Ok::<(), mdf_file::Error>(())
//! ```
#![forbid(unsafe_code)]

mod bytes;
mod channels;
mod column;
mod conversion;
mod conversions;
mod cursor;
mod error;
mod field;
mod file;
mod formula;
mod head;
mod identification;
mod layout;
mod mdf3;
mod stream;
mod structure;
mod text;
mod values;
mod writer;

pub use column::{MdfCell, MdfColumn, MdfColumnType, MdfDescription};
pub use error::Error;
pub use file::{ClockColumns, MdfFile, STRETCH};
pub use identification::is_mdf;
pub use layout::{ChannelValueKind, MasterAxis, MdfChannel, MdfClock, StartTime};
pub use values::ChannelValues;
pub use writer::MdfWriter;
