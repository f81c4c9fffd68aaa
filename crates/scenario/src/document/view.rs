//! The keys of `[view]`, the layout of the replay.

use diagnostics::Spanned;
use recording::view::CurveRole;
use schemars::JsonSchema;
use serde::Deserialize;

/// Layout of the replay. A number is a signal, `"plant.v_x"`, or a formula of signals in the language of checks,
/// `"plant.F_yf / plant.F_zf"`.
///
/// ```toml
/// [view]
/// pose = { x = "plant.x", y = "plant.y", heading = "plant.psi" }
/// ```
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct View {
    /// Moving body.
    pub pose: Option<Pose>,
    /// Covered distance [m]; the length of the driven line without it.
    #[schemars(example = &"plant.s")]
    pub distance: Option<Spanned<String>>,
    /// Speed [m/s]. Its integral is the distance when there is neither `distance` nor `pose`.
    #[schemars(example = &"plant.v_x")]
    pub speed: Option<Spanned<String>>,
    /// Edges of the road.
    pub track: Option<Spanned<Track>>,
    /// Arrows on the moving body.
    #[serde(default)]
    pub arrow: Vec<Arrow>,
    /// Diagrams of one quantity over another.
    #[serde(default)]
    pub xy_plot: Vec<XyPlot>,
    /// Patterns of signals that the replay has beside those of `[view]` and checks. Without them it has all signals of a run with at most 400.
    #[schemars(example = &["plant.*"])]
    pub signals: Option<Vec<Spanned<String>>>,
    /// Diagrams over time. Without one, each unit of each node gets a diagram.
    #[serde(default)]
    pub plot: Vec<Plot>,
}

/// Moving body.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Position east [m].
    #[schemars(example = &"plant.x")]
    pub x: Spanned<String>,
    /// Position north [m].
    #[schemars(example = &"plant.y")]
    pub y: Spanned<String>,
    /// Heading [rad].
    #[schemars(example = &"plant.psi")]
    pub heading: Spanned<String>,
    /// Road-wheel angle [rad].
    #[schemars(example = &"plant.delta")]
    pub steer: Option<Spanned<String>>,
    /// Speed [m/s].
    #[schemars(example = &"plant.v_x")]
    pub speed: Option<Spanned<String>>,
    /// Length of the drawn box [m].
    #[serde(default = "Pose::default_length")]
    #[schemars(example = 4.2)]
    pub length: f64,
    /// Width of the drawn box [m].
    #[serde(default = "Pose::default_width")]
    #[schemars(example = 1.8)]
    pub width: f64,
    /// Distances of front and rear axle ahead of the position [m]; 0.30 and -0.29 times the length without it.
    #[schemars(example = [1.4, -1.6])]
    pub axles: Option<[f64; 2]>,
}

impl Pose {
    /// Length of a box whose size nobody tells [m].
    pub const DEFAULT_LENGTH: f64 = 4.5;
    /// Its width [m].
    pub const DEFAULT_WIDTH: f64 = 1.9;

    fn default_length() -> f64 {
        Self::DEFAULT_LENGTH
    }
    fn default_width() -> f64 {
        Self::DEFAULT_WIDTH
    }
}

/// Edges of the road: both edges, or a centre line with widths.
///
/// ```toml
/// [view.track]
/// path = "track.csv"
/// center = ["x_m", "y_m"]
/// widths = ["left_m", "right_m"]
/// closed = true
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Track {
    /// CSV file with a row for each point, relative to the scenario file. The other keys name its columns then, else signals
    /// of the run.
    #[schemars(example = &"track.csv")]
    pub path: Option<Spanned<String>>,
    /// Left edge: x and y [m].
    #[schemars(example = ["left_x", "left_y"])]
    pub left: Option<[Spanned<String>; 2]>,
    /// Right edge: x and y [m].
    #[schemars(example = ["right_x", "right_y"])]
    pub right: Option<[Spanned<String>; 2]>,
    /// Centre line: x and y [m].
    #[schemars(example = ["x_m", "y_m"])]
    pub center: Option<[Spanned<String>; 2]>,
    /// Distance from the centre line to each edge [m].
    #[schemars(example = 3.5)]
    pub half_width: Option<f64>,
    /// Columns with the distances from the centre line to the left and the right edge [m].
    #[schemars(example = ["left_m", "right_m"])]
    pub widths: Option<[Spanned<String>; 2]>,
    /// Whether the first point of the file follows the last one.
    #[serde(default)]
    #[schemars(example = true)]
    pub closed: bool,
}

/// An arrow on the moving body.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Arrow {
    /// Name.
    #[schemars(example = &"front tire force")]
    pub label: String,
    /// Meaning, which gives the colour.
    #[serde(default)]
    #[schemars(example = &"plant")]
    pub role: CurveRole,
    /// Foot of the arrow: ahead of the position, to the left, above the ground [m].
    #[schemars(example = [1.4, 0.0, 0.3])]
    pub at: [f64; 3],
    /// Component ahead.
    #[schemars(example = &"plant.F_xf")]
    pub x: Option<Spanned<String>>,
    /// Component to the left.
    #[schemars(example = &"plant.F_yf")]
    pub y: Option<Spanned<String>>,
    /// Angle of the frame of both components against the body [rad], such as that of a steered wheel.
    #[schemars(example = &"plant.delta")]
    pub turn: Option<Spanned<String>>,
    /// Length of the drawn arrow for a vector of length 1 [m].
    #[schemars(example = 0.0005)]
    pub scale: Spanned<f64>,
}

/// A diagram of one quantity over another.
///
/// ```toml
/// [[view.xy_plot]]
/// title = "Tire curve"
/// x = { label = "slip angle [rad]", range = [-0.2, 0.2] }
/// y = { label = "F_y / F_z [1]", range = [-1.5, 1.5] }
/// points = [{ label = "front", x = "plant.alpha_f", y = "plant.F_yf / plant.F_zf" }]
/// curves = [{ label = "tire", y = "1.6 * sin(1.8 * atan(22 * x))" }]
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct XyPlot {
    /// Title.
    #[schemars(example = &"Tire curve")]
    pub title: String,
    /// Axis from left to right.
    pub x: Axis,
    /// Axis from bottom to top.
    pub y: Axis,
    /// Radius of a circle around the origin, in the unit of the axes.
    #[schemars(example = 9.81)]
    pub circle: Option<f64>,
    /// Half axes of an ellipse around the origin, along x and along y: a tire that grips one way more than the other.
    #[schemars(example = &[1.4, 1.5])]
    pub ellipse: Option<Spanned<[f64; 2]>>,
    /// Duration of the trails of moving points [s].
    #[serde(default = "XyPlot::default_trail")]
    #[schemars(example = 3.0)]
    pub trail: f64,
    /// Moving points.
    #[serde(default)]
    pub points: Vec<Point>,
    /// Curves.
    #[serde(default)]
    pub curves: Vec<FunctionCurve>,
}

impl XyPlot {
    fn default_trail() -> f64 {
        1.5
    }
}

/// An axis of a diagram.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Label with the unit.
    #[schemars(example = &"F_y / F_z [1]")]
    pub label: String,
    /// Both ends; the first one may be the larger one.
    #[schemars(example = [-1.5, 1.5])]
    pub range: Spanned<[f64; 2]>,
}

/// A moving point of a diagram.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Name.
    #[schemars(example = &"front")]
    pub label: String,
    /// Meaning, which gives the colour.
    #[serde(default)]
    #[schemars(example = &"plant")]
    pub role: CurveRole,
    /// Value on the axis `x`.
    #[schemars(example = &"plant.alpha_f")]
    pub x: Spanned<String>,
    /// Value on the axis `y`.
    #[schemars(example = &"plant.F_yf / plant.F_zf")]
    pub y: Spanned<String>,
}

/// A curve of a diagram.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FunctionCurve {
    /// Name.
    #[schemars(example = &"tire")]
    pub label: String,
    /// Meaning, which gives the colour.
    #[serde(default)]
    #[schemars(example = &"plant")]
    pub role: CurveRole,
    /// Formula of `x` and of signals.
    #[schemars(example = &"1.6 * sin(1.8 * atan(22 * x))")]
    pub y: Spanned<String>,
}

/// A diagram over time.
///
/// ```toml
/// [[view.plot]]
/// title = "Speed"
/// unit = "km/h"
/// signals = [{ signal = "plant.v_x", role = "plant" }]
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plot {
    /// Title without unit.
    #[schemars(example = &"Speed")]
    pub title: String,
    /// Unit of the axis; that of the first signal without it.
    #[schemars(example = &"km/h")]
    pub unit: Option<Spanned<String>>,
    /// Lower and upper end of the axis; the range of the values without it.
    #[schemars(example = [0.0, 120.0])]
    pub range: Option<[f64; 2]>,
    /// Curves.
    pub signals: Vec<Curve>,
}

/// A curve of a diagram over time.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// Recorded variable, or a formula of several.
    #[schemars(example = &"plant.v_x")]
    pub signal: Spanned<String>,
    /// Unit of a signal or a formula without one. It must not contradict those of the signals.
    #[schemars(example = &"m/s")]
    pub unit: Option<Spanned<String>>,
    /// Standard deviation, in the unit of the signal. A band of 2 of them is drawn around the curve.
    #[schemars(example = &"estimator.v_x_std")]
    pub std: Option<Spanned<String>>,
    /// Meaning, which gives the colour.
    #[serde(default)]
    #[schemars(example = &"plant")]
    pub role: CurveRole,
    /// Name in the legend; that of the signal without it.
    #[schemars(example = &"speed")]
    pub label: Option<String>,
}
