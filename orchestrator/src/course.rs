//! Knows where a run begins, which checkpoints it leaves, and whether it goes on as the run did that it comes from.

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

use crate::branch::Held;
use crate::checkpoint_file::{self, RunCheckpoint};
use crate::options::{Role, RunOptions};
use crate::report::{PreviousRun, Resumed, RunReport};

/// What the checks remember at the checkpoint that is to be taken next.
pub(crate) type Remembered = Arc<Mutex<Vec<CheckMemory>>>;

/// Where a run begins, and which checkpoints it leaves.
pub(crate) struct Course {
    scenario: String,
    fingerprint: SystemFingerprint,
    origin: Option<Origin>,
    wanted: Vec<Wanted>,
    taken: Vec<Taken>,
    folder: PathBuf,
    remembered: Remembered,
    role: Role,
    warnings: Vec<String>,
}

/// The checkpoint that a run goes on from.
pub(crate) struct Origin {
    pub checkpoint: RunCheckpoint,
    /// The states of its nodes, if these are those of the run that it comes from.
    pub states: Option<Rc<States>>,
    /// Where it comes from.
    pub place: String,
    fit: Compatibility,
    /// Whether the run still goes on in the same way.
    same: bool,
}

/// A checkpoint to be taken at a communication point.
struct Wanted {
    tick: u64,
    /// [s]
    time: f64,
}

impl Wanted {
    fn file(&self) -> String {
        format!("checkpoint_{}.state", rounded(self.time))
    }
}

/// A checkpoint that was taken, and its file, if it has one.
struct Taken {
    checkpoint: RunCheckpoint,
    states: States,
    file: Option<String>,
    complete: bool,
}

impl Course {
    /// Prepares the course of a run before anything of it begins.
    ///
    /// # Errors
    /// When FMUs cannot do what checkpoints need, when a time is none of the run's, when the checkpoint to go on from cannot be read or
    /// is one of another system.
    pub fn plan(plan: &RunPlan, options: &RunOptions, held: Option<&Held>) -> Result<Self, Error> {
        let alone = options.checkpoints.is_empty() && options.resume.is_none() && held.is_none();
        // Fingerprints of large tables take their time.
        let fingerprint =
            if alone { SystemFingerprint::default() } else { SystemFingerprint::of(&plan.system) };
        let in_bytes = options.role == Role::Alone;
        let mut mistakes = Mistakes::default();
        if !options.checkpoints.is_empty() {
            mistakes.take(check_able(&plan.system, in_bytes));
        }
        let mut warnings = Vec::new();
        let wanted = options.checkpoints.iter().map(|time| wanted(*time, plan.system.clock));
        let wanted = mistakes.take(Mistakes::all(wanted)).unwrap_or_default();
        let mut wanted: Vec<Wanted> = wanted
            .into_iter()
            .map(|(wanted, warning)| {
                warnings.extend(warning);
                wanted
            })
            .collect();
        wanted.sort_by_key(|it| it.tick);
        wanted.dedup_by_key(|it| it.tick);
        let origin = mistakes.take(origin(plan, &fingerprint, options, held)).flatten();
        mistakes.finish()?;
        let before = origin.as_ref().map_or(0, |origin| origin.checkpoint.system.tick);
        if let Some(early) = wanted.iter().find(|it| it.tick < before) {
            let [early, begin] = [early.time, plan.system.clock.at(before)].map(rounded);
            return Err(Error::input(format!(
                "--checkpoint {early}: the run begins at {begin} s, where its checkpoint is"
            )));
        }
        Ok(Course {
            scenario: plan.header.scenario.clone(),
            fingerprint,
            origin,
            wanted,
            taken: Vec::new(),
            folder: plan.header.folder.clone(),
            remembered: Remembered::default(),
            role: options.role,
            warnings,
        })
    }

    /// The first communication point of the run.
    pub fn first(&self) -> u64 {
        self.origin.as_ref().map_or(0, |origin| origin.checkpoint.system.tick)
    }

    /// Refuses to replace files of others: those of an earlier run are set aside by now.
    ///
    /// # Errors
    /// When there is one with the name of a checkpoint.
    pub fn claim(&self) -> Result<(), Error> {
        let mut files = self.wanted.iter().map(|it| it.file()).filter(|_| self.role == Role::Alone);
        match files.find(|file| std::fs::symlink_metadata(self.folder.join(file)).is_ok()) {
            None => Ok(()),
            Some(file) => Err(Error::input(format!(
                "the results cannot go to {}: it holds {file}, and no report says that a run wrote it",
                self.folder.display()
            ))
            .help("move it to another place, or name another folder: --out FOLDER")),
        }
    }

    /// Whether others go on from it in this process.
    pub fn is_warm_up(&self) -> bool {
        self.role == Role::WarmUp
    }

    /// The checkpoint that it goes on from.
    pub fn origin(&self) -> Option<&RunCheckpoint> {
        self.origin.as_ref().map(|origin| &origin.checkpoint)
    }

    /// The communication points at which the checks have to be remembered, and where.
    pub fn remembers(&self) -> (Vec<u64>, Remembered) {
        (self.wanted.iter().map(|it| it.tick).collect(), Arc::clone(&self.remembered))
    }

    /// What the report says about the beginning.
    pub fn resumed(&self) -> Option<Resumed> {
        let Origin { checkpoint, place, fit, .. } = self.origin.as_ref()?;
        Some(Resumed {
            checkpoint: place.clone(),
            scenario: checkpoint.system.name.clone(),
            time: rounded(checkpoint.system.time),
            changes: fit.changes.clone(),
        })
    }

    /// Puts its files and what is to be told after the run into the report.
    pub fn tell(&mut self, report: &mut RunReport) {
        report.files.extend(self.taken.iter().filter_map(|taken| taken.file.clone()));
        report.warnings.append(&mut self.warnings);
    }

    /// Whether nodes are those of an earlier run.
    pub fn takes_over(&self) -> bool {
        self.origin.as_ref().is_some_and(|origin| origin.states.is_some())
    }

    /// The last checkpoint, for runs that go on in this process.
    pub fn into_last(mut self) -> Option<(RunCheckpoint, States)> {
        self.taken.pop().map(|taken| (taken.checkpoint, taken.states))
    }

    /// Completes the files after the run, and tries whether new nodes go on from the checkpoints as the nodes of the run did. They do so
    /// in processes of their own, so whatever an FMU forgets is not there. `whole` tells whether the run came to its end.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn conclude(
        &mut self,
        system: &mut System,
        nodes: &mut [Box<dyn Node>],
        host: Option<&Host>,
        whole: bool,
    ) -> Result<(), Error> {
        let missed = self.wanted.iter().map(|it| {
            format!("there is no checkpoint at {} s: the run ended before", rounded(it.time))
        });
        self.warnings.extend(missed);
        for taken in self.taken.iter_mut().filter(|taken| !taken.complete) {
            taken.write(&self.folder)?;
        }
        if !whole {
            return Ok(());
        }
        for taken in &self.taken {
            let mut coupling = coupling::of(system);
            let tried = match (&taken.file, host) {
                (Some(_), None) => continue,
                (None, _) => taken.rehearse(system, nodes, coupling.as_mut()),
                (Some(_), Some(host)) => {
                    taken.rehearse_apart(system, nodes, coupling.as_mut(), host)
                }
            };
            let time = taken.checkpoint.system.time;
            self.warnings.extend(match tried {
                Ok(found) => Difference::warning(&found, time),
                Err(error) => Some(format!(
                    "nothing goes on from the checkpoint at {} s: {error}",
                    rounded(time)
                )),
            });
        }
        Ok(())
    }
}

impl Taken {
    fn write(&self, folder: &Path) -> Result<(), Error> {
        match &self.file {
            Some(file) => checkpoint_file::write(&folder.join(file), &self.checkpoint),
            None => Ok(()),
        }
    }

    fn rehearse(
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

    fn rehearse_apart(
        &self,
        system: &mut System,
        nodes: &mut [Box<dyn Node>],
        coupling: &mut dyn Coupling,
        host: &Host,
    ) -> Result<Vec<Difference>, Error> {
        let mut twins = node::isolated_copies(system, nodes, host)?;
        let found = cosim::checkpoint::rehearse(
            &self.checkpoint.system,
            system,
            &mut twins,
            coupling,
            None,
        );
        node::return_sources(system, nodes, twins);
        found
    }
}

/// The communication point of a time that was asked for, and what to tell if it is not at that time.
fn wanted(time: f64, clock: Clock) -> Result<(Wanted, Option<String>), Error> {
    let steps = (time - clock.start) / clock.step;
    let nearest = steps.round();
    // A millionth of a step is rounding.
    let tick = if (steps - nearest).abs() < 1e-6 { nearest } else { steps.ceil() };
    if !(0.0..=clock.steps as f64).contains(&tick) {
        let (start, stop) = (rounded(clock.start), rounded(clock.stop()));
        return Err(Error::input(format!(
            "--checkpoint {time}: expected a time from {start} s to {stop} s, of the run"
        )));
    }
    let at = rounded(clock.at(tick as u64));
    let warning = (tick != nearest || (steps - nearest).abs() >= 1e-6).then(|| {
        format!("--checkpoint {time}: it is taken at {at} s, the next communication point")
    });
    let tick = tick as u64;
    Ok((Wanted { tick, time: clock.at(tick) }, warning))
}

/// The checkpoint that the options name, if it fits.
fn origin(
    plan: &RunPlan,
    fingerprint: &SystemFingerprint,
    options: &RunOptions,
    held: Option<&Held>,
) -> Result<Option<Origin>, Error> {
    let (checkpoint, place, states, mut misfits) = match (options.role, held, &options.resume) {
        (Role::End { .. }, Some(held), _) => {
            let (checkpoint, states) = (held.checkpoint.clone(), Rc::clone(&held.states));
            (
                checkpoint,
                held.checkpoint.system.name.clone(),
                Some(states),
                held.misfits(&plan.system),
            )
        }
        (_, _, Some(path)) => {
            let inside = std::fs::canonicalize(path)
                .ok()
                .zip(std::fs::canonicalize(&plan.header.folder).ok());
            if inside.is_some_and(|(file, folder)| file.starts_with(folder)) {
                let (file, folder) = (path.display(), plan.header.folder.display());
                let message =
                    format!("--resume {file}: it is in {folder}, whose files this run replaces");
                return Err(
                    Error::input(message).help("name another folder for this run: --out FOLDER")
                );
            }
            (checkpoint_file::read(path)?, path.display().to_string(), None, Vec::new())
        }
        _ => return Ok(None),
    };
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
        let same = fit.changes.is_empty();
        return Ok(Some(Origin { checkpoint, states, place, fit, same }));
    }
    let scenario = &checkpoint.system.name;
    let message = format!(
        "the checkpoint of `{scenario}` at {time} s ({place}) does not fit: {}",
        misfits.join("; ")
    );
    Err(Error::input(message).help("a run that goes on may have other tunable parameters, signals, effects, faults, checks and another stop time; for all else write a new checkpoint"))
}

impl RunObserver for Course {
    fn initialise(
        &mut self,
        exchange: &mut Exchange,
        coupling: &mut dyn Coupling,
    ) -> Result<u64, Error> {
        if !self.takes_over() {
            coupling.initialise(exchange)?;
        }
        let Some(Origin { checkpoint, states, fit, .. }) = &self.origin else { return Ok(0) };
        checkpoint.system.restore(exchange, coupling, states.as_deref(), &self.fingerprint, fit)?;
        Ok(checkpoint.system.tick)
    }

    fn on_communication_point(
        &mut self,
        tick: u64,
        exchange: &mut Exchange,
        coupling: &mut dyn Coupling,
    ) -> Result<(), Error> {
        self.compare(tick, exchange);
        for taken in self.taken.iter_mut().filter(|taken| !taken.complete) {
            taken.complete = !taken.checkpoint.system.follow(exchange.row());
            if taken.complete {
                taken.write(&self.folder)?;
            }
        }
        let Some(place) = self.wanted.iter().position(|it| it.tick == tick) else { return Ok(()) };
        let wanted = self.wanted.remove(place);
        let in_bytes = self.role == Role::Alone;
        let taken = Checkpoint::take(
            exchange,
            coupling,
            &self.scenario,
            &self.fingerprint,
            tick,
            in_bytes,
        )?;
        let (system, states) = taken;
        let mut remembered = self.remembered.lock().unwrap_or_else(PoisonError::into_inner);
        let checkpoint = RunCheckpoint { system, checks: std::mem::take(&mut *remembered) };
        let file = in_bytes.then(|| wanted.file());
        if let Some(file) = &file {
            // It has this name until it is whole.
            PreviousRun::note(&self.folder, &format!("{file}.partial"))?;
            PreviousRun::note(&self.folder, file)?;
        }
        let taken = Taken { checkpoint, states, file, complete: false };
        // A run that is killed in the next step leaves it nevertheless.
        taken.write(&self.folder)?;
        self.taken.push(taken);
        Ok(())
    }

    fn keeps_nodes(&self) -> bool {
        matches!(self.role, Role::WarmUp | Role::End { last: false })
    }
}

impl Course {
    /// Compares the run with the one that it comes from, as long as nothing is to be another.
    fn compare(&mut self, tick: u64, exchange: &Exchange) {
        let Some(origin) = self.origin.as_mut().filter(|origin| origin.same) else { return };
        let Some(index) = tick.checked_sub(origin.checkpoint.system.tick + 1) else { return };
        let now = exchange.row();
        let then = origin.checkpoint.system.following_in(index as usize, now, exchange);
        let Some(then) = then else {
            origin.same = false;
            return;
        };
        let time = exchange.clock().at(tick);
        let found = differences(exchange.columns(), &then, now, time);
        origin.same = found.is_empty();
        self.warnings.extend(Difference::warning(&found, origin.checkpoint.system.time));
    }
}
