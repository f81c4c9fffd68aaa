//! The diagrams that a standard shows of a test: curves, fitted lines and marks between two axes.

/// A diagram of a test.
#[derive(Debug, Clone, PartialEq)]
pub struct TestDiagram {
    /// What it shows.
    pub title: String,
    /// The axis to the right: name and unit.
    pub x_label: &'static str,
    /// The axis upwards: name and unit.
    pub y_label: &'static str,
    /// What the axis to the right has.
    pub x_scale: DiagramScale,
    /// The ends of the axis upwards; those of the layers without it.
    pub y_range: Option<[f64; 2]>,
    /// From back to front.
    pub layers: Vec<TestDiagramLayer>,
}

/// The scale of the axis to the right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiagramScale {
    /// A quantity.
    Linear,
    /// Frequencies.
    Logarithmic,
    /// Time [s]: from the beginning of the test on in [`ManoeuvreLog`](crate::ManoeuvreLog), of the run in what
    /// [`Manoeuvre::test_diagrams`](crate::Manoeuvre::test_diagrams) returns.
    Time,
}

/// What a layer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiagramLayerKind {
    /// A curve through measured values.
    Curve,
    /// A second one, beside it.
    SecondCurve,
    /// What a car without the shown effect would do.
    Reference,
    /// A line that was fitted, or a mean.
    Fit,
    /// A limit of the standard.
    Limit,
    /// Single points of interest.
    Mark,
}

/// A layer of a diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct TestDiagramLayer {
    /// In the legend.
    pub name: String,
    /// What it is.
    pub kind: DiagramLayerKind,
    /// Coordinates to the right.
    pub x: Vec<f64>,
    /// Coordinates upwards.
    pub y: Vec<f64>,
    /// The time of each point [s], as in [`DiagramScale::Time`]; none where points have no time.
    pub t: Vec<f64>,
}

impl TestDiagram {
    /// An empty diagram.
    #[must_use]
    pub fn new(title: &str, x_scale: DiagramScale, [x_label, y_label]: [&'static str; 2]) -> Self {
        TestDiagram { title: title.to_owned(), x_label, y_label, x_scale, y_range: None, layers: Vec::new() }
    }

    /// A diagram over time.
    #[must_use]
    pub fn over_time(title: &str, y_label: &'static str) -> Self {
        Self::new(title, DiagramScale::Time, ["time [s]", y_label])
    }

    /// The same with given ends of the axis upwards.
    #[must_use]
    pub fn with_y_range(self, range: [f64; 2]) -> Self {
        TestDiagram { y_range: Some(range), ..self }
    }

    /// Adds a layer whose points have no time.
    #[must_use]
    pub fn with_layer(
        mut self,
        name: impl Into<String>,
        kind: DiagramLayerKind,
        points: impl IntoIterator<Item = [f64; 2]>,
    ) -> Self {
        let (x, y) = points.into_iter().map(|[x, y]| (x, y)).unzip();
        self.layers.push(TestDiagramLayer { name: name.into(), kind, x, y, t: Vec::new() });
        self
    }

    /// Adds a layer of points at times [s]: `t`, x and y.
    #[must_use]
    pub fn with_timed_layer(
        mut self,
        name: impl Into<String>,
        kind: DiagramLayerKind,
        points: impl IntoIterator<Item = [f64; 3]>,
    ) -> Self {
        let mut layer =
            TestDiagramLayer { name: name.into(), kind, x: Vec::new(), y: Vec::new(), t: Vec::new() };
        for [t, x, y] in points {
            layer.t.push(t);
            layer.x.push(x);
            layer.y.push(y);
        }
        self.layers.push(layer);
        self
    }

    /// Adds a mark at a point, if there is one.
    #[must_use]
    pub fn with_mark(self, name: impl Into<String>, point: Option<[f64; 2]>) -> Self {
        match point {
            Some(point) => self.with_layer(name, DiagramLayerKind::Mark, [point]),
            None => self,
        }
    }

    /// Adds a mark at a point, if there is one, with its value upwards for a name.
    #[must_use]
    pub fn with_mark_labelled_by_value(self, unit: &str, point: Option<[f64; 2]>) -> Self {
        // What rounds to zero has no sign.
        let value = point.map_or(f64::NAN, |[_, y]| (100.0 * y).round() / 100.0 + 0.0);
        self.with_mark(format!("{value:.2} {unit}"), point)
    }

    /// Moves what is over the time of the test to the time of the run, in which the test begins at `begin` [s].
    pub(crate) fn shift_time(&mut self, begin: f64) {
        for layer in &mut self.layers {
            layer.t.iter_mut().for_each(|t| *t += begin);
            if self.x_scale == DiagramScale::Time {
                layer.x.iter_mut().for_each(|x| *x += begin);
            }
        }
    }
}
