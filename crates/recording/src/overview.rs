//! Keeps an overview of a run in bounded memory while it goes on: the pose of its body, the envelopes of its plots, the time spans of its
//! faults, its laps. A page can show a run of any length by it.

mod envelope;
mod laps;

use std::collections::BTreeMap;

use diagnostics::Error;

pub use envelope::Envelopes;
pub use laps::CompletedLap;

use crate::road_samples::RoadSamples;
use crate::row::{RecordedVariables, Row};
use crate::sink::{CheckOrFaultStatus, RunHeader, Sink, StatusChange, StatusSource};
use crate::thinned_samples::ThinnedSamples;
use crate::view::{PoseColumns, ReplayView, XyPlot, XyPlotFunction};
use laps::LapRecorder;

/// Curves of plots at most: more than anybody looks through on one page. Plots that would exceed it are left out.
pub const MOST_CURVES: usize = 64;
/// Values of all envelopes at most: about a megabyte of text.
const MOST_VALUES: usize = 160_000;
/// Buckets of an envelope at most: several on each pixel of a screen are of no use.
const MOST_BUCKETS: usize = 2_400;
/// Poses, points of the road and of diagrams at most.
const MOST_POSES: usize = 6_000;
const MOST_POINTS: usize = 3_000;
/// Points of diagrams at most, each with a trace of its own. Diagrams that would exceed it are left out.
pub const MOST_XY_POINTS: usize = 12;
/// Curves of diagrams that move at most, in the same way.
pub const MOST_MOVING_CURVES: usize = 6;
/// Points of a curve that moves, and its shapes at most.
pub const CURVE_POINTS: usize = 81;
const MOST_SHAPES: usize = 256;
/// Time spans at most, of all faults and checks.
const MOST_SPANS: usize = 2_000;

/// A pose of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseSample {
    /// Position east and north [m].
    pub position: [f64; 2],
    /// Heading [rad], counter-clockwise from east.
    pub heading: f64,
    /// Road-wheel angle [rad]; 0 where nothing tells it.
    pub steer: f64,
    /// Speed [m/s]; not a number where nothing tells it.
    pub speed: f64,
}

/// A time span in which a fault acts or a check does not hold.
#[derive(Debug, Clone, PartialEq)]
pub struct StatusSpan {
    /// The fault or the check.
    pub source: StatusSource,
    /// First and last moment [s].
    pub span: [f64; 2],
}

/// Takes the rows of a run, and keeps an overview of them. It allocates when it is made, not for a row.
#[derive(Debug)]
pub struct RunOverview {
    /// The layout of what is kept: of plots those whose curves have envelopes.
    pub view: ReplayView,
    /// The titles of plots that are left out, as there are so many.
    pub omitted_plots: Vec<String>,
    /// The titles of diagrams that are left out, as they have so many points or moving curves.
    pub omitted_xy_plots: Vec<String>,
    /// The envelopes of all curves of the plots, one after the other.
    pub envelopes: Envelopes,
    /// The poses, from the first row on.
    pub poses: ThinnedSamples<PoseSample>,
    /// The last of them, which may lie between two that are kept.
    pub last_pose: Option<PoseSample>,
    /// The coordinates of each moving point of the diagrams, from the first row on.
    pub xy_points: Vec<ThinnedSamples<[f64; 2]>>,
    /// The shapes of each curve of the diagrams that moves, from the first row on: y over [`curve_abscissae`].
    pub xy_curves: Vec<ThinnedSamples<[f64; CURVE_POINTS]>>,
    /// Spans that have ended.
    pub spans: Vec<StatusSpan>,
    /// Spans that go on, by what they are of and their beginning [s].
    open_spans: BTreeMap<StatusSource, f64>,
    road: Option<RoadSamples>,
    laps: Option<LapRecorder>,
    /// Time of the first and of the last row [s].
    ends: Option<[f64; 2]>,
    /// Whether it keeps more of a row than its time.
    has_pictures: bool,
    /// Communication step [s].
    pub step: f64,
}

impl RunOverview {
    /// An overview of the run to come; `pose` is the moving body, if there is one.
    #[must_use]
    pub fn new(header: &RunHeader, pose: Option<PoseColumns>) -> Self {
        let mut view = ReplayView { pose, ..header.view.clone() };
        let (mut wanted, mut omitted_plots) = (0, Vec::new());
        view.plots.retain(|plot| {
            wanted += plot.series.len();
            if wanted > MOST_CURVES {
                omitted_plots.push(plot.title.clone());
            }
            wanted <= MOST_CURVES
        });
        let omitted_xy_plots = omit_large_xy_plots(&mut view.xy_plots);
        let curves = view.plots.iter().map(|plot| plot.series.len()).sum();
        let buckets = (MOST_VALUES / 2 / usize::max(curves, 1)).min(MOST_BUCKETS);
        let most_poses = if view.pose.is_some() { MOST_POSES } else { 2 };
        let points = view.xy_plots.iter().flat_map(|plot| &plot.points);
        let laps = LapRecorder::from_columns(&header.columns);
        let has_plots = curves > 0 || !view.xy_plots.is_empty();
        RunOverview {
            has_pictures: has_plots || view.pose.is_some() || view.track.is_some() || laps.is_some(),
            omitted_plots,
            omitted_xy_plots,
            envelopes: Envelopes::new(curves, buckets),
            poses: ThinnedSamples::with_limit(most_poses),
            last_pose: None,
            xy_points: points.map(|_| ThinnedSamples::with_limit(MOST_POINTS)).collect(),
            xy_curves: moving_curves(&view.xy_plots)
                .map(|_| ThinnedSamples::with_limit(MOST_SHAPES))
                .collect(),
            laps,
            spans: Vec::new(),
            open_spans: BTreeMap::new(),
            road: view.track.clone().map(|track| RoadSamples::with_limit(track, MOST_POINTS)),
            ends: None,
            step: header.step,
            view,
        }
    }

    /// Time of the first and of the last row [s]; none before the first row.
    #[must_use]
    pub fn time_range(&self) -> Option<[f64; 2]> {
        self.ends
    }

    /// Whether there are poses.
    #[must_use]
    pub fn has_body(&self) -> bool {
        self.view.pose.is_some() && self.last_pose.is_some()
    }

    /// The left and the right edge of the road [m].
    #[must_use]
    pub fn road_edges(&self) -> [Vec<[f64; 2]>; 2] {
        self.road.as_ref().map(RoadSamples::edges).unwrap_or_default()
    }

    /// The completed laps, in their order.
    #[must_use]
    pub fn completed_laps(&self) -> &[CompletedLap] {
        self.laps.as_ref().map_or(&[], |laps| &laps.laps)
    }

    /// All spans, also those that go on at the end, in the order of their beginning.
    #[must_use]
    pub fn status_spans(&self) -> Vec<StatusSpan> {
        let end = self.ends.map_or(0.0, |ends| ends[1]);
        let open = self.open_spans.iter();
        let open = open.map(|(source, begin)| StatusSpan { source: source.clone(), span: [*begin, end] });
        let mut all: Vec<_> = self.spans.iter().cloned().chain(open).collect();
        all.sort_by(|a, b| a.span[0].total_cmp(&b.span[0]));
        all
    }
}

/// The abscissae of a moving curve, evenly spaced over the axis of its diagram.
#[must_use]
pub fn curve_abscissae(plot: &XyPlot) -> [f64; CURVE_POINTS] {
    let [from, to] = plot.ranges[0];
    std::array::from_fn(|place| from + (to - from) * place as f64 / (CURVE_POINTS - 1) as f64)
}

/// The curves of diagrams that move, each with its diagram.
fn moving_curves(plots: &[XyPlot]) -> impl Iterator<Item = (&XyPlot, &XyPlotFunction)> {
    plots.iter().flat_map(|plot| plot.curves.iter().filter(|it| it.moves).map(move |it| (plot, it)))
}

/// Takes out the diagrams that exceed what a page has of points and moving curves. Returns their titles.
fn omit_large_xy_plots(plots: &mut Vec<XyPlot>) -> Vec<String> {
    let (mut points, mut curves, mut omitted) = (0, 0, Vec::new());
    plots.retain(|plot| {
        let more_points = points + plot.points.len();
        let more_curves = curves + plot.curves.iter().filter(|it| it.moves).count();
        let is_kept = more_points <= MOST_XY_POINTS && more_curves <= MOST_MOVING_CURVES;
        if is_kept {
            (points, curves) = (more_points, more_curves);
        } else {
            omitted.push(plot.title.clone());
        }
        is_kept
    });
    omitted
}

impl Sink for RunOverview {
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        self.ends = Some([self.ends.map_or(time, |ends| ends[0]), time]);
        if !self.has_pictures {
            return Ok(());
        }
        let curves = self.view.plots.iter().flat_map(|plot| &plot.series);
        self.envelopes.push(curves.map(|it| it.quantity.evaluate(time, row) * it.factor + it.offset));
        if let Some(pose) = &self.view.pose {
            let sample = PoseSample {
                position: [row[pose.x], row[pose.y]],
                heading: row[pose.heading],
                steer: pose.steer.map_or(0.0, |it| row[it]),
                speed: pose.speed.map_or(f64::NAN, |it| row[it]),
            };
            self.poses.push(sample);
            self.last_pose = Some(sample);
        }
        let points = self.view.xy_plots.iter().flat_map(|plot| &plot.points);
        for (samples, point) in self.xy_points.iter_mut().zip(points) {
            samples.push_with(|| point.coordinates.each_ref().map(|it| it.evaluate(time, row)));
        }
        for (shapes, (plot, curve)) in self.xy_curves.iter_mut().zip(moving_curves(&self.view.xy_plots)) {
            shapes.push_with(|| curve_abscissae(plot).map(|x| curve.evaluate_at(time, row, x)));
        }
        if let Some(road) = &mut self.road {
            road.push_row(time, row);
        }
        if let Some(laps) = &mut self.laps {
            laps.push_row(time, row);
        }
        Ok(())
    }

    fn push_status_change(&mut self, change: &StatusChange) -> Result<(), Error> {
        let acts = matches!(change.status, CheckOrFaultStatus::Active | CheckOrFaultStatus::Violated);
        let has_room = self.spans.len() < MOST_SPANS;
        if acts && has_room {
            self.open_spans.entry(change.track.clone()).or_insert(change.time);
        } else if !acts
            && let Some((source, begin)) = self.open_spans.remove_entry(&change.track)
            && has_room
        {
            self.spans.push(StatusSpan { source, span: [begin, change.time] });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use expression::NumberIndex;

    use super::*;
    use crate::view::{CurveRole, RowQuantity, XyPlotPoint};

    #[test]
    fn diagrams_beyond_the_limit_are_named_and_smaller_ones_stay() {
        let plot = |title: &str, points: usize| {
            let column = || RowQuantity::Column(NumberIndex::new(0));
            let coordinates = || [column(), column()];
            let point =
                |_| XyPlotPoint { label: String::new(), role: CurveRole::Other, coordinates: coordinates() };
            XyPlot {
                title: title.to_owned(),
                labels: Default::default(),
                ranges: [[0.0, 8.0], [0.0, 1.0]],
                ellipse: None,
                trail: 0.0,
                points: (0..points).map(point).collect(),
                curves: Vec::new(),
            }
        };
        let mut plots = vec![plot("four wheels", 4), plot("many", MOST_XY_POINTS), plot("two axles", 2)];
        assert_eq!(omit_large_xy_plots(&mut plots), ["many"]);
        assert_eq!(
            plots.iter().map(|it| it.title.as_str()).collect::<Vec<_>>(),
            ["four wheels", "two axles"]
        );
        let abscissae = curve_abscissae(&plots[0]);
        assert_eq!([abscissae[0], abscissae[1], abscissae[CURVE_POINTS - 1]], [0.0, 0.1, 8.0]);
    }
}
