//! Lists the keys of a JSON schema, each with its type, unit, default and examples.

use serde_json::{Value, json};

use crate::schema::{
    TaggedTable, allowed_texts, resolve_reference, schema_type_label, table_alternative, tagged_table,
    unit_in_description,
};

/// A key of a configuration file.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyReference {
    /// Keys with dots in between: `connect.noise.std`. `NAME` stands for any name.
    pub path: String,
    /// The path as the head of a table: `[[connect]]`.
    pub heading: String,
    /// Whether its value is a table with keys of its own, or a list of such tables.
    pub is_table: bool,
    /// Its type in words.
    pub kind: String,
    /// The values that it can have, with their descriptions.
    pub choices: Vec<(String, String)>,
    /// Its unit: `m/s`.
    pub unit: Option<String>,
    /// Whether it must be given.
    pub required: bool,
    /// Its value without the key, in TOML.
    pub default: Option<String>,
    /// Values in TOML.
    pub examples: Vec<String>,
    /// Its description, in Markdown, without snippets of TOML.
    pub description: String,
    /// The description of the table that it is or that its list has; the same as `description` without one.
    pub about: String,
    /// A snippet of TOML.
    pub snippet: Option<String>,
    /// The keys that it depends on, with their texts: `loss.kind` and `huber`.
    pub conditions: Vec<(String, String)>,
}

impl KeyReference {
    /// The conditions in TOML: `kind = "huber"`; the tag of another table has its path.
    #[must_use]
    pub fn conditions_as_toml(&self) -> Vec<String> {
        let written = |(tag, text): &(String, String)| {
            let (table, key) = tag.rsplit_once('.').unwrap_or(("", tag));
            format!("{} = \"{text}\"", if table == self.parent_path() { key } else { tag })
        };
        self.conditions.iter().map(written).collect()
    }

    /// The last key of the path.
    #[must_use]
    pub fn last_key(&self) -> &str {
        self.path.rsplit('.').next().unwrap_or(&self.path)
    }

    /// The path without its last key.
    #[must_use]
    pub fn parent_path(&self) -> &str {
        self.path.rsplit_once('.').map_or("", |(parent, _)| parent)
    }
}

/// The keys of a schema: each table is followed by its keys. Required keys come first, then the others by name.
#[must_use]
pub fn list_schema_keys(schema: &Value) -> Vec<KeyReference> {
    let mut walk =
        SchemaWalker { root: schema, entries: Vec::new(), above: Vec::new(), conditions: Vec::new() };
    walk.walk_table(schema, "");
    walk.entries
}

struct SchemaWalker<'a> {
    root: &'a Value,
    entries: Vec<KeyReference>,
    /// The tables around the current one, or else a table that contains itself would have no end.
    above: Vec<&'a Value>,
    conditions: Vec<(String, String)>,
}

/// The path of a key in a table.
fn join_key_path(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

impl<'a> SchemaWalker<'a> {
    fn walk_table(&mut self, schema: &'a Value, path: &str) {
        match tagged_table(self.root, schema) {
            Some(TaggedTable { tag, variants }) => self.tagged_table(tag, &variants, path),
            None => self.walk_keys(schema, path, None),
        }
    }

    fn tagged_table(&mut self, tag: &str, variants: &[(&'a str, &'a Value)], path: &str) {
        let path_of_tag = join_key_path(path, tag);
        let choice = |(name, schema): &(&str, &Value)| {
            let about = schema["description"].as_str().unwrap_or_default();
            ((*name).to_owned(), about.replace('\n', " "))
        };
        let description = "Selects the other keys of the table.".to_owned();
        self.entries.push(KeyReference {
            path: path_of_tag.clone(),
            heading: format!("[{path_of_tag}]"),
            is_table: false,
            kind: "a text, one of those below".to_owned(),
            choices: variants.iter().map(choice).collect(),
            unit: None,
            required: true,
            default: None,
            examples: Vec::new(),
            about: description.clone(),
            description,
            snippet: None,
            conditions: self.conditions.clone(),
        });
        for (name, schema) in variants {
            self.conditions.push((path_of_tag.clone(), (*name).to_owned()));
            self.walk_keys(schema, path, Some(tag));
            self.conditions.pop();
        }
    }

    /// The keys of a table but for its tag.
    fn walk_keys(&mut self, schema: &'a Value, path: &str, tag: Option<&str>) {
        let Some(properties) = schema["properties"].as_object() else { return };
        if self.above.iter().any(|above| std::ptr::eq(*above, schema)) {
            return;
        }
        self.above.push(schema);
        let required: Vec<_> =
            schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let keys = properties.keys().map(String::as_str);
        let mut keys: Vec<_> = keys.filter(|key| Some(*key) != tag).collect();
        keys.sort_by_key(|key| (!required.contains(key), *key));
        for key in keys {
            self.walk_key(&properties[key], &join_key_path(path, key), required.contains(&key));
        }
        self.above.pop();
    }

    fn walk_key(&mut self, property: &'a Value, path: &str, required: bool) {
        let schema = resolve_reference(self.root, property);
        let (inner, heading, inner_path) = self.innermost_schema(schema, path);
        let description =
            property["description"].as_str().or(schema["description"].as_str()).unwrap_or_default();
        let snippet = toml_snippet(description).or(inner["description"].as_str().and_then(toml_snippet));
        let description = without_snippet(description);
        let about = inner["description"].as_str().map(without_snippet);
        let listed = match allowed_texts(schema) {
            found if found.is_empty() => {
                let either = inner["anyOf"].as_array().into_iter().flatten();
                let either = either.flat_map(|schema| allowed_texts(resolve_reference(self.root, schema)));
                allowed_texts(inner).into_iter().chain(either).collect()
            }
            found => found,
        };
        let is_table = inner["properties"].is_object() || tagged_table(self.root, inner).is_some();
        let texts = |(name, about): (&str, &str)| (name.to_owned(), about.replace('\n', " "));
        let examples = property["examples"].as_array().or(schema["examples"].as_array());
        self.entries.push(KeyReference {
            path: path.to_owned(),
            heading,
            is_table,
            kind: self.describe_type(schema),
            choices: listed.into_iter().map(texts).collect(),
            unit: unit_in_description(&description),
            about: about.filter(|it| !it.is_empty()).unwrap_or_else(|| description.clone()),
            required,
            default: property
                .get("default")
                .filter(|it| **it != Value::Array(Vec::new()) && **it != json!({}))
                // The keys of a table have their own defaults.
                .filter(|_| !inner["properties"].is_object())
                .map(json_to_toml),
            examples: examples.into_iter().flatten().map(json_to_toml).collect(),
            description,
            snippet,
            conditions: self.conditions.clone(),
        });
        self.walk_table(inner, &inner_path);
    }

    /// The schema of the innermost value of a list or of a table of names, its head and its path.
    fn innermost_schema(&self, schema: &'a Value, path: &str) -> (&'a Value, String, String) {
        if schema["type"] == "array" {
            return (resolve_reference(self.root, &schema["items"]), format!("[[{path}]]"), path.to_owned());
        }
        let named = &schema["additionalProperties"];
        if named.is_object() && !schema["properties"].is_object() {
            let path = format!("{path}.NAME");
            let named = table_alternative(self.root, resolve_reference(self.root, named));
            return (named, format!("[{path}]"), path);
        }
        (schema, format!("[{path}]"), path.to_owned())
    }

    fn describe_type(&self, schema: &Value) -> String {
        let schema = resolve_reference(self.root, schema);
        if !allowed_texts(schema).is_empty() {
            return "a text, one of those below".to_owned();
        }
        let plural = |kind: &str| match kind.strip_prefix("a ").unwrap_or(kind) {
            "true or false" => "truth values".to_owned(),
            "any value" => "values".to_owned(),
            "text, one of those below" => "texts, each one of those below".to_owned(),
            kind => match kind.split_once(' ') {
                Some(("list" | "table", rest)) => {
                    format!("{}s {rest}", &kind[..kind.len() - rest.len() - 1])
                }
                _ => format!("{kind}s"),
            },
        };
        let plural = |inner: &Value| match self.describe_type(inner).split_once(" or a ") {
            Some((one, other)) => format!("{} or {}", plural(one), plural(other)),
            None => plural(&self.describe_type(inner)),
        };
        match schema["type"].as_str() {
            Some("array") => {
                let items = plural(&schema["items"]);
                match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
                    (Some(few), Some(many)) if few == many => format!("a list of {few} {items}"),
                    _ => format!("a list of {items}"),
                }
            }
            Some("object") if schema["properties"].is_object() => "a table".to_owned(),
            Some("object") => match &schema["additionalProperties"] {
                values @ Value::Object(_) => format!("a table of {} by name", plural(values)),
                _ => "a table of values by name".to_owned(),
            },
            Some(name) => schema_type_label(name).to_owned(),
            None if schema["type"].is_array() => {
                let names = schema["type"].as_array().into_iter().flatten().filter_map(Value::as_str);
                names.map(schema_type_label).collect::<Vec<_>>().join(" or ")
            }
            None if tagged_table(self.root, schema).is_some() => "a table".to_owned(),
            None if schema["anyOf"].is_array() => {
                let either = schema["anyOf"].as_array().into_iter().flatten();
                either.map(|schema| self.describe_type(schema)).collect::<Vec<_>>().join(" or ")
            }
            None => "any value".to_owned(),
        }
    }
}

fn toml_snippet(description: &str) -> Option<String> {
    let (_, rest) = description.split_once("```toml\n")?;
    Some(rest.split_once("```").map_or(rest, |(snippet, _)| snippet).trim_end().to_owned())
}

/// The description on one line per paragraph.
fn without_snippet(description: &str) -> String {
    let text = match description.split_once("```toml\n") {
        Some((before, rest)) => {
            format!("{before}{}", rest.split_once("```").map_or("", |(_, after)| after))
        }
        None => description.to_owned(),
    };
    let paragraphs = text.trim().split("\n\n").map(|it| it.trim().replace('\n', " "));
    paragraphs.collect::<Vec<_>>().join("\n\n")
}

/// A JSON value as it is written in TOML.
fn json_to_toml(value: &Value) -> String {
    match value {
        Value::Array(list) => {
            format!("[{}]", list.iter().map(json_to_toml).collect::<Vec<_>>().join(", "))
        }
        Value::Object(map) => {
            let pair = |(key, value): (&String, &Value)| {
                let bare = key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
                let key = if bare { key.clone() } else { format!("\"{key}\"") };
                format!("{key} = {}", json_to_toml(value))
            };
            match map.is_empty() {
                true => "{}".to_owned(),
                false => format!("{{ {} }}", map.iter().map(pair).collect::<Vec<_>>().join(", ")),
            }
        }
        other => other.to_string(),
    }
}
