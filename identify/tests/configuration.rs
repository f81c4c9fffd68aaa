//! Checks that the configuration of a scenario means what it says.

use identify::config::Config;
use tire_inference::variational::Optimiser;
use tire_inference::variational::adam::Adam;

#[test]
fn a_scenario_chooses_the_optimiser() {
    let read = |svi: &str| {
        Config::read(&format!("task = \"curve\"\ndirection = \"lateral\"\nsvi = {{ {svi} }}"))
    };
    let told = "optimiser = \"adam\", batch = 64, start = { B = 10.0, C = 1.65, D = 1.5, E = 0.0 }";
    let Config::Curve(curve) = read(told).expect("valid") else { panic!("a curve") };
    let start = Some([10.0, 1.65, 1.5, 0.0, 0.0, 0.0]);
    assert_eq!(curve.svi, Optimiser::Adam(Adam { batch: Some(64), start, ..Adam::default() }));
    for (wrong, expected) in [
        ("optimiser = \"adam\", step = -1.0", "`step`: expected a number above 0"),
        ("optimiser = \"adam\", batch = 0", "`batch`: expected 1 or more"),
        ("optimiser = \"lbfgs\"", "`lbfgs`"),
        ("optimiser = \"adam\", stepsize = 1.0", "`stepsize`"),
    ] {
        let error = read(wrong).expect_err(wrong);
        assert!(error.contains(expected), "{error}");
    }
}
