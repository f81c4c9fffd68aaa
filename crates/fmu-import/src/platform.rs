//! Finds the binary of an FMU for this platform.

use std::path::{Path, PathBuf};

use crate::file_list::list_files;
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
        (FmiVersion::Two, true, _) if wide => "linux64",
        (FmiVersion::Two, true, _) => "linux32",
        (FmiVersion::Two, _, true) if wide => "win64",
        (FmiVersion::Two, _, true) => "win32",
        (FmiVersion::Two, ..) => "darwin64",
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

    /// The unpacked library for this machine.
    ///
    /// # Errors
    /// When there is none.
    pub fn library_path(&self) -> Result<PathBuf, OpenError> {
        let expected = library_archive_path(&self.description);
        let path = self.folder.description_folder().join(&expected);
        if path.is_file() {
            return Ok(path);
        }
        if let Some(only) = only_library(self.folder.description_folder(), &self.description) {
            return Ok(self.folder.description_folder().join(only));
        }
        if let Some(library) = wine::windows_library(self.folder.description_folder(), &self.description) {
            let lacking = |what| OpenError::Wine { path: self.path.clone(), what };
            return wine::check_wine(&library).map(|()| library).map_err(lacking);
        }
        let (path, found) = (self.path.clone(), self.describe_available_libraries());
        let platform = platform_folder(self.description.version);
        Err(OpenError::Platform { path, platform, expected, found })
    }

    /// The folder of the library for Windows that runs through Wine here; nothing for another library.
    #[must_use]
    pub fn wine_platform(&self) -> Option<String> {
        let library = self.library_path().ok().filter(|path| wine::is_windows_library(path))?;
        Some(library.parent()?.file_name()?.to_string_lossy().into_owned())
    }

    /// The libraries and sources that the archive has, and what to do with them.
    fn describe_available_libraries(&self) -> String {
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
        let sources = list_files(root, "sources", &["c", "cc", "cpp", "cxx"]);
        if sources.is_empty() {
            return format!("{found}; export the FMU for this platform");
        }
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        format!(
            "{found}, and sources ({}): `fmpy compile {name}` builds a library of them with CMake",
            format_names(&sources)
        )
    }
}

fn format_names(names: &[String]) -> String {
    let more = names.len().saturating_sub(LISTED);
    let listed = names[..names.len().min(LISTED)].join(", ");
    if more > 0 { format!("{listed} and {more} more") } else { listed }
}
