//! Measures the steps of a scenario without recordings, checks and reports, with its FMUs in this process and in processes of their
//! own, by turns: `cargo run --release -p system --example isolated_steps -- SCENARIO ROUNDS`. The same calls without any of this
//! program: `cargo run --release -p fmu-import --example bare_calls`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use cosim::exchange::Exchange;
use cosim::node::{self, FmuProcessOptions};
use cosim::system::NodeBody;
use diagnostics::Error;
use scenario::plan::RunPlan;
use scenario::resolve::{IsolationPolicy, Overrides};
use scenario::{BuildArtifacts, Scenario};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["isolated", host] => Ok(node::serve_host_process(host.parse()?)?),
        [scenario, rounds] => measure(Path::new(scenario), rounds.parse()?),
        _ => Err("expected SCENARIO ROUNDS".into()),
    }
}

fn measure(path: &Path, rounds: usize) -> Result<(), Box<dyn std::error::Error>> {
    let program = (std::env::current_exe()?, vec!["isolated".to_owned()]);
    let patience = Duration::from_secs(10);
    let host = FmuProcessOptions { program, patience, give_up: Arc::new(|| false) };
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..rounds {
        times[0].push(time(path, None)?);
        times[1].push(time(path, Some(&host))?);
    }
    let median = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    println!(
        "median of {rounds}: {:.2} us per step and FMU in one process, {:.2} us in processes of their own, {:.2} us more",
        median[0],
        median[1],
        median[1] - median[0]
    );
    Ok(())
}

/// Time per step and FMU [us].
fn time(path: &Path, host: Option<&FmuProcessOptions>) -> Result<f64, Error> {
    let scenario = Scenario::read(path)?;
    let overrides = Overrides { isolate: IsolationPolicy::Everything, ..Overrides::default() };
    let folder = PathBuf::new();
    let mut plan = RunPlan::resolve(&scenario, &BuildArtifacts::default(), &overrides, folder)?;
    let fmus = plan.system.nodes.iter().filter(|node| matches!(node.body, NodeBody::Fmu { .. })).count();
    plan.restrict_outputs();
    let mut system = plan.system;
    let mut nodes = node::instantiate_nodes(&mut system, host)?;
    let mut coupling = cosim::coupling::create_coupling(&system);
    let steps = system.clock.steps;
    let mut exchange = Exchange::new(&mut system, &mut nodes);
    coupling.initialise(&mut exchange)?;
    let begin = Instant::now();
    for tick in 0..steps {
        exchange.begin_step(tick);
        let stepped = coupling.step(&mut exchange);
        stepped.map_err(|error| Error::invalid_input(format!("{error:?}")))?;
    }
    Ok(begin.elapsed().as_secs_f64() * 1e6 / (steps as f64 * fmus as f64))
}
