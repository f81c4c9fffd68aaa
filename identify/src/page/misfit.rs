//! Draws what the model misses: the mean of the residuals over slip with its 95 % band, over the residuals themselves.

use drive_inference::IdentificationSeries;
use html_page::{Plot, PlotAxis};
use numerics::statistics::{NORMAL_95, mean, std};
use preparation::samples::CurveSamples;
use tire_inference::axles::Axle;
use tire_inference::dependence::correlation_time;
use tire_inference::parameters::{Theta, magic_formula_from_theta};

use crate::page::TireSection;

/// Groups of neighbouring slips, each of as many points.
const GROUPS: usize = 24;
/// A group of fewer points has no mean worth drawing.
const FEWEST: usize = 8;
/// Residuals that are drawn at most.
const DRAWN: usize = 700;
const WIDE: [f64; 2] = [1080.0, 260.0];
const HALF: [f64; 2] = [530.0, 240.0];

/// Residuals in the order of their measurement.
pub struct MisfitOverSlip {
    /// Slip and residual.
    points: Vec<(f64, f64)>,
    /// What of their number they are worth.
    share: f64,
}

impl MisfitOverSlip {
    fn new(points: Vec<(f64, f64)>) -> Self {
        let values: Vec<f64> = points.iter().map(|point| point.1).collect();
        let share = correlation_time(&values).recip();
        Self { points, share }
    }

    /// Of a curve with these parameters.
    pub fn from_samples(samples: &CurveSamples, theta: &Theta) -> Self {
        let tire = magic_formula_from_theta(theta);
        let residual = |(slip, force): (&f64, &f64)| (*slip, force - tire.friction_coefficient(*slip));
        Self::new(samples.slip.iter().zip(&samples.force).map(residual).collect())
    }

    /// Of innovations, those of a sensor over the slip of an axle.
    pub fn from_innovations(series: &[IdentificationSeries], axle: Axle, sensor: usize) -> Self {
        let rows = |series: &'_ IdentificationSeries| -> Vec<(f64, f64)> {
            let slips = series.slip[axle].iter().copied();
            // The first row starts the filter.
            slips.zip(series.whitened[sensor].iter().copied()).skip(1).collect()
        };
        Self::new(series.iter().flat_map(rows).collect())
    }

    /// Mean slip of each group, its mean residual, and half the 95 % interval of that.
    fn group_means(&self) -> Vec<(f64, f64, f64)> {
        let mut points = self.points.clone();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let size = points.len().div_ceil(GROUPS).max(FEWEST);
        let group = |group: &[(f64, f64)]| {
            let [slips, values]: [Vec<f64>; 2] =
                [group.iter().map(|p| p.0).collect(), group.iter().map(|p| p.1).collect()];
            let worth = (self.share * group.len() as f64).max(1.0);
            (mean(&slips), mean(&values), NORMAL_95 * std(&values) / worth.sqrt())
        };
        points.chunks(size).filter(|chunk| chunk.len() >= FEWEST).map(group).collect()
    }

    fn misfit_plot(&self, size: [f64; 2], labels: [&str; 2]) -> Option<Plot> {
        let groups = self.group_means();
        if groups.len() < 2 {
            return None;
        }
        let every = self.points.len().div_ceil(DRAWN).max(1);
        let dots: Vec<_> = self.points.iter().copied().step_by(every).collect();
        // The means are what matters; some residuals lie beyond the picture.
        let far = groups.iter().flat_map(|(_, value, half)| [value - half, value + half]);
        let width = 2.5 * std(&self.points.iter().map(|point| point.1).collect::<Vec<_>>());
        let x = PlotAxis::around_values(labels[0], self.points.iter().map(|point| point.0));
        let mut plot = Plot::new(size, x, PlotAxis::around_values(labels[1], far.chain([-width, width])));
        plot.add_dots(&dots, 1.6, "data", "residuals");
        plot.add_horizontal_line(0.0, "truth", "");
        let band: Vec<_> =
            groups.iter().map(|(slip, value, half)| (*slip, [value - half, value + half])).collect();
        let line: Vec<_> = groups.iter().map(|(slip, value, _)| (*slip, *value)).collect();
        plot.add_band(&band, "c1", "95 % of their mean");
        plot.add_line(&line, "c1", "mean");
        Some(plot)
    }

    /// Beneath a curve.
    pub fn plot_beneath_curve(&self, section: &TireSection) -> Option<Plot> {
        let force = format!("data − curve of {}", section.direction.force_label());
        self.misfit_plot(WIDE, [section.direction.slip_label(), &force])
    }

    /// Of the innovations of a sensor.
    pub fn sensor_plot(&self, axle: &str, sensor: &str) -> Option<Plot> {
        let labels =
            [format!("slip angle of the {axle} axle [rad]"), format!("innovation of {sensor} [std]")];
        self.misfit_plot(HALF, [&labels[0], &labels[1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residuals of ±1 in turn, with a bump of 2 at slips from 0.4 to 0.5.
    fn bumpy() -> Vec<(f64, f64)> {
        (0..2400)
            .map(|i| {
                let slip = f64::from(i * 7 % 2400) / 2400.0;
                let bump = if (0.4..0.5).contains(&slip) { 2.0 } else { 0.0 };
                (slip, bump + if i % 2 == 0 { 1.0 } else { -1.0 })
            })
            .collect()
    }

    #[test]
    fn a_missed_shape_leaves_the_band_and_noise_does_not() {
        let groups = MisfitOverSlip::new(bumpy()).group_means();
        assert_eq!(groups.len(), GROUPS);
        for (slip, value, half) in groups {
            let inside = (0.42..0.48).contains(&slip);
            let outside = !(0.37..0.53).contains(&slip);
            assert!(!inside || value - half > 1.0, "{slip} {value} ± {half}");
            assert!(!outside || value.abs() < half, "{slip} {value} ± {half}");
        }
    }

    #[test]
    fn correlated_residuals_tell_less() {
        let independent = MisfitOverSlip::new(bumpy().into_iter().map(|(slip, _)| (slip, 0.0)).collect());
        assert_eq!(independent.share, 1.0);
        let slow: Vec<_> = (0..2000).map(|i| (0.0, (f64::from(i) / 50.0).sin())).collect();
        // Cosines add up to 50 rows on either side before they turn negative.
        let share = MisfitOverSlip::new(slow).share;
        assert!((share - 1.0 / 101.0).abs() < 2e-4, "{share}");
        assert!(MisfitOverSlip::new(Vec::new()).group_means().is_empty());
        assert!(MisfitOverSlip::new(vec![(0.0, 1.0); 5]).misfit_plot(HALF, ["", ""]).is_none());
    }
}
