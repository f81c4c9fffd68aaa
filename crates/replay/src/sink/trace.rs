//! Keeps the driven line, thinned out as it grows, and cuts it into coloured strips.

use re_sdk_types::components::Color;
use recording::ThinnedSamples;

use super::{WHITE, round_up_to_1_2_5};

/// Strips of the driven line at most; each has one colour.
const STRIP_LIMIT: usize = 2_000;
/// Samples per strip at least.
pub(super) const STRIP_SAMPLES: usize = 10;
/// Labels along the driven line at most.
const MARK_LIMIT: f64 = 8.0;

/// The rectangle that holds the driven line [m].
#[derive(Clone, Copy)]
pub(super) struct MapBounds {
    /// Smallest x and y.
    pub low: [f32; 2],
    /// Largest x and y.
    pub high: [f32; 2],
}

/// The extent of a map of the driven line.
pub(super) struct MapExtent {
    /// [m]
    pub centre: [f32; 2],
    /// The direction that points up on the map.
    pub up: [f32; 2],
    /// [m]
    pub half_height: f32,
}

/// The lowest and the highest speed of the driven line [m/s].
#[derive(Clone, Copy)]
pub(super) struct SpeedRange {
    pub slow: f32,
    pub fast: f32,
}

/// The driven line as short strips of one colour each.
pub(super) struct ColouredStrips {
    pub strips: Vec<Vec<[f32; 3]>>,
    pub colors: Vec<Color>,
}

/// Points at round distances along the driven line, with their labels.
pub(super) struct DistanceMarks {
    pub points: Vec<[f32; 3]>,
    pub labels: Vec<String>,
}

/// Width by height of the map, which decides how high its camera is.
const MAP_ASPECT: f32 = 2.2;

impl MapBounds {
    /// A map of the rectangle, with its longer edge from left to right. A margin is around the rectangle, most of it below for the
    /// scale of colours.
    pub fn map_extent(self) -> MapExtent {
        let [width, depth] = [0, 1].map(|axis: usize| self.high[axis] - self.low[axis]);
        let [x, y] = [0, 1].map(|axis: usize| 0.5 * (self.high[axis] + self.low[axis]));
        let (wide, tall) = (width.max(depth), width.min(depth));
        let half_height = 0.5 * (1.5 * tall.max(wide / MAP_ASPECT) + 10.0);
        let up = if depth > width { [-1.0, 0.0] } else { [0.0, 1.0] };
        let centre = [x - 0.2 * half_height * up[0], y - 0.2 * half_height * up[1]];
        MapExtent { centre, up, half_height }
    }

    /// The ends of a line from left to right in the lower part of the map.
    pub fn scale_line_ends(self) -> [[f32; 3]; 2] {
        let MapExtent { centre: [x, y], up, half_height: half } = self.map_extent();
        let right = [up[1], -up[0]];
        [-0.8, 0.8].map(|aside| {
            let at = |axis: usize, from: f32| from + half * (aside * right[axis] - 0.72 * up[axis]);
            [at(0, x), at(1, y), 0.0]
        })
    }

    /// The rectangle that holds both.
    pub fn union(self, other: MapBounds) -> MapBounds {
        let axes = [0, 1];
        MapBounds {
            low: axes.map(|axis: usize| self.low[axis].min(other.low[axis])),
            high: axes.map(|axis: usize| self.high[axis].max(other.high[axis])),
        }
    }
}

/// The driven line, thinned out as it grows.
#[derive(Default)]
pub(super) struct DrivenLine(ThinnedSamples<PositionSample>);

/// A position [m] and the speed there [m/s].
struct PositionSample {
    point: [f32; 3],
    speed: f32,
}

impl DrivenLine {
    /// Takes the position and the speed of a row, unless the position is no number.
    pub fn push(&mut self, point: [f32; 3], speed: f32) {
        if point.iter().all(|it| it.is_finite()) {
            self.0.push(PositionSample { point, speed });
        }
    }

    /// The number of all rows, retained or not.
    pub fn row_count(&self) -> usize {
        self.0.total_count()
    }

    fn points(&self) -> impl Iterator<Item = [f32; 3]> {
        self.0.samples().iter().map(|it| it.point)
    }

    /// The line as short strips of one colour each, from slow to fast when it is `colored`.
    pub fn colored_strips(&self, colored: bool) -> ColouredStrips {
        let samples = self.0.samples();
        let last = samples.len().saturating_sub(1);
        let strip_length = STRIP_SAMPLES.max(last.div_ceil(STRIP_LIMIT));
        let SpeedRange { slow, fast } = self.speed_range().unwrap_or(SpeedRange { slow: 0.0, fast: 0.0 });
        let (mut strips, mut colors) = (Vec::new(), Vec::new());
        for start in (0..last).step_by(strip_length) {
            let end = (start + strip_length).min(last);
            // 2 cm above the ground, so that the ground does not shine through.
            let strip = samples[start..=end].iter().map(|it| [it.point[0], it.point[1], 0.02]);
            strips.push(strip.collect());
            let share = (samples[start].speed - slow) / (fast - slow).max(0.1);
            colors.push(if colored { speed_color(share) } else { Color::from(WHITE) });
        }
        ColouredStrips { strips, colors }
    }

    pub fn distance_marks(&self) -> DistanceMarks {
        let distances = self.distances_along_line();
        let spacing = round_up_to_1_2_5(distances.last().copied().unwrap_or(0.0) / MARK_LIMIT).max(10.0);
        let (mut points, mut labels) = (Vec::new(), Vec::new());
        let mut next = 0.0;
        for (point, &distance) in self.points().zip(&distances) {
            if distance >= next {
                points.push(point);
                labels.push(format!("{next:.0} m"));
                next += spacing;
            }
        }
        DistanceMarks { points, labels }
    }

    fn distances_along_line(&self) -> Vec<f64> {
        let mut total = 0.0;
        let steps = self.points().zip(self.points().skip(1)).map(|(from, to)| {
            total += f64::from(to[0] - from[0]).hypot(f64::from(to[1] - from[1]));
            total
        });
        std::iter::once(0.0).chain(steps).collect()
    }

    /// The rectangle that holds the line.
    pub fn bounds(&self) -> Option<MapBounds> {
        let first = self.points().next()?;
        let mut bounds = MapBounds { low: [first[0], first[1]], high: [first[0], first[1]] };
        for [x, y, _] in self.points() {
            bounds.low = [bounds.low[0].min(x), bounds.low[1].min(y)];
            bounds.high = [bounds.high[0].max(x), bounds.high[1].max(y)];
        }
        Some(bounds)
    }

    pub fn speed_range(&self) -> Option<SpeedRange> {
        let finite = || self.0.samples().iter().map(|it| it.speed).filter(|it| it.is_finite());
        Some(SpeedRange { slow: finite().reduce(f32::min)?, fast: finite().reduce(f32::max)? })
    }
}

/// Viridis without its darkest part, which is lost on a dark background.
pub(super) fn speed_color(share: f32) -> Color {
    const STOPS: [[f32; 3]; 5] = [
        [62.0, 74.0, 180.0],
        [38.0, 130.0, 142.0],
        [53.0, 183.0, 121.0],
        [170.0, 220.0, 50.0],
        [253.0, 231.0, 37.0],
    ];
    let position = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let below = (position as usize).min(STOPS.len() - 2);
    let share = position - below as f32;
    let mix = |i: usize| (STOPS[below][i] * (1.0 - share) + STOPS[below + 1][i] * share) as u8;
    Color::from_rgb(mix(0), mix(1), mix(2))
}
