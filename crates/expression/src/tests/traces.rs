//! Checks first violations, and what is kept for pictures.

use super::*;

#[test]
fn the_first_sample_that_violates_a_condition_is_known() {
    let samples = [0.0, 3.0, 1.0, 7.0];
    assert_eq!(run("a.x < 2", 0.0, &samples).first, Some(1.0));
    assert_eq!(run("a.x < 2", 0.0, &samples).at, Some(3.0));
    assert_eq!(run("a.x < 9", 0.0, &samples).first, None);
    assert_eq!(run("a.x < 2", 0.0, &[0.0, f64::NAN, 5.0]).first, Some(1.0));
    assert_eq!(run("max(a.x) < 2", 0.0, &samples).first, None);
}

#[test]
fn a_trace_holds_what_is_compared() {
    let traced = |text: &str| {
        let mut monitor = ConditionMonitor::new(parse(text).expect("a condition"), 0.0);
        for x in [1.0, 5.0] {
            monitor.push_sample(x, &TestedRow(&[x, -x, 2.0], &[]));
        }
        let points = monitor.comparison_trace().points();
        let pairs = points.iter().map(|point| [point.value[0], point.limit[0]]);
        (monitor.comparison_trace().content(), pairs.collect::<Vec<_>>())
    };
    assert_eq!(traced("abs(a.y) < 2"), (TraceContent::Sides, vec![[1.0, 2.0], [5.0, 2.0]]));
    assert_eq!(traced("max(a.x) > 3"), (TraceContent::Reduced, vec![[1.0, 3.0], [5.0, 3.0]]));
    let (of, points) = traced("rms(a.x) < 3");
    assert!(of == TraceContent::Reduced && points[1][0] == 5.0 && points[1][1].is_nan());
    assert_eq!(traced("a.x < 2 and a.x < 4"), (TraceContent::Margins, vec![[1.0, 0.0], [-3.0, 0.0]]));
    assert_eq!(traced("max(a.x) > min(a.y)").1, Vec::<[f64; 2]>::new());
}
