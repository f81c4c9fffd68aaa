//! `trackside recover`: repairs the recording of a killed run, or a damaged one.

use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::Error;

use super::print_text;

/// Arguments of `trackside recover`.
#[derive(Args)]
pub struct RecoverArguments {
    /// The recording that was not finished.
    broken: PathBuf,
    /// The new file [default: BROKEN with `.recovered.mcap`].
    #[arg(long)]
    out: Option<PathBuf>,
    /// Take records without a checksum, too, right or wrong.
    #[arg(long)]
    unchecked: bool,
}

/// Writes the new recording, and prints how much of the broken one is in it.
///
/// # Errors
/// When the broken recording cannot be read, or the new one not be written.
pub fn run_recover_command(arguments: &RecoverArguments) -> Result<u8, Error> {
    let broken = &arguments.broken;
    let into = arguments.out.clone();
    let into = into.unwrap_or_else(|| broken.with_extension("recovered.mcap"));
    let same = |a: &Path, b: &Path| a.canonicalize().ok().is_some_and(|a| b.canonicalize().ok() == Some(a));
    if into == *broken || same(&into, broken) {
        return Err(Error::invalid_input("--out: expected another file than the broken one"));
    }
    let found = recording::recover::recover_recording(broken, &into, arguments.unchecked)?;
    let of = found.of.filter(|of| *of != found.messages);
    let of = of.map(|of| format!(" of {of}")).unwrap_or_default();
    let (messages, channels, seconds) = (found.messages, found.channels, found.seconds);
    let end = match (found.is_complete(), found.index) {
        (true, false) => "it was complete",
        (true, true) => "all that it held; its index was broken and is new",
        _ => "what is broken is left out:",
    };
    let mut text = format!(
        "{}: {messages}{of} messages of {channels} channels, {seconds:.3} s, {end}\n",
        into.display()
    );
    for line in found.loss_descriptions() {
        text += &format!("  {line}\n");
    }
    if found.unverified > 0 {
        text += "  `--unchecked` takes what has no checksum, right or wrong\n";
    }
    print_text(&text);
    Ok(0)
}
