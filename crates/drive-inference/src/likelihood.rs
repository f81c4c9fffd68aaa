//! How probable recordings are, given tires and noises: the likelihood of prediction errors, with exact derivatives.
//!
//! The cost is ½ Σ (e²/s + ln s) over all residuals e of variance s that `filter` gives, the negative logarithm of the
//! likelihood but for a constant. Its second derivatives are replaced by what they are on average if the model is right, Fisher's
//! information Σ (e_i e_j / s + ½ s_i s_j / s²), which needs first derivatives only.

use numerics::scalar::Scalar;
use numerics::simd_batch::{SimdBatch, WIDTH};
use numerics::tangent::Tangent;
use vehicle::{Input, Vehicle};

use crate::car::Held;
use crate::evaluation::{Costs, Evaluation, Sums, Visit};
use crate::filter::{Belief, Filter, Innovation, Variances};
use crate::progress::Cancellation;
use crate::recording::Drive;
use crate::tires::{self, SIZE, Tires};

/// Standard deviation of the unknown longitudinal force before any data [N].
const START_STD_XI: f64 = 300.0;
/// Stiffness per load [1/rad] that no tire exceeds by much: with it, steps are short enough.
const STIFFEST: f64 = 90.0;
/// Longest step in units of the fastest pole.
const POLE_REACH: f64 = 1.7;

/// Samples of a stretch that starts are compared on, and length of recordings from which on that is done.
const STRETCH: usize = 200;
const THIN_FROM: usize = 16 * STRETCH;

/// Noises of a recording, as standard deviations.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct DriveNoise {
    /// Of measured v_x, v_y, r and a_y [m/s, m/s, rad/s, m/s²].
    pub sensor: [f64; 4],
    /// Of the random walk that v_x, v_y, r and ξ_x do besides the model, after one second [m/s, m/s, rad/s, N].
    pub process: [f64; 4],
}

impl DriveNoise {
    /// These sensors, on a car that the model describes well.
    pub fn of_sensors(sensor: [f64; 4]) -> Self {
        Self { sensor, process: [1e-5, 1e-5, 1e-5, 30.0] }
    }

    /// With the process multiplied by a factor.
    pub fn with_process(&self, factor: f64) -> Self {
        Self { sensor: self.sensor, process: self.process.map(|std| std * factor) }
    }

    pub(crate) fn variances(&self) -> Variances<f64> {
        let square = |std: f64| std * std;
        Variances { process: self.process.map(square), sensor: self.sensor.map(square) }
    }
}

#[derive(Clone, Copy)]
struct Sample {
    u: Held,
    h: f64,
    steps: usize,
    measured: [f64; 4],
}

/// The likelihood of recordings of one car; evaluations share nothing, so several threads may make them.
pub struct Likelihood {
    car: Vehicle,
    recordings: Vec<([f64; 4], Vec<Sample>)>,
    samples: usize,
    /// Once set, evaluations end at once, with an infinite cost.
    pub cancel: Cancellation,
}

impl Likelihood {
    /// Prepares recordings, which must have passed [`Drive::check`]. The car's own tires are not used.
    pub fn new(car: &Vehicle, recordings: &[Drive]) -> Self {
        let prepared: Vec<_> = recordings.iter().map(|recording| prepare(car, recording)).collect();
        let samples = prepared.iter().map(|(_, samples)| samples.len()).sum();
        Self { car: *car, recordings: prepared, samples, cancel: Cancellation::default() }
    }

    /// A quarter of long recordings, in stretches, as recordings of their own: to compare starts on.
    pub fn thinned(&self) -> Self {
        let mut parts = Vec::new();
        for (first, samples) in &self.recordings {
            if samples.len() < THIN_FROM {
                parts.push((*first, samples.clone()));
                continue;
            }
            for from in (0..samples.len()).step_by(4 * STRETCH) {
                let stretch = &samples[from..(from + STRETCH).min(samples.len())];
                parts.push((stretch[0].measured, stretch[1..].to_vec()));
            }
        }
        let samples = parts.iter().map(|(_, samples)| samples.len()).sum();
        Self { car: self.car, recordings: parts, samples, cancel: self.cancel.clone() }
    }

    /// Number of samples that are predicted: all but the first of each recording.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Cost, gradient and information with respect to the parameters of the tires.
    pub fn of_tires(&self, tires: &Tires, noise: &DriveNoise) -> Evaluation {
        self.evaluate(tires, noise, [1.0; SIZE], [0.0; SIZE])
    }

    /// Cost, gradient and information with respect to the logarithms of the standard deviations of the sensors' noises, and to
    /// the variances of the process noises: those may be 0, where the logarithm would have no slope.
    pub fn of_noise(&self, tires: &Tires, noise: &DriveNoise) -> Evaluation {
        let rate = |i: usize| if i < 4 { 2.0 * noise.sensor[i].powi(2) } else { 1.0 };
        self.evaluate(tires, noise, [0.0; SIZE], std::array::from_fn(rate))
    }

    fn evaluate(
        &self,
        tires: &Tires,
        noise: &DriveNoise,
        of_tires: [f64; SIZE],
        of_noises: [f64; SIZE],
    ) -> Evaluation {
        let rates = [of_tires, of_noises];
        if self.cancel.is_cancelled() {
            return Evaluation::CANCELLED;
        }
        match pulp::Arch::new() {
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V4(simd) => self.evaluate_in::<_, 1>(simd, tires, noise, &rates),
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V3(simd) => self.evaluate_in::<_, 2>(simd, tires, noise, &rates),
            _ => self.evaluate_in::<_, 8>(pulp::Scalar::new(), tires, noise, &rates),
        }
    }

    /// In `N` vectors: derivatives along directions of which each changes a parameter of the tires and a variance, of sensors
    /// before those of the process, at the given rates.
    pub(crate) fn evaluate_in<S: pulp::Simd, const N: usize>(
        &self,
        simd: S,
        tires: &Tires,
        noise: &DriveNoise,
        [of_tires, of_noises]: &[[f64; SIZE]; 2],
    ) -> Evaluation {
        let theta = tires::to_array(*tires);
        let tire = |i: usize| Tangent::<S, N>::seed(simd, theta[i], i, of_tires[i]);
        let variance = |std: f64, i: usize| Tangent::seed(simd, std * std, i, of_noises[i]);
        let pass = Pass {
            likelihood: self,
            tires: tires::from_array(std::array::from_fn(tire)),
            noise: Variances {
                sensor: std::array::from_fn(|i| variance(noise.sensor[i], i)),
                process: std::array::from_fn(|i| variance(noise.process[i], 4 + i)),
            },
            visit: Sums::new(simd),
        };
        simd.vectorize(pass).evaluation(self.samples)
    }

    /// The cost alone.
    pub fn cost(&self, tires: &Tires, noise: &DriveNoise) -> f64 {
        self.costs(&[*tires; WIDTH], noise)[0]
    }

    /// The costs of several tires, in hardly more time than that of one.
    pub fn costs(&self, tires: &[Tires; WIDTH], noise: &DriveNoise) -> [f64; WIDTH] {
        if self.cancel.is_cancelled() {
            return [f64::INFINITY; WIDTH];
        }
        let all_tires = tires.map(tires::to_array);
        let parameter = |i: usize| SimdBatch(std::array::from_fn(|index| all_tires[index][i]));
        let all = |variance: f64| SimdBatch([variance; WIDTH]);
        let Variances { process, sensor } = noise.variances();
        let pass = Pass {
            likelihood: self,
            tires: tires::from_array(std::array::from_fn(parameter)),
            noise: Variances { process: process.map(all), sensor: sensor.map(all) },
            visit: Costs([0.0; WIDTH]),
        };
        pulp::Arch::new().dispatch(pass).0
    }

    /// Shows all innovations, and the state after each: (recording, row, innovation, belief).
    pub(crate) fn run(
        &self,
        tires: Tires<f64>,
        noise: Variances<f64>,
        visit: impl FnMut(usize, usize, &Innovation<f64>, &Belief<f64>),
    ) {
        pulp::Arch::new().dispatch(Pass { likelihood: self, tires, noise, visit });
    }
}

/// One pass over all recordings. It is a type of its own since the widest vector instructions of the machine reach only what is
/// inlined into it, and of a closure the compiler would not inline this much.
struct Pass<'a, T, V> {
    likelihood: &'a Likelihood,
    tires: Tires<T>,
    noise: Variances<T>,
    visit: V,
}

impl<T: Scalar, V: Visit<T>> pulp::WithSimd for Pass<'_, T, V> {
    type Output = V;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _: S) -> V {
        let filter = Filter { car: &self.likelihood.car, tires: self.tires, noise: self.noise };
        for (recording, (first, samples)) in self.likelihood.recordings.iter().enumerate() {
            let mut belief = start(first, &self.noise);
            for (k, sample) in samples.iter().enumerate() {
                let innovation =
                    filter.step(&mut belief, &sample.u, sample.h, sample.steps, &sample.measured);
                self.visit.visit(recording, k + 1, &innovation, &belief);
            }
        }
        self.visit
    }
}

/// The first row as the state before the second.
fn start<T: Scalar>(first: &[f64; 4], noise: &Variances<T>) -> Belief<T> {
    let constant = |value: f64| noise.sensor[0].constant(value);
    let mut P = [[constant(0.0); 4]; 4];
    for (i, row) in P.iter_mut().enumerate().take(3) {
        row[i] = noise.sensor[i];
    }
    P[3][3] = constant(START_STD_XI * START_STD_XI);
    Belief { x: [first[0], first[1], first[2], 0.0].map(constant), P }
}

fn prepare(car: &Vehicle, recording: &Drive) -> ([f64; 4], Vec<Sample>) {
    let body = &car.body;
    let [front, rear] = body.static_loads().map(|load| load * STIFFEST);
    let pole = (body.l_f * body.l_f * front + body.l_r * body.l_r * rear) / body.I_zz
        + (front + rear) / body.m;
    let sample = |k: usize| {
        let h = recording.t[k] - recording.t[k - 1];
        let speed = recording.v_x[k - 1].max(vehicle::SLIP_SPEED_FLOOR);
        let steps = (h * pole / (POLE_REACH * speed)).ceil().max(1.0) as usize;
        let u = Held::new(car, &Input { F_x: recording.F_x[k], delta: recording.delta[k] });
        Sample { u, h, steps, measured: recording.measured(k) }
    };
    let samples = (1..recording.len()).map(sample).collect();
    (recording.measured(0), samples)
}
