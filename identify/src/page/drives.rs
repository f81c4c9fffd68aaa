//! Draws how drives under closed-loop control are explained: innovations, accelerations, the search for noises, validation.

use std::fmt::Write;

use drive_inference::calibration::CalibrationAssessment;
use drive_inference::replay::Replay;
use drive_inference::{Drive, Identification};
use html_page::{Axis, Class, Plot, escape};
use numerics::text::significant;
use tire_inference::axles::Axle;

use crate::names::words;
use crate::page::misfit::Misfit;

/// What was identified from drives.
#[derive(Clone, Debug)]
pub struct Drives<'a> {
    /// What was found.
    pub found: &'a Identification,
    /// Errors of sensors that were estimated by themselves.
    pub calibration: &'a [CalibrationAssessment],
    /// The drives.
    pub recordings: &'a [Drive],
    /// Drives that were not used, by name, and how the identified car went along them.
    pub replays: &'a [(&'a str, &'a Drive, &'a Replay)],
}

const WIDE: [f64; 2] = [1080.0, 320.0];
const HALF: [f64; 2] = [530.0, 260.0];
/// Colours of the drives, in their order.
const COLOURS: [Class; 5] = ["c0", "c1", "c2", "c3", "c4"];
/// Steps of the time over which a long line is drawn by its lowest and its highest points.
const BINS: usize = 540;
/// Half the time of the close-up [s].
const CLOSE: f64 = 3.0;
/// Measured quantities and their units.
const SENSORS: [(&str, &str); 4] =
    [("v_x", "m/s"), ("v_y", "m/s"), ("r", "rad/s"), ("a_y", "m/s²")];

/// All of it.
pub fn drives(drives: &Drives) -> String {
    let mut html = String::from("<h2>How the drives are explained</h2>\n");
    innovations(&mut html, drives.found);
    misfit(&mut html, drives.found);
    calibration(&mut html, drives.calibration);
    html.push_str("<h3>Lateral acceleration</h3>\n");
    html.push_str(&acceleration(drives));
    html.push_str("<h3>Smoothing with the nominal car</h3>\n");
    smoothing(&mut html, drives);
    if !drives.replays.is_empty() {
        html.push_str("<h3>Validation: the identified car on its own</h3>\n");
        validation(&mut html, drives.replays);
    }
    html
}

fn innovations(html: &mut String, found: &Identification) {
    let innovations = &found.innovations;
    let chance = significant(2.0 / (0.5 * innovations.expected_cost).sqrt(), 2);
    let _ = writeln!(
        html,
        "<p class=\"faint\">Innovations are what the measurements differ by from their prediction by the identified car. \
         Over their standard deviations they have a mean square of 1 and no autocorrelation beyond ±{chance} if car and \
         noises are right. Half their sum is {} of {} that are expected.</p>\n\
         <table>\n<tr><th>Sensor</th><th>Noise</th><th>Mean square</th><th>Autocorrelation</th></tr>",
        significant(innovations.cost, 5),
        significant(innovations.expected_cost, 5)
    );
    for (i, (name, unit)) in SENSORS.into_iter().enumerate() {
        let _ = writeln!(
            html,
            "<tr><td>{name}</td><td class=\"number\">{} {unit}</td><td class=\"number\">{}</td>\
             <td class=\"number\">{}</td></tr>",
            significant(found.noise.sensor[i], 3),
            significant(innovations.mean_square[i], 4),
            significant(innovations.autocorrelation[i], 2)
        );
    }
    html.push_str("</table>\n");
}

/// Mean innovations over the slip of each axle: a curve of the wrong shape leaves some.
fn misfit(html: &mut String, found: &Identification) {
    html.push_str("<h3>What the model misses (0: nothing)</h3>\n<div class=\"grid two\">\n");
    for (sensor, (name, _)) in SENSORS.into_iter().enumerate().skip(1) {
        for (axle, side) in [(Axle::Front, "front"), (Axle::Rear, "rear")] {
            let plot = Misfit::of_innovations(&found.series, axle, sensor).of_sensor(side, name);
            let title = format!("{name} over the slip of the {side} axle");
            html.push_str(&plot.map_or_else(String::new, |plot| plot.figure(&title)));
        }
    }
    html.push_str("</div>\n");
}

/// Errors of sensors, with what speaks for them.
fn calibration(html: &mut String, judged: &[CalibrationAssessment]) {
    if judged.is_empty() {
        return;
    }
    html.push_str(
        "<h3>Errors of sensors by themselves (nothing is corrected)</h3>\n<table>\n\
         <tr><th>Error</th><th>Value</th><th>95 %</th><th>Halves of the drive</th><th>Verdict</th><th>Why</th></tr>\n",
    );
    for it in judged {
        let (factor, unit) = it.error.cause.describe().display;
        let show = |value: f64| significant(factor * value, 3);
        let [low, high] = it.error.interval;
        let halves = it.halves.map_or_else(
            || "–".to_owned(),
            |[[first, _], [second, _]]| format!("{} and {}", show(first), show(second)),
        );
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td class=\"number\">{} {unit}</td><td class=\"number\">{} … {}</td>\
             <td class=\"number\">{halves}</td><td>{}</td><td>{}</td></tr>",
            it.error.cause.describe().title,
            show(it.error.value),
            show(low),
            show(high),
            words(it.verdict),
            escape(&it.reason)
        );
    }
    html.push_str("</table>\n");
}

/// A line for each drive, of a value for each of its rows.
fn lines<'a>(
    recordings: &'a [Drive],
    values: impl Fn(usize) -> Vec<f64> + 'a,
) -> Vec<Vec<(f64, f64)>> {
    let line = |(k, recording): (usize, &Drive)| -> Vec<(f64, f64)> {
        recording.t.iter().copied().zip(values(k)).collect()
    };
    recordings.iter().enumerate().map(line).collect()
}

fn acceleration(drives: &Drives) -> String {
    let (found, recordings) = (drives.found, drives.recordings);
    let measured = lines(recordings, |k| recordings[k].a_y.clone());
    let expected = |k: usize| found.series[k].a_y_expected(&recordings[k]).collect();
    let curves = [
        (lines(recordings, expected), "c0", "expected of the identified car, from all before"),
        (
            lines(recordings, |k| found.smoothed[k].a_y.clone()),
            "c1",
            "reconstructed, with the disturbance of the nominal car as virtual force sensor",
        ),
    ];
    let highest = measured.iter().flatten().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let Some(&(middle, _)) = highest else { return String::new() };
    let ends = |recording: &Drive| [recording.t[0], recording.t[recording.len() - 1]];
    let first = recordings.first().map_or(0.0, |recording| ends(recording)[0]);
    let last = recordings.last().map_or(0.0, |recording| ends(recording)[1]);
    let draw = |from: f64, until: f64, title: &str| {
        let inside = |point: &&(f64, f64)| (from..=until).contains(&point.0);
        let rows = measured.iter().flatten().filter(inside).count();
        let cut = |lines: &[Vec<(f64, f64)>]| -> Vec<(f64, f64)> {
            let joined = lines.iter().flat_map(|line| {
                let line: Vec<_> = line.iter().filter(inside).copied().collect();
                // What is no number is not drawn: a gap between drives.
                thin(&line, rows).into_iter().chain([(f64::NAN, f64::NAN)])
            });
            joined.collect()
        };
        let dots: Vec<_> = cut(&measured);
        let y = Axis::about("lateral acceleration [m/s²]", dots.iter().map(|point| point.1));
        let mut plot = Plot::new(WIDE, Axis::linear("time [s]", from, until), y);
        plot.dots(&dots, 1.6, "data", "measured");
        for (lines, class, name) in curves.iter().rev() {
            plot.line(&cut(lines), class, name);
        }
        plot.figure(title)
    };
    let (from, until) = ((middle - CLOSE).max(first), (middle + CLOSE).min(last));
    draw(first, last, "All of it") + &draw(from, until, "Close-up of the largest")
}

/// A part of a line of `rows` points, of which each step of the time keeps no more than the lowest and the highest.
fn thin(points: &[(f64, f64)], rows: usize) -> Vec<(f64, f64)> {
    if rows <= 2 * BINS {
        return points.to_vec();
    }
    let mut thinned = Vec::new();
    for bin in points.chunks(rows.div_ceil(BINS)) {
        let points = || bin.iter().enumerate();
        let low = points().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let high = points().max_by(|a, b| a.1.1.total_cmp(&b.1.1));
        if let (Some((i, low)), Some((j, high))) = (low, high) {
            thinned.extend(if i < j { [*low, *high] } else { [*high, *low] });
        }
    }
    thinned
}

fn smoothing(html: &mut String, drives: &Drives) {
    html.push_str(
        "<table>\n<tr><th>Drive</th><th>Rows</th><th>a_y, root mean square error</th><th>Log-likelihood</th>\
         <th>EM</th></tr>\n",
    );
    for (recording, smoothed) in drives.recordings.iter().zip(&drives.found.smoothed) {
        let report = &smoothed.report;
        let em = match &report.em {
            Some(em) => {
                let end = if em.converged { "converged" } else { "stopped" };
                let falls = match em.violations.len() {
                    0 => String::new(),
                    count => format!("; the likelihood fell in {count} of its steps"),
                };
                format!("{end} after {} passes{falls}", em.passes)
            }
            None => "none: noises as assumed".to_owned(),
        };
        let _ = writeln!(
            html,
            "<tr><td>{} … {} s</td><td class=\"number\">{}</td><td class=\"number\">{} m/s²</td>\
             <td class=\"number\">{}</td><td>{em}</td></tr>",
            significant(recording.t[0], 4),
            significant(recording.t[recording.len() - 1], 4),
            recording.len(),
            significant(report.a_y_rmse, 3),
            significant(report.log_likelihood, 6)
        );
    }
    html.push_str("</table>\n");
    let reports = drives.found.smoothed.iter().map(|smoothed| &smoothed.report);
    let traces: Vec<&[f64]> =
        reports.filter_map(|report| Some(report.em.as_ref()?.log_likelihood.as_slice())).collect();
    if traces.is_empty() {
        return;
    }
    let lack = |trace: &[f64]| -> Vec<(f64, f64)> {
        let last = trace.last().copied().unwrap_or(f64::NAN);
        trace.iter().enumerate().map(|(i, value)| (i as f64, last - value)).collect()
    };
    let all: Vec<Vec<(f64, f64)>> = traces.into_iter().map(lack).collect();
    let longest = all.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let most = all.iter().flatten().map(|point| point.1).fold(1.0, f64::max);
    let mut plot = Plot::new(
        WIDE,
        Axis::linear("estimate", 0.0, longest - 1.0),
        Axis::logarithmic("below the last [nat]", 0.1, 2.0 * most),
    );
    for ((line, class), recording) in
        all.iter().zip(COLOURS.into_iter().cycle()).zip(drives.recordings)
    {
        plot.line(line, class, &format!("from {} s", significant(recording.t[0], 4)));
    }
    html.push_str(&plot.figure("Log-likelihood while EM finds the noises"));
}

fn validation(html: &mut String, replays: &[(&str, &Drive, &Replay)]) {
    html.push_str(
        "<p class=\"faint\">It starts in the smoothed state and gets the inputs alone. Errors are over the size of what was \
         measured; of them the noise of the sensors explains the part in brackets.</p>\n<table>\n\
         <tr><th>Drive</th><th>Time</th><th>a_y</th><th>r</th><th>v_y</th><th>a_y, over the noise</th>\
         <th>r, over the noise</th></tr>\n",
    );
    let mut figures = String::new();
    for (name, recording, replay) in replays {
        let [from, until] = replay.window.map(|t| significant(t, 4));
        let percent = |value: f64| significant(100.0 * value, 2);
        let of = |value: f64, floor: f64| format!("{} % ({} %)", percent(value), percent(floor));
        let (normalised, floor, in_noise) = (replay.normalised, replay.floor, replay.in_noise);
        let _ = write!(html, "<tr><td>{}</td><td>{from} … {until} s</td>", escape(name));
        for text in [
            of(normalised.a_y, floor.a_y),
            of(normalised.r, floor.r),
            of(normalised.v_y, floor.v_y),
            significant(in_noise.a_y, 3),
            significant(in_noise.r, 3),
        ] {
            let _ = write!(html, "<td class=\"number\">{text}</td>");
        }
        html.push_str("</tr>\n");
        let [_, _, r, a_y] = &replay.columns;
        let pairs = [
            ("lateral acceleration [m/s²]", &recording.a_y, a_y),
            ("yaw rate [rad/s]", &recording.r, r),
        ];
        for (label, measured, found) in pairs {
            let line = |values: &[f64]| {
                let points: Vec<_> =
                    recording.t.iter().copied().zip(values.iter().copied()).collect();
                thin(&points, points.len())
            };
            let y = Axis::about(label, measured.iter().chain(found).copied());
            let x = Axis::linear("time [s]", replay.window[0], replay.window[1]);
            let mut plot = Plot::new(HALF, x, y);
            plot.dots(&line(measured), 1.6, "data", "measured");
            plot.line(&line(found), "c0", "identified car");
            figures.push_str(&plot.figure(name));
        }
    }
    let _ = write!(html, "</table>\n<div class=\"grid two\">\n{figures}</div>\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_what_stands_out() {
        let mut points: Vec<(f64, f64)> =
            (0..20_000).map(|i| (f64::from(i), f64::from(i % 100))).collect();
        points[7777].1 = 500.0;
        let thinned = thin(&points, points.len());
        assert!(thinned.len() <= 2 * BINS && thinned.contains(&(7777.0, 500.0)));
        assert!(thinned.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        assert_eq!(thin(&points[..50], 50), points[..50]);
    }
}
