//! Names the libraries that a library for Windows needs and that are nowhere.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use object::LittleEndian as LE;
use object::pe::{ImageNtHeaders32, ImageNtHeaders64};
use object::read::pe::{ImageNtHeaders, PeFile};

/// A damaged library could name more.
const MOST: usize = 500;

/// The libraries that the one at `path`, or one of those beside it that it needs, needs and that lie neither there nor in `system`.
pub(super) fn missing_libraries(path: &Path, system: &Path) -> Vec<String> {
    let beside = path.parent().unwrap_or(Path::new("."));
    let (mut known, mut missing, mut left) = (BTreeSet::new(), Vec::new(), vec![path.to_owned()]);
    while let Some(path) = left.pop() {
        for name in imported_names(&path) {
            if known.len() >= MOST || !known.insert(name.to_ascii_lowercase()) || is_virtual(&name) {
                continue;
            }
            match find_file(beside, &name) {
                Some(own) => left.push(own),
                None if find_file(system, &name).is_some() => {}
                None => missing.push(name),
            }
        }
    }
    missing
}

/// Names that Windows maps to others.
fn is_virtual(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    name.starts_with("api-ms-win-") || name.starts_with("ext-ms-win-")
}

/// A file of a folder, whatever letters are capital.
fn find_file(folder: &Path, name: &str) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let mut alike = entries.filter(|entry| entry.file_name().eq_ignore_ascii_case(name));
    alike.next().map(|entry| entry.path())
}

/// The names in the import table of a library; none of what is no library.
fn imported_names(path: &Path) -> Vec<String> {
    let Ok(bytes) = std::fs::read(path) else { return Vec::new() };
    let names = names_of::<ImageNtHeaders64>(&bytes).or_else(|| names_of::<ImageNtHeaders32>(&bytes));
    names.unwrap_or_default()
}

fn names_of<H: ImageNtHeaders>(bytes: &[u8]) -> Option<Vec<String>> {
    let file = PeFile::<H>::parse(bytes).ok()?;
    let table = file.import_table().ok()??;
    let mut names = Vec::new();
    let mut descriptors = table.descriptors().ok()?;
    while let Ok(Some(descriptor)) = descriptors.next() {
        let name = table.name(descriptor.name.get(LE)).ok()?;
        names.push(String::from_utf8_lossy(name).into_owned());
    }
    Some(names)
}
