//! Reads messages of ROS: a definition and bytes go in, values by their paths come out; and finds both in the bags of ROS 2.
//!
//! Definitions are those that a bag holds (`ros2msg`, `ros2idl`, `ros1msg`), or those of the usual messages, which are known here. Messages are
//! in CDR (both versions, both byte orders) or in the form of ROS 1. What a damaged bag says of sizes is held against the bytes that are there.
//!
//! ```
//! use ros_bag::{DefinitionLanguage, MessageDefinition, MessageEncoding, MessageValue};
//!
//! let definition = MessageDefinition::parse("demo/msg/Wheel", DefinitionLanguage::Msg, "uint8 gear\nfloat64[2] speed\n")?;
//! let mut message = vec![0, 1, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0];
//! message.extend([1.5f64, -2.5].iter().flat_map(|it| it.to_le_bytes()));
//! let message = definition.decode_message(MessageEncoding::Cdr, &message)?;
//! let way = definition.resolve_field_path("speed.1").expect("a number");
//! assert_eq!(message.get_at_path(&way.steps), Some(&MessageValue::Real(-2.5)));
//! # Ok::<(), String>(())
//! ```
#![forbid(unsafe_code)]

mod cdr;
mod compression;
mod database;
mod definition;
mod folder;
mod message;
mod paths;
mod units;

pub use cdr::MessageEncoding;
pub use compression::{decompress_file, decompress_message, is_compressed};
pub use database::{BagDatabase, BagTopic, is_database};
pub use definition::{
    DefinitionLanguage, FieldType, MessageDefinition, ScalarType, StructDefinition, StructField,
};
pub use folder::{BagFiles, bag_folder, find_bag_files};
pub use message::{LONGEST, MessageValue};
pub use paths::{FieldListing, FieldPath, PathError, PrimitiveField, RosMessageRow};

/// Whether a file begins as a bag of ROS 1.
#[must_use]
pub fn is_ros1_bag(head: &[u8]) -> bool {
    head.starts_with(b"#ROSBAG V")
}

/// Why a bag cannot be read: what was expected, what was found, what to do.
#[derive(Debug)]
pub struct Error(String);

impl Error {
    pub(crate) fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Error {}

impl From<std::io::Error> for Error {
    fn from(error: std::io::Error) -> Self {
        Self(format!("cannot be read: {error}"))
    }
}
