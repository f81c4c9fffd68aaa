//! Finds numbers in messages: in protobuf by the schema that comes with them, in JSON by the names.

use mcap::Channel;
use prost_reflect::{
    DescriptorPool, DynamicMessage, FieldDescriptor, Kind, MessageDescriptor, Value,
};
use serde_json::Value as Json;

/// How messages of a channel are read.
#[derive(Debug)]
pub enum Reader {
    /// By this description.
    Protobuf(MessageDescriptor),
    /// As they are.
    Json,
}

/// A message that has been read.
#[derive(Debug)]
pub enum Message {
    /// With its description.
    Protobuf(DynamicMessage),
    /// As it is.
    Json(Json),
}

/// The way to a number in the messages of a channel.
#[derive(Debug)]
pub enum Field {
    /// Fields of messages, and indices in lists.
    Protobuf(Vec<Step>),
    /// Names with dots in between.
    Json(String),
}

/// A step on the way through a protobuf message.
#[derive(Debug)]
pub enum Step {
    /// To a field.
    Into(FieldDescriptor),
    /// To an element of a list, from 0 on.
    At(usize),
}

/// Why there is no way to a number.
#[derive(Debug, PartialEq, Eq)]
pub enum Dead {
    /// No field is called that.
    Missing,
    /// What is there is no number but this.
    Other(String),
}

/// Messages in messages are listed down to this depth: a message may contain its own kind.
const DEEPEST: usize = 5;

impl Reader {
    /// Nothing for encodings that cannot be read.
    ///
    /// # Errors
    /// With what is wrong with the channel's schema.
    pub fn new(channel: &Channel) -> Result<Option<Self>, String> {
        match channel.message_encoding.as_str() {
            "json" => Ok(Some(Reader::Json)),
            "protobuf" => {
                let schema = channel.schema.as_ref().ok_or("it has no schema")?;
                let pool = DescriptorPool::decode(&*schema.data);
                let pool = pool.map_err(|error| format!("its schema cannot be read: {error}"))?;
                let message = pool.get_message_by_name(&schema.name);
                let missing = || format!("its schema has no message `{}`", schema.name);
                Ok(Some(Reader::Protobuf(message.ok_or_else(missing)?)))
            }
            _ => Ok(None),
        }
    }

    /// The way to a number, as far as one can tell without a message.
    pub fn find(&self, path: &str) -> Result<Field, Dead> {
        match self {
            Reader::Json => Ok(Field::Json(path.to_owned())),
            Reader::Protobuf(message) => way(message, path).map(Field::Protobuf),
        }
    }

    /// Reads a message.
    ///
    /// # Errors
    /// With what is wrong with it.
    pub fn read(&self, data: &[u8]) -> Result<Message, String> {
        match self {
            Reader::Protobuf(kind) => DynamicMessage::decode(kind.clone(), data)
                .map(Message::Protobuf)
                .map_err(|error| format!("it does not fit its schema: {error}")),
            Reader::Json => serde_json::from_slice(data)
                .map(Message::Json)
                .map_err(|error| format!("it is no JSON: {error}")),
        }
    }

    /// The numbers of a message by their paths; without a message those that the schema promises.
    pub fn list(&self, message: Option<&Message>) -> Vec<String> {
        let mut paths = Vec::new();
        match (self, message) {
            (Reader::Protobuf(kind), _) => list(kind, "", DEEPEST, &mut paths),
            (Reader::Json, Some(Message::Json(json))) => list_json(json, "", &mut paths),
            (Reader::Json, _) => {}
        }
        paths
    }
}

fn way(message: &MessageDescriptor, path: &str) -> Result<Vec<Step>, Dead> {
    let (mut steps, mut message) = (Vec::new(), Some(message.clone()));
    let mut names = path.split('.').peekable();
    while let Some(name) = names.next() {
        let found = message.as_ref().and_then(|message| message.get_field_by_name(name));
        let field = found.ok_or(Dead::Missing)?;
        let kind = field.kind();
        let list = field.is_list();
        if field.is_map() {
            return Err(Dead::Other("a map".to_owned()));
        }
        steps.push(Step::Into(field));
        if list {
            let place = names
                .next()
                .ok_or_else(|| Dead::Other("a list: add an index, as in `.0`".to_owned()))?;
            steps.push(Step::At(place.parse().map_err(|_| Dead::Missing)?));
        }
        let last = names.peek().is_none();
        message = match kind {
            Kind::Message(_) if last => return Err(Dead::Other("a message".to_owned())),
            Kind::Message(message) => Some(message),
            Kind::String if last => return Err(Dead::Other("a string".to_owned())),
            Kind::Bytes if last => return Err(Dead::Other("bytes".to_owned())),
            _ => None,
        };
    }
    Ok(steps)
}

fn list(message: &MessageDescriptor, prefix: &str, depth: usize, paths: &mut Vec<String>) {
    for field in message.fields().filter(|field| !field.is_map()) {
        let place = if field.is_list() { ".0" } else { "" };
        let path = format!("{prefix}{}{place}", field.name());
        match field.kind() {
            Kind::String | Kind::Bytes => {}
            Kind::Message(message) if depth > 0 => {
                list(&message, &format!("{path}."), depth - 1, paths);
            }
            Kind::Message(_) => {}
            _ => paths.push(path),
        }
    }
}

fn list_json(json: &Json, path: &str, paths: &mut Vec<String>) {
    let under = |name: &str| match path {
        "" => name.to_owned(),
        path => format!("{path}.{name}"),
    };
    match json {
        Json::Object(fields) => {
            fields.iter().for_each(|(name, json)| list_json(json, &under(name), paths));
        }
        Json::Array(list) => {
            let places = list.iter().enumerate();
            places.for_each(|(place, json)| list_json(json, &under(&place.to_string()), paths));
        }
        Json::Number(_) | Json::Bool(_) => paths.push(path.to_owned()),
        Json::Null | Json::String(_) => {}
    }
}

impl Field {
    /// The number in a message; whole numbers above 2^53 are rounded, and `null` is NaN.
    ///
    /// # Errors
    /// When there is none.
    pub fn number(&self, message: &Message) -> Result<f64, Dead> {
        match (self, message) {
            (Field::Protobuf(steps), Message::Protobuf(message)) => field(message, steps),
            (Field::Json(path), Message::Json(json)) => json_number(json, path),
            _ => Err(Dead::Missing),
        }
    }
}

fn field(message: &DynamicMessage, steps: &[Step]) -> Result<f64, Dead> {
    let [Step::Into(field), rest @ ..] = steps else { return Err(Dead::Missing) };
    if field.supports_presence() && !message.has_field(field) {
        return Err(Dead::Missing);
    }
    number(&message.get_field(field), rest)
}

fn number(value: &Value, steps: &[Step]) -> Result<f64, Dead> {
    Ok(match (value, steps) {
        (Value::Message(message), _) => return field(message, steps),
        (Value::List(list), [Step::At(place), rest @ ..]) => {
            return number(list.get(*place).ok_or(Dead::Missing)?, rest);
        }
        (Value::F64(value), _) => *value,
        (Value::F32(value), _) => f64::from(*value),
        (Value::I32(value) | Value::EnumNumber(value), _) => f64::from(*value),
        (Value::U32(value), _) => f64::from(*value),
        (Value::I64(value), _) => *value as f64,
        (Value::U64(value), _) => *value as f64,
        (Value::Bool(value), _) => f64::from(u8::from(*value)),
        _ => return Err(Dead::Missing),
    })
}

fn json_number(json: &Json, path: &str) -> Result<f64, Dead> {
    match place(json, path).ok_or(Dead::Missing)? {
        Json::Number(number) => number.as_f64().ok_or(Dead::Missing),
        Json::Bool(value) => Ok(f64::from(u8::from(*value))),
        Json::Null => Ok(f64::NAN),
        Json::String(_) => Err(Dead::Other("a string".to_owned())),
        Json::Array(_) => Err(Dead::Other("a list: add an index, as in `.0`".to_owned())),
        Json::Object(_) => Err(Dead::Other("an object".to_owned())),
    }
}

/// What stands at a path; names may have dots themselves.
fn place<'a>(json: &'a Json, path: &str) -> Option<&'a Json> {
    let child = |name: &str| match json {
        Json::Object(fields) => fields.get(name),
        Json::Array(list) => list.get(name.parse::<usize>().ok()?),
        _ => None,
    };
    let inner = || {
        path.match_indices('.').find_map(|(dot, _)| place(child(&path[..dot])?, &path[dot + 1..]))
    };
    child(path).or_else(inner)
}
