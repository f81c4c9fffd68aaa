//! Keeps the values of a row with the names of its columns: another system has other columns, or the same ones in another order.

use std::collections::{HashMap, HashSet};

use recording::{AllVariables, Column, Columns, NumberIndex, Row, TextIndex, VariableDirection};
use serde::{Deserialize, Serialize};

use crate::system::{NodeBody, NodePlan};

/// The values of a row.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RowValues {
    numbers: Vec<f64>,
    texts: Vec<String>,
    integers: Vec<i128>,
}

impl RowValues {
    /// Those of a row.
    #[must_use]
    pub fn from_row(row: &Row<AllVariables>) -> Self {
        let (numbers, texts) = (row.numbers().to_vec(), row.texts().to_vec());
        RowValues { numbers, texts, integers: row.integers().to_vec() }
    }
}

/// The columns that have values: inputs, and outputs that somebody uses.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RowNames {
    /// By the place in the row.
    numbers: Vec<Option<(bool, String)>>,
    texts: Vec<Option<(bool, String)>>,
    /// The places of integers of 64 bits among the numbers.
    integers: Vec<usize>,
}

/// Outputs without a value.
#[derive(Debug, Clone, Default)]
pub struct MissingOutputs {
    pub(crate) numbers: HashSet<NumberIndex<AllVariables>>,
    pub(crate) texts: HashSet<TextIndex<AllVariables>>,
}

impl MissingOutputs {
    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty() && self.texts.is_empty()
    }
}

/// Whether it is an input, and its name.
fn column_key(column: &Column) -> (bool, String) {
    (column.direction == VariableDirection::Input, column.qualified_name())
}

/// The outputs that nobody uses, which are never asked for.
fn unused_outputs(plans: &[NodePlan]) -> MissingOutputs {
    let mut unused = MissingOutputs::default();
    for plan in plans {
        let NodeBody::Fmu { outputs, .. } = &plan.body else { continue };
        let mut numbers = plan.outputs.indices();
        for group in &outputs.numbers {
            let own = numbers.by_ref().take(group.places.len());
            unused.numbers.extend(own.filter(|_| !group.needed));
        }
        let mut texts = plan.texts.outputs.indices();
        for group in &outputs.texts {
            let own = texts.by_ref().take(group.places.len());
            unused.texts.extend(own.filter(|_| !group.needed));
        }
    }
    unused
}

impl RowNames {
    /// Those of a system.
    #[must_use]
    pub fn of_system(plans: &[NodePlan], columns: &Columns<AllVariables>) -> Self {
        let unused = unused_outputs(plans);
        let number = |(index, column)| (!unused.numbers.contains(&index)).then(|| column_key(column));
        let text = |(index, column)| (!unused.texts.contains(&index)).then(|| column_key(column));
        RowNames {
            numbers: columns.number_columns().map(number).collect(),
            texts: columns.text_columns().map(text).collect(),
            integers: columns.integer_columns().map(|(_, number)| number.position()).collect(),
        }
    }

    /// Puts values into a row with perhaps other columns; the outputs that have none.
    ///
    /// # Errors
    /// Says what is wrong when the values do not fit the names, or an input has none.
    pub fn fill_row(
        &self,
        values: &RowValues,
        columns: &Columns<AllVariables>,
        row: &mut Row<AllVariables>,
    ) -> Result<MissingOutputs, String> {
        let sizes = [self.numbers.len(), self.texts.len(), self.integers.len()];
        if sizes != [values.numbers.len(), values.texts.len(), values.integers.len()] {
            return Err("it does not have a value for each of its columns".to_owned());
        }
        let places = |names: &'_ [Option<(bool, String)>]| -> HashMap<(bool, String), usize> {
            let named = names.iter().enumerate();
            named.filter_map(|(place, name)| Some((name.clone()?, place))).collect()
        };
        let mut missing = MissingOutputs::default();
        let (numbers, texts) = (places(&self.numbers), places(&self.texts));
        let exact: HashMap<_, _> = self.integers.iter().copied().zip(&values.integers).collect();
        let absent = |column: &Column| match column.direction {
            VariableDirection::Input => Err(format!("it has no value of `{}`", column.qualified_name())),
            VariableDirection::Output => Ok(()),
        };
        for (index, column) in columns.number_columns() {
            match (numbers.get(&column_key(column)), columns.integer_index_of(index)) {
                (Some(place), None) => row[index] = values.numbers[*place],
                (Some(place), Some(integer)) => {
                    let value = exact.get(place).ok_or("it has a number in place of an integer")?;
                    row.set_integer(integer, index, **value);
                }
                (None, _) => {
                    absent(column)?;
                    missing.numbers.insert(index);
                }
            }
        }
        for (index, column) in columns.text_columns() {
            match texts.get(&column_key(column)) {
                Some(place) => row[index].clone_from(&values.texts[*place]),
                None => {
                    absent(column)?;
                    missing.texts.insert(index);
                }
            }
        }
        Ok(missing)
    }
}
