//! Messages of Foxglove's well-known types, which Foxglove and Rerun display by themselves.

use prost_types::field_descriptor_proto::Type;
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto, FileDescriptorProto,
};

use super::descriptor::{encode_descriptor_set, field_descriptor, file_descriptor, message_descriptor};
use super::seconds_to_nanoseconds;
use crate::sink::{EventLevel, RunEvent};

/// `google.protobuf.Timestamp`.
#[derive(Clone, Copy, PartialEq, prost::Message)]
pub(super) struct ProtobufTimestamp {
    #[prost(int64, tag = "1")]
    seconds: i64,
    #[prost(int32, tag = "2")]
    nanos: i32,
}

impl ProtobufTimestamp {
    fn from_seconds(time: f64) -> Self {
        let time = seconds_to_nanoseconds(time);
        let (seconds, nanos) = ((time / 1_000_000_000) as i64, (time % 1_000_000_000) as i32);
        ProtobufTimestamp { seconds, nanos }
    }
}

/// `foxglove.Log`.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct FoxgloveLog {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<ProtobufTimestamp>,
    /// 2 information, 3 warning, 4 error.
    #[prost(int32, tag = "2")]
    level: i32,
    #[prost(string, tag = "3")]
    message: String,
    #[prost(string, tag = "4")]
    name: String,
}

impl From<&RunEvent> for FoxgloveLog {
    fn from(event: &RunEvent) -> Self {
        FoxgloveLog {
            timestamp: Some(ProtobufTimestamp::from_seconds(event.time)),
            level: match event.level {
                EventLevel::Info | EventLevel::Summary => 2,
                EventLevel::Warning => 3,
                EventLevel::Error => 4,
            },
            message: event.message.clone(),
            name: event.source.clone(),
        }
    }
}

/// The event of a [`FoxgloveLog`] message at `time` [s].
pub(crate) fn decode_log_event(time: f64, message: &[u8]) -> Option<RunEvent> {
    let log = <FoxgloveLog as prost::Message>::decode(message).ok()?;
    let level = match log.level {
        3 => EventLevel::Warning,
        4 => EventLevel::Error,
        _ => EventLevel::Info,
    };
    Some(RunEvent { time, level, source: log.name, message: log.message, again: 0 })
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
    timestamp: Option<ProtobufTimestamp>,
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
    pub fn set_car_pose(&mut self, time: f64, [x, y]: [f64; 2], heading: f64) {
        let (sin, cos) = (0.5 * heading).sin_cos();
        self.timestamp = Some(ProtobufTimestamp::from_seconds(time));
        "world".clone_into(&mut self.parent_frame_id);
        "car".clone_into(&mut self.child_frame_id);
        self.translation = Some(Vector3 { x, y, z: 0.0 });
        self.rotation = Some(Quaternion { x: 0.0, y: 0.0, z: sin, w: cos });
    }
}

/// The schema of [`FoxgloveLog`].
pub(super) fn log_schema() -> Vec<u8> {
    let fields = vec![
        timestamp_field(),
        field_descriptor("level", 2, Type::Enum, Some(".foxglove.Log.Level")),
        field_descriptor("message", 3, Type::String, None),
        field_descriptor("name", 4, Type::String, None),
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
    let log = DescriptorProto { enum_type: vec![level], ..message_descriptor("Log", fields) };
    encode_descriptor_set(vec![timestamp_file(), file_descriptor("foxglove", log, &[TIMESTAMP])])
}

/// The schema of [`FrameTransform`].
pub(super) fn transform_schema() -> Vec<u8> {
    let doubles = |names: &[&str]| -> Vec<_> {
        names
            .iter()
            .zip(1..)
            .map(|(name, number)| field_descriptor(name, number, Type::Double, None))
            .collect()
    };
    let vector = file_descriptor("foxglove", message_descriptor("Vector3", doubles(&["x", "y", "z"])), &[]);
    let quaternion =
        file_descriptor("foxglove", message_descriptor("Quaternion", doubles(&["x", "y", "z", "w"])), &[]);
    let transform = message_descriptor(
        "FrameTransform",
        vec![
            timestamp_field(),
            field_descriptor("parent_frame_id", 2, Type::String, None),
            field_descriptor("child_frame_id", 3, Type::String, None),
            field_descriptor("translation", 4, Type::Message, Some(".foxglove.Vector3")),
            field_descriptor("rotation", 5, Type::Message, Some(".foxglove.Quaternion")),
        ],
    );
    let needed = [TIMESTAMP, "foxglove/Vector3.proto", "foxglove/Quaternion.proto"];
    encode_descriptor_set(vec![
        timestamp_file(),
        vector,
        quaternion,
        file_descriptor("foxglove", transform, &needed),
    ])
}

const TIMESTAMP: &str = "google/protobuf/timestamp.proto";

fn timestamp_field() -> FieldDescriptorProto {
    field_descriptor("timestamp", 1, Type::Message, Some(".google.protobuf.Timestamp"))
}

fn timestamp_file() -> FileDescriptorProto {
    let fields = vec![
        field_descriptor("seconds", 1, Type::Int64, None),
        field_descriptor("nanos", 2, Type::Int32, None),
    ];
    let file = file_descriptor("google.protobuf", message_descriptor("Timestamp", fields), &[]);
    FileDescriptorProto { name: Some(TIMESTAMP.to_owned()), ..file }
}
