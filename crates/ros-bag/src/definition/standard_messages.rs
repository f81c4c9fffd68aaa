//! Holds definitions of the standard messages of ROS 2, for bags without definitions: those of rosbag2 before ROS 2 Iron.
//!
//! The fields are those of common_interfaces and rcl_interfaces in ROS 2 Humble, of Autoware (autoware_auto_msgs, autoware_msgs), of the
//! driver of VectorNav and of ackermann_msgs. A message that another release wrote is found by its length.

use std::sync::OnceLock;

use super::{Declarations, declare};

/// A line for each message: its name, and behind a colon its fields.
const KNOWN: &str = include_str!("standard_messages.txt");

/// What is known, by name.
pub fn declarations() -> &'static Declarations {
    static READ: OnceLock<Declarations> = OnceLock::new();
    READ.get_or_init(|| {
        let mut declared = Declarations::new();
        for (name, fields) in KNOWN.lines().filter_map(|line| line.split_once(':')) {
            // A test reads all of them.
            let _ = declare(name, &fields.replace(';', "\n"), &mut declared);
        }
        declared
    })
}

#[cfg(test)]
mod tests {
    use super::{KNOWN, declarations};
    use crate::definition::Definition;

    #[test]
    fn all_that_is_known_is_whole() {
        assert_eq!(declarations().len(), KNOWN.lines().count());
        for name in declarations().keys().filter(|name| !name.starts_with("ros1/")) {
            let definition = Definition::standard(name);
            let definition = definition.unwrap_or_else(|what| panic!("{name}: {what}"));
            assert!(definition.assumed, "{name}");
        }
    }
}
