//! Draws a smooth line through noisy positions: a smoothing spline, as the Kalman smoother of a curvature that walks randomly along the path.

use kalman::{FilteredRecording, Gaussian, LinearStep, NoiseParameters, filter_forward, smooth_recording};
use nalgebra::{Matrix1, Matrix1x3, Matrix3, Vector1, Vector3};
use numerics::golden_section::argmax;

/// A position and its distance along the path, both measured [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Distance along the path [m].
    pub distance: f64,
    /// Position [m].
    pub position: [f64; 2],
}

/// A line at equal distances.
pub struct SmoothLine {
    /// Positions [m].
    pub positions: Vec<[f64; 2]>,
    /// Standard deviation of the measured positions about the line [m].
    pub noise: f64,
}

/// Range of the decimal logarithm of q / r, the intensity of the change of curvature over the variance of a position [1/m^5]: from a line
/// that is straight over 200 m to one that follows each position.
const LOG_RATIOS: [f64; 2] = [-14.0, 6.0];
/// Halvings of that range, to 2e-5.
const BISECTIONS: usize = 20;

/// Both coordinates at the middles of the steps.
struct SampledLine {
    step: f64,
    axes: [Vec<LinearStep<3, 1>>; 2],
}

/// Draws the line through points with rising distances, at the distances `begin + (i + ½) step` for i below `count`.
///
/// Of each coordinate the third derivative along the path is white noise of intensity q, and positions are measured with variance r. The
/// smoother of this process is the quintic smoothing spline (Wahba 1978). The likelihood of both coordinates chooses q / r; but
/// receivers have errors that go on from one position to the next, which a likelihood takes for bends of the road. So the line is at
/// least as smooth as leaves the positions `least_noise` [m] beside it. Points within one step count as one, at their mean. None
/// where the filter loses its covariance.
pub fn smooth_line(
    points: &[PathPoint],
    begin: f64,
    step: f64,
    count: usize,
    least_noise: f64,
) -> Option<SmoothLine> {
    let line = SampledLine { step, axes: [0, 1].map(|axis| sample_points(points, begin, step, count, axis)) };
    let [low, high] = LOG_RATIOS;
    let likelihood = |above: f64| {
        line.filter(low + above).map_or(f64::NEG_INFINITY, |filtered| profile_likelihood(&filtered))
    };
    let likeliest = low + argmax(likelihood, high - low);
    let smooth = line.smooth(likeliest)?;
    if smooth.noise >= least_noise {
        return Some(smooth);
    }
    let (mut smoother, mut rougher) = (low, likeliest);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (smoother + rougher);
        if line.smooth(middle)?.noise > least_noise {
            smoother = middle;
        } else {
            rougher = middle;
        }
    }
    line.smooth(rougher)
}

impl SampledLine {
    fn filter(&self, log_ratio: f64) -> Option<[FilteredRecording<3>; 2]> {
        let ratio = 10_f64.powf(log_ratio);
        let filter = |axis: &[LinearStep<3, 1>]| filter_forward(axis, &noise(ratio, self.step, axis)).ok();
        let [x, y] = &self.axes;
        Some([filter(x)?, filter(y)?])
    }

    fn smooth(&self, log_ratio: f64) -> Option<SmoothLine> {
        let [x, y] = self.filter(log_ratio)?;
        let x = smooth_recording(&self.axes[0], &x).ok()?.states;
        let y = smooth_recording(&self.axes[1], &y).ok()?.states;
        let variance = 0.5 * (residual_variance(&self.axes[0], &x) + residual_variance(&self.axes[1], &y));
        let positions = x.iter().zip(&y).map(|(x, y)| [x.mean[0], y.mean[0]]).collect();
        Some(SmoothLine { positions, noise: variance.sqrt() })
    }
}

/// Mean square of what a coordinate was measured beside the line [m^2].
fn residual_variance(steps: &[LinearStep<3, 1>], states: &[Gaussian<3>]) -> f64 {
    let residuals = steps.iter().zip(states).map(|(step, state)| (step.y - step.H * state.mean)[0]);
    let squares: Vec<f64> = residuals.filter(|it| it.is_finite()).map(|it| it * it).collect();
    squares.iter().sum::<f64>() / f64::max(squares.len() as f64, 1.0)
}

/// One coordinate at the middles of the steps. Where a step has no point, it measures nothing.
fn sample_points(
    points: &[PathPoint],
    begin: f64,
    step: f64,
    count: usize,
    axis: usize,
) -> Vec<LinearStep<3, 1>> {
    #[rustfmt::skip]
    let transition = Matrix3::new(
        1.0, step, 0.5 * step * step,
        0.0, 1.0, step,
        0.0, 0.0, 1.0,
    );
    let mut sums = vec![[0.0; 3]; count];
    for point in points {
        let cell = ((point.distance - begin) / step).floor();
        if cell >= 0.0 && cell < count as f64 {
            let [number, offset, value] = &mut sums[cell as usize];
            *number += 1.0;
            *offset += point.distance - (begin + (cell + 0.5) * step);
            *value += point.position[axis];
        }
    }
    let step_at = |[number, offset, value]: [f64; 3]| {
        let (d, y) = if number > 0.0 { (offset / number, value / number) } else { (0.0, f64::NAN) };
        LinearStep {
            y: Vector1::new(y),
            H: Matrix1x3::new(1.0, d, 0.5 * d * d),
            F: transition,
            b: Vector3::zeros(),
        }
    };
    sums.into_iter().map(step_at).collect()
}

/// The noises in units of the variance of a position. The state before the first position is that of the first two positions, with
/// a variance by which it hardly counts.
fn noise(ratio: f64, step: f64, steps: &[LinearStep<3, 1>]) -> NoiseParameters<3, 1> {
    let measured =
        |(i, step): (usize, &LinearStep<3, 1>)| step.y[0].is_finite().then_some((i as f64, step.y[0]));
    let mut measured = steps.iter().enumerate().filter_map(measured);
    let first = measured.next().unwrap_or_default();
    let second = measured.next().unwrap_or((first.0 + 1.0, first.1));
    let slope = (second.1 - first.1) / (step * (second.0 - first.0));
    let h = step;
    #[rustfmt::skip]
    let walk = Matrix3::new(
        h.powi(5) / 20.0, h.powi(4) / 8.0, h.powi(3) / 6.0,
        h.powi(4) / 8.0, h.powi(3) / 3.0, h.powi(2) / 2.0,
        h.powi(3) / 6.0, h.powi(2) / 2.0, h,
    );
    NoiseParameters {
        start: Gaussian {
            mean: Vector3::new(first.1 - slope * step * first.0, slope, 0.0),
            cov: Matrix3::from_diagonal_element(1e4),
        },
        Q: walk * ratio,
        R: Matrix1::new(1.0),
    }
}

/// Logarithm of the likelihood of both coordinates at the best variance of a position, less a constant.
fn profile_likelihood(filtered: &[FilteredRecording<3>; 2]) -> f64 {
    let (mut number, mut squares, mut log_likelihood) = (0.0, 0.0, 0.0);
    for fit in filtered.iter().flat_map(|axis| &axis.fit) {
        number += fit.observed as f64;
        squares += fit.nis;
        log_likelihood += fit.log_likelihood;
    }
    // The filter has taken a variance of 1, with which its likelihood has half the sum of the squares.
    let variance = f64::max(squares / f64::max(number, 1.0), f64::MIN_POSITIVE);
    log_likelihood + 0.5 * squares - 0.5 * number * variance.ln()
}
