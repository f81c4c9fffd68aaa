//! Draws the time gap of two runs over the distance: a diagram that does not change during the replay.

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::LineStrips2D;
use re_sdk_types::components::Radius;
use recording::view::{Point, Quantity, Role, XyPlot};
use recording::{NumberIndex, Row};

use super::palette::Palette;
use super::round_number;
use super::run_slot::RunSlot;
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
    pub fn last(&self) -> Option<[f64; 2]> {
        self.points.last().copied()
    }

    /// Sends the diagram; `number` is its place in the order of all diagrams.
    pub fn send(
        &self,
        stream: &RecordingStream,
        number: usize,
        title: &str,
    ) -> RecordingStreamResult<Vec<DiagramView>> {
        if self.points.is_empty() {
            return Ok(Vec::new());
        }
        let point = Point {
            label: LABEL.to_owned(),
            role: Role::Other,
            coordinates: [0, 1].map(|axis| Quantity::Column(NumberIndex::new(axis))),
        };
        let plot = XyPlot {
            title: title.to_owned(),
            labels: ["distance [m]".to_owned(), "Δt [s]".to_owned()],
            ranges: [self.range(0, 1.0), self.range(1, FINEST)],
            ellipse: None,
            trail: 0.0,
            points: vec![point],
            curves: Vec::new(),
        };
        let mut xy_plots = XyPlots::numbered(&[plot], &RunSlot::default(), number);
        xy_plots.describe(stream)?;
        let every = self.points.len().div_ceil(POINTS);
        let drawn = self.points.iter().step_by(every).chain(self.points.last());
        let positions: Vec<_> = drawn.map(|point| xy_plots.position(0, *point)).collect();
        let line = LineStrips2D::new([positions])
            .with_colors([Palette::default().color(Role::Other, LABEL)])
            .with_radii([Radius::new_ui_points(1.0)])
            .with_draw_order(20.0);
        stream.log_static(xy_plots.root(0) + "/line", &line)?;
        for (time_point, point) in self.time_points.iter().zip(&self.points) {
            let row = Row::from_values(point.to_vec(), Vec::new());
            xy_plots.push(*time_point, 0.0, &row);
        }
        xy_plots.send(stream, &self.time_points.iter().copied().collect::<TimePoints>().axes())?;
        Ok(xy_plots.views())
    }

    /// The ends of an axis at round numbers. A division is at least `finest`.
    fn range(&self, axis: usize, finest: f64) -> [f64; 2] {
        let values = || self.points.iter().map(|point| point[axis]);
        let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
        let division = round_number(((high - low) / DIVISIONS).max(finest));
        let (low, high) =
            ((low / division).floor() * division, (high / division).ceil() * division);
        if low < high { [low, high] } else { [low - division, high + division] }
    }
}
