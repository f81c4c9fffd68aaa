//! The checkpoint that a run resumes from, those that it saves, and the comparison of the resumed run with the original one.

use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::{Arc, Mutex, PoisonError};

use assessment::check::CheckState;
use cosim::checkpoint::{
    Checkpoint, CheckpointCompatibility, NodeStates, OutputDifference, SystemFingerprint,
    check_checkpoint_support, output_differences,
};
use cosim::clock::CommunicationClock;
use cosim::coupling::{self, CouplingAlgorithm};
use cosim::exchange::Exchange;
use cosim::master::RunObserver;
use cosim::node::{self, FmuProcessOptions, Node};
use cosim::system::System;
use diagnostics::{Error, ErrorCollector, rounded_time};
use scenario::plan::RunPlan;

use crate::checkpoint_file::{self, RunCheckpoint};
use crate::options::{RunOptions, WarmStartRole};
use crate::report::{PreviousRun, ResumeReport, RunReport};
use crate::warm_start::WarmStart;

/// What the checks remember at the checkpoint that is to be saved next.
pub(crate) type CheckMemories = Arc<Mutex<Vec<CheckState>>>;

/// The communication points at which the states of the checks are copied, and where to.
#[derive(Default)]
pub(crate) struct CheckSnapshots {
    pub ticks: Vec<u64>,
    pub memories: CheckMemories,
}

/// The checkpoint that a run resumes from, and those that it saves.
pub(crate) struct CheckpointPlan {
    scenario: String,
    fingerprint: SystemFingerprint,
    origin: Option<ResumePoint>,
    /// Those that are still to be saved.
    requests: Vec<CheckpointRequest>,
    saved: Vec<SavedCheckpoint>,
    folder: PathBuf,
    check_memories: CheckMemories,
    role: WarmStartRole,
    warnings: Vec<String>,
}

/// The checkpoint that a run resumes from.
pub(crate) struct ResumePoint {
    pub checkpoint: RunCheckpoint,
    /// The states of its nodes, if these are those of the run that it comes from.
    pub states: Option<Rc<NodeStates>>,
    /// Its file, or the scenario of the run in this process.
    pub label: String,
    fit: CheckpointCompatibility,
    /// Whether the run still repeats the original one.
    repeats: bool,
}

/// A checkpoint to be saved at a communication point.
struct CheckpointRequest {
    tick: u64,
    /// [s]
    time: f64,
}

impl CheckpointRequest {
    fn file_name(&self) -> String {
        format!("checkpoint_{}.state", rounded_time(self.time))
    }
}

/// A checkpoint that was saved, and its file, if it has one.
struct SavedCheckpoint {
    checkpoint: RunCheckpoint,
    states: NodeStates,
    file: Option<String>,
    complete: bool,
}

impl CheckpointPlan {
    /// Checks the checkpoint options of a run before anything of it begins.
    ///
    /// # Errors
    /// When FMUs cannot do what checkpoints need, when a time is none of the run's, when the checkpoint to resume from cannot be read
    /// or is one of another system.
    pub fn new(plan: &RunPlan, options: &RunOptions, warm_start: Option<&WarmStart>) -> Result<Self, Error> {
        let alone = options.checkpoints.is_empty() && options.resume.is_none() && warm_start.is_none();
        // Fingerprints of large tables take their time.
        let fingerprint =
            if alone { SystemFingerprint::default() } else { SystemFingerprint::of_system(&plan.system) };
        let in_bytes = options.role == WarmStartRole::Standalone;
        let mut mistakes = ErrorCollector::default();
        if !options.checkpoints.is_empty() {
            mistakes.ok_or_record(check_checkpoint_support(&plan.system, in_bytes));
        }
        let mut warnings = Vec::new();
        let mut requests: Vec<CheckpointRequest> = Vec::new();
        for time in &options.checkpoints {
            let request = mistakes.ok_or_record(CheckpointRequest::at_or_after(
                *time,
                plan.system.clock,
                &mut warnings,
            ));
            requests.extend(request);
        }
        requests.sort_by_key(|it| it.tick);
        requests.dedup_by_key(|it| it.tick);
        let origin = mistakes.ok_or_record(resume_point(plan, &fingerprint, options, warm_start)).flatten();
        mistakes.into_result()?;
        let before = origin.as_ref().map_or(0, |origin| origin.checkpoint.system.tick);
        if let Some(early) = requests.iter().find(|it| it.tick < before) {
            let [early, begin] = [early.time, plan.system.clock.time_at(before)].map(rounded_time);
            return Err(Error::invalid_input(format!(
                "--checkpoint {early}: the run begins at {begin} s, where its checkpoint is"
            )));
        }
        Ok(CheckpointPlan {
            scenario: plan.header.scenario.clone(),
            fingerprint,
            origin,
            requests,
            saved: Vec::new(),
            folder: plan.header.folder.clone(),
            check_memories: CheckMemories::default(),
            role: options.role,
            warnings,
        })
    }

    /// The first communication point of the run.
    pub fn first_tick(&self) -> u64 {
        self.origin.as_ref().map_or(0, |origin| origin.checkpoint.system.tick)
    }

    /// Refuses to replace files of others: those of an earlier run are set aside by now.
    ///
    /// # Errors
    /// When there is one with the name of a checkpoint.
    pub fn refuse_existing_files(&self) -> Result<(), Error> {
        let mut files =
            self.requests.iter().map(|it| it.file_name()).filter(|_| self.role == WarmStartRole::Standalone);
        match files.find(|file| std::fs::symlink_metadata(self.folder.join(file)).is_ok()) {
            None => Ok(()),
            Some(file) => Err(Error::invalid_input(format!(
                "the results cannot go to {}: it holds {file}, and no report says that a run wrote it",
                self.folder.display()
            ))
            .with_help("move it to another place, or name another folder: --out FOLDER")),
        }
    }

    /// Whether branches start from its last checkpoint in this process.
    pub fn is_warm_up(&self) -> bool {
        self.role == WarmStartRole::WarmUp
    }

    /// The checkpoint that the run resumes from.
    pub fn resume_checkpoint(&self) -> Option<&RunCheckpoint> {
        self.origin.as_ref().map(|origin| &origin.checkpoint)
    }

    /// The communication points at which the states of the checks are copied, and where to.
    pub fn snapshot_schedule(&self) -> CheckSnapshots {
        CheckSnapshots {
            ticks: self.requests.iter().map(|it| it.tick).collect(),
            memories: Arc::clone(&self.check_memories),
        }
    }

    /// What the report says about the checkpoint that the run resumes from.
    pub fn resume_report(&self) -> Option<ResumeReport> {
        let ResumePoint { checkpoint, label, fit, .. } = self.origin.as_ref()?;
        Some(ResumeReport {
            checkpoint: label.clone(),
            scenario: checkpoint.system.name.clone(),
            time: rounded_time(checkpoint.system.time),
            changes: fit.changes.clone(),
        })
    }

    /// Adds the files of the checkpoints and the warnings to the report.
    pub fn add_to(&mut self, report: &mut RunReport) {
        report.files.extend(self.saved.iter().filter_map(|saved| saved.file.clone()));
        report.warnings.append(&mut self.warnings);
    }

    /// Whether the run goes on with the nodes of an earlier one.
    pub fn reuses_nodes(&self) -> bool {
        self.origin.as_ref().is_some_and(|origin| origin.states.is_some())
    }

    /// The last checkpoint with the states of its nodes, for branches in this process.
    pub fn into_last_checkpoint(mut self) -> Option<(RunCheckpoint, NodeStates)> {
        self.saved.pop().map(|saved| (saved.checkpoint, saved.states))
    }

    /// Completes the files after the run, and verifies the checkpoints: new nodes must repeat the steps that followed. They do so in
    /// processes of their own, so whatever an FMU does not save is not there. `completed` tells whether the run came to its end.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn finish_and_verify(
        &mut self,
        system: &mut System,
        nodes: &mut [Box<dyn Node>],
        host: Option<&FmuProcessOptions>,
        completed: bool,
    ) -> Result<(), Error> {
        let missed = self
            .requests
            .iter()
            .map(|it| format!("there is no checkpoint at {} s: the run ended before", rounded_time(it.time)));
        self.warnings.extend(missed);
        for saved in self.saved.iter_mut().filter(|saved| !saved.complete) {
            saved.write(&self.folder)?;
        }
        if !completed {
            return Ok(());
        }
        for saved in &self.saved {
            let mut coupling = coupling::create_coupling(system);
            let verified = match (&saved.file, host) {
                (Some(_), None) => continue,
                (None, _) => saved.verify_by_repeating_steps(system, nodes, coupling.as_mut()),
                (Some(_), Some(host)) => {
                    saved.verify_in_new_processes(system, nodes, coupling.as_mut(), host)
                }
            };
            let time = saved.checkpoint.system.time;
            self.warnings.extend(match verified {
                Ok(differences) => OutputDifference::describe_differences(&differences, time),
                Err(error) => {
                    Some(format!("nothing goes on from the checkpoint at {} s: {error}", rounded_time(time)))
                }
            });
        }
        Ok(())
    }
}

impl SavedCheckpoint {
    fn write(&self, folder: &Path) -> Result<(), Error> {
        fmu_import::restore_folder_and_permissions();
        match &self.file {
            Some(file) => checkpoint_file::write_checkpoint(&folder.join(file), &self.checkpoint),
            None => Ok(()),
        }
    }

    /// Repeats the steps after the checkpoint with the nodes of the run.
    fn verify_by_repeating_steps(
        &self,
        system: &mut System,
        nodes: &mut [Box<dyn Node>],
        coupling: &mut dyn CouplingAlgorithm,
    ) -> Result<Vec<OutputDifference>, Error> {
        cosim::checkpoint::verify_checkpoint(
            &self.checkpoint.system,
            system,
            nodes,
            coupling,
            Some(&self.states),
        )
    }

    /// Repeats the steps after the checkpoint with new nodes, each FMU in a process of its own.
    fn verify_in_new_processes(
        &self,
        system: &mut System,
        nodes: &mut [Box<dyn Node>],
        coupling: &mut dyn CouplingAlgorithm,
        host: &FmuProcessOptions,
    ) -> Result<Vec<OutputDifference>, Error> {
        let mut twins = node::isolated_copies(system, nodes, host)?;
        let differences =
            cosim::checkpoint::verify_checkpoint(&self.checkpoint.system, system, &mut twins, coupling, None);
        node::return_sources(system, nodes, twins);
        differences
    }
}

impl CheckpointRequest {
    /// The communication point at or after a time that was asked for; a warning says so when it is after it.
    fn at_or_after(time: f64, clock: CommunicationClock, warnings: &mut Vec<String>) -> Result<Self, Error> {
        let steps = (time - clock.start) / clock.step;
        let nearest = steps.round();
        // A millionth of a step is rounding.
        let is_point = (steps - nearest).abs() < 1e-6;
        let tick = if is_point { nearest } else { steps.ceil() };
        if !(0.0..=clock.steps as f64).contains(&tick) {
            let (start, stop) = (rounded_time(clock.start), rounded_time(clock.stop_time()));
            return Err(Error::invalid_input(format!(
                "--checkpoint {time}: expected a time from {start} s to {stop} s, of the run"
            )));
        }
        let request = CheckpointRequest { tick: tick as u64, time: clock.time_at(tick as u64) };
        if !is_point {
            let at = rounded_time(request.time);
            warnings
                .push(format!("--checkpoint {time}: it is taken at {at} s, the next communication point"));
        }
        Ok(request)
    }
}

/// The checkpoint that the options name, if it fits the system.
fn resume_point(
    plan: &RunPlan,
    fingerprint: &SystemFingerprint,
    options: &RunOptions,
    warm_start: Option<&WarmStart>,
) -> Result<Option<ResumePoint>, Error> {
    let (checkpoint, label, states, mut misfits);
    match (options.role, warm_start, &options.resume) {
        (WarmStartRole::Branch { .. }, Some(warm), _) => {
            checkpoint = warm.checkpoint.clone();
            label = warm.checkpoint.system.name.clone();
            states = Some(Rc::clone(&warm.states));
            misfits = warm.describe_misfits(&plan.system);
        }
        (_, _, Some(path)) => {
            refuse_checkpoint_in_folder(path, &plan.header.folder)?;
            checkpoint = checkpoint_file::read_checkpoint(path)?;
            label = path.display().to_string();
            states = None;
            misfits = Vec::new();
        }
        _ => return Ok(None),
    }
    let fit = fingerprint.check_compatibility(&checkpoint.system.fingerprint, &plan.system);
    misfits.extend(fit.misfits.iter().cloned());
    let time = rounded_time(checkpoint.system.time);
    if checkpoint.system.tick > plan.system.clock.steps {
        misfits.push(format!(
            "it is at {time} s, after the end of this run at {} s",
            rounded_time(plan.system.clock.stop_time())
        ));
    }
    if misfits.is_empty() {
        let repeats = fit.changes.is_empty();
        return Ok(Some(ResumePoint { checkpoint, states, label, fit, repeats }));
    }
    let scenario = &checkpoint.system.name;
    let message =
        format!("the checkpoint of `{scenario}` at {time} s ({label}) does not fit: {}", misfits.join("; "));
    Err(Error::invalid_input(message).with_help("a run that goes on may have other tunable parameters, signals, effects, faults, checks and another stop time; for all else write a new checkpoint"))
}

/// Refuses a checkpoint in the folder of the run, whose files the run replaces.
fn refuse_checkpoint_in_folder(file: &Path, folder: &Path) -> Result<(), Error> {
    let real = |path: &Path| std::fs::canonicalize(path).ok();
    if !real(file).zip(real(folder)).is_some_and(|(file, folder)| file.starts_with(folder)) {
        return Ok(());
    }
    let (file, folder) = (file.display(), folder.display());
    let message = format!("--resume {file}: it is in {folder}, whose files this run replaces");
    Err(Error::invalid_input(message).with_help("name another folder for this run: --out FOLDER"))
}

impl RunObserver for CheckpointPlan {
    fn begin_run(
        &mut self,
        exchange: &mut Exchange,
        coupling: &mut dyn CouplingAlgorithm,
    ) -> Result<u64, Error> {
        if !self.reuses_nodes() {
            coupling.initialise(exchange)?;
        }
        let Some(ResumePoint { checkpoint, states, fit, .. }) = &self.origin else { return Ok(0) };
        checkpoint.system.restore(exchange, coupling, states.as_deref(), &self.fingerprint, fit)?;
        Ok(checkpoint.system.tick)
    }

    fn on_communication_point(
        &mut self,
        tick: u64,
        exchange: &mut Exchange,
        coupling: &mut dyn CouplingAlgorithm,
    ) -> Result<(), Error> {
        if self.origin.is_none() && self.requests.is_empty() && self.saved.is_empty() {
            return Ok(());
        }
        self.save_and_compare(tick, exchange, coupling)
    }

    fn keeps_nodes(&self) -> bool {
        matches!(self.role, WarmStartRole::WarmUp | WarmStartRole::Branch { last: false })
    }
}

impl CheckpointPlan {
    /// Compares the run with that which it resumes, and saves the checkpoints of this communication point.
    #[inline(never)]
    fn save_and_compare(
        &mut self,
        tick: u64,
        exchange: &mut Exchange,
        coupling: &mut dyn CouplingAlgorithm,
    ) -> Result<(), Error> {
        self.compare_with_original(tick, exchange);
        for saved in self.saved.iter_mut().filter(|saved| !saved.complete) {
            saved.complete = !saved.checkpoint.system.add_following_row(exchange.row());
            if saved.complete {
                saved.write(&self.folder)?;
            }
        }
        let Some(index) = self.requests.iter().position(|it| it.tick == tick) else {
            return Ok(());
        };
        let request = self.requests.remove(index);
        let in_bytes = self.role == WarmStartRole::Standalone;
        let (system, states) =
            Checkpoint::capture(exchange, coupling, &self.scenario, &self.fingerprint, tick, in_bytes)?;
        let mut memories = self.check_memories.lock().unwrap_or_else(PoisonError::into_inner);
        let checkpoint = RunCheckpoint { system, checks: std::mem::take(&mut *memories) };
        let file = in_bytes.then(|| request.file_name());
        if let Some(file) = &file {
            fmu_import::restore_folder_and_permissions();
            // It has this name until it is whole.
            PreviousRun::note_file_before_writing(&self.folder, &format!("{file}.partial"))?;
            PreviousRun::note_file_before_writing(&self.folder, file)?;
        }
        let saved = SavedCheckpoint { checkpoint, states, file, complete: false };
        // A run that is killed in the next step leaves it nevertheless.
        saved.write(&self.folder)?;
        self.saved.push(saved);
        Ok(())
    }
}

impl CheckpointPlan {
    /// Compares the resumed run with the original one, as long as nothing was changed on purpose.
    fn compare_with_original(&mut self, tick: u64, exchange: &Exchange) {
        let Some(origin) = self.origin.as_mut().filter(|origin| origin.repeats) else { return };
        let Some(index) = tick.checked_sub(origin.checkpoint.system.tick + 1) else { return };
        let now = exchange.row();
        let then = origin.checkpoint.system.following_row(index as usize, now, exchange);
        let Some(then) = then else {
            origin.repeats = false;
            return;
        };
        let time = exchange.clock().time_at(tick);
        let found = output_differences(exchange.columns(), &then, now, time);
        origin.repeats = found.is_empty();
        self.warnings.extend(OutputDifference::describe_differences(&found, origin.checkpoint.system.time));
    }
}
