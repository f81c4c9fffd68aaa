//! Validates TOML tables against JSON schemas, with the span of each violation.

use std::ops::Range;

use diagnostics::suggest::{self, UnknownName};
use serde_json::{Map, Value, json};
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

/// A word that breaks the schema.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SchemaViolation {
    /// Its span.
    pub span: Range<usize>,
    /// The unknown name, when it is one, and the names that are known in its place.
    pub unknown: Option<(String, Vec<String>)>,
    /// The message.
    pub message: String,
    /// A remedy.
    pub help: Option<String>,
}

/// The schema with its keys sorted and without `null`, which TOML does not have.
#[must_use]
pub fn normalize_schema(schema: &Value) -> Value {
    without_null(schema)
}

fn without_null(value: &Value) -> Value {
    match value {
        Value::Array(list) => list.iter().map(without_null).collect(),
        Value::Object(map) => Value::Object(object_without_null(map)),
        other => other.clone(),
    }
}

fn object_without_null(map: &Map<String, Value>) -> Map<String, Value> {
    let is_null = |value: &Value| value["type"] == "null";
    let mut keys: Vec<_> = map.keys().collect();
    keys.sort();
    let mut plain = Map::new();
    for key in keys {
        let value = &map[key];
        match (key.as_str(), value) {
            ("type", Value::Array(types)) => {
                let types: Vec<_> = types.iter().filter(|it| *it != "null").cloned().collect();
                let one = (types.len() == 1).then(|| types[0].clone());
                plain.insert(key.clone(), one.unwrap_or(Value::Array(types)));
            }
            ("anyOf", Value::Array(list)) if list.len() == 2 && list.iter().any(is_null) => {
                let other = list.iter().find(|it| !is_null(it)).map(without_null);
                if let Some(Value::Object(other)) = other {
                    plain.extend(other);
                }
            }
            ("default", Value::Null) => {}
            _ => drop(plain.insert(key.clone(), without_null(value))),
        }
    }
    let mut sorted: Vec<_> = plain.into_iter().collect();
    sorted.sort_by(|a, b| a.0.cmp(&b.0));
    sorted.into_iter().collect()
}

/// A schema that may be a reference into the definitions of `root`.
#[must_use]
pub fn resolve_reference<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    let name = schema["$ref"].as_str().and_then(|it| it.strip_prefix("#/$defs/"));
    name.and_then(|name| root["$defs"].get(name)).unwrap_or(schema)
}

/// The table among the alternatives of a schema, such as a text or a table; the schema itself without alternatives.
#[must_use]
pub fn table_alternative<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    let either = schema["anyOf"].as_array().into_iter().flatten();
    let mut tables = either.map(|it| resolve_reference(root, it)).filter(|it| it["properties"].is_object());
    tables.next().unwrap_or(schema)
}

/// The texts that a schema allows, with their descriptions; none when it allows any.
#[must_use]
pub fn allowed_texts(schema: &Value) -> Vec<(&str, &str)> {
    let listed = schema["enum"].as_array().into_iter().flatten();
    let listed = listed.filter_map(|it| Some((it.as_str()?, "")));
    let described = schema["oneOf"].as_array().into_iter().flatten().flat_map(|it| {
        let several = it["enum"].as_array().into_iter().flatten();
        let names = it["const"].as_str().into_iter().chain(several.filter_map(Value::as_str));
        names.map(|name| (name, it["description"].as_str().unwrap_or_default()))
    });
    listed.chain(described).collect()
}

/// A table whose other keys depend on the text of one of them, its tag.
#[derive(Debug, Clone, PartialEq)]
pub struct TaggedTable<'a> {
    /// The tag.
    pub tag: &'a str,
    /// The texts of the tag, each with the schema of the table.
    pub variants: Vec<(&'a str, &'a Value)>,
}

/// The variants of a tagged table; `None` for any other schema.
#[must_use]
pub fn tagged_table<'a>(root: &'a Value, schema: &'a Value) -> Option<TaggedTable<'a>> {
    let variants: Vec<_> =
        schema["oneOf"].as_array()?.iter().map(|variant| resolve_reference(root, variant)).collect();
    let first = variants.first()?["properties"].as_object()?;
    let text = |variant: &'a Value, tag: &str| variant["properties"][tag]["const"].as_str();
    let (tag, _) = first.iter().find(|(_, property)| property["const"].is_string())?;
    let variants = variants.into_iter().map(|variant| Some((text(variant, tag)?, variant)));
    Some(TaggedTable { tag, variants: variants.collect::<Option<_>>()? })
}

/// The unit of the numbers of a key: the one in brackets in its description.
pub(crate) fn stated_unit(property: &Value) -> Option<String> {
    // A snippet of TOML has brackets of its own.
    let description = property["description"].as_str()?.split("```").next()?;
    unit_in_description(description)
}

/// Whether the numbers of a key have the unit that stands beside it, under `unit`, or in the table around that.
pub(crate) fn takes_unit_of_table(property: &Value) -> bool {
    property["x-unit"] == "of the table"
}

/// The first unit in brackets that is not code.
pub(crate) fn unit_in_description(description: &str) -> Option<String> {
    let text: String = description.split('`').step_by(2).collect();
    let mut rest = text.as_str();
    while let Some(begin) = rest.find(" [") {
        rest = &rest[begin + 2..];
        let end = rest.find(']')?;
        if end > 0 && !rest[..end].contains([' ', '[', '.', ',']) {
            return Some(rest[..end].to_owned());
        }
    }
    None
}

/// The words of a table that break a schema, in the order of the file.
#[must_use]
pub fn validate_table(schema: &Value, span: Range<usize>, table: &DeTable) -> Vec<SchemaViolation> {
    let mut validator = SchemaValidator { root: schema, path: Vec::new(), violations: Vec::new() };
    validator.check_table(schema, span, table);
    validator.violations.sort_by_key(|finding| finding.span.start);
    validator.violations
}

struct SchemaValidator<'a> {
    root: &'a Value,
    /// The keys that lead to the value at hand.
    path: Vec<String>,
    violations: Vec<SchemaViolation>,
}

impl SchemaValidator<'_> {
    fn check_table(&mut self, schema: &Value, span: Range<usize>, table: &DeTable) {
        if let Some(TaggedTable { tag, variants }) = tagged_table(self.root, schema) {
            return self.check_tagged_table(tag, &variants, span, table);
        }
        let Some(properties) = schema["properties"].as_object() else {
            let others = &schema["additionalProperties"];
            return table.values().for_each(|value| self.check_value(others, value));
        };
        let closed = schema["additionalProperties"] == false;
        let mut misspelt = Vec::new();
        for (key, value) in table {
            let name = key.get_ref().as_ref();
            match properties.get(name) {
                Some(schema) => {
                    self.path.push(name.to_owned());
                    self.check_value(schema, value);
                    self.path.pop();
                }
                None if closed => {
                    misspelt.extend(suggest::closest_name(name, properties.keys().map(String::as_str)));
                    self.report_unknown_name("key", name, properties.keys().cloned().collect(), key.span());
                }
                None => self.check_value(&schema["additionalProperties"], value),
            }
        }
        for key in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            // A misspelt key is not missing, too.
            if !table.contains_key(key) && !misspelt.contains(&key) {
                self.report_missing_key(key, &properties[key], span.clone());
            }
        }
    }

    fn check_tagged_table(
        &mut self,
        tag: &str,
        variants: &[(&str, &Value)],
        span: Range<usize>,
        table: &DeTable,
    ) {
        let Some(value) = table.get(tag) else {
            let misspelt = |key: &&Spanned<DeString>| suggest::closest_name(key.get_ref(), [tag]).is_some();
            return match table.keys().find(misspelt) {
                Some(key) => self.report_unknown_name("key", key.get_ref(), vec![tag.to_owned()], key.span()),
                None => self.report_missing_key(tag, &Value::Null, span),
            };
        };
        let Some(text) = value.get_ref().as_str() else {
            return self.check_value(&json!({ "type": "string" }), value);
        };
        match variants.iter().find(|(known, _)| *known == text) {
            Some((_, schema)) => self.check_table(schema, span, table),
            None => {
                let known = variants.iter().map(|(known, _)| (*known).to_owned()).collect();
                self.report_unknown_name("value", text, known, value.span());
            }
        }
    }

    fn check_value(&mut self, schema: &Value, value: &Spanned<DeValue>) {
        let schema = resolve_reference(self.root, schema);
        let choices = allowed_texts(schema);
        let types = match &schema["type"] {
            Value::Array(types) => types.iter().filter_map(Value::as_str).collect(),
            one => one.as_str().map_or(Vec::new(), |one| vec![one]),
        };
        match (value.get_ref(), types.first().copied()) {
            (DeValue::String(text), _) if !choices.is_empty() => {
                let known: Vec<_> = choices.iter().map(|(name, _)| (*name).to_owned()).collect();
                if !known.iter().any(|name| name == text) {
                    self.report_unknown_name("value", text, known, value.span());
                }
            }
            (DeValue::Table(_), Some("array")) if is_list_of_tables(self.root, schema) => {
                let name = self.path.join(".");
                self.violations.push(SchemaViolation {
                    span: value.span(),
                    unknown: None,
                    message: format!("`{name}` is a list of tables, found one table: write [[{name}]]"),
                    help: None,
                });
            }
            (DeValue::Table(table), None | Some("object")) => {
                self.check_table(table_alternative(self.root, schema), value.span(), table);
            }
            (DeValue::Array(list), None | Some("array")) => {
                self.check_list_length(schema, list.len(), value.span());
                list.iter().for_each(|value| self.check_value(&schema["items"], value));
            }
            (found, Some(_)) if !types.iter().any(|it| has_schema_type(found, it)) => {
                let expected: Vec<_> = types.iter().map(|it| schema_type_label(it)).collect();
                let help = example_table(schema).map(|example| format!("such as {example}"));
                self.violations.push(SchemaViolation {
                    span: value.span(),
                    unknown: None,
                    message: format!("expected {}, found {}", expected.join(" or "), toml_type_label(found)),
                    help: help.or_else(|| number_help(found, &types)),
                })
            }
            _ => {}
        }
    }

    /// A list that has to have as many entries as a point has coordinates.
    fn check_list_length(&mut self, schema: &Value, found: usize, span: Range<usize>) {
        let [least, most] = ["minItems", "maxItems"].map(|key| schema[key].as_u64());
        let Some(expected) = least.filter(|least| Some(*least) == most && *least != found as u64) else {
            return;
        };
        let message = format!("expected a list of {expected}, found one of {found}");
        self.violations.push(SchemaViolation { span, unknown: None, message, help: None });
    }

    fn report_unknown_name(&mut self, kind: &str, name: &str, known: Vec<String>, span: Range<usize>) {
        let UnknownName { message, help, .. } =
            suggest::unknown_name(kind, name, known.iter().map(String::as_str));
        let unknown = Some((name.to_owned(), known));
        self.violations.push(SchemaViolation { span, unknown, message, help });
    }

    fn report_missing_key(&mut self, key: &str, schema: &Value, span: Range<usize>) {
        let description = schema["description"].as_str();
        let description =
            description.or(resolve_reference(self.root, schema)["description"].as_str()).unwrap_or_default();
        let first = description.split("\n\n").next().unwrap_or_default().replace('\n', " ");
        let help = (!first.is_empty()).then(|| format!("`{key}`: {first}"));
        let message = format!("the key `{key}` is missing");
        self.violations.push(SchemaViolation { span, unknown: None, message, help });
    }
}

/// Whether a list has tables as its entries, so that `[[name]]` begins one.
fn is_list_of_tables(root: &Value, schema: &Value) -> bool {
    let items = resolve_reference(root, &schema["items"]);
    table_alternative(root, items)["properties"].is_object() || tagged_table(root, items).is_some()
}

/// Whether the keys lead to a list of tables.
pub(crate) fn is_list_of_tables_at(root: &Value, keys: &[&str]) -> bool {
    let property = keys.iter().fold(root, |schema, key| {
        let entry = match &schema["items"] {
            Value::Null => schema,
            items => resolve_reference(root, items),
        };
        resolve_reference(root, &entry["properties"][*key])
    });
    is_list_of_tables(root, property)
}

/// The remedy for a text where a number is expected.
fn number_help(found: &DeValue, types: &[&str]) -> Option<String> {
    let text = found.as_str().filter(|_| types.contains(&"number"))?;
    match suggest::number_with_point(text) {
        Some(number) => Some(format!("a number has a decimal point: {number}")),
        None if text.trim().parse::<f64>().is_ok() => Some(format!("leave the quotes out: {}", text.trim())),
        None => text
            .starts_with(|c: char| c.is_ascii_digit())
            .then(|| "this key states no unit: write the number alone".to_owned()),
    }
}

/// A table with the keys that a schema requires, as it could be written; none for another schema, or without examples.
fn example_table(schema: &Value) -> Option<String> {
    let required = schema["required"].as_array().filter(|keys| !keys.is_empty())?;
    let keys = required.iter().filter_map(Value::as_str);
    let pair = |key: &str| {
        let example = schema["properties"][key]["examples"].get(0)?;
        // JSON writes texts, numbers and lists of them as TOML does.
        (!example.is_object()).then(|| format!("{key} = {example}"))
    };
    let pairs: Vec<_> = keys.map(pair).collect::<Option<_>>()?;
    Some(format!("{{ {} }}", pairs.join(", ")))
}

fn has_schema_type(found: &DeValue, expected: &str) -> bool {
    match found {
        DeValue::String(_) => expected == "string",
        DeValue::Integer(_) => matches!(expected, "integer" | "number"),
        DeValue::Float(_) => expected == "number",
        DeValue::Boolean(_) => expected == "boolean",
        DeValue::Datetime(_) => false,
        DeValue::Array(_) => expected == "array",
        DeValue::Table(_) => expected == "object",
    }
}

/// The name of a type of JSON schema in messages and in the reference.
#[must_use]
pub fn schema_type_label(name: &str) -> &str {
    match name {
        "string" => "a text",
        "integer" => "a whole number",
        "number" => "a number",
        "boolean" => "true or false",
        "array" => "a list",
        "object" => "a table",
        other => other,
    }
}

/// The name of a value's type in messages.
#[must_use]
pub fn toml_type_label(found: &DeValue) -> &'static str {
    match found {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_break_a_schema_are_found_at_their_places() {
        let schema = schema();
        for (text, at, message, help) in CASES {
            let table = DeTable::parse(text).expect(text);
            let found = validate_table(&schema, 0..0, table.get_ref());
            if message.is_empty() {
                assert_eq!(found, [], "{text}");
                continue;
            }
            let missing = found.iter().any(|it| it.message.contains("missing"));
            assert_eq!(missing, message.contains("missing"), "{text}: {found:?}");
            let found = found.iter().find(|it| it.message == *message).expect(text);
            assert_eq!((&text[found.span.clone()], found.help.as_deref()), (*at, *help), "{text}");
        }
    }

    fn schema() -> Value {
        serde_json::json!({
            "type": "object", "additionalProperties": false, "required": ["step"],
            "properties": {
                "step": {"type": "number", "description": "Step [s].\n\nMore."},
                "kind": {"oneOf": [{"const": "left"}, {"const": "right"}]},
                "list": {"type": "array", "items": {"$ref": "#/$defs/Entry"}},
                "curves": {"type": "array", "items": {"$ref": "#/$defs/Curve"}},
                "pair": {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2},
                "names": {"type": "object", "additionalProperties": {"type": "string"}},
                "loss": {"oneOf": [
                    {"type": "object", "additionalProperties": false, "properties": {"kind": {"const": "square"}}},
                    {
                        "type": "object", "additionalProperties": false,
                        "properties": {"kind": {"const": "huber"}, "threshold": {"type": "number"}},
                    },
                ]},
            },
            "$defs": {"Curve": {
                "type": "object", "additionalProperties": false, "required": ["signal"],
                "properties": {"signal": {"type": "string", "examples": ["plant.v_x"]}},
            }, "Entry": {
                "type": "object", "additionalProperties": false,
                "properties": {"on": {"type": "boolean"}},
            }},
        })
    }

    /// A text, the span of the mistake in it, the message and the help; no message when nothing is wrong.
    type Case = (&'static str, &'static str, &'static str, Option<&'static str>);

    const CASES: &[Case] = &[
        ("step = 1\nlist = [{ on = true }]\nkind = 'left'\nnames = { a = 'b' }", "", "", None),
        ("stpe = 1", "stpe", "unknown key `stpe`", Some("did you mean `step`?")),
        ("kind = 'left'", "", "the key `step` is missing", Some("`step`: Step [s].")),
        ("step = 'a'", "'a'", "expected a number, found a text", None),
        ("step = 1\nkind = 'rihgt'", "'rihgt'", "unknown value `rihgt`", Some("did you mean `right`?")),
        ("step = 1\npair = [1]", "[1]", "expected a list of 2, found one of 1", None),
        ("step = 1\npair = [1, 2]", "", "", None),
        ("step = 1\nloss = { knd = 'huber' }", "knd", "unknown key `knd`", Some("did you mean `kind`?")),
        (
            "step = 1\ncurves = ['plant.v_x']",
            "'plant.v_x'",
            "expected a table, found a text",
            Some("such as { signal = \"plant.v_x\" }"),
        ),
        ("step = 1\nlist = [{ off = 1 }]", "off", "unknown key `off`", Some("known: on")),
        ("step = 1\nlist = [{ on = 1 }]", "1", "expected true or false, found a whole number", None),
        ("step = 1\nloss = { kind = 'huber', threshold = 1 }", "", "", None),
        (
            "step = 1\nloss = { kind = 'square', threshold = 1 }",
            "threshold",
            "unknown key `threshold`",
            Some("known: kind"),
        ),
        (
            "step = 1\nloss = { kind = 'hubr' }",
            "'hubr'",
            "unknown value `hubr`",
            Some("did you mean `huber`?"),
        ),
        ("step = 1\nloss = { threshold = 1 }", "{ threshold = 1 }", "the key `kind` is missing", None),
        ("step = 1\nnames = { a = 1 }", "1", "expected a text, found a whole number", None),
    ];
}
