//! Reads recordings of real cars, which belong to others and may not be at hand.

use std::path::{Path, PathBuf};

/// A CSV file of numbers; a cell that is none is NaN.
pub struct RealLog {
    titles: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl RealLog {
    /// A file of `shared/data` beside the repository, or of the folder `TRACKSIDE_DATA`; `None`, and a line that says so, without it.
    pub fn read(file: &str) -> Option<Self> {
        let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
        let beside = || above.map(|it| it.join("shared/data")).find(|it| it.is_dir());
        let folder = std::env::var_os("TRACKSIDE_DATA").map(PathBuf::from).or_else(beside);
        let text = folder.and_then(|folder| std::fs::read_to_string(folder.join(file)).ok());
        let Some(text) = text else {
            eprintln!("skipped: no {file} in shared/data beside the repository, or in TRACKSIDE_DATA");
            return None;
        };
        let mut lines = text.lines();
        let titles = lines.next()?.trim_start_matches("# ").split(',').map(str::to_owned).collect();
        let cell = |cell: &str| cell.parse().unwrap_or(f64::NAN);
        let rows = lines.map(|line| line.split(',').map(cell).collect()).collect();
        Some(Self { titles, rows })
    }

    /// A column, in other units by a factor.
    pub fn column(&self, title: &str, factor: f64) -> Vec<f64> {
        let place = self.titles.iter().position(|it| it == title).expect("a column of the file");
        self.rows.iter().map(|row| factor * row[place]).collect()
    }
}
