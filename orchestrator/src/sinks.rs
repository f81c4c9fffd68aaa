//! The list of recording formats: a new one is a line here.

use diagnostics::Error;
use recording::{
    BoxedSink, CsvSink, LdSink, McapSink, MdfSink, ParquetSink, RunHeader, SinkFactory, ThreadedSink,
};

use crate::options::{ReplayOutput, RunOptions};

/// All ways to record a run. None of them makes a run wait for a compression or a drawing: MCAP has a thread of its own, as it also
/// keeps what a killed run would lose.
pub(crate) const SINKS: &[SinkFactory<RunOptions>] = &[
    SinkFactory { files: McapSink::FILES, open: |run, _| Ok(Some(Box::new(McapSink::new(run)?))) },
    SinkFactory { files: CsvSink::FILES, open: open_csv_sink },
    SinkFactory { files: ParquetSink::FILES, open: open_parquet_sink },
    SinkFactory { files: MdfSink::FILES, open: open_mdf_sink },
    SinkFactory { files: LdSink::FILES, open: open_motec_sink },
    SinkFactory { files: &["run.rrd"], open: open_rerun_sink },
];

fn boxed_threaded_sink(sink: impl recording::Sink + Send + 'static) -> BoxedSink {
    Box::new(ThreadedSink::new(Box::new(sink)))
}

fn open_csv_sink(run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    Ok(if options.csv { Some(boxed_threaded_sink(CsvSink::new(run)?)) } else { None })
}

fn open_parquet_sink(run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    Ok(if options.parquet { Some(boxed_threaded_sink(ParquetSink::new(run)?)) } else { None })
}

fn open_mdf_sink(run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    Ok(if options.mf4 { Some(boxed_threaded_sink(MdfSink::new(run)?)) } else { None })
}

fn open_motec_sink(run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    Ok(if options.ld { Some(boxed_threaded_sink(LdSink::new(run)?)) } else { None })
}

#[cfg(feature = "rerun")]
fn open_rerun_sink(run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    use ::replay::{RecordingTarget, RerunSink};
    let target = match &options.replay {
        ReplayOutput::Save => RecordingTarget::File(run.folder.join("run.rrd")),
        ReplayOutput::Connect(url) => RecordingTarget::Connect(url.clone()),
        ReplayOutput::Serve(address) => RecordingTarget::Serve(*address),
        ReplayOutput::Off => return Ok(None),
    };
    Ok(Some(boxed_threaded_sink(RerunSink::new(run, target)?)))
}

#[cfg(not(feature = "rerun"))]
fn open_rerun_sink(_run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    match options.replay {
        ReplayOutput::Save | ReplayOutput::Off => Ok(None),
        ReplayOutput::Connect(_) | ReplayOutput::Serve(_) => {
            Err(Error::invalid_input("this program was built without the feature `rerun`"))
        }
    }
}

#[cfg(test)]
mod tests {
    use scenario::plan::is_reserved;

    use super::SINKS;

    #[test]
    fn recordings_have_names_that_nothing_else_in_the_folder_can_have() {
        assert!(SINKS.iter().flat_map(|kind| kind.files).all(|file| is_reserved(file)));
    }
}
