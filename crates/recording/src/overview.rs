//! Keeps an overview of a run in bounded memory while it goes on: the pose of its body, the envelopes of its plots, the time spans of its
//! faults. A page can show a run of any length by it.

mod envelope;

use diagnostics::Error;

pub use envelope::Envelopes;

use crate::road_samples::RoadSamples;
use crate::row::{RecordedVariables, Row};
use crate::sink::{CheckOrFaultStatus, RunHeader, Sink, StatusChange, StatusSource};
use crate::thinned_samples::ThinnedSamples;
use crate::view::{PoseColumns, ReplayView};

/// Curves of plots at most: more than anybody looks through on one page. Plots that would exceed it are left out.
const MOST_CURVES: usize = 64;
/// Values of all envelopes at most: about a megabyte of text.
const MOST_VALUES: usize = 160_000;
/// Buckets of an envelope at most: several on each pixel of a screen are of no use.
const MOST_BUCKETS: usize = 2_400;
/// Poses, points of the road and of diagrams at most.
const MOST_POSES: usize = 6_000;
const MOST_POINTS: usize = 3_000;
/// Points of diagrams at most, each with a trace of its own.
const MOST_XY_POINTS: usize = 12;
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
    /// Plots that are left out, as there are so many.
    pub omitted_plots: usize,
    /// The envelopes of all curves of the plots, one after the other.
    pub envelopes: Envelopes,
    /// The poses, from the first row on.
    pub poses: ThinnedSamples<PoseSample>,
    /// The last of them, which may lie between two that are kept.
    pub last_pose: Option<PoseSample>,
    /// The coordinates of each moving point of the diagrams, from the first row on.
    pub xy_points: Vec<ThinnedSamples<[f64; 2]>>,
    /// Spans that have ended.
    pub spans: Vec<StatusSpan>,
    /// Spans that go on, by what they are of and their beginning [s].
    open_spans: Vec<(StatusSource, f64)>,
    road: Option<RoadSamples>,
    /// Time of the first and of the last row [s].
    ends: Option<[f64; 2]>,
    /// Communication step [s].
    pub step: f64,
}

impl RunOverview {
    /// An overview of the run to come; `pose` is the moving body, if there is one.
    #[must_use]
    pub fn new(header: &RunHeader, pose: Option<PoseColumns>) -> Self {
        let mut view = ReplayView { pose, ..header.view.clone() };
        let (all, mut wanted) = (view.plots.len(), 0);
        view.plots.retain(|plot| {
            wanted += plot.series.len();
            wanted <= MOST_CURVES
        });
        let curves = view.plots.iter().map(|plot| plot.series.len()).sum();
        let buckets = (MOST_VALUES / 2 / usize::max(curves, 1)).min(MOST_BUCKETS);
        let most_poses = if view.pose.is_some() { MOST_POSES } else { 2 };
        if view.xy_plots.iter().map(|plot| plot.points.len()).sum::<usize>() > MOST_XY_POINTS {
            view.xy_plots.clear();
        }
        let points = view.xy_plots.iter().flat_map(|plot| &plot.points);
        RunOverview {
            omitted_plots: all - view.plots.len(),
            envelopes: Envelopes::new(curves, buckets),
            poses: ThinnedSamples::with_limit(most_poses),
            last_pose: None,
            xy_points: points.map(|_| ThinnedSamples::with_limit(MOST_POINTS)).collect(),
            spans: Vec::new(),
            open_spans: Vec::new(),
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

impl Sink for RunOverview {
    fn push_row(&mut self, _tick: u64, time: f64, row: &Row<RecordedVariables>) -> Result<(), Error> {
        self.ends = Some([self.ends.map_or(time, |ends| ends[0]), time]);
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
        if let Some(road) = &mut self.road {
            road.push_row(time, row);
        }
        Ok(())
    }

    fn push_status_change(&mut self, change: &StatusChange) -> Result<(), Error> {
        let open = self.open_spans.iter().position(|(source, _)| *source == change.track);
        let acts = matches!(change.status, CheckOrFaultStatus::Active | CheckOrFaultStatus::Violated);
        match open {
            Some(place) if !acts => {
                let (source, begin) = self.open_spans.swap_remove(place);
                if self.spans.len() < MOST_SPANS {
                    self.spans.push(StatusSpan { source, span: [begin, change.time] });
                }
            }
            None if acts && self.spans.len() < MOST_SPANS => {
                self.open_spans.push((change.track.clone(), change.time));
            }
            _ => {}
        }
        Ok(())
    }
}
