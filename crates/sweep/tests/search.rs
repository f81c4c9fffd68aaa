//! Tests searches on problems whose answers are known.

use sweep::search::{
    CmaEsSearch, LimitSearch, LimitSide, SearchObjective, SearchStatus, SequentialSearch, VariantEvaluation,
};

fn minimise(bounds: &[[f64; 2]], most: usize) -> SearchObjective {
    SearchObjective::Minimise(CmaEsSearch {
        bounds: bounds.to_vec(),
        population: None,
        tolerance: 1e-6,
        most,
    })
}

/// Runs a search to its end.
fn run(goal: SearchObjective, seed: u64, mut f: impl FnMut(&[f64]) -> VariantEvaluation) -> SequentialSearch {
    let mut search = SequentialSearch::new(goal, seed).expect("a search");
    loop {
        let asked = search.next_points();
        if asked.is_empty() {
            return search;
        }
        let outcomes: Vec<VariantEvaluation> = asked.iter().map(|point| f(point)).collect();
        search.add_evaluations(&outcomes).expect("as many as were asked for");
    }
}

fn value(value: f64) -> VariantEvaluation {
    VariantEvaluation { value, passed: None }
}

fn margin(value: f64) -> VariantEvaluation {
    VariantEvaluation { value, passed: Some(value >= 0.0) }
}

fn rosenbrock(x: &[f64]) -> f64 {
    x.windows(2).map(|x| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2)).sum()
}

#[test]
fn the_valley_of_rosenbrock_is_followed_to_its_end() {
    for seed in 0..3 {
        let goal = minimise(&[[-2.0, 2.0], [-1.0, 3.0], [-2.0, 2.0]], 5000);
        let search = run(goal, seed, |x| value(rosenbrock(x)));
        assert_eq!(search.status(), SearchStatus::Converged);
        let best = search.best_variant().expect("a best one");
        assert!(best.value < 1e-8, "{best:?} of {}", search.evaluated_points().len());
        assert!(best.point.iter().all(|x| (x - 1.0).abs() < 1e-3), "{best:?}");
        assert_eq!(search.evaluated_points()[best.index].0, best.point);
    }
}

#[test]
fn a_minimum_at_a_bound_is_found_and_no_point_is_outside() {
    let bounds = [[10.0, 20.0], [-1e-3, 1e-3]];
    let search = run(minimise(&bounds, 3000), 1, |x| {
        assert!(x.iter().zip(bounds).all(|(x, [low, high])| (low..=high).contains(x)), "{x:?}");
        value((x[0] - 5.0).powi(2) + (1e3 * x[1] - 0.5).powi(2))
    });
    let best = search.best_variant().expect("a best one");
    assert!((best.point[0] - 10.0).abs() < 1e-3 && (best.point[1] - 5e-4).abs() < 1e-6, "{best:?}");
}

#[test]
fn noise_and_crashes_do_not_lead_astray() {
    let mut count = 0_u32;
    let search = run(minimise(&[[-5.0, 5.0]; 4], 1200), 2, |x| {
        count = count.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // Crashes in a corner and now and then.
        if (x[0] > 3.0 && x[1] > 3.0) || count.is_multiple_of(23) {
            return value(f64::NAN);
        }
        let noise = f64::from(count >> 8) / f64::from(1 << 24) - 0.5;
        value(x.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>() + 0.02 * noise)
    });
    let best = search.best_variant().expect("a best one");
    assert!(best.point.iter().all(|x| (x - 1.0).abs() < 0.3), "{best:?}");
}

#[test]
fn a_search_that_is_told_the_same_again_goes_on_where_it_was() {
    let goal = minimise(&[[-2.0, 2.0]; 2], 400);
    let whole = run(goal.clone(), 5, |x| value(rosenbrock(x)));
    let mut again = SequentialSearch::new(goal.clone(), 5).expect("a search");
    while again.evaluated_points().len() < 100 {
        let asked = again.next_points();
        assert_eq!(asked, again.next_points());
        let place = again.evaluated_points().len();
        let known: Vec<VariantEvaluation> =
            whole.evaluated_points()[place..place + asked.len()].iter().map(|it| it.1).collect();
        again.add_evaluations(&known).expect("as many as were asked for");
        assert!(again.evaluated_points() == &whole.evaluated_points()[..again.evaluated_points().len()]);
    }
    assert_eq!((whole.status(), again.status()), (SearchStatus::Exhausted, SearchStatus::Running));
    assert!(whole.evaluated_points().len() <= 400);
    let other = run(goal, 6, |x| value(rosenbrock(x)));
    assert_ne!(other.evaluated_points()[0], whole.evaluated_points()[0]);
}

fn limit(side: LimitSide, batch: usize) -> SearchObjective {
    SearchObjective::Limit(LimitSearch { bounds: [-1.0, 2.0], side, tolerance: 1e-6, batch, most: 200 })
}

#[test]
fn a_limit_at_a_third_is_found_in_few_batches() {
    for (batch, most) in [(1, 12), (2, 10), (4, 9), (8, 7), (16, 6)] {
        let mut batches = 0;
        let mut search = SequentialSearch::new(limit(LimitSide::Largest, batch), 0).expect("a search");
        loop {
            let asked = search.next_points();
            if asked.is_empty() {
                break;
            }
            batches += 1;
            let outcomes: Vec<_> = asked.iter().map(|x| margin(1.0 - 27.0 * x[0].powi(3))).collect();
            search.add_evaluations(&outcomes).expect("as many as were asked for");
        }
        assert_eq!(search.status(), SearchStatus::Converged);
        let found = search.limit_bracket().expect("a limit");
        assert!(found.passes <= 1.0 / 3.0 && 1.0 / 3.0 < found.fails, "{batch}: {found:?}");
        assert!(found.fails - found.passes <= 1e-6 && found.passes_again.is_none(), "{found:?}");
        assert_eq!(search.best_variant().expect("a best one").point, [found.passes]);
        assert!(batches <= most, "{batches} batches of {batch}");
    }
}

#[test]
fn pass_and_fail_alone_are_enough_and_margins_that_lie_do_no_harm() {
    for batch in [1, 2, 3, 7] {
        for outcome in [
            |x: f64| VariantEvaluation { value: f64::NAN, passed: Some(x <= 1.0 / 3.0) },
            // A crash is no pass.
            |x: f64| VariantEvaluation { value: f64::NAN, passed: (x <= 1.0 / 3.0).then_some(true) },
            // A step, and a margin that is next to nothing on one side.
            |x: f64| margin(if x <= 1.0 / 3.0 { 1.0 } else { -1e-9 }),
            |x: f64| margin(if x <= 1.0 / 3.0 { 1e-9 } else { -1e9 }),
        ] {
            let search = run(limit(LimitSide::Largest, batch), 0, |x| outcome(x[0]));
            assert_eq!(search.status(), SearchStatus::Converged, "{batch}");
            let found = search.limit_bracket().expect("a limit");
            assert!(found.passes <= 1.0 / 3.0 && 1.0 / 3.0 < found.fails, "{batch}: {found:?}");
            // Halving takes 22 batches of one; no more than twice that.
            assert!(
                search.evaluated_points().len() <= 48 * batch,
                "{batch}: {}",
                search.evaluated_points().len()
            );
        }
    }
}

#[test]
fn the_smallest_value_that_passes_is_found_as_well() {
    let search = run(limit(LimitSide::Smallest, 4), 0, |x| margin(x[0] - 0.25));
    let found = search.limit_bracket().expect("a limit");
    assert!(found.fails < 0.25 && 0.25 <= found.passes && found.passes - found.fails <= 1e-6);
}

#[test]
fn bounds_without_a_limit_between_them_are_told() {
    for (side, passes) in
        [(LimitSide::Largest, true), (LimitSide::Largest, false), (LimitSide::Smallest, true)]
    {
        let search = run(limit(side, 4), 0, |_| margin(if passes { 1.0 } else { -1.0 }));
        assert_eq!((search.status(), search.limit_bracket()), (SearchStatus::NotBracketed, None));
        assert_eq!(search.evaluated_points().len(), 4);
    }
    // It fails where it ought to pass.
    let search = run(limit(LimitSide::Largest, 4), 0, |x| margin(x[0]));
    assert_eq!((search.status(), search.limit_bracket()), (SearchStatus::NotBracketed, None));
}

#[test]
fn a_check_that_passes_again_beyond_a_failure_is_told() {
    let search = run(limit(LimitSide::Largest, 6), 0, |x| margin((x[0] - 0.5).abs() - 0.4));
    let found = search.limit_bracket().expect("a limit");
    assert!((found.passes - 0.1).abs() < 2e-6, "{found:?}");
    assert!(found.passes_again.is_some_and(|again| again > 0.9), "{found:?}");
}

#[test]
fn what_cannot_be_searched_is_refused() {
    let refused = |goal| SequentialSearch::new(goal, 0).expect_err("no search").to_string();
    assert!(refused(minimise(&[[1.0, 1.0]], 9)).contains("found 1 and 1"));
    assert!(refused(minimise(&[[0.0, f64::INFINITY]], 9)).contains("found 0 and inf"));
    assert!(refused(minimise(&[], 9)).contains("at least one parameter"));
    assert!(refused(minimise(&[[0.0, 1.0]], 0)).contains("found 1 and 0"));
    let mut search = SequentialSearch::new(limit(LimitSide::Largest, 2), 0).expect("a search");
    search.next_points();
    assert!(search.add_evaluations(&[]).expect_err("three").to_string().contains("of 3 variants"));
}
