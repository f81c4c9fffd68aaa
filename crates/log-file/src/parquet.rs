//! Reads Parquet files: the fields of their rows.

use std::fs::File;
use std::path::Path;

use ::parquet::arrow::ProjectionMask;
use ::parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};

use crate::arrays::SchemaChannels;
use crate::{CHUNK_ROWS, ChunkCallback, Error, LogChannel, LogClock, LogReader};

/// Whether a file begins like this.
pub fn is_parquet(head: &[u8]) -> bool {
    head.starts_with(b"PAR1")
}

/// A Parquet file.
pub struct ParquetLog {
    file: File,
    metadata: ArrowReaderMetadata,
    fields: SchemaChannels,
}

impl ParquetLog {
    /// Reads the schema.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let file = File::open(path)?;
        let metadata = catch_panics(|| ArrowReaderMetadata::load(&file, ArrowReaderOptions::new()))?;
        let rows = metadata.metadata().file_metadata().num_rows();
        let fields = SchemaChannels::new(metadata.schema(), rows.try_into().ok());
        Ok(ParquetLog { file, metadata, fields })
    }
}

fn catch_panics<T, E: std::fmt::Display>(work: impl FnOnce() -> Result<T, E>) -> Result<T, Error> {
    crate::panic_guard::catch_panics("Parquet", work)
}

impl LogReader for ParquetLog {
    fn channels(&self) -> &[LogChannel] {
        &self.fields.channels
    }

    fn clocks(&self) -> &[LogClock] {
        &self.fields.clocks
    }

    fn read_chunks(&mut self, _clock: usize, wanted: &[usize], take: ChunkCallback) -> Result<(), Error> {
        let ParquetLog { file, metadata, fields } = self;
        let mut places: Vec<usize> = wanted.iter().map(|it| fields.places[*it]).collect();
        let columns = crate::arrow::sort_unique_with_ranks(&mut places);
        let file = file.try_clone()?;
        let mut reader = catch_panics(|| {
            let builder = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata.clone());
            let mask = ProjectionMask::roots(builder.parquet_schema(), places.iter().copied());
            builder.with_projection(mask).with_batch_size(CHUNK_ROWS).build()
        })?;
        while let Some(batch) = catch_panics(|| reader.next().transpose())? {
            if !SchemaChannels::emit_batch(&batch, &columns, take) {
                break;
            }
        }
        Ok(())
    }

    fn skipped_contents(&self) -> Vec<String> {
        self.fields.left_out.clone()
    }

    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }
}
