//! An .fmu archive of FMI 2.0 co-simulation goes in: it is unpacked, and its description is read and checked. Instances that
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

mod archive;
mod attributes;
mod binding;
mod call;
mod definitions;
pub mod description;
mod error;
mod fmi2;
mod folder;
mod value;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use sha2::{Digest as _, Sha256};

pub use attributes::{Causality, Initial, Variability};
pub use binding::{FmuState, Instance, Library, STRANGER, watch};
pub use call::{CallError, Message, MessageLevel, StepStatus};
pub use description::{Description, Item, Type, Variable};
pub use error::OpenError;
use folder::Folder;
pub use value::Value;

/// An archive may unpack to this many bytes, which is far more than any real one needs.
const LARGEST: u64 = 4 << 30;

/// A description may be this long; the longest real ones have some hundred thousand variables.
const LONGEST: u64 = 64 << 20;

/// The folders of this platform's library, by FMI 2.0's names.
pub(crate) const PLATFORM: &str = if cfg!(all(target_os = "linux", target_pointer_width = "64")) {
    "linux64"
} else if cfg!(target_os = "linux") {
    "linux32"
} else if cfg!(all(target_os = "windows", target_pointer_width = "64")) {
    "win64"
} else if cfg!(target_os = "windows") {
    "win32"
} else {
    "darwin64"
};

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
    folder: Folder,
    /// Set by `fmi2Fatal`, which ends the life of all instances.
    lost: AtomicBool,
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
    /// When the file is no FMI 2.0 co-simulation archive; its library is not looked at yet.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        let read = |source| OpenError::Read { path: path.to_owned(), source };
        let bytes = std::fs::read(path).map_err(read)?;
        let folder = Folder::new().map_err(read)?;
        archive::unpack(path, &bytes, folder.path())?;
        let wrong = |what: String| OpenError::Description { path: path.to_owned(), what };
        let xml = folder.path().join("modelDescription.xml");
        let length = std::fs::metadata(&xml).map_err(|error| wrong(error.to_string()))?.len();
        if length > LONGEST {
            return Err(wrong(format!("expected at most {LONGEST} bytes, found {length}")));
        }
        let xml = std::fs::read_to_string(&xml).map_err(|error| wrong(error.to_string()))?;
        let description = fmi2::parse(&xml).map_err(wrong)?;
        Ok(Fmu {
            path: path.to_owned(),
            sha256: sha256(&bytes),
            description,
            folder,
            lost: AtomicBool::new(false),
        })
    }

    /// Loads the library.
    ///
    /// # Errors
    /// When there is no library for this machine, or it does not load, or lacks a function.
    pub fn load(self: &Arc<Self>) -> Result<Arc<Library>, OpenError> {
        let library = self.library()?;
        Library::load(Arc::clone(self), &library).map(Arc::new)
    }

    /// The functions of FMI 2.0 co-simulation that the library lacks.
    ///
    /// # Errors
    /// When there is no library for this machine, or it does not load.
    pub fn missing_symbols(&self) -> Result<Vec<&'static str>, OpenError> {
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
            "binaries/{PLATFORM}/{}.{}",
            self.description.identifier,
            std::env::consts::DLL_EXTENSION
        );
        let path = self.folder.path().join(&entry);
        if path.is_file() {
            return Ok(path);
        }
        let platforms = self.platforms();
        let found = if platforms.is_empty() { "none".to_owned() } else { platforms.join(", ") };
        Err(OpenError::Platform { path: self.path.clone(), expected: entry, found })
    }

    /// Whether the unpacked files are still there: somebody may clean up temporary folders.
    #[must_use]
    pub fn is_intact(&self) -> bool {
        self.folder.path().join("modelDescription.xml").is_file()
    }

    /// The URI of the unpacked `resources` folder, as FMI 2.0 wants it.
    fn resources(&self) -> String {
        uri(&self.folder.path().join("resources"))
    }
}

/// The URI of an absolute path (RFC 3986, section 2): all bytes but those that mean nothing else are escaped.
fn uri(path: &Path) -> String {
    let escaped = path.as_os_str().as_encoded_bytes().iter().map(|&byte| match byte {
        b'/' | b'-' | b'.' | b'_' | b'~' => char::from(byte).to_string(),
        _ if byte.is_ascii_alphanumeric() => char::from(byte).to_string(),
        _ => format!("%{byte:02X}"),
    });
    format!("file://{}", escaped.collect::<String>())
}

#[cfg(test)]
mod tests;
