//! An .fmu archive of FMI 2.0 or 3.0 co-simulation goes in: it is unpacked, and its description is read and checked. Instances that
//! can be called come out.
//!
//! The archive and its description may be hostile: nothing is written outside of a temporary folder, and sizes are bounded.
//! Its library is code that runs in this process. A crash ends the process, with a line on standard error that names instance
//! and call; [`watch`] reports calls that do not return. In safe code an instance cannot be called after it was freed or after
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
//!     let output = about.with(Causality::Output).next().ok_or("the FMU has no output")?;
//!     let output = &about.variables[output];
//!     let step = about.default_step.unwrap_or(0.01);
//!
//!     let mut instance = Instance::new(fmu.load()?, "decay", false)?;
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
//! # States
//! An instance whose FMU [can](Instance::can_save) do so saves its state as an [`FmuState`]. Restoring it goes back, dropping
//! it forgets it. The FMU learns at each step whether it must be able to go back, see [`Instance::keep_history`].
//!
//! # Checking the unsafe code
//! `cargo test -p fmu-import` runs the calls of an instance under valgrind where that is installed. Miri cannot run foreign
//! code, but the rest: `cargo +nightly miri test -p fmu-import --lib mailbox`.

mod attributes;
mod binding;
mod call;
mod definitions;
pub mod description;
mod error;
mod fmi2;
mod fmi3;
mod message;
mod place;
mod terminals;
mod value;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use archive::Folder;
use place::{Unpacked, uri};
use sha2::{Digest as _, Sha256};

pub use attributes::{Causality, Initial, Variability};
pub use binding::{
    Block, FmuState, Instance, LastNote, Library, STRANGER, Visit, calls_going_on,
    changed_surroundings, complete, completed, during_plugin, guard_exit, ignore_requests_to_end,
    late_messages, leave, leave_signals_alone, note_requests_to_end, requested_end, watch,
    write_notes_to,
};
pub use call::{Advance, CallError, IntervalChange, StepStatus, Updated};
pub use description::{Description, Interval, Item, Storage, Ticks, Type, Variable, Version};
pub use error::OpenError;
pub use message::{Kinds, MOST_KINDS, Message, MessageKind, MessageLevel, SUMMARY, others};
pub use place::Place;
pub use terminals::{MatchingRule, Member, MemberKind, Stream, Terminal};
pub use value::{Value, bytes, hexadecimal};

/// The file of the description.
const DESCRIPTION: &str = "modelDescription.xml";

/// A description may be this long; the longest real ones have some hundred thousand variables.
const LONGEST: u64 = 64 << 20;

/// The folder of this platform's library, by the names of a version.
pub(crate) const fn platform(version: Version) -> &'static str {
    let windows = cfg!(target_os = "windows");
    let linux = cfg!(target_os = "linux");
    let arm = cfg!(target_arch = "aarch64");
    let wide = cfg!(target_pointer_width = "64");
    match (version, linux, windows) {
        (Version::Two, true, _) if wide => "linux64",
        (Version::Two, true, _) => "linux32",
        (Version::Two, _, true) if wide => "win64",
        (Version::Two, _, true) => "win32",
        (Version::Two, ..) => "darwin64",
        (Version::Three, true, _) if arm => "aarch64-linux",
        (Version::Three, true, _) if wide => "x86_64-linux",
        (Version::Three, true, _) => "x86-linux",
        (Version::Three, _, true) if wide => "x86_64-windows",
        (Version::Three, _, true) => "x86-windows",
        (Version::Three, ..) if arm => "aarch64-darwin",
        (Version::Three, ..) => "x86_64-darwin",
    }
}

/// An opened FMU, from which instances are made.
#[derive(Debug)]
pub struct Fmu {
    /// The archive.
    pub path: PathBuf,
    /// SHA-256 of the archive, in hexadecimal digits.
    pub sha256: String,
    /// What it says about itself.
    pub description: Description,
    /// The unpacked archive, which lives as long as any instance.
    folder: Unpacked,
    /// Values of structural parameters that differ from the description.
    sizes: BTreeMap<u32, u64>,
    /// Set by the status fatal, which ends the life of all instances.
    lost: AtomicBool,
    /// The library, as long as somebody has it.
    loaded: Mutex<Weak<Library>>,
}

/// SHA-256 in hexadecimal digits.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Fmu {
    /// Opens the archive at `path` and reads its description.
    ///
    /// # Errors
    /// When the file is no archive of FMI 2.0 or 3.0 co-simulation; its library is not looked at yet.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        let (folder, sha256, xml) = unpack(path)?;
        let description = parse(&xml, &fmi3::Sizes::new()).map_err(|refusal| refusal.of(path))?;
        let folder = Unpacked::Own(folder);
        let (path, sizes) = (path.to_owned(), BTreeMap::new());
        let (lost, loaded) = (AtomicBool::new(false), Mutex::default());
        Ok(Fmu { path, sha256, description, folder, sizes, lost, loaded })
    }

    /// Opens what another process unpacked, which it is at least until this one ends.
    ///
    /// # Errors
    /// When the folder is gone, or holds no such FMU.
    pub fn reopen(there: &Place) -> Result<Self, OpenError> {
        let Place { path, sha256, folder, sizes } = there.clone();
        let xml = std::fs::read_to_string(folder.join(DESCRIPTION));
        let xml = xml.map_err(|source| OpenError::Read { path: folder.clone(), source })?;
        let description = parse(&xml, &sizes).map_err(|refusal| refusal.of(&path))?;
        let folder = Unpacked::Borrowed(folder);
        let (lost, loaded) = (AtomicBool::new(false), Mutex::default());
        Ok(Fmu { path, sha256, description, folder, sizes, lost, loaded })
    }

    /// Where another process finds this FMU, as long as it is not dropped.
    #[must_use]
    pub fn place(&self) -> Place {
        Place {
            path: self.path.clone(),
            sha256: self.sha256.clone(),
            folder: self.folder.path().to_owned(),
            sizes: self.sizes.clone(),
        }
    }

    /// Gives the arrays the sizes that follow from these values of structural parameters, by reference.
    ///
    /// # Errors
    /// When there are too many elements, or the archive has been removed.
    pub fn resize(&mut self, sizes: &BTreeMap<u32, u64>) -> Result<(), OpenError> {
        let wrong = |what: String| OpenError::Description { path: self.path.clone(), what };
        let xml = std::fs::read_to_string(self.folder.path().join(DESCRIPTION))
            .map_err(|error| wrong(error.to_string()))?;
        self.description = parse(&xml, sizes).map_err(|refusal| refusal.of(&self.path))?;
        self.sizes.clone_from(sizes);
        Ok(())
    }

    /// The contents of a file of the archive, by its path there; nothing when there is none, or the path leads out of the archive.
    #[must_use]
    pub fn entry(&self, name: &str) -> Option<Vec<u8>> {
        let inside = Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
        inside.then(|| std::fs::read(self.folder.path().join(name)).ok()).flatten()
    }

    /// The terminals, and what is wrong with others; none without the file for them.
    ///
    /// # Errors
    /// When the file cannot be read. An FMU without it runs as well.
    pub fn terminals(&self) -> Result<(Vec<Terminal>, Vec<String>), String> {
        let path = self.folder.path().join(terminals::FILE);
        match std::fs::metadata(&path) {
            Err(_) => return Ok((Vec::new(), Vec::new())),
            Ok(file) if file.len() > LONGEST => {
                let length = file.len();
                return Err(format!("expected at most {LONGEST} bytes, found {length}"));
            }
            Ok(_) => {}
        }
        let xml = std::fs::read_to_string(&path).map_err(|error| error.to_string())?;
        let (terminals, mut problems) = terminals::read(&xml)?;
        let names = self.description.variables.iter().flat_map(|it| [it.name.as_str(), it.array()]);
        let names: BTreeSet<_> = names.collect();
        let used = terminals.iter().flat_map(Terminal::variables);
        let absent = used.filter(|name| !names.contains(name));
        problems.extend(absent.map(|name| format!("there is no variable `{name}`")));
        Ok((terminals, problems))
    }

    /// Loads the library, unless it is loaded: all instances have the same.
    ///
    /// # Errors
    /// When there is no library for this machine, or it does not load, or lacks a function.
    pub fn load(self: &Arc<Self>) -> Result<Arc<Library>, OpenError> {
        let mut loaded = self.loaded.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(library) = loaded.upgrade() {
            return Ok(library);
        }
        let library = Library::load(Arc::clone(self), &self.library()?).map(Arc::new)?;
        *loaded = Arc::downgrade(&library);
        Ok(library)
    }

    /// The functions of its version's co-simulation that the library lacks: first those without which it does not load here, then
    /// the others.
    ///
    /// # Errors
    /// When there is no library for this machine, or it does not load.
    pub fn missing_symbols(&self) -> Result<[Vec<&'static str>; 2], OpenError> {
        Library::missing(self, &self.library()?)
    }

    /// The platforms that the archive has libraries for.
    #[must_use]
    pub fn platforms(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path().join("binaries"));
        let mut names: Vec<_> = entries
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    /// The unpacked library for this machine.
    ///
    /// # Errors
    /// When there is none.
    pub fn library(&self) -> Result<PathBuf, OpenError> {
        let entry = format!(
            "binaries/{}/{}.{}",
            platform(self.description.version),
            self.description.identifier,
            std::env::consts::DLL_EXTENSION
        );
        let path = self.folder.path().join(&entry);
        if path.is_file() {
            return Ok(path);
        }
        let platforms = self.platforms();
        let found = if platforms.is_empty() { "none".to_owned() } else { platforms.join(", ") };
        let platform = platform(self.description.version);
        Err(OpenError::Platform { path: self.path.clone(), platform, expected: entry, found })
    }

    /// Whether the unpacked files are still there: somebody may clean up temporary folders.
    #[must_use]
    pub fn is_intact(&self) -> bool {
        self.folder.path().join(DESCRIPTION).is_file()
    }

    /// The unpacked `resources` folder, as its version wants it: a URI, or a path that ends with a separator, which is empty
    /// without such a folder.
    fn resources(&self) -> String {
        let folder = self.folder.path().join("resources");
        match self.description.version {
            Version::Two => uri(&folder),
            Version::Three if folder.is_dir() => format!("{}/", folder.display()),
            Version::Three => String::new(),
        }
    }
}

/// Unpacks the archive at `path`: its folder, its SHA-256, and the text of its description.
fn unpack(path: &Path) -> Result<(Folder, String, String), OpenError> {
    let read = |source| OpenError::Read { path: path.to_owned(), source };
    let bytes = archive::read(path).map_err(read)?;
    let folder = Folder::new().map_err(read)?;
    archive::unpack(path, ".fmu", &bytes, folder.path(), &mut { archive::LARGEST })?;
    let wrong = |what: String| OpenError::Description { path: path.to_owned(), what };
    let xml = folder.path().join(DESCRIPTION);
    let length = std::fs::metadata(&xml).map_err(|error| wrong(error.to_string()))?.len();
    if length > LONGEST {
        return Err(wrong(format!("expected at most {LONGEST} bytes, found {length}")));
    }
    let xml = std::fs::read_to_string(&xml).map_err(|error| wrong(error.to_string()))?;
    Ok((folder, sha256(&bytes), xml))
}

/// The text of the description in the archive at `path`, for those who want to know why it cannot be read.
///
/// # Errors
/// When there is no archive, or no such text in it.
pub fn description_text(path: &Path) -> Result<String, OpenError> {
    unpack(path).map(|(.., xml)| xml)
}

/// Why a text is no description of an FMU that this program steps.
#[derive(Debug)]
enum Refusal {
    /// It breaks the rules.
    Broken(String),
    /// It is one of another version or interface.
    Other(String),
}

impl Refusal {
    fn of(self, path: &Path) -> OpenError {
        let path = path.to_owned();
        match self {
            Refusal::Broken(what) => OpenError::Description { path, what },
            Refusal::Other(what) => OpenError::Interface { path, what },
        }
    }
}

/// Reads a description of any version.
///
/// # Errors
/// When it is none of FMI 2.0 or 3.0 co-simulation.
fn parse(xml: &str, sizes: &fmi3::Sizes) -> Result<Description, Refusal> {
    // No description needs a document type, and its entities can make a short text very long.
    if xml.contains("<!DOCTYPE") || xml.contains("<!ENTITY") {
        let what = "expected no document type declaration, found one";
        return Err(Refusal::Broken(what.to_owned()));
    }
    // The XML library compares all attributes of an element with each other.
    if let Some(place) = archive::crowded(xml) {
        let line = 1 + xml[..place].matches('\n').count();
        let most = archive::ATTRIBUTES;
        return Err(Refusal::Broken(format!(
            "line {line}: expected at most {most} attributes of an element and namespaces, found more"
        )));
    }
    let document =
        roxmltree::Document::parse(xml).map_err(|error| Refusal::Broken(error.to_string()))?;
    let root = document.root_element();
    let version = root.attribute("fmiVersion").unwrap_or("none");
    let three = version == "3.0" || version.starts_with("3.0.");
    if version != "2.0" && !three {
        return Err(Refusal::Other(format!(
            "expected FMI 2.0 or 3.0, found {version}: export the model for co-simulation of one of them"
        )));
    }
    let has = |name: &&str| root.children().any(|node| node.has_tag_name(*name));
    if !has(&"CoSimulation") {
        return Err(Refusal::Other(no_co_simulation(
            ["ModelExchange", "ScheduledExecution"].into_iter().filter(has),
        )));
    }
    let found = if three { fmi3::parse(xml, sizes) } else { fmi2::parse(xml) };
    found.map_err(Refusal::Broken)
}

/// Says what the FMU offers instead of co-simulation, and what to do.
fn no_co_simulation(others: impl Iterator<Item = &'static str>) -> String {
    let others: Vec<_> = others.collect();
    let found = if others.is_empty() { "none".to_owned() } else { others.join(" and ") };
    format!(
        "expected the interface CoSimulation, found {found}: export the model for co-simulation"
    )
}

#[cfg(test)]
mod tests;
