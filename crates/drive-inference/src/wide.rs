//! The extended Kalman filter of [`crate::filter`] with more states: slips that relax, and noises that last from row to row.
#![allow(clippy::needless_range_loop, reason = "indices as in the equations")]

use numerics::scalar::Scalar;

use crate::algebra::{ahead, correct, defect, move_along, side, times};
use crate::car::{self, Car, Held, Linear};
use crate::filter::{Belief, Innovation, Variances};
use crate::relaxed;
use crate::sensors::Sensors;
use crate::tires::Tires;

/// Tires as the filter sees them: the first `M` of `S` states move, the last is ξ_x.
pub trait Motion<T, const M: usize, const S: usize> {
    /// Rates and their derivatives.
    fn linearise(&self, car: &Car<T>, x: &[T; S], u: &Held<T>) -> Linear<T, M, S>;

    /// Steps that a row of this length [s] needs at this speed [m/s].
    fn steps(&self, h: f64, speed: f64) -> usize;
}

/// Tires whose slip is that of the motion.
pub struct Stiff<T>(pub Tires<T>);

impl<T: Scalar> Motion<T, 3, 4> for Stiff<T> {
    #[inline(always)]
    fn linearise(&self, car: &Car<T>, x: &[T; 4], u: &Held<T>) -> Linear<T> {
        car::linearise(car, &self.0, x, u)
    }

    fn steps(&self, _: f64, _: f64) -> usize {
        1
    }
}

/// Tires whose slip follows the motion.
pub struct Lagging<T> {
    /// The tires.
    pub tires: Tires<T>,
    /// Their relaxation lengths [m].
    pub lengths: [T; 2],
    /// Length that steps are short enough for [m].
    pub shortest: f64,
}

impl<T: Scalar> Motion<T, 5, 6> for Lagging<T> {
    #[inline(always)]
    fn linearise(&self, car: &Car<T>, x: &[T; 6], u: &Held<T>) -> Linear<T, 5, 6> {
        relaxed::linearise(car, &self.tires, &self.lengths, x, u)
    }

    /// So that a step is hardly longer than the time that the slip takes to follow.
    fn steps(&self, h: f64, speed: f64) -> usize {
        (h * speed / self.shortest).ceil().max(1.0) as usize
    }
}

/// Sensors, each with a lasting noise.
const SENSORS: usize = 4;

/// Noise of a sensor of which a share lasts: n' = φ n + w.
#[derive(Clone, Copy, Debug)]
pub struct Colour<T> {
    /// Correlation of the lasting noise from row to row.
    pub correlation: T,
    /// Share of the variance that lasts.
    pub share: T,
}

impl<T> Colour<T> {
    /// The same in other numbers.
    pub fn map<U>(self, f: impl Fn(T) -> U) -> Colour<U> {
        Colour { correlation: f(self.correlation), share: f(self.share) }
    }
}

/// State and covariance.
#[derive(Clone, Copy, Debug)]
pub struct WideBelief<T, const S: usize, const ALL: usize> {
    /// The states of the car, then the lasting noises.
    x: [T; ALL],
    P: [[T; ALL]; ALL],
}

impl<T: Scalar, const S: usize, const ALL: usize> WideBelief<T, S, ALL> {
    /// Whether noises last: then each sensor has a state for that.
    const LASTING: bool = ALL > S;

    /// The slips begin at 0, the noises anywhere.
    pub fn new(start: &Belief<T>, noise: &Variances<T>, colours: &[Colour<T>; 4]) -> Self {
        let zero = start.x[0].constant(0.0);
        let place = |i: usize| if i < 3 { i } else { S - 1 };
        let (mut x, mut P) = ([zero; ALL], [[zero; ALL]; ALL]);
        for i in 0..4 {
            x[place(i)] = start.x[i];
            for j in 0..4 {
                P[place(i)][place(j)] = start.P[i][j];
            }
        }
        for i in 3..S - 1 {
            P[i][i] = zero.constant(START_SLIP * START_SLIP);
        }
        for (i, colour) in colours.iter().enumerate().filter(|_| Self::LASTING) {
            P[S + i][S + i] = noise.sensor[i] * colour.share;
        }
        Self { x, P }
    }

    /// The part that the narrow filter has.
    pub fn narrow(&self) -> Belief<T> {
        let place = |i: usize| if i < 3 { i } else { S - 1 };
        Belief {
            x: std::array::from_fn(|i| self.x[place(i)]),
            P: std::array::from_fn(|i| std::array::from_fn(|j| self.P[place(i)][place(j)])),
        }
    }
}

/// Standard deviation of the slip angles of the first row [rad].
const START_SLIP: f64 = 0.05;

/// What stays the same from sample to sample.
pub struct WideFilter<T, K> {
    /// The car.
    pub car: Car<T>,
    /// The tires.
    pub motion: K,
    /// The noises.
    pub noise: Variances<T>,
    /// How much of the sensors' noises lasts.
    pub colours: [Colour<T>; SENSORS],
    /// The errors of the sensors.
    pub sensors: Sensors<T>,
}

impl<T: Scalar, K> WideFilter<T, K> {
    /// Predicts over `h` [s] under a held input in `steps`, and corrects by what is measured at the end.
    #[inline(always)]
    pub fn step<const M: usize, const S: usize, const ALL: usize>(
        &self,
        belief: &mut WideBelief<T, S, ALL>,
        u: &Held<T>,
        h: f64,
        steps: usize,
        measured: &[f64; 4],
    ) -> Innovation<T>
    where
        K: Motion<T, M, S>,
    {
        let steps = steps.max(self.motion.steps(h, measured[0]));
        let part = h / steps as f64;
        let mut left = steps;
        let (near, end) = loop {
            let there = self.predict(belief, u, part);
            left -= 1;
            if left == 0 {
                break there;
            }
        };
        if WideBelief::<T, S, ALL>::LASTING {
            self.colour(belief);
        }
        self.correct(belief, &near, &end, measured)
    }

    #[inline(always)]
    fn at<const M: usize, const S: usize, const ALL: usize>(
        &self,
        x: &[T; ALL],
        u: &Held<T>,
    ) -> Linear<T, M, S>
    where
        K: Motion<T, M, S>,
    {
        let mut state = [x[0]; S];
        state.copy_from_slice(&x[..S]);
        self.motion.linearise(&self.car, &state, u)
    }

    /// As [`crate::filter`] does it.
    #[inline(always)]
    fn predict<const M: usize, const S: usize, const ALL: usize>(
        &self,
        belief: &mut WideBelief<T, S, ALL>,
        u: &Held<T>,
        h: f64,
    ) -> ([T; ALL], Linear<T, M, S>)
    where
        K: Motion<T, M, S>,
    {
        let x = belief.x;
        let start = self.at(&x, u);
        let second = times(&start.A, &start.rates);
        let rates = [start.rates, second, times(&start.A, &second)];
        let near = ahead(&x, &rates, h);
        let end = self.at(&near, u);
        let bent = times(&end.A, &end.rates);
        let [mut F, N] = [side(&start.A, 0.5 * h), side(&end.A, -0.5 * h)];
        for i in 0..M {
            // The column of ξ_x, which does not move, belongs to the right-hand side.
            F[i][S - 1] = F[i][S - 1] - N[i][S - 1];
        }
        let mut off = defect(&rates, &end.rates, &bent, h);
        solve(N, &mut F, &mut off);
        belief.x = near;
        for i in 0..M {
            belief.x[i] = near[i] - off[i];
        }
        move_along(&F, &mut belief.P);
        let Variances { process, .. } = &self.noise;
        for (i, place) in [0, 1, 2, S - 1].into_iter().enumerate() {
            belief.P[place][place] = belief.P[place][place].plus_scaled(process[i], h);
        }
        (near, end)
    }

    /// One row of the lasting noises.
    #[inline(always)]
    fn colour<const S: usize, const ALL: usize>(&self, belief: &mut WideBelief<T, S, ALL>) {
        for (i, Colour { correlation, share }) in self.colours.into_iter().enumerate() {
            let place = S + i;
            belief.x[place] = belief.x[place] * correlation;
            for j in 0..ALL {
                belief.P[place][j] = belief.P[place][j] * correlation;
                belief.P[j][place] = belief.P[j][place] * correlation;
            }
            let lasting = self.noise.sensor[i] * share;
            let fresh = lasting.minus(lasting, correlation * correlation);
            belief.P[place][place] = belief.P[place][place] + fresh;
        }
    }

    #[inline(always)]
    fn correct<const M: usize, const S: usize, const ALL: usize>(
        &self,
        belief: &mut WideBelief<T, S, ALL>,
        prior: &[T; ALL],
        at: &Linear<T, M, S>,
        measured: &[f64; 4],
    ) -> Innovation<T> {
        let zero = at.a_y.constant(0.0);
        let mut innovation = Innovation { residual: [zero; 4], variance: [zero; 4] };
        for i in 0..4 {
            let motion = [prior[0], prior[1], prior[2]];
            let (mut expected, H) = self.sensors.measure(i, &motion, at);
            let P = &belief.P;
            let mut with = [zero; ALL];
            if WideBelief::<T, S, ALL>::LASTING {
                expected = expected + belief.x[S + i];
                with = P[S + i];
            }
            for k in 0..S {
                expected = expected.plus(H[k], belief.x[k] - prior[k]);
                for (j, with) in with.iter_mut().enumerate() {
                    *with = with.plus(H[k], P[k][j]);
                }
            }
            let mut own = zero;
            for k in 0..S {
                own = own.plus(H[k], with[k]);
            }
            let mut variance = own + self.noise.sensor[i];
            if WideBelief::<T, S, ALL>::LASTING {
                variance =
                    (variance + with[S + i]).minus(self.noise.sensor[i], self.colours[i].share);
            }
            let residual = -expected + measured[i];
            correct(&mut belief.x, &mut belief.P, &with, residual, variance);
            innovation.residual[i] = residual;
            innovation.variance[i] = variance;
        }
        innovation
    }
}

/// Solves N X = right, and N y = off, by elimination; N is near the identity or larger on its diagonal.
#[inline(always)]
fn solve<T: Scalar, const M: usize, const S: usize>(
    mut N: [[T; S]; M],
    right: &mut [[T; S]; M],
    off: &mut [T; M],
) {
    for pivot in 0..M {
        let inverse = N[pivot][pivot].recip();
        for j in pivot..M {
            N[pivot][j] = N[pivot][j] * inverse;
        }
        for j in 0..S {
            right[pivot][j] = right[pivot][j] * inverse;
        }
        off[pivot] = off[pivot] * inverse;
        for i in 0..M {
            if i == pivot {
                continue;
            }
            let factor = N[i][pivot];
            for j in pivot..M {
                N[i][j] = N[i][j].minus(factor, N[pivot][j]);
            }
            for j in 0..S {
                right[i][j] = right[i][j].minus(factor, right[pivot][j]);
            }
            off[i] = off[i].minus(factor, off[pivot]);
        }
    }
}
