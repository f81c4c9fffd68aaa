//! Prints the file of a test bench that the scenario tires_from_bench.toml reads: `bench_file > scenarios/bench/sports_tire.csv`.

#[path = "../tests/support/bench_file.rs"]
mod support;

fn main() {
    print!("{}", support::bench_file());
}
