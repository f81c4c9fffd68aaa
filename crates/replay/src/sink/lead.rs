//! Draws how much later the other run comes by, over the distance: a diagram that is there at any time of the replay.

use recording::view::{Plane, Point, Quantity, Role};
use recording::{NumberIndex, Row};
use rerun::{LineStrips2D, Radius, RecordingStream, RecordingStreamResult};

use super::contender::Contender;
use super::moments::{Moment, Moments};
use super::palette::Palette;
use super::planes::{Planes, Shown};
use super::round_number;

/// Points of the line at most: more than any screen shows.
const POINTS: usize = 4_000;
/// Divisions of an axis at most, and of the time the least [s].
const DIVISIONS: f64 = 6.0;
const FINEST: f64 = 0.001;
const LABEL: &str = "Δt";

/// The difference of the times [s] at each distance [m].
#[derive(Default)]
pub(super) struct Lead {
    moments: Vec<Moment>,
    places: Vec<[f64; 2]>,
}

impl Lead {
    pub fn push(&mut self, moment: Moment, place: [f64; 2]) {
        self.moments.push(moment);
        self.places.push(place);
    }

    /// The last distance [m] and the difference [s] there.
    pub fn last(&self) -> Option<[f64; 2]> {
        self.places.last().copied()
    }

    /// Sends the diagram, which is this one in the row of all; `title` says what the difference is.
    pub fn send(
        &self,
        stream: &RecordingStream,
        number: usize,
        title: &str,
    ) -> RecordingStreamResult<Vec<Shown>> {
        if self.places.is_empty() {
            return Ok(Vec::new());
        }
        let point = Point {
            label: LABEL.to_owned(),
            role: Role::Other,
            place: [0, 1].map(|axis| Quantity::Column(NumberIndex::new(axis))),
        };
        let plane = Plane {
            title: title.to_owned(),
            labels: ["distance [m]".to_owned(), "Δt [s]".to_owned()],
            ranges: [self.range(0, 1.0), self.range(1, FINEST)],
            circle: None,
            trail: 0.0,
            points: vec![point],
            curves: Vec::new(),
        };
        let mut planes = Planes::numbered(&[plane], 2, &Contender::default(), number);
        planes.describe(stream)?;
        let every = self.places.len().div_ceil(POINTS);
        let line: Vec<_> = self.places.iter().step_by(every).chain(self.places.last()).collect();
        let line = line.into_iter().map(|place| planes.place(0, *place));
        let line = LineStrips2D::new([line.collect::<Vec<_>>()])
            .with_colors([Palette::default().color(Role::Other, LABEL)])
            .with_radii([Radius::new_ui_points(1.0)])
            .with_draw_order(20.0);
        stream.log_static(planes.root(0) + "/line", &line)?;
        for (moment, place) in self.moments.iter().zip(&self.places) {
            let row = Row::from_values(place.to_vec(), Vec::new());
            planes.push(*moment, 0.0, &row);
        }
        planes.send(stream, &self.moments.iter().copied().collect::<Moments>().axes())?;
        Ok(planes.shown())
    }

    /// The ends of an axis at round numbers, which are at least so far apart that divisions are this fine.
    fn range(&self, axis: usize, finest: f64) -> [f64; 2] {
        let values = || self.places.iter().map(|place| place[axis]);
        let (low, high) = (values().fold(0.0, f64::min), values().fold(0.0, f64::max));
        let division = round_number(((high - low) / DIVISIONS).max(finest));
        let (low, high) =
            ((low / division).floor() * division, (high / division).ceil() * division);
        if low < high { [low, high] } else { [low - division, high + division] }
    }
}
