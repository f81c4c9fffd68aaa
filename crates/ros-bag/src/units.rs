//! Lists the units of fields of standard messages.
//!
//! REP 103 says SI units, degrees for latitude and longitude alone; the comments of each definition say the same, and the exceptions
//! (VectorNav: degrees, kPa). What holds for a field holds for all that lies in it; of quaternions, and of covariances that mix units, nothing is said.

/// Message, fields, unit.
const UNITS: &[(&str, &[&str], &str)] = &[
    ("builtin_interfaces/Time", &["sec"], "s"),
    ("builtin_interfaces/Time", &["nanosec"], "ns"),
    ("builtin_interfaces/Duration", &["sec"], "s"),
    ("builtin_interfaces/Duration", &["nanosec"], "ns"),
    ("ros1/Time", &["secs"], "s"),
    ("ros1/Time", &["nsecs"], "ns"),
    ("ros1/Duration", &["secs"], "s"),
    ("ros1/Duration", &["nsecs"], "ns"),
    ("geometry_msgs/Accel", &["linear"], "m/s2"),
    ("geometry_msgs/Accel", &["angular"], "rad/s2"),
    ("geometry_msgs/Inertia", &["m"], "kg"),
    ("geometry_msgs/Inertia", &["com"], "m"),
    ("geometry_msgs/Inertia", &["ixx", "ixy", "ixz", "iyy", "iyz", "izz"], "kg.m2"),
    ("geometry_msgs/Point", &["x", "y", "z"], "m"),
    ("geometry_msgs/Point32", &["x", "y", "z"], "m"),
    ("geometry_msgs/Pose", &["position"], "m"),
    ("geometry_msgs/Pose2D", &["x", "y"], "m"),
    ("geometry_msgs/Pose2D", &["theta"], "rad"),
    ("geometry_msgs/Transform", &["translation"], "m"),
    ("geometry_msgs/Twist", &["linear"], "m/s"),
    ("geometry_msgs/Twist", &["angular"], "rad/s"),
    ("geometry_msgs/Wrench", &["force"], "N"),
    ("geometry_msgs/Wrench", &["torque"], "N.m"),
    ("sensor_msgs/BatteryState", &["voltage", "cell_voltage"], "V"),
    ("sensor_msgs/BatteryState", &["current"], "A"),
    ("sensor_msgs/BatteryState", &["temperature", "cell_temperature"], "degC"),
    ("sensor_msgs/FluidPressure", &["fluid_pressure"], "Pa"),
    ("sensor_msgs/Imu", &["angular_velocity"], "rad/s"),
    ("sensor_msgs/Imu", &["angular_velocity_covariance"], "rad2/s2"),
    ("sensor_msgs/Imu", &["linear_acceleration"], "m/s2"),
    ("sensor_msgs/Imu", &["linear_acceleration_covariance"], "m2/s4"),
    ("sensor_msgs/Imu", &["orientation_covariance"], "rad2"),
    ("sensor_msgs/MagneticField", &["magnetic_field"], "T"),
    ("sensor_msgs/NavSatFix", &["latitude", "longitude"], "deg"),
    ("sensor_msgs/NavSatFix", &["altitude"], "m"),
    ("sensor_msgs/NavSatFix", &["position_covariance"], "m2"),
    ("sensor_msgs/Range", &["field_of_view"], "rad"),
    ("sensor_msgs/Range", &["min_range", "max_range", "range"], "m"),
    ("sensor_msgs/Temperature", &["temperature"], "degC"),
    ("ackermann_msgs/AckermannDrive", &["steering_angle"], "rad"),
    ("ackermann_msgs/AckermannDrive", &["steering_angle_velocity"], "rad/s"),
    ("ackermann_msgs/AckermannDrive", &["speed"], "m/s"),
    ("ackermann_msgs/AckermannDrive", &["acceleration"], "m/s2"),
    ("ackermann_msgs/AckermannDrive", &["jerk"], "m/s3"),
    ("autoware_auto_control_msgs/AckermannLateralCommand", &["steering_tire_angle"], "rad"),
    ("autoware_auto_control_msgs/AckermannLateralCommand", &["steering_tire_rotation_rate"], "rad/s"),
    ("autoware_auto_control_msgs/LongitudinalCommand", &["speed"], "m/s"),
    ("autoware_auto_control_msgs/LongitudinalCommand", &["acceleration"], "m/s2"),
    ("autoware_auto_control_msgs/LongitudinalCommand", &["jerk"], "m/s3"),
    ("autoware_auto_vehicle_msgs/SteeringReport", &["steering_tire_angle"], "rad"),
    ("autoware_auto_vehicle_msgs/VehicleOdometry", &["velocity_mps"], "m/s"),
    ("autoware_auto_vehicle_msgs/VehicleOdometry", &["front_wheel_angle_rad", "rear_wheel_angle_rad"], "rad"),
    ("autoware_auto_vehicle_msgs/VelocityReport", &["longitudinal_velocity", "lateral_velocity"], "m/s"),
    ("autoware_auto_vehicle_msgs/VelocityReport", &["heading_rate"], "rad/s"),
    ("autoware_auto_vehicle_msgs/WheelEncoder", &["speed_mps"], "m/s"),
    ("autoware_control_msgs/Lateral", &["steering_tire_angle"], "rad"),
    ("autoware_control_msgs/Lateral", &["steering_tire_rotation_rate"], "rad/s"),
    ("autoware_control_msgs/Longitudinal", &["velocity"], "m/s"),
    ("autoware_control_msgs/Longitudinal", &["acceleration"], "m/s2"),
    ("autoware_control_msgs/Longitudinal", &["jerk"], "m/s3"),
    ("autoware_vehicle_msgs/SteeringReport", &["steering_tire_angle"], "rad"),
    ("autoware_vehicle_msgs/VelocityReport", &["longitudinal_velocity", "lateral_velocity"], "m/s"),
    ("autoware_vehicle_msgs/VelocityReport", &["heading_rate"], "rad/s"),
    // The manual of the VN-300, UM005, binary output group 1; `position` is latitude, longitude and altitude.
    ("vectornav_msgs/CommonGroup", &["timestartup", "timegps", "timesyncin"], "ns"),
    ("vectornav_msgs/CommonGroup", &["yawpitchroll"], "deg"),
    ("vectornav_msgs/CommonGroup", &["angularrate", "imu_rate"], "rad/s"),
    ("vectornav_msgs/CommonGroup", &["velocity"], "m/s"),
    ("vectornav_msgs/CommonGroup", &["accel", "imu_accel"], "m/s2"),
    ("vectornav_msgs/CommonGroup", &["magpres_temp"], "degC"),
    ("vectornav_msgs/CommonGroup", &["magpres_pres"], "kPa"),
    ("vectornav_msgs/CommonGroup", &["deltatheta_dtime"], "s"),
    ("vectornav_msgs/CommonGroup", &["deltatheta_dtheta"], "deg"),
    ("vectornav_msgs/CommonGroup", &["deltatheta_dvel"], "m/s"),
    ("vectornav_msgs/ImuGroup", &["uncompaccel", "accel"], "m/s2"),
    ("vectornav_msgs/ImuGroup", &["uncompgyro", "angularrate"], "rad/s"),
    ("vectornav_msgs/ImuGroup", &["temp"], "degC"),
    ("vectornav_msgs/ImuGroup", &["pres"], "kPa"),
    ("vectornav_msgs/ImuGroup", &["deltatheta_time"], "s"),
    ("vectornav_msgs/ImuGroup", &["deltatheta_dtheta"], "deg"),
    ("vectornav_msgs/ImuGroup", &["deltavel"], "m/s"),
    ("vectornav_msgs/InsGroup", &["posecef", "posu"], "m"),
    ("vectornav_msgs/InsGroup", &["velbody", "velned", "velecef", "velu"], "m/s"),
    ("vectornav_msgs/InsGroup", &["accelecef", "linearaccelecef"], "m/s2"),
];

/// Fields of these are no places in metres, although their type says so.
const NO_UNIT: &[(&str, &str)] =
    &[("vectornav_msgs/CommonGroup", "position"), ("vectornav_msgs/InsGroup", "poslla")];

/// The unit of all that lies in a field of a message; `Some(None)` where it has none, whatever lies in it.
pub fn standard_field_unit(message: &str, field: &str) -> Option<Option<&'static str>> {
    if NO_UNIT.contains(&(message, field)) {
        return Some(None);
    }
    let fits = |(of, fields, _): &&(&str, &[&str], &str)| *of == message && fields.contains(&field);
    UNITS.iter().find(fits).map(|(_, _, unit)| Some(*unit))
}

#[cfg(test)]
mod tests {
    use super::{NO_UNIT, UNITS};
    use crate::definition::MessageDefinition;

    #[test]
    fn the_fields_with_units_are_those_of_the_messages() {
        let rows = UNITS.iter().flat_map(|(of, fields, _)| fields.iter().map(move |it| (*of, *it)));
        for (name, field) in rows.chain(NO_UNIT.iter().copied()) {
            if name.starts_with("ros1/") {
                continue;
            }
            let definition = MessageDefinition::standard_message(name).expect(name);
            let fields = &definition.structs[definition.root_struct_index()].fields;
            assert!(fields.iter().any(|it| it.name == field), "{name} has no {field}");
        }
    }
}
