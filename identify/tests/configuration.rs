//! Checks the meaning of each configuration key, and that an error names its key.

use identify::config::Config;
use tire_inference::variational::Optimiser;
use tire_inference::variational::adam::Adam;

#[test]
fn a_scenario_chooses_the_optimiser() {
    let read = |svi: &str| {
        Config::read(&format!("task = \"curve\"\ndirection = \"lateral\"\nsvi = {{ {svi} }}"))
    };
    let text = "optimiser = \"adam\", batch = 64, start = { B = 10.0, C = 1.65, D = 1.5, E = 0.0 }";
    let Config::Curve(curve) = read(text).expect("valid") else { panic!("a curve") };
    let start = Some([10.0, 1.65, 1.5, 0.0, 0.0, 0.0]);
    assert_eq!(curve.svi, Optimiser::Adam(Adam { batch: Some(64), start, ..Adam::default() }));
    for (wrong, expected) in [
        ("optimiser = \"adam\", step = -1.0", "svi.step: expected a number above 0, found -1"),
        ("optimiser = \"adam\", batch = 0", "svi.batch: expected 1 or more, found 0"),
        ("optimiser = \"lbfgs\"", "`lbfgs`"),
        ("optimiser = \"adam\", stepsize = 1.0", "`stepsize`"),
    ] {
        let error = read(wrong).expect_err(wrong).to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn an_error_has_the_path_of_its_key() {
    for (text, key) in [
        ("", ""),
        ("task = \"tyres\"", "task"),
        ("task = \"tires\"\nlatral = {}", "latral"),
        ("task = \"tires\"\nmethods = []", "methods"),
        ("task = \"tires\"\nmethods = [\"svi\", \"sv\"]", "methods.1"),
        ("task = \"tires\"\naxle_coupling = -1.0", "axle_coupling"),
        ("task = \"tires\"\nlateral.boundz.B = [1.0, 2.0]", "lateral.boundz"),
        ("task = \"tires\"\nlateral.bounds.B = [9.0, 2.0]", "lateral.bounds.B"),
        ("task = \"tires\"\nlateral.bounds.B = [9.0, \"x\"]", "lateral.bounds.B.1"),
        ("task = \"tires\"\nlateral.bounds = \"narrow\"", "lateral.bounds"),
        ("task = \"tires\"\nlongitudinal.starts = 0", "longitudinal.starts"),
        ("task = \"tires\"\nlateral.loss = { kind = \"hubert\" }", "lateral.loss.kind"),
        ("task = \"tires\"\nlateral.loss = { kind = \"huber\", threshold = 0 }", "lateral.loss"),
        ("task = \"tires\"\nprepare.rate = 0", "prepare.rate"),
        (
            "task = \"tires\"\nprepare.smooth.wheels = { kind = \"gaussian\", sigma = 0 }",
            "prepare.smooth.wheels.sigma",
        ),
        ("task = \"tires\"\nfiles.prior = \"\"", "files.prior"),
        ("task = \"closed_loop\"\nbody.m = 1.0", "body"),
        ("task = \"closed_loop\"\nmethod = \"mep\"", "method"),
        ("task = \"closed_loop\"\ntypical.S_h = 0.0", "typical.S_h"),
        ("task = \"closed_loop\"\nbounds.C = [-1.0, 2.0]", "bounds.C"),
        ("task = \"closed_loop\"\nwindows = [[0.0, 1.0], [3.0, 2.0]]", "windows.1"),
        (
            "task = \"closed_loop\"\nvalidate = [{ name = \"a\", from = 2.0, until = 1.0 }]",
            "validate.0.until",
        ),
        ("task = \"curve\"\ndirection = \"up\"", "direction"),
        (
            "task = \"curve\"\ndirection = \"lateral\"\nfit.regularisation = -1",
            "fit.regularisation",
        ),
        ("task = \"excitation_study\"\nlevels = [0.1, 0.0]", "levels.1"),
        ("task = \"excitation_study\"\ntruth = { B = 1.0 }", "truth"),
        ("task = \"sensitivity_study\"\nspread = 1.0", "spread"),
    ] {
        let error = Config::read(text).expect_err(text);
        assert_eq!(error.key(), key, "{text}: {error}");
        assert!(!error.message.contains('\n'), "{text}: {error}");
    }
}
