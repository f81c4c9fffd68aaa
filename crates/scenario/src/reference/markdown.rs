//! Writes the reference of all keys in Markdown.

use std::fmt::Write as _;

use serde_json::Value;

use super::entry::{KeyReference, list_schema_keys};

/// The reference of a schema: a section for each table, a line for each key.
#[must_use]
pub fn schema_to_markdown(schema: &Value, title: &str) -> String {
    let entries = list_schema_keys(schema);
    let mut page = format!("# {title}\n\n");
    let about = schema["description"].as_str().unwrap_or_default().replace('\n', " ");
    if !about.is_empty() {
        let _ = writeln!(page, "{about}\n");
    }
    page += "This page is made from the code that reads the file. `NAME` stands for any name.\n";
    let of = |choice: Option<&(String, String)>| -> Vec<&KeyReference> {
        entries.iter().filter(|entry| file_choice(entry) == choice).collect()
    };
    write_tables(&mut page, &of(None), "##");
    // The file as a whole may have a tag.
    for tag in entries.iter().filter(|entry| file_choice(entry).is_none() && is_tag(entry, &entries)) {
        for (text, about) in &tag.choices {
            let _ = writeln!(page, "\n## `{} = \"{text}\"`\n\n{about}", tag.path);
            write_tables(&mut page, &of(Some(&(tag.path.clone(), text.clone()))), "###");
        }
    }
    page
}

/// The choice of a tag of the file as a whole that a key depends on.
fn file_choice(entry: &KeyReference) -> Option<&(String, String)> {
    entry.conditions.first().filter(|(tag, _)| !tag.contains('.'))
}

/// Whether it is the tag of the file as a whole.
fn is_tag(entry: &KeyReference, entries: &[KeyReference]) -> bool {
    entries.iter().filter_map(file_choice).any(|(tag, _)| *tag == entry.path)
}

/// The keys outside of tables, then those of each table.
fn write_tables(page: &mut String, entries: &[&KeyReference], first_level: &str) {
    write_key_table(page, entries, "");
    for table in entries.iter().filter(|entry| entry.is_table) {
        let level = if table.path.contains('.') { "###" } else { first_level };
        let _ = writeln!(page, "\n{level} `{}`\n\n{}", table.heading, table.about);
        if let Some(snippet) = &table.snippet {
            let _ = writeln!(page, "\n```toml\n{snippet}\n```");
        }
        write_key_table(page, entries, table.heading.trim_matches(['[', ']']));
    }
}

/// The keys of one table.
fn write_key_table(page: &mut String, entries: &[&KeyReference], parent: &str) {
    let keys: Vec<_> = entries.iter().filter(|entry| entry.parent_path() == parent).collect();
    if keys.is_empty() {
        return;
    }
    *page += "\n| Key | Type | Unit | Default | Example | Description |\n|---|---|---|---|---|---|\n";
    for entry in &keys {
        let default = match (&entry.default, entry.required) {
            (_, true) => "required".to_owned(),
            (Some(default), _) => format!("`{default}`"),
            (None, _) => String::new(),
        };
        let code = |text: &String| format!("`{text}`");
        let _ = writeln!(
            page,
            "| `{}` | {} | {} | {default} | {} | {} |",
            entry.path,
            type_or_choices(entry),
            entry.unit.clone().unwrap_or_default(),
            escape_table_cell(&entry.examples.first().map(code).unwrap_or_default()),
            escape_table_cell(&(own_condition_text(entry) + &entry.description)),
        );
    }
    for entry in keys.iter().filter(|entry| entry.choices.iter().any(|(_, about)| !about.is_empty())) {
        let _ = writeln!(page, "\nValues of `{}`:\n", entry.path);
        for (name, about) in &entry.choices {
            let _ = writeln!(page, "- `{name}`: {about}");
        }
    }
}

/// The tag of the same table that a key depends on.
fn own_condition_text(entry: &KeyReference) -> String {
    let tags = entry.conditions.iter().zip(entry.conditions_as_toml());
    let own = tags.filter(|((tag, _), _)| {
        tag.contains('.') && tag.rsplit_once('.').is_some_and(|(table, _)| table == entry.parent_path())
    });
    own.map(|(_, written)| format!("With `{written}`: ")).collect()
}

fn type_or_choices(entry: &KeyReference) -> String {
    let names: Vec<_> = entry.choices.iter().map(|(name, _)| format!("`{name}`")).collect();
    match names.is_empty() || !entry.kind.starts_with("a text") {
        true => entry.kind.clone(),
        false => names.join(", "),
    }
}

fn escape_table_cell(text: &str) -> String {
    text.replace("\n\n", " ").replace('|', "\\|")
}
