//! Takes the filter over all recordings: one pass for each kind of filter.

use numerics::scalar::Scalar;

use crate::car::{Car, InputErrors};
use crate::evaluation::Visit;
use crate::filter::{Belief, Filter, Variances};
use crate::samples::{Course, Prepared};
use crate::sensors::Sensors;
use crate::unknowns::{Numbers, Width};
use crate::wide::{Lagging, Motion, Stiff, WideBelief, WideFilter};
use preparation::SystematicError;

/// Standard deviation of the unknown longitudinal force before any data [N].
const START_STD_XI: f64 = 300.0;

/// One pass of the filter that a point needs.
pub struct Sweep<'a, T, V> {
    /// The recordings.
    pub course: &'a Course,
    /// At which it is evaluated.
    pub unknowns: Numbers<T>,
    /// What takes the innovations.
    pub visit: V,
    /// Which filter.
    pub width: Width,
}

impl<T: Scalar, V: Visit<T>> pulp::WithSimd for Sweep<'_, T, V> {
    type Output = V;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> V {
        let Self { course, unknowns, visit, width } = self;
        match width {
            Width::Narrow => simd.vectorize(Pass::<_, _, false> { course, unknowns, visit }),
            Width::Erring => simd.vectorize(Pass::<_, _, true> { course, unknowns, visit }),
            Width::Coloured => simd.vectorize(Coloured { course, unknowns, visit }),
            Width::Relaxed => simd.vectorize(Relaxed::<_, _, 6> { course, unknowns, visit }),
            Width::Full => simd.vectorize(Relaxed::<_, _, 10> { course, unknowns, visit }),
        }
    }
}

/// One pass over all recordings, with errors of sensors and inputs if `ERRORS`; those of the car cost nothing. It is a type of its own since the widest vector
/// instructions of the machine reach only what is inlined into it, and of a closure the compiler would not inline this much.
pub struct Pass<'a, T, V, const ERRORS: bool> {
    /// The recordings.
    pub course: &'a Course,
    /// At which it is evaluated.
    pub unknowns: Numbers<T>,
    /// What takes the innovations.
    pub visit: V,
}

impl<T: Scalar, V: Visit<T>, const ERRORS: bool> pulp::WithSimd for Pass<'_, T, V, ERRORS> {
    type Output = V;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(mut self, _: S) -> V {
        let Course { car, delays, recordings } = self.course;
        let Numbers { tires, causes, noise, .. } = self.unknowns;
        let inputs = InputErrors::new(&causes, delays.inputs);
        let factor = causes[SystematicError::ForceGain] + 1.0;
        let sensors = Sensors::new(&causes, &delays.sensors);
        let filter = Filter::<T, ERRORS> { car: Car::new(car, &causes), tires, noise, sensors };
        for (recording, Prepared { first, samples, first_row }) in recordings.iter().enumerate() {
            let mut belief = start(&filter.sensors.state(first), &noise);
            for (k, sample) in samples.iter().enumerate() {
                let u = if ERRORS { inputs.correct(&sample.u) } else { sample.u.pushed(factor) };
                let innovation =
                    filter.step(&mut belief, &u, sample.h, sample.steps, &sample.measured);
                self.visit.visit(recording, first_row + k + 1, &innovation, &belief);
            }
        }
        self.visit
    }
}

/// One pass with noises that last from row to row.
pub struct Coloured<'a, T, V> {
    /// The recordings.
    pub course: &'a Course,
    /// At which it is evaluated.
    pub unknowns: Numbers<T>,
    /// What takes the innovations.
    pub visit: V,
}

impl<T: Scalar, V: Visit<T>> pulp::WithSimd for Coloured<'_, T, V> {
    type Output = V;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> V {
        let motion = Stiff(self.unknowns.tires);
        wide::<T, V, _, 3, 4, 8>(self.course, self.unknowns, self.visit, motion)
    }
}

/// One pass with slips that relax; with `ALL` of 10 states noises last from row to row, with 6 they do not.
pub struct Relaxed<'a, T, V, const ALL: usize> {
    /// The recordings.
    pub course: &'a Course,
    /// At which it is evaluated.
    pub unknowns: Numbers<T>,
    /// What takes the innovations.
    pub visit: V,
}

impl<T: Scalar, V: Visit<T>, const ALL: usize> pulp::WithSimd for Relaxed<'_, T, V, ALL> {
    type Output = V;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> V {
        let Numbers { tires, causes, .. } = &self.unknowns;
        let lengths = SystematicError::TIRES.map(|cause| causes[cause]);
        let motion = Lagging { tires: *tires, lengths, shortest: self.course.delays.shortest };
        wide::<T, V, _, 5, 6, ALL>(self.course, self.unknowns, self.visit, motion)
    }
}

#[inline(always)]
fn wide<T, V, K, const M: usize, const S: usize, const ALL: usize>(
    Course { car, delays, recordings }: &Course,
    Numbers { causes, noise, colours, .. }: Numbers<T>,
    mut visit: V,
    motion: K,
) -> V
where
    T: Scalar,
    V: Visit<T>,
    K: Motion<T, M, S>,
{
    let inputs = InputErrors::new(&causes, delays.inputs);
    let sensors = Sensors::new(&causes, &delays.sensors);
    let filter = WideFilter { car: Car::new(car, &causes), motion, noise, colours, sensors };
    for (recording, Prepared { first, samples, first_row }) in recordings.iter().enumerate() {
        let narrow = start(&filter.sensors.state(first), &noise);
        let mut belief = WideBelief::<T, S, ALL>::new(&narrow, &noise, &colours);
        for (k, sample) in samples.iter().enumerate() {
            let u = inputs.correct(&sample.u);
            let innovation = filter.step(&mut belief, &u, sample.h, sample.steps, &sample.measured);
            visit.visit(recording, first_row + k + 1, &innovation, &belief.narrow());
        }
    }
    visit
}

/// The state before the second row, from what the sensors show in the first.
fn start<T: Scalar>(&[v_x, v_y, r]: &[T; 3], noise: &Variances<T>) -> Belief<T> {
    let constant = |value: f64| noise.sensor[0].constant(value);
    let mut P = [[constant(0.0); 4]; 4];
    for (i, row) in P.iter_mut().enumerate().take(3) {
        row[i] = noise.sensor[i];
    }
    P[3][3] = constant(START_STD_XI * START_STD_XI);
    Belief { x: [v_x, v_y, r, constant(0.0)], P }
}
