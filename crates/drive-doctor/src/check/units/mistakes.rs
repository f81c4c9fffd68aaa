//! Lists mistakes of units and signs that people make.

use std::f64::consts::PI;

use numerics::text::significant;
use preparation::ColumnKey;
use units::STANDARD_GRAVITY;

use crate::correction::{Correction, Key};

/// What a mistake is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
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
pub(super) struct Mistake {
    pub channel: &'static str,
    pub kind: Kind,
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

impl Mistake {
    /// Whether a channel has it.
    pub fn is_of(&self, channel: &str) -> bool {
        self.channel == channel || self.channel == WHEELS && channel.starts_with("omega_")
    }

    /// Whether some channel would have both.
    pub fn excludes(&self, other: &Self) -> bool {
        self.is_of(other.channel) || other.is_of(self.channel)
    }

    /// The factor, where nothing says more.
    pub fn middle(&self) -> f64 {
        self.sign * (self.range[0] * self.range[1]).sqrt()
    }

    /// The mistake as a name: `v_x_unit`, `a_y_sign`, `delta_steering_wheel`.
    pub fn check(&self) -> String {
        let kind = match self.kind {
            Kind::Unit | Kind::RimSpeed => "unit",
            Kind::Sign => "sign",
            Kind::UnitAndSign => "unit_and_sign",
            Kind::SteeringWheel => "steering_wheel",
        };
        format!("{}_{kind}", self.channel)
    }

    /// The mistake in words, with a factor that is found only now.
    pub fn what(&self, factor: f64) -> String {
        let mirrored = if self.sign < 0.0 { "mirrored" } else { "" };
        let ratio = match self.kind {
            Kind::SteeringWheel => {
                format!(", {} times that of the road wheels", self.ratio(factor, 2))
            }
            _ => String::new(),
        };
        let parts = [format!("{}{ratio}", self.words), mirrored.to_owned()];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(", and ")
    }

    fn ratio(&self, factor: f64, digits: usize) -> String {
        significant(factor.abs() / self.scale, digits)
    }

    /// What corrects it, with a factor that is found only now.
    pub fn correction(&self, factor: f64) -> Correction {
        let gain = match self.kind {
            Kind::SteeringWheel | Kind::RimSpeed => {
                Some(ColumnKey::Gain(self.scale / factor.abs()).into())
            }
            _ => None,
        };
        let mirrored = (self.sign < 0.0).then_some(Key::Mirrored);
        let keys = [self.unit.map(Key::Unit), gain, mirrored];
        let correction = Correction::column(&keys.into_iter().flatten().collect::<Vec<_>>());
        match self.kind {
            Kind::SteeringWheel => {
                correction.noting("the gain is one over the steering ratio: write yours")
            }
            Kind::RimSpeed => {
                correction.noting("the gain is one over the radius of the tire [1/m]")
            }
            Kind::Unit | Kind::UnitAndSign => correction.noting(format!(
                "or gain = {} where the file says another unit itself",
                significant(1.0 / self.scale, 4)
            )),
            Kind::Sign => correction,
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

const fn unit(
    channel: &'static str,
    words: &'static str,
    unit: &'static str,
    factor: f64,
    nats: f64,
) -> Mistake {
    Mistake {
        channel,
        kind: Kind::Unit,
        words,
        unit: Some(unit),
        range: [factor, factor],
        scale: factor,
        sign: 1.0,
        nats,
    }
}

const fn mirrored(channel: &'static str) -> Mistake {
    Mistake {
        channel,
        kind: Kind::Sign,
        words: "",
        unit: None,
        range: [1.0, 1.0],
        scale: 1.0,
        sign: -1.0,
        nats: COMMON,
    }
}

const fn both(of: Mistake) -> Mistake {
    Mistake { kind: Kind::UnitAndSign, sign: -1.0, nats: TWO, ..of }
}

const fn wheel(of: Mistake, words: &'static str, sign: f64, nats: f64) -> Mistake {
    let range = [RATIOS[0] * of.scale, RATIOS[1] * of.scale];
    Mistake { kind: Kind::SteeringWheel, words, range, sign, nats, ..of }
}

const fn kmh(channel: &'static str) -> Mistake {
    unit(channel, "in km/h, not m/s", "km/h", 3.6, COMMON)
}

const fn mph(channel: &'static str) -> Mistake {
    unit(channel, "in mph, not m/s", "mph", 2.236_936, RARE)
}

const fn gravities(channel: &'static str) -> Mistake {
    unit(channel, "in g, not m/s2", "g0", 1.0 / STANDARD_GRAVITY, COMMON)
}

const fn rpm(channel: &'static str) -> Mistake {
    unit(channel, "in revolutions per minute, not rad/s", "rpm", 30.0 / PI, COMMON)
}

const fn rim_speed(channel: &'static str) -> Mistake {
    Mistake {
        channel,
        kind: Kind::RimSpeed,
        words: "a speed in m/s, not rad/s",
        unit: None,
        range: RADII,
        scale: 1.0,
        sign: 1.0,
        nats: COMMON,
    }
}

const R: Mistake = unit("r", "in deg/s, not rad/s", "deg/s", DEG, COMMON);
const DELTA: Mistake = unit("delta", "in deg, not rad", "deg", DEG, COMMON);
const WHEEL: &str = "that of the steering wheel";
const WHEEL_DEG: &str = "that of the steering wheel in deg";
/// The angle in rad, whose unit needs no word.
const IN_RAD: Mistake = Mistake { unit: None, ..unit("delta", "", "rad", 1.0, COMMON) };

/// All mistakes that are looked for.
pub(super) const MISTAKES: [Mistake; 40] = [
    kmh("v_x"),
    mirrored("v_x"),
    both(kmh("v_x")),
    mph("v_x"),
    kmh("v_y"),
    mirrored("v_y"),
    both(kmh("v_y")),
    mph("v_y"),
    R,
    mirrored("r"),
    both(R),
    gravities("a_y"),
    mirrored("a_y"),
    both(gravities("a_y")),
    gravities("a_x"),
    mirrored("a_x"),
    both(gravities("a_x")),
    DELTA,
    mirrored("delta"),
    both(DELTA),
    wheel(IN_RAD, WHEEL, 1.0, COMMON),
    wheel(IN_RAD, WHEEL, -1.0, TWO),
    wheel(DELTA, WHEEL_DEG, 1.0, RARE),
    wheel(DELTA, WHEEL_DEG, -1.0, TWO + 1.0),
    unit("roll", "in deg, not rad", "deg", DEG, COMMON),
    rpm(WHEELS),
    rim_speed(WHEELS),
    mirrored(WHEELS),
    rpm("omega_fl"),
    rpm("omega_fr"),
    rpm("omega_rl"),
    rpm("omega_rr"),
    rim_speed("omega_fl"),
    rim_speed("omega_fr"),
    rim_speed("omega_rl"),
    rim_speed("omega_rr"),
    mirrored("omega_fl"),
    mirrored("omega_fr"),
    mirrored("omega_rl"),
    mirrored("omega_rr"),
];
