//! Decodes fields of messages: protobuf and ROS by their schemas, JSON by names.

use mcap::Channel;
use prost_reflect::{DescriptorPool, DynamicMessage, FieldDescriptor, Kind, MessageDescriptor, Value};
use ros_bag::{DefinitionLanguage, FieldListing, FieldPath, MessageDefinition, MessageEncoding, PathError};

use super::json::{JsonNode, JsonPath};
pub use crate::table::log::ChannelValue;

/// How messages of a channel are read.
#[derive(Debug)]
pub enum MessageDecoder {
    /// By this description.
    Protobuf(MessageDescriptor),
    /// As they are.
    Json,
    /// By this definition of ROS.
    Ros(Box<MessageDefinition>, MessageEncoding),
}

/// A message that has been read.
#[derive(Debug)]
pub enum DecodedMessage<'d> {
    /// With its description.
    Protobuf(DynamicMessage),
    /// As it is.
    Json(JsonNode<'d>),
    /// As a tree of values.
    Ros(ros_bag::MessageValue),
}

/// A row of a message: most messages are one.
#[derive(Debug)]
pub struct MessageRow<'m> {
    /// What tells it from other rows, where a message has several.
    pub key: Option<&'m str>,
    /// The time at which it was measured, where it says so [ns].
    pub stamp: Option<i128>,
    content: RowContent<'m>,
}

#[derive(Debug)]
enum RowContent<'m> {
    Protobuf(&'m DynamicMessage),
    Json(&'m JsonNode<'m>),
    Ros(&'m ros_bag::MessageValue),
}

/// The way to a number in the messages of a channel.
#[derive(Debug)]
pub enum MessageField {
    /// Fields of messages, and indices in lists.
    Protobuf(Vec<PathStep>),
    /// Names with dots in between.
    Json(JsonPath),
    /// Fields of structures, and indices in lists.
    Ros(FieldPath),
}

/// A step on the way through a protobuf message.
#[derive(Debug)]
pub enum PathStep {
    /// To a field.
    Into(FieldDescriptor),
    /// To an element of a list, from 0 on.
    At(usize),
}

/// Why there is no way to a number.
#[derive(Debug, PartialEq, Eq)]
pub enum FieldError {
    /// No field is called that.
    Missing,
    /// What is there is no number but this.
    Other(String),
}

/// Messages in messages are listed down to this depth: a message may contain its own kind.
const DEEPEST: usize = 5;

impl MessageDecoder {
    /// Nothing for encodings that cannot be read.
    ///
    /// # Errors
    /// With what is wrong with the channel's schema.
    pub fn new(channel: &Channel) -> Result<Option<Self>, String> {
        match channel.message_encoding.as_str() {
            "json" => Ok(Some(MessageDecoder::Json)),
            "protobuf" => {
                let schema = channel.schema.as_ref().ok_or("it has no schema")?;
                let pool = DescriptorPool::decode(&*schema.data);
                let pool = pool.map_err(|error| format!("its schema cannot be read: {error}"))?;
                let message = pool.get_message_by_name(&schema.name);
                let missing = || format!("its schema has no message `{}`", schema.name);
                Ok(Some(MessageDecoder::Protobuf(message.ok_or_else(missing)?)))
            }
            encoding => match MessageEncoding::from_name(encoding) {
                Some(encoding) => Ok(Some(ros_message_decoder(channel, encoding)?)),
                None => Ok(None),
            },
        }
    }

    /// The way to a value, as far as one can tell without a message.
    pub fn resolve_field(&self, path: &str) -> Result<MessageField, FieldError> {
        match self {
            MessageDecoder::Json => Ok(MessageField::Json(JsonPath::new(path))),
            MessageDecoder::Protobuf(message) => {
                resolve_protobuf_path(message, path).map(MessageField::Protobuf)
            }
            MessageDecoder::Ros(definition, _) => match definition.resolve_field_path(path) {
                Ok(way) => Ok(MessageField::Ros(way)),
                Err(PathError::Missing) => Err(FieldError::Missing),
                Err(PathError::Other(found)) => Err(FieldError::Other(found)),
            },
        }
    }

    /// Reads a message.
    ///
    /// # Errors
    /// With what is wrong with it.
    pub fn decode<'d>(&self, data: &'d [u8]) -> Result<DecodedMessage<'d>, String> {
        match self {
            MessageDecoder::Protobuf(kind) => DynamicMessage::decode(kind.clone(), data)
                .map(DecodedMessage::Protobuf)
                .map_err(|error| format!("it does not fit its schema: {error}")),
            MessageDecoder::Json => serde_json::from_slice(data)
                .map(DecodedMessage::Json)
                .map_err(|error| format!("it is no JSON: {error}")),
            MessageDecoder::Ros(definition, encoding) => definition
                .decode_message(*encoding, &ros_bag::decompress_message(data)?)
                .map(DecodedMessage::Ros),
        }
    }

    /// The rows of a message.
    pub fn message_rows<'m>(&self, message: &'m DecodedMessage<'m>) -> Vec<MessageRow<'m>> {
        let one = |content| vec![MessageRow { key: None, stamp: None, content }];
        match (self, message) {
            (_, DecodedMessage::Protobuf(message)) => one(RowContent::Protobuf(message)),
            (_, DecodedMessage::Json(json)) => one(RowContent::Json(json)),
            (MessageDecoder::Ros(definition, _), DecodedMessage::Ros(value)) => {
                let rows = definition.message_rows(value).into_iter();
                let row = |row: ros_bag::RosMessageRow<'m>| {
                    let stamp = definition.header_stamp(&row);
                    MessageRow { key: row.key, stamp, content: RowContent::Ros(row.value) }
                };
                rows.map(row).collect()
            }
            (_, DecodedMessage::Ros(value)) => one(RowContent::Ros(value)),
        }
    }

    /// Whether messages say when they were measured.
    pub fn has_stamp(&self) -> bool {
        matches!(self, MessageDecoder::Ros(definition, _) if definition.has_stamp())
    }

    /// The unit of a field, where the type of the message tells.
    pub fn field_unit(&self, field: &MessageField) -> Option<&'static str> {
        match (self, field) {
            (MessageDecoder::Ros(definition, _), MessageField::Ros(way)) => definition.field_unit(way),
            _ => None,
        }
    }

    /// What a row of a message of ROS has; without one what the definition promises.
    pub fn ros_field_listing(&self, row: Option<&MessageRow>) -> Option<FieldListing> {
        let MessageDecoder::Ros(definition, _) = self else { return None };
        let row = row.and_then(|row| match row.content {
            RowContent::Ros(value) => Some(ros_bag::RosMessageRow { key: row.key, value }),
            _ => None,
        });
        Some(definition.list_fields(row.as_ref()))
    }

    /// The numbers of a message by their paths, of ROS its texts, too; without a message those that the schema promises.
    pub fn field_paths(&self, message: Option<&DecodedMessage>) -> Vec<String> {
        let mut paths = Vec::new();
        match (self, message) {
            (MessageDecoder::Protobuf(kind), _) => list_protobuf_fields(kind, "", DEEPEST, &mut paths),
            (MessageDecoder::Json, Some(DecodedMessage::Json(json))) => json.list_numbers("", &mut paths),
            (MessageDecoder::Json, _) => {}
            (MessageDecoder::Ros(..), message) => {
                let rows = message.map_or_else(Vec::new, |message| self.message_rows(message));
                let listings = match rows.is_empty() {
                    true => vec![self.ros_field_listing(None)],
                    false => rows.iter().map(|row| self.ros_field_listing(Some(row))).collect(),
                };
                let leaves = listings.into_iter().flatten().flat_map(|it| it.leaves);
                paths.extend(leaves.map(|leaf| leaf.path));
            }
        }
        paths
    }
}

fn resolve_protobuf_path(message: &MessageDescriptor, path: &str) -> Result<Vec<PathStep>, FieldError> {
    let (mut steps, mut message) = (Vec::new(), Some(message.clone()));
    let mut names = path.split('.').peekable();
    while let Some(name) = names.next() {
        let found = message.as_ref().and_then(|message| message.get_field_by_name(name));
        let field = found.ok_or(FieldError::Missing)?;
        let kind = field.kind();
        let list = field.is_list();
        if field.is_map() {
            return Err(FieldError::Other("a map".to_owned()));
        }
        steps.push(PathStep::Into(field));
        if list {
            let place = names
                .next()
                .ok_or_else(|| FieldError::Other("a list: add an index, as in `.0`".to_owned()))?;
            steps.push(PathStep::At(place.parse().map_err(|_| FieldError::Missing)?));
        }
        let last = names.peek().is_none();
        message = match kind {
            Kind::Message(_) if last => return Err(FieldError::Other("a message".to_owned())),
            Kind::Message(message) => Some(message),
            Kind::Bytes if last => return Err(FieldError::Other("bytes".to_owned())),
            _ => None,
        };
    }
    Ok(steps)
}

fn list_protobuf_fields(message: &MessageDescriptor, prefix: &str, depth: usize, paths: &mut Vec<String>) {
    for field in message.fields().filter(|field| !field.is_map()) {
        let place = if field.is_list() { ".0" } else { "" };
        let path = format!("{prefix}{}{place}", field.name());
        match field.kind() {
            Kind::String | Kind::Bytes => {}
            Kind::Message(message) if depth > 0 => {
                list_protobuf_fields(&message, &format!("{path}."), depth - 1, paths);
            }
            Kind::Message(_) => {}
            _ => paths.push(path),
        }
    }
}

impl MessageRow<'_> {
    /// The length of a list of ROS.
    pub fn ros_list_length(&self, way: &[usize]) -> Option<usize> {
        let RowContent::Ros(value) = self.content else { return None };
        match value.get_at_path(way)? {
            ros_bag::MessageValue::List(list) => Some(list.len()),
            ros_bag::MessageValue::Long(count) => Some(*count),
            _ => None,
        }
    }
}

impl MessageField {
    /// What tells the row of this field from others.
    pub fn row_key(&self) -> Option<&str> {
        match self {
            MessageField::Ros(way) => way.key.as_deref(),
            _ => None,
        }
    }

    /// The value in a row; `null` is NaN.
    ///
    /// # Errors
    /// When there is none.
    pub fn value_in_row(&self, row: &MessageRow) -> Result<ChannelValue, FieldError> {
        match (self, &row.content) {
            (MessageField::Protobuf(steps), RowContent::Protobuf(message)) => {
                protobuf_field_value(message, steps)
            }
            (MessageField::Json(path), RowContent::Json(json)) => {
                json_value(path.find_in(json).ok_or(FieldError::Missing)?)
            }
            (MessageField::Ros(way), RowContent::Ros(value)) => ros_value(value, &way.steps),
            _ => Err(FieldError::Missing),
        }
    }
}

/// How messages of ROS are read; a bag without definitions has those that are known here.
fn ros_message_decoder(channel: &Channel, encoding: MessageEncoding) -> Result<MessageDecoder, String> {
    let schema = channel.schema.as_ref().ok_or("it has no schema")?;
    if schema.data.is_empty() && schema.encoding.is_empty() {
        let known = MessageDefinition::standard_message(&schema.name).map_err(|_| {
            format!(
                "the bag has no definition of `{}`, as those of releases before ROS 2 Iron, and it is not one of the usual \
                 messages; `ros2 bag convert` makes a bag with definitions where the package of that message is installed",
                schema.name
            )
        });
        return Ok(MessageDecoder::Ros(Box::new(known?), encoding));
    }
    let language = DefinitionLanguage::from_name(&schema.encoding).ok_or_else(|| {
        format!("expected a schema in ros2msg, ros2idl or ros1msg, found one in `{}`", schema.encoding)
    })?;
    let text = String::from_utf8_lossy(&schema.data);
    let definition = MessageDefinition::parse(&schema.name, language, &text).map_err(|error| {
        match schema.name.contains("/srv/") || schema.name.contains("/action/") {
            true => "it is of a service or an action, not of a topic".to_owned(),
            false => format!("its schema cannot be read: {error}"),
        }
    })?;
    Ok(MessageDecoder::Ros(Box::new(definition), encoding))
}

fn ros_value(value: &ros_bag::MessageValue, steps: &[usize]) -> Result<ChannelValue, FieldError> {
    use ros_bag::MessageValue;
    for length in 0..steps.len() {
        if let Some(MessageValue::Long(count)) = value.get_at_path(&steps[..length]) {
            return Err(FieldError::Other(format!(
                "in a list of {count} elements, of which those of up to {} are read",
                ros_bag::LONGEST
            )));
        }
    }
    match value.get_at_path(steps) {
        Some(MessageValue::Integer(integer)) => Ok(ChannelValue::Integer(*integer)),
        Some(MessageValue::Real(number)) => Ok(ChannelValue::Number(*number)),
        Some(MessageValue::Text(text)) => Ok(ChannelValue::Text(text.clone())),
        _ => Err(FieldError::Missing),
    }
}

fn protobuf_field_value(message: &DynamicMessage, steps: &[PathStep]) -> Result<ChannelValue, FieldError> {
    let [PathStep::Into(field), rest @ ..] = steps else { return Err(FieldError::Missing) };
    if field.supports_presence() && !message.has_field(field) {
        return Err(FieldError::Missing);
    }
    protobuf_value_at(&message.get_field(field), rest)
}

fn protobuf_value_at(found: &Value, steps: &[PathStep]) -> Result<ChannelValue, FieldError> {
    Ok(match (found, steps) {
        (Value::Message(message), _) => return protobuf_field_value(message, steps),
        (Value::List(list), [PathStep::At(place), rest @ ..]) => {
            return protobuf_value_at(list.get(*place).ok_or(FieldError::Missing)?, rest);
        }
        (Value::F64(value), _) => ChannelValue::Number(*value),
        (Value::F32(value), _) => ChannelValue::Number(f64::from(*value)),
        (Value::I32(value) | Value::EnumNumber(value), _) => ChannelValue::Integer((*value).into()),
        (Value::U32(value), _) => ChannelValue::Integer((*value).into()),
        (Value::I64(value), _) => ChannelValue::Integer((*value).into()),
        (Value::U64(value), _) => ChannelValue::Integer((*value).into()),
        (Value::Bool(value), _) => ChannelValue::Integer((*value).into()),
        (Value::String(text), _) => ChannelValue::Text(text.clone()),
        _ => return Err(FieldError::Missing),
    })
}

fn json_value(node: &JsonNode) -> Result<ChannelValue, FieldError> {
    match node {
        JsonNode::Integer(integer) => Ok(ChannelValue::Integer(*integer)),
        JsonNode::Real(number) => Ok(ChannelValue::Number(*number)),
        JsonNode::Bool(value) => Ok(ChannelValue::Integer((*value).into())),
        JsonNode::Null => Ok(ChannelValue::Number(f64::NAN)),
        JsonNode::Text(text) => Ok(ChannelValue::Text(text.to_string())),
        JsonNode::List(_) => Err(FieldError::Other("a list: add an index, as in `.0`".to_owned())),
        JsonNode::Object(_) => Err(FieldError::Other("an object".to_owned())),
    }
}
