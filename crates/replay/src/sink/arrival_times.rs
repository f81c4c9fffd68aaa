//! The time of first arrival at each distance of a run; the time gap of two runs is the difference of these times.

/// A piece of a run beyond its furthest point so far: time [s] and distance [m] at its ends.
#[derive(Clone, Copy)]
struct ArrivalSegment {
    from: [f64; 2],
    to: [f64; 2],
}

/// The first time at each distance of a run.
///
/// Distance is the furthest point reached so far; stopping or reversing does not change it.
#[derive(Default)]
pub(super) struct ArrivalTimes {
    pieces: Vec<ArrivalSegment>,
    last: Option<[f64; 2]>,
}

impl ArrivalTimes {
    /// Takes the time [s] and the distance [m] of a row. Returns the time at which the furthest distance was reached, if the row
    /// is there.
    pub fn push(&mut self, time: f64, distance: f64) -> Option<f64> {
        let to = [time, distance];
        let from = self.last.replace(to).unwrap_or(to);
        let furthest = self.pieces.last().map(|piece| piece.to);
        match furthest {
            Some([reached, furthest]) if distance <= furthest => (distance == furthest).then_some(reached),
            _ => {
                self.pieces.push(ArrivalSegment { from, to });
                Some(time)
            }
        }
    }

    /// The furthest distance [m].
    pub fn furthest_distance(&self) -> Option<f64> {
        self.pieces.last().map(|piece| piece.to[1])
    }

    /// The time [s] at which the distance [m] was first reached, interpolated linearly; `None` outside of the arrivals.
    pub fn time_at(&self, distance: f64) -> Option<f64> {
        let index = self.pieces.partition_point(|piece| piece.to[1] < distance);
        let ArrivalSegment { from: [t0, s0], to: [t1, s1] } = *self.pieces.get(index)?;
        if distance == s1 {
            return Some(t1);
        }
        // A smaller distance lies before the first row.
        (distance >= s0).then(|| t0 + (distance - s0) / (s1 - s0) * (t1 - t0))
    }
}

#[cfg(test)]
mod tests {
    use super::ArrivalTimes;

    fn arrivals(rows: &[[f64; 2]]) -> ArrivalTimes {
        let mut arrivals = ArrivalTimes::default();
        for &[time, distance] in rows {
            arrivals.push(time, distance);
        }
        arrivals
    }

    #[test]
    fn stopping_or_reversing_does_not_change_the_first_time_at_a_distance() {
        // 0 to 2 s at 1 m/s, a stop until 5 s, back by 1 m until 6 s, then on at 2 m/s.
        let arrivals = arrivals(&[[0.0, 0.0], [2.0, 2.0], [5.0, 2.0], [6.0, 1.0], [8.0, 5.0]]);
        for (distance, time) in [(0.0, 0.0), (1.5, 1.5), (2.0, 2.0), (3.0, 7.0), (5.0, 8.0)] {
            assert_eq!(arrivals.time_at(distance), Some(time), "{distance} m");
        }
        assert_eq!((arrivals.time_at(-0.1), arrivals.time_at(5.1)), (None, None));
        assert_eq!(arrivals.furthest_distance(), Some(5.0));
    }

    #[test]
    fn rows_behind_the_furthest_point_have_no_time() {
        let mut arrivals = ArrivalTimes::default();
        let rows = [[0.0, 3.0], [1.0, 3.0], [2.0, 2.0], [3.0, 3.0], [4.0, 4.0]];
        let times = rows.map(|[time, distance]| arrivals.push(time, distance));
        assert_eq!(times, [Some(0.0), Some(0.0), None, Some(0.0), Some(4.0)]);
    }

    #[test]
    fn at_constant_speeds_the_time_gap_is_proportional_to_the_distance() {
        let drive = |speed: f64, step: f64| {
            let time = |k: u32| f64::from(k) * step;
            let rows: Vec<_> = (0..=(100.0 / step) as u32).map(|k| [time(k), speed * time(k)]).collect();
            arrivals(&rows)
        };
        let (a, b) = (drive(20.0, 0.001), drive(16.0, 0.01));
        for distance in [0.0, 0.0123, 777.7, 1599.9] {
            let gap = b.time_at(distance).zip(a.time_at(distance)).map(|(b, a)| b - a);
            let expected = distance / 16.0 - distance / 20.0;
            assert!(gap.is_some_and(|it| (it - expected).abs() < 1e-9), "{distance} m: {gap:?}");
        }
    }
}
