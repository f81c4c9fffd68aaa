//! Unpacks an FMU and finds its model description, also in a subfolder or under another name.

use std::path::{Path, PathBuf};

use archive::TemporaryFolder;

use crate::{DESCRIPTION, OpenError, sha256_hex};

/// An unpacked archive.
#[derive(Debug)]
pub(crate) struct UnpackedArchive {
    /// The folder with the description.
    root: PathBuf,
    /// Removed when it is dropped; nothing when the folder is that of another process.
    _folder: Option<TemporaryFolder>,
}

impl UnpackedArchive {
    /// Unpacks the archive at `path`; SHA-256 of the archive, and what there is to tell about it.
    pub fn unpack(path: &Path) -> Result<(Self, String, Vec<String>), OpenError> {
        let read = |source| OpenError::Read { path: path.to_owned(), source };
        let bytes = archive::read_archive(path).map_err(read)?;
        let folder = TemporaryFolder::new().map_err(read)?;
        let mut notes =
            archive::unpack_archive(path, ".fmu", &bytes, folder.folder_path(), &mut { archive::LARGEST })?;
        let wrong = |what: String| OpenError::Description { path: path.to_owned(), what };
        let (root, note) = find_description_folder(folder.folder_path()).map_err(wrong)?;
        notes.extend(note);
        Ok((UnpackedArchive { root, _folder: Some(folder) }, sha256_hex(&bytes), notes))
    }

    /// What another process unpacked.
    pub fn from_unpacked_folder(root: PathBuf) -> Self {
        UnpackedArchive { root, _folder: None }
    }

    /// The folder with the description.
    pub fn description_folder(&self) -> &Path {
        &self.root
    }
}

/// The folder that the description is in, and what is unusual about that. A description with other letters gets its name.
fn find_description_folder(folder: &Path) -> Result<(PathBuf, Option<String>), String> {
    let at_top = find_description_name(folder)?;
    if let Some(name) = at_top {
        return Ok((folder.to_owned(), unusual_place_note(folder, Path::new(&name))));
    }
    let names = folder_entry_names(folder)?;
    // What macOS adds.
    let inner = names.iter().filter(|name| *name != "__MACOSX");
    let mut found = Vec::new();
    for name in inner.filter(|name| folder.join(name).is_dir()) {
        found.extend(find_description_name(&folder.join(name))?.map(|file| Path::new(name).join(file)));
    }
    match &found[..] {
        [only] => {
            let root = only.parent().map_or(folder.to_owned(), |parent| folder.join(parent));
            Ok((root, unusual_place_note(folder, only)))
        }
        [] => {
            let shown: Vec<_> = names.iter().take(5).map(String::as_str).collect();
            let more = if names.len() > 5 { ", ..." } else { "" };
            let kind = match names.iter().any(|name| name == "SystemStructure.ssd") {
                true => "; it is a system of SSP: give it the ending .ssp",
                false => "",
            };
            Err(format!(
                "expected it at the top of the archive, found {}{more}{kind}",
                if shown.is_empty() { "nothing".to_owned() } else { shown.join(", ") }
            ))
        }
        several => {
            let several: Vec<_> = several.iter().map(|path| path.display().to_string()).collect();
            let several = several.join(" and ");
            Err(format!("expected one at the top of the archive, found {several}: pack each FMU for itself"))
        }
    }
}

/// What is unusual about the place of the description in the archive.
fn unusual_place_note(folder: &Path, found: &Path) -> Option<String> {
    if found == Path::new(DESCRIPTION) {
        return None;
    }
    let (parent, name) = (folder.join(found.parent()?), found.file_name()?);
    if name != DESCRIPTION {
        // The folder is ours, so the name is free for us to correct.
        let _ = std::fs::rename(parent.join(name), parent.join(DESCRIPTION));
    }
    let found = found.display();
    Some(format!(
        "its description is `{found}` in the archive: the standard, and so other tools, expect `{DESCRIPTION}` at the top"
    ))
}

/// The name of the description in a folder, which may have other letters there.
fn find_description_name(folder: &Path) -> Result<Option<String>, String> {
    if folder.join(DESCRIPTION).is_file() {
        return Ok(Some(DESCRIPTION.to_owned()));
    }
    let names = folder_entry_names(folder)?;
    let alike: Vec<_> = names.into_iter().filter(|name| name.eq_ignore_ascii_case(DESCRIPTION)).collect();
    match &alike[..] {
        [] => Ok(None),
        [only] => Ok(Some(only.clone())),
        several => Err(format!("expected one at the top of the archive, found {}", several.join(" and "))),
    }
}

/// What is in a folder.
fn folder_entry_names(folder: &Path) -> Result<Vec<String>, String> {
    let entries = std::fs::read_dir(folder).map_err(|error| error.to_string())?;
    let names = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
    // That of the lock of the folder is ours.
    let mut names: Vec<_> = names.filter(|name| !name.starts_with('.')).collect();
    names.sort();
    Ok(names)
}
