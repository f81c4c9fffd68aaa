//! Measures the steps of a scenario without recordings, checks and reports:
//! `cargo run --release -p cosim --example loop_steps -- SCENARIO ROUNDS`. The same calls without any of this program:
//! `cargo run --release -p fmu-import --example bare_calls`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use cosim::exchange::Exchange;
use cosim::{coupling, node};
use diagnostics::Error;
use scenario::plan::System;
use scenario::resolve::Overrides;
use scenario::{Built, Scenario};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [scenario, rounds] = words.as_slice() else {
        return Err("expected SCENARIO ROUNDS".into());
    };
    let rounds: usize = rounds.parse()?;
    let times = (0..rounds).map(|_| time(Path::new(scenario)));
    let mut times = times.collect::<Result<Vec<_>, _>>()?;
    times.sort_by(f64::total_cmp);
    println!("median of {rounds}: {:.0} ns per step", times[rounds / 2]);
    Ok(())
}

/// Time per step [ns].
fn time(path: &Path) -> Result<f64, Error> {
    let (scenario, overrides) = (Scenario::read(path)?, Overrides::default());
    let mut system = System::resolve(&scenario, &Built::default(), &overrides, PathBuf::new())?;
    system.leave_unneeded();
    let mut nodes = node::instantiate(&mut system, None)?;
    let mut coupling = coupling::of(system.coupling);
    let steps = system.clock.steps;
    let mut exchange = Exchange::new(&mut system, &mut nodes);
    exchange.initialise(coupling.initialisation_passes())?;
    let begin = Instant::now();
    for tick in 0..steps {
        exchange.begin(tick);
        let stepped = coupling.step(&mut exchange);
        stepped.map_err(|error| Error::input(format!("{error:?}")))?;
    }
    Ok(begin.elapsed().as_secs_f64() * 1e9 / steps as f64)
}
