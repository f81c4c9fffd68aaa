//! Estimates friction and stiffness of both axles step by step, and tells when the surface has changed.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use serde::{Deserialize, Serialize};
use vehicle::VehicleBody;

use crate::curve::TabulatedCurve;
use crate::filter::{AxleObservation, LowPassFilter};
use crate::grid::{AxleGrids, FrictionMoments, SurfaceDrift};
use crate::sample::{SensorNoise, SensorSample};
use crate::sideslip::{ForceExcess, LateralSpeedEstimate};

/// Change of a force over load by ln D, in its standard deviations, from which on a slip says something about friction.
const INFORMATIVE: f64 = 2.0;
/// Longest pause between two samples that the filter bridges, in its time constants.
const BRIDGED: f64 = 5.0;

/// Largest v_y that a sensor of a car can show [m/s].
const MOST_V_Y: f64 = 200.0;
/// Largest square of an excess force, in its variances, that says something about v_y: beyond it the curve is wrong, not the slip.
const FITTING: f64 = 9.0;

/// What does not change during a run.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct ObserverSettings {
    /// The car.
    pub body: VehicleBody,
    /// Standard deviations.
    pub noise: SensorNoise,
    /// Correlation times of the errors of forces and of slip angles [s].
    pub noise_times: [f64; 2],
    /// Time constant of the low-pass [s].
    pub filter_time: f64,
    /// Slowest speed at which slip angles mean something [m/s].
    pub v_x_min: f64,
    /// Standard deviations of ln D and ln K in the beginning.
    pub start_std: [f64; 2],
    /// How the axles change.
    pub drift: SurfaceDrift,
    /// Standard deviation of ln D_f − ln D_r, both over the nominal ones.
    pub difference: f64,
    /// Growth of the variance of v_y [m²/s³].
    pub process_v_y: f64,
    /// Whether v_y is measured.
    pub measured_v_y: bool,
    /// Share of friction from which on a change is one.
    pub change: f64,
    /// Standard deviations by which the change must be beyond that.
    pub deviations: f64,
}

/// What the estimator tells.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct ObserverOutput {
    /// Means of D and K of both axles over the nominal ones, and standard deviations.
    pub axles: [FrictionMoments; 2],
    /// Largest lateral acceleration over the nominal one, and its standard deviation.
    pub factor: [f64; 2],
    /// v_y [m/s] and its standard deviation.
    pub v_y: [f64; 2],
    /// Sideslip angle [rad] and its standard deviation.
    pub beta: [f64; 2],
    /// Whether the slip of each axle says something about friction now.
    pub informative: [bool; 2],
    /// For how long one of them did [s].
    pub informative_time: f64,
    /// Whether the sample was used.
    pub used: bool,
    /// How the surface stands.
    pub alarm: SurfaceAlarm,
}

/// A change of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SurfaceAlarm {
    /// Whether friction is not the nominal one.
    pub raised: bool,
    /// When that was told [s]; −1 before the first time.
    pub time: f64,
    /// When the estimate left the band for that [s]: the change was not known earlier, and is not older than the slip that tells it.
    pub since: f64,
    /// Last time with the estimate inside of the band [s].
    inside: f64,
}

impl Default for SurfaceAlarm {
    fn default() -> Self {
        SurfaceAlarm { raised: false, time: -1.0, since: -1.0, inside: 0.0 }
    }
}

impl SurfaceAlarm {
    /// Judges the friction factor at a time [s].
    fn update_alarm(&mut self, [factor, std]: [f64; 2], settings: &ObserverSettings, time: f64) {
        let beyond = (factor - 1.0).abs() - settings.change;
        if beyond <= 0.0 {
            self.inside = time;
        }
        if !self.raised && beyond > settings.deviations * std {
            *self = SurfaceAlarm { raised: true, time, since: self.inside, ..*self };
        } else if beyond <= 0.0 {
            self.raised = false;
        }
    }
}

/// The estimator.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct FrictionObserver {
    axles: AxleGrids,
    filter: LowPassFilter,
    sideslip: LateralSpeedEstimate,
    /// Time since the last sample [s].
    pause: f64,
    output: ObserverOutput,
}

impl FrictionObserver {
    /// The estimator at a time [s] before the first sample, and what it tells then.
    pub fn new(
        settings: &ObserverSettings,
        curves: &[TabulatedCurve; 2],
        time: f64,
    ) -> (Self, ObserverOutput) {
        let mut observer =
            FrictionObserver { axles: AxleGrids::new(settings.start_std), ..FrictionObserver::default() };
        observer.output.alarm.inside = time;
        observer.output_estimates(settings, curves, time);
        (observer.clone(), observer.output)
    }

    /// A step of `h` [s] that ends at `time` [s] with a sample; without one time passes.
    pub fn step(
        &mut self,
        settings: &ObserverSettings,
        curves: &[TabulatedCurve; 2],
        sample: Option<&SensorSample>,
        [time, h]: [f64; 2],
    ) -> ObserverOutput {
        self.output.informative = [false; 2];
        self.output.used = false;
        self.axles.apply_drift(&settings.drift, h);
        self.pause += h;
        match sample {
            Some(sample) => {
                let h = std::mem::take(&mut self.pause);
                self.process_sample(settings, curves, sample, h);
                self.output_motion(sample);
            }
            None => self.sideslip.predict_without_sample(h),
        }
        self.output_estimates(settings, curves, time);
        self.output
    }

    /// Takes a sample `h` [s] after the one before. A slow car has no slips.
    fn process_sample(
        &mut self,
        settings: &ObserverSettings,
        curves: &[TabulatedCurve; 2],
        sample: &SensorSample,
        h: f64,
    ) {
        let ObserverSettings { body, noise, filter_time, .. } = settings;
        if sample.v_x < settings.v_x_min {
            self.filter.reset();
            self.sideslip.reset_to_rolling(sample, body.l_r);
            self.correct_v_y_by_sensor(settings, sample);
            return;
        }
        if h > BRIDGED * filter_time {
            self.filter.reset();
        }
        self.sideslip.predict(sample, noise, [settings.process_v_y, body.l_r], h);
        self.correct_v_y_by_sensor(settings, sample);
        let measured = self.sideslip.measured;
        let seen = self.filter.filter_sample(sample, &self.sideslip, body, noise, [*filter_time, h]);
        let Some(seen) = seen else { return };
        self.output.used = true;
        for axle in 0..2 {
            let excess = self.learn_from_axle(axle, settings, &curves[axle], &seen[axle], h);
            if let (false, Some(excess)) = (measured, excess) {
                let by_v_y = -excess.by_v_y / sample.v_x;
                self.sideslip.correct_by_force(&ForceExcess { by_v_y, ..excess });
            }
        }
        if self.output.informative != [false; 2] {
            self.output.informative_time += h;
        }
    }

    /// Takes a measured v_y, if there is one.
    fn correct_v_y_by_sensor(&mut self, settings: &ObserverSettings, sample: &SensorSample) {
        // A comparison with NaN is false.
        if settings.measured_v_y && sample.v_y.abs() <= MOST_V_Y {
            self.sideslip.correct_by_sensor(sample.v_y, settings.noise.v_y);
        }
    }

    /// Compares the force of an axle with its curve `h` [s] after the last time, and gives what it has too much, by slip angle,
    /// where it can be that of a wrong v_y. Behind the peak more force would be less slip, and a wrong curve would drive v_y away.
    fn learn_from_axle(
        &mut self,
        axle: usize,
        settings: &ObserverSettings,
        curve: &TabulatedCurve,
        seen: &AxleObservation,
        h: f64,
    ) -> Option<ForceExcess> {
        // n samples of a noise with correlation time τ tell as much as n tanh(h / 2τ) independent ones.
        let [weight, lasting] = settings.noise_times.map(|time| (h / (2.0 * time)).tanh());
        let FrictionMoments { mean: [D, K], std } = self.output.axles[axle];
        let nominal = curve.nominal;
        let expected = curve.evaluate(seen.alpha, nominal.D * D, nominal.cornering_stiffness_per_load() * K);
        let force = seen.force - nominal.S_v;
        // On a surface that is thought too slippery the slope is small, and the slip angle would seem to say much.
        let steepest =
            curve.evaluate(seen.alpha, nominal.D * D.max(1.0), nominal.cornering_stiffness_per_load() * K);
        let by_alpha = expected.by_alpha.abs().max(steepest.by_alpha.abs()).powi(2);
        let trim = by_alpha * seen.alpha_variances[0] * weight / lasting;
        let variance = seen.force_variance + by_alpha * seen.alpha_variances[1];
        self.output.informative[axle] = expected.by_D.abs() > INFORMATIVE * variance.sqrt();
        self.axles.grids[axle].update_with_force(curve, seen.alpha, force, variance + trim, weight);
        let unsure = (expected.by_D * std[0] / D).powi(2) + (expected.by_K * std[1] / K).powi(2);
        let trim = (expected.by_alpha * settings.noise.alpha[axle]).powi(2);
        let (residual, by_v_y) = (force - expected.value, expected.by_alpha);
        let variance = seen.force_variance + unsure + trim;
        let lasting = by_v_y.powi(2) * seen.alpha_variances[0];
        let fits = by_v_y > 0.0 && residual.powi(2) < FITTING * (variance + lasting);
        fits.then_some(ForceExcess { residual, by_v_y, variance: variance / weight })
    }

    fn output_motion(&mut self, sample: &SensorSample) {
        let LateralSpeedEstimate { mean, variance, .. } = self.sideslip;
        let std = variance.sqrt();
        self.output.v_y = [mean, std];
        let v = sample.v_x.hypot(mean);
        // At rest there is no angle.
        self.output.beta = if v > 1e-3 { [mean.atan2(sample.v_x), std / v] } else { [0.0; 2] };
    }

    fn output_estimates(&mut self, settings: &ObserverSettings, curves: &[TabulatedCurve; 2], time: f64) {
        self.output.axles = self.axles.combined_moments(settings.difference);
        let loads = settings.body.static_loads();
        let forces = [0, 1].map(|axle| loads[axle] * curves[axle].nominal.D);
        let shares = forces.map(|force| force / (forces[0] + forces[1]));
        let [front, rear] = self.output.axles;
        let factor = shares[0] * front.mean[0] + shares[1] * rear.mean[0];
        // What one axle knows is in the other one, too: their errors agree.
        let std = shares[0] * front.std[0] + shares[1] * rear.std[0];
        self.output.factor = [factor, std];
        self.output.alarm.update_alarm(self.output.factor, settings, time);
    }
}
