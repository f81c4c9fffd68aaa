//! Holds definitions of the standard messages of ROS 2, for bags without definitions: those of rosbag2 before ROS 2 Iron.
//!
//! The fields are those of common_interfaces and rcl_interfaces in ROS 2 Humble, of Autoware (autoware_auto_msgs, autoware_msgs), of the
//! driver of VectorNav and of ackermann_msgs. A message that another release wrote is found by its length.

use std::sync::OnceLock;

use super::{TypeDeclarations, add_msg_declaration};

/// A line for each message: its name, and behind a colon its fields.
const KNOWN: &str = include_str!("standard_messages.txt");

/// What is known, by name.
pub fn standard_declarations() -> &'static TypeDeclarations {
    static READ: OnceLock<TypeDeclarations> = OnceLock::new();
    READ.get_or_init(|| {
        let mut declared = TypeDeclarations::new();
        for (name, fields) in KNOWN.lines().filter_map(|line| line.split_once(':')) {
            // A test reads all of them.
            let _ = add_msg_declaration(name, &fields.replace(';', "\n"), &mut declared);
        }
        declared
    })
}

#[cfg(test)]
mod tests {
    use super::{KNOWN, standard_declarations};
    use crate::definition::MessageDefinition;

    #[test]
    fn all_that_is_known_is_whole() {
        assert_eq!(standard_declarations().len(), KNOWN.lines().count());
        for name in standard_declarations().keys().filter(|name| !name.starts_with("ros1/")) {
            let definition = MessageDefinition::standard_message(name);
            let definition = definition.unwrap_or_else(|what| panic!("{name}: {what}"));
            assert!(definition.assumed, "{name}");
        }
    }
}
