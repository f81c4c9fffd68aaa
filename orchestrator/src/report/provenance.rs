//! The provenance of a run: command line, versions, and hashes of all files that it read.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use cosim::system::{NodeBody, NodePlan, System};
use fmu_import::sha256_hex;
use scenario::Scenario;
use scenario::plan::RunPlan;
use serde::{Deserialize, Serialize};

/// The argument by which `trackside test` ties a run to itself.
pub(crate) const SUPERVISED: &str = "--supervised";

/// What a run was made with.
#[derive(Debug, Clone, Serialize)]
pub struct RunProvenance {
    /// The command line.
    pub command: Vec<String>,
    /// Values from outside the scenario, as `--set` takes them.
    pub set: Vec<String>,
    /// The number of the process.
    pub process: u32,
    /// When it began [s since 1970-01-01 UTC].
    pub begun: u64,
    /// Versions of all that has one.
    pub versions: SoftwareVersions,
    /// The seed of every random stream.
    pub seed: u64,
    /// The generator of the random streams.
    pub generator: &'static str,
    /// The files that the scenario was read from, first the one that was to be run.
    pub sources: Vec<FileHash>,
    /// Tables, logs and text files that it reads.
    pub data: Vec<FileHash>,
    /// The FMUs that took part.
    pub fmus: Vec<FmuIdentity>,
    /// The libraries of the plugins that took part.
    pub plugins: Vec<FileHash>,
}

/// Versions of all that has one.
#[derive(Debug, Clone, Serialize)]
pub struct SoftwareVersions {
    /// Of this program.
    pub trackside: &'static str,
    /// Of FMI, those of the FMUs that took part, such as `2.0, 3.0`; empty without one.
    pub fmi: String,
    /// Of the interface to plugins.
    pub plugin_interface: u32,
    /// The operating system.
    pub os: &'static str,
    /// The processor.
    pub arch: &'static str,
}

/// A file that was read.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct FileHash {
    /// Where it is, as it was named.
    pub path: PathBuf,
    /// SHA-256 of its contents.
    pub sha256: String,
}

/// An FMU that took part.
#[derive(Debug, Clone, Serialize)]
pub struct FmuIdentity {
    /// The node's name.
    pub name: String,
    /// The identity that it states.
    pub guid: String,
    /// SHA-256 of the archive.
    pub sha256: String,
}

impl RunProvenance {
    /// What the run of a scenario is made with.
    #[must_use]
    pub fn new(scenario: &Scenario, plan: &RunPlan) -> Self {
        let sources = scenario
            .source
            .files()
            .map(|file| FileHash { path: file.path.clone(), sha256: sha256_hex(file.text.as_bytes()) });
        let data = scenario.read_files().map(|word| scenario.source.resolve_path(word));
        let data = data.chain(plan.start_value_files.iter().cloned());
        let begun = SystemTime::now().duration_since(UNIX_EPOCH);
        RunProvenance {
            command: std::env::args_os()
                .map(|word| word.to_string_lossy().into_owned())
                // Between this program and its parent; nobody can repeat it.
                .filter(|word| word != SUPERVISED)
                .collect(),
            set: plan.header.given.clone(),
            process: std::process::id(),
            begun: begun.map(|time| time.as_secs()).unwrap_or_default(),
            versions: SoftwareVersions {
                trackside: env!("CARGO_PKG_VERSION"),
                fmi: fmi_versions(&plan.system),
                plugin_interface: plugin::abi::VERSION,
                os: std::env::consts::OS,
                arch: std::env::consts::ARCH,
            },
            seed: plan.header.seed,
            generator: "Pcg64",
            sources: sources.collect(),
            data: data.filter_map(|path| hash_file(&path)).collect(),
            fmus: fmu_identities(&plan.system),
            plugins: plan.analyses.iter().filter_map(|plan| hash_file(&plan.library)).collect(),
        }
    }
}

fn fmu_identities(system: &System) -> Vec<FmuIdentity> {
    let fmu = |node: &NodePlan| match &node.body {
        NodeBody::Fmu { fmu, .. } => Some(FmuIdentity {
            name: node.name.clone(),
            guid: fmu.description.guid.clone(),
            sha256: fmu.sha256.clone(),
        }),
        _ => None,
    };
    system.nodes.iter().filter_map(fmu).collect()
}

/// The versions of FMI of all FMUs, each once.
fn fmi_versions(system: &System) -> String {
    let version = |node: &NodePlan| match &node.body {
        NodeBody::Fmu { fmu, .. } => Some(fmu.description.version.to_string()),
        _ => None,
    };
    let versions: BTreeSet<String> = system.nodes.iter().filter_map(version).collect();
    Vec::from_iter(versions).join(", ")
}

/// The hash of a file, unless it has gone since it was read.
fn hash_file(path: &Path) -> Option<FileHash> {
    let sha256 = sha256_hex(&std::fs::read(path).ok()?);
    Some(FileHash { path: path.to_owned(), sha256 })
}
