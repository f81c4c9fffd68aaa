//! Looks up numbers and texts in the results of analyses and validations.

use std::collections::BTreeMap;

use diagnostics::suggest;
use recording::Row;
use serde_json::Value;

use super::{ResultName, ResultSpace};

/// What the results say under some names: a number or a text for each; the place in the other list is left empty.
///
/// # Errors
/// In words, when there is no such result.
pub fn look_up(results: &BTreeMap<String, Value>, names: &[ResultName]) -> Result<Row<ResultSpace>, String> {
    let (mut numbers, mut texts) = (Vec::new(), Vec::new());
    for name in names {
        match (find_result(results, name)?, name.is_text) {
            ((_, Value::String(text)), true) => {
                numbers.push(f64::NAN);
                texts.push(text.clone());
            }
            ((place, value), true) => return Err(format!("`{place}` is no text, but {value}")),
            ((place, value), false) => {
                numbers.push(result_number(&place, value)?);
                texts.push(String::new());
            }
        }
    }
    Ok(Row::from_values(numbers, texts))
}

/// What stands under a name, and its full path.
fn find_result<'a>(
    results: &'a BTreeMap<String, Value>,
    name: &ResultName,
) -> Result<(String, &'a Value), String> {
    let ResultName { of, path, .. } = name;
    let mut value = results.get(of).ok_or_else(|| format!("`{of}` has no result"))?;
    // Of messages, names are whole: those of nodes may have dots and brackets.
    if let Some(found) = value.get(path) {
        return Ok((format!("{of}.{path}"), found));
    }
    let mut place = of.clone();
    for part in split_result_path(path) {
        value = child_value(value, part).map_err(|what| format!("`{place}` has no `{part}`{what}"))?;
        place = match part.parse::<usize>() {
            Ok(_) => format!("{place}[{part}]"),
            Err(_) => format!("{place}.{part}"),
        };
    }
    Ok((place, value))
}

/// The number; true is 1 and false is 0.
fn result_number(place: &str, value: &Value) -> Result<f64, String> {
    match value {
        Value::Number(number) => number.as_f64().ok_or_else(|| format!("`{place}` is {number}")),
        Value::Bool(truth) => Ok(f64::from(u8::from(*truth))),
        Value::Null => Err(format!("`{place}` is no number")),
        Value::String(text) => Err(format!("`{place}` is no number, but \"{text}\"")),
        Value::Array(list) => Err(format!("`{place}` is a list of {}: write `{place}[0]`", list.len())),
        Value::Object(map) => {
            let names: Vec<_> = map.keys().map(String::as_str).collect();
            Err(format!("`{place}` holds {}", names.join(", ")))
        }
    }
}

/// The parts of `levels[3].mean.D`: levels, 3, mean, D.
fn split_result_path(path: &str) -> impl Iterator<Item = &str> {
    path.split(['.', '[', ']', ',']).map(str::trim).filter(|part| !part.is_empty())
}

/// A part of a value, or what there is instead.
fn child_value<'a>(value: &'a Value, part: &str) -> Result<&'a Value, String> {
    match value {
        Value::Array(list) => part
            .parse()
            .ok()
            .and_then(|index: usize| list.get(index))
            .ok_or_else(|| format!(", it is a list of {}", list.len())),
        Value::Object(map) => map.get(part).ok_or_else(|| {
            let hint = suggest::suggest_name(part, map.keys().map(String::as_str));
            hint.map(|hint| format!("; {hint}")).unwrap_or_default()
        }),
        _ => Err(String::new()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_found_by_their_path_and_mistakes_are_told() {
        let result = serde_json::json!({
            "front": {"mean": {"B": 15.5, "C": 2}, "at_bound": true, "note": "weak", "none": null},
            "levels": [{"D": 1.5}, {"D": [1.25]}],
        });
        let results = BTreeMap::from([("tires".to_owned(), result)]);
        let find = |path: &str| {
            let (of, path) = ("tires".to_owned(), path.to_owned());
            let name = ResultName { of, path, is_text: false };
            look_up(&results, &[name]).map(|row| row.numbers()[0])
        };
        for (path, expected) in [
            ("front.mean.B", 15.5),
            ("front.mean.C", 2.0),
            ("front.at_bound", 1.0),
            ("levels[0].D", 1.5),
            ("levels[1].D[0]", 1.25),
        ] {
            assert_eq!(find(path), Ok(expected), "{path}");
        }
        let text = |path: &str| {
            let (of, path) = ("tires".to_owned(), path.to_owned());
            let name = ResultName { of, path, is_text: true };
            look_up(&results, &[name]).map(|row| row.texts()[0].clone())
        };
        assert_eq!(text("front.note"), Ok("weak".to_owned()));
        assert_eq!(text("front.mean.C"), Err("`tires.front.mean.C` is no text, but 2".to_owned()));
        for (path, expected) in [
            ("frnt.mean.B", "`tires` has no `frnt`; did you mean `front`?"),
            ("front.mean.Q", "`tires.front.mean` has no `Q`; known: B, C"),
            ("front.note", "`tires.front.note` is no number, but \"weak\""),
            ("front.none", "`tires.front.none` is no number"),
            ("front.mean", "`tires.front.mean` holds B, C"),
            ("levels", "`tires.levels` is a list of 2: write `tires.levels[0]`"),
            ("levels[2].D", "`tires.levels` has no `2`, it is a list of 2"),
            ("front.mean.B.x", "`tires.front.mean.B` has no `x`"),
        ] {
            assert_eq!(find(path), Err(expected.to_owned()), "{path}");
        }
    }
}
