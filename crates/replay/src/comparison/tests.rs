//! Compares runs of known rows.

use recording::{ValueKind, VariableDirection};

use super::*;

fn column(name: &str, unit: Option<&str>) -> Column {
    let (node, variable) = name.split_once('.').expect("node.variable");
    Column {
        node: node.to_owned(),
        variable: variable.to_owned(),
        direction: VariableDirection::Output,
        kind: ValueKind::Real,
        unit: unit.map(str::to_owned),
        description: None,
    }
}

#[test]
fn rows_of_both_runs_have_the_units_of_the_first() {
    let a = [column("a.v", Some("m/s")), column("a.x", Some("m")), column("a.only", None)];
    let b = [column("a.x", Some("s")), column("b.only", None), column("a.v", Some("km/h"))];
    let mut notes = Vec::new();
    let (columns, united) = merge_columns::<NumberKind>(&a, &b, &mut notes);
    let names: Vec<_> = columns.iter().map(Column::qualified_name).collect();
    assert_eq!(names, ["a.v", "a.x", "a.only", "a.x", "b.only"]);
    assert_eq!(united.common, 1);
    let only = united.only.map(|only| only.iter().map(NumberIndex::position).collect::<Vec<_>>());
    assert_eq!(only, [[1, 2], [3, 4]]);
    let Some(SourceColumn { index, factor, offset }) = &united.mappings[1][0] else { panic!("both have it") };
    assert!(index.position() == 2 && (factor - 1.0 / 3.6).abs() < 1e-15 && *offset == 0.0);
    assert!(notes.len() == 1 && notes[0].contains("`a.x` is in m and in s"), "{notes:?}");
}

#[test]
fn runs_are_told_apart_by_the_ends_of_their_paths() {
    let named = |a: &str, b: &str| distinct_path_endings([Path::new(a), Path::new(b)]);
    assert_eq!(named("/r/soft", "/r/stiff"), ["soft", "stiff"]);
    assert_eq!(named("/one/lap", "/two/lap"), ["one/lap", "two/lap"]);
    assert_eq!(named("/r/lap", "/r/lap"), ["A", "B"]);
}
