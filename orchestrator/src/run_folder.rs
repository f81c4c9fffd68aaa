//! The folder of a run: locked for one run at a time; earlier results stay until new ones are recorded, and files of others stay.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use diagnostics::{Error, ErrorCollector, Spanned, utf8_path};
use scenario::Scenario;
use scenario::plan::REPORT;

use crate::report::{OWN_FILES, PARTIAL, PreviousRun};
use crate::sinks::SINKS;

/// Keeps the files of the earlier run until those of the new one are open. A killed run may leave it; the next one removes it.
const ASIDE: &str = "run.previous";
/// A folder with one of these is the root of something else.
const ROOTS: [&str; 2] = ["Cargo.toml", ".git"];

/// Finds out before anything is built whether a run can write into a folder.
///
/// # Errors
/// When it is no folder, or one of something else, or the scenario reads a file in it.
pub(crate) fn check_run_folder(folder: &Path, scenario: &Scenario) -> Result<(), Error> {
    let mut mistakes = ErrorCollector::default();
    mistakes.ok_or_record(utf8_path(folder));
    let absolute = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let existing = absolute.ancestors().find(|path| path.exists());
    if let Some(file) = existing.filter(|path| !path.is_dir()) {
        mistakes.push(unusable_folder_error(folder, &format!("{} is a file", file.display())));
    }
    let real = fs::canonicalize(&absolute).unwrap_or(absolute);
    if real.parent().is_none() {
        mistakes.push(unusable_folder_error(folder, "it is the root of all files"));
    }
    if let Some(root) = ROOTS.iter().find(|root| real.join(root).exists()) {
        mistakes.push(unusable_folder_error(folder, &format!("it holds {root}")));
    }
    mistakes.ok_or_record(refuse_files_of_others(folder));
    mistakes.ok_or_record(refuse_overwriting_inputs(&real, scenario));
    mistakes.ok_or_record(check_validation_folders(folder, scenario));
    mistakes.into_result()
}

/// Refuses validations whose folder is a file, a link to another place, or one with files of others.
fn check_validation_folders(folder: &Path, scenario: &Scenario) -> Result<(), Error> {
    let names = scenario.document.validation.iter().map(|validation| &validation.name);
    ErrorCollector::collect_all(names.zip(&scenario.validations).map(|(name, child)| {
        let path = folder.join(name.get_ref());
        if let Some(kind) = fs::symlink_metadata(&path).ok().filter(|it| !it.is_dir()) {
            let kind = if kind.is_symlink() { "a link" } else { "a file" };
            let message = format!("the validation writes into {}, which is {kind}", path.display());
            return Err(scenario.error_at(name, message));
        }
        refuse_files_of_others(&path).and_then(|()| check_validation_folders(&path, child))
    }))
    .map(drop)
}

/// Refuses files that have the names of a run's, but that no report of a run accounts for.
fn refuse_files_of_others(folder: &Path) -> Result<(), Error> {
    let aside = folder.join(ASIDE);
    let kind = |path: &Path| fs::symlink_metadata(path).ok();
    let ours =
        PreviousRun::read_from_folder(folder).is_some() || PreviousRun::read_from_folder(&aside).is_some();
    if kind(&folder.join(REPORT)).is_some() && PreviousRun::read_from_folder(folder).is_none() {
        return Err(unusable_folder_error(folder, "its report.json is not that of a run"));
    }
    if kind(&aside).is_some_and(|it| !it.is_dir() || !(ours || is_empty(&aside))) {
        return Err(unusable_folder_error(folder, &format!("it holds {ASIDE}, which no run left")));
    }
    // A full disk leaves an empty note of a run.
    let is_marked_begun = |name: &str| {
        name == PARTIAL && kind(&folder.join(name)).is_some_and(|it| it.is_file() && it.len() == 0)
    };
    let mut names = run_file_names().filter(|name| !ours && !is_marked_begun(name));
    match names.find(|name| kind(&folder.join(name)).is_some()) {
        Some(name) => {
            let why = format!("it holds {name}, and no report says that a run wrote it");
            Err(unusable_folder_error(folder, &why))
        }
        None => Ok(()),
    }
}

fn is_empty(folder: &Path) -> bool {
    fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none())
}

/// The names of the files that each run may leave.
fn run_file_names() -> impl Iterator<Item = &'static str> {
    OWN_FILES.into_iter().chain(SINKS.iter().flat_map(|kind| kind.files.iter().copied()))
}

fn unusable_folder_error(folder: &Path, why: &str) -> Error {
    let message = format!("the results cannot go to {}: {why}", folder.display());
    Error::invalid_input(message).with_help("name a folder of their own: --out target/runs/NAME")
}

/// Refuses files of the scenario that the run would replace.
fn refuse_overwriting_inputs(folder: &Path, scenario: &Scenario) -> Result<(), Error> {
    let inside = |word: &&Spanned<String>| {
        let path = scenario.source.resolve_path(word);
        // Also a link in the folder, wherever it leads, and a file there that a link elsewhere leads to.
        let place = path.parent().map(|it| if it.as_os_str().is_empty() { Path::new(".") } else { it });
        [Some(path.as_path()), place]
            .into_iter()
            .flatten()
            .any(|path| fs::canonicalize(path).is_ok_and(|path| path.starts_with(folder)))
    };
    let errors = scenario.read_files().filter(inside).map(|word| {
        let message = format!("`{}` is in the folder that the results go to", word.get_ref());
        scenario
            .error_at(word, message)
            .with_help("copy it to another place, or name another folder: --out FOLDER")
    });
    let own = errors.collect::<ErrorCollector>().into_result();
    let validations = scenario.validations.iter().map(|child| refuse_overwriting_inputs(folder, child));
    ErrorCollector::collect_both(own, ErrorCollector::collect_all(validations)).map(drop)
}

/// A folder that this run alone writes to, until it is dropped.
pub(crate) struct RunFolder {
    path: PathBuf,
    /// The system takes the lock back when the process ends, however it ends.
    _lock: File,
}

/// Time for which a lock is tried again.
const PATIENCE: Duration = Duration::from_secs(1);

/// Locks a folder. A process that starts another one shares its locks with it for a moment, so a lock may outlive its run.
fn lock_with_retries(folder: &File) -> Result<(), TryLockError> {
    let begin = Instant::now();
    loop {
        match folder.try_lock() {
            Err(TryLockError::WouldBlock) if begin.elapsed() < PATIENCE => {
                std::thread::sleep(PATIENCE / 50);
            }
            outcome => return outcome,
        }
    }
}

impl RunFolder {
    /// Makes the folder and locks it.
    ///
    /// # Errors
    /// When it cannot be made, or another run writes into it.
    pub fn create_and_lock(path: &Path) -> Result<Self, Error> {
        let output = |error| Error::output_failure(path, error);
        fs::create_dir_all(path).map_err(output)?;
        let lock = File::open(path).map_err(output)?;
        match lock_with_retries(&lock) {
            Err(TryLockError::WouldBlock) => {
                let message = format!("another run is writing into {}", path.display());
                Err(Error::invalid_input(message)
                    .with_help("wait for its end, or name another folder: --out FOLDER"))
            }
            // Some file systems have no locks.
            Ok(()) | Err(TryLockError::Error(_)) => Ok(RunFolder { path: path.to_owned(), _lock: lock }),
        }
    }

    /// Opens the new recordings, and removes the files of the earlier run if that succeeds.
    ///
    /// # Errors
    /// When they cannot be opened, or would take the place of files of others; then all files are as they were.
    pub fn replace_recordings<T>(&self, open: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
        let (path, aside) = (&self.path, self.path.join(ASIDE));
        refuse_files_of_others(path)?;
        let opened = move_files(path, &aside).and_then(|()| {
            open().inspect_err(|_| drop(remove_run_files(path, &aside))) // What was opened by now is empty.
        });
        match opened {
            Ok(opened) => remove_run_files(&aside, path).map(|()| opened),
            Err(error) => {
                move_files(&aside, path)?;
                let _ = remove_run_files(&aside, path);
                let _ = fs::remove_dir(path);
                Err(error)
            }
        }
    }
}

/// What a run left in a folder, by paths within it.
#[derive(Default)]
struct RunFiles {
    files: Vec<PathBuf>,
    /// The folders of validations, an inner one before an outer one.
    folders: Vec<PathBuf>,
}

impl RunFiles {
    /// Looks through a folder by the reports in it, or by those in the other one: a killed run may have moved some files only.
    fn find_by_reports(folder: &Path, other: &Path) -> Self {
        let mut left = RunFiles::default();
        left.add_folder_contents([folder, other], Path::new(""));
        left
    }

    /// Adds what is in a folder within the folder. Neither a folder nor what a link points to is a file of a run.
    fn add_folder_contents(&mut self, [folder, other]: [&Path; 2], within: &Path) {
        let kind = |path: &Path| fs::symlink_metadata(folder.join(path)).map(|it| it.is_dir());
        let read = |folder: &Path| PreviousRun::read_from_folder(&folder.join(within));
        let Some(report) = read(folder).or_else(|| read(other)) else { return };
        let known = run_file_names().map(str::to_owned);
        let mut files: Vec<_> = known.chain(report.files).map(|name| within.join(name)).collect();
        files.retain(|path| kind(path).is_ok_and(|is_folder| !is_folder));
        files.sort();
        files.dedup();
        self.files.extend(files);
        for validation in report.validations {
            let inner = within.join(validation.name);
            if kind(&inner).is_ok_and(|is_folder| is_folder) {
                self.add_folder_contents([folder, other], &inner);
                self.folders.push(inner);
            }
        }
    }
}

/// Moves what a run left from one folder to another; only files of others stay.
fn move_files(from: &Path, to: &Path) -> Result<(), Error> {
    let RunFiles { files, folders } = RunFiles::find_by_reports(from, to);
    for file in files {
        let (source, target) = (from.join(&file), to.join(&file));
        let folder = target.parent().unwrap_or(to);
        fs::create_dir_all(folder).map_err(|error| Error::output_failure(folder, error))?;
        fs::rename(&source, &target).map_err(|error| Error::output_failure(&source, error))?;
    }
    folders.iter().for_each(|name| drop(fs::remove_dir(from.join(name))));
    Ok(())
}

/// Removes what a run left, by the reports there or in the other folder, and the folder if nothing else is in it.
fn remove_run_files(folder: &Path, other: &Path) -> Result<(), Error> {
    let RunFiles { files, folders } = RunFiles::find_by_reports(folder, other);
    for file in files {
        let path = folder.join(file);
        fs::remove_file(&path).map_err(|error| Error::output_failure(&path, error))?;
    }
    folders.iter().for_each(|name| drop(fs::remove_dir(folder.join(name))));
    let _ = fs::remove_dir(folder);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder with a run, a validation of it, and files of somebody else.
    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        let report = r#"{"scenario": "s", "verdict": "pass", "versions": {"trackside": "0"}, "files": ["found.toml", "../other"], "validations": [{"name": "v"}]}"#;
        let child = r#"{"scenario": "c", "verdict": "pass", "versions": {"trackside": "0"}}"#;
        fs::create_dir(folder.path().join("v")).expect("a folder");
        for (name, text) in [
            ("report.json", report),
            ("found.toml", "old"),
            ("run.mcap", "old"),
            ("notes.txt", "mine"),
            ("v/report.json", child),
            ("v/run.mcap", "old"),
            ("v/notes.txt", "mine"),
        ] {
            fs::write(folder.path().join(name), text).expect("a file");
        }
        folder
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder").flatten();
        let mut names: Vec<_> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn an_earlier_run_goes_when_the_new_one_is_open_and_returns_when_it_is_not() {
        let folder = folder();
        let path = folder.path();
        let before = names(path);
        let claimed = RunFolder::create_and_lock(path).expect("a folder");
        let failed = claimed.replace_recordings(|| {
            assert_eq!(names(path), ["notes.txt", "run.previous", "v"]);
            fs::write(path.join("run.mcap"), "new").expect("a file");
            Err::<(), _>(Error::invalid_input("the disk is full"))
        });
        assert_eq!(failed.expect_err("it failed").to_string(), "the disk is full");
        assert_eq!(names(path), before);
        assert_eq!(fs::read_to_string(path.join("v/run.mcap")).expect("a file"), "old");
        assert_eq!(fs::read_to_string(path.join("run.mcap")).expect("a file"), "old");
        claimed.replace_recordings(|| Ok(())).expect("a new run");
        assert_eq!(names(path), ["notes.txt", "v"]);
        assert_eq!(names(&path.join("v")), ["notes.txt"]);
    }

    #[test]
    fn the_second_run_into_a_folder_is_told() {
        let folder = folder();
        let first = RunFolder::create_and_lock(folder.path()).expect("a folder");
        let error = RunFolder::create_and_lock(folder.path()).err().expect("it is taken");
        assert!(error.to_string().contains("another run is writing into"), "{error}");
        drop(first);
        assert!(RunFolder::create_and_lock(folder.path()).is_ok());
    }

    #[test]
    fn what_a_killed_run_left_goes_with_the_next_one() {
        let folder = folder();
        let path = folder.path();
        move_files(path, &path.join(ASIDE)).expect("moved");
        fs::write(path.join("run.csv.partial"), "new").expect("a file");
        RunFolder::create_and_lock(path).and_then(|it| it.replace_recordings(|| Ok(()))).expect("a new run");
        assert_eq!(names(path), ["notes.txt", "v"]);
        let sketch = r#"{"scenario": "s", "verdict": "error", "versions": {"trackside": "0"}, "files": ["found.toml"], "validations": [{"name": "v"}]}"#;
        fs::write(path.join("report.json.partial"), sketch).expect("a file");
        fs::write(path.join("found.toml"), "half").expect("a file");
        fs::write(path.join("v/run.mcap"), "half").expect("a file");
        fs::write(path.join("v/report.json.partial"), sketch).expect("a file");
        RunFolder::create_and_lock(path).and_then(|it| it.replace_recordings(|| Ok(()))).expect("a new run");
        assert_eq!(
            (names(path), names(&path.join("v"))),
            (vec!["notes.txt".into(), "v".into()], vec!["notes.txt".into()])
        );
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_not_followed() {
        let (folder, other) = (folder(), folder());
        let path = folder.path();
        fs::remove_file(path.join("run.mcap")).expect("a file");
        std::os::unix::fs::symlink(other.path().join("run.mcap"), path.join("run.mcap")).expect("a link");
        fs::remove_dir_all(path.join("v")).expect("a folder");
        std::os::unix::fs::symlink(other.path().join("v"), path.join("v")).expect("a link");
        let before = names(other.path());
        RunFolder::create_and_lock(path).and_then(|it| it.replace_recordings(|| Ok(()))).expect("a new run");
        assert_eq!(names(path), ["notes.txt", "v"]);
        assert_eq!((names(other.path()), names(&other.path().join("v")).len()), (before, 3));
    }
}
