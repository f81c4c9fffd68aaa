//! Fills the template of the page: headline, facts, tables and figures.

use askama::Template;
use html_page::{Markup, filters};
use lap::{Corner, InteriorPointStatus, LapNode, LapOptimum, ParameterRange, ParameterWorth};
use numerics::convergence::OptimisationStatus;
use numerics::text::{format_lap_time, format_significant};
use track::TrackLine;
use units::STANDARD_GRAVITY;
use units::display::unit_text;

use crate::curves::{gg_figure, lap_time_figure, station_figures};
use crate::map::track_map;
use crate::texts::{format_small_difference, format_time_difference, format_time_interval};
use crate::{FastestSetup, LapPage, LoggedLap};

/// Rows of parameters that are seen at once.
const FIRST_ROWS: usize = 15;
/// Longest bar of a parameter [px].
const BAR: f64 = 90.0;

#[derive(Template)]
#[template(path = "lap.html")]
struct LapTemplate<'a> {
    title: String,
    page: &'a LapPage<'a>,
    status: &'static str,
    has_converged: bool,
    /// Fastest and slowest speed [km/h].
    speeds: [f64; 2],
    interval: Option<[String; 2]>,
    map: Markup,
    curves: Vec<Markup>,
    gg: Markup,
    corners: Vec<CornerRow>,
    worth: Vec<WorthRow>,
    setup: Vec<SetupRow>,
    histogram: Option<Markup>,
}

/// A corner in its table.
struct CornerRow {
    number: usize,
    /// Stations of its begin, its apex and its end [m].
    stations: [f64; 3],
    /// Slowest speed [km/h].
    speed: f64,
    /// Time in it [s].
    time: f64,
    /// Largest lateral acceleration [g].
    a_y: f64,
    /// The corner in the log.
    driven: Option<DrivenCornerRow>,
}

/// What a log does in a corner.
struct DrivenCornerRow {
    /// Slowest speed [km/h].
    speed: f64,
    /// Time that is lost to the fastest lap, with its sign.
    lost: String,
}

/// A parameter of the fastest set-up: its value in the car, in the set-up, and its range, with the unit.
struct SetupRow {
    name: &'static str,
    before: String,
    now: String,
    range: String,
    is_at_bound: bool,
}

/// A parameter in its table.
struct WorthRow {
    name: &'static str,
    value: String,
    seconds: String,
    by_corner: Vec<String>,
    /// Length [px] of its bar, and the class of its colour.
    bar: f64,
    bar_class: &'static str,
}

/// The page of a lap.
pub fn lap_page(page: &LapPage) -> String {
    let optimum = page.optimum;
    let has_converged = optimum.status == InteriorPointStatus::Converged;
    let interval =
        page.solved_interval().map(|it| format_time_interval([0.025, 0.975].map(|share| it.quantile(share))));
    html_page::render_page(&LapTemplate {
        title: headline(optimum, interval.as_ref()),
        page,
        status: status_text(optimum.status),
        has_converged,
        speeds: extreme_speeds(&optimum.nodes),
        interval,
        map: track_map(page).figure_with_legend("Driven line"),
        curves: station_figures(page),
        gg: gg_figure(page),
        corners: (1..).zip(page.corners).map(|(number, corner)| corner_row(page, number, corner)).collect(),
        worth: worth_rows(page.worth),
        setup: page.setup.map_or_else(Vec::new, setup_rows),
        histogram: page.solved_interval().map(|it| lap_time_figure(it, optimum.lap_time)),
    })
}

/// The lap time, with its interval.
fn headline(optimum: &LapOptimum, interval: Option<&[String; 2]>) -> String {
    let time = format_lap_time(optimum.lap_time, 3);
    let ends = interval.map_or(String::new(), |[from, to]| format!(" [{from}, {to}]"));
    match optimum.status {
        InteriorPointStatus::Converged => format!("Fastest lap {time}{ends}"),
        _ => format!("Lap {time}{ends}, not the fastest"),
    }
}

fn status_text(status: InteriorPointStatus) -> &'static str {
    match status {
        InteriorPointStatus::Converged => "converged",
        InteriorPointStatus::IterationLimit => "ended at the largest number of steps",
        InteriorPointStatus::Stalled => "ended where no step made the lap better",
    }
}

fn extreme_speeds(nodes: &[LapNode]) -> [f64; 2] {
    let speeds = nodes.iter().map(|node| 3.6 * node.variables.v_x);
    let [low, high] = speeds.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
    [high, low]
}

fn corner_row(page: &LapPage, number: usize, corner: &Corner) -> CornerRow {
    let nodes = &page.optimum.nodes;
    let of_corner = || corner.nodes(nodes.len()).map(|k| &nodes[k]);
    CornerRow {
        number,
        stations: [nodes[corner.first].s, nodes[corner.apex].s, end_station(page.line, nodes, corner)],
        speed: 3.6 * of_corner().map(|node| node.variables.v_x).fold(f64::INFINITY, f64::min),
        time: corner.duration(nodes.len(), |k| nodes[k].t, page.optimum.lap_time),
        a_y: of_corner().map(|node| node.variables.a_y.abs()).fold(0.0, f64::max) / STANDARD_GRAVITY,
        driven: page.driven.map(|LoggedLap { lap, .. }| DrivenCornerRow {
            speed: 3.6 * lap.slowest_speed(corner),
            lost: format_time_difference(lap.time_lost(page.optimum, corner)),
        }),
    }
}

fn end_station(line: &TrackLine, nodes: &[LapNode], corner: &Corner) -> f64 {
    nodes.get(corner.end).map_or(line.length(), |node| node.s)
}

fn worth_rows(worth: &[ParameterWorth]) -> Vec<WorthRow> {
    let sizes = worth.iter().map(|it| it.seconds_per_percent.abs());
    let largest = sizes.filter(|size| size.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
    let row = |it: &ParameterWorth| {
        let share = it.seconds_per_percent.abs() / largest;
        let unit = unit_text(it.unit);
        WorthRow {
            name: it.name,
            value: format!("{} {unit}", format_significant(it.value, 4)).trim_end().to_owned(),
            seconds: format_time_difference(it.seconds_per_percent),
            by_corner: it.by_corner.iter().map(|seconds| format_small_difference(*seconds)).collect(),
            bar: if share.is_finite() { BAR * share } else { 0.0 },
            bar_class: if it.seconds_per_percent < 0.0 { "best-value" } else { "fail" },
        }
    };
    worth.iter().map(row).collect()
}

fn setup_rows(setup: &FastestSetup) -> Vec<SetupRow> {
    let row = |(k, range): (usize, &ParameterRange)| {
        let unit = unit_text(range.key.unit);
        let text = |value: f64| format!("{} {unit}", format_significant(value, 4)).trim_end().to_owned();
        let now = setup.setup.values[k];
        SetupRow {
            name: range.key.name,
            before: text(setup.before[k]),
            now: text(now),
            range: format!("{} – {}", format_significant(range.low, 4), text(range.high)),
            is_at_bound: now == range.low || now == range.high,
        }
    };
    setup.ranges.iter().enumerate().map(row).collect()
}

impl LapTemplate<'_> {
    /// How much faster the fastest set-up is.
    fn setup_sentence(&self) -> Option<String> {
        let setup = self.page.setup?;
        let time = format_lap_time(setup.setup.lap.lap_time, 3);
        let gain = setup.gain_text(self.page);
        let doubt = match setup.setup.status {
            OptimisationStatus::Converged => "",
            _ => " The search for it did not converge: there may be a faster one.",
        };
        Some(format!("Of all set-ups within the ranges the fastest one laps in {time}, {gain}.{doubt}"))
    }

    /// Rows that are seen at once, and the rest.
    fn worth_parts(&self) -> [&[WorthRow]; 2] {
        let (first, rest) = self.worth.split_at(self.worth.len().min(FIRST_ROWS));
        [first, rest]
    }

    /// How the lap of the log and the fastest one differ.
    fn driven_sentence(&self) -> Option<String> {
        let LoggedLap { log, lap } = self.page.driven?;
        let difference = lap.lap_time - self.page.optimum.lap_time;
        let size = format_significant(difference.abs(), 3);
        let verdict = match difference >= 0.0 {
            true => format!("{size} s more than the fastest lap"),
            false => {
                format!("{size} s less than the fastest lap: the car that drove can do more than this one")
            }
        };
        let time = format_lap_time(lap.lap_time, 3);
        let which =
            if lap.count == 1 { "The lap".to_owned() } else { format!("The fastest of {} laps", lap.count) };
        Some(format!("{which} in {log} takes {time}, {verdict}."))
    }

    fn draws(&self) -> usize {
        self.page.interval.map_or(0, |it| it.lap_times.len() + it.unsolved)
    }
}
