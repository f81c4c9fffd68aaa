//! The checkpoint that a run resumes from, those that it saves, and the comparison of the resumed run with the original one.

use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::{Arc, Mutex, PoisonError};

use assessment::check::CheckMemory;
use cosim::checkpoint::{
    Checkpoint, Compatibility, Difference, States, SystemFingerprint, check_able, differences,
};
use cosim::clock::Clock;
use cosim::coupling::{self, Coupling};
use cosim::exchange::Exchange;
use cosim::master::RunObserver;
use cosim::node::{self, Host, Node};
use cosim::system::System;
use diagnostics::{Error, Mistakes, rounded};
use scenario::plan::RunPlan;

use crate::checkpoint_file::{self, RunCheckpoint};
use crate::options::{BranchRole, RunOptions};
use crate::report::{PreviousRun, ResumeReport, RunReport};
use crate::warm_start::WarmStart;

/// What the checks remember at the checkpoint that is to be saved next.
pub(crate) type CheckMemories = Arc<Mutex<Vec<CheckMemory>>>;

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
    role: BranchRole,
    warnings: Vec<String>,
}

/// The checkpoint that a run resumes from.
pub(crate) struct ResumePoint {
    pub checkpoint: RunCheckpoint,
    /// The states of its nodes, if these are those of the run that it comes from.
    pub states: Option<Rc<States>>,
    /// Its file, or the scenario of the run in this process.
    pub label: String,
    fit: Compatibility,
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
    fn file(&self) -> String {
        format!("checkpoint_{}.state", rounded(self.time))
    }
}

/// A checkpoint that was saved, and its file, if it has one.
struct SavedCheckpoint {
    checkpoint: RunCheckpoint,
    states: States,
    file: Option<String>,
    complete: bool,
}

impl CheckpointPlan {
    /// Checks the checkpoint options of a run before anything of it begins.
    ///
    /// # Errors
    /// When FMUs cannot do what checkpoints need, when a time is none of the run's, when the checkpoint to resume from cannot be read
    /// or is one of another system.
    pub fn new(
        plan: &RunPlan,
        options: &RunOptions,
        warm_start: Option<&WarmStart>,
    ) -> Result<Self, Error> {
        let alone =
            options.checkpoints.is_empty() && options.resume.is_none() && warm_start.is_none();
        // Fingerprints of large tables take their time.
        let fingerprint =
            if alone { SystemFingerprint::default() } else { SystemFingerprint::of(&plan.system) };
        let in_bytes = options.role == BranchRole::Standalone;
        let mut mistakes = Mistakes::default();
        if !options.checkpoints.is_empty() {
            mistakes.take(check_able(&plan.system, in_bytes));
        }
        let mut warnings = Vec::new();
        let mut requests: Vec<CheckpointRequest> = Vec::new();
        for time in &options.checkpoints {
            let request =
                mistakes.take(CheckpointRequest::at(*time, plan.system.clock, &mut warnings));
            requests.extend(request);
        }
        requests.sort_by_key(|it| it.tick);
        requests.dedup_by_key(|it| it.tick);
        let origin = mistakes.take(resume_point(plan, &fingerprint, options, warm_start)).flatten();
        mistakes.finish()?;
        let before = origin.as_ref().map_or(0, |origin| origin.checkpoint.system.tick);
        if let Some(early) = requests.iter().find(|it| it.tick < before) {
            let [early, begin] = [early.time, plan.system.clock.at(before)].map(rounded);
            return Err(Error::input(format!(
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
        let mut files = self
            .requests
            .iter()
            .map(|it| it.file())
            .filter(|_| self.role == BranchRole::Standalone);
        match files.find(|file| std::fs::symlink_metadata(self.folder.join(file)).is_ok()) {
            None => Ok(()),
            Some(file) => Err(Error::input(format!(
                "the results cannot go to {}: it holds {file}, and no report says that a run wrote it",
                self.folder.display()
            ))
            .help("move it to another place, or name another folder: --out FOLDER")),
        }
    }

    /// Whether branches start from its last checkpoint in this process.
    pub fn is_warm_up(&self) -> bool {
        self.role == BranchRole::WarmUp
    }

    /// The checkpoint that the run resumes from.
    pub fn origin(&self) -> Option<&RunCheckpoint> {
        self.origin.as_ref().map(|origin| &origin.checkpoint)
    }

    /// The communication points at which the states of the checks are copied, and where to.
    pub fn check_snapshots(&self) -> CheckSnapshots {
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
            time: rounded(checkpoint.system.time),
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
    pub fn into_last_checkpoint(mut self) -> Option<(RunCheckpoint, States)> {
        self.saved.pop().map(|saved| (saved.checkpoint, saved.states))
    }

    /// Completes the files after the run, and verifies the checkpoints: new nodes must repeat the steps that followed. They do so in
    /// processes of their own, so whatever an FMU does not save is not there. `completed` tells whether the run came to its end.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn finish(
        &mut self,
        system: &mut System,
        nodes: &mut [Box<dyn Node>],
        host: Option<&Host>,
        completed: bool,
    ) -> Result<(), Error> {
        let missed = self.requests.iter().map(|it| {
            format!("there is no checkpoint at {} s: the run ended before", rounded(it.time))
        });
        self.warnings.extend(missed);
        for saved in self.saved.iter_mut().filter(|saved| !saved.complete) {
            saved.write(&self.folder)?;
        }
        if !completed {
            return Ok(());
        }
        for saved in &self.saved {
            let mut coupling = coupling::of(system);
            let verified = match (&saved.file, host) {
                (Some(_), None) => continue,
                (None, _) => saved.verify(system, nodes, coupling.as_mut()),
                (Some(_), Some(host)) => {
                    saved.verify_in_new_processes(system, nodes, coupling.as_mut(), host)
                }
            };
            let time = saved.checkpoint.system.time;
            self.warnings.extend(match verified {
                Ok(differences) => Difference::warning(&differences, time),
                Err(error) => Some(format!(
                    "nothing goes on from the checkpoint at {} s: {error}",
                    rounded(time)
                )),
            });
        }
        Ok(())
    }
}

impl SavedCheckpoint {
    fn write(&self, folder: &Path) -> Result<(), Error> {
        match &self.file {
            Some(file) => checkpoint_file::write(&folder.join(file), &self.checkpoint),
            None => Ok(()),
        }
    }

    /// Repeats the steps after the checkpoint with the nodes of the run.
    fn verify(
        &self,
        system: &mut System,
        nodes: &mut [Box<dyn Node>],
        coupling: &mut dyn Coupling,
    ) -> Result<Vec<Difference>, Error> {
        cosim::checkpoint::rehearse(
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
        coupling: &mut dyn Coupling,
        host: &Host,
    ) -> Result<Vec<Difference>, Error> {
        let mut twins = node::isolated_copies(system, nodes, host)?;
        let differences = cosim::checkpoint::rehearse(
            &self.checkpoint.system,
            system,
            &mut twins,
            coupling,
            None,
        );
        node::return_sources(system, nodes, twins);
        differences
    }
}

impl CheckpointRequest {
    /// The communication point at or after a time that was asked for; a warning says so when it is after it.
    fn at(time: f64, clock: Clock, warnings: &mut Vec<String>) -> Result<Self, Error> {
        let steps = (time - clock.start) / clock.step;
        let nearest = steps.round();
        // A millionth of a step is rounding.
        let is_point = (steps - nearest).abs() < 1e-6;
        let tick = if is_point { nearest } else { steps.ceil() };
        if !(0.0..=clock.steps as f64).contains(&tick) {
            let (start, stop) = (rounded(clock.start), rounded(clock.stop()));
            return Err(Error::input(format!(
                "--checkpoint {time}: expected a time from {start} s to {stop} s, of the run"
            )));
        }
        let request = CheckpointRequest { tick: tick as u64, time: clock.at(tick as u64) };
        if !is_point {
            let at = rounded(request.time);
            warnings.push(format!(
                "--checkpoint {time}: it is taken at {at} s, the next communication point"
            ));
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
        (BranchRole::Branch { .. }, Some(warm), _) => {
            checkpoint = warm.checkpoint.clone();
            label = warm.checkpoint.system.name.clone();
            states = Some(Rc::clone(&warm.states));
            misfits = warm.misfits(&plan.system);
        }
        (_, _, Some(path)) => {
            refuse_own_folder(path, &plan.header.folder)?;
            checkpoint = checkpoint_file::read(path)?;
            label = path.display().to_string();
            states = None;
            misfits = Vec::new();
        }
        _ => return Ok(None),
    }
    let fit = fingerprint.compare(&checkpoint.system.fingerprint, &plan.system);
    misfits.extend(fit.misfits.iter().cloned());
    let time = rounded(checkpoint.system.time);
    if checkpoint.system.tick > plan.system.clock.steps {
        misfits.push(format!(
            "it is at {time} s, after the end of this run at {} s",
            rounded(plan.system.clock.stop())
        ));
    }
    if misfits.is_empty() {
        let repeats = fit.changes.is_empty();
        return Ok(Some(ResumePoint { checkpoint, states, label, fit, repeats }));
    }
    let scenario = &checkpoint.system.name;
    let message = format!(
        "the checkpoint of `{scenario}` at {time} s ({label}) does not fit: {}",
        misfits.join("; ")
    );
    Err(Error::input(message).help("a run that goes on may have other tunable parameters, signals, effects, faults, checks and another stop time; for all else write a new checkpoint"))
}

/// Refuses a checkpoint in the folder of the run, whose files the run replaces.
fn refuse_own_folder(file: &Path, folder: &Path) -> Result<(), Error> {
    let real = |path: &Path| std::fs::canonicalize(path).ok();
    if !real(file).zip(real(folder)).is_some_and(|(file, folder)| file.starts_with(folder)) {
        return Ok(());
    }
    let (file, folder) = (file.display(), folder.display());
    let message = format!("--resume {file}: it is in {folder}, whose files this run replaces");
    Err(Error::input(message).help("name another folder for this run: --out FOLDER"))
}

impl RunObserver for CheckpointPlan {
    fn initialise(
        &mut self,
        exchange: &mut Exchange,
        coupling: &mut dyn Coupling,
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
        coupling: &mut dyn Coupling,
    ) -> Result<(), Error> {
        self.compare_with_original(tick, exchange);
        for saved in self.saved.iter_mut().filter(|saved| !saved.complete) {
            saved.complete = !saved.checkpoint.system.follow(exchange.row());
            if saved.complete {
                saved.write(&self.folder)?;
            }
        }
        let Some(index) = self.requests.iter().position(|it| it.tick == tick) else {
            return Ok(());
        };
        let request = self.requests.remove(index);
        let in_bytes = self.role == BranchRole::Standalone;
        let (system, states) = Checkpoint::take(
            exchange,
            coupling,
            &self.scenario,
            &self.fingerprint,
            tick,
            in_bytes,
        )?;
        let mut memories = self.check_memories.lock().unwrap_or_else(PoisonError::into_inner);
        let checkpoint = RunCheckpoint { system, checks: std::mem::take(&mut *memories) };
        let file = in_bytes.then(|| request.file());
        if let Some(file) = &file {
            // It has this name until it is whole.
            PreviousRun::note(&self.folder, &format!("{file}.partial"))?;
            PreviousRun::note(&self.folder, file)?;
        }
        let saved = SavedCheckpoint { checkpoint, states, file, complete: false };
        // A run that is killed in the next step leaves it nevertheless.
        saved.write(&self.folder)?;
        self.saved.push(saved);
        Ok(())
    }

    fn keeps_nodes(&self) -> bool {
        matches!(self.role, BranchRole::WarmUp | BranchRole::Branch { last: false })
    }
}

impl CheckpointPlan {
    /// Compares the resumed run with the original one, as long as nothing was changed on purpose.
    fn compare_with_original(&mut self, tick: u64, exchange: &Exchange) {
        let Some(origin) = self.origin.as_mut().filter(|origin| origin.repeats) else { return };
        let Some(index) = tick.checked_sub(origin.checkpoint.system.tick + 1) else { return };
        let now = exchange.row();
        let then = origin.checkpoint.system.following_in(index as usize, now, exchange);
        let Some(then) = then else {
            origin.repeats = false;
            return;
        };
        let time = exchange.clock().at(tick);
        let found = differences(exchange.columns(), &then, now, time);
        origin.repeats = found.is_empty();
        self.warnings.extend(Difference::warning(&found, origin.checkpoint.system.time));
    }
}
