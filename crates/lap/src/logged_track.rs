//! Finds the line of a track in the positions of a log: its laps, a smooth line through each, and the mean of them.

use std::collections::HashMap;

use rayon::prelude::*;
use track::{TrackLine, TrackSurvey, point_distance, wrap_angle};

use crate::Error;
use crate::driven_lap::{PositionSample, rising_samples};
use crate::line_smoother::{PathPoint, smooth_line};

/// What is told of the laps of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoggedTrackOptions {
    /// Where a lap begins [m]; without it, where most laps pass, and there where they are fastest.
    pub start: Option<[f64; 2]>,
    /// Way from a position to both sides of the car [m].
    pub half_car_width: f64,
    /// Standard deviation that the positions have about their line at least [m].
    pub least_noise: f64,
}

impl Default for LoggedTrackOptions {
    fn default() -> Self {
        // Of 0, 0.02, 0.05, 0.1 and 0.2 m it brings the curvature nearest to Doppler headings and yaw rates, or within 2 % of the nearest, in drives of
        // a VBOX, a RaceChrono and an autonomous race car.
        LoggedTrackOptions { start: None, half_car_width: 1.0, least_noise: 0.05 }
    }
}

/// The line of a track as a log has it.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedTrack {
    /// The mean line of the laps that count, closed; of a log without a lap its whole path, open. With several laps the widths are as far as
    /// they went to both sides, with the car.
    pub survey: TrackSurvey,
    /// All complete laps, in the order of the log.
    pub laps: Vec<LoggedLapLine>,
    /// Length of the line [m].
    pub length: f64,
    /// Standard deviation of the positions about the line of their lap [m].
    pub noise: f64,
    /// Largest distance between two laps, across the line [m].
    pub spread: f64,
}

/// A complete lap of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoggedLapLine {
    /// Time of the log at its beginning [s].
    pub begin: f64,
    /// Time of the lap [s].
    pub lap_time: f64,
    /// Length of its path [m].
    pub length: f64,
    /// Whether it counts for the line: its path is about as long as those of the others, on the same road and without a long gap, and it is
    /// not much slower.
    pub counts: bool,
}

/// Fewest positions of a line.
const FEWEST_POINTS: usize = 10;
/// Positions nearer than this to the one before are taken together [m].
const THINNING: f64 = 1.0;
/// Faster than any car [m/s]: such a position is an error of the receiver.
const JUMP_SPEED: f64 = 150.0;
/// Way between two points of the line [m], about.
const LINE_STEP: f64 = 2.0;
/// Way between two positions of which one may be the start [m].
const START_STEP: f64 = 5.0;
/// A car passes a place again where it is this near to it [m] ...
const GATE_RADIUS: f64 = 15.0;
/// ... in a direction that differs by less than this [rad] ...
const GATE_ANGLE: f64 = 0.7;
/// ... after a distance of at least this [m].
const SHORTEST_LAP: f64 = 100.0;
/// Difference of the length from the median with which a lap counts.
const LENGTH_TOLERANCE: f64 = 0.03;
/// Time over that of the fastest lap with which a lap counts: a slower one has stood in the pits, or beside the track.
const SLOWEST: f64 = 1.5;
/// Way across the line within which two laps are of the same road [m]: as wide as a track, less than from there to the pits.
const ROAD: f64 = 12.0;
/// Longest path of a car that turns round, rolls back or stands while its receiver drifts [m].
const LONGEST_LOOP: f64 = 60.0;
/// Places for the start that are tried.
const TRIED_GATES: usize = 50;
/// Longest distance without a position in a lap that counts [m].
const LONGEST_GAP: f64 = 100.0;
/// Way of the same lap that is laid before its beginning and behind its end, so that its line is smooth there [m].
const OVERLAP: f64 = 300.0;

/// Positions of a log along the path that it drove.
#[derive(Default)]
struct LoggedPath {
    times: Vec<f64>,
    points: Vec<PathPoint>,
}

/// A line across the track.
#[derive(Clone, Copy)]
struct Gate {
    position: [f64; 2],
    heading: f64,
}

/// Where the path crosses a gate.
#[derive(Clone, Copy)]
struct Crossing {
    t: f64,
    point: PathPoint,
    /// The first position behind it.
    next: usize,
}

impl LoggedTrack {
    /// The line of the track that a log has driven. Positions that are not finite, not later than the one before or farther from both neighbours
    /// than a car can be are left out.
    ///
    /// # Errors
    /// When there are too few positions for a line, or no lap passes the start that is told.
    pub fn find(samples: &[PositionSample], options: &LoggedTrackOptions) -> Result<Self, Error> {
        let mut path = LoggedPath::new(samples);
        let length = path.points.last().map_or(0.0, |point| point.distance);
        if path.points.len() < FEWEST_POINTS || length < SHORTEST_LAP {
            return Err(Error::Log(format!(
                "expected the positions of a drive, found {} that are a metre apart, over {length:.0} m",
                path.points.len()
            )));
        }
        let gate = match options.start {
            Some(start) => Some(path.gate_near(start)?),
            None => path.find_gate().or_else(|| path.close_single_lap()),
        };
        let crossings = gate.map_or_else(Vec::new, |gate| path.crossings(gate));
        if crossings.len() < 2 {
            return match options.start {
                Some(_) => Err(Error::Log(format!(
                    "expected laps from this start, found that the log passes it {} times; without one, a log that has no lap gives an open line",
                    crossings.len()
                ))),
                None => path.open_track(options.least_noise),
            };
        }
        path.closed_track(&crossings, options)
    }
}

impl LoggedPath {
    fn new(samples: &[PositionSample]) -> Self {
        let finite = rising_samples(samples);
        let is_jump = |a: &PositionSample, b: &PositionSample| {
            point_distance(a.position, b.position) > THINNING + JUMP_SPEED * (b.t - a.t)
        };
        let is_spike = |i: usize| {
            let before = i.checked_sub(1).map(|before| is_jump(finite[before], finite[i]));
            let after = finite.get(i + 1).map(|after| is_jump(finite[i], after));
            before.unwrap_or(true) && after.unwrap_or(true)
        };
        let kept: Vec<&PositionSample> =
            (0..finite.len()).filter(|i| !is_spike(*i)).map(|i| finite[i]).collect();
        let mut path = LoggedPath::default();
        let mut group = Vec::new();
        for sample in kept {
            if group.first().is_some_and(|first: &&PositionSample| {
                point_distance(first.position, sample.position) >= THINNING
            }) {
                path.push_mean(&group);
                group.clear();
            }
            group.push(sample);
        }
        path.push_mean(&group);
        path.without_loops()
    }

    /// The path without the loops of a car that turns round, rolls back or stands while its receiver drifts: a loop ends where it began, so
    /// the rest goes on from there.
    fn without_loops(&self) -> Self {
        let mut path = LoggedPath::default();
        let mut i = 0;
        while let Some(here) = self.points.get(i) {
            path.push(self.times[i], here.position);
            let ahead =
                self.points[i + 1..].iter().take_while(|it| it.distance - here.distance < LONGEST_LOOP);
            let returns = ahead.enumerate().filter(|(_, there)| {
                let chord = point_distance(here.position, there.position);
                there.distance - here.distance > 3.0 * (chord + THINNING)
            });
            i += returns.last().map_or(1, |(skipped, _)| skipped + 1);
        }
        path
    }

    /// Adds the mean of some positions.
    fn push_mean(&mut self, group: &[&PositionSample]) {
        if group.is_empty() {
            return;
        }
        let mean = |value: &dyn Fn(&PositionSample) -> f64| {
            group.iter().map(|sample| value(sample)).sum::<f64>() / group.len() as f64
        };
        self.push(mean(&|sample| sample.t), [0, 1].map(|axis| mean(&|sample| sample.position[axis])));
    }

    fn push(&mut self, t: f64, position: [f64; 2]) {
        let distance = match self.points.last() {
            Some(before) => before.distance + point_distance(before.position, position),
            None => 0.0,
        };
        self.times.push(t);
        self.points.push(PathPoint { distance, position });
    }

    /// Three positions before and three behind, as far as there are any.
    fn neighbours(&self, i: usize) -> [usize; 2] {
        [i.saturating_sub(3), (i + 3).min(self.points.len() - 1)]
    }

    /// Direction of travel at a position [rad], over its neighbours.
    fn heading(&self, i: usize) -> f64 {
        let [a, b] = self.neighbours(i).map(|i| self.points[i].position);
        (b[1] - a[1]).atan2(b[0] - a[0])
    }

    fn gate_at(&self, i: usize) -> Gate {
        Gate { position: self.points[i].position, heading: self.heading(i) }
    }

    fn gate_near(&self, start: [f64; 2]) -> Result<Gate, Error> {
        let distance = |i: &usize| point_distance(self.points[*i].position, start);
        let nearest = (0..self.points.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let nearest = nearest.filter(|i| distance(i) <= GATE_RADIUS);
        nearest.map(|i| Gate { position: start, ..self.gate_at(i) }).ok_or_else(|| {
            Error::Log(format!(
                "expected a start beside the path of the log, found ({:.1} m, {:.1} m) more than {GATE_RADIUS} m beside it",
                start[0], start[1]
            ))
        })
    }

    /// The place that is passed most often, and there the fastest one; none where no place is passed twice. A place near the beginning
    /// or the end of the log may be reached and not passed.
    fn find_gate(&self) -> Option<Gate> {
        let mut starts: Vec<usize> = Vec::new();
        let end = self.points.last()?.distance - 2.0 * GATE_RADIUS;
        for (i, point) in self.points.iter().enumerate() {
            if point.distance < 2.0 * GATE_RADIUS || point.distance > end {
                continue;
            }
            let is_far = |last: &usize| point.distance - self.points[*last].distance >= START_STEP;
            if starts.last().is_none_or(is_far) {
                starts.push(i);
            }
        }
        let cell = |i: usize| self.points[i].position.map(|it| (it / GATE_RADIUS).floor() as i64);
        let mut cells: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
        for i in &starts {
            cells.entry(cell(*i)).or_default().push(*i);
        }
        let passes = |i: usize| {
            let [x, y] = cell(i);
            let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [x + dx, y + dy]));
            let mut near: Vec<usize> =
                around.filter_map(|cell| cells.get(&cell)).flatten().copied().collect();
            near.retain(|j| {
                point_distance(self.points[*j].position, self.points[i].position) <= GATE_RADIUS
                    && wrap_angle(self.heading(*j) - self.heading(i)).abs() <= GATE_ANGLE
            });
            near.sort_unstable();
            let is_new = |pair: &&[usize]| {
                self.points[pair[1]].distance - self.points[pair[0]].distance >= SHORTEST_LAP
            };
            near.windows(2).filter(is_new).count() + 1
        };
        let speed = |i: usize| {
            let [a, b] = self.neighbours(i);
            (self.points[b].distance - self.points[a].distance) / (self.times[b] - self.times[a])
        };
        let mut best: Vec<(usize, f64, usize)> =
            starts.into_iter().map(|i| (passes(i), speed(i), i)).filter(|it| it.0 > 1).collect();
        best.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)));
        // Near a fork or in a bend the path may come near a place without crossing its gate.
        let tried = best.into_iter().take(TRIED_GATES).map(|it| self.gate_at(it.2));
        let crossed = tried.map(|gate| (self.crossings(gate).len(), gate)).rev();
        crossed.max_by_key(|it| it.0).filter(|it| it.0 > 1).map(|it| it.1)
    }

    /// Of a log that ends where it began, as exports of one lap do: goes on as it began, and the start of the lap. None where it ends elsewhere.
    fn close_single_lap(&mut self) -> Option<Gate> {
        let last = self.points.len() - 1;
        let gap = point_distance(self.points[last].position, self.points[0].position);
        let turn = wrap_angle(self.heading(last) - self.heading(0)).abs();
        if gap > 2.0 * GATE_RADIUS || turn > GATE_ANGLE {
            return None;
        }
        let duration = (self.times[last] - self.times[0]) * (1.0 + gap / self.points[last].distance);
        let length = self.points[last].distance + gap;
        let near = self.points.partition_point(|point| point.distance < 2.0 * GATE_RADIUS);
        let again = (0..(near + 2).min(last)).map(|i| (self.times[i] + duration, self.points[i]));
        let again: Vec<(f64, PathPoint)> = again.collect();
        for (t, point) in again {
            self.times.push(t);
            self.points.push(PathPoint { distance: point.distance + length, ..point });
        }
        Some(self.gate_at(1.max(near / 2)))
    }

    fn crossings(&self, gate: Gate) -> Vec<Crossing> {
        let (sin, cos) = gate.heading.sin_cos();
        let along_and_beside = |point: &PathPoint| {
            let [x, y] = [0, 1].map(|axis| point.position[axis] - gate.position[axis]);
            [x * cos + y * sin, y * cos - x * sin]
        };
        let mut crossings: Vec<Crossing> = Vec::new();
        for next in 1..self.points.len() {
            let [before, after] = [next - 1, next].map(|i| along_and_beside(&self.points[i]));
            if before[0] >= 0.0 || after[0] < 0.0 {
                continue;
            }
            let share = before[0] / (before[0] - after[0]);
            let between = |a: f64, b: f64| a + share * (b - a);
            let [a, b] = [next - 1, next].map(|i| self.points[i]);
            let crossing = Crossing {
                t: between(self.times[next - 1], self.times[next]),
                point: PathPoint {
                    distance: between(a.distance, b.distance),
                    position: [0, 1].map(|axis| between(a.position[axis], b.position[axis])),
                },
                next,
            };
            let is_far = |last: &Crossing| crossing.point.distance - last.point.distance >= SHORTEST_LAP;
            if between(before[1], after[1]).abs() <= GATE_RADIUS && crossings.last().is_none_or(is_far) {
                crossings.push(crossing);
            }
        }
        crossings
    }

    /// The longest path without a gap of a log that has no lap.
    fn open_track(&self, least_noise: f64) -> Result<LoggedTrack, Error> {
        let parts = self.points.chunk_by(|a, b| b.distance - a.distance <= LONGEST_GAP);
        let length_of =
            |part: &[PathPoint]| part.last().zip(part.first()).map_or(0.0, |(b, a)| b.distance - a.distance);
        let part = parts.max_by(|a, b| length_of(a).total_cmp(&length_of(b))).unwrap_or_default();
        let length = length_of(part);
        if part.len() < FEWEST_POINTS || length < SHORTEST_LAP {
            return Err(Error::Log(format!(
                "expected a drive without a gap of {LONGEST_GAP} m in its positions, found {length:.0} m of one"
            )));
        }
        let count = (length / LINE_STEP).ceil();
        let begin = part[0].distance;
        let line =
            smooth_line(part, begin, length / count, count as usize, least_noise).ok_or_else(no_line)?;
        let survey = TrackSurvey { points: line.positions, closed: false, ..TrackSurvey::default() };
        let length = TrackLine::from_survey(&survey)?.length();
        Ok(LoggedTrack { survey, laps: Vec::new(), length, noise: line.noise, spread: 0.0 })
    }

    fn closed_track(
        &self,
        crossings: &[Crossing],
        options: &LoggedTrackOptions,
    ) -> Result<LoggedTrack, Error> {
        let mut laps: Vec<LoggedLapLine> = crossings.windows(2).map(|ends| self.lap_between(ends)).collect();
        let mut lengths: Vec<f64> = laps.iter().map(|lap| lap.length).collect();
        lengths.sort_unstable_by(f64::total_cmp);
        let median = lengths[(lengths.len() - 1) / 2];
        let fastest =
            laps.iter().filter(|lap| lap.counts).map(|lap| lap.lap_time).fold(f64::INFINITY, f64::min);
        for lap in &mut laps {
            lap.counts &=
                (lap.length - median).abs() <= LENGTH_TOLERANCE * median && lap.lap_time <= SLOWEST * fastest;
        }
        let counted: Vec<usize> = (0..laps.len()).filter(|i| laps[*i].counts).collect();
        if counted.is_empty() {
            return self.open_track(options.least_noise);
        }
        let lines = counted.par_iter().map(|i| self.lap_line(&crossings[*i..*i + 2], options.least_noise));
        let lines: Vec<(TrackLine, f64)> = lines.collect::<Result<_, _>>()?;
        let noise = (lines.iter().map(|(_, noise)| noise * noise).sum::<f64>() / lines.len() as f64).sqrt();
        let lines: Vec<TrackLine> = lines.into_iter().map(|(line, _)| line).collect();
        let group = LapGroup::largest(&lines);
        for (k, i) in counted.into_iter().enumerate() {
            laps[i].counts = group.laps.iter().any(|it| it.lap == k);
        }
        let (survey, spread) = group.mean_line(options.half_car_width);
        let length = TrackLine::from_survey(&survey)?.length();
        if (length - median).abs() > 2.0 * LENGTH_TOLERANCE * median {
            return Err(Error::Log(format!(
                "expected a line as long as the laps, {median:.0} m, found one of {length:.0} m: positions are too far from one another, or a lap \
                 goes back; cut the log to some good laps"
            )));
        }
        Ok(LoggedTrack { survey, laps, length, noise, spread })
    }

    fn lap_between(&self, ends: &[Crossing]) -> LoggedLapLine {
        let [a, b] = [ends[0], ends[1]];
        let points = &self.points[a.next - 1..=b.next];
        let gap = points.windows(2).map(|pair| pair[1].distance - pair[0].distance).fold(0.0, f64::max);
        LoggedLapLine {
            begin: a.t,
            lap_time: b.t - a.t,
            length: b.point.distance - a.point.distance,
            counts: gap <= LONGEST_GAP,
        }
    }

    /// The closed line of a lap, and the standard deviation of its positions about it [m].
    ///
    /// A lap ends beside where it began, as receivers drift and drivers differ. The difference is spread over the lap, each position moved
    /// by its share of the length: the compass rule of surveyors (Bowditch).
    fn lap_line(&self, ends: &[Crossing], least_noise: f64) -> Result<(TrackLine, f64), Error> {
        let [begin, end] = [ends[0].point, ends[1].point];
        let length = end.distance - begin.distance;
        let misclosure = [0, 1].map(|axis| end.position[axis] - begin.position[axis]);
        let lap = self.points[ends[0].next..ends[1].next].iter().map(|point| {
            let distance = point.distance - begin.distance;
            let position = [0, 1].map(|axis| point.position[axis] - misclosure[axis] * distance / length);
            PathPoint { distance, position }
        });
        let lap: Vec<PathPoint> = lap.collect();
        let round =
            |by: f64| lap.iter().map(move |point| PathPoint { distance: point.distance + by, ..*point });
        let points: Vec<PathPoint> = round(-length).chain(round(0.0)).chain(round(length)).collect();
        let count = (length / LINE_STEP).ceil() as usize;
        let step = length / count as f64;
        let overlap = ((OVERLAP / step).ceil() as usize).min(count);
        let line = smooth_line(&points, -step * overlap as f64, step, count + 2 * overlap, least_noise)
            .ok_or_else(no_line)?;
        let points = line.positions[overlap..overlap + count].to_vec();
        let survey = TrackSurvey { points, closed: true, ..TrackSurvey::default() };
        Ok((TrackLine::from_survey(&survey)?, line.noise))
    }
}

/// The laps that are on the road of one of them.
struct LapGroup<'a> {
    reference: &'a TrackLine,
    /// Stations of the reference [m].
    stations: Vec<f64>,
    laps: Vec<LapOffsets>,
    /// Sum over the laps of their largest distance from the reference [m].
    distance: f64,
}

/// A lap beside the reference of its group.
struct LapOffsets {
    /// Its number among all lines.
    lap: usize,
    /// Lateral deviations at the stations of the reference [m].
    laterals: Vec<f64>,
}

impl<'a> LapGroup<'a> {
    /// The group with the most laps; of equally large ones that whose laps are nearest to the reference.
    fn largest(lines: &'a [TrackLine]) -> Self {
        let groups: Vec<Self> = lines.par_iter().map(|reference| Self::of(reference, lines)).collect();
        let better = |best: Self, other: Self| {
            let is_better = other.laps.len() > best.laps.len()
                || (other.laps.len() == best.laps.len() && other.distance < best.distance);
            if is_better { other } else { best }
        };
        groups.into_iter().reduce(better).unwrap_or_else(|| Self::of(&lines[0], lines))
    }

    fn of(reference: &'a TrackLine, lines: &[TrackLine]) -> Self {
        let count = (reference.length() / LINE_STEP).ceil() as usize;
        let stations = (0..count).map(|i| reference.length() * i as f64 / count as f64).collect();
        let mut group = LapGroup { reference, stations, laps: Vec::new(), distance: 0.0 };
        for (lap, line) in lines.iter().enumerate() {
            let laterals = match std::ptr::eq(line, reference) {
                true => vec![0.0; count],
                false => laterals_at(reference, line, &group.stations),
            };
            let farthest = laterals.iter().fold(0.0, |farthest, n| f64::max(farthest, n.abs()));
            if farthest <= ROAD {
                group.laps.push(LapOffsets { lap, laterals });
                group.distance += farthest;
            }
        }
        group
    }

    /// The mean of the laps across the reference, with widths that hold all of them, and the largest distance between two of them [m].
    fn mean_line(&self, half_car_width: f64) -> (TrackSurvey, f64) {
        let mut survey = TrackSurvey { closed: true, ..TrackSurvey::default() };
        let mut widths = Vec::with_capacity(self.stations.len());
        let mut spread: f64 = 0.0;
        for (i, s) in self.stations.iter().enumerate() {
            let here = self.laps.iter().map(|lap| lap.laterals[i]);
            let mean = here.clone().sum::<f64>() / self.laps.len() as f64;
            let (left, right) = here.fold((mean, mean), |(left, right), n| (left.max(n), right.min(n)));
            spread = spread.max(left - right);
            widths.push([left - mean + half_car_width, mean - right + half_car_width]);
            let place = self.reference.point_at(*s);
            let (sin, cos) = place.psi.sin_cos();
            survey.points.push([place.point[0] - mean * sin, place.point[1] + mean * cos]);
        }
        survey.widths = (self.laps.len() > 1).then_some(widths);
        (survey, spread)
    }
}

/// Lateral deviations of a closed line from another one [m], at stations of the other.
fn laterals_at(reference: &TrackLine, line: &TrackLine, stations: &[f64]) -> Vec<f64> {
    let length = reference.length();
    let mut last = reference.locate_point(line.point_at(0.0).point, Some(line.point_at(0.0).psi));
    let mut along = last.s - length * (last.s / length).round();
    let mut projected = vec![[along, last.lateral]];
    for s in line.knot_stations().skip(1) {
        let here = reference.follow_point(last.s, line.point_at(s).point);
        along += reference.station_change(last.s, here.s);
        last = here;
        // Where it goes back, what it drives from there on counts.
        while projected.len() > 1 && projected.last().is_some_and(|it| it[0] >= along) {
            projected.pop();
        }
        projected.push([along, here.lateral]);
    }
    let [first_s, first_n] = projected[0];
    projected.push([first_s + length, first_n]);
    let lateral = |s: &f64| {
        let s = first_s + (s - first_s).rem_euclid(length);
        let next = projected.partition_point(|it| it[0] <= s).clamp(1, projected.len() - 1);
        let [[a, n_a], [b, n_b]] = [projected[next - 1], projected[next]];
        let share = if b > a { ((s - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
        n_a + share * (n_b - n_a)
    };
    stations.iter().map(lateral).collect()
}

fn no_line() -> Error {
    Error::Log(
        "expected a line through the positions, found none: they are too far from one another".to_owned(),
    )
}

#[cfg(test)]
mod tests;
