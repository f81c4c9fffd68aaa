//! Keeps what a run was made from in one archive beside its recordings, and opens it again to repeat the run.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};

use archive::TemporaryFolder;
use cosim::system::Algorithm;
use diagnostics::Error;
use fmu_import::sha256_hex;
use recording::Recording;
use scenario::bundle::{BundleLayout, BundledFile, SCENARIO, ScenarioBundle};
use scenario::plan::REPORT;
use scenario::resolve::{AnalysisLoading, IsolationPolicy, Override, Overrides};
use scenario::{BuildArtifacts, OverrideValue, Scenario};
use serde::{Deserialize, Serialize};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// The archive, in the folder of a run.
pub const ARCHIVE: &str = "run.inputs.zip";
/// Its entry with what came from outside of the scenario.
const OVERRIDES: &str = "overrides.json";
/// Its entry with the files that are too large to be kept.
const LARGE_FILES: &str = "large_files.json";
/// Its entry with the hashes of the FMUs, of the inputs of a baseline, which are kept without them.
const ARCHIVE_HASHES: &str = "fmus.json";
/// Its entry with the hash of the baseline whose inputs it holds.
const BASELINE_HASH: &str = "baseline.sha256";
/// The folder of FMUs in it.
pub(crate) const FMUS: &str = "fmus/";
/// The folder of all other files.
pub(crate) const FILES: &str = "files/";
/// The page of the report, in the folder of a run.
const REPORT_PAGE: &str = "report.html";
/// A larger file is not kept, but named with its hash [bytes].
const LARGEST: u64 = 64 << 20;

/// Values from outside of a scenario, as they are kept with a run.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct RecordedOverrides {
    /// Start values that give way to those of the scenario.
    #[serde(default)]
    pub defaults: Vec<Override>,
    /// Values that those of the scenario give way to.
    #[serde(default)]
    pub starts: Vec<Override>,
    /// The seed.
    pub seed: Option<u64>,
    /// Relative tolerance of the integration inside the FMUs [-].
    pub tolerance: Option<f64>,
    /// The coupling algorithm.
    pub coupling: Option<Algorithm>,
}

impl RecordedOverrides {
    /// For a run that evaluates nothing.
    #[must_use]
    pub fn to_overrides(&self, isolate: IsolationPolicy) -> Overrides {
        Overrides {
            defaults: self.defaults.clone(),
            starts: self.starts.clone(),
            seed: self.seed,
            tolerance: self.tolerance,
            coupling: self.coupling,
            isolate,
            analyses: AnalysisLoading::Skip,
            trust: false,
        }
    }
}

/// A file that was too large to be kept.
#[derive(Debug, Serialize, Deserialize)]
struct LargeFile {
    /// Its path in the archive, if it were there.
    entry: String,
    path: PathBuf,
    sha256: String,
}

/// Writes the archive of a run into its folder: the scenario as one text, FMUs and files that it reads, and the overrides.
///
/// # Errors
/// When a file cannot be read or written. No half archive stays.
pub fn save_run_inputs(
    scenario: &Scenario,
    built: &BuildArtifacts,
    overrides: &Overrides,
    folder: &Path,
) -> Result<(), Error> {
    let layout = BundleLayout { fmus: "fmus", others: "files", plugins: None };
    let bundle = ScenarioBundle::gather_simulation(scenario, built, layout)?;
    let path = folder.join(ARCHIVE);
    let failed = |error: std::io::Error| Error::output_failure(&path, error);
    let mut archive =
        InputArchive { zip: ZipWriter::new(BufWriter::new(File::create_new(&path).map_err(failed)?)) };
    let written = archive.write_bundle(&bundle, overrides).and_then(|()| {
        let InputArchive { zip } = archive;
        zip.finish().map_err(std::io::Error::from)?.flush()
    });
    written.map_err(|error| {
        let _ = std::fs::remove_file(&path);
        failed(error)
    })
}

struct InputArchive {
    zip: ZipWriter<BufWriter<File>>,
}

impl InputArchive {
    fn write_bundle(&mut self, bundle: &ScenarioBundle, overrides: &Overrides) -> std::io::Result<()> {
        self.write_entry(SCENARIO, bundle.text.as_bytes())?;
        let mut large = Vec::new();
        for (entry, content) in &bundle.files {
            match content {
                BundledFile::Text(text) => self.write_entry(entry, text.as_bytes())?,
                BundledFile::File(path) if std::fs::metadata(path)?.len() > LARGEST => {
                    let sha256 = sha256_hex(&std::fs::read(path)?);
                    large.push(LargeFile { entry: entry.clone(), path: path.clone(), sha256 });
                }
                BundledFile::File(path) => self.write_entry(entry, &std::fs::read(path)?)?,
            }
        }
        let overrides = self.keep_overrides(overrides)?;
        self.write_json(OVERRIDES, &overrides)?;
        self.write_json(LARGE_FILES, &large)
    }

    /// The overrides, with the archives and texts that they name kept as entries and values.
    fn keep_overrides(&mut self, overrides: &Overrides) -> std::io::Result<RecordedOverrides> {
        let mut starts = overrides.starts.clone();
        for (index, start) in starts.iter_mut().enumerate() {
            if let OverrideValue::Typed(path) = &start.value
                && start.variable_name() == "path"
                && let Ok(bytes) = std::fs::read(path)
            {
                let entry = format!("{FMUS}set_{index}.fmu");
                self.write_entry(&entry, &bytes)?;
                start.value = OverrideValue::Typed(entry);
            }
        }
        starts.iter_mut().for_each(inline_text);
        let mut defaults = overrides.defaults.clone();
        defaults.iter_mut().for_each(inline_text);
        let Overrides { seed, tolerance, coupling, .. } = *overrides;
        Ok(RecordedOverrides { defaults, starts, seed, tolerance, coupling })
    }

    fn write_json(&mut self, entry: &str, value: &impl Serialize) -> std::io::Result<()> {
        self.write_entry(entry, &serde_json::to_vec_pretty(value)?)
    }

    /// Archives are compressed already.
    fn write_entry(&mut self, entry: &str, bytes: &[u8]) -> std::io::Result<()> {
        let method =
            if entry.starts_with(FMUS) { CompressionMethod::Stored } else { CompressionMethod::Deflated };
        self.zip.start_file(entry, SimpleFileOptions::default().compression_method(method))?;
        self.zip.write_all(bytes)
    }
}

/// Puts the text of a file in the place of its path: the file may change.
fn inline_text(start: &mut Override) {
    if let OverrideValue::TextOf(path) = &start.value
        && let Ok(text) = std::fs::read_to_string(path)
    {
        start.value = OverrideValue::Toml(toml::Value::String(text));
    }
}

/// What report.json says of a run.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct RecordedReport {
    /// How the run ended.
    pub verdict: String,
    /// Why it did not come to its end.
    pub error: Option<String>,
    /// The checkpoint that it went on from.
    pub resumed: Option<serde_json::Value>,
    /// Its checks.
    pub checks: Vec<RecordedCheck>,
    /// The laps that were completed.
    pub laps: Vec<RecordedLap>,
    /// The values that a sweep collects, by name; none of what is not a number.
    pub collected: BTreeMap<String, Option<f64>>,
    /// The results of analyses by name.
    pub analyses: serde_json::Map<String, serde_json::Value>,
    /// Versions of all that has one.
    pub versions: serde_json::Map<String, serde_json::Value>,
    /// The libraries of plugins that took part.
    pub plugins: Vec<RecordedFile>,
    /// Time that the run took by the clock [s].
    pub wall_seconds: f64,
}

/// A completed lap of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct RecordedLap {
    /// Its number, from 1 on.
    pub number: usize,
    /// Its duration [s]; none if that was no number.
    pub duration: Option<f64>,
}

/// A check of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RecordedCheck {
    /// Its name.
    pub name: String,
    /// What had to hold.
    pub that: String,
    /// Whether it passed; none if it could not be judged.
    pub passed: Option<bool>,
    /// First and last moment of its window [s].
    pub during: [f64; 2],
    /// By how much a comparison was allowed to be off.
    pub tolerance: f64,
    /// How far the worst sample was from failing, tolerance included; negative when it failed.
    pub margin: Option<f64>,
    /// The time of the worst sample [s].
    pub at: Option<f64>,
    /// The left side of the comparison there.
    pub value: Option<f64>,
    /// The right side of the comparison there.
    pub limit: Option<f64>,
    /// The unit of both sides, if they have one.
    pub unit: Option<String>,
    /// Why it failed, in words.
    pub reason: Option<String>,
}

/// A file that took part in a run.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
pub struct RecordedFile {
    /// Where it was.
    pub path: PathBuf,
    /// SHA-256 of its contents.
    pub sha256: String,
}

/// The archive with the inputs of a baseline, beside it: the scenario and its texts, and of FMUs the hashes alone.
#[must_use]
pub fn baseline_archive(baseline: &Path) -> PathBuf {
    let mut name = baseline.as_os_str().to_owned();
    name.push(".inputs.zip");
    PathBuf::from(name)
}

/// Keeps the inputs of the run in `folder` beside the baseline that was made from it; nothing if the run did not keep them.
///
/// # Errors
/// When the archive of the run cannot be read, or a file cannot be written.
pub fn save_baseline_inputs(folder: &Path, baseline: &Path) -> Result<(), Error> {
    let target = baseline_archive(baseline);
    let failed = |error: std::io::Error| Error::output_failure(&target, error);
    let source = match File::open(folder.join(ARCHIVE)) {
        Ok(source) => source,
        Err(error) if error.kind() == ErrorKind::NotFound => {
            // Those of an earlier baseline are not its own.
            let _ = std::fs::remove_file(&target);
            return Ok(());
        }
        Err(error) => return Err(failed(error)),
    };
    let mut source = zip::ZipArchive::new(source).map_err(|error| failed(error.into()))?;
    let mut bytes = Vec::new();
    let mut archive =
        InputArchive { zip: ZipWriter::new(BufWriter::new(File::create(&target).map_err(failed)?)) };
    let mut hashes = BTreeMap::new();
    for index in 0..source.len() {
        let mut entry = source.by_index(index).map_err(|error| failed(error.into()))?;
        bytes.clear();
        entry.read_to_end(&mut bytes).map_err(failed)?;
        let name = entry.name().map_err(|error| failed(error.into()))?.into_owned();
        match name.starts_with(FMUS) {
            true => drop(hashes.insert(name, sha256_hex(&bytes))),
            false => archive.write_entry(&name, &bytes).map_err(failed)?,
        }
    }
    archive.write_json(ARCHIVE_HASHES, &hashes).map_err(failed)?;
    let recording = std::fs::read(baseline).map_err(|error| Error::output_failure(baseline, error))?;
    archive.write_entry(BASELINE_HASH, sha256_hex(&recording).as_bytes()).map_err(failed)?;
    let InputArchive { zip } = archive;
    zip.finish().map_err(std::io::Error::from).and_then(|mut file| file.flush()).map_err(failed)
}

/// Whether a recording is as a run left it that was taken as right: a recording of this program, or a table whose hash is in the archive
/// beside it.
#[must_use]
pub fn is_blessed_recording(path: &Path) -> bool {
    let hash = || -> Option<String> {
        let mut archive = zip::ZipArchive::new(File::open(baseline_archive(path)).ok()?).ok()?;
        let mut hash = String::new();
        archive.by_name(BASELINE_HASH).ok()?.take(1 << 10).read_to_string(&mut hash).ok()?;
        Some(hash)
    };
    let is_unchanged = |hash| std::fs::read(path).is_ok_and(|bytes| sha256_hex(&bytes) == hash);
    // Beside a recording, other files of a run name it too.
    Recording::open(path).is_ok_and(|recording| recording.path() == path) || hash().is_some_and(is_unchanged)
}

/// What a run was made from.
pub struct RunInputs {
    /// The folder with the kept files; it vanishes with this.
    pub folder: TemporaryFolder,
    /// The scenario, with paths relative to that folder.
    pub table: toml::Table,
    /// Values from outside of it.
    pub overrides: RecordedOverrides,
    /// The hashes of FMUs that were not kept, by their entries.
    absent_archives: BTreeMap<String, String>,
}

/// A run that was recorded: its folder, or a baseline, which is a recording alone.
pub struct RecordedRun {
    /// The folder or the file, as the user names it.
    pub path: PathBuf,
    /// What its report says; none of a baseline.
    pub report: Option<RecordedReport>,
    /// What it was made from, or why that is not known.
    pub inputs: Result<RunInputs, String>,
}

impl RecordedRun {
    /// Opens the folder of a run, a file in it, or a baseline.
    ///
    /// # Errors
    /// When there is nothing of that kind.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let folder = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new("")) };
        let is_run_file = path.is_dir()
            || path
                .file_name()
                .is_some_and(|name| name == REPORT || name.to_string_lossy().starts_with("run."));
        if !path.exists() {
            let message =
                format!("expected the folder of a run or a baseline, found nothing at {}", path.display());
            return Err(Error::invalid_input(message));
        }
        let report = match is_run_file {
            true => read_report(&folder.join(REPORT))?,
            false => None,
        };
        let inputs = match is_run_file {
            true => RunInputs::open(&folder.join(ARCHIVE)),
            false => RunInputs::open(&baseline_archive(path)).map_err(|error| {
                format!("it is a baseline, and its inputs were not kept with it, as `--bless` does: {error}")
            }),
        };
        Ok(RecordedRun { path: path.to_owned(), report, inputs })
    }

    /// Takes the FMUs that were not kept from another run; the entries of those that are others there. Without one of them the run
    /// cannot be repeated.
    pub fn borrow_archives(&mut self, other: &RecordedRun) -> Vec<String> {
        let (Ok(inputs), Ok(source)) = (&mut self.inputs, &other.inputs) else { return Vec::new() };
        inputs.borrow_archives(source).unwrap_or_else(|why| {
            self.inputs = Err(why);
            Vec::new()
        })
    }

    /// How its FMUs run in experiments: as they did in the run, or in processes of their own if it did not come to its end, so that one that
    /// crashes ends no comparison.
    #[must_use]
    pub fn isolation(&self) -> IsolationPolicy {
        match self.report.as_ref().is_some_and(|report| report.error.is_some()) {
            true => IsolationPolicy::Everything,
            false => IsolationPolicy::default(),
        }
    }

    /// The page of its report, if there is one.
    #[must_use]
    pub fn report_page(&self) -> Option<PathBuf> {
        self.report.as_ref()?;
        let folder = if self.path.is_dir() { &self.path } else { self.path.parent()? };
        let page = folder.join(REPORT_PAGE);
        page.is_file().then_some(page)
    }

    /// The name of the run in messages.
    #[must_use]
    pub fn name(&self) -> String {
        self.path.display().to_string()
    }
}

/// The report of a run, if there is one.
fn read_report(path: &Path) -> Result<Option<RecordedReport>, Error> {
    let Ok(text) = std::fs::read_to_string(path) else { return Ok(None) };
    serde_json::from_str(&text).map(Some).map_err(|error| {
        Error::invalid_input(format!("{}: expected the report of a run: {error}", path.display()))
    })
}

impl RunInputs {
    /// Opens the archive of a run.
    ///
    /// # Errors
    /// In words, when it is not there, or damaged, or a file that it names has changed since.
    fn open(path: &Path) -> Result<Self, String> {
        if !path.exists() {
            return Err(format!(
                "{} is not there: an earlier version of the program made the run, or somebody removed it",
                path.display()
            ));
        }
        let broken = |error: &dyn std::fmt::Display| format!("{} cannot be read: {error}", path.display());
        let bytes = archive::read_archive(path).map_err(|error| broken(&error))?;
        let folder = TemporaryFolder::new().map_err(|error| broken(&error))?;
        let root = folder.folder_path().to_owned();
        let mut left = archive::LARGEST;
        archive::unpack_archive(path, "inputs", &bytes, &root, &mut left)
            .map_err(|error| error.to_string())?;
        let read = |name: &str| {
            std::fs::read_to_string(root.join(name)).map_err(|error| broken(&format!("{name}: {error}")))
        };
        let table = read(SCENARIO)?.parse::<toml::Table>().map_err(|error| broken(&error.message()))?;
        let overrides = serde_json::from_str(&read(OVERRIDES)?).map_err(|error| broken(&error))?;
        let large: Vec<LargeFile> =
            serde_json::from_str(&read(LARGE_FILES)?).map_err(|error| broken(&error))?;
        for file in large {
            file.link_into(&root)?;
        }
        let absent_archives = match root.join(ARCHIVE_HASHES).exists() {
            true => serde_json::from_str(&read(ARCHIVE_HASHES)?).map_err(|error| broken(&error))?,
            false => BTreeMap::new(),
        };
        Ok(RunInputs { folder, table, overrides, absent_archives })
    }

    /// Takes the FMUs that were not kept from another run. Gives the entries of those that are others there.
    ///
    /// # Errors
    /// In words, when the other run lacks one.
    pub fn borrow_archives(&mut self, other: &RunInputs) -> Result<Vec<String>, String> {
        let mut others = Vec::new();
        for (entry, sha256) in std::mem::take(&mut self.absent_archives) {
            let source = other.folder.folder_path().join(&entry);
            let bytes = std::fs::read(&source).map_err(|_| {
                format!("its FMU {entry} was not kept, and the other run has none of that name")
            })?;
            let target = self.folder.folder_path().join(&entry);
            target
                .parent()
                .map_or(Ok(()), std::fs::create_dir_all)
                .and_then(|()| std::fs::write(&target, &bytes))
                .map_err(|error| format!("{}: {error}", target.display()))?;
            if sha256_hex(&bytes) != sha256 {
                others.push(entry);
            }
        }
        Ok(others)
    }
}

impl LargeFile {
    /// Puts a link to the original into the folder, if it has not changed.
    fn link_into(&self, root: &Path) -> Result<(), String> {
        let path = self.path.display();
        let bytes = std::fs::read(&self.path)
            .map_err(|error| format!("{path} was too large to be kept with the run, and is gone: {error}"))?;
        if sha256_hex(&bytes) != self.sha256 {
            return Err(format!("{path} was too large to be kept with the run, and has changed since"));
        }
        let target = root.join(&self.entry);
        let made = target.parent().map_or(Ok(()), std::fs::create_dir_all);
        made.and_then(|()| std::os::unix::fs::symlink(&self.path, &target))
            .map_err(|error| format!("{}: {error}", target.display()))
    }
}
