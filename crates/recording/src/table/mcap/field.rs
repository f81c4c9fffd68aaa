//! Finds values in messages: in protobuf and messages of ROS by the schema that comes with them, in JSON by the names.

use mcap::Channel;
use prost_reflect::{
    DescriptorPool, DynamicMessage, FieldDescriptor, Kind, MessageDescriptor, Value,
};
use ros_bag::{Definition, Encoding, Language, Listing, NoWay, Way};
use serde_json::Value as Json;

pub use crate::table::logged::Cell;

/// How messages of a channel are read.
#[derive(Debug)]
pub enum Reader {
    /// By this description.
    Protobuf(MessageDescriptor),
    /// As they are.
    Json,
    /// By this definition of ROS.
    Ros(Box<Definition>, Encoding),
}

/// A message that has been read.
#[derive(Debug)]
pub enum Message {
    /// With its description.
    Protobuf(DynamicMessage),
    /// As it is.
    Json(Json),
    /// As a tree of values.
    Ros(ros_bag::Value),
}

/// A row of a message: most messages are one.
#[derive(Debug)]
pub struct Row<'m> {
    /// What tells it from other rows, where a message has several.
    pub key: Option<&'m str>,
    /// The time at which it was measured, where it says so [ns].
    pub stamp: Option<i128>,
    content: Content<'m>,
}

#[derive(Debug)]
enum Content<'m> {
    Protobuf(&'m DynamicMessage),
    Json(&'m Json),
    Ros(&'m ros_bag::Value),
}

/// The way to a number in the messages of a channel.
#[derive(Debug)]
pub enum Field {
    /// Fields of messages, and indices in lists.
    Protobuf(Vec<Step>),
    /// Names with dots in between.
    Json(String),
    /// Fields of structures, and indices in lists.
    Ros(Way),
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
            encoding => match Encoding::of(encoding) {
                Some(encoding) => Ok(Some(ros(channel, encoding)?)),
                None => Ok(None),
            },
        }
    }

    /// The way to a value, as far as one can tell without a message.
    pub fn find(&self, path: &str) -> Result<Field, Dead> {
        match self {
            Reader::Json => Ok(Field::Json(path.to_owned())),
            Reader::Protobuf(message) => way(message, path).map(Field::Protobuf),
            Reader::Ros(definition, _) => match definition.find(path) {
                Ok(way) => Ok(Field::Ros(way)),
                Err(NoWay::Missing) => Err(Dead::Missing),
                Err(NoWay::Other(found)) => Err(Dead::Other(found)),
            },
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
            Reader::Ros(definition, encoding) => {
                definition.read(*encoding, &ros_bag::unpacked(data)?).map(Message::Ros)
            }
        }
    }

    /// The rows of a message.
    pub fn rows<'m>(&self, message: &'m Message) -> Vec<Row<'m>> {
        let one = |content| vec![Row { key: None, stamp: None, content }];
        match (self, message) {
            (_, Message::Protobuf(message)) => one(Content::Protobuf(message)),
            (_, Message::Json(json)) => one(Content::Json(json)),
            (Reader::Ros(definition, _), Message::Ros(value)) => {
                let rows = definition.rows(value).into_iter();
                let row = |row: ros_bag::Row<'m>| {
                    let stamp = definition.stamp(&row);
                    Row { key: row.key, stamp, content: Content::Ros(row.value) }
                };
                rows.map(row).collect()
            }
            (_, Message::Ros(value)) => one(Content::Ros(value)),
        }
    }

    /// Whether messages say when they were measured.
    pub fn has_stamp(&self) -> bool {
        matches!(self, Reader::Ros(definition, _) if definition.has_stamp())
    }

    /// The unit of a field, where the type of the message tells.
    pub fn unit(&self, field: &Field) -> Option<&'static str> {
        match (self, field) {
            (Reader::Ros(definition, _), Field::Ros(way)) => definition.unit(way),
            _ => None,
        }
    }

    /// What a row of a message of ROS has; without one what the definition promises.
    pub fn listing(&self, row: Option<&Row>) -> Option<Listing> {
        let Reader::Ros(definition, _) = self else { return None };
        let row = row.and_then(|row| match row.content {
            Content::Ros(value) => Some(ros_bag::Row { key: row.key, value }),
            _ => None,
        });
        Some(definition.list(row.as_ref()))
    }

    /// The numbers of a message by their paths, of ROS its texts, too; without a message those that the schema promises.
    pub fn list(&self, message: Option<&Message>) -> Vec<String> {
        let mut paths = Vec::new();
        match (self, message) {
            (Reader::Protobuf(kind), _) => list(kind, "", DEEPEST, &mut paths),
            (Reader::Json, Some(Message::Json(json))) => list_json(json, "", &mut paths),
            (Reader::Json, _) => {}
            (Reader::Ros(..), message) => {
                let rows = message.map_or_else(Vec::new, |message| self.rows(message));
                let listings = match rows.is_empty() {
                    true => vec![self.listing(None)],
                    false => rows.iter().map(|row| self.listing(Some(row))).collect(),
                };
                let leaves = listings.into_iter().flatten().flat_map(|it| it.leaves);
                paths.extend(leaves.map(|leaf| leaf.path));
            }
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

impl Row<'_> {
    /// The length of a list of ROS.
    pub fn length(&self, way: &[usize]) -> Option<usize> {
        let Content::Ros(value) = self.content else { return None };
        match value.get(way)? {
            ros_bag::Value::List(list) => Some(list.len()),
            ros_bag::Value::Long(count) => Some(*count),
            _ => None,
        }
    }
}

impl Field {
    /// What tells the row of this field from others.
    pub fn key(&self) -> Option<&str> {
        match self {
            Field::Ros(way) => way.key.as_deref(),
            _ => None,
        }
    }

    /// The value in a row; `null` is NaN.
    ///
    /// # Errors
    /// When there is none.
    pub fn value(&self, row: &Row) -> Result<Cell, Dead> {
        match (self, &row.content) {
            (Field::Protobuf(steps), Content::Protobuf(message)) => field(message, steps),
            (Field::Json(path), Content::Json(json)) => json_value(json, path),
            (Field::Ros(way), Content::Ros(value)) => ros_value(value, &way.steps),
            _ => Err(Dead::Missing),
        }
    }
}

/// How messages of ROS are read; a bag without definitions has those that are known here.
fn ros(channel: &Channel, encoding: Encoding) -> Result<Reader, String> {
    let schema = channel.schema.as_ref().ok_or("it has no schema")?;
    if schema.data.is_empty() && schema.encoding.is_empty() {
        let known = Definition::known(&schema.name).map_err(|_| {
            format!(
                "the bag has no definition of `{}`, as those of releases before ROS 2 Iron, and it is not one of the usual \
                 messages; `ros2 bag convert` makes a bag with definitions where the package of that message is installed",
                schema.name
            )
        });
        return Ok(Reader::Ros(Box::new(known?), encoding));
    }
    let language = Language::of(&schema.encoding).ok_or_else(|| {
        format!(
            "expected a schema in ros2msg, ros2idl or ros1msg, found one in `{}`",
            schema.encoding
        )
    })?;
    let text = String::from_utf8_lossy(&schema.data);
    let definition = Definition::new(&schema.name, language, &text).map_err(|error| {
        match schema.name.contains("/srv/") || schema.name.contains("/action/") {
            true => "it is of a service or an action, not of a topic".to_owned(),
            false => format!("its schema cannot be read: {error}"),
        }
    })?;
    Ok(Reader::Ros(Box::new(definition), encoding))
}

fn ros_value(value: &ros_bag::Value, steps: &[usize]) -> Result<Cell, Dead> {
    use ros_bag::Value;
    for length in 0..steps.len() {
        if let Some(Value::Long(count)) = value.get(&steps[..length]) {
            return Err(Dead::Other(format!(
                "in a list of {count} elements, of which those of up to {} are read",
                ros_bag::LONGEST
            )));
        }
    }
    match value.get(steps) {
        Some(Value::Integer(integer)) => Ok(Cell::Integer(*integer)),
        Some(Value::Real(number)) => Ok(Cell::Number(*number)),
        Some(Value::Text(text)) => Ok(Cell::Text(text.clone())),
        _ => Err(Dead::Missing),
    }
}

fn field(message: &DynamicMessage, steps: &[Step]) -> Result<Cell, Dead> {
    let [Step::Into(field), rest @ ..] = steps else { return Err(Dead::Missing) };
    if field.supports_presence() && !message.has_field(field) {
        return Err(Dead::Missing);
    }
    value(&message.get_field(field), rest)
}

fn value(found: &Value, steps: &[Step]) -> Result<Cell, Dead> {
    Ok(match (found, steps) {
        (Value::Message(message), _) => return field(message, steps),
        (Value::List(list), [Step::At(place), rest @ ..]) => {
            return value(list.get(*place).ok_or(Dead::Missing)?, rest);
        }
        (Value::F64(value), _) => Cell::Number(*value),
        (Value::F32(value), _) => Cell::Number(f64::from(*value)),
        (Value::I32(value) | Value::EnumNumber(value), _) => Cell::Integer((*value).into()),
        (Value::U32(value), _) => Cell::Integer((*value).into()),
        (Value::I64(value), _) => Cell::Integer((*value).into()),
        (Value::U64(value), _) => Cell::Integer((*value).into()),
        (Value::Bool(value), _) => Cell::Integer((*value).into()),
        (Value::String(text), _) => Cell::Text(text.clone()),
        _ => return Err(Dead::Missing),
    })
}

fn json_value(json: &Json, path: &str) -> Result<Cell, Dead> {
    match place(json, path).ok_or(Dead::Missing)? {
        Json::Number(number) => match (number.as_i64(), number.as_u64()) {
            (Some(integer), _) => Ok(Cell::Integer(integer.into())),
            (_, Some(integer)) => Ok(Cell::Integer(integer.into())),
            _ => number.as_f64().map(Cell::Number).ok_or(Dead::Missing),
        },
        Json::Bool(value) => Ok(Cell::Integer((*value).into())),
        Json::Null => Ok(Cell::Number(f64::NAN)),
        Json::String(text) => Ok(Cell::Text(text.clone())),
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
