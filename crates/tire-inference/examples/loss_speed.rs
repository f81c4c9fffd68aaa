//! Measures the time of a whole identification by loss, in turns: `loss_speed [SAMPLES [ROUNDS]]`; a million samples, five rounds.
//!
//! Prints the median of each loss beside that of least squares, and the time that each result reports. Samples have Student's noise of
//! four degrees of freedom.

use std::time::Instant;

use numerics::statistics::quantile;
use preparation::direction::ForceDirection;
use rand_distr::{Distribution, StudentT};
use rand_pcg::Pcg64;
use tire_inference::estimate::identify_tire;
use tire_inference::noise::NoiseModel;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number =
        |index: usize, absent: usize| arguments.get(index).map_or(Ok(absent), |text| text.parse::<usize>());
    let (count, rounds) = (number(0, 1_000_000)?, number(1, 5)?.max(1));
    let excitation = SyntheticExcitation {
        samples: count,
        slip_std: 0.0,
        force_std: 0.0,
        ..SyntheticExcitation::default()
    };
    let mut measured = synthetic_samples(&excitation, 0.3);
    let (noise, mut random) = (StudentT::new(4.0)?, Pcg64::new(1, 1));
    measured.force.iter_mut().for_each(|force| *force += 0.04 * noise.sample(&mut random));
    let losses = [
        ("least squares", NoiseModel::Square),
        ("huber", NoiseModel::Huber { threshold: 0.06 }),
        ("student_t, given", NoiseModel::StudentT { freedom: Some(4.0), scale: Some(0.04) }),
        ("student_t", NoiseModel::StudentT { freedom: None, scale: None }),
    ];
    let mut times = vec![[Vec::new(), Vec::new()]; losses.len()];
    for _ in 0..rounds {
        for ((_, loss), [waited, reported]) in losses.iter().zip(&mut times) {
            let begin = Instant::now();
            let settings =
                loss.apply_to_settings(IdentificationSettings::new(ForceDirection::Lateral), &measured)?;
            let settled = begin.elapsed().as_secs_f64();
            let answer = identify_tire(&measured, &settings, &[FitMethod::LeastSquares])?;
            waited.push(begin.elapsed().as_secs_f64());
            reported.push(settled + answer.estimates[0].1.seconds);
        }
    }
    let mut squares = f64::NAN;
    for ((name, _), sides) in losses.iter().zip(&mut times) {
        let [waited, reported] = sides.each_mut().map(|times| {
            times.sort_by(f64::total_cmp);
            quantile(times, 0.5)
        });
        squares = if squares.is_nan() { waited } else { squares };
        let ratio = waited / squares;
        println!("{name}: {waited:.3} s, {ratio:.2} times least squares; reported {reported:.3} s");
    }
    Ok(())
}
