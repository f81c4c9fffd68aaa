//! Makes a suite of scenarios from what a team has: FMUs and reference results in a folder.

mod collection;
mod experiment;
mod fmu_case;
mod reference;
mod system_case;
mod toml_text;

use std::collections::{BTreeMap, HashSet};
use std::fs::File;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};

use diagnostics::Error;
use fmu_import::{Fmu, FmuDescription};
use scenario::document::node_name;
use scenario::plan::RunPlan;
use scenario::resolve::Overrides;
use scenario::{BuildArtifacts, Scenario};

use crate::relative_path::{real_path, relative_path};
use collection::{FmuCollection, FmuFiles};
use experiment::{ExperimentOptions, case_experiment};
use fmu_case::{FmuCase, InputTables};
use reference::ReferenceResults;
use system_case::SystemPart;

/// The folder of the suite with the recordings of references and first runs.
const RECORDINGS: &str = "reference";

/// Why an FMU without results has no scenario of its own.
const NO_REFERENCE: &str = "no reference beside it: NAME_ref.csv, NAME_out.csv or NAME.csv";

/// The scenarios that were made of a folder.
#[derive(Debug, Default)]
pub struct SuiteCreation {
    /// The number of FMUs in the folder.
    pub fmus: usize,
    /// The scenarios.
    pub cases: Vec<SuiteCase>,
    /// FMUs, systems and folders without a scenario, with the reason.
    pub omissions: Vec<String>,
}

/// A scenario of the suite.
#[derive(Debug)]
pub struct SuiteCase {
    /// The file.
    pub path: PathBuf,
    /// What became of it.
    pub state: FileState,
    /// What it runs and what it compares with.
    pub summary: String,
    /// What was left out of it, and why.
    pub notes: Vec<String>,
    /// Whether its first run becomes its baseline.
    pub needs_first_run: bool,
}

/// What became of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileState {
    /// It is new.
    Written,
    /// It was there with the same text.
    Same,
    /// It was there with another text, and stays as it is.
    Kept,
}

/// Writes the scenarios of the FMUs in `folder` into `suite`, and overwrites nothing. Runs no code of any FMU.
///
/// # Errors
/// When there is no FMU, or the suite cannot be written.
pub fn create_suite(folder: &Path, suite: &Path) -> Result<SuiteCreation, Error> {
    // The suite may be the folder itself.
    let collection = FmuCollection::find(folder, &[suite, &suite.join(RECORDINGS)])?;
    if collection.fmus.is_empty() && collection.systems.is_empty() {
        let error = Error::invalid_input(format!("expected FMUs in {}, found none", folder.display()));
        return Err(match collection.problems.as_slice() {
            [] => error.with_help("it looks for *.fmu in the folder and in all folders inside of it"),
            problems => error.with_help(problems.join("; ")),
        });
    }
    let mut writer = SuiteWriter {
        root: folder.to_owned(),
        suite: suite.to_owned(),
        real_suite: real_path(suite),
        names: CaseNames::new(&collection),
        creation: SuiteCreation { fmus: collection.fmus.len(), ..SuiteCreation::default() },
    };
    writer.creation.omissions.extend(collection.problems);
    let mut folders: BTreeMap<PathBuf, Vec<SystemPart>> = BTreeMap::new();
    for files in &collection.fmus {
        writer.add_fmu(files, &mut folders)?;
    }
    for (folder, parts) in &folders {
        writer.add_system(folder, parts)?;
    }
    for system in &collection.systems {
        writer.add_ssp(system)?;
    }
    Ok(writer.creation)
}

/// Names of cases that no two of them share: `trackside test` names folders by them.
struct CaseNames {
    of_fmus: BTreeMap<PathBuf, String>,
    taken: HashSet<String>,
}

impl CaseNames {
    /// Names FMUs by their files, and those of one name by the folders that they are in, too.
    fn new(collection: &FmuCollection) -> Self {
        let mut names = CaseNames { of_fmus: BTreeMap::new(), taken: HashSet::new() };
        let fmus: Vec<_> = collection.fmus.iter().map(|files| files.fmu.as_path()).collect();
        let mut count: BTreeMap<String, usize> = BTreeMap::new();
        for fmu in &fmus {
            *count.entry(short_name(fmu).to_lowercase()).or_default() += 1;
        }
        // The folders that all FMUs are in tell none from another.
        let shared = fmus.iter().filter_map(|fmu| fmu.parent().map(Path::to_owned)).reduce(|a, b| {
            let shared = a.components().zip(b.components()).take_while(|(a, b)| a == b);
            shared.map(|(part, _)| part).collect()
        });
        for fmu in fmus {
            let short = short_name(fmu);
            let name = match count[&short.to_lowercase()] {
                1 => short,
                _ => {
                    let inside = fmu.strip_prefix(shared.as_deref().unwrap_or(Path::new(""))).unwrap_or(fmu);
                    let folders = inside.parent().into_iter().flat_map(Path::components);
                    let folders = folders.map(|part| plain_name(&part.as_os_str().to_string_lossy()));
                    let parts = folders.filter(|part| *part != short).chain([short.clone()]);
                    parts.collect::<Vec<_>>().join("_")
                }
            };
            let name = names.unique_name(name);
            names.of_fmus.insert(fmu.to_owned(), name);
        }
        names
    }

    /// A name that no case has, also where files differ by more than small letters only.
    fn unique_name(&mut self, name: String) -> String {
        let mut unique = name.clone();
        for number in 2.. {
            if self.taken.insert(unique.to_lowercase()) {
                break;
            }
            unique = format!("{name}_{number}");
        }
        unique
    }
}

fn short_name(path: &Path) -> String {
    plain_name(&path.file_stem().unwrap_or_default().to_string_lossy())
}

/// A name without what shells, reports or file systems take for something else.
fn plain_name(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect()
}

/// Whether a system of SSP can run here; nothing of it is loaded.
fn check_system(path: &Path) -> Result<(), String> {
    let first =
        |error: Error| error.into_single_errors().first().map(ToString::to_string).unwrap_or_default();
    let scenario = Scenario::read(path).map_err(first)?;
    let (nothing, overrides) = (BuildArtifacts::default(), Overrides::default());
    RunPlan::resolve(&scenario, &nothing, &overrides, PathBuf::new()).map(drop).map_err(first)
}

/// Writes cases into a suite.
struct SuiteWriter {
    root: PathBuf,
    suite: PathBuf,
    /// The suite without links.
    real_suite: PathBuf,
    names: CaseNames,
    creation: SuiteCreation,
}

impl SuiteWriter {
    /// Adds the case of an FMU with a reference, and notes it as a part of the system of its folder.
    fn add_fmu(
        &mut self,
        files: &FmuFiles,
        folders: &mut BTreeMap<PathBuf, Vec<SystemPart>>,
    ) -> Result<(), Error> {
        let (description, archive) = match self.open_fmu(&files.fmu) {
            Ok(opened) => opened,
            Err(reason) => {
                self.omit(&files.fmu, &reason);
                return Ok(());
            }
        };
        match (&files.reference, files.candidates.as_slice()) {
            (Some(reference), _) => self.add_fmu_case(files, reference, &description, &archive)?,
            (None, []) => {}
            (None, candidates) => {
                let names: Vec<_> = candidates.iter().map(|path| self.shown_path(path)).collect();
                let listed = diagnostics::suggest::join_shortened(&names);
                self.omit(&files.fmu, &format!("several references, none beside it: {listed}"));
            }
        }
        if !files.is_in_system {
            let is_told = files.reference.is_some() || !files.candidates.is_empty();
            let folder = files.fmu.parent().unwrap_or(Path::new("")).to_owned();
            let parts = folders.entry(folder).or_default();
            let stem = files.fmu.file_stem().unwrap_or_default().to_string_lossy();
            let mut node = node_name(&stem);
            while parts.iter().any(|part| part.node == node) {
                node.push('_');
            }
            let without_case = (!is_told).then(|| files.fmu.clone());
            parts.push(SystemPart { node, archive, description, without_case });
        }
        Ok(())
    }

    /// The description of an FMU that can run here, and the way to it from the suite.
    fn open_fmu(&self, path: &Path) -> Result<(FmuDescription, String), String> {
        let of_file = |error: fmu_import::OpenError| {
            let text = error.to_string();
            let name = format!("{}", path.display());
            let text = text.strip_prefix(&name).unwrap_or(&text);
            text.trim_start_matches([':', ' ']).to_owned()
        };
        let fmu = Fmu::open(path).map_err(of_file)?;
        fmu.library_origin().map_err(of_file)?;
        let archive = self.path_from_suite(path)?;
        Ok((fmu.description, archive))
    }

    fn path_from_suite(&self, path: &Path) -> Result<String, String> {
        let way = relative_path(&self.real_suite, &real_path(path));
        way.ok_or_else(|| "its path is no text in UTF-8".to_owned())
    }

    fn add_fmu_case(
        &mut self,
        files: &FmuFiles,
        reference_path: &Path,
        description: &FmuDescription,
        archive: &str,
    ) -> Result<(), Error> {
        let reference_name = reference_path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let node = node_name(&files.fmu.file_stem().unwrap_or_default().to_string_lossy());
        let reference = match ReferenceResults::read(reference_path, &node, description) {
            Ok(reference) => reference,
            Err(reason) => {
                self.omit(
                    &files.fmu,
                    &format!("its reference {}: {reason}", self.shown_path(reference_path)),
                );
                return Ok(());
            }
        };
        let mut notes = Vec::new();
        let options = files.options.as_deref().map(ExperimentOptions::read).transpose();
        let options = options.unwrap_or_else(|reason| {
            notes.push(format!("the options were not read: {reason}"));
            None
        });
        let options = options.unwrap_or_default();
        let times = &reference.recording.times;
        let experiment = match case_experiment(description, &options, &reference_name, times) {
            Ok(experiment) => experiment,
            Err(reason) => {
                self.omit(&files.fmu, &reason);
                return Ok(());
            }
        };
        let inputs = files.input.as_deref().map(|file| {
            InputTables::read(file, self.path_from_suite(file)?, description)
                .map_err(|reason| format!("the inputs {}: {reason}", self.shown_path(file)))
        });
        let inputs = inputs.transpose().unwrap_or_else(|reason| {
            notes.push(reason);
            None
        });
        let name = self.names.of_fmus.get(&files.fmu).cloned().unwrap_or_else(|| node.clone());
        let recording = format!("{RECORDINGS}/{name}.csv");
        let case = FmuCase {
            description,
            node: &node,
            archive,
            reference_name: &reference_name,
            reference: &reference,
            recording: &recording,
            experiment: &experiment,
            inputs: inputs.as_ref(),
        };
        let with_inputs = inputs.as_ref().map(|it| format!(", inputs of {}", it.name)).unwrap_or_default();
        notes.extend(reference.notes.iter().chain(inputs.iter().flat_map(|it| &it.notes)).cloned());
        let recording_path = self.suite.join(&recording);
        if self.write_file(&recording_path, &reference.recording.csv_text())? == FileState::Kept {
            notes
                .push(format!("{} was there already with other values, and stays", recording_path.display()));
        }
        let count = reference.recording.columns().len();
        let signals = if count == 1 { "1 signal".to_owned() } else { format!("{count} signals") };
        let summary = format!(
            "{} as {}: {signals}, {}{with_inputs}",
            self.shown_path(&files.fmu),
            self.shown_path(reference_path),
            experiment.describe()
        );
        self.add_case(&name, &case.scenario_text(), summary, notes, false)
    }

    /// Adds the case of the FMUs of a folder, if their names say a connection.
    fn add_system(&mut self, folder: &Path, parts: &[SystemPart]) -> Result<(), Error> {
        let matches = system_case::match_by_name(parts);
        let lone = matches.lone_parts(parts);
        for path in lone.iter().filter_map(|part| part.without_case.as_ref()) {
            self.omit(path, NO_REFERENCE);
        }
        if matches.is_empty() {
            if parts.len() > 1 {
                let count = parts.len();
                let reason =
                    format!("{count} FMUs, and no output has name, type and unit of another one's input");
                self.omit(folder, &format!("no system: {reason}"));
            }
            return Ok(());
        }
        let folder_name = real_path(folder).file_name().unwrap_or_default().to_string_lossy().into_owned();
        let name = self.names.unique_name(format!("{}_system", plain_name(&folder_name)));
        let recording = format!("{RECORDINGS}/{name}.csv");
        let title = format!("The FMUs of {folder_name}, connected by name");
        let text = system_case::system_scenario_text(&title, parts, &matches, &recording);
        let connections = matches.len();
        let summary = format!(
            "{} FMUs of {}: {connections} {} by name, type and unit",
            parts.len() - lone.len(),
            self.shown_path(folder),
            if connections == 1 { "connection" } else { "connections" }
        );
        let mut notes: Vec<_> =
            matches.open_inputs().map(|reason| format!("not connected: {reason}")).collect();
        notes.extend(lone.iter().map(|part| format!("left out: {}, which nothing connects", part.node)));
        let needs_first_run = !self.suite.join(&recording).exists();
        self.add_case(&name, &text, summary, notes, needs_first_run)
    }

    /// Adds the case of a system of SSP, which says its connections itself.
    fn add_ssp(&mut self, system: &Path) -> Result<(), Error> {
        let path = match self.path_from_suite(system) {
            Ok(path) => path,
            Err(reason) => {
                self.omit(system, &reason);
                return Ok(());
            }
        };
        let named_by = match system.extension().is_some_and(|it| it.eq_ignore_ascii_case("ssp")) {
            true => system.to_owned(),
            false => real_path(system.parent().unwrap_or(Path::new(""))),
        };
        let name = self.names.unique_name(short_name(&named_by));
        if let Err(reason) = check_system(system) {
            let inside = reason.replace(&format!("{}/", self.root.display()), "");
            self.omit(system, inside.lines().next().unwrap_or_default());
            return Ok(());
        }
        let recording = format!("{RECORDINGS}/{name}.csv");
        let summary = format!("the system {}", self.shown_path(system));
        let needs_first_run = !self.suite.join(&recording).exists();
        self.add_case(
            &name,
            &system_case::ssp_scenario_text(&path, &recording),
            summary,
            Vec::new(),
            needs_first_run,
        )
    }

    fn add_case(
        &mut self,
        name: &str,
        text: &str,
        summary: String,
        notes: Vec<String>,
        needs_first_run: bool,
    ) -> Result<(), Error> {
        let path = self.suite.join(format!("{name}.toml"));
        let state = self.write_file(&path, text)?;
        self.creation.cases.push(SuiteCase { path, state, summary, notes, needs_first_run });
        Ok(())
    }

    /// Writes a new file.
    fn write_file(&self, path: &Path, text: &str) -> Result<FileState, Error> {
        let failure = |error| Error::output_failure(path, error);
        std::fs::create_dir_all(path.parent().unwrap_or(&self.suite)).map_err(failure)?;
        match File::create_new(path) {
            Ok(mut file) => file.write_all(text.as_bytes()).map(|()| FileState::Written).map_err(failure),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                let is_same = std::fs::read(path).is_ok_and(|there| there == text.as_bytes());
                Ok(if is_same { FileState::Same } else { FileState::Kept })
            }
            Err(error) => Err(failure(error)),
        }
    }

    fn omit(&mut self, path: &Path, reason: &str) {
        let path = self.shown_path(path);
        let line = if reason.starts_with(&path) { reason.to_owned() } else { format!("{path}: {reason}") };
        self.creation.omissions.push(line);
    }

    /// A path inside of the folder.
    fn shown_path(&self, path: &Path) -> String {
        let inside = path.strip_prefix(&self.root).unwrap_or(path);
        let inside = if inside.as_os_str().is_empty() { path } else { inside };
        inside.display().to_string()
    }
}
