//! Computes the three timelines of a recording: time, step and distance of each row.

use re_sdk::log::TimeColumn;
use recording::view::DistanceSource;
use recording::{RecordedVariables, Row, ThinnedSamples};

/// Timeline of the simulated time.
pub(super) const TIME: &str = "sim_time";
/// Timeline of the distance, in whole centimetres.
pub(super) const DISTANCE: &str = "distance_cm";

/// A point on every timeline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TimePoint {
    /// Simulated time [ns].
    pub time: i64,
    /// [cm]
    distance: Option<i64>,
}

/// Time points, in the order of their rows.
#[derive(Default)]
pub(super) struct TimePoints(Vec<TimePoint>);

impl TimePoints {
    pub fn push(&mut self, time_point: TimePoint) {
        self.0.push(time_point);
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Forgets all but the last `count`.
    pub fn keep_last(&mut self, count: usize) {
        self.0.drain(..self.0.len().saturating_sub(count));
    }

    /// Simulated times [s].
    pub fn times_in_seconds(&self) -> Vec<f64> {
        self.0.iter().map(|it| 1e-9 * it.time as f64).collect()
    }

    /// The axes of every column; a column without one of them would vanish from that timeline.
    pub fn time_columns(&self) -> Vec<TimeColumn> {
        time_columns_of_points(self.0.iter())
    }

    /// The axes of a column of some of the time points.
    pub fn time_columns_at(&self, indices: &[usize]) -> Vec<TimeColumn> {
        time_columns_of_points(indices.iter().map(|&index| &self.0[index]))
    }
}

fn time_columns_of_points<'a>(time_points: impl Iterator<Item = &'a TimePoint> + Clone) -> Vec<TimeColumn> {
    let times = time_points.clone().map(|it| it.time);
    let mut axes = vec![TimeColumn::new_duration_nanos(TIME, times)];
    if time_points.clone().all(|it| it.distance.is_some()) {
        let distances = time_points.filter_map(|it| it.distance);
        axes.push(TimeColumn::new_sequence(DISTANCE, distances));
    }
    axes
}

impl FromIterator<TimePoint> for TimePoints {
    fn from_iter<I: IntoIterator<Item = TimePoint>>(time_points: I) -> Self {
        Self(time_points.into_iter().collect())
    }
}

/// Computes the time points of rows and of events between them.
pub(super) struct TimelineClock {
    odometer: Option<DistanceOdometer>,
}

impl TimelineClock {
    pub fn new(distance: Option<DistanceSource>) -> Self {
        Self { odometer: distance.map(DistanceOdometer::new) }
    }

    /// The time point of a row; rows come in the order of their time [s].
    pub fn time_point_of_row(&mut self, time: f64, row: &Row<RecordedVariables>) -> TimePoint {
        if let Some(odometer) = &mut self.odometer {
            odometer.push(time, row);
        }
        self.time_point_at(time)
    }

    /// The distance at the last row [m].
    pub fn last_distance(&self) -> Option<f64> {
        self.odometer.as_ref()?.last.map(|(_, distance, _)| distance)
    }

    /// The time point of a time [s] up to the last row.
    pub fn time_point_at(&self, time: f64) -> TimePoint {
        let distance = self.odometer.as_ref().map(|it| (it.distance_at(time) * 100.0).round() as i64);
        TimePoint { time: nanoseconds(time), distance }
    }
}

pub(super) fn nanoseconds(time: f64) -> i64 {
    (time * 1e9).round() as i64
}

/// Measures the distance.
struct DistanceOdometer {
    source: DistanceSource,
    /// Time [s], distance [m], and what the next distance is computed from.
    last: Option<(f64, f64, [f64; 2])>,
    /// Times [s] and distances [m].
    passed: ThinnedSamples<(f64, f64)>,
}

impl DistanceOdometer {
    fn new(source: DistanceSource) -> Self {
        Self { source, last: None, passed: ThinnedSamples::default() }
    }

    fn push(&mut self, time: f64, row: &Row<RecordedVariables>) {
        let (_, before, from) = self.last.unwrap_or((time, 0.0, [f64::NAN; 2]));
        let state = match &self.source {
            DistanceSource::Given(distance) => [distance.evaluate(time, row), 0.0],
            DistanceSource::Along(position) => position.map(|index| row[index]),
            DistanceSource::Driven(speed) => [speed.evaluate(time, row), time],
        };
        let distance = match &self.source {
            DistanceSource::Given(_) => state[0],
            DistanceSource::Along(_) => before + (state[0] - from[0]).hypot(state[1] - from[1]),
            DistanceSource::Driven(_) => before + 0.5 * (state[0] + from[0]) * (state[1] - from[1]),
        };
        // The first row, and a NaN, cover no distance.
        let distance = if distance.is_finite() { distance } else { before };
        self.last = Some((time, distance, state));
        self.passed.push((time, distance));
    }

    /// The distance at a time [s], interpolated linearly between kept rows.
    fn distance_at(&self, time: f64) -> f64 {
        let Some((end, distance, _)) = self.last else {
            return 0.0;
        };
        if time >= end {
            return distance;
        }
        let passed = self.passed.samples();
        let after = passed.partition_point(|(t, _)| *t <= time);
        let (t0, s0) = passed[after.saturating_sub(1)];
        let (t1, s1) = passed.get(after).copied().unwrap_or((end, distance));
        let share = if t1 > t0 { ((time - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { 0.0 };
        s0 + share * (s1 - s0)
    }
}

#[cfg(test)]
mod tests {
    use super::{DistanceSource, TimePoint, TimelineClock};
    use recording::view::RowQuantity;
    use recording::{NumberIndex, Row};

    /// 300 s around a circle of 100 m at 20 m/s, in steps of 10 ms: more rows than are kept.
    fn distances(source: DistanceSource) -> Vec<Option<i64>> {
        let mut clock = TimelineClock::new(Some(source));
        for step in 0..=30_000 {
            let time = 0.01 * f64::from(step);
            let (sin, cos) = (0.2 * time).sin_cos();
            let numbers = vec![100.0 * cos, 100.0 * sin, 20.0, 20.0 * time];
            clock.time_point_of_row(time, &Row::from_values(numbers, Vec::new()));
        }
        let distance = |time| {
            let TimePoint { time: nanoseconds, distance } = clock.time_point_at(time);
            assert_eq!(nanoseconds, (time * 1e9) as i64);
            distance
        };
        [0.0, 123.0, 299.0, 300.0].map(distance).to_vec()
    }

    #[test]
    fn positions_a_speed_or_the_distance_itself_give_the_distance() {
        let driven = [0, 246_000, 598_000, 600_000].map(Some);
        for source in [
            DistanceSource::Along([0, 1].map(NumberIndex::new)),
            DistanceSource::Driven(RowQuantity::Column(NumberIndex::new(2))),
            DistanceSource::Given(RowQuantity::Column(NumberIndex::new(3))),
        ] {
            assert_eq!(distances(source.clone()), driven, "{source:?}");
        }
    }
}
