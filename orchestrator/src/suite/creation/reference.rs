//! Reads the reference results of an FMU, and makes a recording of them that a run can be compared with.

use std::path::Path;

use fmu_import::{Causality, FmiType, FmuDescription, Variable};
use recording::{GoldenColumn, GoldenRecording, GoldenValues, table};

use super::toml_text::{ColumnOmission, omission_notes};

/// Names of columns of times, in small letters.
const TIMES: [&str; 5] = ["time", "t", "zeit", "temps", "timestamp"];

/// Reference results under the names of a scenario.
#[derive(Debug)]
pub(super) struct ReferenceResults {
    pub recording: GoldenRecording,
    /// Variables that are compared and are no outputs.
    pub observed: Vec<String>,
    /// What is not compared, and why.
    pub notes: Vec<String>,
}

/// The column of the time in a file: one with such a name, or else the first one.
///
/// # Errors
/// In words, when the file cannot be read.
pub(super) fn time_column(path: &Path) -> Result<Option<String>, String> {
    let titles = table::read_titles(path).map_err(|error| error.to_string())?;
    let is_time = |name: &str| TIMES.contains(&name.trim().to_lowercase().as_str());
    let named = titles.columns.iter().find(|title| is_time(&title.plain));
    Ok(named.or(titles.columns.first()).map(|title| title.name.clone()))
}

impl ReferenceResults {
    /// Reads a CSV file of any tool; its columns are the variables of the FMU that is the node `node`.
    ///
    /// # Errors
    /// In words, when the file cannot be read, or none of its columns is a variable that can be compared.
    pub fn read(path: &Path, node: &str, description: &FmuDescription) -> Result<Self, String> {
        let texts = description.variables.iter().filter(|it| is_text(it)).map(|it| it.name.as_str());
        let texts: Vec<_> = texts.collect();
        let time = time_column(path)?;
        let read =
            GoldenRecording::read_csv(path, time.as_deref(), &texts).map_err(|error| error.to_string())?;
        let mut results = ColumnMapping::new(node, description);
        for column in read.columns() {
            if let Err(reason) = results.take_column(column) {
                results.omissions.push(ColumnOmission { column: column.name.clone(), reason });
            }
        }
        let notes = omission_notes("not compared", &results.omissions);
        if results.columns.is_empty() {
            return Err(match notes.is_empty() {
                true => "it has no columns besides the time".to_owned(),
                false => format!("nothing in it can be compared; {}", notes.join("; ")),
            });
        }
        let ColumnMapping { columns, observed, .. } = results;
        Ok(ReferenceResults { recording: GoldenRecording::new(read.times.clone(), columns), observed, notes })
    }
}

fn is_text(variable: &Variable) -> bool {
    matches!(variable.kind, FmiType::String | FmiType::Binary)
}

/// The columns of a file, as far as they are variables of an FMU.
struct ColumnMapping<'d> {
    node: &'d str,
    description: &'d FmuDescription,
    columns: Vec<GoldenColumn>,
    observed: Vec<String>,
    omissions: Vec<ColumnOmission>,
}

impl<'d> ColumnMapping<'d> {
    fn new(node: &'d str, description: &'d FmuDescription) -> Self {
        ColumnMapping { node, description, columns: Vec::new(), observed: Vec::new(), omissions: Vec::new() }
    }

    /// Takes a column as the variable of its name.
    fn take_column(&mut self, column: &GoldenColumn) -> Result<(), String> {
        let place = self.description.find_variable(&column.name);
        let place = place.ok_or("the FMU has no such variable")?;
        let variable = &self.description.variables[place];
        match variable.causality {
            Causality::Independent => return Err("it is the time".to_owned()),
            Causality::Input => return Err("it is an input".to_owned()),
            _ if variable.kind == FmiType::Clock => return Err("it is a clock".to_owned()),
            _ => {}
        }
        if variable.element.1 > 1 && variable.name != column.name {
            self.take_array(column, place)?;
        } else {
            let values = typed_values(variable, &column.values)?;
            self.columns.push(self.renamed_column(variable, column, values));
        }
        if variable.causality != Causality::Output {
            self.observed.push(column.name.clone());
        }
        Ok(())
    }

    /// Takes the elements of an array, whose first one is at `place`, from cells such as `1 2 3`.
    fn take_array(&mut self, column: &GoldenColumn, place: usize) -> Result<(), String> {
        let count = self.description.variables[place].element.1;
        let GoldenValues::Texts(cells) = &column.values else {
            return Err(format!("expected {count} elements in a cell, found one number"));
        };
        let rows = cells.iter().map(|cell| {
            let numbers: Option<Vec<f64>> =
                cell.split([' ', ';']).filter(|it| !it.is_empty()).map(|it| it.parse().ok()).collect();
            numbers.filter(|it| it.len() == count).ok_or(cell)
        });
        let rows: Result<Vec<Vec<f64>>, &String> = rows.collect();
        let rows = rows.map_err(|cell| format!("expected {count} numbers in a cell, found {cell:?}"))?;
        for element in 0..count {
            let variable = &self.description.variables[place + element];
            let values = GoldenValues::Numbers(rows.iter().map(|row| row[element]).collect());
            self.columns.push(self.renamed_column(variable, column, values));
        }
        Ok(())
    }

    /// A column under its name in the scenario. Its unit is that of the file where both say one.
    fn renamed_column(
        &self,
        variable: &Variable,
        column: &GoldenColumn,
        values: GoldenValues,
    ) -> GoldenColumn {
        let own = variable.offset_free_unit_name();
        let unit = own.map(|own| column.unit.clone().unwrap_or(own));
        GoldenColumn { name: format!("{}.{}", self.node, variable.name), unit, values }
    }
}

/// The values of a column as those of a variable.
fn typed_values(variable: &Variable, values: &GoldenValues) -> Result<GoldenValues, String> {
    match (values, is_text(variable)) {
        (GoldenValues::Texts(_), true) => Ok(values.clone()),
        (GoldenValues::Numbers(_), true) => Err("it is a text of the FMU".to_owned()),
        (GoldenValues::Numbers(numbers), false) => match numbers.iter().all(|value| value.is_finite()) {
            true => Ok(values.clone()),
            false => Err("it has cells without a number".to_owned()),
        },
        (GoldenValues::Texts(texts), false) => {
            let number = |text: &String| match text.trim().to_ascii_lowercase().as_str() {
                "false" => Ok(0.0),
                "true" => Ok(1.0),
                _ => {
                    let item = variable.items.iter().find(|item| item.name == text.trim());
                    item.map(|item| item.value as f64).ok_or(format!("{text:?} is no number"))
                }
            };
            texts.iter().map(number).collect::<Result<_, _>>().map(GoldenValues::Numbers)
        }
    }
}
