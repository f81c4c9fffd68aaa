//! Holds the page of a small lap to what it promises.

use std::fmt::Write;

use lap::{CarParameters, InteriorPointStatus, LapOptions, LapTimeInterval};
use numerics::text::format_lap_time;

use super::*;

/// A lap of a small oval, with what its page needs.
struct OvalLap {
    line: TrackLine,
    optimum: LapOptimum,
    corners: Vec<Corner>,
    worth: Vec<ParameterWorth>,
}

fn car_parameters() -> CarParameters {
    CarParameters::from_numbers(&[
        ("body.m", 1250.0),
        ("body.I_zz", 1850.0),
        ("body.l_f", 1.18),
        ("body.l_r", 1.27),
        ("body.h", 0.47),
        ("drive.power_max", 190e3),
        ("limit.F_x_max", 9e3),
        ("limit.F_x_min", -15e3),
    ])
    .expect("in their ranges")
}

/// Two straights of 120 m and two half circles of 25 m.
fn oval_table() -> String {
    const STRAIGHT: f64 = 120.0;
    const RADIUS: f64 = 25.0;
    let mut table = "x_m,y_m\n".to_owned();
    for side in [1.0, -1.0] {
        for i in 0..12 {
            let _ = writeln!(
                table,
                "{},{}",
                side * (f64::from(i) * STRAIGHT / 12.0 - 0.5 * STRAIGHT),
                -side * RADIUS
            );
        }
        for i in 0..8 {
            let (sin, cos) = (f64::from(i) * std::f64::consts::PI / 8.0).sin_cos();
            let _ = writeln!(table, "{},{}", side * (0.5 * STRAIGHT + RADIUS * sin), -side * RADIUS * cos);
        }
    }
    table
}

impl OvalLap {
    fn find() -> Self {
        let line = TrackLine::from_table_text(&oval_table()).expect("a line");
        let options = LapOptions { nodes: Some(60), half_width: Some(5.0), ..LapOptions::default() };
        let parameters = car_parameters();
        let (car, _) = parameters.car().expect("a car");
        let optimum = LapOptimum::find(&car, &line, &options).expect("a lap");
        let corners = optimum.corners(line.is_closed());
        let worth = optimum.parameter_worth(&parameters, &line, &options, &corners).expect("the worth");
        OvalLap { line, optimum, corners, worth }
    }

    fn page(&self) -> LapPage<'_> {
        LapPage {
            car: "small <car>.toml",
            track: "oval.csv",
            line: &self.line,
            optimum: &self.optimum,
            corners: &self.corners,
            worth: &self.worth,
            interval: None,
            setup: None,
            driven: None,
            messages: &[],
        }
    }
}

/// The page without its style.
fn page_body(page: &LapPage) -> String {
    let whole = lap_page(page);
    let body = whole.split_once("<body>").expect("a body").1;
    assert!(!body.contains("NaN") && !body.contains("inf"), "{body}");
    body.to_owned()
}

#[test]
fn the_page_holds_the_lap_and_all_its_sections() {
    let lap = OvalLap::find();
    assert_eq!(lap.optimum.status, InteriorPointStatus::Converged);
    assert_eq!(lap.corners.len(), 2);
    let body = page_body(&lap.page());
    let title = format!("<h1>Fastest lap {}</h1>", format_lap_time(lap.optimum.lap_time, 3));
    assert!(body.contains(&title), "{body}");
    for section in ["Track map", "Along the lap", "g-g diagram", "Corners", "What one percent is worth"] {
        assert!(body.contains(&format!("<h2>{section}</h2>")), "{section}");
    }
    assert!(body.contains("small &lt;car&gt;.toml") && body.contains("oval.csv"));
    assert!(body.contains("body.m") && body.contains("1250 kg") && body.contains("<details>"));
    assert!(
        !body.contains("banner") && !body.contains("Spread of the lap time") && !body.contains("Notes on")
    );
    // Corners that follow each other on a closed line take the whole lap.
    let column =
        |row: &str| row.split("</td>").nth(4).and_then(|cell| cell.split('>').nth(1)?.parse::<f64>().ok());
    let table = body
        .split("<table class=\"figures corners\">")
        .nth(1)
        .expect("a table")
        .split("</table>")
        .next()
        .expect("its end");
    let times: Vec<f64> = table.split("<tr>").skip(2).filter_map(column).collect();
    assert_eq!(times.len(), 2);
    assert!((times.iter().sum::<f64>() - lap.optimum.lap_time).abs() < 2e-3, "{times:?}");
}

#[test]
fn the_page_shows_the_interval_and_the_messages() {
    let lap = OvalLap::find();
    let time = lap.optimum.lap_time;
    let lap_times: Vec<f64> = (0..40).map(|i| time + 0.01 * f64::from(i - 20)).collect();
    let deviations =
        lap.optimum.nodes.iter().map(|node| [node.variables.n - 0.2, node.variables.n + 0.2]).collect();
    let mut interval = LapTimeInterval {
        by_draw: lap_times.iter().copied().map(Some).collect(),
        lap_times,
        deviations,
        unsolved: 2,
        first_failure: Some("the search did not converge".to_owned()),
    };
    let messages = ["tire_f.tir: LMUX & more".to_owned()];
    let body = page_body(&LapPage { interval: Some(&interval), messages: &messages, ..lap.page() });
    let [from, to] = [0.025, 0.975].map(|share| format_lap_time(interval.quantile(share), 1));
    assert!(body.contains(&format!("{} [{from}, {to}]</h1>", format_lap_time(time, 3))), "{body}");
    assert!(
        body.contains("42 cars were drawn")
            && body.contains(
                "2 of them were not solved and left out, the first because the search did not converge."
            )
    );
    assert!(body.contains("Lap times of the draws") && body.contains("95 % of the draws"));
    assert!(body.contains("<li>tire_f.tir: LMUX &amp; more</li>"));
    // Draws that are all the same, and none at all.
    interval.lap_times = vec![time; 3];
    page_body(&LapPage { interval: Some(&interval), ..lap.page() });
    interval.lap_times.clear();
    let body = page_body(&LapPage { interval: Some(&interval), ..lap.page() });
    assert!(!body.contains("Lap times of the draws"));
}

#[test]
fn a_lap_that_did_not_converge_is_told_first() {
    let mut lap = OvalLap::find();
    lap.optimum.status = InteriorPointStatus::Stalled;
    lap.optimum.nodes[7].variables.v_x = f64::NAN;
    lap.optimum.lap_time = f64::NAN;
    lap.optimum.optimality_error = f64::INFINITY;
    let body = page_body(&lap.page());
    assert!(body.contains("<h1>Lap –, not the fastest</h1>"));
    let banner = body.find("<p class=\"banner fail\"><b>The search did not converge").expect("a banner");
    assert!(banner < body.find("<table").expect("a table"));
}

#[test]
fn a_lap_without_corners_and_worth_has_a_page() {
    let lap = OvalLap::find();
    let body = page_body(&LapPage { corners: &[], worth: &[], ..lap.page() });
    assert!(body.contains("The lap has no corners") && !body.contains("What one percent is worth"));
}
