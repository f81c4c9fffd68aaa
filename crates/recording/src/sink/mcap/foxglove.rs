//! Messages of Foxglove's well-known types, which Foxglove and Rerun display by themselves.

use prost_types::field_descriptor_proto::Type;
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto,
};

use super::descriptor::{field, file, message, set};
use super::nanoseconds;
use crate::sink::{Event, Level};

/// `google.protobuf.Timestamp`.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub(super) struct Timestamp {
    #[prost(int64, tag = "1")]
    seconds: i64,
    #[prost(int32, tag = "2")]
    nanos: i32,
}

impl Timestamp {
    fn at(time: f64) -> Self {
        let time = nanoseconds(time);
        let (seconds, nanos) = ((time / 1_000_000_000) as i64, (time % 1_000_000_000) as i32);
        Timestamp { seconds, nanos }
    }
}

/// `foxglove.Log`.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct Log {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Timestamp>,
    /// 2 information, 3 warning, 4 error.
    #[prost(int32, tag = "2")]
    level: i32,
    #[prost(string, tag = "3")]
    message: String,
    #[prost(string, tag = "4")]
    name: String,
}

impl From<&Event> for Log {
    fn from(event: &Event) -> Self {
        Log {
            timestamp: Some(Timestamp::at(event.time)),
            level: match event.level {
                Level::Info | Level::Summary => 2,
                Level::Warning => 3,
                Level::Error => 4,
            },
            message: event.message.clone(),
            name: event.source.clone(),
        }
    }
}

/// The event of a [`Log`] message at `time` [s].
pub(crate) fn event(time: f64, message: &[u8]) -> Option<Event> {
    let log = <Log as prost::Message>::decode(message).ok()?;
    let level = match log.level {
        3 => Level::Warning,
        4 => Level::Error,
        _ => Level::Info,
    };
    Some(Event { time, level, source: log.name, message: log.message, again: 0 })
}

/// `foxglove.Vector3` [m].
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub(super) struct Vector3 {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
}

/// `foxglove.Quaternion`.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub(super) struct Quaternion {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
    #[prost(double, tag = "4")]
    w: f64,
}

/// `foxglove.FrameTransform`: the pose of a frame in another one.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct FrameTransform {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Timestamp>,
    #[prost(string, tag = "2")]
    parent_frame_id: String,
    #[prost(string, tag = "3")]
    child_frame_id: String,
    #[prost(message, optional, tag = "4")]
    translation: Option<Vector3>,
    #[prost(message, optional, tag = "5")]
    rotation: Option<Quaternion>,
}

impl FrameTransform {
    /// Places the frame `car` in the frame `world` at `time` [s]: at x and y [m], turned by `heading` [rad] to the left.
    pub fn place_car(&mut self, time: f64, [x, y]: [f64; 2], heading: f64) {
        let (sin, cos) = (0.5 * heading).sin_cos();
        self.timestamp = Some(Timestamp::at(time));
        "world".clone_into(&mut self.parent_frame_id);
        "car".clone_into(&mut self.child_frame_id);
        self.translation = Some(Vector3 { x, y, z: 0.0 });
        self.rotation = Some(Quaternion { x: 0.0, y: 0.0, z: sin, w: cos });
    }
}

/// The schema of [`Log`].
pub(super) fn log_schema() -> Vec<u8> {
    let fields = vec![
        timestamp_field(),
        field("level", 2, Type::Enum, Some(".foxglove.Log.Level")),
        field("message", 3, Type::String, None),
        field("name", 4, Type::String, None),
    ];
    let names = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];
    let value = |(number, name): (usize, &str)| EnumValueDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number as i32),
        ..EnumValueDescriptorProto::default()
    };
    let level = EnumDescriptorProto {
        name: Some("Level".to_owned()),
        value: names.into_iter().enumerate().map(value).collect(),
        ..EnumDescriptorProto::default()
    };
    let log = DescriptorProto { enum_type: vec![level], ..message("Log", fields) };
    set(vec![timestamp_file(), file("foxglove", log, &[TIMESTAMP])])
}

/// The schema of [`FrameTransform`].
pub(super) fn transform_schema() -> Vec<u8> {
    let doubles = |names: &[&str]| -> Vec<_> {
        names
            .iter()
            .zip(1..)
            .map(|(name, number)| field(name, number, Type::Double, None))
            .collect()
    };
    let vector = file("foxglove", message("Vector3", doubles(&["x", "y", "z"])), &[]);
    let quaternion = file("foxglove", message("Quaternion", doubles(&["x", "y", "z", "w"])), &[]);
    let transform = message(
        "FrameTransform",
        vec![
            timestamp_field(),
            field("parent_frame_id", 2, Type::String, None),
            field("child_frame_id", 3, Type::String, None),
            field("translation", 4, Type::Message, Some(".foxglove.Vector3")),
            field("rotation", 5, Type::Message, Some(".foxglove.Quaternion")),
        ],
    );
    let needed = [TIMESTAMP, "foxglove/Vector3.proto", "foxglove/Quaternion.proto"];
    set(vec![timestamp_file(), vector, quaternion, file("foxglove", transform, &needed)])
}

const TIMESTAMP: &str = "google/protobuf/timestamp.proto";

fn timestamp_field() -> FieldDescriptorProto {
    field("timestamp", 1, Type::Message, Some(".google.protobuf.Timestamp"))
}

fn timestamp_file() -> FileDescriptorProto {
    let fields = vec![field("seconds", 1, Type::Int64, None), field("nanos", 2, Type::Int32, None)];
    let file = file("google.protobuf", message("Timestamp", fields), &[]);
    FileDescriptorProto { name: Some(TIMESTAMP.to_owned()), ..file }
}
