//! Describes protobuf messages at run time: descriptors without a compiler.

use std::ops::Range;

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};

/// A field of a message; `of` names its message or enumeration type.
pub(super) fn field_descriptor(
    name: &str,
    number: i32,
    kind: Type,
    of: Option<&str>,
) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        type_name: of.map(str::to_owned),
        ..FieldDescriptorProto::default()
    }
}

/// A message with these fields.
pub(super) fn message_descriptor(name: &str, field: Vec<FieldDescriptorProto>) -> DescriptorProto {
    DescriptorProto { name: Some(name.to_owned()), field, ..DescriptorProto::default() }
}

/// A file with one message, and the files that it needs.
pub(super) fn file_descriptor(
    package: &str,
    message: DescriptorProto,
    needed: &[&str],
) -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some(format!("{package}/{}.proto", message.name())),
        package: Some(package.to_owned()),
        syntax: Some("proto3".to_owned()),
        dependency: needed.iter().map(|it| (*it).to_owned()).collect(),
        message_type: vec![message],
        ..FileDescriptorProto::default()
    }
}

/// A schema as MCAP wants it: its file after the files that it needs.
pub(super) fn encode_descriptor_set(file: Vec<FileDescriptorProto>) -> Vec<u8> {
    FileDescriptorSet { file }.encode_to_vec()
}

/// The numbers of fields: from 1 on, without those that protobuf keeps for itself.
pub(super) fn field_numbers() -> impl Iterator<Item = u32> {
    (1..RESERVED.start).chain(RESERVED.end..)
}

/// <https://protobuf.dev/programming-guides/proto3/#assigning>
const RESERVED: Range<u32> = 19_000..20_000;

/// The schema of a message of doubles and texts: names and types of its fields, which have the [`field_numbers`].
pub(super) fn encode_message_schema(package: &str, name: &str, fields: &[(&str, Type)]) -> Vec<u8> {
    let fields = fields
        .iter()
        .zip(field_numbers())
        .map(|((name, kind), number)| field_descriptor(name, number as i32, *kind, None));
    encode_descriptor_set(vec![file_descriptor(package, message_descriptor(name, fields.collect()), &[])])
}
