//! The fields of common ROS messages that are signals of a car.

use recording::table::ColumnTitle;

/// Signals with the paths of fields in a topic: of Odometry, TwistStamped, Imu, and of the reports of Autoware and Ackermann.
const FIELDS: [(&str, &[&str]); 6] = [
    ("v_x", &["longitudinal_velocity", "twist.twist.linear.x", "twist.linear.x"]),
    ("v_y", &["lateral_velocity", "twist.twist.linear.y", "twist.linear.y"]),
    ("r", &["angular_velocity.z", "heading_rate", "twist.twist.angular.z", "twist.angular.z"]),
    ("a_x", &["linear_acceleration.x"]),
    ("a_y", &["linear_acceleration.y"]),
    ("delta", &["steering_tire_angle", "steering_angle", "drive.steering_angle"]),
];

/// The column of a signal, if one topic alone has such a field.
pub fn usual_ros_column<'t>(titles: &'t [ColumnTitle], name: &str) -> Option<&'t ColumnTitle> {
    let (_, fields) = FIELDS.iter().find(|(of, _)| *of == name)?;
    fields.iter().find_map(|field| {
        let is = |title: &&ColumnTitle| {
            title.name.starts_with('/') && title.name.split_once('.').is_some_and(|(_, path)| path == *field)
        };
        let mut found = titles.iter().filter(is);
        let first = found.next()?;
        found.next().is_none().then_some(first)
    })
}
