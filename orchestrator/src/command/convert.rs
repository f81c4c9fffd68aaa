//! `trackside convert`: writes the signals of a recording as a table, Parquet or CSV, as MDF 4, or for MoTeC i2.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::Error;
use recording::{CsvSink, LdSink, MdfSink, ParquetSink, Recording, Sink, SinkNotice};

use super::{print_text, print_to_stderr};

/// Arguments of `trackside convert`.
#[derive(Args)]
pub struct ConvertArguments {
    /// The folder of the run, or its run.mcap.
    run: PathBuf,
    /// The new file; its ending, `.parquet`, `.csv`, `.mf4` or `.ld`, says which form it gets [default: run.parquet beside the recording].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Writes the table, and prints its path.
///
/// # Errors
/// When the recording cannot be read, the ending is another one, or the table cannot be written.
pub fn run_convert_command(arguments: &ConvertArguments) -> Result<u8, Error> {
    let recording = Recording::open(&arguments.run)?;
    let beside = || recording.header.folder.join("run.parquet");
    let out = arguments.out.clone().unwrap_or_else(beside);
    let mut sink = open_sink_for_extension(&recording, &out)?;
    recording.replay_into(&mut *sink)?;
    sink.finish("", true)?;
    for notice in sink.take_notices() {
        if let SinkNotice::Warning(text) = notice {
            print_to_stderr(&format!("note: {text}"));
        }
    }
    if recording.cut {
        let path = recording.path().display();
        print_to_stderr(&format!("note: {path} was cut off; the table ends where it does"));
    }
    print_text(&format!("{}\n", out.display()));
    Ok(0)
}

/// The table that the ending of its name asks for.
fn open_sink_for_extension(recording: &Recording, out: &Path) -> Result<Box<dyn Sink>, Error> {
    let header = &recording.header;
    let ending = out.extension().map(|it| it.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("parquet") => Ok(Box::new(ParquetSink::create(header, out)?)),
        Some("csv") => Ok(Box::new(CsvSink::create(header, out)?)),
        Some("mf4") => Ok(Box::new(MdfSink::create(header, out)?)),
        Some("ld") => Ok(Box::new(LdSink::create(header, out)?)),
        _ => Err(Error::invalid_input(format!(
            "--out: expected a file that ends in .parquet, .csv, .mf4 or .ld, found {}",
            out.display()
        ))),
    }
}
