//! Says, before an FMU's library is loaded, which others it needs, where they lie, and what it would share with another FMU of the
//! process.
//!
//! A process has one library of a name (`DT_SONAME`): what needs that name gets the one that came first. And it has one definition of
//! a symbol of the binding `STB_GNU_UNIQUE`, which C++ gives to static members of templates and inline variables. Neither
//! `RTLD_LOCAL` nor `RTLD_DEEPBIND` changes that. A namespace of its own (`dlmopen`) would have a C library of its own as well, there are 16
//! of them at most, and threads and signals of this program would not be known there. So one of two such FMUs needs a process of its own.

mod elf;
mod missing;
mod system;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use elf::ElfLinkInfo;
pub(crate) use elf::defined_functions;
pub(crate) use missing::describe_missing_libraries;

/// An FMU may be loaded with this many libraries; a damaged one could name more.
const MOST: usize = 2_000;

/// How a library and those that it needs are loaded.
#[derive(Debug, Default)]
pub(crate) struct LibraryLinkage {
    /// The names of the libraries from the archive that are loaded.
    pub bundled: BTreeSet<String>,
    /// The names of all libraries that are needed, but for those that the program itself has.
    needed: BTreeSet<String>,
    /// Symbols of the libraries from the archive that a process has once, with the bytes of those that nobody can change.
    unique: BTreeMap<String, Option<Vec<u8>>>,
    /// Whether one of the archive calls Python.
    pub calls_python: bool,
    /// Libraries of the archive that are loaded before it, in this order: the loader does not find them by itself.
    pub first: Vec<PathBuf>,
    /// Those that the loader would not take from there either, since they have another name: what is needed, and where it lies.
    pub mismatched: Vec<(String, PathBuf)>,
    /// Those that are nowhere.
    pub missing: Vec<String>,
}

/// What two FMUs of one process would share.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum LibraryClash {
    /// A library of this name.
    Library(String),
    /// A symbol of this name.
    Symbol(String),
    /// The interpreter of Python with its modules.
    Python,
}

/// Libraries that start threads which outlive those that need them: OpenMP of GCC, LLVM and Intel, and oneTBB.
const POOLS: [&str; 4] = ["libgomp.", "libomp.", "libiomp5.", "libtbb."];

impl LibraryLinkage {
    /// Reads the library `path` of an archive that is unpacked to `root`, and all that it needs.
    pub fn read(root: &Path, path: &Path) -> Self {
        let mut linkage = LibraryLinkage::default();
        let walk = LibrarySearch { root, beside: path.parent().unwrap_or(root) };
        linkage.add_library(&walk, path, &[], true);
        linkage
    }

    /// Adds a library of the archive, or one of the system, and then those that it needs. `searched` are the folders of those that need it.
    fn add_library(&mut self, walk: &LibrarySearch, path: &Path, searched: &[PathBuf], is_own: bool) {
        let Some(object) = ElfLinkInfo::read(path) else { return };
        if is_own {
            self.bundled.extend(object.soname.clone());
            self.unique.extend(object.unique.clone());
            self.calls_python |= object.calls_python;
        }
        let (before, after) = walk.search_folders(path, &object, searched);
        for name in &object.needed {
            if system::PROGRAM.contains(name)
                || self.needed.len() >= MOST
                || !self.needed.insert(name.clone())
            {
                continue;
            }
            let Some(found) = walk.find_library(name, &before, &after) else {
                self.missing.push(name.clone());
                continue;
            };
            if found.is_own {
                self.bundled.insert(name.clone());
            }
            self.add_library(walk, &found.path, &before, found.is_own);
            match found.mode {
                LoadMode::ByLoader => {}
                LoadMode::Preload => self.first.push(found.path),
                LoadMode::SonameMismatch => self.mismatched.push((name.clone(), found.path)),
            }
        }
    }

    /// What a process with both would have only once, to the harm of one of them.
    pub fn clash_with(&self, other: &LibraryLinkage) -> Option<LibraryClash> {
        let mut libraries = self.bundled.intersection(&other.needed);
        let library = libraries.next().or_else(|| other.bundled.intersection(&self.needed).next());
        if let Some(name) = library {
            return Some(LibraryClash::Library(name.clone()));
        }
        if self.calls_python && other.calls_python {
            return Some(LibraryClash::Python);
        }
        let differs = |(name, bytes): &(&String, &Option<Vec<u8>>)| {
            let there = other.unique.get(*name);
            there.is_some_and(|there| there.is_none() || there != *bytes)
        };
        self.unique.iter().find(differs).map(|(name, _)| LibraryClash::Symbol(name.clone()))
    }

    /// Whether it calls Python, and leaves it to others to load one.
    pub fn expects_python(&self) -> bool {
        self.calls_python && !self.needed.iter().any(|name| name.starts_with("libpython"))
    }

    /// Whether it starts threads that go on when it has been freed.
    pub fn leaves_threads(&self) -> bool {
        self.needed.iter().any(|name| POOLS.iter().any(|pool| name.starts_with(pool)))
    }
}

/// How the loader gets a library.
enum LoadMode {
    /// By its own rules.
    ByLoader,
    /// By its name, once it is loaded.
    Preload,
    /// Not at all: the name that is needed is not its own.
    SonameMismatch,
}

struct LibraryFile {
    path: PathBuf,
    is_own: bool,
    mode: LoadMode,
}

struct LibrarySearch<'a> {
    /// The unpacked archive, and the folder of the FMU's library.
    root: &'a Path,
    beside: &'a Path,
}

impl LibrarySearch<'_> {
    /// The folders that are searched before and after those of the environment for what a library needs.
    fn search_folders(
        &self,
        path: &Path,
        object: &ElfLinkInfo,
        searched: &[PathBuf],
    ) -> (Vec<PathBuf>, Vec<PathBuf>) {
        let origin = path.parent().unwrap_or(self.root).display().to_string();
        let folders = |list: &Option<String>| -> Vec<PathBuf> {
            let parts = list.iter().flat_map(|list| list.split(':'));
            let parts = parts.filter(|part| !part.is_empty());
            let at = |part: &str| part.replace("${ORIGIN}", &origin).replace("$ORIGIN", &origin);
            parts.map(|part| at(part).into()).collect()
        };
        match &object.runpath {
            // It is for this library alone, and shuts off those of the others.
            Some(_) => (Vec::new(), folders(&object.runpath)),
            None => {
                let own = folders(&object.rpath).into_iter();
                (own.chain(searched.iter().cloned()).collect(), Vec::new())
            }
        }
    }

    fn find_library(&self, name: &str, before: &[PathBuf], after: &[PathBuf]) -> Option<LibraryFile> {
        let is_own = |path: &Path| path.starts_with(self.root) || self.is_in_archive(path);
        if name.contains('/') {
            let path = PathBuf::from(name);
            let found = ElfLinkInfo::read(&path).map(|_| path);
            let way = found.map(|path| LibraryFile { is_own: is_own(&path), path, mode: LoadMode::ByLoader });
            return way.or_else(|| self.find_in_archive(name.rsplit('/').next()?, name));
        }
        let folders = before.iter().cloned().chain(system::library_path_folders()).chain(after.to_vec());
        let mut paths = folders.map(|folder| folder.join(name));
        let found = paths.find(|path| ElfLinkInfo::read(path).is_some());
        match found.or_else(|| system::find_system_library(name)) {
            Some(path) => Some(LibraryFile { is_own: is_own(&path), path, mode: LoadMode::ByLoader }),
            None => self.find_in_archive(name, name),
        }
    }

    /// Whether the path leads into the archive by another way.
    fn is_in_archive(&self, path: &Path) -> bool {
        let real = |path: &Path| std::fs::canonicalize(path).ok();
        real(path).zip(real(self.root)).is_some_and(|(path, root)| path.starts_with(root))
    }

    /// A file of the archive that the loader does not look for: beside the library, or else where libraries of resources are.
    fn find_in_archive(&self, file: &str, name: &str) -> Option<LibraryFile> {
        let resources = self.root.join("resources");
        let folders = [self.beside.to_owned(), resources.join("lib"), resources];
        let candidates = folders.iter().map(|folder| folder.join(file));
        let (path, object) =
            candidates.filter_map(|path| ElfLinkInfo::read(&path).map(|it| (path, it))).next()?;
        let mode = match object.soname.is_some_and(|soname| soname == name) {
            true => LoadMode::Preload,
            false => LoadMode::SonameMismatch,
        };
        Some(LibraryFile { path, is_own: true, mode })
    }
}

#[cfg(test)]
mod tests;
