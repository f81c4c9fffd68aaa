//! Opens an `.ssp` archive, a folder or an `.ssd` file, and chooses among its variants.

use std::path::{Path, PathBuf};

use crate::flat::FlatSystem;
use crate::notes::ReadingNotes;
use crate::package::{DEFAULT, PackageLocation, PackageReader};
use crate::tree::SystemTree;
use crate::{Error, SspSystem, SystemExperiment, SystemVariant};

/// Opens an `.ssp` archive, a folder with a `SystemStructure.ssd`, or an `.ssd` file.
///
/// `variant` chooses another `.ssd` file of the archive or folder, by the name of the file with or without its ending, or by
/// the name in it.
///
/// # Errors
/// When a file is missing, broken, hostile or against the rules of the standard, or asks for something other than FMUs.
pub fn open_system(path: &Path, variant: Option<&str>) -> Result<SspSystem, Error> {
    let notes = ReadingNotes::default();
    let mut store = PackageReader::new();
    let within = system_folder(path, &mut store)?;
    let file = match (&within, variant) {
        (None, None) => single_file_location(path),
        (None, Some(wanted)) => {
            let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let found = vec![SystemVariant { file, name: String::new() }];
            return Err(Error::Variant { path: path.to_owned(), wanted: wanted.to_owned(), found });
        }
        (Some(folder), None) => PackageLocation::new(folder, path, DEFAULT),
        (Some(folder), Some(wanted)) => find_variant(path, folder, wanted, &notes)?,
    };
    let mut others = match &within {
        Some(folder) => description_files(path, folder)?,
        None => Vec::new(),
    };
    others.retain(|other| file.path().file_name().is_none_or(|used| *used != **other));
    let mut tree = SystemTree::new(store, &notes);
    let description = tree.load_description(&file)?;
    let outer = tree.instantiate_element(&description, &description.system, String::new())?;
    let FlatSystem { components, connections, inputs, outputs } = tree.flatten(outer)?;
    let experiment = SystemExperiment { start: description.start, stop: description.stop };
    let display_path = description.location.display_path();
    let folders = tree.store.into_unpacked_folders();
    let stepping = description.stepping.clone();
    let (name, annotations) = (description.name.clone(), description.annotations.clone());
    let notes = notes.into_sentences();
    Ok(SspSystem {
        name,
        description: display_path,
        components,
        connections,
        inputs,
        outputs,
        experiment,
        stepping,
        annotations,
        others,
        notes,
        folder: within.unwrap_or_else(|| path.parent().unwrap_or(Path::new("")).to_owned()),
        folders,
    })
}

/// Descriptions in an archive or a folder, that which is meant without a name first.
///
/// # Errors
/// When the archive or one of the descriptions cannot be read.
pub fn list_variants(path: &Path) -> Result<Vec<SystemVariant>, Error> {
    let mut store = PackageReader::new();
    let notes = ReadingNotes::default();
    match system_folder(path, &mut store)? {
        Some(folder) => variants_in_folder(path, &folder, &notes),
        None => {
            let name =
                SystemTree::new(store, &notes).load_description(&single_file_location(path))?.name.clone();
            let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            Ok(vec![SystemVariant { file, name }])
        }
    }
}

/// The folder of the system; `None` when the path is that of a description.
fn system_folder(path: &Path, store: &mut PackageReader) -> Result<Option<PathBuf>, Error> {
    if path.is_dir() {
        return Ok(Some(path.to_owned()));
    }
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ssd")) {
        return Ok(None);
    }
    store.unpack_once(path, path).map(Some)
}

fn single_file_location(path: &Path) -> PackageLocation {
    let folder = path.parent().unwrap_or(Path::new(""));
    PackageLocation::new(folder, folder, &path.file_name().unwrap_or_default().to_string_lossy())
}

/// The files of descriptions in a folder, that which is meant without a name first.
fn description_files(path: &Path, folder: &Path) -> Result<Vec<String>, Error> {
    let failed = |source| Error::Read { path: path.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let file = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        if Path::new(&file).extension().is_some_and(|ending| ending == "ssd") {
            files.push(file);
        }
    }
    files.sort_by_key(|file| (file != DEFAULT, file.clone()));
    Ok(files)
}

fn variants_in_folder(path: &Path, folder: &Path, notes: &ReadingNotes) -> Result<Vec<SystemVariant>, Error> {
    // A store of its own: texts are read once more when one of them is chosen.
    let mut tree = SystemTree::new(PackageReader::new(), notes);
    let variants = description_files(path, folder)?.into_iter().map(|file| {
        let name = tree.load_description(&PackageLocation::new(folder, path, &file))?.name.clone();
        Ok(SystemVariant { file, name })
    });
    variants.collect()
}

fn find_variant(
    path: &Path,
    folder: &Path,
    wanted: &str,
    notes: &ReadingNotes,
) -> Result<PackageLocation, Error> {
    let discarded = ReadingNotes::default();
    let variants = variants_in_folder(path, folder, &discarded)?;
    let stem = |file: &str| file.strip_suffix(".ssd").unwrap_or(file).to_owned();
    let by_file = variants.iter().find(|x| x.file == wanted || stem(&x.file) == wanted);
    let Some(found) = by_file.or_else(|| variants.iter().find(|x| x.name == wanted)) else {
        let (path, wanted) = (path.to_owned(), wanted.to_owned());
        return Err(Error::Variant { path, wanted, found: variants });
    };
    notes.add_note(|| format!("the variant {} is used", found.file));
    Ok(PackageLocation::new(folder, path, &found.file))
}
