//! Opens an `.ssp` archive, a folder or an `.ssd` file, and chooses among its variants.

use std::path::{Path, PathBuf};

use crate::flat::FlatSystem;
use crate::notes::Notes;
use crate::package::{DEFAULT, Location, Store};
use crate::tree::Tree;
use crate::{Error, Experiment, System, Variant};

/// Opens an `.ssp` archive, a folder with a `SystemStructure.ssd`, or an `.ssd` file.
///
/// `variant` chooses another `.ssd` file of the archive or folder, by the name of the file with or without its ending, or by
/// the name in it.
///
/// # Errors
/// When a file is missing, broken, hostile or against the rules of the standard, or asks for something other than FMUs.
pub fn open(path: &Path, variant: Option<&str>) -> Result<System, Error> {
    let notes = Notes::default();
    let mut store = Store::new();
    let within = folder(path, &mut store)?;
    let file = match (&within, variant) {
        (None, None) => single(path),
        (None, Some(wanted)) => {
            let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let found = vec![Variant { file, name: String::new() }];
            return Err(Error::Variant { path: path.to_owned(), wanted: wanted.to_owned(), found });
        }
        (Some(folder), None) => Location::new(folder, path, DEFAULT),
        (Some(folder), Some(wanted)) => chosen(path, folder, wanted, &notes)?,
    };
    let mut others = match &within {
        Some(folder) => files(path, folder)?,
        None => Vec::new(),
    };
    others.retain(|other| file.path().file_name().is_none_or(|used| *used != **other));
    let mut tree = Tree::new(store, &notes);
    let description = tree.description(&file)?;
    let outer = tree.element(&description, &description.system, String::new())?;
    let FlatSystem { components, connections, inputs, outputs } = tree.flatten(outer)?;
    let experiment = Experiment { start: description.start, stop: description.stop };
    let display_path = description.location.display_path();
    let folders = tree.store.folders();
    let stepping = description.stepping.clone();
    let (name, annotations) = (description.name.clone(), description.annotations.clone());
    let notes = notes.take();
    Ok(System {
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
pub fn variants(path: &Path) -> Result<Vec<Variant>, Error> {
    let mut store = Store::new();
    let notes = Notes::default();
    match folder(path, &mut store)? {
        Some(folder) => within(path, &folder, &notes),
        None => {
            let name = Tree::new(store, &notes).description(&single(path))?.name.clone();
            let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            Ok(vec![Variant { file, name }])
        }
    }
}

/// The folder of the system; `None` when the path is that of a description.
fn folder(path: &Path, store: &mut Store) -> Result<Option<PathBuf>, Error> {
    if path.is_dir() {
        return Ok(Some(path.to_owned()));
    }
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ssd")) {
        return Ok(None);
    }
    store.unpacked(path, path).map(Some)
}

fn single(path: &Path) -> Location {
    let folder = path.parent().unwrap_or(Path::new(""));
    Location::new(folder, folder, &path.file_name().unwrap_or_default().to_string_lossy())
}

/// The files of descriptions in a folder, that which is meant without a name first.
fn files(path: &Path, folder: &Path) -> Result<Vec<String>, Error> {
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

fn within(path: &Path, folder: &Path, notes: &Notes) -> Result<Vec<Variant>, Error> {
    // A store of its own: texts are read once more when one of them is chosen.
    let mut tree = Tree::new(Store::new(), notes);
    let variants = files(path, folder)?.into_iter().map(|file| {
        let name = tree.description(&Location::new(folder, path, &file))?.name.clone();
        Ok(Variant { file, name })
    });
    variants.collect()
}

fn chosen(path: &Path, folder: &Path, wanted: &str, notes: &Notes) -> Result<Location, Error> {
    let discarded = Notes::default();
    let variants = within(path, folder, &discarded)?;
    let stem = |file: &str| file.strip_suffix(".ssd").unwrap_or(file).to_owned();
    let by_file = variants.iter().find(|x| x.file == wanted || stem(&x.file) == wanted);
    let Some(found) = by_file.or_else(|| variants.iter().find(|x| x.name == wanted)) else {
        let (path, wanted) = (path.to_owned(), wanted.to_owned());
        return Err(Error::Variant { path, wanted, found: variants });
    };
    notes.add(|| format!("the variant {} is used", found.file));
    Ok(Location::new(folder, path, &found.file))
}
