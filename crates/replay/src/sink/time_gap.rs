//! Draws the time gap of two runs over the distance: a diagram that does not change during the replay.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::LineStrips2D;
use re_sdk_types::components::Radius;
use recording::view::{CurveRole, RowQuantity, XyPlot, XyPlotPoint};
use recording::{NumberIndex, Row};

use super::palette::CurvePalette;
use super::round_up_to_1_2_5;
use super::run_slot::RunNamespace;
use super::timeline::{TimePoint, TimePoints};
use super::xy_plots::{DiagramView, XyPlots};

/// Points of the line at most: more than any screen shows.
const POINTS: usize = 4_000;
/// Divisions of an axis at most, and the least division of the time gap [s].
const DIVISIONS: f64 = 6.0;
const FINEST: f64 = 0.001;
const LABEL: &str = "Δt";

/// The time gap [s] at each distance [m].
#[derive(Default)]
pub(super) struct TimeGap {
    time_points: Vec<TimePoint>,
    points: Vec<[f64; 2]>,
}

impl TimeGap {
    pub fn push(&mut self, time_point: TimePoint, point: [f64; 2]) {
        self.time_points.push(time_point);
        self.points.push(point);
    }

    /// The last distance [m] and the time gap [s] there.
    pub fn last_point(&self) -> Option<[f64; 2]> {
        self.points.last().copied()
    }

    /// Sends the diagram; `number` is its place in the order of all diagrams.
    pub fn send_diagram(
        &self,
        stream: &RecordingStream,
        number: usize,
        title: &str,
    ) -> RecordingStreamResult<Vec<DiagramView>> {
        if self.points.is_empty() {
            return Ok(Vec::new());
        }
        let point = XyPlotPoint {
            label: LABEL.to_owned(),
            role: CurveRole::Other,
            coordinates: [0, 1].map(|axis| RowQuantity::Column(NumberIndex::new(axis))),
        };
        let plot = XyPlot {
            title: title.to_owned(),
            labels: ["distance [m]".to_owned(), "Δt [s]".to_owned()],
            ranges: [self.rounded_axis_range(0, 1.0), self.rounded_axis_range(1, FINEST)],
            ellipse: None,
            trail: 0.0,
            points: vec![point],
            curves: Vec::new(),
        };
        let mut xy_plots = XyPlots::from_plots_numbered(&[plot], &RunNamespace::default(), number);
        xy_plots.send_static(stream)?;
        let every = self.points.len().div_ceil(POINTS);
        let drawn = self.points.iter().step_by(every).chain(self.points.last());
        let positions: Vec<_> = drawn.map(|point| xy_plots.view_position(0, *point)).collect();
        let line = LineStrips2D::new([positions])
            .with_colors([CurvePalette::default().curve_color(CurveRole::Other, LABEL)])
            .with_radii([Radius::new_ui_points(1.0)])
            .with_draw_order(20.0);
        stream.log_static(xy_plots.root_entity(0) + "/line", &line)?;
        for (time_point, point) in self.time_points.iter().zip(&self.points) {
            let row = Row::from_values(point.to_vec(), Vec::new());
            xy_plots.push_row(*time_point, 0.0, &row);
        }
        xy_plots.send(stream, &self.time_points.iter().copied().collect::<TimePoints>().time_columns())?;
        Ok(xy_plots.diagram_views())
    }

    /// The ends of an axis at round numbers. A division is at least `finest`.
    fn rounded_axis_range(&self, axis: usize, finest: f64) -> [f64; 2] {
        let values = || self.points.iter().map(|point| point[axis]);
        let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
        let division = round_up_to_1_2_5(((high - low) / DIVISIONS).max(finest));
        let (low, high) = ((low / division).floor() * division, (high / division).ceil() * division);
        if low < high { [low, high] } else { [low - division, high + division] }
    }
}
