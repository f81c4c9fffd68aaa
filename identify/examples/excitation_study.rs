//! Runs the studies on synthetic data and writes their page: `excitation_study [PAGE.html [SEEDS LEVEL...]]`. With
//! a number of seeds and levels it also counts how often the stated 95 % intervals hold the truth.

use identify::direction::Direction;
use identify::estimate::{Answer, Question, identify};
use identify::page::{Method, Page, Section, render};
use identify::parameters::curve;
use identify::prior::Prior;
use identify::samples::Samples;
use identify::study::excitation::{self, Excitation, samples};
use identify::study::sensitivity;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let page = arguments.next().unwrap_or_else(|| "tires.html".into());
    let seeds: u64 = arguments.next().map_or(Ok(0), |text| text.parse())?;
    let excitation = Excitation::default();
    let study = excitation::run(&excitation)?;
    for level in &study.levels {
        print!("{:>5} %", 100.0 * level.level);
        for judgement in &level.judgements {
            let (name, value, std) = (judgement.quantity.name(), judgement.mean, judgement.std);
            print!("  {name} {value:.4} ± {std:.4} {:?}", judgement.verdict);
        }
        println!();
    }
    write_page(&page, &excitation, &study)?;
    for level in arguments {
        cover(&excitation, level.parse()?, seeds)?;
    }
    Ok(())
}

fn ask(samples: &Samples, slip_std: f64, seed: u64) -> Result<Answer, Box<dyn std::error::Error>> {
    let direction = Direction::Longitudinal;
    Ok(identify(&Question { samples, prior: Prior::longitudinal(), direction, slip_std, seed })?)
}

fn write_page(
    path: &str,
    excitation: &Excitation,
    study: &excitation::Study,
) -> Result<(), Box<dyn std::error::Error>> {
    let prior = Prior::longitudinal();
    let data = [0.08, 0.75].map(|level| samples(excitation, level));
    let answers =
        [ask(&data[0], excitation.slip_std, 42)?, ask(&data[1], excitation.slip_std, 42)?];
    let sensitivity = sensitivity::run(&curve(&excitation.truth), 0.1, 1.0, 100);
    let section = |(index, name)| -> Section {
        let answer: &Answer = &answers[index];
        let method = |name, estimate| Method { name, estimate, posterior: &answer.posterior };
        let methods = vec![
            method("least squares", &answer.least_squares),
            method("Nelder-Mead", &answer.nelder_mead),
        ];
        Section {
            name,
            direction: Direction::Longitudinal,
            samples: &data[index],
            prior: &prior,
            methods,
        }
    };
    let facts = [
        ("generator".to_owned(), "PCG64".to_owned()),
        ("seed".to_owned(), excitation.seed.to_string()),
    ];
    let html = render(&Page {
        title: "Tires of the synthetic study",
        facts: &facts,
        sections: [(0, "Slip to 8 %"), (1, "Slip to 75 %")].map(section).into(),
        excitation: Some(study),
        sensitivity: Some(&sensitivity),
    });
    Ok(std::fs::write(path, html)?)
}

fn cover(
    excitation: &Excitation,
    level: f64,
    seeds: u64,
) -> Result<(), Box<dyn std::error::Error>> {
    if seeds == 0 {
        return Ok(());
    }
    let mut hits = std::collections::BTreeMap::<&str, u64>::new();
    for seed in 0..seeds {
        let samples = samples(&Excitation { seed, ..excitation.clone() }, level);
        for judgement in ask(&samples, excitation.slip_std, seed)?.judgements {
            let truth = judgement.quantity.value(&excitation.truth);
            let hit = (judgement.interval[0]..=judgement.interval[1]).contains(&truth);
            *hits.entry(judgement.quantity.name()).or_default() += u64::from(hit);
        }
    }
    println!("{:>5} %: the interval holds the truth, of {seeds} seeds: {hits:?}", 100.0 * level);
    Ok(())
}
