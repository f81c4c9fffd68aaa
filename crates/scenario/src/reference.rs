//! Makes the reference of a configuration file from its JSON schema: all keys in Markdown, and one of them for the terminal.

mod entry;
mod explain;
mod markdown;

use serde_json::{Value, json};

pub use entry::{KeyReference, list_schema_keys};
pub use explain::{MOST_EXPLAINED, ambiguous_key, explain_key, list_top_keys, matching_paths, unknown_key};
pub use markdown::schema_to_markdown;

use crate::document;
use crate::schema::{stated_unit, takes_unit_of_table};

/// The JSON schema of a scenario file, for editors. No key is required: a file that extends another one may leave any out.
#[must_use]
pub fn editor_schema_text() -> String {
    let mut schema = document::scenario_schema_value().clone();
    remove_required_keys(&mut schema);
    allow_texts_with_units(&mut schema, false);
    schema["$id"] = "scenario.schema.json".into();
    schema["title"] = "Trackside scenario".into();
    format_schema(&schema)
}

fn remove_required_keys(schema: &mut Value) {
    match schema {
        Value::Array(list) => list.iter_mut().for_each(remove_required_keys),
        Value::Object(map) => {
            if map.get("required").is_some_and(Value::is_array) {
                map.remove("required");
            }
            map.values_mut().for_each(remove_required_keys);
        }
        _ => {}
    }
}

/// Lets numbers with a unit be texts such as `"100 km/h"`, too; `of_list` says that the list around them has a unit.
fn allow_texts_with_units(schema: &mut Value, of_list: bool) {
    let has_unit = of_list || stated_unit(schema).is_some() || takes_unit_of_table(schema);
    match schema {
        Value::Array(list) => list.iter_mut().for_each(|schema| allow_texts_with_units(schema, false)),
        Value::Object(map) => {
            let is_list = map.get("type").is_some_and(|it| it == "array");
            if has_unit && map.get("type").is_some_and(|it| it == "number") {
                map.insert("type".to_owned(), json!(["number", "string"]));
            }
            for (key, schema) in map {
                allow_texts_with_units(schema, has_unit && is_list && key == "items");
            }
        }
        _ => {}
    }
}

/// A JSON schema as text.
#[must_use]
pub fn format_schema(schema: &Value) -> String {
    format!("{schema:#}\n")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Compares a file of the repository with the text that the code makes, or rewrites it with BLESS=1.
    fn golden(name: &str, text: &str) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference").join(name);
        if std::env::var_os("BLESS").is_some() {
            std::fs::write(&path, text).expect("a file that can be written");
        }
        let found = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(
            found == text,
            "docs/reference/{name} is not what the code makes: run `BLESS=1 cargo test -p scenario reference`"
        );
    }

    #[test]
    fn the_reference_of_scenarios_is_that_of_the_code() {
        golden("scenario.md", &schema_to_markdown(document::scenario_schema_value(), "Scenario reference"));
        golden("scenario.schema.json", &editor_schema_text());
    }

    #[test]
    fn every_key_has_a_description_and_an_example() {
        for entry in list_schema_keys(document::scenario_schema_value()) {
            assert!(!entry.description.is_empty(), "{} has no description", entry.path);
            let shown = entry.is_table || !entry.examples.is_empty();
            assert!(shown, "{} has no example", entry.path);
        }
    }

    #[test]
    fn a_key_is_found_by_its_path_or_by_its_end() {
        let explain = |key: &str| {
            explain_key(document::scenario_schema_value(), key).map_err(|unknown| unknown.to_string())
        };
        for key in ["connect.noise.std", "noise.std", " connect.noise.std "] {
            let text = explain(key).expect(key);
            for part in ["connect.noise.std", "a number", "std = 0.1", "Standard deviation"] {
                assert!(text.contains(part), "{key}: {text}");
            }
        }
        for (key, part) in [
            ("[[connect]]", "convert"),
            ("connect.noise", "std"),
            ("view.xy_plot", "trail"),
            ("time", "[time]"),
            ("coupling.algorithm", "`gauss_seidel`"),
            ("quantise", "connect.quantise"),
            ("bias", "connect.bias"),
            ("bias", "fault.bias"),
        ] {
            let text = explain(key).expect(key);
            assert!(text.contains(part), "{key}: {text}");
        }
        for (key, part) in [
            ("seeed", "did you mean `seed`?"),
            ("conect.noise", "did you mean `connect.noise`?"),
            ("name", "analysis.name, "),
        ] {
            let error = explain(key).expect_err(key);
            assert!(error.contains(part), "{key}: {error}");
        }
    }
}
