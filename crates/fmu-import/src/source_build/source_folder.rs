//! Reads the folder `sources` of an unpacked archive: its files, and which of them include which.

use std::collections::BTreeSet;
use std::path::{Component, Path};

use sha2::{Digest as _, Sha256};

/// The folder in the archive.
pub(super) const SOURCES: &str = "sources";

/// The endings of files in C and in C++, and of those that they include.
const C: [&str; 1] = ["c"];
const CPP: [&str; 4] = ["cc", "cpp", "cxx", "C"];
const INCLUDED: [&str; 6] = ["h", "hh", "hpp", "hxx", "inc", "inl"];

/// A folder has at most this many files; the largest ones that were met have some hundred.
const MOST: usize = 50_000;

/// The files below `sources`.
pub(super) struct SourceFolder<'a> {
    /// The folder of the description.
    root: &'a Path,
    /// Their paths from `sources`, sorted.
    pub files: BTreeSet<String>,
}

/// What the sources include.
#[derive(Debug, Default)]
pub(super) struct SourceIncludes {
    /// Sources that are part of others, such as those of an `all.c`.
    pub sources: BTreeSet<String>,
    /// Whether a file includes one that lies elsewhere in the archive.
    pub leaves_folder: bool,
}

impl<'a> SourceFolder<'a> {
    /// Lists the files of the archive that is unpacked to `root`.
    pub fn read(root: &'a Path) -> Self {
        let (mut files, mut left) = (BTreeSet::new(), vec![String::new()]);
        while let Some(folder) = left.pop() {
            let path = root.join(SOURCES).join(&folder);
            for entry in std::fs::read_dir(path).into_iter().flatten().flatten() {
                let Ok(name) = entry.file_name().into_string() else { continue };
                let name = if folder.is_empty() { name } else { format!("{folder}/{name}") };
                match entry.file_type() {
                    Ok(kind) if kind.is_dir() => left.push(name),
                    _ if files.len() < MOST => drop(files.insert(name)),
                    _ => {}
                }
            }
        }
        SourceFolder { root, files }
    }

    /// The files that a compiler takes.
    pub fn sources(&self) -> impl Iterator<Item = &String> {
        self.files.iter().filter(|name| is_source(name))
    }

    /// The folders with files that can be included, the shortest paths first. The first one is `sources` itself.
    pub fn include_folders(&self) -> Vec<String> {
        let included = self.files.iter().filter(|name| has_ending(name, &INCLUDED) || is_source(name));
        let folders: BTreeSet<_> =
            included.filter_map(|name| name.rsplit_once('/')).map(|(folder, _)| folder).collect();
        let mut folders: Vec<_> = folders.into_iter().map(|folder| format!("{SOURCES}/{folder}")).collect();
        folders.sort_by_key(|folder| folder.matches('/').count());
        folders.insert(0, SOURCES.to_owned());
        folders
    }

    /// Looks through all files for their `#include`.
    pub fn includes(&self) -> SourceIncludes {
        let mut found = SourceIncludes::default();
        for file in self.files.iter().filter(|name| is_source(name) || has_ending(name, &INCLUDED)) {
            let bytes = std::fs::read(self.root.join(SOURCES).join(file)).unwrap_or_default();
            let beside = file.rsplit_once('/').map_or("", |(folder, _)| folder);
            for name in String::from_utf8_lossy(&bytes).lines().filter_map(included_name) {
                let name = name.replace('\\', "/");
                let place = normalise(&format!("{beside}/{name}"));
                found.leaves_folder |= place.is_none();
                if is_source(&name) {
                    let target = place.filter(|place| self.files.contains(place));
                    let target = target.or_else(|| self.find_by_end(&name));
                    found.sources.extend(target.filter(|target| target != file));
                }
            }
        }
        found
    }

    /// The file that one of the include folders gives for a name.
    fn find_by_end(&self, name: &str) -> Option<String> {
        let name = normalise(name)?;
        let ends = |file: &&String| {
            file.strip_suffix(&name).is_some_and(|rest| rest.is_empty() || rest.ends_with('/'))
        };
        self.files.iter().find(ends).cloned()
    }

    /// Adds the names and contents of all files to a hash.
    pub fn hash_into(&self, hash: &mut Sha256) -> std::io::Result<()> {
        for file in &self.files {
            let bytes = std::fs::read(self.root.join(SOURCES).join(file))?;
            hash.update(file.as_bytes());
            hash.update([0]);
            hash.update((bytes.len() as u64).to_le_bytes());
            hash.update(&bytes);
        }
        Ok(())
    }
}

fn has_ending(name: &str, endings: &[&str]) -> bool {
    name.rsplit_once('.').is_some_and(|(_, ending)| endings.contains(&ending))
}

/// Whether a file is one in C or C++, by its name.
pub(super) fn is_source(name: &str) -> bool {
    has_ending(name, &C) || is_cpp(name)
}

/// Whether a file is one in C++, by its name.
pub(super) fn is_cpp(name: &str) -> bool {
    has_ending(name, &CPP)
}

/// The path without `.` and `..`; nothing for one that leads out of its folder.
pub(super) fn normalise(path: &str) -> Option<String> {
    let mut parts: Vec<&str> = Vec::new();
    for part in Path::new(path.trim_start_matches('/')).components() {
        match part {
            Component::Normal(part) => parts.push(part.to_str()?),
            Component::ParentDir => drop(parts.pop()?),
            Component::CurDir => {}
            Component::Prefix(_) | Component::RootDir => return None,
        }
    }
    Some(parts.join("/"))
}

/// What a line includes, if that is all it does.
fn included_name(line: &str) -> Option<&str> {
    let rest = line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("include")?.trim_start();
    let end = match rest.chars().next()? {
        '"' => '"',
        '<' => '>',
        _ => return None,
    };
    rest[1..].split_once(end).map(|(name, _)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_included_source_is_found_wherever_it_lies() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            let path = folder.path().join(SOURCES).join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, text).expect("a file");
        };
        write("all.c", "#include \"model.c\"\n  # include <deep/solver.c>\n#include \"all.c\"\n");
        write("model.c", "#include \"model.h\"\n");
        write("more/deep/solver.c", "#include \"../../model.h\"\n");
        write("model.h", "#include MACRO\n");
        let sources = SourceFolder::read(folder.path());
        let includes = sources.includes();
        assert_eq!(Vec::from_iter(&includes.sources), ["model.c", "more/deep/solver.c"]);
        assert!(!includes.leaves_folder);
        assert_eq!(sources.include_folders(), ["sources", "sources/more/deep"]);
        write("outside.c", "#include \"../resources/table.h\"\n");
        assert!(SourceFolder::read(folder.path()).includes().leaves_folder);
    }
}
