//! Asks tires for forces at random points, far beyond all limits: every answer is a finite number.

use tire::{Coefficients, FormulaConvention, MagicFormulaVersion, MfTire, Tire, TireOperatingPoint};

#[test]
fn no_input_gives_nan() {
    let mut seed = 1_u64;
    let mut random = |low: f64, high: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    let usual = Coefficients::sports_tire();
    // Some files have neither a least load nor a low speed.
    let bare = Coefficients { FZMIN: 0.0, VXLOW: 0.0, ..usual };
    let versions = [MagicFormulaVersion::Mf52, MagicFormulaVersion::Mf61, MagicFormulaVersion::Mf62];
    for (version, tire) in versions.into_iter().flat_map(|it| [(it, usual), (it, bare)]) {
        let coefficients = Coefficients { version, ..tire };
        let tire = MfTire::new(coefficients).expect("a tire").with_convention(FormulaConvention::default());
        for case in 0..100_000 {
            let far = [1.0, 10.0, 0.0][case % 3];
            let slip = TireOperatingPoint {
                kappa: far * random(-1.5, 1.5),
                alpha: far * random(-1.6, 1.6),
                gamma: far * random(-0.3, 0.3),
                F_z: random(-2000.0, 30_000.0) * if case % 5 == 0 { 0.0 } else { 1.0 },
                v_x: random(-60.0, 60.0) * if case % 7 == 0 { 0.0 } else { 1.0 },
                pressure: (case % 2 == 0).then(|| random(0.0, 4e5)),
                mu: random(-0.2, 2.0).max(0.0),
            };
            let forces = tire.forces(&slip);
            let relaxation = tire.relaxation(&slip);
            let all = [forces.F_x, forces.F_y, forces.M_x, forces.M_y, forces.M_z];
            let lengths = [relaxation.x, relaxation.y];
            let radii = [tire.effective_radius(&slip), tire.loaded_radius(&slip, &forces)];
            let radii = radii.into_iter().flatten();
            let finite = all.into_iter().chain(lengths).chain(radii).all(f64::is_finite);
            assert!(finite, "{version}, case {case}: {slip:?} {forces:?} {relaxation:?}");
        }
    }
}
