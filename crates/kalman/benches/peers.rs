//! Measures an iteration of EM against the same in NumPy, numba and Octave, in turns on the same recording.
//!
//! `cargo bench -p kalman --bench peers`; `PYTHON` names a Python that has NumPy (and numba).

mod problem;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use kalman::EmSettings;

const STEPS: usize = 10_000;
const ROUNDS: usize = 5;

/// Rows of F, b, H (row by row) and y as numbers of the machine.
fn write(steps: &problem::Recording, path: &Path) -> std::io::Result<()> {
    let row = |step: &kalman::LinearStep<6, 4>| {
        let mut row: Vec<f64> = step.F.transpose().as_slice().to_vec();
        row.extend(step.b.as_slice());
        row.extend(step.H.transpose().as_slice());
        row.extend(step.y.as_slice());
        row
    };
    let bytes: Vec<u8> = steps.iter().flat_map(row).flat_map(f64::to_ne_bytes).collect();
    std::fs::write(path, bytes)
}

/// Seconds and log-likelihood of an iteration that another program says.
fn ask(program: &str, arguments: &[&str]) -> Result<[f64; 2], Box<dyn Error>> {
    let done = Command::new(program).args(arguments).env("OMP_NUM_THREADS", "1").output()?;
    if !done.status.success() {
        return Err(String::from_utf8_lossy(&done.stderr).into());
    }
    let text = String::from_utf8(done.stdout)?;
    let numbers: Vec<f64> = text.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
    Ok([numbers[0], numbers[1]])
}

/// The same of this crate, the mean of ten iterations.
fn ours(steps: &problem::Recording) -> Result<[f64; 2], Box<dyn Error>> {
    let em = EmSettings { accelerate: false, tolerance: 0.0, max_evaluations: 10, ..EmSettings::default() };
    let begun = Instant::now();
    let found = em.fit(steps, &problem::guess())?;
    Ok([begun.elapsed().as_secs_f64() / found.evaluations as f64, found.log_likelihood[0]])
}

/// A name, a program and its arguments.
type Peer<'a> = (&'a str, &'a str, Vec<&'a str>);

/// Seconds of each round, and the log-likelihood, of this crate first and then of each peer.
fn take_turns(steps: &problem::Recording, peers: &[Peer<'_>]) -> Vec<(Vec<f64>, f64)> {
    let mut results = vec![(Vec::new(), f64::NAN); peers.len() + 1];
    for _ in 0..ROUNDS {
        for (i, (times, likelihood)) in results.iter_mut().enumerate() {
            let asked = match i.checked_sub(1).map(|i| &peers[i]) {
                None => ours(steps),
                Some((_, program, arguments)) => ask(program, arguments),
            };
            match asked {
                Ok([seconds, log_likelihood]) => {
                    times.push(seconds);
                    *likelihood = log_likelihood;
                }
                Err(error) => eprintln!("{}: {error}", name(i, peers)),
            }
        }
    }
    results
}

fn name<'a>(i: usize, peers: &[Peer<'a>]) -> &'a str {
    i.checked_sub(1).map_or("kalman", |i| peers[i].0)
}

fn main() -> Result<(), Box<dyn Error>> {
    let steps = problem::record(STEPS, 1);
    let path: PathBuf = std::env::temp_dir().join(format!("em-{}.bin", std::process::id()));
    write(&steps, &path)?;
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let file = path.to_str().ok_or("temporary folder with a name that is no text")?;
    let here = |name: &str| format!("{}/benches/peers/{name}", env!("CARGO_MANIFEST_DIR"));
    let (py, m) = (here("em.py"), here("em.m"));
    let peers: [Peer<'_>; 3] = [
        ("NumPy", &python, vec![&py, file]),
        ("numba", &python, vec![&py, file, "jit"]),
        ("Octave", "octave-cli", vec!["-qf", &m, file]),
    ];
    let mut results = take_turns(&steps, &peers);
    std::fs::remove_file(&path)?;
    println!("one iteration of EM, {STEPS} steps, median of {ROUNDS} in turns");
    println!("          us per step   times ours   log-likelihood");
    let median = |times: &mut Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times.get(times.len() / 2).map_or(f64::NAN, |seconds| 1e6 * seconds / STEPS as f64)
    };
    let own = median(&mut results[0].0);
    for (i, (times, likelihood)) in results.iter_mut().enumerate() {
        let us = median(times);
        println!("  {:<8}{us:11.2} {:12.1} {likelihood:16.6}", name(i, &peers), us / own);
    }
    Ok(())
}
