//! Manoeuvres that cannot be driven are refused, and those that did not take place give no numbers.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::sync::Arc;

use crate::support::{Car, common, manoeuvre, values};
use manoeuvre::kind::{
    AccelerationTest, FrequencyResponse, ManoeuvreKind, SineWithDwell, SlowlyIncreasingSteer, SteadyCircle,
    StepSteer,
};
use manoeuvre::{CommonParameters, Manoeuvre, ManoeuvreDriver};

fn refused(common: CommonParameters, kind: impl ManoeuvreKind + 'static) -> (&'static str, String) {
    let wrong = Manoeuvre { common, kind: Arc::new(kind) }.check_parameters().expect_err("a mistake");
    (wrong.key, wrong.message)
}

#[test]
fn numbers_that_nothing_can_be_driven_with_are_refused_by_their_keys() {
    let step = StepSteer { amplitude: 0.02, ..StepSteer::default() };
    let sine = SineWithDwell { amplitude: Some(0.05), ..SineWithDwell::default() };
    let absurd = CommonParameters { step: 0.6, ..common(20.0) };
    for ((key, message), expected) in [
        (refused(common(-20.0), step), ("entry_speed", "found -20 m/s")),
        (refused(common(f64::NAN), step), ("entry_speed", "found NaN")),
        (refused(common(20.0), StepSteer { amplitude: 0.0, ..step }), ("amplitude", "found 0")),
        (refused(common(20.0), StepSteer { steady: 9.0, ..step }), ("steady", "found 9 s")),
        (refused(absurd, sine), ("frequency", "found 0.6 s")),
        (
            refused(CommonParameters { step: 0.06, ..common(20.0) }, SineWithDwell { dwell: 0.3, ..sine }),
            ("dwell", "0.0300 s"),
        ),
        (refused(common(20.0), SineWithDwell { times_A: Some(5.0), ..sine }), ("times_A", "both")),
        (refused(common(20.0), SineWithDwell { amplitude: None, ..sine }), ("amplitude", "neither")),
        (
            refused(CommonParameters { wheelbase: None, ..common(8.0) }, SteadyCircle::default()),
            ("wheelbase", "understeer gradient"),
        ),
        (
            refused(common(8.0), SteadyCircle { linear: [3.0, 1.0], ..SteadyCircle::default() }),
            ("linear", "3 and 1"),
        ),
        (refused(common(30.0), AccelerationTest::default()), ("to", "30 m/s")),
        (
            refused(
                common(20.0),
                FrequencyResponse { amplitude: 0.01, to: 0.1, ..FrequencyResponse::default() },
            ),
            ("to", "0.1 Hz"),
        ),
        (
            refused(
                common(20.0),
                FrequencyResponse { amplitude: 0.01, count: 1000, ..FrequencyResponse::default() },
            ),
            ("count", "1000"),
        ),
        (
            refused(common(20.0), SlowlyIncreasingSteer { until: 1.0, ..SlowlyIncreasingSteer::default() }),
            ("until", "found 1 m/s2"),
        ),
    ] {
        assert_eq!(key, expected.0, "{message}");
        assert!(message.contains(expected.1), "{message}");
    }
}

#[test]
fn a_manoeuvre_that_did_not_take_place_gives_a_reason_and_no_number() {
    let step = StepSteer { amplitude: 0.02, ..StepSteer::default() };
    for (common, car, stop, expected) in [
        // Too fast for its force.
        (
            common(90.0),
            Car { drag: 2.0, ..Car::new(20.0) },
            20.0,
            "did not keep its entry speed of 90.00 m/s",
        ),
        (common(20.0), Car::new(20.0), 3.0, "it was still at \"step\""),
        // No axle holds it.
        (common(20.0), Car { C_f: 1.0, C_r: 1.0, ..Car::new(20.0) }, 12.0, "no steady state"),
    ] {
        let reason = values(&manoeuvre(common, step), car, stop).expect_err("a reason");
        assert!(reason.contains(expected), "{reason}");
    }
    let search = SlowlyIncreasingSteer { max_steer: 0.005, ..SlowlyIncreasingSteer::default() };
    let reason = values(&manoeuvre(common(22.2), search), Car::new(22.2), 20.0).expect_err("a reason");
    assert!(reason.contains("needed to find A"), "{reason}");
}

#[test]
fn whatever_is_measured_the_commands_are_numbers() {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let share = (state >> 11) as f64 / (1_u64 << 53) as f64;
        (share - 0.5) * 10_f64.powi((state % 13) as i32 - 4)
    };
    let kinds: [Arc<dyn ManoeuvreKind>; 4] = [
        Arc::new(manoeuvre::kind::LaneChange::default()),
        Arc::new(SteadyCircle::default()),
        Arc::new(SineWithDwell { times_A: Some(5.0), ..SineWithDwell::default() }),
        Arc::new(AccelerationTest { power: Some(1e5), ..AccelerationTest::default() }),
    ];
    for kind in kinds {
        let common = CommonParameters { speed_tolerance: 1e9, settle: 0.02, ..common(5.0) };
        let manoeuvre = Arc::new(Manoeuvre { common, kind });
        let count = manoeuvre.kind.required_channels().len();
        let mut driver = ManoeuvreDriver::new(manoeuvre);
        for k in 0..25_000 {
            let inputs: Vec<f64> = (0..count).map(|_| random()).collect();
            let outputs = driver.step_commands(f64::from(k) * 0.01, &inputs);
            assert!(outputs.iter().all(|it| it.is_finite()), "{outputs:?} of {inputs:?}");
        }
    }
}
