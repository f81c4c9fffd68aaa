//! `trackside recover`: makes a valid recording of one that a killed run left.

use std::path::PathBuf;

use clap::Args;
use diagnostics::Error;

use super::print;

/// Arguments of `trackside recover`.
#[derive(Args)]
pub struct Arguments {
    /// The recording that was not finished.
    broken: PathBuf,
    /// The new file [default: BROKEN with `.recovered.mcap`].
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Writes the new recording, and prints how much of the broken one is in it.
///
/// # Errors
/// When the broken recording cannot be read, or the new one not be written.
pub fn run(arguments: &Arguments) -> Result<u8, Error> {
    let broken = &arguments.broken;
    let into = arguments.out.clone();
    let into = into.unwrap_or_else(|| broken.with_extension("recovered.mcap"));
    if into == *broken {
        return Err(Error::input("--out: expected another file than the broken one"));
    }
    let found = recording::recover::recover(broken, &into)?;
    let (messages, channels, seconds) = (found.messages, found.channels, found.seconds);
    let end = match found.lost {
        Some(reason) => format!("up to where it is broken: {reason}"),
        None => "it was complete".to_owned(),
    };
    print(&format!(
        "{}: {messages} messages of {channels} channels, {seconds:.3} s, {end}\n",
        into.display()
    ));
    Ok(0)
}
