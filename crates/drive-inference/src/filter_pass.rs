//! A pass of the augmented Kalman filter over all drives, in the variant that some unknowns need.

use std::marker::PhantomData;

use kalman::augmented::{AugmentedFilter, ColouredNoise, Innovations, ProcessModel, StateEstimate};
use numerics::scalar::Scalar;
use preparation::SystematicError;

use crate::car::{CarInput, CarLinearisation, FilterCarParameters, SteadySlip};
use crate::prepared_drive::{PreparedDelays, PreparedDrive, PreparedDrives};
use crate::recorded_input::{InputErrors, TrueInputs};
use crate::sensors::SensorModel;
use crate::transient_slip::{MOVING, STATES, TransientSlip};
use crate::unknowns::{FilterParameters, FilterStructure, NoiseVariances};

/// Standard deviation of the unknown longitudinal force before any data [N], and of the slip angles of the first row [rad].
const START_STD_XI: f64 = 300.0;
const START_STD_SLIP: f64 = 0.05;

/// Residuals of v_x, v_y, r and a_y.
pub type RowInnovations<T> = Innovations<T, 4>;

/// Takes what a pass gives.
pub trait InnovationVisitor<T> {
    /// The drive, its row, the innovations, and v_x, v_y, r and ξ_x after them.
    fn visit(&mut self, drive: usize, row: usize, innovations: &RowInnovations<T>, x: &[T; 4]);
}

impl<T, F: FnMut(usize, usize, &RowInnovations<T>, &[T; 4])> InnovationVisitor<T> for F {
    #[inline(always)]
    fn visit(&mut self, drive: usize, row: usize, innovations: &RowInnovations<T>, x: &[T; 4]) {
        self(drive, row, innovations, x);
    }
}

/// A process model that the parameters of a filter make.
pub trait CarModel<T, const M: usize, const S: usize>:
    ProcessModel<T, M, S, Input = CarInput<T>, Linearisation = CarLinearisation<T, M, S>>
{
    /// That of a car with these parameters.
    fn new(car: FilterCarParameters<T>, parameters: &FilterParameters<T>) -> Self;

    /// Sub-steps that a row of this length [s] needs at this speed [m/s].
    fn required_substeps(delays: &PreparedDelays, h: f64, speed: f64) -> usize;
}

impl<T: Scalar, const BIASED: bool> CarModel<T, 3, 4> for SteadySlip<T, BIASED> {
    fn new(car: FilterCarParameters<T>, parameters: &FilterParameters<T>) -> Self {
        Self { car, tires: parameters.tires }
    }

    fn required_substeps(_: &PreparedDelays, _: f64, _: f64) -> usize {
        1
    }
}

impl<T: Scalar> CarModel<T, MOVING, STATES> for TransientSlip<T> {
    fn new(
        car: FilterCarParameters<T>,
        FilterParameters { tires, causes, .. }: &FilterParameters<T>,
    ) -> Self {
        Self { car, tires: *tires, lengths: SystematicError::TIRES.map(|it| causes[it]) }
    }

    /// So that a sub-step is hardly longer than the time that the slip takes to follow.
    fn required_substeps(delays: &PreparedDelays, h: f64, speed: f64) -> usize {
        (h * speed / delays.shortest_relaxation).ceil().max(1.0) as usize
    }
}

/// One pass over all drives with a process model of `M` moving among `S` states and `N` states in all. With `BIASED` sensors and inputs
/// have errors; those of the car cost nothing. It is a type of its own since the widest vector instructions of the machine reach only what
/// is inlined into it, and of a closure the compiler would not inline this much.
pub struct FilterPass<'a, T, V, P, const BIASED: bool, const M: usize, const S: usize, const N: usize> {
    drives: &'a PreparedDrives,
    parameters: FilterParameters<T>,
    visitor: V,
    process: PhantomData<P>,
}

/// A pass without errors of sensors, coloured noises and transient slip.
pub type SteadySlipFilterPass<'a, T, V> = FilterPass<'a, T, V, SteadySlip<T, false>, false, 3, 4, 4>;

impl<'a, T, V, P, const BIASED: bool, const M: usize, const S: usize, const N: usize>
    FilterPass<'a, T, V, P, BIASED, M, S, N>
{
    /// Over some drives, with what takes the innovations.
    pub fn new(drives: &'a PreparedDrives, parameters: FilterParameters<T>, visitor: V) -> Self {
        Self { drives, parameters, visitor, process: PhantomData }
    }
}

impl<T, V, P, const BIASED: bool, const M: usize, const S: usize, const N: usize> pulp::WithSimd
    for FilterPass<'_, T, V, P, BIASED, M, S, N>
where
    T: Scalar,
    V: InnovationVisitor<T>,
    P: CarModel<T, M, S>,
{
    type Output = V;

    #[inline(always)]
    fn with_simd<I: pulp::Simd>(mut self, _: I) -> V {
        let PreparedDrives { car, delays, drives } = self.drives;
        let FilterParameters { causes, noise, coloured_noise, .. } = &self.parameters;
        let mut errors = InputErrors::new(causes);
        let force_factor = causes[SystematicError::ForceGain] + 1.0;
        let mut filter = AugmentedFilter {
            process: P::new(FilterCarParameters::new(car, causes), &self.parameters),
            measurement: SensorModel::<T, BIASED>::new(causes),
            process_noise: noise.process,
            sensor_noise: noise.sensor,
            coloured_noise: *coloured_noise,
        };
        for (drive, PreparedDrive { first, samples, first_row, .. }) in drives.iter().enumerate() {
            let motion = filter.measurement.state_from_sensors(first);
            let mut estimate = initial_estimate::<T, S, N>(&motion, noise, coloured_noise);
            for (k, sample) in samples.iter().enumerate() {
                if BIASED {
                    errors.set_sample(sample.time, &sample.taken, sample.after_change);
                    filter.measurement.set_sample(sample);
                }
                let errors = BIASED.then_some(&errors);
                let inputs = TrueInputs { recorded: &sample.inputs, errors, force_factor };
                let substeps =
                    sample.substeps.max(P::required_substeps(delays, sample.h, sample.measured[0]));
                let innovations = filter.step(&mut estimate, &inputs, sample.h, substeps, &sample.measured);
                let x = &estimate.x;
                let motion = [x[0], x[1], x[2], x[S - 1]];
                self.visitor.visit(drive, first_row + k + 1, &innovations, &motion);
            }
        }
        self.visitor
    }
}

/// A pass in any variant.
pub struct AnyPass<'a, T, V> {
    /// The drives.
    pub drives: &'a PreparedDrives,
    /// At which the filter is evaluated.
    pub parameters: FilterParameters<T>,
    /// What takes the innovations.
    pub visitor: V,
    /// The variant.
    pub variant: FilterStructure,
}

impl<T: Scalar, V: InnovationVisitor<T>> pulp::WithSimd for AnyPass<'_, T, V> {
    type Output = V;

    #[inline(always)]
    fn with_simd<I: pulp::Simd>(self, simd: I) -> V {
        type Steady<'a, T, V, const BIASED: bool, const N: usize> =
            FilterPass<'a, T, V, SteadySlip<T, BIASED>, BIASED, 3, 4, N>;
        type Transient<'a, T, V, const N: usize> =
            FilterPass<'a, T, V, TransientSlip<T>, true, MOVING, STATES, N>;
        let Self { drives, parameters, visitor, variant } = self;
        match variant {
            FilterStructure::Base => {
                simd.vectorize(SteadySlipFilterPass::<T, V>::new(drives, parameters, visitor))
            }
            FilterStructure::SensorBias => {
                simd.vectorize(Steady::<T, V, true, 4>::new(drives, parameters, visitor))
            }
            FilterStructure::ColouredNoise => {
                simd.vectorize(Steady::<T, V, true, 8>::new(drives, parameters, visitor))
            }
            FilterStructure::TransientSlip => {
                simd.vectorize(Transient::<T, V, 6>::new(drives, parameters, visitor))
            }
            FilterStructure::ColouredTransientSlip => {
                simd.vectorize(Transient::<T, V, 10>::new(drives, parameters, visitor))
            }
        }
    }
}

/// The estimate before the second row, from the motion that the sensors show in the first: ξ_x and slips begin at 0, coloured noises
/// anywhere.
fn initial_estimate<T: Scalar, const S: usize, const N: usize>(
    motion: &[T; 3],
    noise: &NoiseVariances<T>,
    coloured_noise: &[ColouredNoise<T>; 4],
) -> StateEstimate<T, N> {
    let constant = |value: f64| noise.sensor[0].constant(value);
    let mut estimate = StateEstimate { x: [constant(0.0); N], P: [[constant(0.0); N]; N] };
    for (i, value) in motion.iter().enumerate() {
        estimate.x[i] = *value;
        estimate.P[i][i] = noise.sensor[i];
    }
    for i in 3..S - 1 {
        estimate.P[i][i] = constant(START_STD_SLIP * START_STD_SLIP);
    }
    estimate.P[S - 1][S - 1] = constant(START_STD_XI * START_STD_XI);
    for i in S..N {
        estimate.P[i][i] = noise.sensor[i - S] * coloured_noise[i - S].share;
    }
    estimate
}
