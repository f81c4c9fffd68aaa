//! Lists mistakes of units and signs that people make.

use std::f64::consts::PI;

/// A mistake in one channel: the log reads `factor` times what it should.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mistake {
    pub channel: &'static str,
    /// `unit`, `sign`, `unit_and_sign` or `steering_wheel`.
    pub kind: &'static str,
    pub words: &'static str,
    /// Lowest and highest size of the factor.
    pub range: [f64; 2],
    /// What of the factor is the unit's.
    pub scale: f64,
    /// Sign of the factor.
    pub sign: f64,
    /// How rare it is: the negative logarithm of its probability in an unknown log.
    pub nats: f64,
    /// The line that corrects it.
    pub line: &'static str,
}

impl Mistake {
    /// The factor, where nothing says more.
    pub fn middle(&self) -> f64 {
        self.sign * (self.range[0] * self.range[1]).sqrt()
    }
}

const DEG: f64 = 180.0 / PI;
/// Nats of a common mistake and of a rare one; of two at once in one channel.
const COMMON: f64 = 5.0;
const RARE: f64 = 6.5;
const TWO: f64 = 8.0;
/// Steering ratios of cars.
const RATIOS: [f64; 2] = [8.0, 25.0];

const fn unit(
    channel: &'static str,
    words: &'static str,
    factor: f64,
    nats: f64,
    line: &'static str,
) -> Mistake {
    Mistake {
        channel,
        kind: "unit",
        words,
        range: [factor, factor],
        scale: factor,
        sign: 1.0,
        nats,
        line,
    }
}

const fn mirrored(channel: &'static str) -> Mistake {
    Mistake {
        channel,
        kind: "sign",
        words: "mirrored",
        range: [1.0, 1.0],
        scale: 1.0,
        sign: -1.0,
        nats: COMMON,
        line: "sign = -1",
    }
}

const fn both(of: Mistake, words: &'static str, line: &'static str) -> Mistake {
    Mistake { kind: "unit_and_sign", words, sign: -1.0, nats: TWO, line, ..of }
}

const fn wheel(
    words: &'static str,
    scale: f64,
    sign: f64,
    nats: f64,
    line: &'static str,
) -> Mistake {
    let range = [RATIOS[0] * scale, RATIOS[1] * scale];
    Mistake { channel: "delta", kind: "steering_wheel", words, range, scale, sign, nats, line }
}

const KMH: &str = "unit = \"km/h\"";
const KMH_MIRRORED: &str = "unit = \"km/h\"; sign = -1";
const IN_KMH: &str = "in km/h, not m/s";
const IN_KMH_MIRRORED: &str = "in km/h, not m/s, and mirrored";
const IN_DEG_S: &str = "in deg/s, not rad/s";
const IN_G: &str = "in g, not m/s2";
const G: f64 = 9.80665;
const G_LINE: &str = "unit = \"g0\"";

const V_X: Mistake = unit("v_x", IN_KMH, 3.6, COMMON, KMH);
const V_Y: Mistake = unit("v_y", IN_KMH, 3.6, COMMON, KMH);
const R: Mistake = unit("r", IN_DEG_S, DEG, COMMON, "unit = \"deg/s\"");
const A_Y: Mistake = unit("a_y", IN_G, 1.0 / G, COMMON, G_LINE);
const A_X: Mistake = unit("a_x", IN_G, 1.0 / G, COMMON, G_LINE);
const DELTA: Mistake = unit("delta", "in deg, not rad", DEG, COMMON, "unit = \"deg\"");

const fn rpm(channel: &'static str) -> Mistake {
    unit(channel, "in revolutions per minute, not rad/s", 30.0 / PI, COMMON, "unit = \"rpm\"")
}

const fn rim_speed(channel: &'static str) -> Mistake {
    Mistake {
        range: [0.2, 0.45],
        ..unit(
            channel,
            "a speed in m/s, not rad/s",
            0.3,
            COMMON,
            "gain = 3.3  # one over the radius of the tire [1/m]",
        )
    }
}

/// All mistakes that are looked for.
pub(super) const MISTAKES: [Mistake; 36] = [
    V_X,
    mirrored("v_x"),
    both(V_X, IN_KMH_MIRRORED, KMH_MIRRORED),
    unit("v_x", "in mph, not m/s", 2.236_936, RARE, "unit = \"mph\""),
    V_Y,
    mirrored("v_y"),
    both(V_Y, IN_KMH_MIRRORED, KMH_MIRRORED),
    unit("v_y", "in mph, not m/s", 2.236_936, RARE, "unit = \"mph\""),
    R,
    mirrored("r"),
    both(R, "in deg/s, not rad/s, and mirrored", "unit = \"deg/s\"; sign = -1"),
    A_Y,
    mirrored("a_y"),
    both(A_Y, "in g, not m/s2, and mirrored", "unit = \"g0\"; sign = -1"),
    A_X,
    mirrored("a_x"),
    both(A_X, "in g, not m/s2, and mirrored", "unit = \"g0\"; sign = -1"),
    DELTA,
    mirrored("delta"),
    both(DELTA, "in deg, not rad, and mirrored", "unit = \"deg\"; sign = -1"),
    wheel("that of the steering wheel", 1.0, 1.0, COMMON, ""),
    wheel("that of the steering wheel, mirrored", 1.0, -1.0, TWO, ""),
    wheel("that of the steering wheel in deg", DEG, 1.0, RARE, "; unit = \"deg\""),
    wheel("that of the steering wheel in deg, mirrored", DEG, -1.0, TWO + 1.0, "; unit = \"deg\""),
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
