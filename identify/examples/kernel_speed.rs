//! Measures one pass over the samples.
use identify::{kernel, loss::Loss, samples::Samples};
use std::time::Instant;
fn main() {
    for n in [1000usize, 4096, 100_000] {
        let slip: Vec<f64> = (0..n).map(|i| 0.75 * (i as f64 + 0.5) / n as f64).collect();
        let force = kernel::values(&[15.0, 2.0, 1.5, 0.8, 0.0, 0.0], &slip);
        let s = Samples::new(slip, force);
        let th = [16.0, 1.9, 1.45, 0.7, 0.0, 0.0];
        for (name, free) in [("4", [true, true, true, true, false, false]), ("6", [true; 6])] {
            let mut best = f64::INFINITY;
            let mut bc = f64::INFINITY;
            for _ in 0..30 {
                let t = Instant::now();
                for _ in 0..20 {
                    std::hint::black_box(kernel::pass(&s, &th, &free, Loss::Square));
                }
                best = best.min(t.elapsed().as_secs_f64() / 20.0 / n as f64 * 1e9);
                let t = Instant::now();
                for _ in 0..20 {
                    std::hint::black_box(kernel::cost(&s, &th, Loss::Square));
                }
                bc = bc.min(t.elapsed().as_secs_f64() / 20.0 / n as f64 * 1e9);
            }
            println!("N={n} free={name} pass {best:.2} ns/sample, cost {bc:.2}");
        }
    }
}
