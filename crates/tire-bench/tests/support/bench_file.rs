//! Makes a file as a test bench writes it, of the sports tire: SAE axes, units in the head, noise, pauses between sweeps.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::f64::consts::TAU;
use std::fmt::Write as _;

use rand::SeedableRng as _;
use rand_distr::{Distribution as _, Normal};
use rand_pcg::Pcg64Mcg;
use tire::{Coefficients, MagicFormulaVersion, MfTire, Tire as _, TireOperatingPoint};

/// Samples of a sweep, at 20 Hz.
const COUNT: usize = 130;

/// From the end of a sweep to the begin of the next [s].
const PAUSE: f64 = 4.0;

/// ln of friction over 10 K of the tread.
pub const WARM: f64 = -0.05;

/// The tire that is measured.
pub fn truth() -> Coefficients {
    Coefficients { version: MagicFormulaVersion::Mf61, ..Coefficients::sports_tire() }
}

/// The text of the file.
pub fn bench_file() -> String {
    let tire = MfTire::new(truth()).expect("a tire");
    let (mut random, normal) = (Pcg64Mcg::seed_from_u64(22), Normal::new(0.0, 1.0).expect("a distribution"));
    let mut text =
        "# Made of the sports tire by the example bench_file of the crate tire-bench; SAE axes.\n".to_owned();
    text.push_str(
        "ET [s],V [km/h],SA [deg],SL [-],IA [deg],P [kPa],FX [N],FY [N],FZ [N],MZ [N.m],TSTC [degC]\n",
    );
    for sweep in 0..24 {
        let (load, pressure) = ([2000.0, 4000.0, 6000.0][sweep % 3], [200e3, 260e3][sweep / 3 % 2]);
        let (gamma, along) = ([0.0, 0.05][sweep / 6 % 2], sweep >= 12);
        for k in 0..COUNT {
            let phase = k as f64 / COUNT as f64 * TAU;
            let (slip, warm) = (phase.sin(), 8.0 * (1.0 - phase.cos()) - 4.0);
            let angle = if sweep % 2 == 1 { 0.05 } else { 0.0 };
            let (alpha, kappa) = if along { (angle, 0.15 * slip) } else { (0.17 * slip, 0.0) };
            let mut disturbed = |value: f64, std: f64| value + std * normal.sample(&mut random);
            let F_z = disturbed(load, 0.005 * load);
            let at =
                TireOperatingPoint { kappa, alpha, gamma, F_z, v_x: 16.7, pressure: Some(pressure), mu: 1.0 };
            let factor = (WARM * warm / 10.0).exp();
            let forces = tire.with_scale_factors([factor, factor, 1.0, 1.0]).forces(&at);
            let time = sweep as f64 * (0.05 * COUNT as f64 + PAUSE) + 0.05 * k as f64;
            let (F_x, F_y, M_z) =
                (disturbed(forces.F_x, 20.0), disturbed(forces.F_y, 20.0), disturbed(forces.M_z, 2.0));
            let _ = writeln!(
                text,
                "{time:.2},{:.2},{:.3},{kappa:.4},{:.2},{:.1},{F_x:.0},{:.0},{:.0},{:.1},{:.1}",
                16.7 * 3.6,
                -alpha.to_degrees(),
                gamma.to_degrees(),
                pressure / 1e3,
                -F_y,
                -F_z,
                -M_z,
                60.0 - 0.15 + warm
            );
        }
    }
    text
}
