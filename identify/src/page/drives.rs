//! Draws how drives under closed-loop control are explained: innovations, accelerations, the search for noises, validation.

use drive_inference::calibration::SensorErrorAssessment;
use drive_inference::replay::OpenLoopReplay;
use drive_inference::smoothing::SmoothingReport;
use drive_inference::{Drive, DriveIdentification};
use html_page::{CssClass, Markup, Plot, PlotAxis};
use numerics::text::format_significant;
use tire_inference::axles::Axle;

use crate::page::misfit::MisfitOverSlip;

/// What was identified from drives.
#[derive(Clone, Debug)]
pub struct DrivesSection<'a> {
    /// What was found.
    pub found: &'a DriveIdentification,
    /// Errors of sensors that were estimated by themselves.
    pub calibration: &'a [SensorErrorAssessment],
    /// The drives.
    pub recordings: &'a [Drive],
    /// Drives that were not used, by name, and how the identified car went along them.
    pub replays: &'a [(&'a str, &'a Drive, &'a OpenLoopReplay)],
}

const WIDE: [f64; 2] = [1080.0, 320.0];
const HALF: [f64; 2] = [530.0, 260.0];
/// Colours of the drives, in their order.
const COLOURS: [CssClass; 5] = ["c0", "c1", "c2", "c3", "c4"];
/// Steps of the time over which a long line is drawn by its lowest and its highest points.
const BINS: usize = 540;
/// Half the time of the close-up [s].
const CLOSE: f64 = 3.0;
/// Measured quantities and their units.
pub const SENSORS: [(&str, &str); 4] = [("v_x", "m/s"), ("v_y", "m/s"), ("r", "rad/s"), ("a_y", "m/s²")];

impl DrivesSection<'_> {
    /// What autocorrelations of white innovations stay below.
    pub fn chance(&self) -> f64 {
        2.0 / (0.5 * self.found.innovations.expected_cost).sqrt()
    }

    /// Mean innovations over the slip of each axle: a curve of the wrong shape leaves some.
    pub fn misfits(&self) -> Vec<Markup> {
        let mut figures = Vec::new();
        for (sensor, (name, _)) in SENSORS.into_iter().enumerate().skip(1) {
            for (axle, side) in [(Axle::Front, "front"), (Axle::Rear, "rear")] {
                let misfit = MisfitOverSlip::from_innovations(&self.found.series, axle, sensor);
                let title = format!("{name} over the slip of the {side} axle");
                figures.extend(misfit.sensor_plot(side, name).map(|it| it.figure_with_legend(&title)));
            }
        }
        figures
    }

    /// Each drive with the report of its smoothing.
    pub fn smoothed(&self) -> impl Iterator<Item = (&Drive, &SmoothingReport)> {
        let reports = self.found.smoothed.iter().map(|smoothed| &smoothed.report);
        self.recordings.iter().zip(reports)
    }

    /// Measured, expected and reconstructed: all of it, and a close-up.
    pub fn acceleration(&self) -> Vec<Markup> {
        let DrivesSection { found, recordings, .. } = *self;
        let measured = drive_lines(recordings, |k| recordings[k].a_y.clone());
        let expected = |k: usize| found.series[k].a_y_expected(&recordings[k]).collect();
        let curves = [
            (drive_lines(recordings, expected), "c0", "expected of the identified car, from all before"),
            (
                drive_lines(recordings, |k| found.smoothed[k].a_y.clone()),
                "c1",
                "reconstructed, with the disturbance of the nominal car as virtual force sensor",
            ),
        ];
        let highest = measured.iter().flatten().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let Some(&(middle, _)) = highest else { return Vec::new() };
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
                    thin_line(&line, rows).into_iter().chain([(f64::NAN, f64::NAN)])
                });
                joined.collect()
            };
            let dots: Vec<_> = cut(&measured);
            let y = PlotAxis::around_values("lateral acceleration [m/s²]", dots.iter().map(|point| point.1));
            let mut plot = Plot::new(WIDE, PlotAxis::linear("time [s]", from, until), y);
            plot.add_dots(&dots, 1.6, "data", "measured");
            for (lines, class, name) in curves.iter().rev() {
                plot.add_line(&cut(lines), class, name);
            }
            plot.figure_with_legend(title)
        };
        let (from, until) = ((middle - CLOSE).max(first), (middle + CLOSE).min(last));
        vec![draw(first, last, "All of it"), draw(from, until, "Close-up of the largest")]
    }

    /// How EM found the noises.
    pub fn likelihoods(&self) -> Option<Markup> {
        let reports = self.found.smoothed.iter().map(|smoothed| &smoothed.report);
        let traces: Vec<&[f64]> =
            reports.filter_map(|report| Some(report.em.as_ref()?.log_likelihood.as_slice())).collect();
        if traces.is_empty() {
            return None;
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
            PlotAxis::linear("estimate", 0.0, longest - 1.0),
            PlotAxis::logarithmic("below the last [nat]", 0.1, 2.0 * most),
        );
        for ((line, class), recording) in all.iter().zip(COLOURS.into_iter().cycle()).zip(self.recordings) {
            plot.add_line(line, class, &format!("from {} s", format_significant(recording.t[0], 4)));
        }
        Some(plot.figure_with_legend("Log-likelihood while EM finds the noises"))
    }

    /// Measured and predicted quantities of drives that were not fitted.
    pub fn validation(&self) -> Vec<Markup> {
        let mut plots = Vec::new();
        for (name, recording, replay) in self.replays {
            let [_, _, r, a_y] = &replay.columns;
            let pairs =
                [("lateral acceleration [m/s²]", &recording.a_y, a_y), ("yaw rate [rad/s]", &recording.r, r)];
            for (label, measured, found) in pairs {
                let line = |values: &[f64]| {
                    let points: Vec<_> = recording.t.iter().copied().zip(values.iter().copied()).collect();
                    thin_line(&points, points.len())
                };
                let y = PlotAxis::around_values(label, measured.iter().chain(found).copied());
                let x = PlotAxis::linear("time [s]", replay.window[0], replay.window[1]);
                let mut plot = Plot::new(HALF, x, y);
                plot.add_dots(&line(measured), 1.6, "data", "measured");
                plot.add_line(&line(found), "c0", "identified car");
                plots.push(plot.figure_with_legend(name));
            }
        }
        plots
    }
}

/// A line for each drive, of a value for each of its rows.
fn drive_lines<'a>(recordings: &'a [Drive], values: impl Fn(usize) -> Vec<f64> + 'a) -> Vec<Vec<(f64, f64)>> {
    let line = |(k, recording): (usize, &Drive)| -> Vec<(f64, f64)> {
        recording.t.iter().copied().zip(values(k)).collect()
    };
    recordings.iter().enumerate().map(line).collect()
}

/// A part of a line of `rows` points, of which each step of the time keeps no more than the lowest and the highest.
fn thin_line(points: &[(f64, f64)], rows: usize) -> Vec<(f64, f64)> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_what_stands_out() {
        let mut points: Vec<(f64, f64)> = (0..20_000).map(|i| (f64::from(i), f64::from(i % 100))).collect();
        points[7777].1 = 500.0;
        let thinned = thin_line(&points, points.len());
        assert!(thinned.len() <= 2 * BINS && thinned.contains(&(7777.0, 500.0)));
        assert!(thinned.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        assert_eq!(thin_line(&points[..50], 50), points[..50]);
    }
}
