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

/// The keys that one name explains at once; of more only the paths are named.
pub const MOST_EXPLAINED: usize = 6;

/// The explanation of a key: its path `connect.noise`, its table `[[connect]]`, or the end of its path. Of a name that ends several paths,
/// each key is explained.
///
/// # Errors
/// When no key is called so, or more than [`MOST_EXPLAINED`] are.
pub fn explain_key(schema: &Value, key: &str) -> Result<String, UnknownName> {
    let entries = list_schema_keys(schema);
    let wanted = key.trim().trim_matches(['[', ']']).trim();
    let found = matching_entries(&entries, key);
    let mut paths: Vec<_> = found.iter().map(|entry| entry.path.as_str()).collect();
    paths.dedup();
    match paths.len() {
        0 => Err(unknown_key(schema, key)),
        1..=MOST_EXPLAINED => {
            let texts = found.iter().map(|entry| describe_key(entry, &entries));
            Ok(texts.collect::<Vec<_>>().join("\n"))
        }
        _ => Err(ambiguous_key(wanted, &paths)),
    }
}

/// What is said of a name that no key has.
#[must_use]
pub fn unknown_key(schema: &Value, key: &str) -> UnknownName {
    let entries = list_schema_keys(schema);
    let paths = entries.iter().map(|entry| entry.path.as_str());
    let known: Vec<_> = paths.chain(entries.iter().map(KeyReference::last_key)).collect();
    suggest::unknown_name("key", key.trim().trim_matches(['[', ']']).trim(), known)
}

/// What is said of a name that ends the paths of too many keys.
#[must_use]
pub fn ambiguous_key(name: &str, paths: &[impl AsRef<str>]) -> UnknownName {
    UnknownName {
        message: format!("{} keys are called `{name}`", paths.len()),
        help: Some(format!("take one of {}", join_shortened(paths))),
        name: name.to_owned(),
    }
}

/// The keys at the top of a schema, a line for each, in a group for each condition that they depend on.
#[must_use]
pub fn list_top_keys(schema: &Value) -> String {
    let entries = list_schema_keys(schema);
    let top: Vec<_> = entries.iter().filter(|it| it.parent_path().is_empty()).collect();
    let groups = top.chunk_by(|a, b| a.conditions == b.conditions);
    let texts = groups.map(|keys| {
        let conditions = keys[0].conditions_as_toml().join(" and ");
        let head = if conditions.is_empty() { conditions } else { format!("\nwith {conditions}\n") };
        head + &key_lines(keys, |key| if key.is_table { &key.heading } else { &key.path })
    });
    texts.collect()
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
        let _ = write!(text, "\nKeys:\n{}", key_lines(&keys, KeyReference::last_key));
    }
    text
}

/// A line for each key: its name and the first sentence about it.
fn key_lines<'e>(keys: &[&'e KeyReference], name: impl Fn(&'e KeyReference) -> &'e str) -> String {
    let width = keys.iter().map(|it| name(it).len()).max().unwrap_or(0);
    let lines = keys.iter().map(|key| {
        let first = key.description.split(". ").next().unwrap_or_default();
        let required = if key.required { " (required)" } else { "" };
        format!("  {:width$}  {}{required}\n", name(key), first.trim_end_matches('.'))
    });
    lines.collect()
}
