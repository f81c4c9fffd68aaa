//! Names what a scenario may say about its replay.

use recording::view::Role;
use serde::Deserialize;
use toml::Spanned;

/// `[view]`. Where a number is wanted, there may be a signal, `"plant.v_x"`, or what is computed from signals as in a check,
/// `"plant.F_yf / plant.F_zf"`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct View {
    /// The moving body.
    pub pose: Option<Pose>,
    /// The distance that was covered [m]; the length of the driven line unless it is given.
    pub distance: Option<Spanned<String>>,
    /// The speed [m/s], whose integral is the distance when there is neither that nor a moving body.
    pub speed: Option<Spanned<String>>,
    /// The edges of the road.
    pub track: Option<Spanned<Track>>,
    /// Arrows that the body carries.
    #[serde(default)]
    pub arrow: Vec<Arrow>,
    /// Diagrams of one quantity over another.
    #[serde(default)]
    pub plane: Vec<Plane>,
    /// Time plots.
    #[serde(default)]
    pub plot: Vec<Plot>,
}

/// `[view.pose]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// Position east [m].
    pub x: Spanned<String>,
    /// Position north [m].
    pub y: Spanned<String>,
    /// Heading [rad].
    pub heading: Spanned<String>,
    /// Road-wheel angle [rad].
    pub steer: Option<Spanned<String>>,
    /// Speed [m/s].
    pub speed: Option<Spanned<String>>,
    /// Length of the drawn box [m].
    #[serde(default = "Pose::default_length")]
    pub length: f64,
    /// Width of the drawn box [m].
    #[serde(default = "Pose::default_width")]
    pub width: f64,
    /// How far the front and the rear axle are ahead of the position [m]; shares of the length unless given.
    pub axles: Option<[f64; 2]>,
}

impl Pose {
    fn default_length() -> f64 {
        4.5
    }
    fn default_width() -> f64 {
        1.9
    }
}

/// `[view.track]`: two edges, or a centre line with widths.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Track {
    /// A CSV file with a row for each point, relative to the scenario file; then the words below are its columns and not
    /// signals of the run.
    pub path: Option<Spanned<String>>,
    /// x and y of the left edge [m].
    pub left: Option<[Spanned<String>; 2]>,
    /// x and y of the right edge [m].
    pub right: Option<[Spanned<String>; 2]>,
    /// x and y of the centre line [m].
    pub center: Option<[Spanned<String>; 2]>,
    /// From the centre line to each edge [m].
    pub half_width: Option<f64>,
    /// Columns with the distances from the centre line to the left and the right edge [m].
    pub widths: Option<[Spanned<String>; 2]>,
    /// Whether the last point of the file is followed by the first one.
    #[serde(default)]
    pub closed: bool,
}

/// `[[view.arrow]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arrow {
    /// Its name.
    pub label: String,
    /// What it stands for.
    #[serde(default)]
    pub role: Role,
    /// Where it starts: ahead of the position, to the left, above the ground [m].
    pub at: [f64; 3],
    /// Its component ahead.
    pub x: Option<Spanned<String>>,
    /// Its component to the left.
    pub y: Option<Spanned<String>>,
    /// The angle of the frame of both against the body [rad], such as that of a steered wheel.
    pub turn: Option<Spanned<String>>,
    /// Its length [m] for a vector of length 1.
    pub scale: Spanned<f64>,
}

/// `[[view.plane]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Its title.
    pub title: String,
    /// The axis from left to right.
    pub x: Axis,
    /// The axis from bottom to top.
    pub y: Axis,
    /// Radius of a circle around the origin.
    pub circle: Option<f64>,
    /// How long points leave a trail [s].
    #[serde(default = "Plane::default_trail")]
    pub trail: f64,
    /// Moving points.
    #[serde(default)]
    pub points: Vec<Point>,
    /// Curves.
    #[serde(default)]
    pub curves: Vec<Function>,
}

impl Plane {
    fn default_trail() -> f64 {
        1.5
    }
}

/// An axis of a plane.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// What it shows, with its unit: `"F_y / F_z [1]"`.
    pub label: String,
    /// Its ends; the first one may be the larger one.
    pub range: Spanned<[f64; 2]>,
}

/// A moving point of a plane.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Its name.
    pub label: String,
    /// What it stands for.
    #[serde(default)]
    pub role: Role,
    /// Its place on the axis x.
    pub x: Spanned<String>,
    /// Its place on the axis y.
    pub y: Spanned<String>,
}

/// A curve of a plane: `{ y = "1.6 * sin(1.8 * atan(22 * x))", label = "tire" }`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Function {
    /// Its name.
    pub label: String,
    /// What it stands for.
    #[serde(default)]
    pub role: Role,
    /// Its y, computed from `x` and from signals.
    pub y: Spanned<String>,
}

/// `[[view.plot]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plot {
    /// Its title, without unit.
    pub title: String,
    /// The unit of the axis; that of the signals unless it is given.
    pub unit: Option<Spanned<String>>,
    /// The lower and the upper end of the axis; what there is to show unless it is given.
    pub range: Option<[f64; 2]>,
    /// Its curves.
    pub signals: Vec<Curve>,
}

/// A curve of a plot: `{ signal = "plant.v_x", role = "plant" }`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// The recorded variable, or what is computed from some.
    pub signal: Spanned<String>,
    /// The unit of what is computed; a signal has its own.
    pub unit: Option<Spanned<String>>,
    /// The standard deviation of the signal, in its unit: a band of 2 of them is drawn around it.
    pub std: Option<Spanned<String>>,
    /// What it stands for.
    #[serde(default)]
    pub role: Role,
    /// Its name in the legend; the signal's unless it is given.
    pub label: Option<String>,
}
