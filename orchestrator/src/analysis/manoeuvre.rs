//! The analysis of a manoeuvre: its characteristic values as numbers for checks and as a table for the report, its course and its diagrams.

use diagnostics::Error;
use manoeuvre::{CharacteristicValue, CharacteristicValueInfo, CharacteristicValues, Manoeuvre};
use serde_json::{Map, Value, json};

use crate::report::TestPicture;

/// The values of a manoeuvre, from the columns that the driver commanded and measured, in the order of [`Manoeuvre::test_log`]. The
/// pictures get that of the test, whether it has values or not.
///
/// # Errors
/// When the test did not take place.
pub(super) fn evaluate_manoeuvre(
    name: &str,
    manoeuvre: &Manoeuvre,
    time: &[f64],
    columns: &[Vec<f64>],
    pictures: &mut Vec<TestPicture>,
) -> Result<Value, Error> {
    let failed = |what: String| Error::analysis_failure(name, what);
    let Some((commands, inputs)) = columns.split_first_chunk::<3>() else {
        return Err(failed("its commands are not there".to_owned()));
    };
    let commands = commands.each_ref().map(Vec::as_slice);
    pictures.push(TestPicture::new(name, manoeuvre, time, commands[2], inputs));
    let log = manoeuvre.test_log(time, commands, inputs).map_err(failed)?;
    let values = manoeuvre.kind.characteristic_values(&manoeuvre.common, &log).map_err(failed)?;
    if let Some(picture) = pictures.last_mut()
        && let Some((begin, _)) = picture.stages.first()
    {
        picture.diagrams = manoeuvre.test_diagrams(&log, &values, *begin);
    }
    Ok(manoeuvre_result_json(manoeuvre, &values))
}

/// The values under their names, with a title and tables.
fn manoeuvre_result_json(manoeuvre: &Manoeuvre, values: &CharacteristicValues) -> Value {
    let known = manoeuvre.kind.value_descriptions();
    let about = |name: &str| known.iter().find(|it| it.name == name);
    let (mut all, mut rows, mut lists) = (Map::new(), Vec::new(), Vec::new());
    for (name, found) in &values.0 {
        let Some(known) = about(name) else { continue };
        match found {
            CharacteristicValue::Number(number) => {
                all.insert((*name).to_owned(), json!(number));
                let number = number.map_or("-".to_owned(), format_four_digits);
                rows.push(json!([name, number, known.unit, known.about]));
            }
            CharacteristicValue::List(list) => {
                all.insert((*name).to_owned(), json!(list));
                lists.push((known, list));
            }
        }
    }
    let mut tables = Vec::new();
    if !rows.is_empty() {
        tables.push(json!({ "head": ["value", "", "unit", ""], "rows": rows }));
    }
    tables.extend(value_lists_table(&lists));
    all.insert("summary".to_owned(), json!([manoeuvre.kind.kind_title()]));
    all.insert("tables".to_owned(), Value::Array(tables));
    Value::Object(all)
}

/// Lists side by side, one row for each place.
fn value_lists_table(lists: &[(&CharacteristicValueInfo, &Vec<f64>)]) -> Option<Value> {
    let longest = lists.iter().map(|(_, list)| list.len()).max()?;
    let title = |known: &CharacteristicValueInfo| format!("{} [{}]", known.name, known.unit);
    let head: Vec<_> = lists.iter().map(|(known, _)| title(known)).collect();
    let cell =
        |list: &Vec<f64>, place: usize| list.get(place).copied().map_or(String::new(), format_four_digits);
    let row = |place| lists.iter().map(|(_, list)| cell(list, place)).collect::<Vec<_>>();
    Some(json!({ "head": head, "rows": (0..longest).map(row).collect::<Vec<_>>() }))
}

/// A number with four digits.
fn format_four_digits(number: f64) -> String {
    if number != 0.0 && !(1e-3..1e5).contains(&number.abs()) {
        return format!("{number:.3e}");
    }
    let before = if number == 0.0 { 0 } else { number.abs().log10().floor() as i32 };
    format!("{number:.*}", usize::try_from(3 - before).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::format_four_digits;

    #[test]
    fn numbers_have_four_digits() {
        for (number, text) in [
            (0.0, "0.000"),
            (-0.033_21, "-0.03321"),
            (3.571_4, "3.571"),
            (27.78, "27.78"),
            (12_345.6, "12346"),
            (2.5e-5, "2.500e-5"),
        ] {
            assert_eq!(format_four_digits(number), text);
        }
    }
}
