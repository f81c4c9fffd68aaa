//! Reads tables from Parquet, whole or a row group of them.

use std::fs::File;
use std::path::{Path, PathBuf};

use diagnostics::{Error, catch_panics};
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};

use super::checksum::{self, RowChecksum};
use super::{SweepTable, arrow};

/// An open file of a table.
#[derive(Debug)]
pub struct SweepTableReader {
    path: PathBuf,
    file: File,
    metadata: ArrowReaderMetadata,
    columns: SweepTable,
}

/// Reads a whole file.
///
/// # Errors
/// When it cannot be read, is damaged, or holds no table of a sweep; the error names it.
pub fn read_table(path: &Path) -> Result<SweepTable, Error> {
    SweepTableReader::open(path)?.read_all_rows()
}

impl SweepTableReader {
    /// Opens a file and reads what it says about its columns.
    ///
    /// # Errors
    /// As [`read_table`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(|error| unreadable_file_error(path, &error.to_string()))?;
        let metadata = panic_to_error(|| {
            ArrowReaderMetadata::load(&file, ArrowReaderOptions::new()).map_err(|error| error.to_string())
        })
        .map_err(|what| unreadable_file_error(path, &what))?;
        let columns =
            arrow::columns_of_schema(metadata.schema()).map_err(|what| unreadable_file_error(path, &what))?;
        columns.check_columns().map_err(|what| unreadable_file_error(path, &what))?;
        Ok(Self { path: path.to_owned(), file, metadata, columns })
    }

    /// How many row groups it has.
    #[must_use]
    pub fn row_group_count(&self) -> usize {
        self.metadata.metadata().num_row_groups()
    }

    /// How many rows it has.
    #[must_use]
    pub fn row_count(&self) -> usize {
        let rows = self.metadata.metadata().file_metadata().num_rows();
        usize::try_from(rows).unwrap_or_default()
    }

    /// Its columns without their rows.
    #[must_use]
    pub fn columns(&self) -> &SweepTable {
        &self.columns
    }

    /// The rows of one group, from 0.
    ///
    /// # Errors
    /// When there is no such group, or as [`read_table`].
    pub fn read_row_group(&self, index: usize) -> Result<SweepTable, Error> {
        if index >= self.row_group_count() {
            let what = format!("expected more than {index} row groups, found {}", self.row_group_count());
            return Err(unreadable_file_error(&self.path, &what));
        }
        self.read_row_groups(vec![index])
    }

    /// All rows.
    ///
    /// # Errors
    /// As [`read_table`].
    pub fn read_all_rows(&self) -> Result<SweepTable, Error> {
        self.read_row_groups((0..self.row_group_count()).collect())
    }

    /// Compares all rows with the checksum that the file got when it was written.
    ///
    /// # Errors
    /// When it has none, or the rows are others; the error names the file.
    pub fn check_rows(&self, table: &SweepTable) -> Result<(), Error> {
        let metadata = self.metadata.metadata().file_metadata().key_value_metadata();
        let entry = metadata.into_iter().flatten().find(|entry| entry.key == checksum::KEY);
        let written = entry.and_then(|entry| entry.value.as_deref());
        let mut found = RowChecksum::new(&self.columns);
        found.add_rows(table);
        let found = found.finish();
        let what = match written {
            Some(written) if written == found => return Ok(()),
            Some(written) => format!("expected rows with the checksum {written}, found {found}"),
            None => format!("expected the checksum of its rows as `{}`, found none", checksum::KEY),
        };
        Err(unreadable_file_error(&self.path, &what))
    }

    fn read_row_groups(&self, groups: Vec<usize>) -> Result<SweepTable, Error> {
        let table = panic_to_error(|| {
            let file = self.file.try_clone().map_err(|error| error.to_string())?;
            let metadata = self.metadata.clone();
            let batches = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata)
                .with_row_groups(groups)
                .build()
                .map_err(|error| error.to_string())?;
            let mut table = self.columns.clone();
            for batch in batches {
                let batch = batch.map_err(|error| error.to_string())?;
                arrow::append_record_batch(&mut table, &batch)?;
            }
            Ok(table)
        });
        table.map_err(|what| unreadable_file_error(&self.path, &what))
    }
}

/// The library panics on some damaged pages, which is a mistake of the file and none of the program.
fn panic_to_error<T>(read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_panics(read).unwrap_or_else(|| Err("a page of it is damaged".to_owned()))
}

fn unreadable_file_error(path: &Path, what: &str) -> Error {
    let message =
        format!("{}: expected a table of a sweep in Parquet that can be read: {what}", path.display());
    Error::invalid_input(message).with_help("delete the file and run what writes it again")
}
