//! Reads a message in JSON as a tree that borrows its texts and keeps the order of its fields.

use std::borrow::Cow;
use std::cell::Cell;
use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};

/// A value of a message.
#[derive(Debug, PartialEq)]
pub enum JsonNode<'d> {
    Null,
    Bool(bool),
    Integer(i128),
    Real(f64),
    Text(Cow<'d, str>),
    List(Vec<JsonNode<'d>>),
    Object(Vec<(Cow<'d, str>, JsonNode<'d>)>),
}

/// The way to a value: names with dots in between. Names may have dots themselves.
#[derive(Debug)]
pub struct JsonPath {
    path: String,
    /// The length of the first name and its place among the fields, as they were last: messages of a channel are alike.
    first: Cell<(usize, usize)>,
}

impl JsonPath {
    pub fn new(path: &str) -> Self {
        Self { path: path.to_owned(), first: Cell::new((path.len(), 0)) }
    }

    /// What stands there.
    pub fn find_in<'n, 'd>(&self, node: &'n JsonNode<'d>) -> Option<&'n JsonNode<'d>> {
        let JsonNode::Object(fields) = node else { return node.descend(&self.path) };
        let below = |length: usize, place: usize| {
            let (_, value) = fields.get(place).filter(|(name, _)| *name == self.path[..length])?;
            if length == self.path.len() { Some(value) } else { value.descend(&self.path[length + 1..]) }
        };
        let (length, place) = self.first.get();
        below(length, place).or_else(|| {
            let dots = self.path.match_indices('.').map(|(dot, _)| dot);
            std::iter::once(self.path.len()).chain(dots).find_map(|length| {
                let place = fields.iter().rposition(|(name, _)| *name == self.path[..length])?;
                below(length, place).inspect(|_| self.first.set((length, place)))
            })
        })
    }
}

impl<'d> JsonNode<'d> {
    /// The element of a list, or the field of an object: of several of one name the last.
    fn child(&self, name: &str) -> Option<&JsonNode<'d>> {
        match self {
            JsonNode::Object(fields) => fields.iter().rfind(|(it, _)| it == name).map(|(_, value)| value),
            JsonNode::List(list) => list.get(name.parse::<usize>().ok()?),
            _ => None,
        }
    }

    fn descend(&self, path: &str) -> Option<&JsonNode<'d>> {
        let inner = || {
            let mut dots = path.match_indices('.');
            dots.find_map(|(dot, _)| self.child(&path[..dot])?.descend(&path[dot + 1..]))
        };
        self.child(path).or_else(inner)
    }

    /// Appends the paths of all numbers, those of an object by their names.
    pub fn list_numbers(&self, path: &str, paths: &mut Vec<String>) {
        let under = |name: &str| match path {
            "" => name.to_owned(),
            path => format!("{path}.{name}"),
        };
        match self {
            JsonNode::Object(fields) => {
                let mut names: Vec<&str> = fields.iter().map(|(name, _)| name.as_ref()).collect();
                names.sort_unstable();
                names.dedup();
                for name in names {
                    if let Some(value) = self.child(name) {
                        value.list_numbers(&under(name), paths);
                    }
                }
            }
            JsonNode::List(list) => {
                let places = list.iter().enumerate();
                places.for_each(|(place, value)| value.list_numbers(&under(&place.to_string()), paths));
            }
            JsonNode::Integer(_) | JsonNode::Real(_) | JsonNode::Bool(_) => paths.push(path.to_owned()),
            JsonNode::Null | JsonNode::Text(_) => {}
        }
    }
}

impl<'de> Deserialize<'de> for JsonNode<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(JsonNodeVisitor)
    }
}

struct JsonNodeVisitor;

impl<'de> Visitor<'de> for JsonNodeVisitor {
    type Value = JsonNode<'de>;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a JSON value")
    }

    fn visit_unit<E: Error>(self) -> Result<Self::Value, E> {
        Ok(JsonNode::Null)
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Self::Value, E> {
        Ok(JsonNode::Bool(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        Ok(JsonNode::Integer(value.into()))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Self::Value, E> {
        Ok(JsonNode::Integer(value.into()))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        Ok(JsonNode::Real(value))
    }

    fn visit_borrowed_str<E: Error>(self, text: &'de str) -> Result<Self::Value, E> {
        Ok(JsonNode::Text(Cow::Borrowed(text)))
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
        Ok(JsonNode::Text(Cow::Owned(text.to_owned())))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<Self::Value, A::Error> {
        let mut list = Vec::new();
        while let Some(element) = elements.next_element()? {
            list.push(element);
        }
        Ok(JsonNode::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
        let mut fields = Vec::new();
        while let Some(name) = entries.next_key()? {
            let JsonNode::Text(name) = name else { return Err(A::Error::custom("a name that is no text")) };
            fields.push((name, entries.next_value()?));
        }
        Ok(JsonNode::Object(fields))
    }
}

#[cfg(test)]
mod tests {
    use super::{JsonNode, JsonPath};

    fn parse(text: &str) -> JsonNode<'_> {
        serde_json::from_str(text).expect("JSON")
    }

    #[test]
    fn values_are_found_by_names_with_and_without_dots_wherever_they_stand() {
        let first = r#"{"b": {"c.d": [1, {"e": -2.5}]}, "a": true, "t": "\u00e4", "n": null}"#;
        let second = r#"{"a": 18446744073709551615, "b": {"c.d": []}, "a": 7}"#;
        let (deep, flat) = (JsonPath::new("b.c.d.1.e"), JsonPath::new("a"));
        assert_eq!(deep.find_in(&parse(first)), Some(&JsonNode::Real(-2.5)));
        assert_eq!(flat.find_in(&parse(first)), Some(&JsonNode::Bool(true)));
        assert_eq!(JsonPath::new("t").find_in(&parse(first)), Some(&JsonNode::Text("ä".into())));
        assert_eq!(deep.find_in(&parse(second)), None);
        // The last of two fields of one name.
        assert_eq!(flat.find_in(&parse(second)), Some(&JsonNode::Integer(7)));
        assert_eq!(flat.find_in(&parse("[1]")), None);
        let mut paths = Vec::new();
        parse(first).list_numbers("", &mut paths);
        assert_eq!(paths, ["a", "b.c.d.0", "b.c.d.1.e"]);
    }
}
