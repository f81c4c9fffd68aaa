//! Ends a run together with the `trackside test` that started it.

use std::fs::File;
use std::io::{BufRead as _, BufReader, ErrorKind, Read as _};

use diagnostics::Error;
use orchestrator::suite::orphans;
use rustix::process::{Signal, getpgrp, getpid, kill_process_group};

/// The first descriptor that is no standard one.
const BESIDES: i32 = 3;

/// Reads the identity of the run from standard input, and from then on ends the group of this process when that closes. Foreign code
/// gets an empty input.
///
/// # Errors
/// When this process does not lead a group, or the input does not begin with a line.
pub fn read_identity_and_watch_stdin() -> Result<String, Error> {
    let wrong = |what: String| Error::invalid_input(format!("--supervised is for `trackside test`: {what}"));
    if getpgrp() != getpid() {
        return Err(wrong("this process does not lead a group of processes".to_owned()));
    }
    let system = |error: std::io::Error| wrong(error.to_string());
    let stdin = rustix::io::fcntl_dupfd_cloexec(rustix::stdio::stdin(), BESIDES)
        .map_err(|error| system(error.into()))?;
    let null = File::open("/dev/null").map_err(system)?;
    rustix::stdio::dup2_stdin(&null).map_err(|error| system(error.into()))?;
    let mut input = BufReader::new(File::from(stdin));
    let mut identity = String::new();
    input.read_line(&mut identity).map_err(system)?;
    if !identity.ends_with('\n') {
        return Err(wrong("standard input does not begin with a line".to_owned()));
    }
    orphans::become_subreaper();
    let thread = std::thread::Builder::new().name("supervised".to_owned());
    thread.spawn(move || end_group_at_eof(input)).map_err(system)?;
    Ok(identity.trim_end().to_owned())
}

fn end_group_at_eof(mut input: BufReader<File>) {
    let mut byte = [0];
    loop {
        match input.read(&mut byte) {
            Ok(1..) => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Ok(0) | Err(_) => {
                // First what has left the group.
                orphans::kill_descendant_processes();
                let _ = kill_process_group(getpgrp(), Signal::KILL);
            }
        }
    }
}
