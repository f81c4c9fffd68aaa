//! Measures the cost of a step of the estimator, with v_y measured and without: `step`.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

#[allow(dead_code, reason = "the tests and the other example use the rest")]
#[path = "../tests/support/log.rs"]
mod log;
#[allow(dead_code, reason = "the tests and the other example use the rest")]
#[path = "../tests/support/replay.rs"]
mod replay;

use std::time::Instant;

use fmu_export::Model;
use replay::Fmu;

const STEPS: usize = 20_000;

fn main() {
    for measured in [true, false] {
        let mut fmu = Fmu::default();
        fmu.set("measured.v_y", f64::from(measured));
        fmu.0.initialise().expect("start values");
        let mut costs = Vec::with_capacity(STEPS);
        for k in 0..STEPS {
            let t = k as f64 * 0.01;
            let delta = 0.06 * t.sin();
            for (name, value) in [
                ("v_x_meas", 25.0),
                ("v_y_meas", -0.3 * t.sin()),
                ("r_meas", 25.0 * delta / 3.0),
                ("a_y_meas", 25.0 * 25.0 * delta / 4.0),
                ("delta", delta),
            ] {
                fmu.set(name, value);
            }
            let start = Instant::now();
            fmu.0.step(t, 0.01).expect("a step");
            costs.push(start.elapsed().as_secs_f64() * 1e6);
        }
        costs.sort_by(f64::total_cmp);
        let [half, most] = [0.5, 0.99].map(|share| costs[(share * STEPS as f64) as usize]);
        println!("v_y measured {measured}: median {half:.1} us, 99 % below {most:.1} us");
    }
}
