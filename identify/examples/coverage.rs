//! Counts how often the stated 95 % intervals hold the truth of synthetic data: `coverage SEEDS LEVEL...`.

use std::collections::BTreeMap;

use identify::direction::Direction;
use identify::estimate::identify;
use identify::fit::{Options, SlipNoise};
use identify::settings::{Method, Settings};
use identify::study::excitation::{Excitation, samples};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let seeds: u64 = arguments.next().ok_or("expected SEEDS LEVEL...")?.parse()?;
    for level in arguments {
        let level: f64 = level.parse()?;
        let mut hits = BTreeMap::<&str, u64>::new();
        for seed in 0..seeds {
            let excitation = Excitation { seed, ..Excitation::default() };
            let usual = Settings::new(Direction::Longitudinal);
            let settings = Settings {
                slip_noise: Some(SlipNoise::new(excitation.slip_std)),
                options: Options { seed, ..usual.options },
                ..usual
            };
            let samples = samples(&excitation, level);
            for judgement in identify(&samples, &settings, &[Method::LeastSquares])?.judgements {
                let truth = judgement.quantity.value(&excitation.truth);
                let hit = (judgement.interval[0]..=judgement.interval[1]).contains(&truth);
                *hits.entry(judgement.quantity.name()).or_default() += u64::from(hit);
            }
        }
        println!(
            "{:>5} %: the interval holds the truth, of {seeds} seeds: {hits:?}",
            100.0 * level
        );
    }
    Ok(())
}
