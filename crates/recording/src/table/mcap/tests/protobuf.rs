//! Numbers of each type of protobuf, and what is no number.

use std::collections::BTreeMap;

use ::mcap::Compression;
use prost::Message as _;
use prost_reflect::{DescriptorPool, DynamicMessage, Value};
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet,
};

use super::{put, recording};

const KINDS: [(&str, Type); 17] = [
    ("double", Type::Double),
    ("float", Type::Float),
    ("int32", Type::Int32),
    ("int64", Type::Int64),
    ("uint32", Type::Uint32),
    ("uint64", Type::Uint64),
    ("sint32", Type::Sint32),
    ("sint64", Type::Sint64),
    ("fixed32", Type::Fixed32),
    ("fixed64", Type::Fixed64),
    ("sfixed32", Type::Sfixed32),
    ("sfixed64", Type::Sfixed64),
    ("bool", Type::Bool),
    ("gear", Type::Enum),
    ("text", Type::String),
    ("raw", Type::Bytes),
    ("inner", Type::Message),
];

/// A schema with a field of each type, which contains its own kind.
fn schema() -> Vec<u8> {
    let field = |name: &str, kind: Type, label: Label, number| FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        label: Some(label.into()),
        r#type: Some(kind.into()),
        type_name: match kind {
            Type::Enum => Some(".test.Gear".to_owned()),
            Type::Message => Some(".test.All".to_owned()),
            _ => None,
        },
        ..Default::default()
    };
    let fields = KINDS.iter().zip(1..).map(|((name, kind), k)| field(name, *kind, Label::Optional, k));
    let list = field("list", Type::Double, Label::Repeated, 20);
    let message = DescriptorProto {
        name: Some("All".to_owned()),
        field: fields.chain([list]).collect(),
        ..Default::default()
    };
    let file = FileDescriptorProto {
        name: Some("all.proto".to_owned()),
        package: Some("test".to_owned()),
        syntax: Some("proto3".to_owned()),
        message_type: vec![message],
        enum_type: vec![gear()],
        ..Default::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

fn gear() -> EnumDescriptorProto {
    let gears = ["NEUTRAL", "FIRST"].into_iter().zip(0..);
    EnumDescriptorProto {
        name: Some("Gear".to_owned()),
        value: gears
            .map(|(name, number)| EnumValueDescriptorProto {
                name: Some(name.to_owned()),
                number: Some(number),
                ..Default::default()
            })
            .collect(),
        ..Default::default()
    }
}

fn value(kind: Type) -> Option<Value> {
    Some(match kind {
        Type::Double => Value::F64(-0.1),
        Type::Float => Value::F32(0.25),
        Type::Int32 | Type::Sint32 | Type::Sfixed32 => Value::I32(-7),
        Type::Int64 | Type::Sint64 | Type::Sfixed64 => Value::I64(-7),
        Type::Uint32 | Type::Fixed32 => Value::U32(7),
        Type::Uint64 | Type::Fixed64 => Value::U64(7),
        Type::Bool => Value::Bool(true),
        Type::Enum => Value::EnumNumber(1),
        _ => return None,
    })
}

#[test]
fn every_number_of_protobuf_is_read_also_in_messages_and_lists() {
    let schema = schema();
    let pool = DescriptorPool::decode(&*schema).expect("a schema");
    let kind = pool.get_message_by_name("test.All").expect("a message");
    let mut inner = DynamicMessage::new(kind.clone());
    for (name, kind) in KINDS {
        if let Some(value) = value(kind) {
            inner.set_field_by_name(name, value);
        }
    }
    inner.set_field_by_name("list", Value::List(vec![Value::F64(1.5), Value::F64(2.5)]));
    let mut outer = DynamicMessage::new(kind);
    outer.set_field_by_name("inner", Value::Message(inner));
    let scrap = recording("kinds", Some(Compression::Lz4), |file| {
        let schema = file.add_schema("test.All", "protobuf", &schema).expect("a schema");
        let metadata = BTreeMap::from([
            ("unit:double".to_owned(), "m".to_owned()),
            ("unit:inner.float".to_owned(), "s".to_owned()),
        ]);
        let topic = file.add_channel(schema, "/all", "protobuf", &metadata).expect("a channel");
        put(file, topic, [0; 2], &outer.encode_to_vec());
        let bad = file.add_schema("test.Nothing", "protobuf", &[]).expect("a schema");
        file.add_channel(bad, "/bad", "protobuf", &metadata).expect("a channel");
    });
    let numbers = KINDS.iter().filter(|(_, kind)| value(*kind).is_some());
    for (name, kind) in numbers {
        let columns = [format!("/all.{name}"), format!("/all.inner.{name}")];
        let table = scrap.read(None, &[&columns[0], &columns[1]]).expect(name);
        let expected = match kind {
            Type::Double => -0.1,
            Type::Float => 0.25,
            Type::Bool | Type::Enum => 1.0,
            Type::Uint32 | Type::Uint64 | Type::Fixed32 | Type::Fixed64 => 7.0,
            _ => -7.0,
        };
        assert_eq!((table.column_values(0), table.column_values(1)), (&[0.0][..], &[expected][..]), "{name}");
        let units = (table.column_unit(0), table.column_unit(1));
        assert_eq!(units.0, (*name == "double").then_some("m"));
        assert_eq!(units.1, (*name == "float").then_some("s"));
    }
    let table = scrap.read(None, &["/all.inner.list.1"]).expect("a list");
    assert_eq!(table.column_values(0), [2.5]);
    for (column, part) in [
        ("/all.text", "is a string: expected a number"),
        ("/all.raw", "is bytes"),
        ("/all.inner", "is a message"),
        ("/all.list", "is a list: add an index"),
        ("/all.doubel", "did you mean `/all.double`?"),
        ("/all.doubel", "/all.double, /all.float, /all.int32"),
        ("/all.doubel", "more; did you mean"),
        ("/all.double.x", "no column `/all.double.x`"),
        ("/all.inner.inner.double", "message 1 of `/all`"),
        ("/all.inner.list.7", "it has no `/all.inner.list.7`"),
        ("/bad.x", "its schema has no message `test.Nothing`"),
    ] {
        let error = scrap.error(column);
        assert!(error.contains(part), "{column}: {error}");
    }
}
