//! Posteriors with two modes.

use tire_inference::bounds::Bounds;
use tire_inference::prior::Prior;

use super::judge::judge;
use super::support::{data, draw};

#[test]
fn both_modes_have_their_masses() {
    let prior = Prior::longitudinal().with_bounds(Bounds::GOBLIRSCH);
    // A tire of an even sequence in the box, the largest slip, a value of E between the modes.
    for (number, level, between) in [(6, 0.08, 0.6), (152, 0.75, 0.65)] {
        let tire = prior.space_filling_points(number + 1).last().expect("a tire");
        let (data, optima) = data(tire, 400, level, number as u64);
        let expected = judge(&data, &prior, 32, between).mass_above;
        assert!((0.05..0.95).contains(&expected), "one mode has next to nothing: {expected}");
        // Found also where no fit says where to look.
        for seeds in [&optima[..], &[]] {
            let found = draw(&data, &prior, seeds);
            let draws = &found.posterior.samples;
            let above = draws.iter().filter(|theta| theta[3] > between).count();
            let mass = above as f64 / draws.len() as f64;
            assert!((mass - expected).abs() < 0.02, "{number}: {mass} instead of {expected}");
            let [first, second] = &found.report.modes[..] else {
                panic!("{number}: {:?}", found.report.modes)
            };
            assert!((first.mass + second.mass - 1.0).abs() < 0.01);
            let mass = if second.mean[3] > between { second.mass } else { first.mass };
            assert!((mass - expected).abs() < 0.03, "{number}: {mass} instead of {expected}");
        }
    }
}
