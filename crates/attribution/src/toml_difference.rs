//! Finds the values that differ between two scenarios, by the keys that lead to them, and puts values of one into the other.

use std::collections::BTreeSet;
use std::fmt;

use toml::{Table, Value};

/// The keys that name an entry of a list, in the order in which they count.
const NAMES: [&str; 4] = ["name", "to", "node", "input"];

/// A step on the way to a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum KeyStep {
    /// A key of a table.
    Key(String),
    /// An entry of a list of tables, by its name, and its number among those of that name.
    Entry(String, usize),
}

/// The keys that lead to a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyPath(pub Vec<KeyStep>);

impl KeyPath {
    fn joined(&self, step: KeyStep) -> Self {
        KeyPath(self.0.iter().cloned().chain([step]).collect())
    }

    /// The first key.
    #[must_use]
    pub fn root(&self) -> &str {
        match self.0.first() {
            Some(KeyStep::Key(key)) => key,
            _ => "",
        }
    }

    /// The entry of the list at the root, and the key in it.
    #[must_use]
    pub fn entry_and_key(&self) -> Option<(&str, &str)> {
        match self.0.as_slice() {
            [_, KeyStep::Entry(name, _), KeyStep::Key(key), ..] => Some((name, key)),
            [_, KeyStep::Entry(name, _)] => Some((name, "")),
            _ => None,
        }
    }
}

impl fmt::Display for KeyPath {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, step) in self.0.iter().enumerate() {
            let dot = if place == 0 { "" } else { "." };
            match step {
                KeyStep::Key(key) | KeyStep::Entry(key, 0) => write!(out, "{dot}{key}")?,
                KeyStep::Entry(name, again) => write!(out, "{dot}{name}#{}", again + 1)?,
            }
        }
        Ok(())
    }
}

/// A value that differs: nothing where a scenario has none.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueDifference {
    /// The keys that lead to it.
    pub path: KeyPath,
    /// The value of A.
    pub a: Option<Value>,
    /// That of B.
    pub b: Option<Value>,
}

/// All values that differ between two tables.
#[must_use]
pub fn table_differences(a: &Table, b: &Table) -> Vec<ValueDifference> {
    let mut differences = Vec::new();
    compare_tables(&KeyPath(Vec::new()), a, b, &mut differences);
    differences
}

fn compare_tables(path: &KeyPath, a: &Table, b: &Table, differences: &mut Vec<ValueDifference>) {
    let keys: BTreeSet<_> = a.keys().chain(b.keys()).collect();
    for key in keys {
        compare_values(&path.joined(KeyStep::Key(key.clone())), a.get(key), b.get(key), differences);
    }
}

fn compare_values(
    path: &KeyPath,
    a: Option<&Value>,
    b: Option<&Value>,
    differences: &mut Vec<ValueDifference>,
) {
    match (a, b) {
        (Some(Value::Table(a)), Some(Value::Table(b))) => compare_tables(path, a, b, differences),
        // A whole table of the scenario, such as [coupling], is told key by key.
        (Some(Value::Table(a)), None) if path.0.len() == 1 => {
            compare_tables(path, a, &Table::new(), differences)
        }
        (None, Some(Value::Table(b))) if path.0.len() == 1 => {
            compare_tables(path, &Table::new(), b, differences)
        }
        (Some(a), Some(b)) if is_equal(a, b) => {}
        (a, b) if [a, b].into_iter().flatten().all(is_table_list) => {
            let (of_a, of_b) = (entries_of_list(a), entries_of_list(b));
            for (step, entry) in &of_a {
                let other = of_b.iter().find(|(it, _)| it == step).map(|(_, entry)| *entry);
                compare_values(&path.joined(step.clone()), Some(entry), other, differences);
            }
            for (step, entry) in of_b.iter().filter(|(step, _)| of_a.iter().all(|(it, _)| it != step)) {
                compare_values(&path.joined(step.clone()), None, Some(entry), differences);
            }
        }
        (a, b) => differences.push(ValueDifference { path: path.clone(), a: a.cloned(), b: b.cloned() }),
    }
}

fn entries_of_list(list: Option<&Value>) -> Vec<(KeyStep, &Value)> {
    named_entries(list.and_then(Value::as_array).map_or(&[], Vec::as_slice))
}

fn is_table_list(value: &Value) -> bool {
    value.as_array().is_some_and(|list| !list.is_empty() && list.iter().all(Value::is_table))
}

/// Whether both are the same value: 1 and 1.0 are.
fn is_equal(a: &Value, b: &Value) -> bool {
    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(|it| it as f64));
    match (number(a), number(b)) {
        (Some(a), Some(b)) => a.to_bits() == b.to_bits() || a == b,
        _ => a == b,
    }
}

/// The entries of a list of tables with their names; one without a name goes by its number.
pub(crate) fn named_entries(list: &[Value]) -> Vec<(KeyStep, &Value)> {
    let mut steps: Vec<(KeyStep, &Value)> = Vec::new();
    for (place, entry) in list.iter().enumerate() {
        let name = NAMES.iter().find_map(|key| entry.get(*key)?.as_str());
        let name = name.map_or_else(|| place.to_string(), str::to_owned);
        let again =
            steps.iter().filter(|(step, _)| matches!(step, KeyStep::Entry(it, _) if *it == name)).count();
        steps.push((KeyStep::Entry(name, again), entry));
    }
    steps
}

/// Puts a value where the keys lead to, or takes away what is there.
pub fn set_value(table: &mut Table, path: &KeyPath, value: Option<Value>) {
    set_in_table(table, &path.0, value);
}

fn set_in_table(table: &mut Table, path: &[KeyStep], value: Option<Value>) {
    match path {
        [KeyStep::Key(key)] => match value {
            Some(value) => drop(table.insert(key.clone(), value)),
            None => drop(table.remove(key)),
        },
        [KeyStep::Key(key), rest @ ..] => {
            let is_list = matches!(rest.first(), Some(KeyStep::Entry(..)));
            let empty = || if is_list { Value::Array(Vec::new()) } else { Value::Table(Table::new()) };
            match table.entry(key.clone()).or_insert_with(empty) {
                Value::Table(inner) => set_in_table(inner, rest, value),
                Value::Array(list) => set_in_list(list, rest, value),
                _ => {}
            }
        }
        _ => {}
    }
}

fn set_in_list(list: &mut Vec<Value>, path: &[KeyStep], value: Option<Value>) {
    let Some((step, rest)) = path.split_first() else { return };
    let place = named_entries(list).iter().position(|(it, _)| it == step);
    match (place, rest, value) {
        (Some(place), [], Some(value)) => list[place] = value,
        (Some(place), [], None) => drop(list.remove(place)),
        (None, [], Some(value)) => list.push(value),
        (Some(place), rest, value) => {
            if let Value::Table(inner) = &mut list[place] {
                set_in_table(inner, rest, value);
            }
        }
        (None, ..) => {}
    }
}

/// A value in one line, as people read it: 780 and not 780.0.
#[must_use]
pub fn display_value(value: &Value) -> String {
    match value {
        Value::Float(number) => number.to_string(),
        Value::String(text) => text.clone(),
        Value::Table(table) => {
            let entries: Vec<_> =
                table.iter().map(|(key, value)| format!("{key} = {}", display_value(value))).collect();
            format!("{{ {} }}", entries.join(", "))
        }
        Value::Array(list) => {
            let entries: Vec<_> = list.iter().map(display_value).collect();
            format!("[{}]", entries.join(", "))
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        text.parse().expect("a table")
    }

    #[test]
    fn entries_of_lists_go_by_their_names() {
        let a =
            table("[[connect]]\nfrom = 'p.a'\nto = 'e.a'\ngain = 1.0\n[[connect]]\nfrom = 'p.b'\nto = 'e.b'");
        let b =
            table("[[connect]]\nfrom = 'p.b'\nto = 'e.b'\n[[connect]]\nfrom = 'p.a'\nto = 'e.a'\ngain = -1");
        let found = table_differences(&a, &b);
        let [difference] = found.as_slice() else { panic!("{found:?}") };
        assert_eq!(difference.path.to_string(), "connect.e.a.gain");
        assert_eq!(difference.path.entry_and_key(), Some(("e.a", "gain")));
        let mut mixed = a.clone();
        set_value(&mut mixed, &difference.path, difference.b.clone());
        assert!(table_differences(&mixed, &b).is_empty());
    }

    #[test]
    fn what_only_one_has_is_one_difference_that_can_be_put_in_and_taken_out() {
        let a = table("seed = 1\n[time]\nstep = 0.01");
        let whole =
            table_differences(&a, &table("seed = 1\n[time]\nstep = 0.01\n[coupling]\nalgorithm = 'jacobi'"));
        assert_eq!(whole[0].path.to_string(), "coupling.algorithm");
        let b =
            table("seed = 1.0\n[time]\nstep = 0.01\ntolerance = 1e-6\n[[fault]]\ninput = 'e.a'\nvalue = 0");
        let found = table_differences(&a, &b);
        let names: Vec<_> = found.iter().map(|it| it.path.to_string()).collect();
        assert_eq!(names, ["fault.e.a", "time.tolerance"]);
        let mut mixed = a.clone();
        found.iter().for_each(|it| set_value(&mut mixed, &it.path, it.b.clone()));
        assert!(table_differences(&mixed, &b).is_empty());
        found.iter().for_each(|it| set_value(&mut mixed, &it.path, it.a.clone()));
        assert_eq!(mixed.get("fault").and_then(Value::as_array).map(Vec::len), Some(0));
    }

    #[test]
    fn values_are_shown_as_people_write_them() {
        let value = table("v = { a = 780.0, b = [1.5, 'x'] }");
        assert_eq!(display_value(&value["v"]), "{ a = 780, b = [1.5, x] }");
    }
}
