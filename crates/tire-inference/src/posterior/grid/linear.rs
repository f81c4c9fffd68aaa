//! Integrates over what the curve is linear in, and over the noise: all of it in closed form.
//!
//! The curve is linear in S_v, in D, and near a shift in D (S_h − shift), whose column is the slope. The noise has a flat prior:
//! ∫ σ^−N exp(−S / 2σ²) dσ is S^−(N−1)/2 but for a factor, in the linear parameters Student's t distribution. They are
//! drawn one after the other, each cut off by the box: the first cut is in the integral as it is, the others where
//! those before have their most probable values. What this leaves, and the curve's bend over S_h, are weights of the draws.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use numerics::student::TruncatedStudent;
use rand::Rng;

use crate::compressed::CompressedSamples;
use crate::kernel::{shape_sums, shapes_and_slopes};
use crate::parameters::{Parameter, Theta};
use crate::prior::Prior;

const PEAK: usize = Parameter::D as usize;
const S_H: usize = Parameter::S_h as usize;
const S_V: usize = Parameter::S_v as usize;
/// Linear parameters in the order of their draws: the bounds of S_v are what most often ends a ridge of S_h and S_v.
const ORDER: [usize; COUNT] = [S_V, PEAK, S_H];
/// How many there are.
const COUNT: usize = 3;
/// Share of a column that is not that of the others, below which it is rounding.
const COLLINEAR: f64 = 1e-9;

/// The data, as weights of h, the curve for D = 1 and without shifts, and of its slope.
pub struct LinearParameterIntegrator<'a> {
    data: &'a CompressedSamples,
    prior: &'a Prior,
    /// Slip plus `shift`. Around it the curve is odd, and both sides are one.
    slips: Vec<f64>,
    /// For h² and even functions.
    even: Vec<f64>,
    /// For the products of forces with h, and with even functions.
    odd_forces: Vec<f64>,
    even_forces: Vec<f64>,
    /// For h.
    odd: Vec<f64>,
    /// Σ w, Σ w y, Σ w y².
    whole: [f64; 3],
    count: f64,
    /// Where the curve is taken to be linear in S_h.
    shift: f64,
}

/// One linear parameter, given those before it.
#[derive(Clone, Copy, Debug, Default)]
struct ConditionalParameter {
    /// Its value where those before are 0.
    centre: f64,
    /// How it falls with each of those before.
    slopes: [f64; COUNT],
    /// What its square is multiplied with in the sum of squares.
    information: f64,
}

/// The integral over the linear parameters and the noise at a shape of the curve, and what remains to be drawn there.
#[derive(Clone, Copy, Debug)]
pub struct LinearIntegral {
    /// Its logarithm, but for a constant.
    pub log: f64,
    /// What the cuts by the box add to that.
    cuts: f64,
    /// Smallest sum of squares.
    squares: f64,
    /// In the order of draws; those of parameters that are held are not used.
    steps: [ConditionalParameter; COUNT],
}

impl<'a> LinearParameterIntegrator<'a> {
    /// `shift` is a value of S_h near those that count; where S_h is held, what it is held at.
    pub fn new(data: &'a CompressedSamples, prior: &'a Prior, shift: f64) -> Self {
        let mut nodes: Vec<[f64; 5]> = data
            .with_slip_shift(shift)
            .slip_nodes()
            .map(|[slip, weight, force]| {
                let sign = f64::from(slip >= 0.0) - f64::from(slip < 0.0);
                [slip.abs(), weight, sign * force, force, sign * weight]
            })
            .collect();
        nodes.sort_by(|a, b| a[0].total_cmp(&b[0]));
        nodes.dedup_by(|next, kept| {
            let same = next[0] == kept[0];
            if same {
                (1..5).for_each(|k| kept[k] += next[k]);
            }
            same
        });
        let column = |k: usize| nodes.iter().map(|node| node[k]).collect();
        let whole = data.slip_nodes().fold([0.0; 2], |[w, y], [_, weight, force]| [w + weight, y + force]);
        Self {
            data,
            prior,
            slips: column(0),
            even: column(1),
            odd_forces: column(2),
            even_forces: column(3),
            odd: column(4),
            whole: [whole[0], whole[1], data.force_squares()],
            count: data.effective_count() as f64,
            shift,
        }
    }

    /// The integral for B, C and E.
    pub fn integrate_at(&self, B: f64, C: f64, E: f64) -> LinearIntegral {
        let (mut normal, mut right) = self.normal_equations([B, C, E]);
        let mut squares = self.whole[2];
        if let Some((known, variance)) = self.data.prior() {
            // D (S_h − shift) is reported of as if D were the best one.
            let ends = [self.prior.bounds.lower[PEAK], self.prior.bounds.upper[PEAK]];
            let peak = (right[1] / normal[1][1].max(f64::MIN_POSITIVE)).clamp(ends[0], ends[1]);
            let scale = [1.0, 1.0, peak.recip()];
            let (distance, gradient) = known.squared_mahalanobis_distance(&[B, C, 0.0, E, self.shift, 0.0]);
            squares += variance * distance;
            for (k, i) in ORDER.into_iter().enumerate() {
                right[k] -= variance * scale[k] * gradient[i];
                for (l, j) in ORDER.into_iter().enumerate() {
                    normal[k][l] += variance * scale[k] * scale[l] * known.precision[i][j];
                }
            }
        }
        // What is held is no unknown.
        for (k, &parameter) in ORDER.iter().enumerate() {
            if !self.prior.free[parameter] {
                let held = if parameter == S_H { 0.0 } else { self.prior.centre[parameter] };
                squares += held * (held * normal[k][k] - 2.0 * right[k]);
                (0..COUNT).for_each(|i| right[i] -= held * normal[i][k]);
            }
        }
        // Gauss's elimination of the last first, so that each is reported by those before it.
        let mut steps = [ConditionalParameter::default(); COUNT];
        let mut determinant = 1.0;
        let mut unknowns = 0.0;
        let whole: [f64; COUNT] = std::array::from_fn(|k| normal[k][k]);
        for k in self.free_parameter_order().rev() {
            let information = normal[k][k].max(COLLINEAR * whole[k]).max(f64::MIN_POSITIVE);
            let centre = right[k] / information;
            let slopes = std::array::from_fn(|i| if i < k { normal[k][i] / information } else { 0.0 });
            squares -= centre * right[k];
            for i in 0..k {
                right[i] -= slopes[i] * right[k];
                (0..k).for_each(|j| normal[i][j] -= slopes[i] * normal[k][j]);
            }
            steps[k] = ConditionalParameter { centre, slopes, information };
            determinant *= information;
            unknowns += 1.0;
        }
        let squares = squares.max(1e-15 * self.whole[2]);
        let log = -0.5 * ((self.count - 1.0 - unknowns) * squares.ln() + f64::ln(determinant));
        let uncut = LinearIntegral { log, cuts: 0.0, squares, steps };
        let likely =
            |student: &TruncatedStudent| student.centre.clamp(student.between[0], student.between[1]);
        let (_, cuts, _) = self.choose_parameters(&uncut, likely);
        LinearIntegral { log: log + cuts, cuts, ..uncut }
    }

    /// Of S_v, D and D (S_h − shift): products of their columns, and with the forces.
    fn normal_equations(&self, of: [f64; 3]) -> ([[f64; COUNT]; COUNT], [f64; COUNT]) {
        let Self { slips, even, odd_forces, even_forces, odd, whole: [ones, y, _], .. } = self;
        if !self.prior.free[S_H] {
            let [hh, yh, h] = shape_sums(of, slips, [even, odd_forces, odd]);
            return ([[*ones, h, 0.0], [h, hh, 0.0], [0.0; COUNT]], [*y, yh, 0.0]);
        }
        let [hh, yh, h, hs, ss, ys, s] = shapes_and_slopes(of, slips, [even, odd_forces, odd, even_forces]);
        ([[*ones, h, s], [h, hh, hs], [s, hs, ss]], [*y, yh, ys])
    }

    /// Places in [`ORDER`] of what is free.
    fn free_parameter_order(&self) -> impl DoubleEndedIterator<Item = usize> {
        (0..COUNT).filter(|&k| self.prior.free[ORDER[k]])
    }

    /// Chooses the linear parameters, each given those before. With them the logarithm of the mass inside the box, per S_h, and
    /// the sum of squares of the linear curve.
    fn choose_parameters(
        &self,
        at: &LinearIntegral,
        mut choose: impl FnMut(&TruncatedStudent) -> f64,
    ) -> (Theta, f64, f64) {
        let mut theta = self.prior.centre;
        let mut chosen = [0.0; COUNT];
        let (mut squares, mut log) = (at.squares, 0.0);
        let mut freedom = self.count - 1.0 - self.free_parameter_order().count() as f64;
        for k in self.free_parameter_order() {
            let ConditionalParameter { centre, slopes, information } = at.steps[k];
            let parameter = ORDER[k];
            let mut between = [self.prior.bounds.lower[parameter], self.prior.bounds.upper[parameter]];
            if parameter == S_H {
                between = between.map(|end| theta[PEAK] * (end - self.shift));
                log -= theta[PEAK].ln();
            }
            let centre = (0..k).fold(centre, |centre, i| centre - slopes[i] * chosen[i]);
            let scale = (squares / (freedom * information)).sqrt();
            let student = TruncatedStudent { freedom, centre, scale, between };
            log += student.log_mass();
            chosen[k] = choose(&student);
            squares += information * (chosen[k] - centre).powi(2);
            freedom += 1.0;
            theta[parameter] = match parameter {
                S_H => self.shift + chosen[k] / theta[PEAK],
                _ => chosen[k],
            };
        }
        (theta, log, squares)
    }

    /// Draws the linear parameters for the shape of `theta`, and gives the logarithm of the weight of such a draw.
    pub fn draw_linear_parameters(
        &self,
        theta: &mut Theta,
        at: &LinearIntegral,
        random: &mut impl Rng,
    ) -> f64 {
        let (drawn, log, squares) = self.choose_parameters(at, |student| student.draw(random));
        ORDER.into_iter().for_each(|parameter| theta[parameter] = drawn[parameter]);
        let bent = if self.prior.free[S_H] {
            // S_h may leave its bounds by the rounding of the way there and back.
            let ends = [self.prior.bounds.lower[S_H], self.prior.bounds.upper[S_H]];
            theta[S_H] = theta[S_H].clamp(ends[0], ends[1]);
            -0.5 * (self.count - 1.0) * (self.data.residual_squares(theta) / squares).ln()
        } else {
            0.0
        };
        log - at.cuts + bent
    }

    /// Smallest sum of squares that is left, over that of the forces, per sample: what sets the width of the posterior.
    pub fn relative_noise(&self, squares: f64) -> f64 {
        squares / (self.whole[2] * self.count)
    }
}
