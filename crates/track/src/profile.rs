//! Computes how fast a car can be at each station of a line: the speed profile between its limits.

use serde::{Deserialize, Serialize};

use crate::{Error, GgvDiagram, RoadGeometry, TrackLine};

/// Speeds that a profile keeps below, and those at the ends of an open line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedBounds {
    /// Highest speed [m/s].
    pub top: f64,
    /// Speed at the beginning of an open line [m/s]; the highest possible one without it.
    pub start: Option<f64>,
    /// Speed at the end of an open line [m/s]; the highest possible one without it.
    pub end: Option<f64>,
}

impl Default for SpeedBounds {
    fn default() -> Self {
        SpeedBounds { top: f64::INFINITY, start: None, end: None }
    }
}

/// Speeds along a line, at equidistant stations; the square of the speed is linear between them, so the acceleration is constant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpeedProfile {
    closed: bool,
    step: f64,
    length: f64,
    squares: Vec<f64>,
}

/// Change of the speed between two rounds that ends the passes [m/s].
const SETTLED: f64 = 1e-9;
/// Most rounds of both passes. A round changes nothing any more once the car has forgotten with which speed it began: after two, or
/// after some on a line that is nearly a circle.
const ROUNDS: usize = 1000;

impl SpeedProfile {
    /// The fastest profile of a line within a g-g-v diagram, by a pass forward and one backward.
    ///
    /// At first each station has the highest speed of its bend. The forward pass lets the car accelerate from station to station no faster than
    /// it can, the backward pass brake no later than it must. Each step takes the mean of the accelerations at its ends
    /// (trapezoidal rule in v²). On a closed line both passes start at the slowest station and go round until nothing changes any more.
    /// The quasi-steady approach is described in W. Milliken and D. Milliken, Race Car Vehicle Dynamics (1995), section 9, and
    /// by N. Kapania, J. Subosits, J. Gerdes, J. Dyn. Sys. Meas. Control 138 (2016), 091005.
    ///
    /// # Errors
    /// Where the tires do not hold the car on the bank at rest, or where the engine does not take it up a grade.
    pub fn fastest_on_line(line: &TrackLine, ggv: &GgvDiagram, bounds: &SpeedBounds) -> Result<Self, Error> {
        let top = bounds.top.min(ggv.top_speed());
        if top.is_nan() || top <= 0.0 {
            return Err(Error::Limits(format!("expected a top speed above 0 m/s, found {top} m/s")));
        }
        let roads: Vec<RoadGeometry> = line.knot_stations().map(|s| line.road_at(s)).collect();
        let mut most = Vec::with_capacity(roads.len());
        for (road, s) in roads.iter().zip(line.knot_stations()) {
            let speed = ggv.max_cornering_speed(road, top).ok_or_else(|| {
                let bank = road.bank.to_degrees();
                let message = format!("the tires do not hold the car on a bank of {bank:.1} degrees");
                Error::Place { s, message }
            })?;
            most.push(speed);
        }
        if !line.is_closed() {
            let last = most.len() - 1;
            most[0] = most[0].min(bounds.start.unwrap_or(top));
            most[last] = most[last].min(bounds.end.unwrap_or(top));
        }
        let passes = SpeedPasses { ggv, step: line.knot_spacing(), roads, closed: line.is_closed() };
        let speeds = passes.iterate_passes(most)?;
        let squares = speeds.iter().map(|v| v * v).collect();
        Ok(SpeedProfile {
            closed: line.is_closed(),
            step: line.knot_spacing(),
            length: line.length(),
            squares,
        })
    }

    /// A share [-] of the speeds that the table of the line tells, up to a highest speed [m/s].
    ///
    /// # Errors
    /// When the table has no speeds, or where one is no number above 0.
    pub fn from_line(line: &TrackLine, share: f64, top: f64) -> Result<Self, Error> {
        let no_speeds =
            || Error::Table("expected a column of speeds, such as `v_x [m/s]`, found none".to_owned());
        let speeds = line.knot_speeds().ok_or_else(no_speeds)?;
        let square = |(speed, s): (f64, f64)| match speed > 0.0 {
            true => Ok((share * speed).min(top).powi(2)),
            false => Err(Error::Place { s, message: "expected a speed above 0 m/s in the table".to_owned() }),
        };
        Ok(SpeedProfile {
            closed: line.is_closed(),
            step: line.knot_spacing(),
            length: line.length(),
            squares: speeds.zip(line.knot_stations()).map(square).collect::<Result<_, _>>()?,
        })
    }

    /// Speed at a station [m/s].
    #[must_use]
    pub fn speed_at(&self, s: f64) -> f64 {
        let ([a, b], t) = self.surrounding_squared_speeds(s);
        (a + t * (b - a)).max(0.0).sqrt()
    }

    /// Acceleration along the line at a station [m/s²].
    #[must_use]
    pub fn acceleration_at(&self, s: f64) -> f64 {
        let ([a, b], _) = self.surrounding_squared_speeds(s);
        if !self.closed && !(0.0..=self.length).contains(&s) {
            return 0.0;
        }
        0.5 * (b - a) / self.step
    }

    /// Time from the beginning of the line to its end [s].
    #[must_use]
    pub fn travel_time(&self) -> f64 {
        let count = self.squares.len();
        let last = if self.closed { count } else { count - 1 };
        let speed = |i: usize| self.squares[i % count].sqrt();
        (0..last).map(|i| 2.0 * self.step / (speed(i) + speed(i + 1))).sum()
    }

    /// Lowest and highest speed [m/s].
    #[must_use]
    pub fn speed_range(&self) -> [f64; 2] {
        let low = self.squares.iter().copied().fold(f64::INFINITY, f64::min);
        [low.sqrt(), self.squares.iter().copied().fold(0.0, f64::max).sqrt()]
    }

    fn surrounding_squared_speeds(&self, s: f64) -> ([f64; 2], f64) {
        let count = self.squares.len();
        let place = match self.closed {
            true => s.rem_euclid(self.length) / self.step,
            false => s.clamp(0.0, self.length) / self.step,
        };
        let index = (place as usize).min(if self.closed { count - 1 } else { count - 2 });
        let next = if index + 1 == count { 0 } else { index + 1 };
        ([self.squares[index], self.squares[next]], place - index as f64)
    }
}

/// Both passes over a line.
struct SpeedPasses<'a> {
    ggv: &'a GgvDiagram,
    step: f64,
    roads: Vec<RoadGeometry>,
    closed: bool,
}

/// Which way a pass goes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum PassDirection {
    Forward,
    Backward,
}

impl SpeedPasses<'_> {
    fn iterate_passes(&self, mut speeds: Vec<f64>) -> Result<Vec<f64>, Error> {
        let count = speeds.len();
        let slowest = (0..count).min_by(|a, b| speeds[*a].total_cmp(&speeds[*b])).unwrap_or(0);
        let begin = if self.closed { slowest } else { 0 };
        for _ in 0..ROUNDS {
            let before = speeds.clone();
            self.limit_speeds_in_pass(&mut speeds, begin, PassDirection::Forward)?;
            self.limit_speeds_in_pass(&mut speeds, begin, PassDirection::Backward)?;
            let changes = speeds.iter().zip(&before).map(|(now, before)| (now - before).abs());
            if changes.fold(0.0, f64::max) <= SETTLED {
                return Ok(speeds);
            }
        }
        Err(Error::Limits(format!("the speed profile did not settle within {ROUNDS} rounds")))
    }

    /// Lowers speeds that the car cannot reach from the station before it in this direction.
    fn limit_speeds_in_pass(
        &self,
        speeds: &mut [f64],
        begin: usize,
        way: PassDirection,
    ) -> Result<(), Error> {
        let count = speeds.len();
        let steps = if self.closed { count } else { count - 1 };
        for k in 0..steps {
            let (from, to) = match way {
                PassDirection::Forward => ((begin + k) % count, (begin + k + 1) % count),
                PassDirection::Backward => (
                    (begin + 2 * count - k - usize::from(!self.closed)) % count,
                    (begin + 2 * count - k - 1 - usize::from(!self.closed)) % count,
                ),
            };
            let reached = self.reachable_speed(speeds[from], speeds[to], from, to, way);
            if reached <= 0.0 && way == PassDirection::Forward && speeds[to] > 0.0 {
                let grade = self.roads[to].grade.to_degrees();
                let message = format!("the car does not get up a grade of {grade:.1} degrees");
                return Err(Error::Place { s: self.step * to as f64, message });
            }
            speeds[to] = speeds[to].min(reached);
        }
        Ok(())
    }

    /// The highest speed at `to`, up to `most`, when the car has the speed `v` at `from`: v_to² = v² + Δs (a_from + a_to), where a_to
    /// is that at v_to. An explicit step would overshoot where the lateral grip is used up, as the ellipse is vertical there.
    fn reachable_speed(&self, v: f64, most: f64, from: usize, to: usize, way: PassDirection) -> f64 {
        let gain = |v: f64, at: usize| match way {
            PassDirection::Forward => self.ggv.acceleration_range(v, &self.roads[at])[1],
            PassDirection::Backward => -self.ggv.acceleration_range(v, &self.roads[at])[0],
        };
        let known = v * v + self.step * gain(v, from);
        let excess = |x: f64| x * x - known - self.step * gain(x, to);
        let (mut high, mut above) = (most, excess(most));
        if above <= 0.0 {
            return most;
        }
        let (mut low, mut below) = (0.0, excess(0.0));
        if below >= 0.0 {
            return 0.0;
        }
        // False position; an end that stays twice counts half (the Illinois method).
        let mut kept = 0;
        for _ in 0..100 {
            let middle = (low * above - high * below) / (above - below);
            let found = excess(middle);
            if found.abs() <= 1e-13 * known.abs().max(1.0) || high - low <= 1e-13 * high {
                return middle;
            }
            if found > 0.0 {
                (high, above) = (middle, found);
                below *= if kept == 1 { 0.5 } else { 1.0 };
                kept = 1;
            } else {
                (low, below) = (middle, found);
                above *= if kept == -1 { 0.5 } else { 1.0 };
                kept = -1;
            }
        }
        low
    }
}

#[cfg(test)]
mod tests;
