//! Lists mistakes of units and signs that people make.

use std::f64::consts::PI;

use numerics::text::format_significant;
use preparation::ColumnKey;
use units::STANDARD_GRAVITY;

use crate::correction::{CorrectionKey, LogCorrection};

/// What a mistake is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MistakeKind {
    Unit,
    Sign,
    UnitAndSign,
    /// The angle of the steering wheel in place of that of the road wheels.
    SteeringWheel,
    /// The speed of a wheel's rim in place of its angular velocity.
    RimSpeed,
}

/// A mistake in one channel: the log reads `factor` times what it should.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChannelMistake {
    pub channel: &'static str,
    pub kind: MistakeKind,
    /// As "in km/h, not m/s".
    words: &'static str,
    /// The unit in which the channel is.
    unit: Option<&'static str>,
    /// Lowest and highest size of the factor.
    pub range: [f64; 2],
    /// What of the factor is the unit's.
    scale: f64,
    /// Sign of the factor.
    pub sign: f64,
    /// How rare it is: the negative logarithm of its probability in an unknown log.
    pub nats: f64,
}

/// All wheels at once: what is wrong with one is mostly wrong with all.
const WHEELS: &str = "omega";

impl ChannelMistake {
    /// Whether a channel has it.
    pub fn is_in_channel(&self, channel: &str) -> bool {
        self.channel == channel || self.channel == WHEELS && channel.starts_with("omega_")
    }

    /// Whether some channel would have both.
    pub fn is_exclusive_with(&self, other: &Self) -> bool {
        self.is_in_channel(other.channel) || other.is_in_channel(self.channel)
    }

    /// The factor, where nothing says more.
    pub fn typical_factor(&self) -> f64 {
        self.sign * (self.range[0] * self.range[1]).sqrt()
    }

    /// The mistake as a name: `v_x_unit`, `a_y_sign`, `delta_steering_wheel`.
    pub fn check_name(&self) -> String {
        let kind = match self.kind {
            MistakeKind::Unit | MistakeKind::RimSpeed => "unit",
            MistakeKind::Sign => "sign",
            MistakeKind::UnitAndSign => "unit_and_sign",
            MistakeKind::SteeringWheel => "steering_wheel",
        };
        format!("{}_{kind}", self.channel)
    }

    /// The mistake in words, with a factor that is found only now.
    pub fn describe_mistake(&self, factor: f64) -> String {
        let mirrored = if self.sign < 0.0 { "mirrored" } else { "" };
        let ratio = match self.kind {
            MistakeKind::SteeringWheel => {
                format!(", {} times that of the road wheels", self.formatted_ratio(factor, 2))
            }
            _ => String::new(),
        };
        let parts = [format!("{}{ratio}", self.words), mirrored.to_owned()];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", and ")
    }

    fn formatted_ratio(&self, factor: f64, digits: usize) -> String {
        format_significant(factor.abs() / self.scale, digits)
    }

    /// What corrects it, with a factor that is found only now.
    pub fn mistake_correction(&self, factor: f64) -> LogCorrection {
        let gain = match self.kind {
            MistakeKind::SteeringWheel | MistakeKind::RimSpeed => {
                Some(ColumnKey::Gain(self.scale / factor.abs()).into())
            }
            _ => None,
        };
        let mirrored = (self.sign < 0.0).then_some(CorrectionKey::Mirrored);
        let keys = [self.unit.map(CorrectionKey::Unit), gain, mirrored];
        let correction = LogCorrection::from_column_keys(&keys.into_iter().flatten().collect::<Vec<_>>());
        match self.kind {
            MistakeKind::SteeringWheel => {
                correction.with_note("the gain is one over the steering ratio: write yours")
            }
            MistakeKind::RimSpeed => {
                correction.with_note("the gain is one over the radius of the tire [1/m]")
            }
            MistakeKind::Unit | MistakeKind::UnitAndSign => correction.with_note(format!(
                "or gain = {} where the file says another unit itself",
                format_significant(1.0 / self.scale, 4)
            )),
            MistakeKind::Sign => correction,
        }
    }
}

const DEG: f64 = 180.0 / PI;
/// Nats of a common mistake and of a rare one; of two at once in one channel.
const COMMON: f64 = 5.0;
const RARE: f64 = 6.5;
const TWO: f64 = 8.0;
/// Steering ratios of cars.
const RATIOS: [f64; 2] = [8.0, 25.0];
/// Radii of tires of cars [m].
const RADII: [f64; 2] = [0.2, 0.45];

const fn unit_mistake(
    channel: &'static str,
    words: &'static str,
    unit: &'static str,
    factor: f64,
    nats: f64,
) -> ChannelMistake {
    ChannelMistake {
        channel,
        kind: MistakeKind::Unit,
        words,
        unit: Some(unit),
        range: [factor, factor],
        scale: factor,
        sign: 1.0,
        nats,
    }
}

const fn sign_mistake(channel: &'static str) -> ChannelMistake {
    ChannelMistake {
        channel,
        kind: MistakeKind::Sign,
        words: "",
        unit: None,
        range: [1.0, 1.0],
        scale: 1.0,
        sign: -1.0,
        nats: COMMON,
    }
}

const fn unit_and_sign_mistake(of: ChannelMistake) -> ChannelMistake {
    ChannelMistake { kind: MistakeKind::UnitAndSign, sign: -1.0, nats: TWO, ..of }
}

const fn steering_wheel_mistake(
    of: ChannelMistake,
    words: &'static str,
    sign: f64,
    nats: f64,
) -> ChannelMistake {
    let range = [RATIOS[0] * of.scale, RATIOS[1] * of.scale];
    ChannelMistake { kind: MistakeKind::SteeringWheel, words, range, sign, nats, ..of }
}

const fn kmh_mistake(channel: &'static str) -> ChannelMistake {
    unit_mistake(channel, "in km/h, not m/s", "km/h", 3.6, COMMON)
}

const fn mph_mistake(channel: &'static str) -> ChannelMistake {
    unit_mistake(channel, "in mph, not m/s", "mph", 2.236_936, RARE)
}

const fn g_unit_mistake(channel: &'static str) -> ChannelMistake {
    unit_mistake(channel, "in g, not m/s2", "g0", 1.0 / STANDARD_GRAVITY, COMMON)
}

const fn rpm_mistake(channel: &'static str) -> ChannelMistake {
    unit_mistake(channel, "in revolutions per minute, not rad/s", "rpm", 30.0 / PI, COMMON)
}

const fn rim_speed(channel: &'static str) -> ChannelMistake {
    ChannelMistake {
        channel,
        kind: MistakeKind::RimSpeed,
        words: "a speed in m/s, not rad/s",
        unit: None,
        range: RADII,
        scale: 1.0,
        sign: 1.0,
        nats: COMMON,
    }
}

const R: ChannelMistake = unit_mistake("r", "in deg/s, not rad/s", "deg/s", DEG, COMMON);
const DELTA: ChannelMistake = unit_mistake("delta", "in deg, not rad", "deg", DEG, COMMON);
const WHEEL: &str = "that of the steering wheel";
const WHEEL_DEG: &str = "that of the steering wheel in deg";
/// The angle in rad, whose unit needs no word.
const IN_RAD: ChannelMistake = ChannelMistake { unit: None, ..unit_mistake("delta", "", "rad", 1.0, COMMON) };

/// All mistakes that are looked for.
pub(super) const MISTAKES: [ChannelMistake; 40] = [
    kmh_mistake("v_x"),
    sign_mistake("v_x"),
    unit_and_sign_mistake(kmh_mistake("v_x")),
    mph_mistake("v_x"),
    kmh_mistake("v_y"),
    sign_mistake("v_y"),
    unit_and_sign_mistake(kmh_mistake("v_y")),
    mph_mistake("v_y"),
    R,
    sign_mistake("r"),
    unit_and_sign_mistake(R),
    g_unit_mistake("a_y"),
    sign_mistake("a_y"),
    unit_and_sign_mistake(g_unit_mistake("a_y")),
    g_unit_mistake("a_x"),
    sign_mistake("a_x"),
    unit_and_sign_mistake(g_unit_mistake("a_x")),
    DELTA,
    sign_mistake("delta"),
    unit_and_sign_mistake(DELTA),
    steering_wheel_mistake(IN_RAD, WHEEL, 1.0, COMMON),
    steering_wheel_mistake(IN_RAD, WHEEL, -1.0, TWO),
    steering_wheel_mistake(DELTA, WHEEL_DEG, 1.0, RARE),
    steering_wheel_mistake(DELTA, WHEEL_DEG, -1.0, TWO + 1.0),
    unit_mistake("roll", "in deg, not rad", "deg", DEG, COMMON),
    rpm_mistake(WHEELS),
    rim_speed(WHEELS),
    sign_mistake(WHEELS),
    rpm_mistake("omega_fl"),
    rpm_mistake("omega_fr"),
    rpm_mistake("omega_rl"),
    rpm_mistake("omega_rr"),
    rim_speed("omega_fl"),
    rim_speed("omega_fr"),
    rim_speed("omega_rl"),
    rim_speed("omega_rr"),
    sign_mistake("omega_fl"),
    sign_mistake("omega_fr"),
    sign_mistake("omega_rl"),
    sign_mistake("omega_rr"),
];
