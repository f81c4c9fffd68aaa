//! Explains why two runs differ: what differs between their inputs, what that did first, and by experiments which difference is the cause.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use diagnostics::Error;
use diagnostics::suggest::join_first;
use scenario::plan::RunPlan;
use scenario::resolve::IsolationPolicy;
use serde::Serialize;

use crate::check_comparison::{self, CheckComparison};
use crate::difference::{
    Difference, DifferenceKind, DifferenceScope, InputSwap, PlannedInputs, list_differences,
    list_value_differences,
};
use crate::experiment::{ExperimentOptions, ExperimentRunner, LocalDeviation, SimulatedRun, node_order};
use crate::key_figure::{self, KeyFigure};
use crate::pictures::{self, SignalPlots, TitledPlot};
use crate::run_inputs::{RecordedRun, RunInputs};
use crate::trajectory::{SignalDeviation, SignalName, Trajectory, TrajectoryComparison};

/// Signals or differences that a sentence names.
const MOST_NAMED: usize = 6;

/// Signals whose shares of an effect are told.
const SHARES: usize = 3;
/// Effects whose sum misses the whole by less than this add up [-].
const ADDITIVE: f64 = 0.05;

/// How much of the difference between two runs a cause makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CauseEffect {
    /// A with it alone is B.
    All,
    /// It makes a part, and the parts add up.
    Part,
    /// It acts with others: their effects do not add up.
    Together,
    /// It is one or more of these: there was no time to part them.
    Among,
}

/// A cause of the difference between two runs.
#[derive(Debug, Clone, Serialize)]
pub struct Cause {
    /// The numbers of the differences.
    pub differences: Vec<usize>,
    /// How much of it.
    pub effect: CauseEffect,
    /// A sentence.
    pub text: String,
}

/// A connection that carries a difference on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SpreadArrow {
    /// The node that it comes from.
    pub from: String,
    /// The node that it goes to.
    pub to: String,
}

/// One of two compared runs, in a few words.
#[derive(Debug, Clone, Serialize)]
pub struct RunSummary {
    /// Its path.
    pub path: String,
    /// Its verdict.
    pub verdict: String,
    /// Its checks that passed, and all of them.
    pub passed_checks: [usize; 2],
    /// The page of its report.
    #[serde(skip)]
    pub report_page: Option<PathBuf>,
    /// Time that it took by the clock [s].
    pub wall_seconds: Option<f64>,
}

/// Why two runs differ.
#[derive(Debug, Clone, Serialize)]
pub struct Explanation {
    /// The runs.
    pub a: RunSummary,
    /// The second one.
    pub b: RunSummary,
    /// Whether no value differs beyond rounding.
    pub same: bool,
    /// What differs between the inputs.
    pub differences: Vec<Difference>,
    /// Signals that both runs have, and those of them that differ.
    pub signals: [usize; 2],
    /// The first value that differs.
    pub first_deviation: Option<SignalDeviation>,
    /// The first value of each node that differs, in the order of time and calls.
    pub spread: Vec<SignalDeviation>,
    /// The connections between these nodes.
    pub arrows: Vec<SpreadArrow>,
    /// Nodes and connections that differ while all that they get is as in A.
    pub local: Vec<LocalDeviation>,
    /// The causes.
    pub causes: Vec<Cause>,
    /// The numbers of the differences that change no value.
    pub without_effect: Vec<usize>,
    /// What no difference explains, or why there were no experiments.
    pub unexplained: Option<String>,
    /// Whether both runs were kept with their inputs.
    #[serde(skip)]
    pub(crate) inputs_known: bool,
    /// What else is to be known.
    pub notes: Vec<String>,
    /// The notes of the comparison that counts: that of the recordings, or that of the repeated runs.
    #[serde(skip)]
    comparison_notes: Vec<String>,
    /// The checks of both runs: first those whose verdicts differ, then those that differ in anything else.
    pub checks: Vec<CheckComparison>,
    /// Lap times and collected values of both runs.
    pub key_figures: Vec<KeyFigure>,
    /// The first signals that differ, over time.
    #[serde(skip)]
    pub(crate) signal_plots: Vec<SignalPlots>,
    /// What the checks compare whose verdicts differ, over time.
    #[serde(skip)]
    pub(crate) check_plots: Vec<TitledPlot>,
    /// Runs that this took.
    pub runs: usize,
    /// Time that this took [s].
    pub seconds: f64,
    /// All of it in one line.
    pub summary: String,
}

/// Explains why run B differs from run A: folders of runs, or a baseline in the place of A.
///
/// # Errors
/// When one of them cannot be read, or an experiment is called off.
pub fn explain_difference(a: &Path, b: &Path, options: &ExperimentOptions) -> Result<Explanation, Error> {
    let begin = Instant::now();
    let [mut run_a, run_b] = [RecordedRun::open(a)?, RecordedRun::open(b)?];
    let borrowed = run_a.borrow_archives(&run_b);
    let runs = [run_a, run_b];
    let recorded = [Trajectory::read(a), Trajectory::read(b)];
    let mut explanation = Explanation::of_runs(&runs);
    let recorded = recorded.map(|read| read.map(Arc::new));
    explanation.compare_software(&runs);
    explanation.notes.extend(borrowed.iter().map(|entry| {
        format!("{entry} of A was another archive, which was not kept: A is repeated with that of B")
    }));
    match (&runs[0].inputs, &runs[1].inputs) {
        (Ok(inputs_a), Ok(inputs_b)) => {
            let analysis = RunPairAnalysis::new(&runs, [inputs_a, inputs_b], options)?;
            analysis.explain(&mut explanation, &recorded)?;
        }
        (inputs_a, Ok(inputs_b)) => {
            let why = inputs_a.as_ref().err().cloned().unwrap_or_default();
            explanation.compare_recordings(&recorded, &[])?;
            explanation.notes.push(format!("A cannot be repeated: {why}"));
            explanation.explain_from_b(&runs, inputs_b, &recorded[0], options)?;
        }
        (inputs_a, inputs_b) => {
            explanation.compare_recordings(&recorded, &[])?;
            for (name, inputs) in [("A", inputs_a), ("B", inputs_b)] {
                explanation
                    .notes
                    .extend(inputs.as_ref().err().map(|why| format!("{name} cannot be repeated: {why}")));
            }
        }
    }
    explanation.compare_results(&runs, &recorded);
    explanation.finish(begin.elapsed().as_secs_f64());
    Ok(explanation)
}

impl Explanation {
    fn of_runs(runs: &[RecordedRun; 2]) -> Self {
        let summary = |run: &RecordedRun| RunSummary {
            path: run.name(),
            verdict: run.report.as_ref().map_or("baseline".to_owned(), |report| report.verdict.clone()),
            passed_checks: run.report.as_ref().map_or([0, 0], |report| {
                let passed = report.checks.iter().filter(|check| check.passed == Some(true)).count();
                [passed, report.checks.len()]
            }),
            report_page: run.report_page(),
            wall_seconds: run.report.as_ref().map(|report| report.wall_seconds),
        };
        let mut explanation = Explanation {
            a: summary(&runs[0]),
            b: summary(&runs[1]),
            same: false,
            differences: Vec::new(),
            signals: [0, 0],
            first_deviation: None,
            spread: Vec::new(),
            arrows: Vec::new(),
            local: Vec::new(),
            causes: Vec::new(),
            without_effect: Vec::new(),
            unexplained: None,
            inputs_known: runs.iter().all(|run| run.inputs.is_ok()),
            notes: Vec::new(),
            comparison_notes: Vec::new(),
            checks: Vec::new(),
            key_figures: Vec::new(),
            signal_plots: Vec::new(),
            check_plots: Vec::new(),
            runs: 0,
            seconds: 0.0,
            summary: String::new(),
        };
        for (name, run) in ["A", "B"].into_iter().zip(runs) {
            let error = run.report.as_ref().and_then(|report| report.error.as_ref());
            explanation.notes.extend(error.map(|error| format!("{name} did not come to its end: {error}")));
        }
        explanation
    }

    /// Whether both runs were kept with their inputs, so that the differences are all that there are.
    #[must_use]
    pub fn inputs_are_known(&self) -> bool {
        self.inputs_known
    }

    /// The checks and key figures of both runs side by side, and the signals that differ over time.
    fn compare_results(&mut self, runs: &[RecordedRun; 2], recorded: &[Result<Arc<Trajectory>, Error>; 2]) {
        let trajectories = recorded.each_ref().map(|read| read.as_ref().ok().map(Arc::as_ref));
        let reports = runs.each_ref().map(|run| run.report.as_ref());
        if let [Some(a), Some(b)] = reports {
            self.checks = check_comparison::compare_checks([&a.checks, &b.checks], trajectories, self.same);
        }
        self.key_figures = key_figure::collect_key_figures(reports);
        if let [Some(a), Some(b)] = trajectories {
            self.signal_plots = pictures::plot_first_deviations([a, b], &self.spread);
            let first = self.first_deviation.as_ref().map(|it| it.time);
            self.check_plots = pictures::plot_flipped_checks([a, b], &self.checks, first);
        }
    }

    /// Versions and the machine.
    fn compare_software(&mut self, runs: &[RecordedRun; 2]) {
        let [Some(a), Some(b)] = [&runs[0].report, &runs[1].report] else { return };
        let text = |value: Option<&serde_json::Value>| match value {
            Some(serde_json::Value::String(text)) => text.clone(),
            Some(value) => value.to_string(),
            None => "unknown".to_owned(),
        };
        for name in a.versions.keys().filter(|name| a.versions.get(*name) != b.versions.get(*name)) {
            let (old, new) = (text(a.versions.get(name)), text(b.versions.get(name)));
            self.push_software(&format!("versions.{name}"), old, new);
        }
        for plugin in &a.plugins {
            let same_name =
                |it: &&crate::run_inputs::RecordedFile| it.path.file_name() == plugin.path.file_name();
            if let Some(other) = b.plugins.iter().find(same_name).filter(|it| it.sha256 != plugin.sha256) {
                let name = plugin.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                let short = |hash: &str| hash.chars().take(8).collect::<String>();
                self.push_software(&format!("plugin {name}"), short(&plugin.sha256), short(&other.sha256));
            }
        }
    }

    fn push_software(&mut self, place: &str, a: String, b: String) {
        self.push_difference(Difference::of_software(place, [a, b]));
    }

    fn push_difference(&mut self, difference: Difference) {
        self.differences.push(Difference { id: self.differences.len(), ..difference });
    }

    /// What the recordings tell: the first deviation and how it spreads.
    fn compare_recordings(
        &mut self,
        recorded: &[Result<Arc<Trajectory>, Error>; 2],
        order: &[String],
    ) -> Result<(), Error> {
        match recorded {
            [Ok(a), Ok(b)] => {
                self.take_comparison(&TrajectoryComparison::new(a, b, order));
                Ok(())
            }
            [a, b] => {
                for (name, read) in [("A", a), ("B", b)] {
                    self.notes.extend(
                        read.as_ref()
                            .err()
                            .map(|error| format!("{name} has no recording that can be read: {error}")),
                    );
                }
                match [a, b].into_iter().find_map(|read| read.as_ref().err()) {
                    Some(error) => Err(Error::invalid_input(error.to_string())),
                    None => Ok(()),
                }
            }
        }
    }

    fn take_comparison(&mut self, comparison: &TrajectoryComparison) {
        self.comparison_notes.clear();
        self.same = comparison.is_same();
        self.signals = [comparison.common, comparison.deviations.len()];
        self.first_deviation = comparison.deviations.first().cloned();
        self.spread = comparison.spread().into_iter().cloned().collect();
        if let Some([a, b]) = comparison.ends {
            self.notes
                .push(format!("A ends at {a} s and B at {b} s: they are compared up to the earlier one"));
        }
        for (name, only) in [("A", &comparison.only_a), ("B", &comparison.only_b)] {
            if !only.is_empty() {
                self.comparison_notes.push(format!("only {name} has {}", listed(only)));
            }
        }
        for name in &comparison.unlike_units {
            self.comparison_notes.push(format!("`{name}` has units that do not fit"));
        }
        if comparison.points == 0 {
            self.comparison_notes.push("the runs have no communication point in common".to_owned());
        }
    }

    /// B alone can be repeated: which of its nodes differ when they get what A recorded.
    fn explain_from_b(
        &mut self,
        runs: &[RecordedRun; 2],
        b: &RunInputs,
        recorded_a: &Result<Arc<Trajectory>, Error>,
        options: &ExperimentOptions,
    ) -> Result<(), Error> {
        if self.same || options.most_runs == 0 {
            return Ok(());
        }
        if let Ok(text) = recorded_scenario(&runs[0].path)
            && runs[0].path.extension().is_none_or(|it| it != "csv")
        {
            list_value_differences(&text, &b.table).into_iter().for_each(|it| self.push_difference(it));
        }
        let Ok(reference) = recorded_a else { return Ok(()) };
        let mut runner = ExperimentRunner::new(options, runs[1].isolation(), b, b)?;
        let mut plan = runner.plan(b, "b")?;
        self.arrows = spread_arrows(&plan, &self.spread);
        self.local = runner.local_deviations(&mut plan.system, reference)?;
        self.runs = runner.runs;
        self.unexplained = Some(match self.local.first() {
            Some(first) => format!(
                "A was not kept with its inputs, so its values alone are known: {} differs from {} s on while it gets the values of A",
                local_name(first), first.time
            ),
            None => "A was not kept with its inputs, and no node of B differs while it gets the values of A: a connection differs, or a signal that A did not record".to_owned(),
        });
        Ok(())
    }

    fn finish(&mut self, seconds: f64) {
        self.seconds = seconds;
        self.notes.append(&mut self.comparison_notes);
        self.summary = self.summary_line();
    }

    fn summary_line(&self) -> String {
        let acting = |it: &&Difference| it.swap.is_some();
        let count = self.differences.iter().filter(acting).count();
        if self.same {
            let checks = check_comparison::definition_sentence(&self.checks);
            return match count {
                0 => match checks {
                    Some(checks) => {
                        format!("The runs differ only in {checks}: every simulated value is the same.")
                    }
                    None => {
                        "The runs differ in nothing that is simulated: every value is the same.".to_owned()
                    }
                },
                1 => format!(
                    "Every value is the same: {} has no effect.",
                    self.differences.iter().find(acting).map_or("", |it| &it.place)
                ),
                count => {
                    format!("Every value is the same: {count} differences of the inputs have no effect.")
                }
            };
        }
        let texts: Vec<_> = self.causes.iter().map(|cause| cause.text.clone()).collect();
        match (texts.is_empty(), &self.unexplained) {
            (false, _) => {
                let checks = check_comparison::definition_sentence(&self.checks);
                let checks = checks.map(|checks| format!(" Also different: {checks}.")).unwrap_or_default();
                texts.join(" ") + &checks
            }
            (true, Some(why)) => why.clone(),
            (true, None) => "The values differ, and no cause was found.".to_owned(),
        }
    }
}

/// A node or a connection, in a sentence.
pub(crate) fn local_name(local: &LocalDeviation) -> String {
    match local.input {
        true => format!("the connection to `{}.{}`", local.node, local.variable),
        false => format!("`{}`", local.node),
    }
}

fn recorded_scenario(run: &Path) -> Result<toml::Table, Error> {
    let recording = recording::Recording::open(run)?;
    let text = recording.header.source.files().next().map(|file| file.text.clone()).unwrap_or_default();
    text.parse().map_err(|error: toml::de::Error| Error::invalid_input(error.message().to_owned()))
}

fn listed(signals: &[SignalName]) -> String {
    join_first(&signals.iter().map(SignalName::qualified_name).collect::<Vec<_>>(), MOST_NAMED)
}

/// The connections between nodes that differ.
fn spread_arrows(plan: &RunPlan, spread: &[SignalDeviation]) -> Vec<SpreadArrow> {
    let differs = |node: &str| spread.iter().any(|it| it.signal.node == node);
    let mut arrows = Vec::new();
    for node in &plan.system.nodes {
        for connection in &node.connections {
            let from = plan.system.columns[connection.source.index].node.clone();
            let arrow = SpreadArrow { from, to: node.name.clone() };
            if differs(&arrow.from)
                && differs(&arrow.to)
                && arrow.from != arrow.to
                && !arrows.contains(&arrow)
            {
                arrows.push(arrow);
            }
        }
    }
    arrows
}

/// The experiments on two runs that can be repeated.
struct RunPairAnalysis<'a> {
    runner: ExperimentRunner<'a>,
    inputs: [&'a RunInputs; 2],
    plans: [RunPlan; 2],
    order: Vec<String>,
    resumed: bool,
}

impl<'a> RunPairAnalysis<'a> {
    fn new(
        runs: &[RecordedRun; 2],
        inputs: [&'a RunInputs; 2],
        options: &'a ExperimentOptions<'a>,
    ) -> Result<Self, Error> {
        let failed = runs.iter().map(RecordedRun::isolation).find(|it| *it == IsolationPolicy::Everything);
        let mut runner = ExperimentRunner::new(options, failed.unwrap_or_default(), inputs[0], inputs[1])?;
        let plans = [runner.plan(inputs[0], "a")?, runner.plan(inputs[1], "b")?];
        let order = node_order(&plans[0].system);
        let resumed =
            runs.iter().any(|run| run.report.as_ref().is_some_and(|report| report.resumed.is_some()));
        Ok(RunPairAnalysis { runner, inputs, plans, order, resumed })
    }

    fn explain(
        mut self,
        explanation: &mut Explanation,
        recorded: &[Result<Arc<Trajectory>, Error>; 2],
    ) -> Result<(), Error> {
        let [a, b] = [0, 1].map(|run| PlannedInputs { inputs: self.inputs[run], plan: &self.plans[run] });
        for difference in list_differences(a, b) {
            explanation.push_difference(difference);
        }
        if let [Ok(a), Ok(b)] = recorded {
            explanation.take_comparison(&TrajectoryComparison::new(a, b, &self.order));
        } else {
            for (name, read) in ["A", "B"].into_iter().zip(recorded) {
                explanation.notes.extend(
                    read.as_ref()
                        .err()
                        .map(|error| format!("the recording of {name} cannot be read: {error}")),
                );
            }
        }
        let acting: Vec<usize> =
            explanation.differences.iter().filter(|it| it.swap.is_some()).map(|it| it.id).collect();
        let is_recorded = recorded.iter().all(Result::is_ok);
        if is_recorded && explanation.same && acting.is_empty() {
            return Ok(());
        }
        if !self.runner.has_budget() {
            explanation.arrows = spread_arrows(&self.plans[0], &explanation.spread);
            return Ok(());
        }
        if self.resumed {
            explanation.unexplained =
                Some("a run went on from a checkpoint: it is not repeated from there".to_owned());
            explanation.arrows = spread_arrows(&self.plans[0], &explanation.spread);
            return Ok(());
        }
        let run_a = self.runner.simulate(&mut self.plans[0].system)?;
        let run_b = self.runner.simulate(&mut self.plans[1].system)?;
        let repeated = self.note_repeatability(explanation, [&run_a, &run_b], recorded);
        let whole = TrajectoryComparison::new(&run_a.trajectory, &run_b.trajectory, &self.order);
        let is_whole_same = whole.is_same() && run_a.failure == run_b.failure;
        // Repeated runs have all values: also those that a recording leaves out.
        if !is_recorded || (repeated && !is_whole_same) {
            explanation.take_comparison(&whole);
        }
        explanation.arrows = spread_arrows(&self.plans[0], &explanation.spread);
        if is_whole_same {
            self.explain_equal_runs(explanation, &acting, &run_a)?;
        } else {
            self.find_local_deviations(explanation, &run_a, &acting)?;
            let mut search = CauseSearch { analysis: &mut self, explanation, run_a, run_b, whole };
            search.find_causes(acting)?;
        }
        explanation.runs = self.runner.runs;
        Ok(())
    }

    /// Whether both runs, when they are repeated, give what was recorded.
    fn note_repeatability(
        &self,
        explanation: &mut Explanation,
        again: [&SimulatedRun; 2],
        recorded: &[Result<Arc<Trajectory>, Error>; 2],
    ) -> bool {
        let mut all = true;
        for ((name, run), recorded) in ["A", "B"].into_iter().zip(again).zip(recorded) {
            let Ok(recorded) = recorded else { continue };
            let comparison = TrajectoryComparison::new(recorded, &run.trajectory, &self.order);
            let Some(first) = comparison.deviations.first() else { continue };
            all = false;
            let versions: Vec<_> = explanation
                .differences
                .iter()
                .filter(|it| it.kind == DifferenceKind::Software)
                .map(Difference::sentence)
                .collect();
            let because = match versions.is_empty() {
                true => "a node is not deterministic, or the machine or the program is another".to_owned(),
                false => versions.join(", "),
            };
            explanation.notes.push(format!(
                "{name} repeated differs from its recording from {} s on, first in {}: {because}",
                first.time,
                first.signal.qualified_name()
            ));
        }
        all
    }

    /// No value of the repeated runs differs.
    fn explain_equal_runs(
        &mut self,
        explanation: &mut Explanation,
        acting: &[usize],
        run_a: &SimulatedRun,
    ) -> Result<(), Error> {
        if !explanation.same && !explanation.spread.is_empty() {
            let software = explanation.differences.iter().filter(|it| it.kind == DifferenceKind::Software);
            let software: Vec<_> = software.map(|it| it.id).collect();
            let texts: Vec<_> = software.iter().map(|id| explanation.differences[*id].sentence()).collect();
            explanation.unexplained = Some(match texts.is_empty() {
                true => "The recordings differ, and both runs give the same values when they are repeated: a node is not deterministic, or the runs were made by different programs or machines.".to_owned(),
                false => format!("The recordings differ, and both runs give the same values when this program repeats them: {} is the difference that is left.", texts.join(", ")),
            });
            explanation.without_effect = acting.to_vec();
            return Ok(());
        }
        explanation.same = true;
        // Two causes may cancel: each is tried by itself while there is time.
        for &id in acting.iter().filter(|_| acting.len() > 1) {
            if !self.runner.has_budget() {
                break;
            }
            let swaps = [explanation.differences[id].swap.clone()];
            let swaps: Vec<&InputSwap> = swaps.iter().flatten().collect();
            let run = self.runner.run_with(self.inputs[0], &swaps)?;
            let comparison = TrajectoryComparison::new(&run_a.trajectory, &run.trajectory, &self.order);
            match comparison.deviations.first() {
                None => explanation.without_effect.push(id),
                Some(first) => {
                    let difference = explanation.differences[id].sentence();
                    let (name, time) = (first.signal.qualified_name(), first.time);
                    explanation.notes.push(format!(
                        "{difference} alone changes {name} from {time} s on; the other differences cancel that"
                    ));
                }
            }
        }
        if acting.len() == 1 {
            explanation.without_effect = acting.to_vec();
        }
        Ok(())
    }

    /// The nodes and connections of B that differ by themselves. With other communication points nothing can be compared.
    fn find_local_deviations(
        &mut self,
        explanation: &mut Explanation,
        run_a: &SimulatedRun,
        acting: &[usize],
    ) -> Result<(), Error> {
        let [clock_a, clock_b] = [0, 1].map(|run| self.plans[run].system.clock);
        if clock_a.step != clock_b.step || clock_a.start != clock_b.start || acting.is_empty() {
            return Ok(());
        }
        // A plan is used up by its run.
        let mut plan = self.runner.plan(self.inputs[1], "b")?;
        explanation.local = self.runner.local_deviations(&mut plan.system, &run_a.trajectory)?;
        Ok(())
    }
}

/// The search for the differences that make B out of A.
struct CauseSearch<'s, 'a> {
    analysis: &'s mut RunPairAnalysis<'a>,
    explanation: &'s mut Explanation,
    run_a: SimulatedRun,
    run_b: SimulatedRun,
    /// B compared with A.
    whole: TrajectoryComparison,
}

impl CauseSearch<'_, '_> {
    fn find_causes(&mut self, acting: Vec<usize>) -> Result<(), Error> {
        if acting.is_empty() {
            self.explanation.unexplained = Some(
                "The inputs are the same and the values differ: a node is not deterministic.".to_owned(),
            );
            return Ok(());
        }
        if !self.makes_b(&acting)? {
            self.explanation.unexplained = Some(
                "A with all differences of this table is not B: a node is not deterministic, or something else differs.".to_owned(),
            );
            return Ok(());
        }
        let likely = self.likely_causes(&acting);
        let mut relevant = Vec::new();
        let mut unparted = Vec::new();
        if likely.len() < acting.len() && !likely.is_empty() && self.makes_b(&likely)? {
            self.part(likely.clone(), &likely, &mut relevant, &mut unparted)?;
        } else {
            self.part(acting.clone(), &acting, &mut relevant, &mut unparted)?;
        }
        self.explanation.without_effect =
            acting.iter().copied().filter(|id| !relevant.contains(id) && !unparted.contains(id)).collect();
        match (relevant.as_slice(), unparted.is_empty()) {
            ([only], true) => {
                let text = format!("All of it is {}.", self.explanation.differences[*only].sentence());
                self.push_cause(vec![*only], CauseEffect::All, text);
            }
            ([], true) => {
                self.explanation.unexplained = Some(
                    "Each difference can be left out alone and B stays: more than one of them does the same."
                        .to_owned(),
                );
                self.push_cause(acting.clone(), CauseEffect::Among, self.among_text(&acting));
            }
            _ => self.weigh_causes(&relevant)?,
        }
        if !unparted.is_empty() {
            let text = self.among_text(&unparted);
            self.push_cause(unparted, CauseEffect::Among, text);
        }
        Ok(())
    }

    fn among_text(&self, ids: &[usize]) -> String {
        let names: Vec<_> = ids.iter().map(|id| self.explanation.differences[*id].place.as_str()).collect();
        format!(
            "{} of {}: they were not parted.",
            if self.explanation.causes.is_empty() {
                "The cause is one or more"
            } else {
                "The rest is one or more"
            },
            join_first(&names, MOST_NAMED)
        )
    }

    fn push_cause(&mut self, differences: Vec<usize>, effect: CauseEffect, text: String) {
        self.explanation.causes.push(Cause { differences, effect, text });
    }

    /// The differences at nodes and connections that differ by themselves.
    fn likely_causes(&self, acting: &[usize]) -> Vec<usize> {
        let local = &self.explanation.local;
        let is_likely = |id: &&usize| match &self.explanation.differences[**id].scope {
            DifferenceScope::Node(node) => local.iter().any(|it| !it.input && it.node == *node),
            DifferenceScope::Connection(input) => {
                local.iter().any(|it| it.input && format!("{}.{}", it.node, it.variable) == *input)
            }
            DifferenceScope::System => true,
            DifferenceScope::None => false,
        };
        acting.iter().filter(is_likely).copied().collect()
    }

    fn run_with(&mut self, ids: &[usize]) -> Result<SimulatedRun, Error> {
        let swaps: Vec<InputSwap> =
            ids.iter().filter_map(|id| self.explanation.differences[*id].swap.clone()).collect();
        let swaps: Vec<&InputSwap> = swaps.iter().collect();
        self.analysis.runner.run_with(self.analysis.inputs[0], &swaps)
    }

    /// Whether A with these differences is B.
    fn makes_b(&mut self, ids: &[usize]) -> Result<bool, Error> {
        let run = match self.run_with(ids) {
            Ok(run) => run,
            // Some differences go together: one alone may make no scenario.
            Err(error) if error.is_interruption() => return Err(error),
            Err(_) => return Ok(false),
        };
        let comparison =
            TrajectoryComparison::new(&self.run_b.trajectory, &run.trajectory, &self.analysis.order);
        Ok(comparison.is_same() && run.failure.is_some() == self.run_b.failure.is_some())
    }

    /// Parts a group into the differences that matter and the others. `all` makes B, and so does what is left of it without those that do
    /// not matter.
    fn part(
        &mut self,
        group: Vec<usize>,
        all: &[usize],
        relevant: &mut Vec<usize>,
        unparted: &mut Vec<usize>,
    ) -> Result<(), Error> {
        let mut needed: Vec<usize> = all.to_vec();
        let mut open = vec![group];
        while let Some(group) = open.pop() {
            if let ([only], [alone]) = (group.as_slice(), needed.as_slice())
                && only == alone
            {
                relevant.push(*only);
                continue;
            }
            if !self.analysis.runner.has_budget() {
                match group.as_slice() {
                    [only] if needed.len() == 1 => relevant.push(*only),
                    _ => unparted.extend(group),
                }
                continue;
            }
            let without: Vec<_> = needed.iter().copied().filter(|id| !group.contains(id)).collect();
            // Without any difference there is A, which is not B.
            let dispensable = !without.is_empty() && self.makes_b(&without)?;
            if dispensable {
                needed = without;
            } else if let [only] = group.as_slice() {
                relevant.push(*only);
            } else {
                let (first, second) = group.split_at(group.len() / 2);
                open.push(second.to_vec());
                open.push(first.to_vec());
            }
        }
        relevant.sort_unstable();
        unparted.sort_unstable();
        Ok(())
    }

    /// Tells how much each of several causes does by itself.
    fn weigh_causes(&mut self, relevant: &[usize]) -> Result<(), Error> {
        let mut effects = Vec::new();
        for &id in relevant {
            if !self.analysis.runner.has_budget() {
                effects.push(None);
                continue;
            }
            effects.push(match self.run_with(&[id]) {
                Ok(run) => Some(run.trajectory),
                Err(error) if error.is_interruption() => return Err(error),
                Err(_) => None,
            });
        }
        let additive =
            effects.iter().cloned().collect::<Option<Vec<_>>>().is_some_and(|it| self.is_additive(&it));
        for (&id, effect) in relevant.iter().zip(&effects) {
            let sentence = self.explanation.differences[id].sentence();
            let own = effect
                .as_ref()
                .map(|it| TrajectoryComparison::new(&self.run_a.trajectory, it, &self.analysis.order));
            let (effect, text) = match own {
                None => (CauseEffect::Together, format!("{sentence}: what it does by itself was not tried.")),
                Some(own) if own.deviations.is_empty() => (
                    CauseEffect::Together,
                    format!("{sentence}: it acts together with the others, and does nothing by itself."),
                ),
                Some(own) => {
                    let words = self.share_words(&own);
                    let effect = if additive { CauseEffect::Part } else { CauseEffect::Together };
                    (effect, format!("{sentence}: {words}."))
                }
            };
            self.push_cause(vec![id], effect, text);
        }
        if relevant.len() > 1 && effects.iter().all(Option::is_some) {
            let note = match additive {
                true => "the effects of the causes add up",
                false => "the effects of the causes do not add up: they act on each other",
            };
            self.explanation.notes.push(note.to_owned());
        }
        Ok(())
    }

    /// Whether the sum of what the causes do alone is the whole, in the signals that differ most.
    fn is_additive(&self, effects: &[Arc<Trajectory>]) -> bool {
        let (a, b) = (&self.run_a.trajectory, &self.run_b.trajectory);
        self.largest_deviations().iter().all(|whole| {
            let values = |run: &Trajectory| run.column_values(&whole.signal);
            let (Some(of_a), Some(of_b)) = (values(a), values(b)) else { return false };
            let alone: Option<Vec<_>> = effects.iter().map(|run| values(run)).collect();
            let Some(alone) = alone else { return false };
            if [&of_b].into_iter().chain(&alone).any(|it| it.len() != of_a.len()) {
                return false;
            }
            let rest = |row: usize| {
                let parts: f64 = alone.iter().map(|it| it[row] - of_a[row]).sum();
                of_b[row] - of_a[row] - parts
            };
            let squares: f64 = (0..of_a.len()).map(|row| rest(row) * rest(row)).sum();
            (squares / of_a.len() as f64).sqrt() <= ADDITIVE * whole.rms
        })
    }

    /// The signals that differ most, relative to how much they vary.
    fn largest_deviations(&self) -> Vec<SignalDeviation> {
        let finite = |it: &&SignalDeviation| it.rms.is_finite() && it.rms > 0.0 && !it.signal.input;
        let mut all: Vec<_> = self.whole.deviations.iter().filter(finite).cloned().collect();
        let relative = |it: &SignalDeviation| {
            let scale = it.a.abs().max(it.b.abs()).max(it.largest);
            it.rms / scale.max(f64::MIN_POSITIVE)
        };
        all.sort_by(|x, y| relative(y).total_cmp(&relative(x)));
        all.truncate(SHARES);
        all
    }

    fn share_words(&self, effect: &TrajectoryComparison) -> String {
        let mut words = Vec::new();
        for whole in self.largest_deviations() {
            let own = effect.deviations.iter().find(|it| it.signal == whole.signal);
            let share = own.map_or(0.0, |own| own.rms / whole.rms);
            let of = if words.is_empty() { "of the difference in" } else { "in" };
            words.push(format!("{:.0} % {of} {}", share * 100.0, whole.signal.qualified_name()));
        }
        let first = effect.deviations.first().map(|it| format!("from {} s on", it.time)).unwrap_or_default();
        format!("alone it makes {}, {first}", words.join(", "))
    }
}
