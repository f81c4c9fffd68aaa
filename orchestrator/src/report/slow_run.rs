//! Warns of a run that is far slower than real time, and names the node that took the most time.

use super::NodeReport;

/// Runs that take so many times the time that they simulate are slow.
const SLOW_RUN: f64 = 100.0;
/// Runs that take less time than this say nothing of their speed [s].
const SHORT_RUN: f64 = 2.0;

/// The warning of a run that simulated `simulated` [s] in `wall_seconds` [s] without its analyses, if it was slow.
#[must_use]
pub(crate) fn slow_run_warning(simulated: f64, wall_seconds: f64, nodes: &[NodeReport]) -> Option<String> {
    let slowness = wall_seconds / simulated;
    if simulated <= 0.0 || wall_seconds < SHORT_RUN || slowness <= SLOW_RUN {
        return None;
    }
    let percent = |seconds: f64| 100.0 * seconds / wall_seconds;
    let slowest = nodes.iter().max_by(|a, b| a.seconds.total_cmp(&b.seconds))?;
    let NodeReport { name, calls, seconds, .. } = slowest;
    let others = nodes.iter().map(|node| node.seconds).sum::<f64>() - seconds;
    Some(format!(
        "the run is {slowness:.0} times slower than real time: {wall_seconds:.1} s for {simulated} s. `{name}` took the most of the nodes: {seconds:.1} s, \
         {:.0} %, in {calls} steps; the other nodes took {:.0} %, recording and coupling the rest",
        percent(*seconds),
        percent(others)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_run_is_told_with_its_slowest_node() {
        let node = |name: &str, seconds| NodeReport { calls: 100, seconds, ..NodeReport::new(name) };
        let nodes = [node("quick", 1.0), node("plant", 400.0)];
        let told = slow_run_warning(1.0, 421.0, &nodes).expect("a warning");
        assert_eq!(
            told,
            "the run is 421 times slower than real time: 421.0 s for 1 s. `plant` took the most of the nodes: 400.0 s, 95 %, in 100 steps; the other \
             nodes took 0 %, recording and coupling the rest"
        );
        for (simulated, wall_seconds) in [(10.0, 421.0), (0.001, 1.0), (0.0, 421.0)] {
            assert_eq!(slow_run_warning(simulated, wall_seconds, &nodes), None);
        }
    }
}
