//! How probable recordings are, given tires and noises: the likelihood of prediction errors, with exact derivatives.
//!
//! The cost is ½ Σ (e²/s + ln s) over all residuals e of variance s that `filter` gives, the negative logarithm of the
//! likelihood but for a constant. Its second derivatives are replaced by what they are on average if the model is right, Fisher's
//! information Σ (e_i e_j / s + ½ s_i s_j / s²), which needs first derivatives only.

use numerics::simd_batch::{SimdBatch, WIDTH};
use numerics::tangent::{DIRECTIONS, Tangent};
use rayon::prelude::*;
use vehicle::Vehicle;

use crate::cause::{Cause, Causes};
use crate::evaluation::{Costs, Evaluation, Sums};
use crate::filter::{Belief, Innovation, Variances};
use crate::passes::{Coloured, Numbers, Pass, Relaxed, Width};
use crate::progress::Cancellation;
use crate::recording::Drive;
use crate::rows::{Group, Rows};
use crate::samples::{Delays, Prepared, prepare};
use crate::tires::{self, SIZE, Tires};
use crate::wide::Colour;

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
    /// Correlation from row to row of the part of each sensor's noise that lasts, and the share of that part in its variance;
    /// 0 where noises are white.
    pub colour: [[f64; 2]; 4],
}

impl DriveNoise {
    /// These sensors, on a car that the model describes well.
    pub fn of_sensors(sensor: [f64; 4]) -> Self {
        Self { sensor, process: [1e-5, 1e-5, 1e-5, 30.0], colour: [[0.0; 2]; 4] }
    }

    /// With the process multiplied by a factor.
    pub fn with_process(&self, factor: f64) -> Self {
        Self { process: self.process.map(|std| std * factor), ..*self }
    }

    pub(crate) fn colours(&self) -> [Colour<f64>; 4] {
        self.colour.map(|[correlation, share]| Colour { correlation, share })
    }

    pub(crate) fn variances(&self) -> Variances<f64> {
        let square = |std: f64| std * std;
        Variances { process: self.process.map(square), sensor: self.sensor.map(square) }
    }
}

/// What the likelihood depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unknowns {
    /// The tires.
    pub tires: Tires,
    /// Errors of sensors and car.
    pub causes: Causes,
    /// The noises.
    pub noise: DriveNoise,
}

impl Unknowns {
    /// Tires and noises, where nothing else is wrong.
    pub fn new(tires: &Tires, noise: &DriveNoise) -> Self {
        Self { tires: *tires, causes: Causes::default(), noise: *noise }
    }

    /// Whether tires and white noises are all there is.
    fn is_plain(&self) -> bool {
        self.causes == Causes::default()
            && Width::of(&self.causes, &self.noise, &[]) == Width::Narrow
    }

    /// As numbers with derivatives along up to eight directions.
    fn seeded<S: pulp::Simd, const N: usize>(
        &self,
        simd: S,
        directions: &[Direction],
    ) -> Numbers<Tangent<S, N>> {
        let seed = |value: f64, direction: Direction, rate: f64| match directions
            .iter()
            .position(|known| *known == direction)
        {
            Some(index) => Tangent::<S, N>::seed(simd, value, index, rate),
            None => Tangent::seed(simd, value, 0, 0.0),
        };
        let Self { tires, causes, noise } = self;
        let theta = tires::to_array(*tires);
        let sensor = |i: usize| {
            let variance = noise.sensor[i].powi(2);
            seed(variance, Direction::Noise(i), 2.0 * variance)
        };
        let process = |i: usize| seed(noise.process[i].powi(2), Direction::Noise(4 + i), 1.0);
        let error = |cause: Cause| seed(causes[cause], Direction::Cause(cause), cause.about().std);
        let colour = |i: usize| {
            let [correlation, share] =
                std::array::from_fn(|j| seed(noise.colour[i][j], Direction::Colour(i, j), 1.0));
            Colour { correlation, share }
        };
        Numbers {
            tires: tires::from_array(std::array::from_fn(|i| {
                seed(theta[i], Direction::Tire(i), 1.0)
            })),
            causes: Causes(Cause::ALL.map(error)),
            noise: Variances {
                sensor: std::array::from_fn(sensor),
                process: std::array::from_fn(process),
            },
            colours: std::array::from_fn(colour),
        }
    }
}

/// An unknown along which a derivative is taken, in its own unit but for the logarithms of the standard deviations of sensors
/// and the variances of the process: those may be 0, where the logarithm would have no slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Direction {
    /// A parameter of the tires, by its number in [`crate::tires`].
    Tire(usize),
    /// An error, in its standard deviations before any data.
    Cause(Cause),
    /// A noise: those of sensors before those of the process.
    Noise(usize),
    /// Correlation or share of the lasting noise of a sensor.
    Colour(usize, usize),
}

/// The likelihood of recordings of one car; evaluations share nothing, so several threads may make them.
#[derive(Clone)]
pub struct Likelihood {
    pub(crate) car: Vehicle,
    pub(crate) recordings: Vec<Prepared>,
    pub(crate) delays: Delays,
    samples: usize,
    /// Once set, evaluations end at once, with an infinite cost.
    pub cancel: Cancellation,
}

impl Likelihood {
    /// Prepares recordings, which must have passed [`Drive::check`]. The car's own tires are not used.
    pub fn new(car: &Vehicle, recordings: &[Drive]) -> Self {
        Self::with(car, recordings, Delays::default())
    }

    /// The same for channels with the delays among some causes: the likelihood may be evaluated at delays near these.
    pub fn delayed(car: &Vehicle, recordings: &[Drive], causes: &Causes) -> Self {
        Self::with(car, recordings, Delays::near(causes, recordings))
    }

    fn with(car: &Vehicle, recordings: &[Drive], delays: Delays) -> Self {
        let prepared: Vec<_> =
            recordings.iter().map(|recording| prepare(car, recording, &delays)).collect();
        Self {
            car: *car,
            samples: prepared.iter().map(|part| part.samples.len()).sum(),
            recordings: prepared,
            delays,
            cancel: Cancellation::default(),
        }
    }

    /// A quarter of long recordings, in stretches, as recordings of their own: to compare starts on.
    pub fn thinned(&self) -> Self {
        let mut parts = Vec::new();
        for part in &self.recordings {
            let Prepared { samples, .. } = part;
            if samples.len() < THIN_FROM {
                parts.push(part.clone());
                continue;
            }
            for from in (0..samples.len()).step_by(4 * STRETCH) {
                let stretch = &samples[from..(from + STRETCH).min(samples.len())];
                let (first, rest) = (stretch[0].measured, stretch[1..].to_vec());
                parts.push(Prepared { first, samples: rest, first_row: part.first_row + from + 1 });
            }
        }
        let samples = parts.iter().map(|part| part.samples.len()).sum();
        Self { recordings: parts, samples, cancel: self.cancel.clone(), ..*self }
    }

    /// Number of samples that are predicted: all but the first of each recording.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Cost, gradient and information with respect to the parameters of the tires.
    pub fn of_tires(&self, at: &Unknowns) -> Evaluation {
        self.evaluate(at, &std::array::from_fn::<_, SIZE, _>(Direction::Tire))
    }

    /// Cost, gradient and information with respect to the noises.
    pub fn of_noise(&self, at: &Unknowns) -> Evaluation {
        self.evaluate(at, &std::array::from_fn::<_, SIZE, _>(Direction::Noise))
    }

    fn evaluate(&self, at: &Unknowns, directions: &[Direction]) -> Evaluation {
        if self.cancel.is_cancelled() {
            return Evaluation::CANCELLED;
        }
        if !at.is_plain() {
            return self.rows(at, directions).evaluation();
        }
        match pulp::Arch::new() {
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V4(simd) => self.evaluate_in::<_, 1>(simd, at, directions),
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V3(simd) => self.evaluate_in::<_, 2>(simd, at, directions),
            _ => self.evaluate_in::<_, 8>(pulp::Scalar::new(), at, directions),
        }
    }

    /// In `N` vectors, where nothing is wrong but tires and noises: derivatives along up to eight directions.
    pub(crate) fn evaluate_in<S: pulp::Simd, const N: usize>(
        &self,
        simd: S,
        at: &Unknowns,
        directions: &[Direction],
    ) -> Evaluation {
        let (unknowns, visit) = (at.seeded::<S, N>(simd, directions), Sums::new(simd));
        let pass = Pass::<_, _, false> { likelihood: self, unknowns, visit };
        simd.vectorize(pass).evaluation(self.samples)
    }

    /// Every residual with its derivatives along any number of directions.
    pub fn rows(&self, at: &Unknowns, directions: &[Direction]) -> Rows {
        let group = |directions: &[Direction]| match pulp::Arch::new() {
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V4(simd) => self.group::<_, 1>(simd, at, directions),
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V3(simd) => self.group::<_, 2>(simd, at, directions),
            _ => self.group::<_, 8>(pulp::Scalar::new(), at, directions),
        };
        if self.cancel.is_cancelled() {
            return Rows::cancelled(directions.len());
        }
        let groups = directions.par_chunks(DIRECTIONS).map(group).collect();
        Rows::new(groups, directions.len())
    }

    fn group<S: pulp::Simd, const N: usize>(
        &self,
        simd: S,
        at: &Unknowns,
        directions: &[Direction],
    ) -> Group {
        let (unknowns, visit) = (at.seeded::<S, N>(simd, directions), Group::new(self.samples));
        match Width::of(&at.causes, &at.noise, directions) {
            Width::Relaxed(shortest) => {
                simd.vectorize(Relaxed { likelihood: self, unknowns, visit, shortest })
            }
            Width::Coloured => simd.vectorize(Coloured { likelihood: self, unknowns, visit }),
            Width::Narrow => {
                simd.vectorize(Pass::<_, _, true> { likelihood: self, unknowns, visit })
            }
        }
    }

    /// The cost alone.
    pub fn cost(&self, at: &Unknowns) -> f64 {
        self.costs(&[(at.tires, at.causes); WIDTH], &at.noise)[0]
    }

    /// The costs of several tires and causes, in hardly more time than that of one.
    pub fn costs(&self, several: &[(Tires, Causes); WIDTH], noise: &DriveNoise) -> [f64; WIDTH] {
        if self.cancel.is_cancelled() {
            return [f64::INFINITY; WIDTH];
        }
        let all_tires = several.map(|(tires, _)| tires::to_array(tires));
        let parameter = |i: usize| SimdBatch(std::array::from_fn(|index| all_tires[index][i]));
        let error = |i: usize| SimdBatch(std::array::from_fn(|index| several[index].1.0[i]));
        let all = |variance: f64| SimdBatch([variance; WIDTH]);
        let Variances { process, sensor } = noise.variances();
        let unknowns = Numbers {
            tires: tires::from_array(std::array::from_fn(parameter)),
            causes: Causes(std::array::from_fn(error)),
            noise: Variances { process: process.map(all), sensor: sensor.map(all) },
            colours: noise.colours().map(|colour| colour.map(all)),
        };
        let visit = Costs([0.0; WIDTH]);
        let arch = pulp::Arch::new();
        let widths = several.iter().map(|(_, causes)| Width::of(causes, noise, &[]));
        match widths.fold(Width::Narrow, Width::widest) {
            Width::Relaxed(shortest) => {
                arch.dispatch(Relaxed { likelihood: self, unknowns, visit, shortest }).0
            }
            Width::Coloured => arch.dispatch(Coloured { likelihood: self, unknowns, visit }).0,
            Width::Narrow if several.iter().any(|(_, causes)| *causes != Causes::default()) => {
                arch.dispatch(Pass::<_, _, true> { likelihood: self, unknowns, visit }).0
            }
            Width::Narrow => {
                arch.dispatch(Pass::<_, _, false> { likelihood: self, unknowns, visit }).0
            }
        }
    }

    /// Shows all innovations, and the state after each: (recording, row, innovation, belief).
    pub(crate) fn run(
        &self,
        at: &Unknowns,
        visit: impl FnMut(usize, usize, &Innovation<f64>, &Belief<f64>),
    ) {
        let Unknowns { tires, causes, noise } = *at;
        let width = Width::of(&causes, &noise, &[]);
        let (noise, colours) = (noise.variances(), noise.colours());
        let unknowns = Numbers { tires, causes, noise, colours };
        let arch = pulp::Arch::new();
        match width {
            Width::Relaxed(shortest) => {
                arch.dispatch(Relaxed { likelihood: self, unknowns, visit, shortest });
            }
            Width::Coloured => {
                arch.dispatch(Coloured { likelihood: self, unknowns, visit });
            }
            Width::Narrow => {
                arch.dispatch(Pass::<_, _, true> { likelihood: self, unknowns, visit });
            }
        }
    }
}
