//! Creates the plan folder of a sweep: the values of its variants, and the scenario with all its files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ::sweep::table::{RowGroups, SweepTable, SweepTableWriter};
use cosim::quantity::{InputUnit, Quantity};
use cosim::system::{NodeBody, System};
use diagnostics::{Error, ErrorCollector, Spanned};
use scenario::bundle::{BundleLayout, SCENARIO, ScenarioBundle};
use scenario::document::VariantSelection;
use scenario::plan::{AxisValues, RunPlan, SweepAxis, SweepPlan};
use scenario::resolve::{self, FmuCache, Overrides};
use scenario::{BuildArtifacts, Scenario};

use super::assignment::VariantAssignment;
use super::digest::{plan_digest, program_sha256};
use super::file_names::{GATHERED, PARTS, PLAN, SEARCHED, VARIANTS};
use super::plan::SweepPlanFolder;
use super::plan_metadata::{PlanMetadata, VERSION};
use super::scenario_values::{ScenarioValue, scenario_values};
use crate::{nofollow, package};

/// The files of results, which another plan replaces.
const RESULTS: [&str; 4] = ["sweep.parquet", "sweep.csv", "sweep.html", "sweep.json"];
/// The fewest and the most variants of a chunk that nobody chose, and how many chunks there are in between.
const LEAST: u64 = 50;
const CHUNK: u64 = 1000;
const TARGET_CHUNKS: u64 = 64;

/// The options of a new plan.
#[derive(Debug, Clone, Default)]
pub struct PlanOptions {
    /// The folder; `target/sweeps/SCENARIO` without it.
    pub out: Option<PathBuf>,
    /// What all variants have, besides the words of the scenario: `--set` and the options beside it.
    pub overrides: Overrides,
    /// Variants of a chunk.
    pub chunk: Option<u64>,
    /// Whether it may take the place of another plan with its results.
    pub replace: bool,
}

/// Makes the plan of a scenario in its folder, or finds it there.
///
/// # Errors
/// When the scenario is wrong, a variant cannot be resolved, or the folder has the results of another plan.
pub fn create_sweep_plan(
    path: &Path,
    options: &PlanOptions,
    program: &Path,
    progress: package::OnProgress,
) -> Result<SweepPlanFolder, Error> {
    let scenario = Scenario::read(path)?;
    let words = resolve::resolve_sweep(&scenario)?.ok_or_else(|| {
        Error::invalid_input(format!("{}: the scenario has no variants", path.display())).with_help(
            "say what varies: add [sweep], or run it once by trackside run; trackside explain sweep tells more",
        )
    })?;
    let default = || Path::new("target/sweeps").join(path.file_stem().unwrap_or_default());
    let folder = options.out.clone().unwrap_or_else(default);
    let built = package::build_scenario_packages(&scenario, progress)?;
    // All that is wrong is told with its places in the files of the user.
    let plan = resolve_first_and_last_variant(&scenario, &built, &words, options)?;
    let made = folder.with_extension("plan.partial");
    remove_folder_if_present(&made)?;
    let result = write_plan_folder(&made, &scenario, &built, &words, &plan, options, program);
    let result = result.and_then(|metadata| install_plan_folder(&made, &folder, &metadata, options));
    let _ = std::fs::remove_dir_all(&made);
    result?;
    SweepPlanFolder::open(&folder, program)
}

/// Resolves the first variant and the last one, and all that are written by hand, at the words that vary.
fn resolve_first_and_last_variant(
    scenario: &Scenario,
    built: &BuildArtifacts,
    words: &SweepPlan,
    options: &PlanOptions,
) -> Result<RunPlan, Error> {
    let assignment = VariantAssignment::new(words, &options.overrides.starts)?;
    let folder = scenario.source.main_path().parent().unwrap_or(Path::new(""));
    let place = |name: &str| {
        let sweep = scenario.document.sweep.as_ref()?;
        let vary = sweep.vary.iter().find(|vary| vary.name.get_ref() == name);
        let by_hand = || {
            let set = sweep.variant.iter().flat_map(|variant| variant.set.keys());
            let known = |key: &&Spanned<String>| {
                let rest = name.strip_prefix(key.get_ref().as_str());
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            set.into_iter().find(known).map(Spanned::span)
        };
        let word =
            vary.map(|vary| vary.name.span()).or(sweep.list.as_ref().map(|it| it.span())).or_else(by_hand);
        Some((std::sync::Arc::new(scenario.source.clone()), word?))
    };
    let mut cache = FmuCache::default();
    let mut resolve = |values: SweepTable| {
        let mut variant = SweepPlanFolder::row_overrides(&values, 0);
        variant.iter_mut().for_each(|it| it.place = place(&it.name));
        let overrides = options.overrides.with_variant(&variant, folder);
        let overrides = overrides.map_err(Error::invalid_input)?;
        RunPlan::resolve_cached(scenario, built, &overrides, PathBuf::new(), &mut cache)
    };
    let mut mistakes = ErrorCollector::default();
    let first = mistakes.ok_or_record(resolve(assignment.first_or_last_values(false)));
    if first.is_some() {
        mistakes.ok_or_record(resolve(assignment.first_or_last_values(true)));
    }
    // Each variant by hand has names of its own.
    let by_hand = scenario.document.sweep.as_ref().map_or(0, |sweep| sweep.variant.len() as u64);
    for variant in 1..by_hand.saturating_sub(1).min(assignment.variant_count()) {
        mistakes.ok_or_record(resolve(assignment.variant_values(variant..variant + 1)));
    }
    mistakes.into_result()?;
    first.ok_or_else(Error::already_reported)
}

/// Writes all of a plan into a folder.
fn write_plan_folder(
    folder: &Path,
    scenario: &Scenario,
    built: &BuildArtifacts,
    words: &SweepPlan,
    plan: &RunPlan,
    options: &PlanOptions,
    program: &Path,
) -> Result<PlanMetadata, Error> {
    let bundle = folder.join(GATHERED);
    std::fs::create_dir_all(&bundle).map_err(|error| Error::output_failure(&bundle, error))?;
    let layout = BundleLayout { fmus: "fmus", others: "files", plugins: Some("plugins") };
    let gathered = ScenarioBundle::gather(scenario, built, layout)?;
    gathered.write(&bundle)?;
    let named = bundle.join(format!("{}.toml", scenario.name));
    let renamed = std::fs::rename(bundle.join(SCENARIO), &named);
    renamed.map_err(|error| Error::output_failure(&named, error))?;
    let again = Scenario::read(&named)?;
    let mut words = resolve::resolve_sweep(&again)?.unwrap_or_else(|| words.clone());
    convert_levels(&mut words.axes, scenario, &plan.system);
    let assignment = VariantAssignment::new(&words, &options.overrides.starts)?;
    let variants = assignment.variant_count();
    let is_search = words.search.is_some();
    let chunk = options.chunk.unwrap_or_else(|| variants.div_ceil(TARGET_CHUNKS).clamp(LEAST, CHUNK));
    let path = folder.join(VARIANTS);
    let mut writer = SweepTableWriter::create(&path, &assignment.variant_values(0..0), RowGroups::Tables)?;
    for first in (0..variants).step_by(chunk as usize) {
        writer.append(&assignment.variant_values(first..(first + chunk).min(variants)))?;
    }
    writer.finish()?;
    let mut warnings = plan.system.warnings.clone();
    warnings.extend(omission_warnings(scenario, gathered.notes, &assignment));
    let VariantSelection { worst, best, failed, every } = words.recorded;
    let mut metadata = PlanMetadata {
        version: VERSION,
        scenario: scenario.name.clone(),
        title: plan.header.title.clone(),
        digest: String::new(),
        program: program_sha256(program)?,
        variants,
        chunk,
        design: assignment.design_name().to_owned(),
        set: options.overrides.starts.clone(),
        seed: options.overrides.seed,
        tolerance: options.overrides.tolerance,
        blocks: assignment.saltelli_axis_names(),
        also: assignment.names_coupled_to_others().map(str::to_owned).collect(),
        units: units_of_names(scenario, &plan.system, assignment.varied_names()),
        scenario_values: values_of_scenario(&words.axes, scenario, built, options),
        is_sample: assignment.is_sample(),
        is_search,
        checks: plan.checks.iter().map(|check| check.name.clone()).collect(),
        margin_units: plan
            .checks
            .iter()
            .map(|check| check.condition.compared_unit().map(str::to_owned))
            .collect(),
        collected: plan
            .collected
            .iter()
            .map(|it| (it.name.clone(), it.unit.as_ref().map(|(unit, _)| unit.clone())))
            .collect(),
        pass_share: words.pass_share,
        recorded: [worst, best, failed, every],
        warnings,
    };
    metadata.digest = plan_digest(&bundle, &path, &metadata)?;
    let path = folder.join(PLAN);
    let text = serde_json::to_string_pretty(&metadata)
        .map_err(|error| Error::invalid_input(format!("{}: {error}", path.display())))?;
    nofollow::write_without_following_links(&path, text)
        .map_err(|error| Error::output_failure(&path, error))?;
    Ok(metadata)
}

/// What the scenario itself has of what its set-ups vary; nothing of one that does not run without them.
fn values_of_scenario(
    axes: &[SweepAxis],
    scenario: &Scenario,
    built: &BuildArtifacts,
    options: &PlanOptions,
) -> BTreeMap<String, ScenarioValue> {
    let is_list = axes.iter().any(|axis| axis.variant_names.is_some()) || {
        let sweep = scenario.document.sweep.as_ref();
        sweep.is_some_and(|sweep| sweep.list.is_some())
    };
    let plan = is_list.then(|| RunPlan::resolve(scenario, built, &options.overrides, PathBuf::new()));
    let Some(Ok(plan)) = plan else { return BTreeMap::new() };
    scenario_values(axes, scenario, &plan.system, |name| unit_of_name(scenario, &plan.system, name))
}

/// Warnings about what variants do without, and about names that do not vary.
fn omission_warnings(scenario: &Scenario, notes: Vec<String>, assignment: &VariantAssignment) -> Vec<String> {
    let mut warnings = notes;
    if !scenario.document.validation.is_empty() {
        warnings.push("validations run in no variant; `trackside replay` runs them".to_owned());
    }
    if !scenario.document.baseline.is_empty() {
        warnings.push("no variant is compared with the baselines of the scenario".to_owned());
    }
    warnings.extend(
        assignment
            .constant_names()
            .map(|name| format!("--set {name} holds in all variants: it does not vary")),
    );
    warnings
}

/// Puts a plan that was made into its folder, unless the same one is there.
fn install_plan_folder(
    made: &Path,
    folder: &Path,
    metadata: &PlanMetadata,
    options: &PlanOptions,
) -> Result<(), Error> {
    let wrong = |error: std::io::Error| Error::output_failure(folder, error);
    if folder.join(PLAN).exists() {
        let there = SweepPlanFolder::open_of_any_program(folder).ok().map(|plan| plan.metadata);
        let same =
            |there: &PlanMetadata| (&there.digest, &there.program) == (&metadata.digest, &metadata.program);
        if there.as_ref().is_some_and(same) {
            return Ok(());
        }
        let has_results = std::fs::read_dir(folder.join(PARTS)).is_ok_and(|mut files| files.next().is_some());
        if has_results && !options.replace {
            let message = format!(
                "{} has results of another sweep: the scenario, its files, --set or this program changed since",
                folder.display()
            );
            return Err(Error::invalid_input(message)
                .with_help("--replace replaces them; --out FOLDER leaves them where they are"));
        }
        for file in [PLAN, VARIANTS].iter().chain(&RESULTS) {
            let _ = std::fs::remove_file(folder.join(file));
        }
        for inner in [GATHERED, PARTS, SEARCHED, "variants"] {
            remove_folder_if_present(&folder.join(inner))?;
        }
    } else if std::fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some()) {
        return Err(Error::invalid_input(format!(
            "the sweep cannot go to {}: it holds other files",
            folder.display()
        ))
        .with_help("name another folder: --out FOLDER"));
    }
    std::fs::create_dir_all(folder).map_err(wrong)?;
    // What says that there is a plan comes last.
    for name in [GATHERED, VARIANTS, PLAN] {
        std::fs::rename(made.join(name), folder.join(name)).map_err(wrong)?;
    }
    Ok(())
}

/// Removes a folder, if it is there.
fn remove_folder_if_present(folder: &Path) -> Result<(), Error> {
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::output_failure(folder, error))
        }
        _ => Ok(()),
    }
}

/// The unit that a variable or a signal has by itself.
fn unit_of_name<'a>(scenario: &'a Scenario, system: &'a System, name: &str) -> Option<InputUnit<'a>> {
    let variable = || {
        let (node, variable) = name.split_once('.')?;
        let plan = system.nodes.iter().find(|plan| plan.name == node)?;
        let NodeBody::Fmu { fmu, .. } = &plan.body else { return None };
        let found = fmu.description.variables.iter().find(|it| it.name == variable)?;
        Some(InputUnit {
            name: Some(found.unit.as_deref()?),
            definition: found.dimension,
            is_difference: found.relative.is_some(),
        })
    };
    let signal = || {
        let mut signals = scenario.document.signal.iter().map(|part| part.get_ref());
        let found = signals.find(|part| part.name.as_ref().is_some_and(|it| it.get_ref() == name))?;
        Some(InputUnit { name: Some(found.unit.as_ref()?.get_ref()), ..InputUnit::default() })
    };
    variable().or_else(signal)
}

/// The units that variables and signals have by themselves.
fn units_of_names<'a>(
    scenario: &Scenario,
    system: &System,
    names: impl Iterator<Item = &'a str>,
) -> BTreeMap<String, String> {
    let named = names.filter_map(|name| {
        let unit = unit_of_name(scenario, system, name)?.name?;
        Some((name.to_owned(), unit.to_owned()))
    });
    named.collect()
}

/// Turns levels that have a unit of their own, such as `0.9 t`, into numbers in the unit of what they set, so that a column has one unit.
/// A level that cannot be converted stays a text.
fn convert_levels(axes: &mut [SweepAxis], scenario: &Scenario, system: &System) {
    for axis in axes {
        let AxisValues::Levels(levels) = &mut axis.values else { continue };
        for (place, name) in axis.names.iter().enumerate().filter(|(place, _)| axis.units[*place].is_none()) {
            let Some(input) = unit_of_name(scenario, system, name) else { continue };
            for level in levels.iter_mut().map(|row| &mut row[place]) {
                let converted = Quantity::split_text(level)
                    .map(|(number, unit)| Quantity { number, unit: Some(unit.to_owned()) })
                    .and_then(|quantity| quantity.value_at(input).ok());
                if let Some(value) = converted {
                    *level = format!("{value:?}");
                }
            }
        }
    }
}
