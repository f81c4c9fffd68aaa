//! How probable recordings are, given tires and noises: the likelihood of prediction errors, with exact derivatives.
//!
//! The cost is ½ Σ (e²/s + ln s) over all residuals e of variance s that the filter gives, the negative logarithm of the
//! likelihood but for a constant. Its second derivatives are replaced by what they are on average if the model is right, Fisher's
//! information Σ (e_i e_j / s + ½ s_i s_j / s²), which needs first derivatives only.

use numerics::simd_batch::{SimdBatch, WIDTH};
use numerics::tangent::DIRECTIONS;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use vehicle::SingleTrackCar;

use crate::evaluation::{CostAccumulator, EvaluationSums, LikelihoodEvaluation};
use crate::filter_pass::{AnyPass, RowInnovations, SteadySlipFilterPass};
use crate::prepared_drive::{PreparedDelays, PreparedDrive, PreparedDrives, PreparedSample, prepare_drive};
use crate::progress::CancellationFlag;
use crate::residual_rows::{ResidualGroup, ResidualRows};
use crate::tires::{self, SIZE, Tires};
pub use crate::unknowns::{DerivativeDirection, DriveNoise, DriveUnknowns};
use crate::unknowns::{FilterParameters, FilterStructure, NoiseVariances};
use preparation::{Drive, SystematicErrors};

/// Samples of a stretch that starts are compared on, and length of recordings from which on that is done.
const STRETCH: usize = 200;
const THIN_FROM: usize = 16 * STRETCH;

/// The likelihood of recordings of one car; evaluations share nothing, so several threads may make them.
#[derive(Clone)]
pub struct DriveLikelihood {
    drives: PreparedDrives,
    samples: usize,
    /// Once set, evaluations end at once, with an infinite cost.
    pub cancel: CancellationFlag,
}

impl DriveLikelihood {
    /// Prepares recordings, which must have passed [`Drive::check_columns`]. The car's own tires are not used.
    pub fn new(car: &SingleTrackCar, recordings: &[Drive]) -> Self {
        Self::with_prepared_delays(car, recordings, PreparedDelays::default())
    }

    /// The same for channels with the delays among some unknowns, and their change of friction: the likelihood may be evaluated at delays
    /// near these.
    pub fn with_delays(car: &SingleTrackCar, recordings: &[Drive], at: &DriveUnknowns) -> Self {
        Self::with_prepared_delays(car, recordings, PreparedDelays::nearest_to(at, recordings))
    }

    fn with_prepared_delays(car: &SingleTrackCar, recordings: &[Drive], delays: PreparedDelays) -> Self {
        let mut rows_before = 0;
        let prepare = |recording: &Drive| {
            let drive = prepare_drive(car, recording, rows_before, &delays);
            rows_before += recording.len();
            drive
        };
        let prepared: Vec<_> = recordings.iter().map(prepare).collect();
        Self {
            samples: prepared.iter().map(|part| part.samples.len()).sum(),
            drives: PreparedDrives { car: *car, drives: prepared, delays },
            cancel: CancellationFlag::default(),
        }
    }

    /// Whether it may be evaluated at some unknowns of these recordings.
    pub fn is_valid_for(&self, at: &DriveUnknowns, recordings: &[Drive]) -> bool {
        self.drives.delays.is_valid_for(at, recordings)
    }

    /// The row from which on the friction is another one, counted over all recordings.
    pub fn friction_change_row(&self) -> usize {
        self.drives.delays.friction_change_row
    }

    /// The row of the recordings, counted over all, of a sample among all.
    pub fn recorded_row(&self, sample: usize) -> usize {
        let mut before = 0;
        for part in &self.drives.drives {
            if sample < before + part.samples.len() {
                return part.rows_before + part.first_row + 1 + sample - before;
            }
            before += part.samples.len();
        }
        usize::MAX
    }

    /// The time of the first sample after the change of friction, by the clock of its recording [s].
    pub fn friction_change_time(&self) -> Option<f64> {
        let time = |part: &PreparedDrive| {
            part.samples.iter().find(|sample| sample.after_change).map(|it| it.time + part.middle)
        };
        self.drives.drives.iter().find_map(time)
    }

    /// A quarter of long recordings, in stretches, as recordings of their own: to compare starts on.
    pub fn subsampled(&self) -> Self {
        let mut parts = Vec::new();
        for part in &self.drives.drives {
            let PreparedDrive { samples, .. } = part;
            if samples.len() < THIN_FROM {
                parts.push(part.clone());
                continue;
            }
            for from in (0..samples.len()).step_by(4 * STRETCH) {
                let stretch = &samples[from..(from + STRETCH).min(samples.len())];
                // A stretch starts where no value is missing.
                let is_complete = |sample: &PreparedSample| sample.measured.iter().all(|it| it.is_finite());
                let Some(start) = stretch.iter().position(is_complete) else { continue };
                let (from, stretch) = (from + start, &stretch[start..]);
                let (first, rest) = (stretch[0].measured, stretch[1..].to_vec());
                parts.push(PreparedDrive {
                    first,
                    samples: rest,
                    first_row: part.first_row + from + 1,
                    ..*part
                });
            }
        }
        let samples = parts.iter().map(|part| part.samples.len()).sum();
        let drives = PreparedDrives { drives: parts, ..self.drives };
        Self { drives, samples, cancel: self.cancel.clone() }
    }

    /// Number of samples that are predicted: all but the first of each recording.
    pub fn sample_count(&self) -> usize {
        self.samples
    }

    /// Cost, gradient and information with respect to the parameters of the tires.
    pub fn evaluate_by_tires(&self, at: &DriveUnknowns) -> LikelihoodEvaluation {
        self.evaluate(at, &std::array::from_fn::<_, SIZE, _>(DerivativeDirection::Tire))
    }

    /// Cost, gradient and information with respect to the noises.
    pub fn evaluate_by_noise(&self, at: &DriveUnknowns) -> LikelihoodEvaluation {
        self.evaluate(at, &std::array::from_fn::<_, SIZE, _>(DerivativeDirection::Noise))
    }

    fn evaluate(&self, at: &DriveUnknowns, directions: &[DerivativeDirection]) -> LikelihoodEvaluation {
        if self.cancel.is_cancelled() {
            return LikelihoodEvaluation::CANCELLED;
        }
        if !at.has_no_errors() {
            return self.residual_rows(at, directions).to_evaluation();
        }
        match pulp::Arch::new() {
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V4(simd) => self.evaluate_simd::<_, 1>(simd, at, directions),
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V3(simd) => self.evaluate_simd::<_, 2>(simd, at, directions),
            _ => self.residual_rows(at, directions).to_evaluation(),
        }
    }

    /// In `N` vectors, where nothing is wrong but tires and noises: derivatives along up to eight directions.
    fn evaluate_simd<S: Simd, const N: usize>(
        &self,
        simd: S,
        at: &DriveUnknowns,
        directions: &[DerivativeDirection],
    ) -> LikelihoodEvaluation {
        let parameters = at.with_derivative_seeds::<S, N>(simd, directions);
        let pass = SteadySlipFilterPass::new(&self.drives, parameters, EvaluationSums::new(simd));
        simd.vectorize(pass).to_evaluation(self.samples)
    }

    /// Every residual with its derivatives along any number of directions.
    pub fn residual_rows(&self, at: &DriveUnknowns, directions: &[DerivativeDirection]) -> ResidualRows {
        let group = |directions: &[DerivativeDirection]| match pulp::Arch::new() {
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V4(simd) => self.residual_group::<_, 1>(simd, at, directions),
            #[cfg(target_arch = "x86_64")]
            pulp::Arch::V3(simd) => self.residual_group::<_, 2>(simd, at, directions),
            _ => self.residuals_by_direction(at, directions),
        };
        if self.cancel.is_cancelled() {
            return ResidualRows::new_cancelled(directions.len());
        }
        let groups = directions.par_chunks(DIRECTIONS).map(group).collect();
        ResidualRows::new(groups, directions.len())
    }

    /// Without vectors each direction has a pass of its own: all in one would be eight times the code.
    pub(crate) fn residuals_by_direction(
        &self,
        at: &DriveUnknowns,
        directions: &[DerivativeDirection],
    ) -> ResidualGroup {
        let alone = |direction| self.residual_group::<_, 1>(pulp::Scalar::new(), at, &[direction]);
        ResidualGroup::merge_directions(directions.iter().copied().map(alone))
    }

    fn residual_group<S: Simd, const N: usize>(
        &self,
        simd: S,
        at: &DriveUnknowns,
        directions: &[DerivativeDirection],
    ) -> ResidualGroup {
        simd.vectorize(AnyPass {
            drives: &self.drives,
            parameters: at.with_derivative_seeds::<S, N>(simd, directions),
            visitor: ResidualGroup::new(self.samples),
            variant: FilterStructure::required_for(&at.causes, &at.noise, directions),
        })
    }

    /// The cost alone.
    pub fn cost(&self, at: &DriveUnknowns) -> f64 {
        self.costs(&[(at.tires, at.causes); WIDTH], &at.noise)[0]
    }

    /// The costs of several tires and causes, in hardly more time than that of one.
    pub fn costs(&self, several: &[(Tires, SystematicErrors); WIDTH], noise: &DriveNoise) -> [f64; WIDTH] {
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
            coloured_noise: noise.coloured.map(|it| it.map(all)),
        };
        let variants = several.iter().map(|(_, causes)| FilterStructure::required_for(causes, noise, &[]));
        let variant = variants.fold(FilterStructure::Base, FilterStructure::covering_both);
        let visitor = CostAccumulator([0.0; WIDTH]);
        let pass = AnyPass { drives: &self.drives, parameters, visitor, variant };
        pulp::Arch::new().dispatch(pass).0
    }

    /// Shows all innovations, and v_x, v_y, r and ξ_x after each: (recording, row, innovations, state).
    pub(crate) fn visit_innovations(
        &self,
        at: &DriveUnknowns,
        visitor: impl FnMut(usize, usize, &RowInnovations<f64>, &[f64; 4]),
    ) {
        let DriveUnknowns { tires, causes, noise, .. } = *at;
        let variant = FilterStructure::required_for(&causes, &noise, &[]);
        let (noise, coloured_noise) = (noise.variances(), noise.coloured);
        let parameters = FilterParameters { tires, causes, noise, coloured_noise };
        let pass = AnyPass { drives: &self.drives, parameters, visitor, variant };
        pass.with_simd(pulp::Scalar::new());
    }
}
