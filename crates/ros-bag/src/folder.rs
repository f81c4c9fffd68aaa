//! Finds the files of a bag: a folder with `metadata.yaml`, in which rosbag2 lists them.

use std::path::{Path, PathBuf};

use crate::Error;

/// The list of a bag.
const LIST: &str = "metadata.yaml";
/// A list that is longer than this is none [B].
const LONGEST: u64 = 64 << 20;

/// The files of a bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagFiles {
    /// Those that are there, in their order.
    pub files: Vec<PathBuf>,
    /// What is not as the list says.
    pub warnings: Vec<String>,
}

/// The folder of a bag that a path means: itself, or that of its list.
#[must_use]
pub fn bag_folder(path: &Path) -> Option<&Path> {
    if path.is_dir() {
        return Some(path);
    }
    let is_list = path.file_name().is_some_and(|name| name == LIST);
    is_list.then(|| path.parent()).flatten()
}

/// The files of the bag in a folder.
///
/// # Errors
/// When there is no file of a bag in it.
pub fn find_bag_files(folder: &Path) -> Result<BagFiles, Error> {
    let (mut files, mut warnings) = (Vec::new(), Vec::new());
    let list = folder.join(LIST);
    match list.is_file() {
        true => {
            let about = std::fs::metadata(&list)?;
            if about.len() > LONGEST {
                return Err(Error::new(format!("{LIST} has more than {LONGEST} bytes")));
            }
            let text = String::from_utf8_lossy(&std::fs::read(&list)?).into_owned();
            for name in parse_listed_file_names(&text) {
                // Before version 4 of the list, paths were not relative to it.
                let file = Path::new(&name).file_name().map(|name| folder.join(name));
                match file {
                    Some(file) if file.is_file() => files.push(file),
                    _ => warnings.push(format!("{name}, which {LIST} lists, is missing")),
                }
            }
        }
        false => {
            files = by_number(folder)?;
            warnings.push(format!("there is no {LIST}: all files of bags in the folder are read"));
        }
    }
    match (files.is_empty(), warnings.first()) {
        (false, _) => Ok(BagFiles { files, warnings }),
        (true, Some(first)) if list.is_file() => {
            Err(Error::new(format!("expected the files of a bag, but {first}")))
        }
        (true, _) => Err(Error::new(format!(
            "expected the folder of a bag with {LIST}, or a file, found a folder without files of bags (.mcap, .db3)"
        ))),
    }
}

/// The names in the list `relative_file_paths`, which is one of lines with `- `, or one in brackets.
fn parse_listed_file_names(text: &str) -> Vec<String> {
    let plain = |name: &str| name.trim().trim_matches(['"', '\'']).to_owned();
    let mut lines = text.lines();
    let Some(rest) = lines.find_map(|line| line.trim_start().strip_prefix("relative_file_paths:")) else {
        return Vec::new();
    };
    if let Some(inner) = rest.trim().strip_prefix('[') {
        let whole: String = std::iter::once(inner).chain(lines).collect::<Vec<_>>().join(" ");
        let inner = whole.split(']').next().unwrap_or_default();
        return inner.split(',').map(plain).filter(|name| !name.is_empty()).collect();
    }
    let entry = |line: &str| line.trim_start().strip_prefix("- ").map(plain);
    lines.map_while(entry).collect()
}

/// Files of bags, in the order of the numbers at the end of their names: `drive_2.db3` before `drive_10.db3`.
fn by_number(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        let name = name.unwrap_or_default();
        let plain = name.strip_suffix(".zstd").unwrap_or(&name);
        let stem = plain.strip_suffix(".mcap").or_else(|| plain.strip_suffix(".db3"));
        if let Some(stem) = stem.filter(|_| path.is_file()) {
            let number = stem.rsplit('_').next().and_then(|it| it.parse::<u64>().ok());
            files.push((number, name.clone(), path));
        }
    }
    files.sort();
    Ok(files.into_iter().map(|(_, _, path)| path).collect())
}

#[cfg(test)]
mod tests {
    use super::{bag_folder, find_bag_files, parse_listed_file_names};

    #[test]
    fn lists_are_read_in_both_forms() {
        let block = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - a_0.db3\n    - \"a_1.db3\"\n  duration:\n    - no\n";
        assert_eq!(parse_listed_file_names(block), ["a_0.db3", "a_1.db3"]);
        let flow =
            "rosbag2_bagfile_information: \n  relative_file_paths: [a_0.mcap,\n    'a_1.mcap']\n  x: [b]\n";
        assert_eq!(parse_listed_file_names(flow), ["a_0.mcap", "a_1.mcap"]);
        assert!(parse_listed_file_names("x: 1\n").is_empty());
    }

    #[test]
    fn a_file_that_is_missing_is_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path();
        let nothing = find_bag_files(path).expect_err("it is empty").to_string();
        assert!(nothing.contains("expected the folder of a bag with metadata.yaml"), "{nothing}");
        for name in ["d_10.db3", "d_2.db3", "d_1.db3.zstd", "other.txt"] {
            std::fs::write(path.join(name), "x").expect("it is written");
        }
        let names = |files: &[std::path::PathBuf]| -> Vec<String> {
            files.iter().map(|it| it.file_name().expect("a name").to_string_lossy().into()).collect()
        };
        let found = find_bag_files(path).expect("there are files");
        assert_eq!(names(&found.files), ["d_1.db3.zstd", "d_2.db3", "d_10.db3"]);
        assert!(found.warnings[0].contains("no metadata.yaml"), "{:?}", found.warnings);
        let list = path.join("metadata.yaml");
        std::fs::write(&list, "relative_file_paths:\n  - bag/d_2.db3\n  - d_3.db3\n").expect("written");
        assert_eq!(bag_folder(&list), Some(path));
        let found = find_bag_files(path).expect("one is there");
        assert_eq!(names(&found.files), ["d_2.db3"]);
        assert!(found.warnings[0].contains("d_3.db3, which metadata.yaml lists, is missing"));
    }
}
