//! Asserts that both tasks say nothing of a real car that the other one contradicts, if its recording is at hand.

use crate::log_250lm::{Log, by_drive, by_points, closed_loop, tires};
use tire_inference::axles::Axle;
use tire_inference::model::ModelFit;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::Identifiability;

#[test]
#[ignore = "needs logs of real cars"]
fn no_task_is_sure_of_what_the_other_one_rules_out() {
    let log = Log::read().expect("a log of TRACKSIDE_DATA");
    let window = [0.0, 36.0];
    let driven = by_drive(&closed_loop("", ""), &log.drive(window));
    let logged = by_points(&tires("", ""), &log.signals(window));
    for axle in Axle::ALL {
        let estimates = [&driven.estimates[axle], &logged[axle]];
        for name in [Quantity::K, Quantity::Peak] {
            let [[low, high], [least, most]] = estimates.map(|it| it.interval[&name]);
            let apart = high < least || most < low;
            let sure = estimates.map(|it| it.identified[&name] == Identifiability::Identified);
            assert!(
                !apart || sure == [false; 2],
                "{axle:?} {name}: {low} to {high} by prediction errors, {least} to {most} by points"
            );
        }
    }
    // Bank, play of the steering and heat of the tires are in no model: prediction errors have to say so.
    assert_eq!(driven.model.verdict, ModelFit::DoesNotFit, "{}", driven.model.sentence);
    assert!(driven.model.sentence.contains(':'), "no cause is named: {}", driven.model.sentence);
    let sure =
        |axle: Axle| driven.estimates[axle].identified.values().any(|it| *it == Identifiability::Identified);
    assert!(!Axle::ALL.into_iter().any(sure));
}
