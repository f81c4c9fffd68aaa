//! `trackside pack --ssp`: packs scenarios as archives of SSP.

use std::path::{Path, PathBuf};

use diagnostics::{Error, ErrorCollector};
use orchestrator::package::{self, BuildProgress};
use orchestrator::{suite, validation};
use scenario::Scenario;
use scenario::export::export_ssp;
use scenario::plan::RunPlan;
use scenario::resolve::Overrides;

use crate::command::progress::BuildLine;
use crate::command::{print_text, print_to_stderr};

/// The folder of the archives when none is named.
const FOLDER: &str = "target/ssp";

/// Packs each scenario and prints the paths of the archives.
///
/// # Errors
/// When a scenario is wrong, or its archive cannot be written.
pub fn pack_scenarios_as_ssp(scenarios: &[String], out: Option<&Path>) -> Result<u8, Error> {
    let scenarios: Vec<PathBuf> = scenarios.iter().map(PathBuf::from).collect();
    if scenarios.is_empty() {
        let error = Error::invalid_input("expected a scenario to pack, found none");
        return Err(error.with_help("trackside pack SCENARIO.toml --ssp"));
    }
    suite::check_names(&scenarios)?;
    let is_archive = |path: &&Path| {
        path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ssp")) && !path.is_dir()
    };
    let archive = out.filter(is_archive);
    if let (Some(archive), [_, _, ..]) = (archive, scenarios.as_slice()) {
        let message = format!(
            "--out: expected a folder for {} scenarios, found {}",
            scenarios.len(),
            archive.display()
        );
        return Err(Error::invalid_input(message));
    }
    let packed = scenarios.iter().map(|scenario| {
        let name = scenario.file_stem().unwrap_or_default().to_string_lossy();
        let default = out.unwrap_or(Path::new(FOLDER)).join(format!("{name}.ssp"));
        write_ssp_archive(scenario, archive.unwrap_or(&default))
    });
    ErrorCollector::collect_all(packed).map(|_| 0)
}

fn write_ssp_archive(path: &Path, archive: &Path) -> Result<(), Error> {
    let scenario = Scenario::read(path)?;
    let mut building = BuildLine::default();
    let built =
        package::build_scenario_packages(&scenario, &mut |progress: BuildProgress| building.show(&progress))?;
    let overrides = Overrides::default();
    let plan = RunPlan::resolve(&scenario, &built, &overrides, PathBuf::new())?;
    validation::check_validations(&scenario, &built, &plan.system, &overrides)?;
    let exported = export_ssp(&scenario, &built, &plan.system, archive)?;
    for note in &exported.notes {
        print_to_stderr(&format!("note: {note}"));
    }
    print_text(&format!("{} (SSP {})\n", archive.display(), exported.version));
    Ok(())
}
