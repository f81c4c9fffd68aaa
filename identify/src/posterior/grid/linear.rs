//! Integrates over what the curve is linear in, D and S_v, and over the noise: all of it in closed form.
//!
//! The noise has a flat prior: ∫ σ^−N exp(−S / 2σ²) dσ is S^−(N−1)/2 but for a factor. As a function of D that is Student's t
//! distribution, cut off by the box; S_v first, as if the box were wide, and its own cut as a weight of the draws.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use rand::Rng;

use super::normal::Student;
use crate::compressed::Compressed;
use crate::kernel::shapes;
use crate::parameters::{Parameter, Theta};
use crate::prior::Prior;

const PEAK: usize = Parameter::D as usize;
const S_H: usize = Parameter::S_h as usize;
const S_V: usize = Parameter::S_v as usize;

/// The data, as weights of h, the curve for D = 1 and S_v = 0, at nodes.
pub struct Linear<'a> {
    prior: &'a Prior,
    /// Slip plus shift. Without a shift the curve is odd, and both sides are one.
    slips: Vec<f64>,
    /// Of h².
    squares: Vec<f64>,
    /// Of h, for the products with the forces.
    forces: Vec<f64>,
    /// Of h, for its sum.
    ones: Vec<f64>,
    /// Σ w, Σ w y, Σ w y².
    whole: [f64; 3],
    count: f64,
}

/// The integral over D, S_v and the noise at a shape of the curve, and what remains to be drawn there.
#[derive(Clone, Copy, Debug)]
pub struct Integral {
    /// Its logarithm, but for a constant.
    pub log: f64,
    /// Smallest sum of squares.
    pub squares: f64,
    peak: Option<Student>,
    /// Σ w h² once S_v has its best value.
    information: f64,
    /// Σ w h.
    sum: f64,
}

impl<'a> Linear<'a> {
    /// S_h must be held.
    pub fn new(data: &Compressed, prior: &'a Prior) -> Self {
        let shift = prior.centre[S_H];
        let mut nodes: Vec<[f64; 4]> = data
            .nodes()
            .map(|[slip, weight, force]| match slip + shift {
                x if shift == 0.0 && x < 0.0 => [-x, weight, -force, -weight],
                x => [x, weight, force, weight],
            })
            .collect();
        nodes.sort_by(|a, b| a[0].total_cmp(&b[0]));
        nodes.dedup_by(|next, kept| {
            let same = next[0] == kept[0];
            if same {
                (1..4).for_each(|k| kept[k] += next[k]);
            }
            same
        });
        let column = |k: usize| nodes.iter().map(|node| node[k]).collect();
        let whole =
            data.nodes().fold([0.0; 2], |[w, y], [_, weight, force]| [w + weight, y + force]);
        Self {
            prior,
            slips: column(0),
            squares: column(1),
            forces: column(2),
            ones: column(3),
            whole: [whole[0], whole[1], data.square()],
            count: data.count() as f64,
        }
    }

    /// The integral for B, C and E.
    pub fn at(&self, B: f64, C: f64, E: f64) -> Integral {
        let [mut hh, mut hy, h] =
            shapes([B, C, E], &self.slips, [&self.squares, &self.forces, &self.ones]);
        let [ones, y, mut yy] = self.whole;
        // Of the t distribution whose density is S^−(freedom + 1)/2.
        let mut freedom = self.count - 2.0;
        if self.prior.free[S_V] {
            hh -= h * h / ones;
            hy -= h * y / ones;
            yy -= y * y / ones;
            freedom -= 1.0;
        } else {
            let held = self.prior.centre[S_V];
            hy -= held * h;
            yy += held * (held * ones - 2.0 * y);
        }
        let floor = 1e-15 * self.whole[2];
        if !self.prior.free[PEAK] {
            let held = self.prior.centre[PEAK];
            let squares = (yy + held * (held * hh - 2.0 * hy)).max(floor);
            let log = -0.5 * (freedom + 1.0) * squares.ln();
            return Integral { log, squares, peak: None, information: hh, sum: h };
        }
        let hh = hh.max(f64::MIN_POSITIVE);
        let centre = hy / hh;
        let squares = (yy - centre * hy).max(floor);
        let scale = (squares / (freedom * hh)).sqrt();
        let between = [self.prior.bounds.lower[PEAK], self.prior.bounds.upper[PEAK]];
        let peak = Student { freedom, centre, scale, between };
        let log = -0.5 * (freedom * squares.ln() + hh.ln()) + peak.log_mass();
        Integral { log, squares, peak: Some(peak), information: hh, sum: h }
    }

    /// D and S_v for a shape, and the logarithm of the weight of such a draw.
    pub fn draw(&self, theta: &mut Theta, at: &Integral, random: &mut impl Rng) -> f64 {
        let mut squares = at.squares;
        if let Some(peak) = at.peak {
            theta[PEAK] = peak.draw(random);
            squares += at.information * (theta[PEAK] - peak.centre).powi(2);
        }
        if !self.prior.free[S_V] {
            return 0.0;
        }
        let [ones, y, _] = self.whole;
        let freedom = self.count - 2.0;
        let shift = Student {
            freedom,
            centre: (y - theta[PEAK] * at.sum) / ones,
            scale: (squares / (freedom * ones)).sqrt(),
            between: [self.prior.bounds.lower[S_V], self.prior.bounds.upper[S_V]],
        };
        theta[S_V] = shift.draw(random);
        shift.log_mass()
    }

    /// Smallest sum of squares that is left, over that of the forces, per sample: what sets the width of the posterior.
    pub fn relative_noise(&self, squares: f64) -> f64 {
        squares / (self.whole[2] * self.count)
    }
}
