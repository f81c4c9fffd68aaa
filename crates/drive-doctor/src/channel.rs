//! The channels that are looked at, with their units.

/// Channels that are looked at, with their units. ISO 8855 axes: x forward, y left, z up; left turns are positive. `roll` is
/// that of the body with the road under it, `course` the direction of travel over ground, `x` and `y` the place on the ground: a
/// course is made of them where there is none.
pub const CHANNELS: [(&str, &str); 15] = [
    ("v_x", "m/s"),
    ("v_y", "m/s"),
    ("r", "rad/s"),
    ("a_x", "m/s2"),
    ("a_y", "m/s2"),
    ("delta", "rad"),
    ("F_x", "N"),
    ("omega_fl", "rad/s"),
    ("omega_fr", "rad/s"),
    ("omega_rl", "rad/s"),
    ("omega_rr", "rad/s"),
    ("roll", "rad"),
    ("course", "rad"),
    ("x", "m"),
    ("y", "m"),
];

/// The unit of a channel.
pub(crate) fn channel_unit(name: &str) -> &'static str {
    CHANNELS.iter().find(|(of, _)| *of == name).map_or("1", |(_, unit)| unit)
}
