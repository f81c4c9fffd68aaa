//! The diagrams of standards show the values that are given beside them.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::sync::Arc;

use crate::support::{Car, common, log, manoeuvre};
use manoeuvre::kind::{FrequencyResponse, SineWithDwell, SteadyCircle, StepSteer};
use manoeuvre::{CharacteristicValues, DiagramLayerKind, Manoeuvre, TestDiagram, TestDiagramLayer};

/// The diagrams of a test that begins at 10 s of its run, and the values; each layer is whole.
fn diagrams(manoeuvre: &Arc<Manoeuvre>, speed: f64, stop: f64) -> (Vec<TestDiagram>, CharacteristicValues) {
    let log = log(manoeuvre, Car::new(speed), stop).expect("a test");
    let values = manoeuvre.kind.characteristic_values(&manoeuvre.common, &log).expect("values");
    let diagrams = manoeuvre.test_diagrams(&log, &values, 10.0);
    for layer in diagrams.iter().flat_map(|diagram| &diagram.layers) {
        assert!(!layer.x.is_empty() && layer.x.len() == layer.y.len(), "{}", layer.name);
        assert!(layer.t.is_empty() || layer.t.len() == layer.x.len(), "{}", layer.name);
        assert!(layer.x.iter().chain(&layer.y).all(|it| it.is_finite()), "{}", layer.name);
    }
    (diagrams, values)
}

fn layers(diagram: &TestDiagram, kind: DiagramLayerKind) -> Vec<&TestDiagramLayer> {
    diagram.layers.iter().filter(|layer| layer.kind == kind).collect()
}

#[test]
fn the_fitted_line_over_lateral_acceleration_has_the_slope_of_the_gradient() {
    let (diagrams, values) = diagrams(&manoeuvre(common(6.0), SteadyCircle::default()), 6.0, 120.0);
    for (diagram, name) in diagrams.iter().zip(["understeer_gradient", "sideslip_gradient"]) {
        let fit = layers(diagram, DiagramLayerKind::Fit)[0];
        let slope = (fit.y[1] - fit.y[0]) / (fit.x[1] - fit.x[0]);
        let expected = values.get_number(name).expect("a gradient").to_degrees();
        assert!((slope - expected).abs() < 1e-9, "{name}: {slope} for {expected}");
        assert_eq!(fit.x, SteadyCircle::default().linear);
    }
}

#[test]
fn the_yaw_rate_is_marked_where_fmvss_126_judges_it() {
    let kind = SineWithDwell { amplitude: Some(0.05), ..SineWithDwell::default() };
    let (diagrams, values) = diagrams(&manoeuvre(common(22.2), kind), 22.2, 12.0);
    let yaw_rate = &diagrams[0];
    let [peak, one, two] = layers(yaw_rate, DiagramLayerKind::Mark)[..] else { panic!("three marks") };
    let completion = layers(yaw_rate, DiagramLayerKind::Reference)[0].x[0];
    for (mark, after, name) in [(one, 1.0, "yaw_rate_ratio_1_00"), (two, 1.75, "yaw_rate_ratio_1_75")] {
        assert!((mark.x[0] - completion - after).abs() < 1e-9, "{:?}", mark.x);
        let ratio = mark.y[0] / peak.y[0];
        assert!((ratio - values.get_number(name).expect("a ratio")).abs() < 1e-9, "{name}: {ratio}");
    }
    let limits = layers(yaw_rate, DiagramLayerKind::Limit);
    assert_eq!(limits.len(), 2);
    assert!((limits[0].y[0] - 0.35 * peak.y[0]).abs() < 1e-9);
    // The sine takes 1 / 0.7 Hz + 0.5 s, and the test begins at 10 s.
    assert!(completion > 10.0 + 1.0 / 0.7 + 0.5 - 1e-9, "{completion}");
}

#[test]
fn answers_to_a_step_and_to_frequencies_have_their_marks() {
    let (step, values) =
        diagrams(&manoeuvre(common(22.2), StepSteer { amplitude: 0.02, ..StepSteer::default() }), 22.2, 12.0);
    let steady = values.get_number("steady_yaw_rate").expect("a steady state").to_degrees();
    let response = layers(&step[0], DiagramLayerKind::Mark)[0];
    assert!((response.y[0] - 0.9 * steady).abs() < 1e-9);
    let sines = FrequencyResponse { amplitude: 0.01, count: 6, ..FrequencyResponse::default() };
    let (response, values) = diagrams(&manoeuvre(common(22.2), sines), 22.2, 200.0);
    assert_eq!(response.len(), 5);
    assert_eq!(layers(&response[0], DiagramLayerKind::Curve)[0].y, values.get_list("yaw_rate_gain"));
}
