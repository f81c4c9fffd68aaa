//! Reads tables from Parquet, whole or a row group of them.

use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use diagnostics::Error;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};

use super::{Table, arrow};

/// An open file of a table.
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    file: File,
    metadata: ArrowReaderMetadata,
    columns: Table,
}

/// Reads a whole file.
///
/// # Errors
/// When it cannot be read, is damaged, or holds no table of a sweep; the error names it.
pub fn read(path: &Path) -> Result<Table, Error> {
    Reader::open(path)?.all()
}

impl Reader {
    /// Opens a file and reads what it says about its columns.
    ///
    /// # Errors
    /// As [`read`].
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = File::open(path).map_err(|error| unreadable(path, &error.to_string()))?;
        let metadata = catch_panic(|| {
            ArrowReaderMetadata::load(&file, ArrowReaderOptions::new())
                .map_err(|error| error.to_string())
        })
        .map_err(|what| unreadable(path, &what))?;
        let columns = arrow::columns(metadata.schema()).map_err(|what| unreadable(path, &what))?;
        columns.check_columns().map_err(|what| unreadable(path, &what))?;
        Ok(Self { path: path.to_owned(), file, metadata, columns })
    }

    /// How many row groups it has.
    #[must_use]
    pub fn groups(&self) -> usize {
        self.metadata.metadata().num_row_groups()
    }

    /// How many rows it has.
    #[must_use]
    pub fn rows(&self) -> usize {
        let rows = self.metadata.metadata().file_metadata().num_rows();
        usize::try_from(rows).unwrap_or_default()
    }

    /// Its columns without their rows.
    #[must_use]
    pub fn columns(&self) -> &Table {
        &self.columns
    }

    /// The rows of one group, from 0.
    ///
    /// # Errors
    /// When there is no such group, or as [`read`].
    pub fn group(&self, index: usize) -> Result<Table, Error> {
        if index >= self.groups() {
            let what = format!("expected more than {index} row groups, found {}", self.groups());
            return Err(unreadable(&self.path, &what));
        }
        self.rows_of(vec![index])
    }

    /// All rows.
    ///
    /// # Errors
    /// As [`read`].
    pub fn all(&self) -> Result<Table, Error> {
        self.rows_of((0..self.groups()).collect())
    }

    fn rows_of(&self, groups: Vec<usize>) -> Result<Table, Error> {
        let table = catch_panic(|| {
            let file = self.file.try_clone().map_err(|error| error.to_string())?;
            let metadata = self.metadata.clone();
            let batches = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata)
                .with_row_groups(groups)
                .build()
                .map_err(|error| error.to_string())?;
            let mut table = self.columns.clone();
            for batch in batches {
                let batch = batch.map_err(|error| error.to_string())?;
                arrow::extend(&mut table, &batch)?;
            }
            Ok(table)
        });
        table.map_err(|what| unreadable(&self.path, &what))
    }
}

/// The library panics on some damaged pages, which is a mistake of the file and none of the program.
fn catch_panic<T>(read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let panicked = |_| Err("a page of it is damaged".to_owned());
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(panicked)
}

fn unreadable(path: &Path, what: &str) -> Error {
    let message = format!(
        "{}: expected a table of a sweep in Parquet that can be read: {what}",
        path.display()
    );
    Error::input(message).help("delete the file and run what writes it again")
}
