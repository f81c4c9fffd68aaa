//! Fits data of a known tire that weakens as it warms, and finds it again.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use tire::{Coefficients, MagicFormulaVersion, MfTire, Tire, TireOperatingPoint};
use tire_bench::{
    BenchSample, FitHoldout, FittedChannel, Identifiability, TireFitOptions, average_over_revolutions,
    fit_tire, fit_with_holdout, write_tir,
};

/// ln of friction over 10 K of the tread.
const WARM: f64 = -0.05;

fn truth() -> Coefficients {
    Coefficients { version: MagicFormulaVersion::Mf61, ..Coefficients::sports_tire() }
}

/// Sweeps of slip angle and of slip ratio at three loads and two pressures; noise of 15 N.
fn samples() -> Vec<BenchSample> {
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
    let noise = Normal::new(0.0, 15.0).expect("a distribution");
    let tire = MfTire::new(truth()).expect("a tire");
    let mut found = Vec::new();
    for block in 0..24 {
        let (load, pressure) = ([2000.0, 4000.0, 6000.0][block % 3], [200_000.0, 260_000.0][block / 3 % 2]);
        let (gamma, along) = ([0.0, 0.05][block / 6 % 2], block >= 12);
        for step in 0..600 {
            let phase = f64::from(step) / 600.0 * std::f64::consts::TAU;
            let slip = phase.sin();
            let warm = 8.0 * (1.0 - phase.cos()) - 4.0;
            let (alpha, kappa) =
                if along { (0.04 * (block % 2) as f64, 0.15 * slip) } else { (0.17 * slip, 0.0) };
            let at = TireOperatingPoint {
                kappa,
                alpha,
                gamma,
                F_z: load,
                v_x: 16.7,
                pressure: Some(pressure),
                mu: 1.0,
            };
            let factor = (WARM * warm / 10.0).exp();
            let forces = tire.with_scale_factors([factor, factor, 1.0, 1.0]).forces(&at);
            let mut disturbed = |value: f64, share: f64| value + share * noise.sample(&mut random);
            found.push(BenchSample {
                run: 0,
                block,
                time: 20.0 * block as f64 + 0.02 * f64::from(step),
                kappa,
                alpha,
                gamma,
                F_z: load,
                pressure,
                v_x: 16.7,
                temperature: 333.0 + warm,
                F_x: disturbed(forces.F_x, 1.0),
                F_y: disturbed(forces.F_y, 1.0),
                M_z: disturbed(forces.M_z, 0.1),
            });
        }
    }
    found
}

#[test]
fn a_known_tire_is_found_with_its_temperature_and_its_bands() {
    let (samples, truth) = (samples(), truth());
    // What the fit moves begins at its prior, whatever stands here.
    let options = TireFitOptions { tire: truth, extended: false, draws: 50, seed: 3 };
    let found = fit_tire(&samples, &options).expect("a fit");
    let estimate = |name: &str| found.estimates.iter().find(|it| it.name == name).expect("an estimate");
    for (name, expected, off) in
        [("PDX1", truth.PDX1, 0.03), ("PDY1", truth.PDY1, 0.03), ("TDY1", WARM, 0.01), ("TDX1", WARM, 0.01)]
    {
        let it = estimate(name);
        assert!((it.value - expected).abs() < off, "{it:?}, expected {expected}");
        assert_eq!(it.verdict, Identifiability::Identified, "{it:?}");
    }
    let points = average_over_revolutions(&samples, &truth);
    for channel in [FittedChannel::Longitudinal, FittedChannel::Lateral] {
        let bands = found.prediction_bands(channel, &points).expect("bands");
        let inside = points
            .iter()
            .zip(&bands)
            .filter(|(it, band)| (channel.measured_value(it) - band[0]).abs() <= band[1]);
        let share = inside.count() as f64 / points.len() as f64;
        println!("{channel:?}: {share} in bands");
        assert!((0.93..=0.97).contains(&share), "{channel:?}: {share} in bands");
    }
    assert_eq!((found.draws.len(), found.draws[0].len()), (50, found.estimates.len()));
    let (read, _) = tire_file::read_tir(&write_tir(&found), "bench.tir").expect("a file");
    assert_eq!(read.PDY1, found.coefficients.PDY1);
}

#[test]
fn a_load_that_was_left_out_lies_in_its_bands() {
    let options = TireFitOptions { tire: truth(), extended: false, draws: 0, seed: 3 };
    let (_, found) = fit_with_holdout(&samples(), &options, FitHoldout::Load(4000.0)).expect("a fit");
    assert_eq!(found.len(), 3);
    for it in found {
        println!("{it:?}");
        assert!(it.means < 0.02 && it.coverage > 0.93, "{it:?}");
    }
}
