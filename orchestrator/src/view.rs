//! Says how a replay is laid out, by column and not by name: what the viewer needs to know of `[view]`.

/// The layout of a replay.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// The moving body, when the scenario names one.
    pub pose: Option<Pose>,
    /// The time plots, from top to bottom.
    pub plots: Vec<Plot>,
}

/// Where the moving body is; every member but `length` and `width` is a column of the row.
#[derive(Debug, Clone)]
pub struct Pose {
    /// Position east [m].
    pub x: usize,
    /// Position north [m].
    pub y: usize,
    /// Heading [rad], counter-clockwise from x.
    pub heading: usize,
    /// Road-wheel angle of the steered wheels [rad].
    pub steer: Option<usize>,
    /// Speed [m/s], which colours the driven line.
    pub speed: Option<usize>,
    /// Length of the drawn box [m].
    pub length: f64,
    /// Width of the drawn box [m].
    pub width: f64,
}

/// One time plot.
#[derive(Debug, Clone)]
pub struct Plot {
    /// Its title, with the unit in brackets.
    pub title: String,
    /// Its curves.
    pub series: Vec<Series>,
}

/// One curve of a plot.
#[derive(Debug, Clone)]
pub struct Series {
    /// The column of the row.
    pub column: usize,
    /// What the value is multiplied by to get the plot's unit.
    pub factor: f64,
    /// What is added after that.
    pub offset: f64,
    /// Its name in the legend.
    pub label: String,
    /// What the curve stands for, which decides its colour.
    pub role: Role,
}

/// What a curve stands for; one role has one colour in every view.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Nothing in particular: a colour by position.
    #[default]
    Other,
    /// A set point.
    Reference,
    /// The truth.
    Plant,
    /// What a sensor says.
    Measurement,
    /// What an estimator says.
    Estimate,
    /// A disturbance, a limit or a fault.
    Limit,
}
