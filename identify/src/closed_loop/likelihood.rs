//! How probable recordings are, given tires and noises: the likelihood of prediction errors, with exact derivatives.
//!
//! The cost is ½ Σ (e²/s + ln s) over all residuals e of variance s that [`super::filter`] gives, the negative logarithm of the
//! likelihood but for a constant. Its second derivatives are replaced by what they are on average if the model is right, Fisher's
//! information Σ (e_i e_j / s + ½ s_i s_j / s²), which needs first derivatives only.

use nalgebra::{DMatrix, DVector};
use vehicle::{Input, Vehicle};

use super::car::{Held, Tires};
use super::filter::{Belief, Filter, Innovation, Variances};
use super::recording::Recording;
use super::scalar::{DIRECTIONS, Products, Scalar, Tangent};
use super::watch::Cancel;

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
pub struct Noise {
    /// Of measured v_x, v_y, r and a_y [m/s, m/s, rad/s, m/s²].
    pub sensor: [f64; 4],
    /// Of the random walk that v_x, v_y, r and ξ_x do besides the model, after one second [m/s, m/s, rad/s, N].
    pub process: [f64; 4],
}

impl Noise {
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

/// Parameters of both axles in the order B, C, D, E of the front and of the rear axle.
pub type Theta8 = [f64; 8];

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
    pub cancel: Cancel,
}

/// The likelihood at one point, with its derivatives.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// ½ Σ (e²/s + ln s).
    pub cost: f64,
    /// Its derivatives.
    pub gradient: [f64; DIRECTIONS],
    /// Fisher's information.
    pub information: [[f64; DIRECTIONS]; DIRECTIONS],
    /// Mean of e²/s for v_x, v_y, r and a_y; 1 if model and noises are right.
    pub mean_square: [f64; 4],
}

impl Evaluation {
    /// What is told instead once nobody wants to know.
    const CANCELLED: Self = Self {
        cost: f64::INFINITY,
        gradient: [0.0; DIRECTIONS],
        information: [[0.0; DIRECTIONS]; DIRECTIONS],
        mean_square: [0.0; 4],
    };

    /// As the model that a minimiser wants.
    pub fn model(&self, samples: usize) -> crate::fit::sqp::Model {
        crate::fit::sqp::Model {
            cost: self.cost,
            gradient: DVector::from_column_slice(&self.gradient),
            hessian: DMatrix::from_fn(DIRECTIONS, DIRECTIONS, |i, j| self.information[i][j]),
            scale: (4.0 * samples as f64).sqrt(),
        }
    }
}

impl Likelihood {
    /// Prepares recordings, which must have passed [`Recording::check`]. The car's own tires are not used.
    pub fn new(car: &Vehicle, recordings: &[Recording]) -> Self {
        let prepared: Vec<_> = recordings.iter().map(|recording| prepare(car, recording)).collect();
        let samples = prepared.iter().map(|(_, samples)| samples.len()).sum();
        Self { car: *car, recordings: prepared, samples, cancel: Cancel::default() }
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
    pub fn of_tires(&self, theta: &Theta8, noise: &Noise) -> Evaluation {
        self.evaluate(theta, noise, [1.0; 8], [0.0; 8])
    }

    /// Cost, gradient and information with respect to the logarithms of the standard deviations of the sensors' noises, and to
    /// the variances of the process noises: those may be 0, where the logarithm would have no slope.
    pub fn of_noise(&self, theta: &Theta8, noise: &Noise) -> Evaluation {
        let rate = |i: usize| if i < 4 { 2.0 * noise.sensor[i].powi(2) } else { 1.0 };
        self.evaluate(theta, noise, [0.0; 8], std::array::from_fn(rate))
    }

    /// Derivatives along directions of which each changes a parameter of the tires and a variance, of sensors before those of
    /// the process, at the given rates.
    fn evaluate(&self, theta: &Theta8, noise: &Noise, tires: Theta8, noises: Theta8) -> Evaluation {
        if self.cancel.is_cancelled() {
            return Evaluation::CANCELLED;
        }
        let seeds =
            Seeds { likelihood: self, theta, noise: noise.variances(), rates: [tires, noises] };
        match pulp::Arch::new() {
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V3(simd) => seeds.evaluate::<_, 2>(simd),
            _ => seeds.evaluate::<_, DIRECTIONS>(pulp::Scalar::new()),
        }
    }

    /// The cost alone.
    pub fn cost(&self, theta: &Theta8, noise: &Noise) -> f64 {
        let mut cost = 0.0;
        self.run(tires(theta), noise.variances(), |_, _, innovation, _| {
            let s = &innovation.variance;
            for (e, s) in innovation.residual.iter().zip(s) {
                cost += 0.5 * e * e / s;
            }
            cost += 0.5 * (s[0] * s[1] * s[2] * s[3]).ln();
        });
        cost
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

/// Numbers, and the rates of those that are derived by.
struct Seeds<'a> {
    likelihood: &'a Likelihood,
    theta: &'a Theta8,
    noise: Variances<f64>,
    rates: [Theta8; 2],
}

impl Seeds<'_> {
    fn evaluate<S: pulp::Simd, const N: usize>(&self, simd: S) -> Evaluation {
        let [tire, noise] = &self.rates;
        let tires = |o: usize| {
            std::array::from_fn(|i| {
                Tangent::<S, N>::seed(simd, self.theta[o + i], o + i, tire[o + i])
            })
        };
        let variance = |variance: f64, i: usize| Tangent::seed(simd, variance, i, noise[i]);
        let pass = Pass {
            likelihood: self.likelihood,
            tires: Tires { front: tires(0), rear: tires(4) },
            noise: Variances {
                sensor: std::array::from_fn(|i| variance(self.noise.sensor[i], i)),
                process: std::array::from_fn(|i| variance(self.noise.process[i], 4 + i)),
            },
            visit: Sums::new(simd),
        };
        let samples = self.likelihood.samples as f64;
        let sums = simd.vectorize(pass);
        Evaluation {
            cost: sums.cost.value(),
            gradient: sums.cost.derivatives(),
            information: sums.products.matrix(),
            mean_square: sums.squares.map(|square| square / samples),
        }
    }
}

/// Takes what a pass gives.
trait Visit<T> {
    fn visit(
        &mut self,
        recording: usize,
        row: usize,
        innovation: &Innovation<T>,
        belief: &Belief<T>,
    );
}

impl<T, F: FnMut(usize, usize, &Innovation<T>, &Belief<T>)> Visit<T> for F {
    #[inline(always)]
    fn visit(
        &mut self,
        recording: usize,
        row: usize,
        innovation: &Innovation<T>,
        belief: &Belief<T>,
    ) {
        self(recording, row, innovation, belief);
    }
}

/// An [`Evaluation`] while it grows.
struct Sums<S: pulp::Simd, const N: usize> {
    cost: Tangent<S, N>,
    products: Products<S, N>,
    squares: [f64; 4],
}

impl<S: pulp::Simd, const N: usize> Sums<S, N> {
    fn new(simd: S) -> Self {
        Self {
            cost: Tangent::seed(simd, 0.0, 0, 0.0),
            products: Products::new(simd),
            squares: [0.0; 4],
        }
    }
}

impl<S: pulp::Simd, const N: usize> Visit<Tangent<S, N>> for Sums<S, N> {
    #[inline(always)]
    fn visit(
        &mut self,
        _: usize,
        _: usize,
        innovation: &Innovation<Tangent<S, N>>,
        _: &Belief<Tangent<S, N>>,
    ) {
        let mut determinant = 1.0;
        for i in 0..4 {
            let (e, s) = (innovation.residual[i], innovation.variance[i]);
            let inverse = 1.0 / s.value();
            let square = e.value() * e.value() * inverse;
            self.squares[i] += square;
            determinant *= s.value();
            let by_s = 0.5 * inverse * (1.0 - square);
            self.cost = self.cost + e.chain(0.5 * square, e.value() * inverse) + s.chain(0.0, by_s);
            let (e, s) = (e * inverse.sqrt(), s * (0.5_f64.sqrt() * inverse));
            self.products.add(&[*e.along(), *s.along()]);
        }
        self.cost = self.cost + 0.5 * determinant.ln();
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

/// Plain numbers for both axles.
pub(crate) fn tires(theta: &Theta8) -> Tires<f64> {
    let [bf, cf, df, ef, br, cr, dr, er] = *theta;
    Tires { front: [bf, cf, df, ef], rear: [br, cr, dr, er] }
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

fn prepare(car: &Vehicle, recording: &Recording) -> ([f64; 4], Vec<Sample>) {
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
