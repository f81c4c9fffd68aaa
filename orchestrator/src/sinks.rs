//! The list of recording formats: a new one is a line here.

use diagnostics::Error;
use recording::{
    BoxedSink, CsvSink, LdSink, McapSink, MdfSink, ParquetSink, RunHeader, SinkKind, ThreadedSink,
};

use crate::options::{Replay, RunOptions};

/// All ways to record a run. None of them makes a run wait for a compression or a drawing: MCAP has a thread of its own, as it also
/// keeps what a killed run would lose.
pub(crate) const SINKS: &[SinkKind<RunOptions>] = &[
    SinkKind { files: McapSink::FILES, open: |run, _| Ok(Some(Box::new(McapSink::new(run)?))) },
    SinkKind { files: CsvSink::FILES, open: csv },
    SinkKind { files: ParquetSink::FILES, open: parquet },
    SinkKind { files: MdfSink::FILES, open: mdf },
    SinkKind { files: LdSink::FILES, open: ld },
    SinkKind { files: &["run.rrd"], open: replay },
];

fn threaded(sink: impl recording::Sink + Send + 'static) -> BoxedSink {
    Box::new(ThreadedSink::new(Box::new(sink)))
}

fn csv(run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    Ok(if options.csv { Some(threaded(CsvSink::new(run)?)) } else { None })
}

fn parquet(run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    Ok(if options.parquet { Some(threaded(ParquetSink::new(run)?)) } else { None })
}

fn mdf(run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    Ok(if options.mf4 { Some(threaded(MdfSink::new(run)?)) } else { None })
}

fn ld(run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    Ok(if options.ld { Some(threaded(LdSink::new(run)?)) } else { None })
}

#[cfg(feature = "rerun")]
fn replay(run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    use ::replay::{RerunSink, Target};
    let target = match &options.replay {
        Replay::Save => Target::File(run.folder.join("run.rrd")),
        Replay::Connect(url) => Target::Connect(url.clone()),
        Replay::Serve(address) => Target::Serve(*address),
        Replay::Off => return Ok(None),
    };
    Ok(Some(threaded(RerunSink::new(run, target)?)))
}

#[cfg(not(feature = "rerun"))]
fn replay(_run: &RunHeader, options: &RunOptions) -> Result<Option<BoxedSink>, Error> {
    match options.replay {
        Replay::Save | Replay::Off => Ok(None),
        Replay::Connect(_) | Replay::Serve(_) => {
            Err(Error::input("this program was built without the feature `rerun`"))
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
