//! Minimises weighted squares with a normal prior by Levenberg's and Marquardt's method, with exact derivatives by dual numbers.

use nalgebra::{Const, DMatrix, DVector, Dyn, SVector};
use num_dual::{Derivative, DualSVec64};
use numerics::convergence::OptimisationStatus;
use numerics::levenberg_marquardt::{
    LevenbergMarquardtMinimum, LevenbergMarquardtOptions, NormalEquations, SquaredCost,
    minimise_levenberg_marquardt,
};
use rayon::prelude::*;
use tire::{Coefficients, MfTire};

use crate::condition::RevolutionMean;
use crate::model::{COUNT, ExtendedTireModel, FittedChannel};
use crate::prior::{FittedParameter, FreeParameterPrior};

/// Directions of derivatives at once.
const WIDE: usize = 8;

/// Points whose sums are made by one task; the order of the sums does not depend on the number of threads.
const TASK: usize = 256;

type Dual = DualSVec64<WIDE>;

/// A fit of one channel: unknowns are in standard deviations of their prior from its mean.
pub(crate) struct ChannelFitProblem<'a> {
    pub channel: FittedChannel,
    pub points: &'a [RevolutionMean],
    pub free: &'a [FreeParameterPrior],
    /// What is not free.
    pub coefficients: Coefficients,
    pub terms: [f64; COUNT],
    /// Where the terms of temperature are 0 [K].
    pub reference: f64,
    /// Weight of one squared residual [1/N², 1/(N m)²].
    pub weight: f64,
}

/// Where a minimisation ended.
pub(crate) struct FitMinimum {
    pub z: DVector<f64>,
    /// The Gauss-Newton matrix there, prior included.
    pub information: DMatrix<f64>,
    pub status: OptimisationStatus,
    pub iterations: usize,
}

impl ChannelFitProblem<'_> {
    /// The coefficients and terms at a place.
    pub fn coefficients_and_terms_at(&self, z: &DVector<f64>) -> (Coefficients, [f64; COUNT]) {
        let (mut coefficients, mut terms) = (self.coefficients, self.terms);
        for (free, z) in self.free.iter().zip(z.iter()) {
            let value = free.mean + free.std * z;
            match free.what {
                FittedParameter::Key(key) => key.set(&mut coefficients, value),
                FittedParameter::Term(place) => terms[place] = value,
            }
        }
        (coefficients, terms)
    }

    /// The model with derivatives along all unknowns, [`WIDE`] at a time; `None` outside of what a tire can be.
    fn dual_number_models(&self, z: &DVector<f64>) -> Option<Vec<ExtendedTireModel<Dual>>> {
        let (coefficients, terms) = self.coefficients_and_terms_at(z);
        let chunk = |free: &[FreeParameterPrior]| {
            let mut lifted: Coefficients<Dual> = coefficients.cast();
            let mut with = terms.map(Dual::from);
            for (direction, free) in free.iter().enumerate() {
                let mut along = SVector::<f64, WIDE>::zeros();
                along[direction] = free.std;
                let seed =
                    |value: f64| Dual::new(value, Derivative::<f64, Const<WIDE>, Const<1>>::some(along));
                match free.what {
                    FittedParameter::Key(key) => key.set(&mut lifted, seed(key.get(&coefficients))),
                    FittedParameter::Term(place) => with[place] = seed(terms[place]),
                }
            }
            let reference = self.reference;
            MfTire::new(lifted).ok().map(|tire| ExtendedTireModel { tire, terms: with, reference })
        };
        self.free.chunks(WIDE).map(chunk).collect()
    }

    /// Residual and gradient of each of some points at a place.
    pub fn residuals_and_gradients(
        &self,
        z: &DVector<f64>,
        points: &[RevolutionMean],
    ) -> Option<Vec<(f64, DVector<f64>)>> {
        let models = self.dual_number_models(z)?;
        let row = |point: &RevolutionMean| {
            let mut gradient = DVector::zeros(self.free.len());
            let mut value = 0.0;
            for (number, model) in models.iter().enumerate() {
                let found = model.channel_value(self.channel, point);
                value = found.re;
                if let Some(along) = found.eps.0 {
                    let begin = WIDE * number;
                    for k in 0..WIDE.min(self.free.len() - begin) {
                        gradient[begin + k] = along[k];
                    }
                }
            }
            (value - self.channel.measured_value(point), gradient)
        };
        Some(points.par_iter().map(row).collect())
    }

    /// Minimises from a place; `None` when the start is no tire.
    pub fn minimise(&self, start: DVector<f64>, limit: usize) -> Option<FitMinimum> {
        let options = LevenbergMarquardtOptions {
            iterations: limit,
            rejections: 12,
            increase: 6.0,
            decrease: 0.2,
            gain_ratio: 0.5,
            relative_tolerance: 0.0,
            // A share of a nat, so it stops alike for all data.
            absolute_tolerance: 2e-4,
        };
        let minimum = minimise_levenberg_marquardt(self, start, &options);
        let LevenbergMarquardtMinimum { x: z, cost, status, iterations } = minimum;
        let information = self.normal_equations(&z).filter(|_| cost.is_finite())?.matrix;
        Some(FitMinimum { z, information, status, iterations })
    }
}

/// −2 ln of the posterior density, but for a constant.
impl SquaredCost<Dyn> for ChannelFitProblem<'_> {
    fn cost(&self, z: &DVector<f64>) -> f64 {
        let (coefficients, terms) = self.coefficients_and_terms_at(z);
        let Some(model) = crate::model::plain_tire_model(&coefficients, terms, self.reference) else {
            return f64::INFINITY;
        };
        let squares: Vec<f64> = self
            .points
            .par_chunks(TASK)
            .map(|points| {
                let miss = |it: &RevolutionMean| {
                    model.channel_value(self.channel, it) - self.channel.measured_value(it)
                };
                points.iter().map(|it| miss(it).powi(2)).sum()
            })
            .collect();
        self.weight * squares.iter().sum::<f64>() + z.norm_squared()
    }

    fn normal_equations(&self, z: &DVector<f64>) -> Option<NormalEquations<Dyn>> {
        let rows = self.residuals_and_gradients(z, self.points)?;
        let count = self.free.len();
        let sums: Vec<_> = rows
            .par_chunks(TASK)
            .map(|rows| {
                let jacobian = DMatrix::from_fn(rows.len(), count, |i, k| rows[i].1[k]);
                let residual = DVector::from_fn(rows.len(), |i, _| rows[i].0);
                (jacobian.tr_mul(&residual), jacobian.tr_mul(&jacobian))
            })
            .collect();
        let mut gradient = z.clone();
        let mut matrix = DMatrix::identity(count, count);
        for (by, product) in sums {
            gradient += by * self.weight;
            matrix += product * self.weight;
        }
        Some(NormalEquations { matrix, gradient })
    }
}
