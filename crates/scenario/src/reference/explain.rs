//! Formats the reference of one key for the terminal.

use std::fmt::Write as _;

use diagnostics::suggest::{self, UnknownName, join_shortened};
use serde_json::Value;

use super::entry::{KeyReference, list_schema_keys};

/// The paths of the keys that a name may mean: a path, a table `[[connect]]`, or the end of paths.
#[must_use]
pub fn matching_paths(schema: &Value, key: &str) -> Vec<String> {
    let entries = list_schema_keys(schema);
    let mut paths: Vec<_> = matching_entries(&entries, key).into_iter().map(|it| it.path.clone()).collect();
    paths.dedup();
    paths
}

/// The entries of a path or a table, or else those whose paths end so.
fn matching_entries<'e>(entries: &'e [KeyReference], key: &str) -> Vec<&'e KeyReference> {
    let wanted = key.trim().trim_matches(['[', ']']).trim();
    let same: Vec<_> = entries.iter().filter(|it| it.path == wanted || table_path(it) == wanted).collect();
    if !same.is_empty() {
        return same;
    }
    let ending = format!(".{wanted}");
    entries.iter().filter(|it| it.path.ends_with(&ending)).collect()
}

/// The explanation of a key: its path `connect.noise`, its table `[[connect]]`, or the end of its path when that is unique.
///
/// # Errors
/// When no key is called so, or several are.
pub fn explain_key(schema: &Value, key: &str) -> Result<String, UnknownName> {
    let entries = list_schema_keys(schema);
    let wanted = key.trim().trim_matches(['[', ']']).trim();
    let found = matching_entries(&entries, key);
    match found[..] {
        [first, ref others @ ..] if others.iter().all(|it| it.path == first.path) => {
            let texts = found.iter().map(|entry| describe_key(entry, &entries));
            Ok(texts.collect::<Vec<_>>().join("\n"))
        }
        [] => {
            let paths = entries.iter().map(|entry| entry.path.as_str());
            let known: Vec<_> = paths.chain(entries.iter().map(KeyReference::last_key)).collect();
            Err(suggest::unknown_name("key", wanted, known))
        }
        _ => {
            let paths: Vec<_> = found.iter().map(|entry| entry.path.as_str()).collect();
            let message = format!("several keys are called `{wanted}`");
            let help = Some(format!("known: {}", join_shortened(&paths)));
            Err(UnknownName { message, help, name: wanted.to_owned() })
        }
    }
}

/// The path of the keys of a table: `table.columns.NAME`.
fn table_path(entry: &KeyReference) -> &str {
    entry.heading.trim_matches(['[', ']'])
}

fn describe_key(entry: &KeyReference, entries: &[KeyReference]) -> String {
    let head = if entry.is_table { &entry.heading } else { &entry.path };
    let mut text = format!("{head}: {}", entry.kind);
    if let Some(unit) = &entry.unit {
        let _ = write!(text, " [{unit}]");
    }
    if entry.required {
        text += ", required";
    } else if let Some(default) = &entry.default {
        let _ = write!(text, ", default {default}");
    }
    if !entry.conditions.is_empty() {
        let _ = write!(text, "\nwith {}", entry.conditions_as_toml().join(" and "));
    }
    let about = if entry.is_table { &entry.about } else { &entry.description };
    let _ = writeln!(text, "\n\n{about}");
    for (name, about) in &entry.choices {
        let _ = writeln!(text, "  `{name}`  {about}");
    }
    if let Some(snippet) = &entry.snippet {
        let _ = writeln!(text, "\n{snippet}");
    } else if let Some(example) = entry.examples.first() {
        let _ = writeln!(text, "\nExample: {} = {example}", entry.last_key());
    }
    let below = |it: &&KeyReference| {
        it.parent_path() == table_path(entry) && it.conditions.starts_with(&entry.conditions)
    };
    let keys: Vec<_> = entries.iter().filter(below).collect();
    if entry.is_table && !keys.is_empty() {
        let width = keys.iter().map(|it| it.last_key().len()).max().unwrap_or(0);
        let _ = writeln!(text, "\nKeys:");
        for key in keys {
            let first = key.description.split(". ").next().unwrap_or_default();
            let required = if key.required { " (required)" } else { "" };
            let _ = writeln!(text, "  {:width$}  {}{required}", key.last_key(), first.trim_end_matches('.'));
        }
    }
    text
}
