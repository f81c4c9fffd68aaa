//! Gathers what the player of the page shows: the car's way, signals, checks, faults and diagrams, as JSON beside its script.

mod quantized;

use std::collections::BTreeMap;

use assessment::check::CheckVerdict;
use html_page::{Markup, Safe, script_json};
use manoeuvre::{DiagramLayerKind, DiagramScale, TestDiagram, TestTrack};
use recording::StatusSource;
use recording::overview::{
    CURVE_POINTS, CompletedLap, MOST_CURVES, MOST_MOVING_CURVES, MOST_XY_POINTS, RunOverview, StatusSpan,
    curve_abscissae,
};
use recording::view::{CurveRole, XyPlot};
use serde::Serialize;
use units::display::{label_text, number_text, quantity_text, unit_text};

use super::RunPictures;
use super::driven_map::{DrivenMap, driven_map, thinned_points};
use super::pictures::{trace_names, worst_trace_value};
use crate::report::TestPicture;
use numerics::text::format_lap_time;

use crate::report::laps;
use crate::report::text::shorten_list;
use quantized::QuantizedValues;

/// The script and the style of the player.
const SCRIPT: &str = include_str!("../../../templates/player.js");
const STYLE: &str = include_str!("../../../templates/player.css");

/// Checks with a plot in the player at most; others keep their pictures.
const MOST_CHECKS: usize = 60;
/// Points of a curve of a diagram, of an edge of the road and of a function at most.
const MOST_POINTS: usize = 1_500;
const MOST_EDGE_POINTS: usize = 3_000;
const FUNCTION_POINTS: usize = 160;
/// Powers of ten of the digits that are kept: of positions [m], angles [rad], and speeds [m/s].
const POSITION_DIGITS: i32 = -2;
const ANGLE_DIGITS: i32 = -3;
const SPEED_DIGITS: i32 = -2;

/// What the page has of the player.
pub struct RunPlayer {
    /// The driven way without a script.
    pub map: Option<Markup>,
    /// What is shown, as JSON inside of a script.
    pub data: Markup,
    /// How fine it is, in words.
    pub resolution: String,
}

/// Everything the script knows.
#[derive(Serialize)]
struct PlayerData<'a> {
    /// Time of the first and the last row [s], and the communication step [s].
    time: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    car: Option<CarData>,
    road: Vec<[QuantizedValues; 2]>,
    cones: Vec<[f64; 2]>,
    /// Cones that the car hit, each with the moment of its first touch [s].
    hits: Vec<([f64; 2], f64)>,
    course: Vec<[QuantizedValues; 2]>,
    /// What the tests are called, with the speed at which they began.
    tests: Vec<String>,
    /// Their stages, each with its beginning [s].
    stages: Vec<(f64, &'a str)>,
    /// Duration of a bucket of a curve [s], and its communication points.
    bucket: (f64, usize),
    plots: Vec<PlotData<'a>>,
    checks: Vec<CheckData<'a>>,
    /// Failed checks that have nothing to draw over time, such as those of results.
    failures: Vec<FailureData<'a>>,
    laps: Vec<LapData>,
    faults: BTreeMap<&'a str, Vec<[f64; 2]>>,
    diagrams: Vec<DiagramData<'a>>,
    xy: Vec<XyData<'a>>,
}

#[derive(Serialize)]
struct CarData {
    /// Time between two poses [s]; the last one is that of the last row.
    step: f64,
    x: QuantizedValues,
    y: QuantizedValues,
    heading: QuantizedValues,
    #[serde(skip_serializing_if = "Option::is_none")]
    steer: Option<QuantizedValues>,
    #[serde(skip_serializing_if = "Option::is_none")]
    speed: Option<QuantizedValues>,
    length: f64,
    width: f64,
    axles: [f64; 2],
}

#[derive(Serialize)]
struct PlotData<'a> {
    title: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<[f64; 2]>,
    curves: Vec<CurveData<'a>>,
    limits: Vec<LimitData>,
}

#[derive(Serialize)]
struct CurveData<'a> {
    label: &'a str,
    role: CurveRole,
    bound: bool,
    /// Two values for each bucket, in the order of their time.
    values: QuantizedValues,
}

#[derive(Serialize)]
struct LimitData {
    value: f64,
    during: [f64; 2],
}

#[derive(Serialize)]
struct CheckData<'a> {
    place: usize,
    name: &'a str,
    that: &'a str,
    passed: bool,
    unit: String,
    names: [&'a str; 2],
    during: [f64; 2],
    first: Option<f64>,
    at: Option<f64>,
    worst: Option<f64>,
    t: QuantizedValues,
    /// The lowest and the highest value of each point, and of its limit.
    value: [QuantizedValues; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<[QuantizedValues; 2]>,
    violated: Vec<[f64; 2]>,
}

/// A failed check without a plot.
#[derive(Serialize)]
struct FailureData<'a> {
    name: &'a str,
    that: &'a str,
    /// What was found, or why there is nothing.
    found: String,
}

#[derive(Serialize)]
struct LapData {
    name: String,
    span: [f64; 2],
}

#[derive(Serialize)]
struct DiagramData<'a> {
    title: &'a str,
    labels: [String; 2],
    scale: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    range: Option<[f64; 2]>,
    layers: Vec<LayerData<'a>>,
}

#[derive(Serialize)]
struct LayerData<'a> {
    name: &'a str,
    kind: &'static str,
    x: QuantizedValues,
    y: QuantizedValues,
    #[serde(skip_serializing_if = "Option::is_none")]
    t: Option<QuantizedValues>,
}

#[derive(Serialize)]
struct XyData<'a> {
    title: &'a str,
    labels: [String; 2],
    ranges: [[f64; 2]; 2],
    /// Whether a unit is as long on both axes.
    equal: bool,
    ellipse: Option<[f64; 2]>,
    trail: f64,
    /// Time between two coordinates of a point [s].
    step: f64,
    points: Vec<XyLineData<'a>>,
    curves: Vec<XyLineData<'a>>,
    /// Curves that change with the run.
    moving: Vec<MovingCurveData<'a>>,
}

#[derive(Serialize)]
struct MovingCurveData<'a> {
    label: &'a str,
    role: CurveRole,
    /// Time between two shapes [s].
    step: f64,
    x: QuantizedValues,
    /// The ordinates of all shapes, one shape after the other.
    y: QuantizedValues,
}

#[derive(Serialize)]
struct XyLineData<'a> {
    label: &'a str,
    role: CurveRole,
    x: QuantizedValues,
    y: QuantizedValues,
}

impl RunPlayer {
    /// The player of a run; none of one that did not go from one time to another.
    pub fn new(pictures: &RunPictures, checks: &[CheckVerdict], laps: &[CompletedLap]) -> Option<Self> {
        let overview = pictures.overview;
        let [first, last] = overview.time_range()?;
        if first >= last {
            return None;
        }
        let tracks = pictures.tests.iter().filter_map(|test| test.track.as_ref());
        let (road, car, spans) = (overview.road_edges(), car_data(overview), overview.status_spans());
        let [hit_cones, cones] = [true, false].map(|hit| {
            let of = tracks.clone().map(TestTrack::hit_and_standing_cones);
            of.flat_map(|[hit_cones, cones]| if hit { hit_cones } else { cones }).collect::<Vec<_>>()
        });
        let touched = tracks.clone().flat_map(|track| track.hits.iter().flatten().copied());
        let data = PlayerData {
            time: [first, last, overview.step],
            road: road.iter().filter(|edge| edge.len() > 1).map(|edge| line_data(edge)).collect(),
            cones: if car.is_some() {
                cones.iter().map(|it| it.map(round_to_centimetres)).collect()
            } else {
                Vec::new()
            },
            hits: if car.is_some() {
                let cones = hit_cones.iter().map(|it| it.map(round_to_centimetres));
                cones.zip(touched).collect()
            } else {
                Vec::new()
            },
            course: tracks.clone().filter(|it| !it.path.is_empty()).map(|it| line_data(&it.path)).collect(),
            tests: pictures.tests.iter().map(test_title).collect(),
            stages: pictures
                .tests
                .iter()
                .flat_map(|test| {
                    let stages = test.stages.iter().map(|(time, name)| (*time, *name));
                    stages.chain(test.end.map(|end| (end, "end of the test")))
                })
                .collect(),
            bucket: (overview.envelopes.stride() as f64 * overview.step, overview.envelopes.stride()),
            plots: plots_data(overview),
            checks: checks_data(&spans, checks),
            failures: checks
                .iter()
                .filter(|check| !check.passed && !has_trace(check))
                .map(failure_data)
                .collect(),
            laps: laps.iter().map(lap_data).collect(),
            faults: fault_spans(&spans),
            diagrams: pictures.tests.iter().flat_map(|test| &test.diagrams).map(diagram_data).collect(),
            xy: xy_data(overview),
            car,
        };
        let path: Vec<_> = tracks.flat_map(|track| track.path.iter().copied()).collect();
        let map = overview.has_body().then(|| {
            driven_map(&DrivenMap {
                poses: overview.poses.samples(),
                road: &road,
                cones: &cones,
                hit_cones: &hit_cones,
                course: &path,
            })
        });
        let resolution = resolution_text(overview);
        let json = serde_json::to_string(&data).unwrap_or_default();
        Some(RunPlayer { map, data: script_json(&json), resolution })
    }

    /// Its script.
    pub fn script() -> Markup {
        Safe(SCRIPT.to_owned())
    }

    /// Its style.
    pub fn style() -> Markup {
        Safe(STYLE.to_owned())
    }
}

/// How fine the page shows what the recording has.
fn resolution_text(overview: &RunOverview) -> String {
    let every = |stride: usize| format!("{} s", diagnostics::rounded_time(stride as f64 * overview.step));
    let mut sentences = Vec::new();
    let stride = overview.envelopes.stride();
    if !overview.view.plots.is_empty() {
        sentences.push(match stride {
            1 => "Signals have all communication points.".to_owned(),
            _ => format!(
                "Signals have the lowest and the highest value of each {} ({stride} communication points), so no peak is lost; the numbers beside \
                 their names are the nearest of these.",
                every(stride)
            ),
        });
    }
    if overview.has_body() && overview.poses.stride() > 1 {
        sentences.push(format!("Poses are {} apart.", every(overview.poses.stride())));
    }
    sentences.extend(omission_text("Plots", &overview.omitted_plots, &format!("{MOST_CURVES} curves")));
    let most = format!("{MOST_XY_POINTS} points and {MOST_MOVING_CURVES} moving curves");
    sentences.extend(omission_text("Diagrams", &overview.omitted_xy_plots, &most));
    let plots = overview.view.xy_plots.iter();
    sentences.extend(
        plots.zip(curves_without_values(overview)).filter(|(_, curves)| !curves.is_empty()).map(
            |(plot, curves)| {
                format!(
                    "In the diagram {} no value of {} lies within its axes.",
                    plot.title,
                    curves.join(", ")
                )
            },
        ),
    );
    sentences.push("run.mcap has all values.".to_owned());
    sentences.join(" ")
}

/// Which things are left out, as a page has `most` of them.
fn omission_text(what: &str, titles: &[String], most: &str) -> Option<String> {
    let titles = (!titles.is_empty()).then(|| shorten_list(titles))?;
    Some(format!("{what} that are left out, as a page has {most} at most: {titles}."))
}

/// The curves and points of each diagram that nothing can be drawn of: they are never a number within the axes.
fn curves_without_values(overview: &RunOverview) -> Vec<Vec<&str>> {
    let (mut samples, mut shapes) = (overview.xy_points.iter(), overview.xy_curves.iter());
    let plots = overview.view.xy_plots.iter();
    plots
        .map(|plot| {
            let inside = |axis: usize, value: f64| {
                let [from, to] = plot.ranges[axis];
                (from.min(to)..=from.max(to)).contains(&value)
            };
            let points = plot.points.iter().zip(samples.by_ref()).filter_map(|(point, trace)| {
                let is_seen = trace.samples().iter().any(|[x, y]| inside(0, *x) && inside(1, *y));
                (!is_seen).then_some(point.label.as_str())
            });
            let points: Vec<_> = points.collect();
            let moving = plot.curves.iter().filter(|curve| curve.moves).zip(shapes.by_ref());
            let curves = moving.filter_map(|(curve, shapes)| {
                let is_seen = shapes.samples().iter().flatten().any(|y| inside(1, *y));
                (!is_seen).then_some(curve.label.as_str())
            });
            points.into_iter().chain(curves.collect::<Vec<_>>()).collect()
        })
        .collect()
}

/// What a test is called, with its entry speed.
fn test_title(test: &TestPicture) -> String {
    let speed = test.entry_speed;
    format!("{}, entry at {} m/s = {:.1} km/h", test.title, number_text(speed), 3.6 * speed)
}

fn lap_data(lap: &CompletedLap) -> LapData {
    let name = format!("lap {}: {}", lap.number, format_lap_time(lap.duration, laps::DECIMALS));
    LapData { name, span: [lap.end - lap.duration, lap.end] }
}

/// Whether a check has something to draw over time.
fn has_trace(check: &CheckVerdict) -> bool {
    let finite = |value: &[f64; 2]| value.iter().all(|it| it.is_finite());
    check.trace.points().iter().filter(|point| finite(&point.value)).count() > 1
}

fn failure_data(check: &CheckVerdict) -> FailureData<'_> {
    let quantity = |value| quantity_text(value, check.unit.as_deref());
    let found = match (&check.reason, check.value, check.limit) {
        (Some(reason), ..) => reason.clone(),
        (None, Some(value), Some(limit)) => format!("found {}, limit {}", quantity(value), quantity(limit)),
        (None, Some(value), None) => format!("found {}", quantity(value)),
        (None, None, _) => String::new(),
    };
    FailureData { name: &check.name, that: &check.that, found }
}

fn round_to_centimetres(value: f64) -> f64 {
    (100.0 * value).round() / 100.0
}

fn line_data(points: &[[f64; 2]]) -> [QuantizedValues; 2] {
    let kept = thinned_points(points, MOST_EDGE_POINTS);
    [0, 1].map(|axis| QuantizedValues::with_digits(kept.iter().map(|point| point[axis]), POSITION_DIGITS))
}

fn car_data(overview: &RunOverview) -> Option<CarData> {
    let (pose, last) = (overview.view.pose.as_ref()?, overview.last_pose?);
    let poses = || overview.poses.samples().iter().chain([&last]);
    let heading = QuantizedValues::with_digits(poses().map(|it| it.heading), ANGLE_DIGITS);
    let steer = pose.steer.map(|_| QuantizedValues::with_digits(poses().map(|it| it.steer), ANGLE_DIGITS));
    let speed = pose.speed.map(|_| QuantizedValues::with_digits(poses().map(|it| it.speed), SPEED_DIGITS));
    Some(CarData {
        step: overview.poses.stride() as f64 * overview.step,
        x: QuantizedValues::with_digits(poses().map(|it| it.position[0]), POSITION_DIGITS),
        y: QuantizedValues::with_digits(poses().map(|it| it.position[1]), POSITION_DIGITS),
        heading,
        steer,
        speed,
        length: pose.length,
        width: pose.width,
        axles: pose.axles,
    })
}

fn plots_data(overview: &RunOverview) -> Vec<PlotData<'_>> {
    let mut next = 0;
    overview
        .view
        .plots
        .iter()
        .map(|plot| {
            let first = next;
            next += plot.series.len();
            let curves = plot.series.iter().enumerate().map(|(place, series)| CurveData {
                label: &series.label,
                role: series.role,
                bound: series.bound,
                values: QuantizedValues::new(overview.envelopes.extremes(first + place).flatten()),
            });
            let limits = plot.series.iter().flat_map(|series| {
                let of = overview.view.limits.iter().filter(|limit| series.quantity.is_column(limit.column));
                of.map(|limit| LimitData {
                    value: limit.value * series.factor + series.offset,
                    during: limit.during,
                })
            });
            let limits = limits.filter(|limit| limit.value.is_finite()).collect();
            PlotData { title: label_text(&plot.title), range: plot.range, curves: curves.collect(), limits }
        })
        .collect()
}

/// The time spans of each fault, by its name [s].
fn fault_spans(spans: &[StatusSpan]) -> BTreeMap<&str, Vec<[f64; 2]>> {
    let mut faults: BTreeMap<&str, Vec<[f64; 2]>> = BTreeMap::new();
    for it in spans {
        if let StatusSource::Fault(name) = &it.source {
            faults.entry(name).or_default().push(it.span);
        }
    }
    faults
}

fn checks_data<'a>(spans: &[StatusSpan], checks: &'a [CheckVerdict]) -> Vec<CheckData<'a>> {
    let violated = |name: &str| {
        let of = spans.iter().filter(|it| matches!(&it.source, StatusSource::Check(check) if check == name));
        of.map(|it| it.span).collect()
    };
    let mut shown: Vec<_> = checks.iter().enumerate().filter(|(_, check)| has_trace(check)).collect();
    shown.sort_by_key(|(_, check)| check.passed);
    shown.truncate(MOST_CHECKS);
    let data = |(place, check): (usize, &'a CheckVerdict)| {
        let points = check.trace.points();
        let [value, limit] = [0, 1].map(|of| {
            [0, 1].map(|end| {
                QuantizedValues::new(
                    points.iter().map(|point| if of == 0 { point.value[end] } else { point.limit[end] }),
                )
            })
        });
        CheckData {
            place,
            name: &check.name,
            that: &check.that,
            passed: check.passed,
            unit: unit_text(check.unit.as_deref().unwrap_or_default()),
            names: trace_names(check),
            during: check.during,
            first: check.first,
            at: check.at,
            worst: worst_trace_value(check),
            t: QuantizedValues::new(points.iter().map(|point| point.time)),
            value,
            limit: points.iter().any(|point| point.limit[0].is_finite()).then_some(limit),
            violated: violated(&check.name),
        }
    };
    shown.into_iter().map(data).collect()
}

fn diagram_data(diagram: &TestDiagram) -> DiagramData<'_> {
    let layers = diagram.layers.iter().map(|layer| {
        let places: Vec<usize> = (0..layer.x.len()).collect();
        let places = thinned_points(&places, MOST_POINTS);
        let of = |values: &[f64]| QuantizedValues::new(places.iter().map(|place| values[*place]));
        LayerData {
            name: &layer.name,
            kind: match layer.kind {
                DiagramLayerKind::Curve => "curve",
                DiagramLayerKind::SecondCurve => "second",
                DiagramLayerKind::Reference => "reference",
                DiagramLayerKind::Fit => "fit",
                DiagramLayerKind::Limit => "limit",
                DiagramLayerKind::Mark => "mark",
            },
            x: of(&layer.x),
            y: of(&layer.y),
            t: (!layer.t.is_empty()).then(|| of(&layer.t)),
        }
    });
    DiagramData {
        title: &diagram.title,
        labels: [diagram.x_label, diagram.y_label].map(label_text),
        scale: match diagram.x_scale {
            DiagramScale::Linear => "linear",
            DiagramScale::Logarithmic => "logarithmic",
            DiagramScale::Time => "time",
        },
        range: diagram.y_range,
        layers: layers.collect(),
    }
}

/// The ordinates of shapes, as far as an axis and its length beyond it: a pole would take all digits.
fn moving_ordinates(plot: &XyPlot, shapes: &[[f64; CURVE_POINTS]]) -> QuantizedValues {
    let [from, to] = plot.ranges[1];
    let (low, high, length) = (from.min(to), from.max(to), (to - from).abs());
    QuantizedValues::new(shapes.iter().flatten().map(|y| y.clamp(low - length, high + length)))
}

fn xy_data(overview: &RunOverview) -> Vec<XyData<'_>> {
    let (mut samples, mut shapes) = (overview.xy_points.iter(), overview.xy_curves.iter());
    let plots = overview.view.xy_plots.iter();
    plots
        .map(|plot| {
            let moving = plot.curves.iter().filter(|curve| curve.moves).zip(shapes.by_ref());
            let moving = moving.map(|(curve, shapes)| MovingCurveData {
                label: &curve.label,
                role: curve.role,
                step: shapes.stride() as f64 * overview.step,
                x: QuantizedValues::new(curve_abscissae(plot).into_iter()),
                y: moving_ordinates(plot, shapes.samples()),
            });
            let moving = moving.collect();
            let traces: Vec<_> = samples.by_ref().take(plot.points.len()).collect();
            let [from, to] = plot.ranges[0];
            let abscissae = (0..FUNCTION_POINTS)
                .map(|k| from + (to - from) * k as f64 / (FUNCTION_POINTS - 1) as f64)
                .collect::<Vec<_>>();
            let row = recording::Row::default();
            let fixed = plot.curves.iter().filter(|curve| !curve.moves);
            XyData {
                title: &plot.title,
                labels: plot.labels.each_ref().map(|label| label_text(label)),
                ranges: plot.ranges,
                equal: plot.has_equal_scales(),
                moving,
                ellipse: plot.ellipse,
                trail: plot.trail,
                step: traces.first().map_or(1, |it| it.stride()) as f64 * overview.step,
                points: plot
                    .points
                    .iter()
                    .zip(&traces)
                    .map(|(point, trace)| XyLineData {
                        label: &point.label,
                        role: point.role,
                        x: QuantizedValues::new(trace.samples().iter().map(|it| it[0])),
                        y: QuantizedValues::new(trace.samples().iter().map(|it| it[1])),
                    })
                    .collect(),
                curves: fixed
                    .map(|curve| XyLineData {
                        label: &curve.label,
                        role: curve.role,
                        x: QuantizedValues::new(abscissae.iter().copied()),
                        y: QuantizedValues::new(abscissae.iter().map(|x| curve.evaluate_at(0.0, &row, *x))),
                    })
                    .collect(),
            }
        })
        .collect()
}
