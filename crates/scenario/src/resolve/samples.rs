//! Reads joint samples from a CSV file: a line for each variant of a design, or for each draw from a posterior.

use std::path::{Path, PathBuf};

use diagnostics::{Error, Spanned};

use crate::document::Scenario;
use crate::plan::{AxisValues, SweepAxis};

/// The title of the column with the names of variants.
const VARIANT_NAME: &str = "name";
/// How names of files of draws end.
const ENDING: &str = "_draws.csv";
/// The largest file [bytes].
const LARGEST: u64 = 1 << 30;

/// The lines of a file that the scenario names.
pub(super) fn variant_list(scenario: &Scenario, word: &Spanned<String>) -> Result<SweepAxis, Error> {
    let path = scenario.source.resolve_path(word);
    read_table(&path).map_err(|what| scenario.error_at(word, what))
}

/// The draws in a file, or those that the identification of a run left beside its report.
pub(super) fn posterior_samples(
    scenario: &Scenario,
    name: &str,
    word: &Spanned<String>,
) -> Result<SweepAxis, Error> {
    let path = scenario.source.resolve_path(word);
    let axis = sample_file(&path, name).and_then(|path| read_table(&path));
    axis.map_err(|what| scenario.error_at(word, what))
}

/// The file of draws itself, when what is named is the report of a run.
///
/// # Errors
/// In words, when that run has none.
pub(crate) fn sample_file(path: &Path, name: &str) -> Result<PathBuf, String> {
    let is_report = path.extension().is_some_and(|ending| ending == "json");
    if is_report { file_beside_report(path, name) } else { Ok(path.to_owned()) }
}

/// The file of draws beside a report: the only one, or that of this name.
fn file_beside_report(report: &Path, name: &str) -> Result<PathBuf, String> {
    let text = diagnostics::read_text_bounded(report, LARGEST);
    let text = text.map_err(|error| format!("cannot read {}: {error}", report.display()))?;
    let parsed: serde_json::Value = serde_json::from_str(&text)
        .map_err(|error| format!("{}: expected a report of a run: {error}", report.display()))?;
    let files = parsed["files"].as_array().into_iter().flatten().filter_map(|it| it.as_str());
    let known: Vec<_> = files.filter_map(|it| it.strip_suffix(ENDING)).collect();
    let chosen = match known.as_slice() {
        [only] => Some(only),
        known => known.iter().find(|known| **known == name),
    };
    if let Some(chosen) = chosen {
        return Ok(report.with_file_name(format!("{chosen}{ENDING}")));
    }
    let hint = match known.as_slice() {
        [] => "no analysis of that run left draws from a posterior".to_owned(),
        known => format!("that run has draws of `{}`: give one of these names", known.join("`, `")),
    };
    let file = format!("{name}{ENDING}");
    Err(format!("{}: expected the file {file} among those of the run; {hint}", report.display()))
}

/// The columns of a file by their names, the unit of each in brackets behind it.
fn read_table(path: &Path) -> Result<SweepAxis, String> {
    let wrong = |what: String| format!("{}: {what}", path.display());
    let text = diagnostics::read_text_bounded(path, LARGEST);
    let text = text.map_err(|error| wrong(format!("cannot read it: {error}")))?;
    let mut reader =
        csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| wrong(error.to_string()))?.clone();
    let (mut names, mut units) = (Vec::new(), Vec::new());
    // A column of names sets nothing.
    let name_column = header.iter().position(|title| title == VARIANT_NAME);
    for title in header.iter().filter(|title| *title != VARIANT_NAME) {
        let unit = title.strip_suffix(']').and_then(|title| title.rsplit_once('['));
        let (name, unit) = match unit {
            Some((name, unit)) if name.ends_with(' ') => (name.trim_end(), Some(unit.to_owned())),
            _ => (title, None),
        };
        if name != "seed" && !name.contains('.') {
            return Err(wrong(format!(
                "expected the names of what the columns set, such as plant.body.m or seed, found `{title}`"
            )));
        }
        if names.iter().any(|known| known == name) {
            return Err(wrong(format!("two columns set `{name}`")));
        }
        names.push(name.to_owned());
        units.push(unit);
    }
    let (mut levels, mut variant_names) = (Vec::new(), Vec::new());
    for record in reader.records() {
        let whole = record.map_err(|error| wrong(error.to_string()))?;
        let cells = whole.iter().enumerate().filter(|(place, _)| Some(*place) != name_column);
        let mut record: csv::StringRecord = cells.map(|(_, cell)| cell).collect();
        record.set_position(whole.position().cloned());
        if let Some(name) = name_column.and_then(|place| whole.get(place)) {
            if variant_names.iter().any(|known| known == name) {
                let line = record.position().map_or(0, csv::Position::line);
                return Err(wrong(format!("line {line}: two variants are called `{name}`")));
            }
            variant_names.push(name.to_owned());
        }
        if let Some(index) = record.iter().position(str::is_empty) {
            let line = record.position().map_or(0, csv::Position::line);
            return Err(wrong(format!("line {line}: `{}` has no value", names[index])));
        }
        let seed = names.iter().position(|name| name == "seed").and_then(|index| record.get(index));
        if let Some(seed) = seed.filter(|text| !text.parse::<i64>().is_ok_and(|it| it >= 0)) {
            let line = record.position().map_or(0, csv::Position::line);
            return Err(wrong(format!(
                "line {line}: expected a seed, a whole number from 0 on, found {seed}"
            )));
        }
        levels.push(record.iter().map(str::to_owned).collect());
    }
    match levels.is_empty() {
        true => Err(wrong("it has no line with values".to_owned())),
        false => Ok(SweepAxis {
            names,
            units,
            is_joint: true,
            values: AxisValues::Levels(levels),
            variant_names: name_column.map(|_| variant_names),
        }),
    }
}
