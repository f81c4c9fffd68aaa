//! Selects the recorded values from the rows of a run.

use expression::{IntegerIndex, NumberIndex, TextIndex};

use crate::columns::{Column, Columns};
use crate::row::{AllVariables, RecordedVariables, Row};

/// The variables of a run that are recorded: the only way from a full row to a recorded one.
#[derive(Debug, Clone, Default)]
pub struct RecordedSelection {
    numbers: Vec<NumberIndex<AllVariables>>,
    texts: Vec<TextIndex<AllVariables>>,
    integers: Vec<IntegerIndex<AllVariables>>,
}

impl RecordedSelection {
    /// The columns for which `keep` is true.
    pub fn new(columns: &Columns<AllVariables>, keep: impl Fn(&Column) -> bool) -> Self {
        Self {
            numbers: columns.number_columns().filter(|(_, it)| keep(it)).map(|(index, _)| index).collect(),
            texts: columns.text_columns().filter(|(_, it)| keep(it)).map(|(index, _)| index).collect(),
            integers: columns
                .integer_columns()
                .filter(|(_, number)| keep(&columns[*number]))
                .map(|(index, _)| index)
                .collect(),
        }
    }

    /// Whether nothing is recorded.
    #[must_use]
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty() && self.texts.is_empty() && self.integers.is_empty()
    }

    /// The recorded columns.
    #[must_use]
    pub fn recorded_columns(&self, full: &Columns<AllVariables>) -> Columns<RecordedVariables> {
        let numbers = self.numbers.iter().map(|&index| full[index].clone());
        let texts = self.texts.iter().map(|&index| full[index].clone());
        numbers.chain(texts).collect()
    }

    /// The recorded numbers.
    pub fn number_indices(&self) -> impl Iterator<Item = NumberIndex<AllVariables>> {
        self.numbers.iter().copied()
    }

    /// The recorded texts.
    pub fn text_indices(&self) -> impl Iterator<Item = TextIndex<AllVariables>> {
        self.texts.iter().copied()
    }

    /// The recorded column of a full one, if it is recorded.
    #[must_use]
    pub fn recorded_index(&self, index: NumberIndex<AllVariables>) -> Option<NumberIndex<RecordedVariables>> {
        // They stand in the order of the full row.
        let place = self.numbers.binary_search_by_key(&index.position(), |it| it.position());
        place.ok().map(NumberIndex::new)
    }

    /// Puts the recorded values of a full row into `recorded`, without allocating for numbers.
    pub fn copy_recorded_values(&self, full: &Row<AllVariables>, recorded: &mut Row<RecordedVariables>) {
        recorded.numbers.clear();
        recorded.numbers.extend(self.numbers.iter().map(|&index| full[index]));
        recorded.texts.resize_with(self.texts.len(), String::new);
        for (text, &index) in recorded.texts.iter_mut().zip(&self.texts) {
            text.clone_from(&full[index]);
        }
        recorded.integers.clear();
        recorded.integers.extend(self.integers.iter().map(|&index| full[index]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{ValueKind, VariableDirection};
    use crate::row::is_exact_in_f64;

    fn column(variable: &str, kind: ValueKind) -> Column {
        Column {
            node: "car".to_owned(),
            variable: variable.to_owned(),
            direction: VariableDirection::Output,
            kind,
            unit: None,
            description: None,
        }
    }

    #[test]
    fn a_recorded_row_has_the_selected_values_of_the_full_one() {
        let mut columns = Columns::<AllVariables>::default();
        columns.push(column("speed", ValueKind::Real));
        let gear = columns.push(column("gear", ValueKind::Integer));
        let state = columns.push(column("state", ValueKind::String));
        assert_eq!(columns.find("car.gear"), Some(gear));
        assert_eq!(columns.find("car.state"), Some(state));
        assert_eq!(columns.find("car.clutch"), None);
        let selection = RecordedSelection::new(&columns, |column| column.variable != "speed");
        let full = Row::from_values(vec![20.0, 3.0], vec!["armed".to_owned()]);
        let mut recorded = Row::default();
        selection.copy_recorded_values(&full, &mut recorded);
        assert_eq!(recorded, Row::from_values(vec![3.0], vec!["armed".to_owned()]));
        let names: Vec<_> = selection.recorded_columns(&columns).iter().map(Column::qualified_name).collect();
        assert_eq!(names, ["car.gear", "car.state"]);
    }

    #[test]
    fn an_integer_of_64_bits_is_kept_exactly_beside_its_number() {
        let kinds = [ValueKind::UInt64, ValueKind::Real, ValueKind::Int64];
        let mut columns = Columns::<AllVariables>::default();
        for (kind, name) in kinds.into_iter().zip(["id", "speed", "count"]) {
            columns.push(column(name, kind));
        }
        let places: Vec<_> = columns.integer_columns().collect();
        assert_eq!(places.iter().map(|(_, number)| number.position()).collect::<Vec<_>>(), [0, 2]);
        assert_eq!(columns.integer_index_of(NumberIndex::new(1)), None);
        assert_eq!(columns.integer_index_of(NumberIndex::new(2)), Some(places[1].0));
        let mut full = columns.zero_row();
        let (id, count) = (i128::from(u64::MAX), i128::from(i64::MIN) + 1);
        full.set_integer(places[0].0, places[0].1, id);
        full.set_integer(places[1].0, places[1].1, count);
        assert_eq!(full.numbers(), [u64::MAX as f64, 0.0, i64::MIN as f64]);
        assert_eq!(full.integers(), [id, count]);
        let selection = RecordedSelection::new(&columns, |column| column.variable != "id");
        let mut recorded = Row::default();
        selection.copy_recorded_values(&full, &mut recorded);
        assert_eq!(recorded.integers(), [count]);
        let columns = selection.recorded_columns(&columns);
        assert_eq!(columns.integer_columns().map(|it| it.1.position()).collect::<Vec<_>>(), [1]);
        assert!(is_exact_in_f64(1 << 53) && is_exact_in_f64(1 << 60) && !is_exact_in_f64((1 << 53) + 1));
    }
}
