//! Finds the binary of an FMU for this platform.

use std::path::{Path, PathBuf};
use std::sync::PoisonError;

use crate::file_list::list_files;
use crate::source_build::{CompilationPlan, CompiledLibrary};
use crate::{FmiVersion, Fmu, FmuDescription, OpenError, wine};

/// So many files of a kind are listed.
const LISTED: usize = 5;

/// The folder of this platform's library, by the names of a version.
pub(crate) const fn platform_folder(version: FmiVersion) -> &'static str {
    let windows = cfg!(target_os = "windows");
    let linux = cfg!(target_os = "linux");
    let arm = cfg!(target_arch = "aarch64");
    let wide = cfg!(target_pointer_width = "64");
    match (version, linux, windows) {
        (FmiVersion::One | FmiVersion::Two, true, _) if wide => "linux64",
        (FmiVersion::One | FmiVersion::Two, true, _) => "linux32",
        (FmiVersion::One | FmiVersion::Two, _, true) if wide => "win64",
        (FmiVersion::One | FmiVersion::Two, _, true) => "win32",
        (FmiVersion::One | FmiVersion::Two, ..) => "darwin64",
        (FmiVersion::Three, true, _) if arm => "aarch64-linux",
        (FmiVersion::Three, true, _) if wide => "x86_64-linux",
        (FmiVersion::Three, true, _) => "x86-linux",
        (FmiVersion::Three, _, true) if wide => "x86_64-windows",
        (FmiVersion::Three, _, true) => "x86-windows",
        (FmiVersion::Three, ..) if arm => "aarch64-darwin",
        (FmiVersion::Three, ..) => "x86_64-darwin",
    }
}

/// Where the library for this machine has to be in the archive.
fn library_archive_path(about: &FmuDescription) -> String {
    let (folder, extension) = (platform_folder(about.version), std::env::consts::DLL_EXTENSION);
    format!("binaries/{folder}/{}.{extension}", about.identifier)
}

/// The only library for this machine, under another name than that of the model: some tools give it the name of the archive.
fn only_library(folder: &Path, about: &FmuDescription) -> Option<String> {
    let own = format!("binaries/{}", platform_folder(about.version));
    match list_files(folder, &own, &[std::env::consts::DLL_EXTENSION]).as_slice() {
        [only] => Some(only.clone()),
        _ => None,
    }
}

/// What to tell of a library that has another name than that of the model.
pub(crate) fn misnamed_library_note(folder: &Path, about: &FmuDescription) -> Option<String> {
    let expected = library_archive_path(about);
    let only = only_library(folder, about).filter(|only| *only != expected)?;
    Some(format!(
        "modelIdentifier=\"{}\" asks for {expected}: {only} is taken, the only library there",
        about.identifier
    ))
}

/// Where the library for this machine comes from.
#[derive(Debug)]
#[non_exhaustive]
pub enum LibraryOrigin {
    /// It is in the unpacked archive.
    Archive(PathBuf),
    /// It is compiled from the sources of the archive.
    Sources(CompilationPlan),
    /// It is one for Windows in the unpacked archive, and runs through Wine.
    Wine(PathBuf),
}

impl LibraryOrigin {
    /// The folder of the library for Windows that runs through Wine; nothing for another library.
    #[must_use]
    pub fn wine_platform(&self) -> Option<String> {
        let LibraryOrigin::Wine(library) = self else { return None };
        Some(library.parent()?.file_name()?.to_string_lossy().into_owned())
    }
}

impl Fmu {
    /// The platforms that the archive has libraries for.
    #[must_use]
    pub fn supported_platforms(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.description_folder().join("binaries"));
        let mut names: Vec<_> = entries
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    /// Where the library for this machine comes from. Nothing is compiled for that.
    ///
    /// # Errors
    /// When there is none, and no way to one.
    pub fn library_origin(&self) -> Result<LibraryOrigin, OpenError> {
        let root = self.folder.description_folder();
        let expected = library_archive_path(&self.description);
        if root.join(&expected).is_file() {
            return Ok(LibraryOrigin::Archive(root.join(expected)));
        }
        if let Some(only) = only_library(root, &self.description) {
            return Ok(LibraryOrigin::Archive(root.join(only)));
        }
        let platform = platform_folder(self.description.version);
        let no_build = match self.compilation_plan(platform) {
            Some(Ok(build)) => return Ok(LibraryOrigin::Sources(build)),
            Some(Err(why)) => Some(why),
            None => None,
        };
        if let Some(library) = wine::windows_library(root, &self.description) {
            let lacking = |what| OpenError::Wine { path: self.path.clone(), what };
            return wine::check_wine(&library).map(|()| LibraryOrigin::Wine(library)).map_err(lacking);
        }
        let (path, found) = (self.path.clone(), self.describe_available_libraries(no_build));
        Err(OpenError::Platform { path, platform, expected, found })
    }

    /// The unpacked library for this machine.
    ///
    /// # Errors
    /// When there is none, or it is not compiled yet.
    pub fn library_path(&self) -> Result<PathBuf, OpenError> {
        match self.library_origin()? {
            LibraryOrigin::Archive(path) | LibraryOrigin::Wine(path) => Ok(path),
            LibraryOrigin::Sources(_) => {
                let what = "they are not compiled yet".to_owned();
                Err(OpenError::Sources { path: self.path.clone(), what })
            }
        }
    }

    /// The library for this machine, which is compiled if there are only sources.
    ///
    /// # Errors
    /// When there is none, and none comes of the sources.
    pub fn prepare_library(&self) -> Result<PathBuf, OpenError> {
        let mut compiled = self.compiled.lock().unwrap_or_else(PoisonError::into_inner);
        let build = match self.library_origin()? {
            LibraryOrigin::Archive(path) | LibraryOrigin::Wine(path) => return Ok(path),
            LibraryOrigin::Sources(build) => build,
        };
        let path = self.folder.description_folder().join(library_archive_path(&self.description));
        *compiled = Some(self.compile_sources(&build, &path)?);
        Ok(path)
    }

    /// Whether its library is compiled from sources, or will be.
    #[must_use]
    pub fn is_compiled(&self) -> bool {
        self.compiled_library().is_some() || matches!(self.library_origin(), Ok(LibraryOrigin::Sources(_)))
    }

    /// What to tell of the library, if it was compiled from sources.
    #[must_use]
    pub fn compiled_library(&self) -> Option<CompiledLibrary> {
        self.compiled.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// As [`LibraryOrigin::wine_platform`], of where the library comes from here.
    #[must_use]
    pub fn wine_platform(&self) -> Option<String> {
        self.library_origin().ok()?.wine_platform()
    }

    /// The libraries that the archive has, and what to do; `no_build` says why its sources are of no use, if it has some.
    fn describe_available_libraries(&self, no_build: Option<String>) -> String {
        let root = self.folder.description_folder();
        let libraries = list_files(root, "binaries", &["so", "dll", "dylib"]);
        // Beside a library may lie others that it needs.
        let is_own = |path: &&String| {
            Path::new(path).file_stem().is_some_and(|it| it == self.description.identifier.as_str())
        };
        let own: Vec<_> = libraries.iter().filter(is_own).cloned().collect();
        let found = match (libraries.as_slice(), own.as_slice()) {
            ([], _) => "none".to_owned(),
            (others, []) => format_names(others),
            (_, own) => format_names(own),
        };
        match no_build {
            None => format!("{found}; export the FMU for this platform"),
            Some(why) => format!("{found}, and sources, which cannot be compiled: {why}"),
        }
    }
}

fn format_names(names: &[String]) -> String {
    let more = names.len().saturating_sub(LISTED);
    let listed = names[..names.len().min(LISTED)].join(", ");
    if more > 0 { format!("{listed} and {more} more") } else { listed }
}
