//! An .fmu archive of FMI 1.0, 2.0 or 3.0, for co-simulation or model exchange, goes in: it is unpacked, and its description is read and checked. Instances that
//! can be called come out.
//!
//! The archive and its description may be hostile: nothing is written outside of a temporary folder, and sizes are bounded.
//! Its library is code that runs in this process. A crash ends the process, with a line on standard error that names instance
//! and call; [`start_watchdog`] reports calls that do not return. In safe code an instance cannot be called after it was freed or after
//! `fmi2Fatal`, nor get a state of another instance.
//!
//! # Example
//! ```
//! # mod support { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/support/pack.in")); }
//! use std::path::Path;
//! use std::sync::Arc;
//!
//! use fmu_import::{Causality, Fmu, Instance, StepStatus};
//!
//! /// Steps the FMU to `stop` [s] and prints its first output.
//! fn simulate(archive: &Path, stop: f64) -> Result<f64, Box<dyn std::error::Error>> {
//!     let fmu = Arc::new(Fmu::open(archive)?);
//!     let about = &fmu.description;
//!     let output = about.indices_with_causality(Causality::Output).next().ok_or("the FMU has no output")?;
//!     let output = &about.variables[output];
//!     let step = about.default_step.unwrap_or(0.01);
//!
//!     let mut instance = Instance::new(fmu.load_library()?, "decay", false)?;
//!     instance.setup_experiment(0.0, stop, about.default_tolerance)?;
//!     instance.enter_initialization()?;
//!     instance.exit_initialization()?;
//!     let mut value = [0.0];
//!     for k in 0..(stop / step).round() as u64 {
//!         match instance.do_step(k as f64 * step, step)? {
//!             StepStatus::Done => {}
//!             StepStatus::Discarded { what, .. } | StepStatus::Terminated { what, .. } => {
//!                 return Err(what.into());
//!             }
//!         }
//!         instance.get_real(&[output.reference], &mut value)?;
//!         println!("{:.1} s: {} = {:.3}", (k + 1) as f64 * step, output.name, value[0]);
//!     }
//!     instance.terminate()?;
//!     Ok(value[0])
//! }
//!
//! # let folder = support::pack("");
//! # let archive = folder.path().join("probe.fmu");
//! let reached = simulate(&archive, 1.0)?;
//! assert!((reached - (-1.0_f64).exp()).abs() < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In the registry this crate is `trackside-fmu-import`; the name in code stays.
//!
//! # States
//! An instance whose FMU [can](Instance::can_save) do so saves its state as an [`FmuState`]. Restoring it goes back, dropping
//! it forgets it. The FMU learns at each step whether it must be able to go back, see [`Instance::set_keeps_earlier_states`].
//!
//! # Checking the unsafe code
//! `cargo test -p fmu-import` runs the calls of an instance under valgrind where that is installed. Miri cannot run foreign
//! code, but the rest: `cargo +nightly miri test -p fmu-import --lib mailbox`.

mod attributes;
mod binding;
mod cache_folder;
mod call;
mod corrections;
mod definitions;
pub mod description;
mod description_text;
mod error;
mod file_list;
mod fmi1;
mod fmi1_attributes;
mod fmi1_names;
mod fmi2;
mod fmi3;
mod linkage;
mod loaded;
mod location;
mod message;
mod platform;
mod problem_list;
mod program_search;
mod source_build;
mod terminals;
mod unpacked_archive;
mod validation;
mod value;
#[cfg_attr(not(target_os = "linux"), path = "wine/elsewhere.rs")]
mod wine;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, OnceLock, Weak};

use corrections::CorrectedDescription;
use linkage::LibraryLinkage;
use python::PythonLibrary;
use sha2::{Digest as _, Sha256};
use unpacked_archive::UnpackedArchive;

pub use attributes::{Causality, Initial, Variability};
pub use binding::{
    ArrayVariable, CallBatch, CrashNote, FOREIGN_ENVIRONMENT, FmuLibrary, FmuState, Instance, StepCalls,
    StepMemory, StepRound, ValueCall, active_calls, adopt_forked_process, call_plugin,
    cancel_wine_calls_when, catch_termination_signals, disable_crash_handlers, exit_without_destructors,
    final_exit_code, guard_exit, has_new_messages, ignore_termination_signals, messages_while_freed,
    restore_folder_and_permissions, set_final_exit_code, share_call_notes, start_watchdog,
    take_process_change_reports, termination_signal,
};
pub use call::{
    CallError, CompletedStep, DiscreteStatesUpdate, IntervalQualifier, RealInputs, StepResult, StepStatus,
};
pub use description::{
    ClockAttributes, ContinuousState, EnumerationItem, EquationStructure, FmiInterface, FmiType, FmiVersion,
    FmuDescription, IntervalVariability, StorageType, Variable,
};
pub use error::OpenError;
pub use location::FmuLocation;
pub use message::{
    FmuMessage, MOST_KINDS, MessageKind, MessageKinds, MessageLevel, SUMMARY, further_kinds_message,
};
pub use platform::LibraryOrigin;
pub use program_search::find_program;
pub use source_build::{CompilationPlan, CompiledLibrary};
pub use terminals::{MatchingRule, MemberKind, Terminal, TerminalMember, TerminalStream};
pub use value::{Value, from_hex, to_hex};

/// The file of the description.
const DESCRIPTION: &str = "modelDescription.xml";

/// A description may be this long; the longest real ones have some hundred thousand variables.
const LONGEST: u64 = 64 << 20;

/// An opened FMU, from which instances are made.
#[derive(Debug)]
pub struct Fmu {
    /// The archive.
    pub path: PathBuf,
    /// SHA-256 of the archive, in hexadecimal digits.
    pub sha256: String,
    /// What it says about itself.
    pub description: FmuDescription,
    /// What is unusual about its archive.
    pub notes: Vec<String>,
    /// The unpacked archive, which lives as long as any instance.
    folder: UnpackedArchive,
    /// Values of structural parameters that differ from the description.
    sizes: BTreeMap<u32, u64>,
    /// Set by the status fatal, which ends the life of all instances.
    lost: AtomicBool,
    /// The library, as long as somebody has it.
    loaded: Mutex<Weak<FmuLibrary>>,
    /// What to tell of the library, if it was compiled from sources; held while that goes on.
    compiled: Mutex<Option<CompiledLibrary>>,
    /// What the library is loaded with.
    linkage: OnceLock<Arc<LibraryLinkage>>,
    /// The Python that the library expects in the process, or why there is none for it.
    python: OnceLock<Result<PythonLibrary, String>>,
}

/// SHA-256 in hexadecimal digits.
#[must_use]
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Fmu {
    /// Opens the archive at `path` and reads its description. It is used for co-simulation if it can be, else for model exchange.
    ///
    /// # Errors
    /// When the file is no archive of FMI 1.0, 2.0 or 3.0 for one of these; its library is not looked at yet.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        Self::open_interface(path, None)
    }

    /// The same to be used through this interface.
    ///
    /// # Errors
    /// As of [`open`](Self::open); also when the FMU does not have the interface.
    pub fn open_interface(path: &Path, interface: Option<FmiInterface>) -> Result<Self, OpenError> {
        let (folder, sha256, notes) = UnpackedArchive::unpack(path)?;
        let sizes = fmi3::StructuralSizes::new();
        let description = read_description(folder.description_folder(), &sizes, interface, path)?;
        let (path, root) = (path.to_owned(), folder.description_folder().to_owned());
        let interface = description.interface;
        let there = FmuLocation { path, sha256, folder: root, sizes, interface, python: None };
        Ok(Self::from_unpacked(there, description, folder, notes))
    }

    /// Opens what another process unpacked, which it is at least until this one ends.
    ///
    /// # Errors
    /// When the folder is gone, or holds no such FMU.
    pub fn reopen(location: &FmuLocation) -> Result<Self, OpenError> {
        let description =
            read_description(&location.folder, &location.sizes, Some(location.interface), &location.path)?;
        let folder = UnpackedArchive::from_unpacked_folder(location.folder.clone());
        Ok(Self::from_unpacked(location.clone(), description, folder, Vec::new()))
    }

    fn from_unpacked(
        location: FmuLocation,
        mut description: FmuDescription,
        folder: UnpackedArchive,
        notes: Vec<String>,
    ) -> Self {
        let FmuLocation { path, sha256, sizes, python, .. } = location;
        description.problems.extend(notes.iter().cloned());
        let (lost, loaded, linkage) = (AtomicBool::new(false), Mutex::default(), OnceLock::new());
        let python = python.map(Ok).map_or_else(OnceLock::new, OnceLock::from);
        let compiled = Mutex::default();
        Fmu { path, sha256, description, notes, folder, sizes, lost, loaded, compiled, linkage, python }
    }

    /// Where another process finds this FMU, as long as it is not dropped.
    #[must_use]
    pub fn location(&self) -> FmuLocation {
        FmuLocation {
            path: self.path.clone(),
            sha256: self.sha256.clone(),
            folder: self.folder.description_folder().to_owned(),
            sizes: self.sizes.clone(),
            python: self.python_library().and_then(|found| found.ok().cloned()),
            interface: self.description.interface,
        }
    }

    /// Gives the arrays the sizes that follow from these values of structural parameters, by reference.
    ///
    /// # Errors
    /// When there are too many elements, or the archive has been removed.
    pub fn resize_arrays(&mut self, sizes: &BTreeMap<u32, u64>) -> Result<(), OpenError> {
        let interface = Some(self.description.interface);
        self.description = read_description(self.folder.description_folder(), sizes, interface, &self.path)?;
        self.description.problems.extend(self.notes.iter().cloned());
        self.sizes.clone_from(sizes);
        Ok(())
    }

    /// The text of the description, for those who look at it themselves.
    ///
    /// # Errors
    /// When somebody has removed the unpacked files.
    pub fn description_text(&self) -> Result<String, OpenError> {
        let found = description_text::load_description_text(self.folder.description_folder());
        found.map(|it| it.text).map_err(|what| ParseError::Broken(what).into_open_error(&self.path))
    }

    /// The contents of a file of the archive, by its path there; nothing when there is none, or the path leads out of the archive.
    #[must_use]
    pub fn read_archive_entry(&self, name: &str) -> Option<Vec<u8>> {
        let inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        inside.then(|| std::fs::read(self.folder.description_folder().join(name)).ok()).flatten()
    }

    /// The terminals, and what is wrong with others; none without the file for them.
    ///
    /// # Errors
    /// When the file cannot be read. An FMU without it runs as well.
    pub fn terminals(&self) -> Result<(Vec<Terminal>, Vec<String>), String> {
        let path = self.folder.description_folder().join(terminals::FILE);
        match std::fs::metadata(&path) {
            Err(_) => return Ok((Vec::new(), Vec::new())),
            Ok(file) if file.len() > LONGEST => {
                let length = file.len();
                return Err(format!("expected at most {LONGEST} bytes, found {length}"));
            }
            Ok(_) => {}
        }
        let xml = std::fs::read_to_string(&path).map_err(|error| error.to_string())?;
        let (terminals, mut problems) = terminals::parse_terminals(&xml)?;
        let names = self.description.variables.iter().flat_map(|it| [it.name.as_str(), it.array_name()]);
        let names: BTreeSet<_> = names.collect();
        let used = terminals.iter().flat_map(Terminal::variable_names);
        let absent = used.filter(|name| !names.contains(name));
        problems.extend(absent.map(|name| format!("there is no variable `{name}`")));
        Ok((terminals, problems))
    }

    /// Whether the unpacked files are still there: somebody may clean up temporary folders.
    #[must_use]
    pub fn are_files_intact(&self) -> bool {
        self.folder.description_folder().join(DESCRIPTION).is_file()
    }

    /// The unpacked `resources` folder, which need not be there.
    fn resources_folder(&self) -> PathBuf {
        self.folder.description_folder().join("resources")
    }
}

/// The description in the folder of the unpacked archive at `path`.
fn read_description(
    folder: &Path,
    sizes: &fmi3::StructuralSizes,
    interface: Option<FmiInterface>,
    path: &Path,
) -> Result<FmuDescription, OpenError> {
    let found = description_text::load_description_text(folder)
        .map_err(|what| ParseError::Broken(what).into_open_error(path))?;
    let mut description =
        parse_description(&found.text, sizes, interface).map_err(|refusal| refusal.into_open_error(path))?;
    description.corrections.splice(0..0, found.correction);
    description.problems.splice(0..0, found.problem);
    description.corrections.extend(platform::misnamed_library_note(folder, &description));
    Ok(description)
}

/// The text of the description in the archive at `path`, for those who want to know why it cannot be read.
///
/// # Errors
/// When there is no archive, or no such text in it.
pub fn description_text(path: &Path) -> Result<String, OpenError> {
    let (folder, ..) = UnpackedArchive::unpack(path)?;
    let found = description_text::load_description_text(folder.description_folder());
    found.map(|it| it.text).map_err(|what| ParseError::Broken(what).into_open_error(path))
}

/// Why a text is no description of an FMU that this program steps.
#[derive(Debug)]
enum ParseError {
    /// It breaks the rules.
    Broken(String),
    /// It is one of another version or interface.
    Other(String),
}

impl ParseError {
    fn into_open_error(self, path: &Path) -> OpenError {
        let path = path.to_owned();
        match self {
            ParseError::Broken(what) => OpenError::Description { path, what },
            ParseError::Other(what) => OpenError::Interface { path, what },
        }
    }
}

/// Reads a description of any version, for this interface or for the one that is preferred.
///
/// # Errors
/// When it is none of FMI 1.0, 2.0 or 3.0, or the FMU does not have the interface.
fn parse_description(
    xml: &str,
    sizes: &fmi3::StructuralSizes,
    wanted: Option<FmiInterface>,
) -> Result<FmuDescription, ParseError> {
    // The XML library compares all attributes of an element with each other.
    if let Some(place) = archive::find_element_over_limit(xml) {
        let line = 1 + xml[..place].matches('\n').count();
        let most = archive::ATTRIBUTES;
        return Err(ParseError::Broken(format!(
            "line {line}: expected at most {most} attributes of an element and namespaces, found more"
        )));
    }
    let document = roxmltree::Document::parse(xml)
        .map_err(|error| ParseError::Broken(describe_xml_error(xml, &error)))?;
    let root = document.root_element();
    let version = match root.attribute("fmiVersion").unwrap_or("none") {
        "1.0" => FmiVersion::One,
        "2.0" => FmiVersion::Two,
        version if version == "3.0" || version.starts_with("3.0.") => FmiVersion::Three,
        version => {
            return Err(ParseError::Other(format!(
                "expected FMI 1.0, 2.0 or 3.0, found {version}: export the model for co-simulation of one of them"
            )));
        }
    };
    let has = |name: &str| match version {
        FmiVersion::One => fmi1::interface(root).to_string() == name,
        FmiVersion::Two | FmiVersion::Three => root.children().any(|node| node.has_tag_name(name)),
    };
    let interfaces = FmiInterface::ALL.into_iter().filter(|it| has(&it.to_string()));
    let interfaces: Vec<_> = interfaces.collect();
    let found = wanted.map_or(interfaces.first(), |wanted| interfaces.iter().find(|it| **it == wanted));
    let Some(&interface) = found else {
        let others = ["CoSimulation", "ModelExchange", "ScheduledExecution"].into_iter();
        return Err(ParseError::Other(missing_interface(wanted, others.filter(|name| has(name)))));
    };
    let corrected = match version {
        FmiVersion::One => CorrectedDescription::default(),
        FmiVersion::Two | FmiVersion::Three => {
            corrections::correct_description(&document, version).map_err(ParseError::Broken)?
        }
    };
    let found = match version {
        FmiVersion::One => fmi1::parse(&document),
        FmiVersion::Two => fmi2::parse(&corrected.text, interface),
        FmiVersion::Three => fmi3::parse(&corrected.text, sizes, interface),
    };
    let mut found = found.map_err(ParseError::Broken)?;
    found.problems.extend(validation::value_problems(&document, &found.variables));
    found.corrections.splice(0..0, corrected.told);
    Ok(FmuDescription { interfaces, ..found })
}

/// Says why a text is not read as XML. No description needs a document type, and its entities can make a short text very long.
fn describe_xml_error(xml: &str, error: &roxmltree::Error) -> String {
    match error {
        roxmltree::Error::DtdDetected => {
            let place = xml.rfind("<!DOCTYPE").unwrap_or_default();
            let line = problem_list::describe_place(xml, None, place);
            format!(
                "{line}: expected no document type declaration, found <!DOCTYPE: remove it, and write what its entities stand for"
            )
        }
        error => format!("line {}: {error}", error.pos().row),
    }
}

/// Says what the FMU offers instead of an interface, and what to do.
fn missing_interface(wanted: Option<FmiInterface>, others: impl Iterator<Item = &'static str>) -> String {
    let others: Vec<_> = others.collect();
    let found = if others.is_empty() { "none".to_owned() } else { others.join(" and ") };
    match wanted {
        Some(wanted) => format!("expected the interface {wanted}, found {found}"),
        None => format!(
            "expected the interface CoSimulation or ModelExchange, found {found}: export the model for co-simulation"
        ),
    }
}

#[cfg(test)]
mod tests;
