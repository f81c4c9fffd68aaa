//! Names the files of a bundle by paths that are valid on every operating system.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::BundledFile;

/// The files that were gathered. One that is named several times is there once.
pub(super) struct BundleFiles {
    pub all: BTreeMap<String, BundledFile>,
    /// Paths in the bundle by those of the files.
    known: BTreeMap<(PathBuf, String), String>,
    /// Paths in the bundle in small letters.
    taken: BTreeSet<String>,
}

impl BundleFiles {
    pub fn new() -> Self {
        BundleFiles { all: BTreeMap::new(), known: BTreeMap::new(), taken: BTreeSet::new() }
    }

    /// Keeps a path free.
    pub fn reserve_path(&mut self, inside: &str) {
        self.taken.insert(inside.to_lowercase());
    }

    /// Adds a file to a folder of the bundle, and returns its path there.
    ///
    /// # Errors
    /// In words, when it is no file.
    pub fn add_file(&mut self, path: &Path, folder: &str) -> Result<String, String> {
        let real = canonical_file_path(path)?;
        if let Some(inside) = self.known.get(&(real.clone(), folder.to_owned())) {
            return Ok(inside.clone());
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let inside = self.take_free_path(&name, folder);
        self.all.insert(inside.clone(), BundledFile::File(real.clone()));
        self.known.insert((real, folder.to_owned()), inside.clone());
        Ok(inside)
    }

    /// Adds a file under this path.
    ///
    /// # Errors
    /// In words, when it is no file, or another one has the path.
    pub fn add_as(&mut self, path: &Path, inside: &str) -> Result<(), String> {
        let content = BundledFile::File(canonical_file_path(path)?);
        if self.all.get(inside) == Some(&content) {
            return Ok(());
        }
        if portable_path(inside) != inside || !self.taken.insert(inside.to_lowercase()) {
            return Err(format!(
                "the file cannot be gathered as `{inside}`: expected letters, digits, `.`, `_` and `-`, and a name that no other file has; rename it"
            ));
        }
        self.all.insert(inside.to_owned(), content);
        Ok(())
    }

    /// Adds a text to a folder of the bundle, and returns its path there.
    pub fn add_text(&mut self, name: &str, folder: &str, text: String) -> String {
        let content = BundledFile::Text(text);
        let same = self.all.iter().find(|(inside, known)| {
            **known == content && inside.strip_prefix(folder).is_some_and(|it| it.ends_with(name))
        });
        if let Some((inside, _)) = same {
            return inside.clone();
        }
        let inside = self.take_free_path(name, folder);
        self.all.insert(inside.clone(), content);
        inside
    }

    /// A path in the folder that is free, on systems that ignore case, too.
    fn take_free_path(&mut self, name: &str, folder: &str) -> String {
        let name = portable_path(name);
        let (stem, ending) = name.split_at(name.rfind('.').unwrap_or(name.len()));
        let folder = folder.trim_end_matches('/');
        let mut inside = format!("{folder}/{name}");
        let mut number = 2;
        while !self.taken.insert(inside.to_lowercase()) {
            inside = format!("{folder}/{stem}_{number}{ending}");
            number += 1;
        }
        inside
    }
}

fn canonical_file_path(path: &Path) -> Result<PathBuf, String> {
    let found = std::fs::canonicalize(path).map_err(|error| error.to_string());
    match found {
        Ok(real) if real.is_file() => Ok(real),
        Ok(_) => Err(format!("expected a file, found a folder at {}", path.display())),
        Err(what) => Err(format!("cannot read {}: {what}", path.display())),
    }
}

/// A path of letters that all systems and archives hold.
fn portable_path(text: &str) -> String {
    let kept = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-' | '/');
    text.chars().map(|c| if kept(c) { c } else { '_' }).collect()
}
