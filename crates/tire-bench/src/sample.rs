//! Holds what a test bench measured, and refuses signs that no tire has.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::fmt;

use tire::TireAxes;

/// One sample of a bench, in ISO-W axes and SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BenchSample {
    /// The file that it is from, counted from 0.
    pub run: usize,
    /// The sweep within the run.
    pub block: usize,
    /// Time [s].
    pub time: f64,
    /// Slip ratio [-].
    pub kappa: f64,
    /// Slip angle [rad].
    pub alpha: f64,
    /// Camber [rad].
    pub gamma: f64,
    /// Load [N], above 0.
    pub F_z: f64,
    /// Inflation pressure [Pa].
    pub pressure: f64,
    /// Speed of the belt [m/s].
    pub v_x: f64,
    /// Temperature of the tread's surface [K]; NaN where it is not measured.
    pub temperature: f64,
    /// Longitudinal force [N].
    pub F_x: f64,
    /// Lateral force [N].
    pub F_y: f64,
    /// Aligning moment [N m]; NaN where it is not measured.
    pub M_z: f64,
}

/// A slip that moves less within a block is a condition of it, slip ratio [-] and slip angle [rad] alike.
pub(crate) const SWEPT: f64 = 0.05;

/// The largest less the smallest of values.
pub(crate) fn value_range(values: impl Iterator<Item = f64>) -> f64 {
    let [low, high] = values.fold([f64::MAX, f64::MIN], |[low, high], it| [low.min(it), high.max(it)]);
    high - low
}

/// What makes data unusable: where, and what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BenchError {
    /// Name of the file.
    pub file: String,
    /// Line, from 1; none for what is not in one line.
    pub line: Option<usize>,
    /// What was expected, what was found, what to do.
    pub text: String,
}

impl fmt::Display for BenchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = self.line.map_or(String::new(), |line| format!(":{line}"));
        write!(f, "{}{line}: {}", self.file, self.text)
    }
}

impl std::error::Error for BenchError {}

impl BenchSample {
    /// The sample in ISO-W axes, when it was written in other ones. SAE turns α, F_y, M_z and F_z over; adapted SAE leaves α.
    pub(crate) fn converted_from_axes(mut self, axes: TireAxes) -> Self {
        if axes != TireAxes::Iso {
            (self.F_y, self.M_z, self.F_z) = (-self.F_y, -self.M_z, self.F_z.abs());
        }
        if axes == TireAxes::Sae {
            self.alpha = -self.alpha;
        }
        self
    }
}

/// Refuses samples whose signs no tire has: loads below 0, and F_y that goes along with α.
///
/// # Errors
/// Names `file`, the channel, and the choice of axes that would mend it.
pub fn check_sample_signs(samples: &[BenchSample], file: &str) -> Result<(), BenchError> {
    let bad = |text: String| Err(BenchError { file: file.to_owned(), line: None, text });
    let pressed = samples.iter().filter(|it| it.F_z > 0.0).count();
    if 2 * pressed < samples.len() || samples.is_empty() {
        return bad(format!(
            "expected F_z above 0, found that in {pressed} of {} samples: choose the axes of the file, SAE benches write F_z < 0",
            samples.len()
        ));
    }
    let steep = samples.iter().filter(|it| it.alpha.abs() > 0.01 && it.kappa.abs() < 0.02);
    let along: f64 = steep.map(|it| it.alpha * it.F_y).sum();
    if along > 0.0 {
        return bad(
            "expected F_y < 0 where the slip angle is > 0 (ISO-W), found F_y > 0: choose adapted SAE axes"
                .to_owned(),
        );
    }
    let forward: f64 = samples.iter().filter(|it| it.kappa.abs() > 0.02).map(|it| it.kappa * it.F_x).sum();
    if forward < 0.0 {
        return bad(
            "expected F_x > 0 where the slip ratio is > 0, found F_x < 0: check the signs of both".to_owned()
        );
    }
    Ok(())
}
