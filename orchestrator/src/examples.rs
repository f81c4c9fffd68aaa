//! The scenarios that came with the program: finds their folder, lists them, and copies one with all files that it needs.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use diagnostics::{Error, suggest};
use scenario::{Scenario, bundle};

use crate::nearest_path::nearest_path;

/// The folder of the scenarios, in the folder of a repository and beside an installed program.
const FOLDER: &str = "scenarios";

/// A file of a repository that tells it from others.
const LANDMARK: &str = "orchestrator/Cargo.toml";

/// The line of a scenario that names its schema for editors, which stays in the repository.
const SCHEMA_LINE: &str = "#:schema ";

/// The scenarios of a folder.
pub struct ExampleFolder(PathBuf);

/// A scenario that can be copied.
pub struct Example {
    /// Its path in the folder without its ending: `manoeuvres/tip_in`.
    pub name: String,
    /// One line about it.
    pub title: String,
    /// The paths in the folder of all that it needs, its own first.
    files: Vec<PathBuf>,
}

impl ExampleFolder {
    /// That of this program: installed beside it, or of the repository that it was built in or that is around the current folder.
    ///
    /// # Errors
    /// When there is none.
    pub fn of_current_program() -> Result<Self, Error> {
        let program = std::env::current_exe().and_then(std::fs::canonicalize).unwrap_or_default();
        let installed = crate::package::shared_folder().join(FOLDER);
        let current = std::env::current_dir().unwrap_or_default();
        let repositories = program.ancestors().chain(current.ancestors());
        let mut repositories = repositories.filter(|folder| folder.join(LANDMARK).is_file());
        let found = Some(installed.clone()).filter(|folder| folder.is_dir());
        found.or_else(|| Some(repositories.next()?.join(FOLDER))).map(ExampleFolder).ok_or_else(|| {
            let message =
                format!("no scenarios came with this program: expected them in {}", installed.display());
            Error::invalid_input(message).with_help("call it in a clone of Trackside, or install the wheel")
        })
    }

    /// The scenarios in this folder.
    #[must_use]
    pub fn new(folder: PathBuf) -> Self {
        ExampleFolder(folder)
    }

    /// The scenarios all of whose files are there, by name; those that need logs of others are not.
    ///
    /// # Errors
    /// When the folder or one of them cannot be read.
    pub fn list_examples(&self) -> Result<BTreeMap<String, Example>, Error> {
        let mut examples = BTreeMap::new();
        for path in toml_files(&self.0)
            .map_err(|error| Error::invalid_input(format!("{}: {error}", self.0.display())))?
        {
            // Files of parameters are no scenarios.
            let Ok(scenario) = Scenario::read(&path) else { continue };
            let runs = scenario.document.time.is_some() || !scenario.document.analysis.is_empty();
            let Some(own) = self.path_inside(&path).filter(|_| runs) else { continue };
            let files = bundle::input_files(&scenario)?;
            let inside: Option<Vec<_>> = files.iter().map(|file| self.path_inside(file)).collect();
            let Some(others) = inside.filter(|all| all.iter().all(|file| self.0.join(file).is_file())) else {
                continue;
            };
            let name = own.with_extension("").to_string_lossy().into_owned();
            let title = scenario.document.title.clone().unwrap_or_default();
            let others = others.into_iter().filter(|file| *file != own);
            let files = std::iter::once(own.clone()).chain(others).collect();
            examples.insert(name.clone(), Example { name, title, files });
        }
        Ok(examples)
    }

    /// The scenario of this name, or of the last part of its name.
    ///
    /// # Errors
    /// When there is none, or the folder cannot be read.
    pub fn find_example(&self, name: &str) -> Result<Example, Error> {
        let mut examples = self.list_examples()?;
        let wanted = name.trim_end_matches(".toml").trim_start_matches("scenarios/");
        let ending = format!("/{wanted}");
        let full = match examples.contains_key(wanted) {
            true => Some(wanted.to_owned()),
            false => examples.keys().find(|name| name.ends_with(&ending)).cloned(),
        };
        let example = full.and_then(|name| examples.remove(&name));
        example.ok_or_else(|| {
            let known =
                examples.keys().flat_map(|name| [name.as_str(), name.rsplit('/').next().unwrap_or(name)]);
            suggest::unknown_name("example", wanted, known).into_error()
        })
    }

    /// Copies the files of a scenario into a folder, as they lie to each other; returns their paths, that of the scenario first.
    ///
    /// # Errors
    /// When one of them is there already with other contents, before any is copied; when one cannot be read or written.
    pub fn copy_example(&self, example: &Example, into: &Path) -> Result<Vec<PathBuf>, Error> {
        let contents = example.files.iter().map(|file| {
            let from = self.0.join(file);
            let bytes = std::fs::read(&from)
                .map_err(|error| Error::invalid_input(format!("{}: {error}", from.display())))?;
            Ok((into.join(file), without_schema_line(bytes)))
        });
        let contents = contents.collect::<Result<Vec<_>, Error>>()?;
        let differs = |(path, bytes): &&(PathBuf, Vec<u8>)| {
            std::fs::read(path).map_or(path.exists(), |there| there != *bytes)
        };
        if let Some((path, _)) = contents.iter().find(differs) {
            let message =
                format!("{} is there already, with other contents: nothing was copied", path.display());
            return Err(Error::invalid_input(message)
                .with_help("remove it, or copy into another folder: --out FOLDER"));
        }
        for (path, bytes) in &contents {
            let parent = path.parent().unwrap_or(into);
            let written = std::fs::create_dir_all(parent).and_then(|()| std::fs::write(path, bytes));
            written.map_err(|error| Error::output_failure(path, error))?;
        }
        Ok(contents.into_iter().map(|(path, _)| path).collect())
    }

    /// The path of a file in the folder, if it is there; `a/../b` is `b`.
    fn path_inside(&self, path: &Path) -> Option<PathBuf> {
        let mut plain = PathBuf::new();
        for part in path.components() {
            match part {
                Component::ParentDir => drop(plain.pop()),
                Component::CurDir => {}
                part => plain.push(part),
            }
        }
        plain.strip_prefix(&self.0).ok().map(Path::to_owned)
    }
}

/// What a scenario file that is not there may have been meant to be: a file of almost this name beside it, or an example.
#[must_use]
pub fn missing_scenario_help(path: &Path) -> Option<String> {
    let runs = |path: &Path| {
        path.extension().is_some_and(|it| ["toml", "fmu", "ssp", "ssd"].iter().any(|ending| it == *ending))
    };
    if let Some(nearest) = nearest_path(path, &[], runs) {
        return Some(format!("did you mean `{}`?", nearest.display()));
    }
    let wanted = path.file_name()?.to_str()?.trim_end_matches(".toml");
    let examples = ExampleFolder::of_current_program().ok()?.list_examples().ok()?;
    let last_parts = examples.keys().filter_map(|name| name.rsplit('/').next());
    Some(match suggest::closest_name(wanted, last_parts) {
        Some(close) => format!("`trackside examples {close}` copies an example into the current folder"),
        None => "`trackside examples` lists the scenarios that came with the program".to_owned(),
    })
}

/// The files `*.toml` in a folder and below, in order.
fn toml_files(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut entries: Vec<_> = std::fs::read_dir(folder)?.collect::<Result<_, _>>()?;
    entries.sort_by_key(std::fs::DirEntry::path);
    let mut found = Vec::new();
    for path in entries.iter().map(std::fs::DirEntry::path) {
        if path.is_dir() {
            found.extend(toml_files(&path)?);
        } else if path.extension().is_some_and(|ending| ending == "toml") {
            found.push(path);
        }
    }
    Ok(found)
}

fn without_schema_line(bytes: Vec<u8>) -> Vec<u8> {
    let is_schema = bytes.starts_with(SCHEMA_LINE.as_bytes());
    let end = bytes.iter().position(|byte| *byte == b'\n').filter(|_| is_schema);
    end.map_or_else(|| bytes.clone(), |end| bytes[end + 1..].to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn examples() -> ExampleFolder {
        ExampleFolder::new(
            std::fs::canonicalize(concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios")).expect("a folder"),
        )
    }

    #[test]
    fn each_example_has_a_line_and_all_of_its_files() {
        let all = examples().list_examples().expect("a list");
        for name in ["limit_handling", "lap_road_course", "manoeuvres/tip_in", "tires_from_bench"] {
            assert!(
                all.get(name).is_some_and(|example| !example.title.is_empty()),
                "{name}: {:?}",
                all.keys()
            );
        }
        // Its log does not come with the program; a file of parameters is no scenario.
        assert!(!all.contains_key("replay_250lm") && !all.contains_key("cars/sport/car"));
        let example = examples().find_example("tip_in").expect("the end of its name");
        let needed = [
            "manoeuvres/tip_in.toml",
            "cars/sport/car.toml",
            "cars/sport/front.tir",
            "dual_track_limit.toml",
        ];
        assert!(
            needed.iter().all(|file| example.files.contains(&PathBuf::from(file))),
            "{:?}",
            example.files
        );
    }

    #[test]
    fn an_example_is_copied_once_and_never_over_something_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let example = examples().find_example("lap_road_course.toml").expect("an example");
        let copied = examples().copy_example(&example, folder.path()).expect("a copy");
        assert_eq!(copied[0], folder.path().join("lap_road_course.toml"));
        Scenario::read(&copied[0]).unwrap_or_else(|error| panic!("{error}"));
        assert!(folder.path().join("tracks/road_course.csv").is_file());
        // The same files again are no harm; a changed one is not lost.
        examples().copy_example(&example, folder.path()).expect("the same");
        std::fs::write(folder.path().join("dual_track_limit.toml"), "mine").expect("a file");
        let error = examples().copy_example(&example, folder.path()).expect_err("mine is there").to_string();
        assert!(error.contains("dual_track_limit.toml is there already"), "{error}");
        let unknown = examples().find_example("limit_handlin").map(drop).expect_err("no example");
        assert!(format!("{unknown:?}").contains("limit_handling"), "{unknown:?}");
    }
}
