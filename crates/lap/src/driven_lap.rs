//! Finds the fastest complete lap in the positions of a log, and when and how fast it passed the nodes of a fastest lap.

use track::{TrackLine, point_distance};

use crate::Error;
use crate::corners::Corner;
use crate::optimum::{LapNode, LapOptimum};

/// Position of the car at a time, both as logged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionSample {
    /// Time [s].
    pub t: f64,
    /// Position in the frame of the track [m].
    pub position: [f64; 2],
}

/// A lap that somebody drove, at the stations of the nodes of a fastest lap.
#[derive(Clone, Debug, PartialEq)]
pub struct DrivenLap {
    /// Number of the lap among the complete ones, from 1 on.
    pub number: usize,
    /// How many complete laps there are.
    pub count: usize,
    /// Time of the log at the first node [s].
    pub begin: f64,
    /// Time of the lap [s].
    pub lap_time: f64,
    /// The car at each node.
    pub nodes: Vec<DrivenNode>,
    /// The car at the end of the lap.
    pub end: DrivenNode,
    /// Longest time between two samples of the lap [s].
    pub longest_gap: f64,
}

/// A driven car where it passes the station of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivenNode {
    /// Time since the first node [s].
    pub t: f64,
    /// Position [m].
    pub position: [f64; 2],
    /// Lateral deviation from the line [m].
    pub n: f64,
    /// Speed over ground [m/s], from the way between the nodes on both sides.
    pub speed: f64,
}

/// A sample beside the line.
struct ProjectedSample {
    t: f64,
    position: [f64; 2],
    /// Way along the line, which goes on over the start of a closed one [m].
    distance: f64,
    n: f64,
}

/// A log that begins so near behind the start, or ends so near before the end, has the whole lap [m].
const TOLERANCE: f64 = 1.0;
/// So many of its samples a log is continued by at its ends, as fast as it is there.
const CONTINUED_SAMPLES: f64 = 1.5;
/// Way beside the road from which on a log is doubted [m]: more than a car that runs wide.
const BESIDE_ROAD: f64 = 3.0;
/// Time without a position that is told [s].
const LONG_GAP: f64 = 0.5;
/// Share of the least lap time below which a log is not of this car.
const SURELY_FASTER: f64 = 0.98;
/// Deviation beyond which a car is not on the track [m].
const OFF_TRACK: f64 = 50.0;

impl DrivenLap {
    /// The fastest complete lap of a log, beside a fastest lap on the same line. A sample that is not finite, or not later than the one
    /// before, is left out.
    ///
    /// # Errors
    /// When the log has no complete lap on this line.
    pub fn find_fastest(
        samples: &[PositionSample],
        line: &TrackLine,
        optimum: &LapOptimum,
    ) -> Result<Self, Error> {
        let projected = project_samples(samples, line)?;
        let stations: Vec<f64> =
            optimum.nodes.iter().map(|node| node.s).chain(line.is_closed().then(|| line.length())).collect();
        let (Some(first), Some(last)) = (projected.first(), projected.last()) else {
            return Err(Error::Log("expected positions with rising times, found none".to_owned()));
        };
        let length = line.length();
        let begins: Vec<f64> = match line.is_closed() {
            true => {
                let laps = (first.distance / length).floor() as i64..=(last.distance / length).floor() as i64;
                laps.map(|lap| length * lap as f64).collect()
            }
            false => vec![0.0],
        };
        let laps: Vec<DrivenLap> = begins
            .iter()
            .filter_map(|begin| Self::at_stations(&projected, &stations, *begin, line))
            .collect();
        let count = laps.len();
        let fastest = laps.into_iter().enumerate().min_by(|a, b| a.1.lap_time.total_cmp(&b.1.lap_time));
        let (number, lap) =
            fastest.ok_or_else(|| Error::Log(no_lap_message(first, last, line, projected.len())))?;
        Ok(DrivenLap { number: number + 1, count, ..lap })
    }

    /// A lap from a way on, where the car passes the stations; none where it does not pass all.
    fn at_stations(
        samples: &[ProjectedSample],
        stations: &[f64],
        begin: f64,
        line: &TrackLine,
    ) -> Option<Self> {
        let mut nodes = Vec::with_capacity(stations.len());
        let mut at = 0;
        let mut longest_gap: f64 = 0.0;
        for s in stations {
            let distance = begin + s;
            while at + 2 < samples.len() && samples[at + 1].distance < distance {
                at += 1;
                if !nodes.is_empty() {
                    longest_gap = longest_gap.max(samples[at + 1].t - samples[at].t);
                }
            }
            let (a, b) = (samples.get(at)?, samples.get(at + 1)?);
            let way = b.distance - a.distance;
            let wanted = if way > 0.0 { (distance - a.distance) / way } else { 0.0 };
            let share = wanted.clamp(-CONTINUED_SAMPLES, 1.0 + CONTINUED_SAMPLES);
            let is_near = (distance - a.distance).abs().min((distance - b.distance).abs()) <= TOLERANCE;
            // A car that has just started, or that stands behind the line, is not continued.
            let share = match share == wanted && way > 0.0 {
                true => share,
                false if is_near => wanted.clamp(0.0, 1.0),
                false => return None,
            };
            let between = |a: f64, b: f64| a + share * (b - a);
            nodes.push(DrivenNode {
                t: between(a.t, b.t),
                position: [0, 1].map(|axis| between(a.position[axis], b.position[axis])),
                n: between(a.n, b.n),
                speed: 0.0,
            });
        }
        if nodes.iter().any(|node| node.n.abs() > OFF_TRACK) {
            return None;
        }
        let start = nodes.first()?.t;
        let speeds: Vec<f64> = (0..nodes.len())
            .map(|k| {
                let [a, b] = [k.saturating_sub(1), (k + 1).min(nodes.len() - 1)];
                let ways = nodes[a..=b].windows(2);
                let way: f64 = ways.map(|pair| point_distance(pair[0].position, pair[1].position)).sum();
                way / (nodes[b].t - nodes[a].t)
            })
            .collect();
        for (node, speed) in nodes.iter_mut().zip(speeds) {
            (node.t, node.speed) = (node.t - start, speed);
        }
        let end = *nodes.last()?;
        if line.is_closed() {
            nodes.pop();
        }
        Some(DrivenLap { number: 0, count: 0, begin: start, lap_time: end.t, nodes, end, longest_gap })
    }

    /// Time behind the fastest lap at a node [s].
    pub fn time_gap(&self, optimum: &LapOptimum, node: usize) -> f64 {
        self.nodes[node].t - optimum.nodes[node].t
    }

    /// Time that is lost to the fastest lap in a corner [s].
    pub fn time_lost(&self, optimum: &LapOptimum, corner: &Corner) -> f64 {
        let total = self.lap_time - optimum.lap_time;
        corner.duration(self.nodes.len(), |k| self.time_gap(optimum, k), total)
    }

    /// What is odd about it, in words.
    pub fn doubts(&self, line: &TrackLine, optimum: &LapOptimum) -> Vec<String> {
        let mut doubts = Vec::new();
        let beside_road = |(node, best): (&DrivenNode, &LapNode)| {
            line.widths_at(best.s).map_or(0.0, |[left, right]| (node.n - left).max(-right - node.n))
        };
        let beside_road: Vec<f64> = self.nodes.iter().zip(&optimum.nodes).map(beside_road).collect();
        let farthest = beside_road.iter().copied().fold(0.0, f64::max);
        if farthest > BESIDE_ROAD {
            let share = beside_road.iter().filter(|it| **it > 0.0).count() as f64 / beside_road.len() as f64;
            doubts.push(format!(
            "{:.0} % of the lap is beside the road, up to {farthest:.1} m: does the log have the origin of the track?",
            100.0 * share
        ));
        }
        if self.longest_gap > LONG_GAP {
            doubts.push(format!(
                "the positions of the lap have a gap of {:.1} s: speeds there are means over the gap",
                self.longest_gap
            ));
        }
        if self.lap_time < SURELY_FASTER * optimum.lap_time {
            doubts.push(
                "the lap is faster than this car can be: is its time in another unit, or was it another car?"
                    .to_owned(),
            );
        }
        doubts
    }

    /// Slowest speed in a corner [m/s].
    pub fn slowest_speed(&self, corner: &Corner) -> f64 {
        corner.nodes(self.nodes.len()).map(|k| self.nodes[k].speed).fold(f64::INFINITY, f64::min)
    }
}

/// Why a log has no complete lap, by the way from its first sample to its last.
fn no_lap_message(
    first: &ProjectedSample,
    last: &ProjectedSample,
    line: &TrackLine,
    samples: usize,
) -> String {
    let (way, length, s) = (last.distance - first.distance, line.length(), line.wrap_station(first.distance));
    let expected = "expected a lap from the start of the track to its end";
    match way {
        _ if way.abs() < 0.01 * length => format!(
            "{expected}, found {samples} positions within {:.1} m: perhaps they are in degrees or kilometres",
            way.abs()
        ),
        _ if way < 0.0 => format!("{expected}, found {:.0} m against the direction of the track", -way),
        _ => format!(
            "{expected}, found {:.1} % of its {length:.0} m, from s = {s:.0} m on",
            100.0 * way / length
        ),
    }
}

/// The samples that are finite, and later than the one before.
pub(crate) fn rising_samples(samples: &[PositionSample]) -> Vec<&PositionSample> {
    let mut rising: Vec<&PositionSample> = Vec::with_capacity(samples.len());
    for sample in samples {
        let is_finite = sample.t.is_finite() && sample.position.iter().all(|it| it.is_finite());
        if is_finite && rising.last().is_none_or(|before| sample.t > before.t) {
            rising.push(sample);
        }
    }
    rising
}

fn project_samples(samples: &[PositionSample], line: &TrackLine) -> Result<Vec<ProjectedSample>, Error> {
    let mut projected: Vec<ProjectedSample> = Vec::with_capacity(samples.len());
    let mut s_before = None;
    for sample in rising_samples(samples) {
        let station = match s_before {
            Some(s) => line.follow_point(s, sample.position),
            None => line.locate_point(sample.position, None),
        };
        let moved = s_before.map_or(0.0, |s| line.station_change(s, station.s));
        let distance = projected.last().map_or(station.s, |before| before.distance) + moved;
        s_before = Some(station.s);
        projected.push(ProjectedSample {
            t: sample.t,
            position: sample.position,
            distance,
            n: station.lateral,
        });
    }
    let far = projected.iter().filter(|sample| sample.n.abs() > OFF_TRACK).count();
    if 2 * far > projected.len() {
        let [x, y] = projected[projected.len() / 2].position;
        return Err(Error::Log(format!(
            "expected positions on the track, found most of them more than {OFF_TRACK} m beside it, such as ({x:.0} m, {y:.0} m): log and track \
             need one origin and one direction of their axes"
        )));
    }
    Ok(projected)
}
