//! Finds a Rerun viewer that opens our recordings: on the search path, in the active virtual environment, beside this program.
//!
//! Not in an environment of the current folder: that may be somebody else's, and looking at a run starts nothing of it.

use std::ffi::OsString;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use diagnostics::Error;

use super::VERSION;

/// The versions 0.x whose viewers open our recordings, as measured: docs/replay.md.
const OPENING_VERSIONS: RangeInclusive<u32> = 32..=41;

/// Where viewers are looked for.
pub(super) struct SearchPlaces {
    /// `PATH`.
    search_path: OsString,
    /// The active virtual environment.
    environment: Option<PathBuf>,
    /// The folder of this program; a wheel puts both into one.
    program_folder: Option<PathBuf>,
}

impl SearchPlaces {
    /// Those of this process.
    pub(super) fn of_this_process() -> Self {
        let variable = |name| std::env::var_os(name).unwrap_or_default();
        let environment = PathBuf::from(variable("VIRTUAL_ENV"));
        let program = std::env::current_exe().ok();
        Self {
            search_path: variable("PATH"),
            environment: Some(environment).filter(|it| it.is_absolute()),
            program_folder: program.and_then(|it| it.parent().map(Path::to_owned)),
        }
    }

    /// All viewers, the first choice first.
    fn viewers(&self) -> Vec<PathBuf> {
        // `Command` looks for a bare name, as that of an empty folder, on the search path.
        let search_path = std::env::split_paths(&self.search_path).filter(|it| !it.as_os_str().is_empty());
        let active = self.environment.iter().map(|it| it.join("bin"));
        let program = self.program_folder.iter().cloned();
        let mut viewers: Vec<PathBuf> = Vec::new();
        for folder in search_path.chain(active).chain(program) {
            let viewer = folder.join("rerun");
            // An active environment is on the search path as well.
            if viewer.is_file() && !viewers.contains(&viewer) {
                viewers.push(viewer);
            }
        }
        viewers
    }
}

/// The first viewer of our version, or else the first one that opens our recordings; `note` gets the version of the latter.
///
/// # Errors
/// When there is no such viewer.
pub(super) fn find_viewer(places: &SearchPlaces, note: &mut dyn FnMut(&str)) -> Result<PathBuf, Error> {
    let mut others = Vec::new();
    for viewer in places.viewers() {
        let version = viewer_version(&viewer);
        if version == VERSION {
            return Ok(viewer);
        }
        others.push((viewer, version));
    }
    let (first, last) = (OPENING_VERSIONS.start(), OPENING_VERSIONS.end());
    if let Some((viewer, version)) = others.iter().find(|(_, version)| opens_recordings(version)) {
        note(&format!(
            "the Rerun viewer {} is version {version}, the recordings are of version {VERSION}; versions 0.{first} to \
             0.{last} open them",
            viewer.display()
        ));
        return Ok(viewer.clone());
    }
    let found: Vec<_> =
        others.iter().map(|(viewer, version)| format!("{} is version {version}", viewer.display())).collect();
    let message = match found.is_empty() {
        true => "there is no Rerun viewer (`rerun`) on the search path, in the active virtual environment or beside this program"
            .to_owned(),
        false => format!("the Rerun viewer {}, expected {VERSION}; 0.{first} to 0.{last} will do", found.join(", ")),
    };
    Err(Error::invalid_input(message).with_help(format!(
        "install it: pip install rerun-sdk=={VERSION}; report.html beside the recording plays the run in any browser"
    )))
}

/// The version that a viewer prints.
fn viewer_version(viewer: &Path) -> String {
    let output = Command::new(viewer).arg("--version").stdin(Stdio::null()).output();
    let text = output.map(|it| String::from_utf8_lossy(&it.stdout).into_owned()).unwrap_or_default();
    // `rerun-cli 0.36.3 [rustc ...]`
    text.split_whitespace().nth(1).unwrap_or("unknown").to_owned()
}

/// Whether viewers of a version open our recordings.
fn opens_recordings(version: &str) -> bool {
    let minor = version.strip_prefix("0.").and_then(|it| it.split('.').next()?.parse().ok());
    minor.is_some_and(|it: u32| OPENING_VERSIONS.contains(&it))
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};
    use std::process::Command;

    use super::{SearchPlaces, VERSION, find_viewer};

    /// A file that prints a version as the viewer does. A shell writes it: a program that this process has open cannot start in a
    /// test beside this one.
    fn add_viewer(folder: &Path, version: &str) -> PathBuf {
        std::fs::create_dir_all(folder).expect("a folder");
        let viewer = folder.join("rerun");
        let script = r#"printf '#!/bin/sh\necho "rerun-cli %s [rustc]"\n' "$2" > "$1" && chmod +x "$1""#;
        let written = Command::new("sh").args(["-c", script, "sh"]).arg(&viewer).arg(version).status();
        assert!(written.is_ok_and(|it| it.success()));
        viewer
    }

    /// Places in a folder: `bin` on the search path, `active`, `program`.
    fn places(root: &Path) -> SearchPlaces {
        SearchPlaces {
            search_path: root.join("bin").into_os_string(),
            environment: Some(root.join("active")),
            program_folder: Some(root.join("program")),
        }
    }

    /// The viewer that is found in a folder, and what the user is told.
    fn find(root: &Path) -> (Result<PathBuf, String>, Vec<String>) {
        let mut notes = Vec::new();
        let viewer = find_viewer(&places(root), &mut |it| notes.push(it.to_owned()));
        (viewer.map_err(|it| it.to_string()), notes)
    }

    #[test]
    fn each_place_comes_before_those_behind_it() {
        let root = tempfile::tempdir().expect("a folder");
        let root = root.path();
        for place in ["program", "active/bin", "bin"] {
            let viewer = add_viewer(&root.join(place), VERSION);
            assert_eq!(find(root), (Ok(viewer), vec![]), "{place}");
        }
    }

    #[test]
    fn a_viewer_of_our_version_comes_before_others_that_open_recordings() {
        let root = tempfile::tempdir().expect("a folder");
        let root = root.path();
        add_viewer(&root.join("bin"), "0.20.3");
        let near = add_viewer(&root.join("active/bin"), "0.37.2");
        let (viewer, notes) = find(root);
        assert_eq!(viewer, Ok(near.clone()));
        assert!(notes.concat().contains(&format!("{} is version 0.37.2", near.display())), "{notes:?}");
        let ours = add_viewer(&root.join("program"), VERSION);
        assert_eq!(find(root), (Ok(ours), vec![]));
    }

    #[test]
    fn viewers_that_do_not_open_recordings_are_named_with_what_to_install() {
        let root = tempfile::tempdir().expect("a folder");
        let root = root.path();
        let (viewer, _) = find(root);
        assert!(viewer.is_err_and(|it| it.contains("there is no Rerun viewer")));
        let old = add_viewer(&root.join("bin"), "0.20.3");
        let strange = root.join("program/rerun");
        std::fs::create_dir(root.join("program")).expect("a folder");
        std::fs::write(&strange, "no program").expect("a file");
        let (viewer, notes) = find(root);
        let message = viewer.expect_err("no viewer fits");
        for part in [
            format!("{} is version 0.20.3, {} is version unknown", old.display(), strange.display()),
            format!("expected {VERSION}"),
        ] {
            assert!(message.contains(&part), "{message}");
        }
        assert!(notes.is_empty());
    }
}
