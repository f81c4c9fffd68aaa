//! Draws the curves of a lap over the station, its g-g diagram, and how the times of its draws spread.

use html_page::{EqualScale, Markup, Plot, PlotAxis};
use lap::LapTimeInterval;
use units::STANDARD_GRAVITY;

use crate::LapPage;
use crate::phase::{DrivingPhase, add_phase_dots};

/// Sizes of a curve over the station and of the histogram [px].
const SIZE: [f64; 2] = [1080.0, 250.0];
const HISTOGRAM_SIZE: [f64; 2] = [560.0, 340.0];
const GG_SIZE: EqualScale = EqualScale { width: 560.0, heights: [200.0, 460.0], space: 16.0 };

/// Room for the numbers of the corners above a curve, over its height [-].
const NUMBERS: f64 = 0.12;

/// Class of the log in curves and on the map: a colour that nothing beside it has.
pub(crate) const LOG_CLASS: &str = "c3";

/// Fewest and most bars of the histogram.
const BARS: [f64; 2] = [5.0, 30.0];
/// Least width of all bars together [s].
const LEAST_SPREAD: f64 = 1e-3;

/// Speed, force, steering angle and lateral deviation over the station.
pub(crate) fn station_figures(page: &LapPage) -> Vec<Markup> {
    let nodes = &page.optimum.nodes;
    let speed = page.values_over_station(|k| 3.6 * nodes[k].variables.v_x);
    let force = page.values_over_station(|k| 1e-3 * nodes[k].variables.F_x);
    let delta = page.values_over_station(|k| nodes[k].variables.delta.to_degrees());
    let mut figures = Vec::new();
    figures.extend(time_gap_figure(page));
    figures.extend([
        speed_plot(page, &speed).figure_with_legend("Speed"),
        station_plot(page, "F_x [kN]", &force, "c1")
            .figure_with_legend("Longitudinal force F_x: power above 0, brakes below"),
        station_plot(page, "delta [deg]", &delta, "c3")
            .figure_with_legend("Steering angle delta of the front wheels: left above 0"),
        deviation_plot(page).figure_with_legend("Lateral deviation from the line of the track: left above 0"),
    ]);
    figures.extend(attitude_figure(page));
    figures
}

/// How a body that swings rolls and pitches.
fn attitude_figure(page: &LapPage) -> Option<Markup> {
    let attitudes: Option<Vec<_>> =
        page.optimum.nodes.iter().map(|node| node.variables.body.map(|body| body.attitude)).collect();
    let attitudes = attitudes?;
    let phi = page.values_over_station(|k| attitudes[k].phi.to_degrees());
    let theta = page.values_over_station(|k| attitudes[k].theta.to_degrees());
    let mut plot = empty_station_plot(page, "angle [deg]", phi.iter().chain(&theta).map(|point| point.1));
    plot.add_line(&[(plot.x.low(), 0.0), (plot.x.high(), 0.0)], "data hair", "");
    plot.add_line(&phi, "c0", "roll phi: above 0 in a left turn");
    plot.add_line(&theta, "c1", "pitch theta: above 0 while braking");
    Some(plot.figure_with_legend("Roll and pitch of the body"))
}

/// How far the log is behind the fastest lap.
fn time_gap_figure(page: &LapPage) -> Option<Markup> {
    page.driven?;
    let curve = page.driven_values_over_station(|node, best| node.t - best);
    Some(
        station_plot(page, "behind [s]", &curve, LOG_CLASS)
            .figure_with_legend("Time behind the fastest lap: it rises where the log loses time"),
    )
}

/// The speed, with that of the log.
fn speed_plot(page: &LapPage, speed: &[(f64, f64)]) -> Plot {
    let driven = page.driven_values_over_station(|node, _| 3.6 * node.speed);
    let mut plot = empty_station_plot(page, "speed [km/h]", speed.iter().chain(&driven).map(|point| point.1));
    plot.add_line(speed, "c0", if page.driven.is_some() { "fastest lap" } else { "" });
    if page.driven.is_some() {
        plot.add_line(&driven, LOG_CLASS, "log");
    }
    plot
}

/// A plot over the station with marks at the corners.
fn empty_station_plot(page: &LapPage, label: &str, values: impl IntoIterator<Item = f64>) -> Plot {
    let y = PlotAxis::around_values(label, values);
    let high = y.high() + NUMBERS * (y.high() - y.low());
    let station = PlotAxis::linear("station [m]", 0.0, page.line.length());
    let mut plot = Plot::new(SIZE, station, PlotAxis::linear(label, y.low(), high));
    for (number, corner) in (1..).zip(page.corners) {
        let s = page.optimum.nodes[corner.apex].s;
        plot.add_dashed_line(&[(s, y.low()), (s, y.high())], "data", "");
        plot.add_label((s, high), &number.to_string());
    }
    plot
}

fn station_plot(page: &LapPage, label: &str, curve: &[(f64, f64)], class: &'static str) -> Plot {
    let mut plot = empty_station_plot(page, label, curve.iter().map(|point| point.1));
    if plot.y.low() < 0.0 {
        plot.add_line(&[(plot.x.low(), 0.0), (plot.x.high(), 0.0)], "data hair", "");
    }
    plot.add_line(curve, class, "");
    plot
}

/// The lateral deviation within its bounds, and where it lies in the draws.
fn deviation_plot(page: &LapPage) -> Plot {
    let nodes = &page.optimum.nodes;
    let room = page.values_over_station(|k| nodes[k].deviation_bounds);
    let curve = page.values_over_station(|k| nodes[k].variables.n);
    let driven = page.driven_values_over_station(|node, _| node.n);
    let lines = curve.iter().chain(&driven).map(|point| point.1);
    let values = room.iter().flat_map(|point| point.1).chain(lines);
    let mut plot = empty_station_plot(page, "deviation [m]", values);
    plot.add_band(&room, "data", "room for the centre of gravity");
    plot.add_line(&[(plot.x.low(), 0.0), (plot.x.high(), 0.0)], "data hair", "line of the track");
    if let Some(interval) = page.solved_interval().filter(|it| it.deviations.len() == nodes.len()) {
        let band = page.values_over_station(|k| interval.deviations[k]);
        plot.add_band(&band, "c1", "95 % of the draws");
    }
    plot.add_line(&curve, "c0", if page.driven.is_some() { "fastest lap" } else { "this lap" });
    if page.driven.is_some() {
        plot.add_line(&driven, LOG_CLASS, "log");
    }
    plot
}

/// Acceleration along the car over the one to its left, in g.
pub(crate) fn gg_figure(page: &LapPage) -> Markup {
    let nodes = &page.optimum.nodes;
    let points: Vec<_> = nodes
        .iter()
        .map(|node| (node.variables.a_y / STANDARD_GRAVITY, node.a_x / STANDARD_GRAVITY))
        .collect();
    let mut plot = GG_SIZE.plot_around(["a_y [g], positive to the left", "a_x [g]"], &points).plot;
    plot.add_line(&[(plot.x.low(), 0.0), (plot.x.high(), 0.0)], "data hair", "");
    plot.add_line(&[(0.0, plot.y.low()), (0.0, plot.y.high())], "data hair", "");
    add_phase_dots(&mut plot, &points, &DrivingPhase::of_nodes(nodes));
    plot.figure_with_legend("a_x over a_y")
}

/// How many draws have which lap time.
pub(crate) fn lap_time_figure(interval: &LapTimeInterval, lap_time: f64) -> Markup {
    let times = &interval.lap_times;
    let (low, high) = (interval.quantile(0.0), interval.quantile(1.0));
    let space = (0.5 * (LEAST_SPREAD - (high - low))).max(0.0);
    let (low, high) = (low - space, high + space);
    let bars = (times.len() as f64).sqrt().ceil().clamp(BARS[0], BARS[1]);
    let width = (high - low) / bars;
    let mut counts = vec![0.0; bars as usize];
    for time in times {
        let bar = ((time - low) / width) as usize;
        counts[bar.min(bars as usize - 1)] += 1.0;
    }
    let most = counts.iter().copied().fold(0.0, f64::max);
    let ends = [low, high, lap_time];
    let y = PlotAxis::linear("draws", 0.0, 1.1 * most);
    let mut plot = Plot::new(HISTOGRAM_SIZE, PlotAxis::around_values("lap time [s]", ends), y);
    let mut outline = vec![(low, 0.0)];
    for (bar, count) in counts.iter().enumerate() {
        let [begin, end] = [bar, bar + 1].map(|edge| low + width * edge as f64);
        plot.add_band(
            &[(begin, [0.0, *count]), (end, [0.0, *count])],
            "c0",
            if bar == 0 { "draws" } else { "" },
        );
        outline.extend([(begin, *count), (end, *count), (end, 0.0)]);
    }
    plot.add_line(&outline, "c0 hair", "");
    for (share, name) in [(0.025, "95 % interval"), (0.975, "")] {
        plot.add_vertical_line(interval.quantile(share), "c1", name);
    }
    plot.add_vertical_line(lap_time, "truth", "this lap");
    plot.figure_with_legend("Lap times of the draws")
}
