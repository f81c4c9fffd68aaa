//! Makes tables of MAT files: vectors of one length are columns, whether they are variables or fields of a struct.

use std::collections::BTreeMap;

use mat_file::{MatFile, MatValue};

use crate::channels::is_known;
use crate::sample::BenchError;
use crate::table::{BenchColumn, BenchTable, ROWS};

/// Reads a file. Structs that each hold channels, such as `run(1)` and `run(2)`, are tables one after the other.
///
/// # Errors
/// When it is no MAT file, or holds no channels.
pub(crate) fn read_mat_tables(
    bytes: &[u8],
    file: &str,
    named: &[&str],
) -> Result<Vec<BenchTable>, BenchError> {
    let bad = |text: String| BenchError { file: file.to_owned(), line: None, text };
    let found = mat_file::read_mat_file(bytes).map_err(|error| bad(error.to_string()))?;
    let mut groups: BTreeMap<&str, Vec<(&str, &[f64])>> = BTreeMap::new();
    for variable in &found.variables {
        let MatValue::Numbers(array) = &variable.value else { continue };
        if array.is_vector() && !array.values.is_empty() {
            let (group, name) = split_struct_name(&variable.name);
            groups.entry(group).or_default().push((name, &array.values));
        }
    }
    let known = |columns: &Vec<(&str, &[f64])>| {
        columns.iter().filter(|(name, _)| is_known(name) || named.contains(name)).count()
    };
    let most = groups.values().map(known).max().unwrap_or(0);
    if most < 2 {
        let names: Vec<_> = found.variables.iter().take(60).map(|it| it.name.as_str()).collect();
        let mut text = format!("expected vectors such as FX, FZ and SA, found {}", names.join(", "));
        if let Some((name, reason)) = found.skipped.iter().find(|it| !it.0.is_empty()) {
            text = format!("{text}; `{name}` is {reason}");
        }
        return Err(bad(text));
    }
    let units = units_in_file(&found);
    // A run has all channels; what has few are settings or units.
    let runs = groups.into_iter().filter(|(_, columns)| 2 * known(columns) > most);
    runs.map(|(group, columns)| table_from_columns(file, group, &columns, &units)).collect()
}

/// The struct of a name, and its field.
fn split_struct_name(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

fn table_from_columns(
    file: &str,
    group: &str,
    columns: &[(&str, &[f64])],
    units: &BTreeMap<String, String>,
) -> Result<BenchTable, BenchError> {
    let mut table = BenchTable { file: file.to_owned(), ..BenchTable::default() };
    let channels = columns.iter().filter(|(name, _)| is_known(name));
    let rows = channels.map(|(_, values)| values.len()).max().unwrap_or(0);
    if rows > ROWS {
        return Err(table.error_at_line(None, format!("expected at most {ROWS} samples, found {rows}")));
    }
    for (name, values) in columns {
        if values.len() != rows && values.len() != 1 {
            if is_known(name) {
                let text =
                    format!("{name}: expected {rows} values as other channels have, found {}", values.len());
                return Err(table.error_at_line(None, text));
            }
            continue;
        }
        let unit = units.get(&format!("{group}.{name}").to_ascii_lowercase());
        let unit = unit.or_else(|| units.get(&name.to_ascii_lowercase()));
        let mut column = BenchColumn::new(name, unit.map_or("", String::as_str));
        column.constant = values.len() == 1 && rows > 1;
        column.values = values.to_vec();
        table.columns.push(column);
    }
    if !group.is_empty() {
        table.notes.push(format!("channels of the struct `{group}`"));
    }
    Ok(table)
}

/// What the file says of units: lists of names and units side by side (`channel.name`, `channel.units`), `channel(2).name` with
/// `channel(2).units`, fields of a struct `units` (`units.FX`), or `FX_units`. Names are in lower case.
fn units_in_file(found: &MatFile) -> BTreeMap<String, String> {
    let mut units = BTreeMap::new();
    let texts = |name: &str| found.text_rows(name);
    for variable in &found.variables {
        let MatValue::Texts(values) = &variable.value else { continue };
        let lower = variable.name.to_ascii_lowercase();
        let (group, field) = split_struct_name(&variable.name);
        if matches!(split_struct_name(&lower).1, "name" | "names") {
            let of = ["units", "unit", "Units", "Unit"].iter().find_map(|it| {
                let path = if group.is_empty() { (*it).to_owned() } else { format!("{group}.{it}") };
                texts(&path)
            });
            let pairs = values.iter().zip(of.unwrap_or_default());
            units.extend(pairs.map(|(name, unit)| (name.to_ascii_lowercase(), unit.clone())));
        } else if let [unit] = &values[..] {
            let of_struct = split_struct_name(group).1.to_ascii_lowercase();
            let base = lower.strip_suffix("_units").or_else(|| lower.strip_suffix("_unit"));
            if matches!(of_struct.as_str(), "units" | "unit") {
                units.insert(field.to_ascii_lowercase(), unit.clone());
            } else if let Some(base) = base {
                units.insert(base.to_owned(), unit.clone());
            }
        }
    }
    units
}
