//! Runs a scenario: builds its packages, simulates its system, runs analyses and validations, evaluates checks, writes the report.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use assessment::baseline::BaselineOutcome;
use assessment::check::CheckVerdict;
use cosim::coupling;
use cosim::master::{self, RunProgress};
use cosim::node::{self, FmuProcessOptions, Node};
use cosim::system::System;
use diagnostics::{Error, ErrorCollector, print_to_stderr};
use scenario::plan::RunPlan;
use scenario::resolve;
use scenario::{BuildArtifacts, Scenario, document};

use crate::baseline_change::BaselineChange;
use crate::checkpoint_plan::CheckpointPlan;
use crate::options::{ProgressEvent, ReplayOutput, RunOptions, WarmStartRole};
use crate::real_time::RealTimeTimer;
use crate::recorder::RunRecorder;
use crate::report::{self, RunReport, ValidationReport};
use crate::run_folder::{self, RunFolder};
use crate::stop::StopCondition;
use crate::warm_start::WarmStart;
use crate::{baseline, messages, package, validation};

/// A completed run. Viewers can be connected to it as long as it is kept.
pub struct CompletedRun {
    /// Its report.
    pub report: RunReport,
    _recorder: RunRecorder,
}

/// What the runs of one process share: nodes that are to be freed, the stop condition, and a warm start for branches. Nodes are freed when
/// it is dropped, which runs the code of their FMUs: that may crash or hang, so all else comes before it.
#[derive(Default)]
pub struct RunContext {
    /// Nodes of finished runs.
    nodes: Vec<Box<dyn Node>>,
    /// That of the last run, which goes on watching the limit.
    stop: Option<StopCondition>,
    /// Until a run has loaded its files, ends the thread that waits for a signal when it is dropped.
    loading: Option<Sender<()>>,
    warm_start: Option<WarmStart>,
}

impl RunContext {
    /// Whether branches can start from the last run.
    #[must_use]
    pub fn has_warm_start(&self) -> bool {
        self.warm_start.is_some()
    }

    /// Frees those FMUs of which a process can hold one instance only: what follows may need one.
    fn free_single_instances(&mut self) {
        self.nodes.retain(|node| !node.is_single_instance());
    }

    /// The nodes of a system: new ones, or those of the warm start.
    fn create_nodes(
        &mut self,
        system: &mut System,
        checkpoints: &CheckpointPlan,
        host: Option<&FmuProcessOptions>,
    ) -> Result<Vec<Box<dyn Node>>, Error> {
        match self.warm_start.as_mut().filter(|_| checkpoints.reuses_nodes()) {
            None => {
                let mut nodes =
                    node::instantiate_nodes(system, host).map_err(|error| self.stop_error_or(error))?;
                if checkpoints.is_warm_up() {
                    // The branches may have faults of calls that the warm-up does not have.
                    node::with_call_faults(system, &mut nodes, true);
                }
                Ok(nodes)
            }
            Some(warm_start) => {
                let mut nodes = node::source_nodes(system);
                warm_start.lend_nodes(system, &mut nodes);
                Ok(nodes)
            }
        }
    }

    /// Keeps the nodes of a finished run until they are freed, or a branch goes on with them.
    fn keep_nodes(&mut self, system: &System, mut nodes: Vec<Box<dyn Node>>, checkpoints: CheckpointPlan) {
        if checkpoints.reuses_nodes() {
            if let Some(warm_start) = &mut self.warm_start {
                warm_start.take_back_nodes(system, &mut nodes);
            }
        } else if checkpoints.is_warm_up() {
            self.warm_start = checkpoints
                .into_last_checkpoint()
                .map(|(checkpoint, states)| WarmStart::new(system, &mut nodes, checkpoint, states));
        }
        self.nodes.append(&mut nodes);
    }

    fn check_stop(&self) -> Result<(), Error> {
        self.stop.as_ref().map_or(Ok(()), StopCondition::check_may_continue)
    }

    /// How isolated FMUs are started and watched; none when this process cannot start them.
    fn isolation_host(&self, options: &RunOptions) -> Option<FmuProcessOptions> {
        let program = (options.program.clone()?, vec!["isolated".to_owned()]);
        let give_up = self.stop.as_ref()?.overdue_call_condition();
        Some(FmuProcessOptions { program, patience: options.patience.unwrap_or(PATIENCE), give_up })
    }

    /// Why the run had to end, if it had to; or else the error.
    fn stop_error_or(&self, error: Error) -> Error {
        match &self.stop {
            Some(stop) => stop.stop_error_or(error),
            None => error,
        }
    }
}

/// A call that lasts longer than this is reported.
const PATIENCE: Duration = Duration::from_secs(10);

/// Receives the events of a run.
type OnProgressEvent<'a> = &'a mut dyn FnMut(ProgressEvent);

/// Runs the scenario at `path`; `events` is called as it goes on. Its nodes stay in the context afterwards.
///
/// # Errors
/// When the scenario is wrong, an FMU fails, or a file cannot be written; when a signal or its limit ends it. A run that began
/// has a report nevertheless.
pub fn run_scenario(
    path: &Path,
    options: &RunOptions,
    context: &mut RunContext,
    events: OnProgressEvent,
) -> Result<CompletedRun, Error> {
    let default = || Path::new("target/runs").join(path.file_stem().unwrap_or_default());
    let folder = options.out.clone().unwrap_or_else(default);
    let scenario = &Scenario::read_variant(path, options.variant.as_deref())?;
    run_folder::check_run_folder(&folder, scenario)?;
    let on_progress = &mut |progress: package::BuildProgress| events(ProgressEvent::Building(progress));
    let built = &package::build_scenario_packages(scenario, on_progress)
        .map_err(|error| with_other_scenario_errors(error, scenario, options))?;
    // A wrong word is told with all others.
    let limit = resolve::wall_clock_limit(scenario).ok().flatten();
    let stop = StopCondition::new(options.limit.or(limit));
    (context.loading, context.stop) = (stop.watch_while_loading(), Some(stop));
    ScenarioJob { scenario, built, options }.run_and_validate(folder, context, events)
}

/// The error of a build, with all other mistakes of the scenario that can be found without the packages.
fn with_other_scenario_errors(error: Error, scenario: &Scenario, options: &RunOptions) -> Error {
    let mut mistakes = ErrorCollector::from_iter([error]);
    let nothing = BuildArtifacts::default();
    mistakes.ok_or_record(RunPlan::resolve(scenario, &nothing, &options.overrides, PathBuf::new()));
    mistakes.into_result().err().unwrap_or_else(Error::already_reported)
}

/// A scenario, its packages, and the options of its run.
#[derive(Clone, Copy)]
struct ScenarioJob<'a> {
    scenario: &'a Scenario,
    built: &'a BuildArtifacts,
    options: &'a RunOptions,
}

impl ScenarioJob<'_> {
    /// Runs the scenario, and then the validations of its results.
    fn run_and_validate(
        self,
        folder: PathBuf,
        context: &mut RunContext,
        events: OnProgressEvent,
    ) -> Result<CompletedRun, Error> {
        let mut plan = self.resolve_run_plan(folder)?;
        let (baselines, new_baselines) = match self.options.bless {
            true => {
                if !self.options.force {
                    baseline::check_replaceable(self.scenario, &plan)?;
                }
                baseline::read_replaced_baselines(&plan)
            }
            false => (baseline::read_baselines(self.scenario, &plan)?, Vec::new()),
        };
        let host = context.isolation_host(self.options);
        let mut checkpoints = CheckpointPlan::new(&plan, self.options, context.warm_start.as_ref())?;
        let mut nodes = context.create_nodes(&mut plan.system, &checkpoints, host.as_ref())?;
        context.loading = None;
        // The runtime of an FMU may have taken the signals, and an FMU may have moved the folder while its start values were set.
        fmu_import::catch_termination_signals();
        fmu_import::restore_folder_and_permissions();

        let begin = Instant::now();
        let run_folder = RunFolder::create_and_lock(&plan.header.folder)?;
        let mut report = RunReport::new(self.scenario, &plan);
        report.identity.clone_from(&self.options.identity);
        let recording_options = self.recording_options(&plan);
        let mut recorder = run_folder.replace_recordings(|| {
            // A killed run leaves no file that nothing accounts for.
            report.write_cleanup_report(&self.scenario.document.validation)?;
            checkpoints.refuse_existing_files()?;
            RunRecorder::new(&mut plan, baselines, &recording_options)
        })?;
        if let Err(error) =
            attribution::save_run_inputs(self.scenario, self.built, &self.options.overrides, &report.folder)
        {
            report.warnings.push(format!("the inputs of the run were not kept for `trackside why`: {error}"));
        }
        recorder.viewer_urls().for_each(|url| events(ProgressEvent::Serving(url)));
        recorder.restore_from_checkpoint(&checkpoints, &plan, &mut report);

        let (clock, first_tick) = (plan.system.clock, checkpoints.first_tick());
        let mut timer = RealTimeTimer::new(clock, first_tick, self.options.realtime);
        let mut progress = RunProgress { deadline: timer.step_deadline(), ..RunProgress::default() };
        // Nobody sees more than a hundred of them, and each costs more than a short step.
        let mut next_event = 0;
        let done_steps = Arc::new(AtomicU64::new(first_tick));
        let stop = context.stop.as_ref();
        let hang_report =
            stop.map(|stop| stop.report_hang_by(self.hang_report(&report, clock.step, &done_steps)));
        let mut on_tick = |done| {
            done_steps.store(done, Relaxed);
            if done >= next_event {
                events(ProgressEvent::Steps(done, clock.steps));
                next_event = done + clock.steps / 100 + 1;
            }
            timer.wait_for_tick(done, || context.check_stop())
        };
        let simulation = Instant::now();
        let simulated = simulate_to_end(
            &mut plan.system,
            &mut nodes,
            &mut recorder,
            &mut progress,
            &mut on_tick,
            &mut checkpoints,
        );
        let simulation_seconds = simulation.elapsed().as_secs_f64();
        fmu_import::restore_folder_and_permissions();
        let mut outcome = simulated.map_err(|error| context.stop_error_or(error));
        checkpoints.finish_and_verify(&mut plan.system, &mut nodes, host.as_ref(), outcome.is_ok())?;
        checkpoints.add_to(&mut report);
        context.keep_nodes(&plan.system, nodes, checkpoints);

        if outcome.is_ok() {
            outcome = run_analyses(&plan, &mut recorder, &mut report, context, events);
        }
        if outcome.is_ok() {
            outcome = self.validate_all(&plan.system, &mut report, context, events);
        }
        drop(hang_report);
        fmu_import::restore_folder_and_permissions();
        if let Err(error @ Error::Output { .. }) = outcome {
            return Err(error);
        }

        let failure = outcome.err();
        let mut verdicts = evaluate_checks(&recorder, &mut report, failure.is_some());
        if self.options.bless {
            // What a run replaces does not judge it.
            let compared = recorder.baselines.outcomes().into_iter().map(BaselineChange::from_comparison);
            report.baseline_changes = compared.chain(new_baselines).collect();
        } else {
            report.baselines = recorder.baselines.outcomes();
        }
        verdicts.extend(report.baselines.iter().map(BaselineOutcome::to_verdict));
        messages::locate_named_start_values(&mut report.messages, &plan.system.nodes);
        if failure.is_none() {
            report.warnings.extend(recorder.checks.unfailing_warnings(&verdicts, &plan.system.columns));
        }
        baseline::draw_baseline_plots(&recorder.baselines, &mut report)?;
        report.laps = recorder.completed_laps().to_vec();
        report.late_points = timer.late_points();
        report.complete_after_run(&progress, clock.step, verdicts, failure.as_ref());
        if self.options.realtime.is_none() {
            let slow = report::slow_run_warning(report.sim_seconds, simulation_seconds, &report.nodes);
            report.warnings.extend(slow);
        }
        recorder.finish_recordings(&report)?;
        if self.options.bless {
            if report.verdict.is_success() {
                events(ProgressEvent::Blessing(&report.baseline_changes));
            }
            baseline::replace_baselines_by_run(&plan, &mut report)?;
        }
        report.warnings.extend(recorder.recording_warnings().chain(progress.notices).chain(progress.ended));
        report.warnings.extend(fmu_import::take_process_change_reports());
        report.set_wall_time(begin.elapsed().as_secs_f64());
        report.write_report_files(&self.scenario.source, recorder.run_pictures())?;
        match failure {
            Some(error) => {
                events(ProgressEvent::Failed(&report));
                Err(error)
            }
            None => Ok(CompletedRun { report, _recorder: recorder }),
        }
    }

    /// Writes the report of this run from another thread, with nothing but its error and how far it came: the checks are with the
    /// thread that hangs.
    fn hang_report(self, report: &RunReport, step: f64, done: &Arc<AtomicU64>) -> Box<dyn Fn(&Error) + Send> {
        let (report, source, done) = (report.clone(), self.scenario.source.clone(), done.clone());
        let begin = Instant::now();
        Box::new(move |error| {
            let mut report = report.clone();
            let progress = RunProgress { steps: done.load(Relaxed), ..RunProgress::default() };
            report.complete_after_run(&progress, step, Vec::new(), Some(error));
            report.set_wall_time(begin.elapsed().as_secs_f64());
            fmu_import::restore_folder_and_permissions();
            report.warnings.extend(fmu_import::take_process_change_reports());
            if let Err(error) = report.write_report_files(&source, None) {
                print_to_stderr(&error.to_string());
            }
        })
    }

    /// The plan of the run, which is checked together with those of its validations.
    fn resolve_run_plan(self, folder: PathBuf) -> Result<RunPlan, Error> {
        let overrides = &self.options.overrides;
        let mut plan = RunPlan::resolve(self.scenario, self.built, overrides, folder)?;
        if let Some(label) = &self.options.label {
            plan.header.title = format!("{}: {label}", plan.header.title);
        }
        if let Some(latest) = self.options.latest_stop {
            let announced_stop = &mut plan.system.announced_stop;
            *announced_stop = announced_stop.map(|stop| stop.max(latest));
        }
        validation::check_validations(self.scenario, self.built, &plan.system, overrides)?;
        plan.restrict_outputs();
        Ok(plan)
    }

    /// The options of the run, with the recording that a new baseline is made of.
    fn recording_options(self, plan: &RunPlan) -> RunOptions {
        let csv = self.options.csv || (self.options.bless && baseline::is_csv_recording_needed(plan));
        RunOptions { csv, ..self.options.clone() }
    }

    fn validate_all(
        self,
        system: &System,
        report: &mut RunReport,
        context: &mut RunContext,
        events: OnProgressEvent,
    ) -> Result<(), Error> {
        let validations = self.scenario.document.validation.iter();
        for (validation, child) in validations.zip(&self.scenario.validations) {
            context.check_stop()?;
            context.free_single_instances();
            self.run_validation(system, validation, child, report, context, events)?;
        }
        Ok(())
    }

    /// Runs the scenario `child` that validates the results of this run, and adds its ending to the report.
    fn run_validation(
        self,
        system: &System,
        validation: &document::Validation,
        child: &Scenario,
        report: &mut RunReport,
        context: &mut RunContext,
        events: OnProgressEvent,
    ) -> Result<(), Error> {
        let name = validation.name.get_ref();
        events(ProgressEvent::Validation(name));
        let run = &self.options.overrides;
        let options = RunOptions {
            overrides: validation::validation_overrides(
                self.scenario,
                validation,
                system,
                Some(report),
                run,
            )?,
            // A viewer that is connected goes on showing this run.
            replay: if self.options.replay == ReplayOutput::Off {
                ReplayOutput::Off
            } else {
                ReplayOutput::Save
            },
            realtime: None,
            checkpoints: Vec::new(),
            resume: None,
            role: WarmStartRole::Standalone,
            ..self.options.clone()
        };
        let folder = report.folder.join(name);
        let job = ScenarioJob { scenario: child, built: self.built, options: &options };
        let outcome = job.run_and_validate(folder.clone(), context, events).map(|run| run.report);
        report.validations.push(ValidationReport::new(name, child.source.main_path(), folder, &outcome));
        match outcome {
            Ok(_) => Ok(()),
            Err(error) => Err(Error::Validation { name: name.clone(), error: Box::new(error) }),
        }
    }
}

/// The verdicts of all checks; the report gets the values that they are about.
fn evaluate_checks(recorder: &RunRecorder, report: &mut RunReport, has_failed: bool) -> Vec<CheckVerdict> {
    report.messages = recorder.messages.node_messages();
    let results = report.results_for_checks();
    let verdicts = recorder.checks.verdicts(&results, has_failed);
    report.collected = recorder.values.by_name(&results);
    verdicts
}

/// Steps the nodes to the end; `on_tick` is called at each communication point.
fn simulate_to_end(
    system: &mut System,
    nodes: &mut [Box<dyn Node>],
    recorder: &mut RunRecorder,
    progress: &mut RunProgress,
    on_tick: &mut dyn FnMut(u64) -> Result<(), Error>,
    checkpoints: &mut CheckpointPlan,
) -> Result<(), Error> {
    if nodes.is_empty() {
        return Ok(());
    }
    on_tick(checkpoints.first_tick())?;
    let mut coupling = coupling::create_coupling(system);
    master::run_observed(system, nodes, coupling.as_mut(), recorder, progress, on_tick, checkpoints)
}

/// Runs the analyses one after the other.
fn run_analyses(
    run_plan: &RunPlan,
    recorder: &mut RunRecorder,
    report: &mut RunReport,
    context: &RunContext,
    events: OnProgressEvent,
) -> Result<(), Error> {
    for plan in &run_plan.analyses {
        context.check_stop()?;
        let outcome = recorder.run_analysis(plan, report, &|| context.check_stop().is_ok(), events);
        // An analysis that is called off says something else.
        context.check_stop().and(outcome)?;
    }
    Ok(())
}
