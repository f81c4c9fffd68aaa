//! How probable recordings are, given tires and noises: the likelihood of prediction errors, with exact derivatives.
//!
//! The cost is ½ Σ (e²/s + ln s) over all residuals e of variance s that the filter gives, the negative logarithm of the
//! likelihood but for a constant. Its second derivatives are replaced by what they are on average if the model is right, Fisher's
//! information Σ (e_i e_j / s + ½ s_i s_j / s²), which needs first derivatives only.

use numerics::simd_batch::{SimdBatch, WIDTH};
use numerics::tangent::DIRECTIONS;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use vehicle::Vehicle;

use crate::evaluation::{Costs, Evaluation, Sums};
use crate::filter_pass::{AnyPass, BasePass, RowInnovations};
use crate::prepared_drive::{Delays, PreparedDrive, PreparedDrives, prepare};
use crate::progress::Cancellation;
use crate::residual_rows::{ResidualGroup, ResidualRows};
use crate::tires::{self, SIZE, Tires};
pub use crate::unknowns::{Direction, DriveNoise, Unknowns};
use crate::unknowns::{FilterParameters, FilterVariant, NoiseVariances};
use preparation::{Drive, SystematicErrors};

/// Samples of a stretch that starts are compared on, and length of recordings from which on that is done.
const STRETCH: usize = 200;
const THIN_FROM: usize = 16 * STRETCH;

/// The likelihood of recordings of one car; evaluations share nothing, so several threads may make them.
#[derive(Clone)]
pub struct Likelihood {
    drives: PreparedDrives,
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
    pub fn delayed(car: &Vehicle, recordings: &[Drive], causes: &SystematicErrors) -> Self {
        Self::with(car, recordings, Delays::near(causes, recordings))
    }

    fn with(car: &Vehicle, recordings: &[Drive], delays: Delays) -> Self {
        let prepared: Vec<_> =
            recordings.iter().map(|recording| prepare(car, recording, &delays)).collect();
        Self {
            samples: prepared.iter().map(|part| part.samples.len()).sum(),
            drives: PreparedDrives { car: *car, drives: prepared, delays },
            cancel: Cancellation::default(),
        }
    }

    /// Whether it may be evaluated at some causes of these recordings.
    pub fn serves(&self, causes: &SystematicErrors, recordings: &[Drive]) -> bool {
        self.drives.delays.serve(causes, recordings)
    }

    /// A quarter of long recordings, in stretches, as recordings of their own: to compare starts on.
    pub fn thinned(&self) -> Self {
        let mut parts = Vec::new();
        for part in &self.drives.drives {
            let PreparedDrive { samples, .. } = part;
            if samples.len() < THIN_FROM {
                parts.push(part.clone());
                continue;
            }
            for from in (0..samples.len()).step_by(4 * STRETCH) {
                let stretch = &samples[from..(from + STRETCH).min(samples.len())];
                let (first, rest) = (stretch[0].measured, stretch[1..].to_vec());
                parts.push(PreparedDrive {
                    first,
                    samples: rest,
                    first_row: part.first_row + from + 1,
                });
            }
        }
        let samples = parts.iter().map(|part| part.samples.len()).sum();
        let drives = PreparedDrives { drives: parts, ..self.drives };
        Self { drives, samples, cancel: self.cancel.clone() }
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
            _ => self.rows(at, directions).evaluation(),
        }
    }

    /// In `N` vectors, where nothing is wrong but tires and noises: derivatives along up to eight directions.
    fn evaluate_in<S: Simd, const N: usize>(
        &self,
        simd: S,
        at: &Unknowns,
        directions: &[Direction],
    ) -> Evaluation {
        let parameters = at.seeded::<S, N>(simd, directions);
        let pass = BasePass::new(&self.drives, parameters, Sums::new(simd));
        simd.vectorize(pass).evaluation(self.samples)
    }

    /// Every residual with its derivatives along any number of directions.
    pub fn rows(&self, at: &Unknowns, directions: &[Direction]) -> ResidualRows {
        let group = |directions: &[Direction]| match pulp::Arch::new() {
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V4(simd) => self.group::<_, 1>(simd, at, directions),
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V3(simd) => self.group::<_, 2>(simd, at, directions),
            _ => self.one_by_one(at, directions),
        };
        if self.cancel.is_cancelled() {
            return ResidualRows::cancelled(directions.len());
        }
        let groups = directions.par_chunks(DIRECTIONS).map(group).collect();
        ResidualRows::new(groups, directions.len())
    }

    /// Without vectors each direction has a pass of its own: all in one would be eight times the code.
    pub(crate) fn one_by_one(&self, at: &Unknowns, directions: &[Direction]) -> ResidualGroup {
        let alone = |direction| self.group::<_, 1>(pulp::Scalar::new(), at, &[direction]);
        ResidualGroup::side_by_side(directions.iter().copied().map(alone))
    }

    fn group<S: Simd, const N: usize>(
        &self,
        simd: S,
        at: &Unknowns,
        directions: &[Direction],
    ) -> ResidualGroup {
        simd.vectorize(AnyPass {
            drives: &self.drives,
            parameters: at.seeded::<S, N>(simd, directions),
            visitor: ResidualGroup::new(self.samples),
            variant: FilterVariant::of(&at.causes, &at.noise, directions),
        })
    }

    /// The cost alone.
    pub fn cost(&self, at: &Unknowns) -> f64 {
        self.costs(&[(at.tires, at.causes); WIDTH], &at.noise)[0]
    }

    /// The costs of several tires and causes, in hardly more time than that of one.
    pub fn costs(
        &self,
        several: &[(Tires, SystematicErrors); WIDTH],
        noise: &DriveNoise,
    ) -> [f64; WIDTH] {
        if self.cancel.is_cancelled() {
            return [f64::INFINITY; WIDTH];
        }
        let all_tires = several.map(|(tires, _)| tires::to_array(tires));
        let parameter = |i: usize| SimdBatch(std::array::from_fn(|index| all_tires[index][i]));
        let error = |i: usize| SimdBatch(std::array::from_fn(|index| several[index].1.0[i]));
        let all = |variance: f64| SimdBatch([variance; WIDTH]);
        let NoiseVariances { process, sensor } = noise.variances();
        let parameters = FilterParameters {
            tires: tires::from_array(std::array::from_fn(parameter)),
            causes: SystematicErrors(std::array::from_fn(error)),
            noise: NoiseVariances { process: process.map(all), sensor: sensor.map(all) },
            coloured_noise: noise.coloured_noise().map(|colour| colour.map(all)),
        };
        let variants = several.iter().map(|(_, causes)| FilterVariant::of(causes, noise, &[]));
        let variant = variants.fold(FilterVariant::Base, FilterVariant::covering);
        let visitor = Costs([0.0; WIDTH]);
        let pass = AnyPass { drives: &self.drives, parameters, visitor, variant };
        pulp::Arch::new().dispatch(pass).0
    }

    /// Shows all innovations, and v_x, v_y, r and ξ_x after each: (recording, row, innovations, state).
    pub(crate) fn run(
        &self,
        at: &Unknowns,
        visitor: impl FnMut(usize, usize, &RowInnovations<f64>, &[f64; 4]),
    ) {
        let Unknowns { tires, causes, noise } = *at;
        let variant = FilterVariant::of(&causes, &noise, &[]);
        let (noise, coloured_noise) = (noise.variances(), noise.coloured_noise());
        let parameters = FilterParameters { tires, causes, noise, coloured_noise };
        let pass = AnyPass { drives: &self.drives, parameters, visitor, variant };
        pass.with_simd(pulp::Scalar::new());
    }
}
