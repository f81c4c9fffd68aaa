//! Writes the reference of all keys in Markdown.

use std::fmt::Write as _;

use serde_json::Value;

use super::entry::{Entry, entries};

/// The reference of a schema: a section for each table, a line for each key.
#[must_use]
pub fn markdown(schema: &Value, title: &str) -> String {
    let entries = entries(schema);
    let mut page = format!("# {title}\n\n");
    let about = schema["description"].as_str().unwrap_or_default().replace('\n', " ");
    if !about.is_empty() {
        let _ = writeln!(page, "{about}\n");
    }
    page += "This page is made from the code that reads the file. `NAME` stands for any name.\n";
    section(&mut page, &entries, "");
    for table in entries.iter().filter(|entry| entry.is_table) {
        let level = if table.path.contains('.') { "###" } else { "##" };
        let _ = writeln!(page, "\n{level} `{}`\n\n{}", table.heading, table.description);
        if let Some(snippet) = &table.snippet {
            let _ = writeln!(page, "\n```toml\n{snippet}\n```");
        }
        section(&mut page, &entries, table.heading.trim_matches(['[', ']']));
    }
    page
}

/// The keys of one table.
fn section(page: &mut String, entries: &[Entry], parent: &str) {
    let keys: Vec<_> = entries.iter().filter(|entry| entry.parent() == parent).collect();
    if keys.is_empty() {
        return;
    }
    *page +=
        "\n| Key | Type | Unit | Default | Example | Description |\n|---|---|---|---|---|---|\n";
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
            kind(entry),
            entry.unit.clone().unwrap_or_default(),
            cell(&entry.examples.first().map(code).unwrap_or_default()),
            cell(&entry.description),
        );
    }
    for entry in
        keys.iter().filter(|entry| entry.choices.iter().any(|(_, about)| !about.is_empty()))
    {
        let _ = writeln!(page, "\nValues of `{}`:\n", entry.path);
        for (name, about) in &entry.choices {
            let _ = writeln!(page, "- `{name}`: {about}");
        }
    }
}

fn kind(entry: &Entry) -> String {
    let names: Vec<_> = entry.choices.iter().map(|(name, _)| format!("`{name}`")).collect();
    match names.is_empty() || entry.kind.starts_with("a list") {
        true => entry.kind.clone(),
        false => names.join(", "),
    }
}

fn cell(text: &str) -> String {
    text.replace("\n\n", " ").replace('|', "\\|")
}
