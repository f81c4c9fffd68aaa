//! Keeps the register of FMU libraries that this process has loaded, and refuses one that clashes with another.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use python::{PythonInterpreter, PythonLibrary};

use crate::binding::is_loaded;
use crate::linkage::{LibraryClash, LibraryLinkage};
use crate::{Fmu, FmuLibrary, OpenError};

/// An FMU whose library is loaded.
struct LoadedFmu {
    archive: PathBuf,
    sha256: String,
    /// Its unpacked archive.
    root: PathBuf,
    linkage: Arc<LibraryLinkage>,
}

static LOADED_FMUS: Mutex<Vec<LoadedFmu>> = Mutex::new(Vec::new());

fn loaded_fmus() -> MutexGuard<'static, Vec<LoadedFmu>> {
    LOADED_FMUS.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Fmu {
    /// Notes that its library is going to be loaded.
    pub(crate) fn register_loaded(&self) {
        let (archive, sha256) = (self.path.clone(), self.sha256.clone());
        let (root, linkage) = (self.folder.description_folder().to_owned(), self.library_linkage());
        let mut all = loaded_fmus();
        all.retain(|resident| resident.root != root);
        all.push(LoadedFmu { archive, sha256, root, linkage });
    }

    /// Notes that nothing of it is loaded any more.
    pub(crate) fn unregister_loaded(&self) {
        loaded_fmus().retain(|resident| resident.root != self.folder.description_folder());
    }

    /// Loads the library, unless it is loaded: all instances have the same. It is compiled if there are only sources.
    ///
    /// # Errors
    /// When there is no library for this machine, or it does not load, or lacks a function.
    pub fn load_library(self: &Arc<Self>) -> Result<Arc<FmuLibrary>, OpenError> {
        let mut loaded = self.loaded.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(library) = loaded.upgrade() {
            return Ok(library);
        }
        let library = FmuLibrary::load(Arc::clone(self), &self.prepare_library()?).map(Arc::new)?;
        *loaded = Arc::downgrade(&library);
        Ok(library)
    }

    /// The functions of its version's co-simulation that the library lacks: first those without which it does not load here, then
    /// the others.
    ///
    /// # Errors
    /// When there is no library for this machine, or it does not load.
    pub fn missing_symbols(&self) -> Result<[Vec<&'static str>; 2], OpenError> {
        FmuLibrary::missing_functions(self, &self.prepare_library()?)
    }

    /// What its library is loaded with; nothing without a library for this machine, or before it is compiled.
    pub(crate) fn library_linkage(&self) -> Arc<LibraryLinkage> {
        let Ok(library) = self.library_path() else { return Arc::default() };
        let read = || LibraryLinkage::read(self.folder.description_folder(), &library);
        Arc::clone(self.linkage.get_or_init(|| Arc::new(read())))
    }

    /// The Python that its library expects in the process, as FMUs of PythonFMU do; none of an FMU that expects none.
    ///
    /// # Errors
    /// In a sentence, when there is no such Python.
    #[must_use]
    pub fn python_library(&self) -> Option<Result<&PythonLibrary, &str>> {
        let find = || PythonInterpreter::choose_interpreter(None).find_shared_library();
        let expects = self.library_linkage().expects_python();
        expects.then(|| self.python.get_or_init(find).as_ref().map_err(String::as_str))
    }

    /// Why this FMU and another one cannot be in one process: they would share what each has for itself elsewhere. Nothing for two of
    /// one unpacked archive, which share all they have.
    #[must_use]
    pub fn clash_reason(&self, other: &Fmu) -> Option<String> {
        if self.folder.description_folder() == other.folder.description_folder() {
            return None;
        }
        let clash = self.library_linkage().clash_with(&other.library_linkage())?;
        Some(describe_clash(&clash, [&self.path, &other.path]))
    }

    /// Why it cannot be loaded into this process, beside what other FMUs have loaded there or left. Nothing once it is loaded.
    #[must_use]
    pub fn clash_in_process(&self) -> Option<String> {
        let beside = self.clash_with(|resident| resident.root != self.folder.description_folder());
        beside.or_else(|| self.shadowed_library())
    }

    /// Why it does not get a library that it brings along: whoever else is in this process has one of that name.
    pub(crate) fn shadowed_library(&self) -> Option<String> {
        if loaded_fmus().iter().any(|resident| resident.sha256 == self.sha256) {
            return None;
        }
        let linkage = self.library_linkage();
        let name = linkage.bundled.iter().find(|name| is_loaded(Path::new(name)))?;
        let archive = self.path.display();
        Some(format!("this process has another library called `{name}` than {archive} brings along"))
    }

    /// The same, but beside other archives only: copies of one archive share what two instances of it share as well.
    pub(crate) fn clash_reason_with_archives(&self) -> Option<String> {
        self.clash_with(|resident| resident.sha256 != self.sha256)
    }

    fn clash_with(&self, counts: impl Fn(&LoadedFmu) -> bool) -> Option<String> {
        let is_loaded = |all: &[LoadedFmu]| all.iter().any(|it| it.root == self.folder.description_folder());
        let all = loaded_fmus();
        if all.is_empty() || is_loaded(&all) {
            return None;
        }
        let linkage = self.library_linkage();
        let mut others = all.iter().filter(|resident| counts(resident));
        others.find_map(|resident| {
            let clash = linkage.clash_with(&resident.linkage)?;
            Some(describe_clash(&clash, [&self.path, &resident.archive]))
        })
    }
}

fn describe_clash(clash: &LibraryClash, [one, other]: [&PathBuf; 2]) -> String {
    let other = match one == other {
        true => "another copy of it".to_owned(),
        false => other.display().to_string(),
    };
    let one = one.display();
    match clash {
        LibraryClash::Library(name) => format!(
            "{one} and {other} need a library called `{name}` that at least one of them brings along, and a process has only one of a name"
        ),
        LibraryClash::Python => format!(
            "{one} and {other} expect Python in the process, and a process has only one, with one module of a name"
        ),
        LibraryClash::Symbol(name) => format!(
            "{one} and {other} both define the symbol `{name}`, of which a process has only one (STB_GNU_UNIQUE: a static or inline variable of C++)"
        ),
    }
}
