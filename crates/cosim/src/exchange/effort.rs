//! Measures how long each node takes.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use super::histogram::DurationHistogram;

/// How often a node was stepped, and how long that took. Of many short steps one in 64 is measured, and stands for those before it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct NodeStepTiming {
    /// Number of steps.
    pub calls: u64,
    /// Time in them, with the values going in and coming out.
    pub time: Duration,
    /// The longest measured time in a communication step.
    pub longest: Duration,
    /// Communication steps whose time was longer than the deadline.
    pub misses: u64,
    /// The times in the communication steps.
    times: DurationHistogram,
    /// The time in the step that goes on.
    now: Duration,
}

impl NodeStepTiming {
    /// The time [s] in a communication step that this share [-] of all steps does not exceed; nothing before the first one.
    #[must_use]
    pub fn step_time_quantile(&self, share: f64) -> Option<f64> {
        // The middle of a place may be beyond all that was in it.
        self.times.quantile(share).map(|time| time.min(self.longest.as_secs_f64()))
    }

    /// The mean time of a step.
    #[must_use]
    pub fn mean_step_time(&self) -> Duration {
        self.time.div_f64(self.calls.max(1) as f64)
    }

    fn finish_step(&mut self, weight: u32, deadline: Option<Duration>) {
        let time = std::mem::take(&mut self.now);
        self.time += time * weight;
        self.longest = self.longest.max(time);
        self.misses += u64::from(deadline.is_some_and(|deadline| time > deadline));
        self.times.add_duration(time, weight);
    }
}

/// All of the first steps are measured, so that what is left out at the end is little [-].
const FIRST: u64 = 1024;
/// At most so many short steps are left out between two that are measured, on average half as many [-].
const LEFT_OUT: u64 = 126;
/// A step of all nodes that takes longer than this for each is measured each time: looking at the clock is little beside it.
const SHORT: Duration = Duration::from_micros(5);

/// The effort of each node, and who is at work. A look at the clock costs as much as a short call, so there is at most one for each
/// node and step: the end of one is the begin of the next.
#[derive(Debug, Clone)]
pub(super) struct TimingCollector {
    all: Vec<NodeStepTiming>,
    /// The steps of each node, close together: these are counted at each step.
    calls: Vec<u64>,
    busy: Option<usize>,
    since: Instant,
    /// When the step began.
    begin: Instant,
    steps: u64,
    /// Whether the step is measured.
    looks: bool,
    /// So many steps the measured one stands for.
    weight: u32,
    /// The last step that was measured, and the next one.
    last: u64,
    next: u64,
    /// Chooses how many are left out: an FMU may do its work at each 64th step.
    random: u64,
    /// How long a step of a node may take in real time; then each one is measured.
    deadline: Option<Duration>,
}

impl Default for TimingCollector {
    fn default() -> Self {
        TimingCollector::for_nodes(0)
    }
}

impl TimingCollector {
    /// Those of so many nodes, before the first step.
    pub fn for_nodes(nodes: usize) -> Self {
        // Any moment before the first step; to look at the clock costs as much as a short call.
        static START: OnceLock<Instant> = OnceLock::new();
        let (all, now) = (vec![NodeStepTiming::default(); nodes], *START.get_or_init(Instant::now));
        TimingCollector {
            all,
            calls: vec![0; nodes],
            busy: None,
            since: now,
            begin: now,
            steps: 0,
            looks: false,
            weight: 1,
            last: 0,
            next: 1,
            random: 0,
            deadline: None,
        }
    }

    /// Counts steps of nodes that take longer than this.
    pub fn set_deadline(&mut self, deadline: Duration) {
        self.deadline = Some(deadline);
    }

    /// All of them, after the last step.
    pub fn node_timings(&mut self) -> &[NodeStepTiming] {
        self.finish_measured_step();
        self.all.iter_mut().zip(&self.calls).for_each(|(timing, calls)| timing.calls = *calls);
        &self.all
    }

    /// Begins a step: the time so far is nobody's.
    #[inline]
    pub fn begin_step(&mut self) {
        self.steps += 1;
        if self.looks || self.steps == self.next {
            self.change_measured_step();
        }
    }

    /// Ends a measured step at the begin of the next one, and begins that if it is measured, too.
    #[inline(never)]
    fn change_measured_step(&mut self) {
        if self.looks {
            self.finish_measured_step();
            self.choose_next_measured_step();
        }
        if self.steps == self.next {
            self.start_measured_step();
        }
    }

    fn start_measured_step(&mut self) {
        self.weight = (self.steps - self.last) as u32;
        (self.looks, self.begin, self.busy) = (true, Instant::now(), None);
        self.since = self.begin;
    }

    /// Counts the time of each node in the step that was measured, and looks away.
    fn finish_measured_step(&mut self) {
        if std::mem::take(&mut self.looks) {
            self.stop_timing_node();
            let (weight, deadline) = (self.weight, self.deadline);
            self.all.iter_mut().for_each(|effort| effort.finish_step(weight, deadline));
        }
    }

    /// Chooses the next step to be measured.
    fn choose_next_measured_step(&mut self) {
        self.last = self.steps - 1;
        self.next = self.steps;
        let nodes = u32::try_from(self.all.len()).unwrap_or(u32::MAX);
        let short = self.since - self.begin < SHORT.saturating_mul(nodes) && self.steps > FIRST;
        if short && self.deadline.is_none() {
            self.next += self.random_skip_count();
        }
    }

    /// How many steps to leave out: the generator of Knuth's MMIX, whose upper bits are good enough.
    fn random_skip_count(&mut self) -> u64 {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.random >> 33) % (LEFT_OUT + 1)
    }

    /// Whether this step is measured.
    #[inline]
    pub fn measures(&self) -> bool {
        self.looks
    }

    /// Counts a step of a node.
    #[inline]
    pub fn count_step(&mut self, node: usize) {
        self.calls[node] += 1;
    }

    /// Counts this time, which ends now, as that of a node that was at work beside others.
    pub fn add_node_time(&mut self, node: usize, time: Duration) {
        if self.looks {
            self.all[node].now += time;
            self.since = Instant::now();
        }
    }

    /// Counts the time from here on as that of a node.
    #[inline]
    pub fn start_timing_node(&mut self, node: usize) {
        if self.looks && self.busy != Some(node) {
            self.switch_to_node(Some(node));
        }
    }

    /// Ends the time of the node at work.
    #[inline]
    pub fn stop_timing_node(&mut self) {
        if self.busy.is_some() {
            self.switch_to_node(None);
        }
    }

    /// Ends the time of the node at work, if there is one.
    #[inline(never)]
    fn switch_to_node(&mut self, next: Option<usize>) {
        if let Some(node) = std::mem::replace(&mut self.busy, next) {
            let now = Instant::now();
            self.all[node].now += now - self.since;
            self.since = now;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps two nodes so often, which wait so long [us].
    fn efforts(steps: u64, waits: [u64; 2], deadline: Option<Duration>) -> Vec<NodeStepTiming> {
        let mut efforts = TimingCollector::for_nodes(2);
        deadline.into_iter().for_each(|deadline| efforts.set_deadline(deadline));
        for _ in 0..steps {
            efforts.begin_step();
            for (node, wait) in waits.into_iter().enumerate() {
                efforts.count_step(node);
                efforts.start_timing_node(node);
                let begin = Instant::now();
                while begin.elapsed() < Duration::from_micros(wait) {}
                efforts.stop_timing_node();
            }
        }
        efforts.node_timings().to_vec()
    }

    #[test]
    fn long_steps_are_measured_each_time_and_short_ones_are_scaled() {
        let short = efforts(20_000, [1, 2], None);
        let [one, two] = [0, 1].map(|node| short[node].time.as_micros());
        assert!(one >= 19_800 && two >= 39_600, "{one} {two}");
        let long = efforts(2_000, [5, 50], None);
        assert!(long[1].time.as_micros() >= 100_000, "{:?}", long[1].time);
        assert_eq!(long[0].calls, 2_000);
    }

    #[test]
    fn times_of_steps_are_told_by_quantiles_and_the_longest() {
        for effort in efforts(2_000, [5, 50], None).iter().zip([5e-6, 50e-6]) {
            let (effort, least) = effort;
            let [half, most] = [0.5, 0.99].map(|share| effort.step_time_quantile(share).expect("steps"));
            let longest = effort.longest.as_secs_f64();
            assert!(half >= least * 0.98 && most >= half && longest >= most, "{effort:?}");
            assert_eq!(effort.misses, 0);
        }
        assert_eq!(NodeStepTiming::default().step_time_quantile(0.99), None);
    }

    #[test]
    fn all_steps_are_measured_where_there_is_a_deadline() {
        let late = efforts(3_000, [0, 10], Some(Duration::from_micros(10)));
        assert_eq!(late[1].misses, 3_000);
        assert!(late[0].misses < 3_000);
    }
}
