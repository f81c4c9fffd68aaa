//! Finds FMUs in a folder and the files that belong to each: reference results, inputs, options of the experiment.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use diagnostics::Error;

use crate::relative_path::real_path;

/// Files that are looked at, at most.
const MOST_FILES: usize = 500_000;
/// Endings of the names of reference results, behind the name of the FMU, as FMI's cross check, the Reference FMUs and tools of
/// Modelica write them.
const REFERENCES: [&str; 3] = ["_ref.csv", "_out.csv", ".csv"];
/// Endings of the names of inputs.
const INPUTS: [&str; 1] = ["_in.csv"];
/// Endings of the names of options: start, stop and step.
const OPTIONS: [&str; 2] = ["_ref.opt", ".opt"];

/// The FMUs and systems in a folder, in the order of their paths.
#[derive(Debug, Default)]
pub(super) struct FmuCollection {
    pub fmus: Vec<FmuFiles>,
    /// Archives and descriptions of SSP.
    pub systems: Vec<PathBuf>,
    /// Folders that cannot be read.
    pub problems: Vec<String>,
}

/// An FMU with its files.
#[derive(Debug)]
pub(super) struct FmuFiles {
    pub fmu: PathBuf,
    pub reference: Option<PathBuf>,
    pub input: Option<PathBuf>,
    pub options: Option<PathBuf>,
    /// Files elsewhere that may be its reference, where there are several.
    pub candidates: Vec<PathBuf>,
    /// Whether it is a part of a system of SSP, which says its connections.
    pub is_in_system: bool,
}

impl FmuCollection {
    /// Looks through a folder and all folders in it, but hidden ones, links and those of `excluded`.
    ///
    /// # Errors
    /// When the folder cannot be read, or has too many files.
    pub fn find(root: &Path, excluded: &[&Path]) -> Result<Self, Error> {
        let excluded: Vec<_> = excluded.iter().map(|path| real_path(path)).collect();
        let (mut files, mut problems, mut left) = (Vec::new(), Vec::new(), vec![root.to_owned()]);
        while let Some(folder) = left.pop() {
            let entries = match std::fs::read_dir(&folder) {
                Ok(entries) => entries,
                Err(error) if folder == root => {
                    let message = format!("expected a folder of FMUs, found {}: {error}", root.display());
                    return Err(Error::invalid_input(message));
                }
                Err(error) => {
                    problems.push(format!("{} was not looked through: {error}", folder.display()));
                    continue;
                }
            };
            for entry in entries.flatten() {
                let path = entry.path();
                let is_hidden = entry.file_name().to_string_lossy().starts_with('.');
                let Some(kind) = entry.file_type().ok().filter(|_| !is_hidden) else { continue };
                if !kind.is_dir() {
                    files.push(path);
                } else if !excluded.contains(&real_path(&path)) {
                    left.push(path);
                }
            }
            if files.len() > MOST_FILES {
                let message = format!("expected at most {MOST_FILES} files in {}", root.display());
                return Err(Error::invalid_input(message).with_help("name a folder inside of it"));
            }
        }
        files.sort();
        problems.sort();
        let index = FileIndex::new(&files);
        let fmus = files.iter().filter(|path| has_extension(path, "fmu"));
        let systems = files.iter().filter(|path| {
            has_extension(path, "ssp") || path.file_name().is_some_and(|it| it == "SystemStructure.ssd")
        });
        let systems: Vec<_> = systems.cloned().collect();
        let fmus = fmus.map(|fmu| index.files_of_fmu(fmu, &systems)).collect();
        Ok(FmuCollection { fmus, systems, problems })
    }
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|it| it.eq_ignore_ascii_case(extension))
}

/// Files by folder and by name in small letters.
struct FileIndex<'f> {
    by_folder: HashMap<&'f Path, Vec<(String, &'f Path)>>,
    by_name: HashMap<String, Vec<&'f Path>>,
}

impl<'f> FileIndex<'f> {
    fn new(files: &'f [PathBuf]) -> Self {
        let mut index = FileIndex { by_folder: HashMap::new(), by_name: HashMap::new() };
        for file in files {
            let name = file.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
            let folder = file.parent().unwrap_or(Path::new(""));
            index.by_name.entry(name.clone()).or_default().push(file);
            index.by_folder.entry(folder).or_default().push((name, file));
        }
        index
    }

    fn files_of_fmu(&self, fmu: &Path, systems: &[PathBuf]) -> FmuFiles {
        let stem = fmu.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
        let folder = fmu.parent().unwrap_or(Path::new(""));
        let beside = self.find_in_folder(folder, &stem, &REFERENCES);
        // An FMU may have its results in a folder of results. Those beside another FMU of its name are that one's.
        let is_of_another = |file: &&Path| {
            let of_folder = self.by_folder.get(file.parent().unwrap_or(Path::new("")));
            of_folder.into_iter().flatten().any(|(name, _)| *name == format!("{stem}.fmu"))
        };
        let elsewhere = || {
            let named = REFERENCES.iter().map(|ending| format!("{stem}{ending}"));
            let named = named.filter_map(|name| self.by_name.get(&name));
            let mut free = named.map(|files| files.iter().copied().filter(|it| !is_of_another(it)).collect());
            free.find(|files: &Vec<&Path>| !files.is_empty()).unwrap_or_default()
        };
        let (reference, candidates) = match (beside, elsewhere()) {
            (Some(file), _) => (Some(file), Vec::new()),
            (None, files) => match files.as_slice() {
                [only] => (Some(*only), Vec::new()),
                _ => (None, files),
            },
        };
        let folders = [Some(folder), reference.and_then(Path::parent)];
        let find = |endings: &[&str]| {
            let mut found = folders.iter().flatten().map(|it| self.find_in_folder(it, &stem, endings));
            found.find_map(|it| it).map(Path::to_owned)
        };
        let is_in_system = systems.iter().any(|system| {
            !has_extension(system, "ssp") && system.parent().is_some_and(|it| fmu.starts_with(it))
        });
        FmuFiles {
            fmu: fmu.to_owned(),
            input: find(&INPUTS),
            options: find(&OPTIONS),
            reference: reference.map(Path::to_owned),
            candidates: candidates.into_iter().map(Path::to_owned).collect(),
            is_in_system,
        }
    }

    /// The file of a folder that has the name of the FMU and one of the endings; in the folder of a single FMU, the only one with such an
    /// ending.
    fn find_in_folder(&self, folder: &Path, stem: &str, endings: &[&str]) -> Option<&'f Path> {
        let files = self.by_folder.get(folder)?;
        let named = endings.iter().find_map(|ending| {
            let wanted = format!("{stem}{ending}");
            files.iter().find(|(name, _)| *name == wanted)
        });
        let is_alone = files.iter().filter(|(name, _)| name.ends_with(".fmu")).count() == 1;
        let only = || {
            // A plain `.csv` may be anything.
            let marked = endings.iter().filter(|ending| ending.starts_with('_'));
            let mut found =
                marked.flat_map(|ending| files.iter().filter(move |(name, _)| name.ends_with(ending)));
            found.next().filter(|_| found.next().is_none())
        };
        named.or_else(|| is_alone.then(only).flatten()).map(|(_, file)| *file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_fmu_gets_the_files_that_belong_to_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let files = [
            "beside/Ball.fmu",
            "beside/Ball_ref.csv",
            "beside/Ball_in.csv",
            "beside/Ball_ref.opt",
            "beside/Ball.csv",
            "beside/Other.fmu",
            "2.0/Stair.fmu",
            "results/Stair_out.csv",
            "results/Stair_in.csv",
            "case/Fork Lift.fmu",
            "case/lift_ref.csv",
            "alone/Ball.fmu",
            "many/Twice.fmu",
            "a/Twice_ref.csv",
            "b/Twice_ref.csv",
            "ssp/SystemStructure.ssd",
            "ssp/resources/Part.fmu",
            ".git/Hidden.fmu",
            "suite/Again.fmu",
        ];
        for name in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, "").expect("a file");
        }
        let found =
            FmuCollection::find(folder.path(), &[&folder.path().join("suite")]).expect("a collection");
        let short = |path: &Path| path.strip_prefix(folder.path()).expect("inside").display().to_string();
        let of = |name: &str| found.fmus.iter().find(|it| short(&it.fmu) == name).expect("an FMU");
        let files = |name: &str| {
            let FmuFiles { reference, input, options, .. } = of(name);
            [reference, input, options].map(|it| it.as_deref().map(short).unwrap_or_default())
        };
        assert_eq!(found.fmus.len(), 7);
        assert_eq!(
            files("beside/Ball.fmu"),
            ["beside/Ball_ref.csv", "beside/Ball_in.csv", "beside/Ball_ref.opt"]
        );
        assert_eq!(files("beside/Other.fmu"), ["", "", ""]);
        assert_eq!(files("alone/Ball.fmu"), ["", "", ""]);
        assert_eq!(files("2.0/Stair.fmu"), ["results/Stair_out.csv", "results/Stair_in.csv", ""]);
        assert_eq!(files("case/Fork Lift.fmu"), ["case/lift_ref.csv", "", ""]);
        assert_eq!(
            (files("many/Twice.fmu"), of("many/Twice.fmu").candidates.len()),
            (["", "", ""].map(str::to_owned), 2)
        );
        assert!(of("ssp/resources/Part.fmu").is_in_system && !of("beside/Ball.fmu").is_in_system);
        assert_eq!(found.systems.iter().map(|it| short(it)).collect::<Vec<_>>(), ["ssp/SystemStructure.ssd"]);
    }
}
