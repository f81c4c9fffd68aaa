//! Writes tables as Parquet: under another name first, so that a file is there whole or not at all.

use std::fs::{File, Permissions};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};

use diagnostics::Error;
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use tempfile::NamedTempFile;

use super::checksum::{self, RowChecksum};
use super::{SweepTable, arrow};

/// Rows of a group in files that are written evenly: with 30 columns 16 MB of numbers.
const EVEN: usize = 65_536;
/// Of anybody, less what the user's mask takes away, as of other files.
const MODE: u32 = 0o666;

/// What becomes a row group.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum RowGroups {
    /// Each table that is appended: the file of a plan, read group by group.
    Tables,
    /// 65,536 rows, however they came: the same rows give the same bytes, and there are never more of them in memory.
    Even,
}

/// A file in the making. It appears under its name when it is finished; nothing is left of one that is dropped.
pub struct SweepTableWriter {
    path: PathBuf,
    groups: RowGroups,
    writer: ArrowWriter<NamedTempFile>,
    schema: std::sync::Arc<arrow_schema::Schema>,
    /// Rows that are in no group yet.
    waiting: SweepTable,
    checksum: RowChecksum,
}

/// Writes a file of one table. The same table gives the same bytes.
///
/// # Errors
/// When the columns do not fit together, or the file cannot be written.
pub fn write_table(path: &Path, table: &SweepTable) -> Result<(), Error> {
    let mut writer = SweepTableWriter::create(path, table, RowGroups::Even)?;
    writer.append(table)?;
    writer.finish()
}

impl SweepTableWriter {
    /// Begins a file with the columns of a table, whose rows are not taken.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn create(path: &Path, columns: &SweepTable, groups: RowGroups) -> Result<Self, Error> {
        let failed = |what: String| Error::output_failure(path, what);
        let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
        let name = path.file_name().unwrap_or_default();
        let mut prefix = std::ffi::OsString::from(".");
        prefix.push(name);
        let file = tempfile::Builder::new()
            .prefix(&prefix)
            .suffix(".part")
            .permissions(Permissions::from_mode(MODE))
            .tempfile_in(folder.unwrap_or(Path::new(".")))
            .map_err(|error| failed(error.to_string()))?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_max_row_group_row_count(None)
            .build();
        let waiting = columns.without_rows();
        let schema = arrow::table_schema(&waiting);
        let writer = ArrowWriter::try_new(file, schema.clone(), Some(properties))
            .map_err(|error| failed(error.to_string()))?;
        let checksum = RowChecksum::new(&waiting);
        Ok(Self { path: path.to_owned(), groups, writer, schema, waiting, checksum })
    }

    /// Takes the rows of a table.
    ///
    /// # Errors
    /// When its columns are others, or the file cannot be written.
    pub fn append(&mut self, table: &SweepTable) -> Result<(), Error> {
        self.waiting.append_rows(table).map_err(|what| Error::output_failure(&self.path, what))?;
        self.checksum.add_rows(table);
        match self.groups {
            RowGroups::Tables => self.write_row_group(usize::MAX),
            RowGroups::Even => {
                while self.waiting.row_count() >= EVEN {
                    self.write_row_group(EVEN)?;
                }
                Ok(())
            }
        }
    }

    /// Writes what is left, waits until all is on the disk, and gives the file its name.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn finish(mut self) -> Result<(), Error> {
        if self.waiting.row_count() > 0 {
            self.write_row_group(usize::MAX)?;
        }
        let checksum = KeyValue::new(checksum::KEY.to_owned(), self.checksum.finish());
        self.writer.append_key_value_metadata(checksum);
        let path = self.path;
        let failed = |what: String| Error::output_failure(&path, what);
        let file = self.writer.into_inner().map_err(|error| failed(error.to_string()))?;
        file.as_file().sync_all().map_err(|error| failed(error.to_string()))?;
        file.persist(&path).map_err(|error| failed(error.to_string()))?;
        // The name is on the disk when the folder is.
        let folder = path.parent().filter(|it| !it.as_os_str().is_empty());
        let folder = File::open(folder.unwrap_or(Path::new(".")));
        folder.and_then(|it| it.sync_all()).map_err(|error| failed(error.to_string()))
    }

    fn write_row_group(&mut self, rows: usize) -> Result<(), Error> {
        let failed = |what: String| Error::output_failure(&self.path, what);
        let front = self.waiting.split_front(rows);
        let batch = arrow::table_to_record_batch(&front, &self.schema).map_err(failed)?;
        self.writer
            .write(&batch)
            .and_then(|()| self.writer.flush())
            .map_err(|error| Error::output_failure(&self.path, error))
    }
}
