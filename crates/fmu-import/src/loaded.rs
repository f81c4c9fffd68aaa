//! Keeps the register of FMU libraries that this process has loaded, and refuses one that clashes with another.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::binding::is_loaded;
use crate::linkage::{Clash, Linkage};
use crate::{Fmu, Library, OpenError};

/// An FMU whose library is loaded.
struct LoadedFmu {
    archive: PathBuf,
    sha256: String,
    /// Its unpacked archive.
    root: PathBuf,
    linkage: Arc<Linkage>,
}

static LOADED_FMUS: Mutex<Vec<LoadedFmu>> = Mutex::new(Vec::new());

fn loaded_fmus() -> MutexGuard<'static, Vec<LoadedFmu>> {
    LOADED_FMUS.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Fmu {
    /// Notes that its library is going to be loaded.
    pub(crate) fn enter(&self) {
        let (archive, sha256) = (self.path.clone(), self.sha256.clone());
        let (root, linkage) = (self.folder.path().to_owned(), self.linkage());
        let mut all = loaded_fmus();
        all.retain(|resident| resident.root != root);
        all.push(LoadedFmu { archive, sha256, root, linkage });
    }

    /// Notes that nothing of it is loaded any more.
    pub(crate) fn leave(&self) {
        loaded_fmus().retain(|resident| resident.root != self.folder.path());
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

    /// What its library is loaded with; nothing without a library for this machine.
    pub(crate) fn linkage(&self) -> Arc<Linkage> {
        let read = || match self.library() {
            Ok(library) => Linkage::read(self.folder.path(), &library),
            Err(_) => Linkage::default(),
        };
        Arc::clone(self.linkage.get_or_init(|| Arc::new(read())))
    }

    /// Why this FMU and another one cannot be in one process: they would share what each has for itself elsewhere. Nothing for two of
    /// one unpacked archive, which share all they have.
    #[must_use]
    pub fn clash(&self, other: &Fmu) -> Option<String> {
        if self.folder.path() == other.folder.path() {
            return None;
        }
        let clash = self.linkage().clash(&other.linkage())?;
        Some(sentence(&clash, [&self.path, &other.path]))
    }

    /// Why it cannot be loaded into this process, beside what other FMUs have loaded there or left. Nothing once it is loaded.
    #[must_use]
    pub fn clash_in_process(&self) -> Option<String> {
        let beside = self.clash_with(|resident| resident.root != self.folder.path());
        beside.or_else(|| self.shadowed_library())
    }

    /// Why it does not get a library that it brings along: whoever else is in this process has one of that name.
    pub(crate) fn shadowed_library(&self) -> Option<String> {
        if loaded_fmus().iter().any(|resident| resident.sha256 == self.sha256) {
            return None;
        }
        let linkage = self.linkage();
        let name = linkage.bundled.iter().find(|name| is_loaded(Path::new(name)))?;
        let archive = self.path.display();
        Some(format!(
            "this process has another library called `{name}` than {archive} brings along"
        ))
    }

    /// The same, but beside other archives only: copies of one archive share what two instances of it share as well.
    pub(crate) fn clash_with_other_archives(&self) -> Option<String> {
        self.clash_with(|resident| resident.sha256 != self.sha256)
    }

    fn clash_with(&self, counts: impl Fn(&LoadedFmu) -> bool) -> Option<String> {
        let is_loaded = |all: &[LoadedFmu]| all.iter().any(|it| it.root == self.folder.path());
        let all = loaded_fmus();
        if all.is_empty() || is_loaded(&all) {
            return None;
        }
        let linkage = self.linkage();
        let mut others = all.iter().filter(|resident| counts(resident));
        others.find_map(|resident| {
            let clash = linkage.clash(&resident.linkage)?;
            Some(sentence(&clash, [&self.path, &resident.archive]))
        })
    }
}

fn sentence(clash: &Clash, [one, other]: [&PathBuf; 2]) -> String {
    let other = match one == other {
        true => "another copy of it".to_owned(),
        false => other.display().to_string(),
    };
    let one = one.display();
    match clash {
        Clash::Library(name) => format!(
            "{one} and {other} need a library called `{name}` that at least one of them brings along, and a process has only one of a name"
        ),
        Clash::Symbol(name) => format!(
            "{one} and {other} both define the symbol `{name}`, of which a process has only one (STB_GNU_UNIQUE: a static or inline variable of C++)"
        ),
    }
}
