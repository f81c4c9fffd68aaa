//! Writes the files of a fastest lap: its page, its table, its numbers, and what drives it.

use std::path::{Path, PathBuf};

use diagnostics::Error;
use lap::{InteriorPointStatus, LapCar, ParameterRange};
use lap_report::LapPage;
use orchestrator::nofollow;
use track::LocalPlane;

use super::car_file::CarFile;
use super::drive_scenario::{DRIVE_HEAD, SET_HEAD, drive_files};

/// Names of all files of a lap.
pub const RESULT_FILES: [&str; 6] =
    ["lap.html", "lap.csv", "lap.json", "set.toml", "drive.toml", "setup.toml"];

/// First words of the set-up.
const SETUP_HEAD: &str = "# The fastest set-up";
/// Files that a lap does not always have, with their first words.
const OPTIONAL_FILES: [(&str, &str); 3] =
    [("set.toml", SET_HEAD), ("drive.toml", DRIVE_HEAD), ("setup.toml", SETUP_HEAD)];

/// Writes `lap.html`, `lap.csv` and `lap.json`, of a lap that is the fastest also the files that drive it, and returns
/// where they are.
///
/// # Errors
/// When the folder or a file cannot be written.
pub fn write_lap_files(
    folder: &Path,
    page: &LapPage,
    car_file: &CarFile,
    car: &LapCar,
    plane: Option<LocalPlane>,
) -> Result<Vec<PathBuf>, Error> {
    std::fs::create_dir_all(folder).map_err(|error| Error::output_failure(folder, error))?;
    let mut texts = vec![
        ("lap.html", lap_report::lap_page(page)),
        (
            "lap.csv",
            plane.map_or_else(String::new, |plane| plane.comment())
                + &lap_report::lap_table(&page.optimum.nodes),
        ),
        ("lap.json", format!("{:#}\n", lap_report::lap_numbers(page))),
    ];
    if page.optimum.status == InteriorPointStatus::Converged {
        texts.extend(drive_files(folder, car_file, car, page));
    }
    if let Some(setup) = page.setup {
        let line = |(range, value): (&ParameterRange, &f64)| format!("{} = {value:?}\n", range.key.name);
        let lines: String = setup.ranges.iter().zip(&setup.setup.values).map(line).collect();
        texts.push(("setup.toml", format!("{SETUP_HEAD}, in SI units.\n{lines}")));
    }
    for (name, head) in OPTIONAL_FILES {
        if texts.iter().all(|(written, _)| *written != name) {
            remove_stale_file(&folder.join(name), head)?;
        }
    }
    let mut paths = Vec::with_capacity(texts.len());
    for (name, text) in texts {
        let path = folder.join(name);
        nofollow::write_without_following_links(&path, text)
            .map_err(|error| Error::output_failure(&path, error))?;
        paths.push(path);
    }
    Ok(paths)
}

/// Removes a file that an earlier lap left, known by its first words: it would be taken for one of this lap.
fn remove_stale_file(path: &Path, head: &str) -> Result<(), Error> {
    match std::fs::read_to_string(path) {
        Ok(text) if text.starts_with(head) => {
            std::fs::remove_file(path).map_err(|error| Error::output_failure(path, error))
        }
        _ => Ok(()),
    }
}
