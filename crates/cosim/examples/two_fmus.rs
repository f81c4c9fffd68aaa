//! Couples two FMUs without a scenario, and prints their outputs at each communication point:
//! `cargo run -p cosim --example two_fmus -- FIRST.fmu SECOND.fmu STEP STOP [first.y=second.u ...]`.

use std::path::Path;
use std::sync::Arc;

use cosim::builder::SystemBuilder;
use cosim::clock::CommunicationClock;
use cosim::system::Algorithm;
use fmu_import::Fmu;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [first, second, step, stop, connections @ ..] = words.as_slice() else {
        return Err("expected FIRST.fmu SECOND.fmu STEP STOP [first.y=second.u ...]".into());
    };
    let (step, stop): (f64, f64) = (step.parse()?, stop.parse()?);
    let clock = CommunicationClock { start: 0.0, step, steps: (stop / step).round() as u64 };
    let mut builder = SystemBuilder::new(clock, Algorithm::GaussSeidel);
    builder.add_fmu("first", &Arc::new(Fmu::open(Path::new(first))?), &[])?;
    builder.add_fmu("second", &Arc::new(Fmu::open(Path::new(second))?), &[])?;
    for connection in connections {
        let (output, input) = connection.split_once('=').ok_or("expected first.y=second.u")?;
        builder.connect(output, input)?;
    }
    let mut execution = builder.build()?;
    let names: Vec<_> = execution.system.columns.iter().map(|column| column.qualified_name()).collect();
    println!("time,{}", names.join(","));
    loop {
        let values = names.iter().filter_map(|name| execution.variable_value(name));
        let values: Vec<_> = values.map(|value| value.to_string()).collect();
        println!("{},{}", execution.time(), values.join(","));
        if execution.tick == clock.steps {
            return Ok(execution.terminate()?);
        }
        execution.step()?;
    }
}
