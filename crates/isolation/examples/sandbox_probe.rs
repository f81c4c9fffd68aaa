//! Prints what a process tried in the sandbox, what of that succeeded, and what this machine lacks: `sandbox_probe [user number]`.

#[path = "../tests/support/probe.rs"]
mod probe;

fn main() -> std::io::Result<()> {
    let mut words = std::env::args().skip(1);
    let word = words.next();
    if word.as_deref() == Some(probe::PROBE) {
        probe::serve_as_probe(words);
        return Ok(());
    }
    let user = word.and_then(|word| word.parse().ok());
    let probe::ProbeReport { missing, attempts, changes } = probe::run_probe(user)?;
    for attempt in &attempts {
        println!("{:9}  {}", if attempt.succeeded { "SUCCEEDED" } else { "refused" }, attempt.name);
    }
    missing.iter().for_each(|it| println!("missing: {it}"));
    changes.iter().for_each(|it| println!("changed: {it}"));
    let succeeded = attempts.iter().filter(|it| it.succeeded).count();
    println!("{} attempts, {succeeded} succeeded", attempts.len());
    Ok(())
}
