//! Makes the folder of a sweep: its variants with their values, and the scenario with all its files.

use std::path::{Path, PathBuf};

use ::sweep::table::{Column, Groups, Reader, Role, Table, Values, Writer};
use diagnostics::{Error, Mistakes};
use scenario::bundle::{Bundle, Layout, SCENARIO};
use scenario::plan::{SweepPlan, System};
use scenario::resolve::{self, Overrides};
use scenario::words::Recorded;
use scenario::{Built, Scenario};
use serde::{Deserialize, Serialize};

use super::assignment::Assignment;
use super::settings::{SEED, Setting, overrides};
use crate::{fresh, package};

/// The file that says what a plan is.
pub const PLAN: &str = "plan.json";
/// The values of each variant; a row group for each chunk.
const VARIANTS: &str = "variants.parquet";
/// The folder of the gathered scenario.
const GATHERED: &str = "scenario";
/// The folder of the results of chunks.
pub const PARTS: &str = "parts";
/// What a plan leaves besides, which another plan replaces.
const RESULTS: [&str; 3] = ["sweep.parquet", "sweep.html", "sweep.json"];
/// The form of the file.
const VERSION: u32 = 1;
/// The fewest and the most variants of a chunk that nobody chose, and how many chunks there are in between.
const LEAST: u64 = 50;
const CHUNK: u64 = 1000;
const PARTS_WANTED: u64 = 64;

/// What to make a plan of.
#[derive(Debug, Clone, Default)]
pub struct PlanOptions {
    /// The folder; `target/sweeps/SCENARIO` without it.
    pub out: Option<PathBuf>,
    /// What all variants have, besides the words of the scenario.
    pub overrides: Overrides,
    /// The texts of `--set` that make part of them.
    pub set: Vec<Setting>,
    /// Variants of a chunk.
    pub chunk: Option<u64>,
    /// Whether it may take the place of another plan with its results.
    pub replace: bool,
}

/// What `plan.json` says.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct About {
    version: u32,
    /// The name of the scenario.
    pub scenario: String,
    /// Its title.
    pub title: String,
    /// SHA-256 of all that the results depend on, but for the program.
    pub digest: String,
    /// SHA-256 of the program.
    program: String,
    /// Number of variants.
    pub variants: u64,
    /// Variants of a chunk.
    pub chunk: u64,
    /// How they were chosen.
    pub design: String,
    /// What all variants have.
    pub set: Vec<Setting>,
    /// The seed of all variants, instead of the scenario's.
    seed: Option<u64>,
    /// Relative tolerance inside the FMUs [-].
    tolerance: Option<f64>,
    /// The checks, in the order of the file.
    pub checks: Vec<String>,
    /// The collected values and their units.
    pub collected: Vec<(String, Option<String>)>,
    /// Share of the variants that must pass.
    pub pass_share: f64,
    /// Variants that run again with everything recorded: worst, best, failed, every.
    pub recorded: [u32; 4],
    /// What is left out in variants.
    pub warnings: Vec<String>,
}

/// The folder of a sweep.
pub struct Plan {
    /// Where it is.
    pub folder: PathBuf,
    /// What it says about itself.
    pub about: About,
    variants: Reader,
}

impl Plan {
    /// Opens the plan in a folder, which this build of the program made.
    ///
    /// # Errors
    /// When there is none, another program made it, or its files changed.
    pub fn open(folder: &Path, program: &Path) -> Result<Self, Error> {
        let plan = Self::look_at(folder)?;
        if plan.about.program != digest_of(program)? {
            return Err(Error::input(format!(
                "the plan in {} was made by another build of this program, which may give other results",
                folder.display()
            ))
            .help("make it again with this one: trackside sweep plan SCENARIO"));
        }
        let bundle = folder.join(GATHERED);
        let found = digest(&bundle, &folder.join(VARIANTS), &plan.about)?;
        if found != plan.about.digest {
            return Err(Error::input(format!(
                "the files of the plan in {} were changed after it was made",
                folder.display()
            ))
            .help("make it again: trackside sweep plan SCENARIO"));
        }
        Ok(plan)
    }

    /// Opens the plan in a folder, whoever made it.
    ///
    /// # Errors
    /// When there is none.
    pub fn look_at(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(PLAN);
        let text = std::fs::read_to_string(&path).map_err(|error| {
            Error::input(format!("there is no plan of a sweep in {}: {error}", folder.display()))
                .help("make one: trackside sweep plan SCENARIO --out FOLDER")
        })?;
        let about: About = serde_json::from_str(&text)
            .map_err(|error| Error::input(format!("{}: {error}", path.display())))?;
        if about.version != VERSION {
            let found = about.version;
            let message = format!("{}: expected version {VERSION}, found {found}", path.display());
            return Err(Error::input(message));
        }
        let variants = Reader::open(&folder.join(VARIANTS))?;
        if variants.rows() as u64 != about.variants {
            let (rows, wanted) = (variants.rows(), about.variants);
            return Err(Error::input(format!(
                "{}: expected {wanted} rows, found {rows}",
                folder.join(VARIANTS).display()
            )));
        }
        Ok(Plan { folder: folder.to_owned(), about, variants })
    }

    /// How many chunks it has.
    #[must_use]
    pub fn chunks(&self) -> u64 {
        self.about.variants.div_ceil(self.about.chunk)
    }

    /// The variants of a chunk, from its first one to before the last.
    #[must_use]
    pub fn range(&self, chunk: u64) -> std::ops::Range<u64> {
        let first = chunk * self.about.chunk;
        first..(first + self.about.chunk).min(self.about.variants)
    }

    /// The values of a chunk.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn values(&self, chunk: u64) -> Result<Table, Error> {
        self.variants.group(chunk as usize)
    }

    /// The columns of the values.
    #[must_use]
    pub fn columns(&self) -> &Table {
        self.variants.columns()
    }

    /// The settings of a row of values.
    #[must_use]
    pub fn settings(values: &Table, row: usize) -> Vec<Setting> {
        let varied = values.columns.iter().filter(|it| it.role != Role::Variant);
        varied.filter_map(|column| setting(column, row)).collect()
    }

    /// The settings of a variant.
    ///
    /// # Errors
    /// When there is no such variant, or its values cannot be read.
    pub fn settings_of(&self, variant: u64) -> Result<Vec<Setting>, Error> {
        let (variants, folder) = (self.about.variants, self.folder.display());
        if variant >= variants {
            let message = format!(
                "the sweep in {folder} has the variants 0 to {}, found {variant}",
                variants.saturating_sub(1)
            );
            return Err(Error::input(message));
        }
        let chunk = variant / self.about.chunk;
        Ok(Self::settings(&self.values(chunk)?, (variant - self.range(chunk).start) as usize))
    }

    /// The gathered scenario.
    #[must_use]
    pub fn scenario_file(&self) -> PathBuf {
        self.folder.join(GATHERED).join(format!("{}.toml", self.about.scenario))
    }

    /// The gathered scenario.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn scenario(&self) -> Result<Scenario, Error> {
        Scenario::read(&self.scenario_file())
    }

    /// What all variants have.
    ///
    /// # Errors
    /// When a setting has no form that a scenario takes.
    pub fn overrides(&self) -> Result<Overrides, Error> {
        let About { seed, tolerance, set, .. } = &self.about;
        let all = Overrides { seed: *seed, tolerance: *tolerance, ..Overrides::default() };
        self.with(&all, set)
    }

    /// These overrides with the settings of a variant.
    ///
    /// # Errors
    /// When a setting has no form that a scenario takes.
    pub fn with(&self, all: &Overrides, settings: &[Setting]) -> Result<Overrides, Error> {
        let folder = self.folder.join(GATHERED);
        overrides(all, settings, &folder, |_| None).map_err(Error::input)
    }

    /// The file of the results of a chunk.
    #[must_use]
    pub fn part(&self, chunk: u64) -> PathBuf {
        self.folder.join(PARTS).join(format!("{chunk:06}.parquet"))
    }

    /// Which variants run again with everything recorded.
    #[must_use]
    pub fn recorded(&self) -> Recorded {
        let [worst, best, failed, every] = self.about.recorded;
        Recorded { worst, best, failed, every }
    }
}

fn setting(column: &Column, row: usize) -> Option<Setting> {
    let text = |value: String| Setting { name: column.name.clone(), value };
    match &column.values {
        Values::Numbers(all) => {
            let unit = column.unit.as_deref();
            all.get(row).map(|value| Setting::number(&column.name, *value, unit))
        }
        Values::Integers(all) => all.get(row).map(|value| text(value.to_string())),
        Values::Booleans(all) => Some(text((*all.get(row)?)?.to_string())),
        Values::Texts(all) => Some(text(all.get(row)?.clone()?)),
    }
}

/// Makes the plan of a scenario in its folder, or finds it there.
///
/// # Errors
/// When the scenario is wrong, a variant cannot be resolved, or the folder has the results of another plan.
pub fn make(
    path: &Path,
    options: &PlanOptions,
    program: &Path,
    progress: package::OnProgress,
) -> Result<Plan, Error> {
    let scenario = Scenario::read(path)?;
    let words = resolve::sweep(&scenario)?.ok_or_else(|| {
        Error::input(format!("{}: the scenario has no variants", path.display())).help(
            "say what varies: add [sweep], or run it once by trackside run; trackside explain sweep tells more",
        )
    })?;
    let default = || Path::new("target/sweeps").join(path.file_stem().unwrap_or_default());
    let folder = options.out.clone().unwrap_or_else(default);
    let built = package::build(&scenario, progress)?;
    // All that is wrong is told with its places in the files of the user.
    let system = try_out(&scenario, &built, &words, options)?;
    let made = folder.with_extension("plan.partial");
    clear(&made)?;
    let result = write(&made, &scenario, &built, (&words, &system), options, program);
    let result = result.and_then(|about| place(&made, &folder, &about, options));
    let _ = std::fs::remove_dir_all(&made);
    result?;
    Plan::open(&folder, program)
}

/// Resolves the first variant and the last one, at the words that vary.
fn try_out(
    scenario: &Scenario,
    built: &Built,
    words: &SweepPlan,
    options: &PlanOptions,
) -> Result<System, Error> {
    let assignment = Assignment::new(words, &options.set)?;
    let folder = scenario.source.path().parent().unwrap_or(Path::new(""));
    let place = |name: &str| {
        let sweep = scenario.document.sweep.as_ref()?;
        let vary = sweep.vary.iter().find(|vary| vary.name.get_ref() == name);
        let word = vary.map(|vary| vary.name.span()).or(sweep.list.as_ref().map(|it| it.span()));
        Some((std::sync::Arc::new(scenario.source.clone()), word?))
    };
    let resolve = |row: usize| {
        let table = assignment.rows(row as u64..row as u64 + 1);
        let settings = Plan::settings(&table, 0);
        let overrides = overrides(&options.overrides, &settings, folder, place);
        System::resolve(scenario, built, &overrides.map_err(Error::input)?, PathBuf::new())
    };
    let mut mistakes = Mistakes::default();
    let first = mistakes.take(resolve(0));
    if first.is_some() && assignment.count() > 1 {
        mistakes.take(resolve(assignment.count() as usize - 1));
    }
    mistakes.finish()?;
    first.ok_or_else(Error::follow_up)
}

/// Writes all of a plan into a folder.
fn write(
    folder: &Path,
    scenario: &Scenario,
    built: &Built,
    (words, system): (&SweepPlan, &System),
    options: &PlanOptions,
    program: &Path,
) -> Result<About, Error> {
    let bundle = folder.join(GATHERED);
    std::fs::create_dir_all(&bundle).map_err(|error| Error::output(&bundle, error))?;
    let layout = Layout { fmus: "fmus", others: "files", plugins: Some("plugins") };
    let gathered = Bundle::gather(scenario, built, layout)?;
    gathered.write(&bundle)?;
    let named = bundle.join(format!("{}.toml", scenario.name));
    let renamed = std::fs::rename(bundle.join(SCENARIO), &named);
    renamed.map_err(|error| Error::output(&named, error))?;
    let again = Scenario::read(&named)?;
    let words = resolve::sweep(&again)?.unwrap_or_else(|| words.clone());
    let assignment = Assignment::new(&words, &options.set)?;
    let variants = assignment.count();
    let chunk =
        options.chunk.unwrap_or_else(|| variants.div_ceil(PARTS_WANTED).clamp(LEAST, CHUNK));
    let path = folder.join(VARIANTS);
    let mut writer = Writer::create(&path, &assignment.rows(0..0), Groups::Tables)?;
    for first in (0..variants).step_by(chunk as usize) {
        writer.append(&assignment.rows(first..(first + chunk).min(variants)))?;
    }
    writer.finish()?;
    let mut warnings = gathered.notes;
    if !scenario.document.validation.is_empty() {
        warnings.push("validations run in no variant; `trackside replay` runs them".to_owned());
    }
    if !scenario.document.baseline.is_empty() {
        warnings.push("no variant is compared with the baselines of the scenario".to_owned());
    }
    warnings.extend(
        assignment
            .fixed()
            .map(|name| format!("--set {name} holds in all variants: it does not vary")),
    );
    let Recorded { worst, best, failed, every } = words.recorded;
    let mut about = About {
        version: VERSION,
        scenario: scenario.name.clone(),
        title: system.header.title.clone(),
        digest: String::new(),
        program: digest_of(program)?,
        variants,
        chunk,
        design: assignment.design().to_owned(),
        set: options.set.clone(),
        seed: options.overrides.seed,
        tolerance: options.overrides.tolerance,
        checks: system.checks.iter().map(|check| check.name.clone()).collect(),
        collected: system
            .collected
            .iter()
            .map(|it| (it.name.clone(), it.unit.as_ref().map(|(unit, _)| unit.clone())))
            .collect(),
        pass_share: words.pass_share,
        recorded: [worst, best, failed, every],
        warnings,
    };
    about.digest = digest(&bundle, &path, &about)?;
    let path = folder.join(PLAN);
    let text = serde_json::to_string_pretty(&about)
        .map_err(|error| Error::input(format!("{}: {error}", path.display())))?;
    fresh::write(&path, text).map_err(|error| Error::output(&path, error))?;
    Ok(about)
}

/// Puts a plan that was made into its folder, unless the same one is there.
fn place(made: &Path, folder: &Path, about: &About, options: &PlanOptions) -> Result<(), Error> {
    let wrong = |error: std::io::Error| Error::output(folder, error);
    if folder.join(PLAN).exists() {
        let there = Plan::look_at(folder).ok().map(|plan| plan.about);
        let same =
            |there: &About| (&there.digest, &there.program) == (&about.digest, &about.program);
        if there.as_ref().is_some_and(same) {
            return Ok(());
        }
        let has_results =
            std::fs::read_dir(folder.join(PARTS)).is_ok_and(|mut files| files.next().is_some());
        if has_results && !options.replace {
            let message = format!(
                "{} has results of another sweep: the scenario, its files, --set or this program changed since",
                folder.display()
            );
            return Err(Error::input(message)
                .help("--replace replaces them; --out FOLDER leaves them where they are"));
        }
        for file in [PLAN, VARIANTS].iter().chain(&RESULTS) {
            let _ = std::fs::remove_file(folder.join(file));
        }
        for inner in [GATHERED, PARTS, "variants"] {
            clear(&folder.join(inner))?;
        }
    } else if std::fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some()) {
        return Err(Error::input(format!(
            "the sweep cannot go to {}: it holds other files",
            folder.display()
        ))
        .help("name another folder: --out FOLDER"));
    }
    std::fs::create_dir_all(folder).map_err(wrong)?;
    // What says that there is a plan comes last.
    for name in [GATHERED, VARIANTS, PLAN] {
        std::fs::rename(made.join(name), folder.join(name)).map_err(wrong)?;
    }
    Ok(())
}

/// Removes a folder, if it is there.
fn clear(folder: &Path) -> Result<(), Error> {
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::output(folder, error))
        }
        _ => Ok(()),
    }
}

fn digest_of(path: &Path) -> Result<String, Error> {
    let bytes = std::fs::read(path)
        .map_err(|error| Error::input(format!("cannot read {}: {error}", path.display())))?;
    Ok(fmu_import::sha256(&bytes))
}

/// One digest of the files of a gathered scenario with their names, of the values, and of what holds in all variants.
fn digest(bundle: &Path, variants: &Path, about: &About) -> Result<String, Error> {
    let mut files = Vec::new();
    list(bundle, &mut files)?;
    files.sort();
    files.push(variants.to_owned());
    let mut all = format!("{:?} {:?} {:?}\n", about.set, about.seed, about.tolerance);
    for file in files {
        let name = file.strip_prefix(bundle).unwrap_or(Path::new(VARIANTS));
        all += &format!("{} {}\n", name.display(), digest_of(&file)?);
    }
    Ok(fmu_import::sha256(all.as_bytes()))
}

fn list(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), Error> {
    let wrong =
        |error: std::io::Error| Error::input(format!("cannot read {}: {error}", folder.display()));
    for entry in std::fs::read_dir(folder).map_err(wrong)? {
        let path = entry.map_err(wrong)?.path();
        if path.is_dir() { list(&path, files)? } else { files.push(path) }
    }
    Ok(())
}

/// Whether a name is that of the seed.
pub(super) fn is_seed(name: &str) -> bool {
    name == SEED
}
