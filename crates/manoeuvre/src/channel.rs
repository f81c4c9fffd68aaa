//! Names the variables of a car that manoeuvres measure.

/// A variable of the car that a manoeuvre measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Channel {
    /// Forward speed of the centre of gravity.
    ForwardSpeed,
    /// Speed of the centre of gravity to the left.
    SideSpeed,
    /// Yaw rate, positive to the left.
    YawRate,
    /// Acceleration to the left.
    LateralAcceleration,
    /// Position east.
    East,
    /// Position north.
    North,
    /// Heading, counter-clockwise from east.
    Heading,
}

impl Channel {
    /// All of them.
    pub const ALL: [Channel; 7] = [
        Channel::ForwardSpeed,
        Channel::SideSpeed,
        Channel::YawRate,
        Channel::LateralAcceleration,
        Channel::East,
        Channel::North,
        Channel::Heading,
    ];

    /// Where the car is and which way it points.
    pub const POSE: [Channel; 3] = [Channel::East, Channel::North, Channel::Heading];

    /// The usual name of the variable.
    #[must_use]
    pub const fn variable_name(self) -> &'static str {
        match self {
            Channel::ForwardSpeed => "v_x",
            Channel::SideSpeed => "v_y",
            Channel::YawRate => "r",
            Channel::LateralAcceleration => "a_y",
            Channel::East => "X",
            Channel::North => "Y",
            Channel::Heading => "psi",
        }
    }

    /// Its unit.
    #[must_use]
    pub const fn unit_name(self) -> &'static str {
        match self {
            Channel::ForwardSpeed | Channel::SideSpeed => "m/s",
            Channel::YawRate => "rad/s",
            Channel::LateralAcceleration => "m/s2",
            Channel::East | Channel::North => "m",
            Channel::Heading => "rad",
        }
    }

    /// What it is.
    #[must_use]
    pub const fn description(self) -> &'static str {
        match self {
            Channel::ForwardSpeed => "forward speed",
            Channel::SideSpeed => "speed to the left",
            Channel::YawRate => "yaw rate",
            Channel::LateralAcceleration => "lateral acceleration",
            Channel::East => "position east",
            Channel::North => "position north",
            Channel::Heading => "heading",
        }
    }

    /// Its place among [`ALL`](Self::ALL).
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// -1 when it changes its sign in a mirror that swaps left and right.
    #[must_use]
    pub const fn mirror_sign(self) -> f64 {
        match self {
            Channel::ForwardSpeed | Channel::East => 1.0,
            _ => -1.0,
        }
    }
}
