//! Checks that a monitor goes on with what another one remembered, and refuses what none could remember.

use super::*;

const CONDITIONS: [&str; 15] = [
    "a.x < 2",
    "a.x < 9 and a.y > -4",
    "a.on == 0 or a.x > 1",
    "max(a.x) < 2",
    "min(a.x) / max(b.x) > -2",
    "first(a.x) == last(a.x)",
    "sum(a.x) > 0",
    "mean(a.x) < rms(a.y)",
    "count(a.x > 1) > 1",
    "std(a.x) < 1",
    "quantile(a.x, 0.3) < 1",
    "max(a.x) > min(a.y)",
    "rating(a.x, a.y) > 0.5",
    "corridor(a.x, a.y, a.y, a.x, 0.1, 0.1 + 0.1 * abs(a.x)) < 1",
    "corridor_share(a.x, a.y, a.y, 1, 0.1, 0.1) > rating_slope(a.x, b.x)",
];

fn sample(monitor: &mut ConditionMonitor<Tested>, k: u32) {
    let x = if k == 77 { f64::NAN } else { f64::from(k * 7 % 13) / 3.0 };
    monitor.push_sample(0.1 * f64::from(k), &TestedRow(&[x, -x, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0], &[]));
}

/// What a monitor says, so that NaN equals itself.
fn said(monitor: &ConditionMonitor<Tested>) -> String {
    format!("{:?} {:?}", monitor.outcome(), monitor.comparison_trace())
}

#[test]
fn a_run_in_two_parts_is_judged_as_in_one() {
    for condition in CONDITIONS {
        for (half, all) in [(0, 5), (3, 60), (70, 90), (80, 90), (1300, 2000)] {
            let new = || ConditionMonitor::new(parse(condition).expect(condition), 0.1);
            let [mut whole, mut one, mut other] = [new(), new(), new()];
            (0..all).for_each(|k| sample(&mut whole, k));
            (0..half).for_each(|k| sample(&mut one, k));
            assert!(other.restore_state(&one.save_state()), "{condition}");
            (half..all).for_each(|k| sample(&mut other, k));
            assert_eq!(said(&other), said(&whole), "{condition} from {half} on");
        }
    }
}

#[test]
fn what_no_monitor_remembers_is_refused_and_changes_nothing() {
    for condition in CONDITIONS {
        let mut monitor = ConditionMonitor::new(parse(condition).expect(condition), 0.0);
        (0..5).for_each(|k| sample(&mut monitor, k));
        let (before, good) = (said(&monitor), monitor.save_state());
        let mut wrong = vec![Vec::new(), good[..2].to_vec()];
        wrong.push(good.iter().cloned().chain([vec![1.0, f64::NAN, 1.0]]).collect());
        for list in 0..good.len() {
            for numbers in [vec![-1.0; 4], vec![f64::NAN], vec![1e300, 1.0], vec![0.5; 7]] {
                let mut memory = good.clone();
                memory[list] = numbers;
                wrong.push(memory);
            }
        }
        for memory in wrong {
            assert!(!monitor.restore_state(&memory), "{condition}: {memory:?}");
            assert_eq!(said(&monitor), before);
        }
        assert!(monitor.restore_state(&good) && said(&monitor) == before);
    }
}
