//! The joint posterior of tires and systematic errors as a cost, and the marginal one of tires alone, which the errors follow.

use kalman::augmented::ColouredNoise;
use nalgebra::{DMatrix, DVector};
use numerics::simd_batch::WIDTH;
use numerics::sqp::{Objective, QuadraticModel, SqpMinimum};
use rayon::prelude::*;
use tire_inference::bounds::Bounds;

use crate::coordinates::UnboundedCoordinates;
use crate::laplace::{LaplaceApproximation, inverse_hessian};
use crate::likelihood::{DerivativeDirection, DriveLikelihood, DriveNoise, DriveUnknowns};
use crate::regularisation::TireRegularisation;
use crate::tires::{SIZE, Tires, box_corners, from_vector, to_vector};
use crate::unknowns::SHORTEST;
use preparation::{SystematicError, SystematicErrors};

/// Largest error that is looked for, in its usual standard deviations.
const REACH: f64 = 30.0;

/// Cost of tires and of some causes, given noises: the negative logarithm of the posterior but for the box. The variables are
/// the parameters of the tires, then the causes in their usual standard deviations.
#[derive(Clone)]
pub struct JointPosterior<'a> {
    /// The likelihood.
    pub likelihood: &'a DriveLikelihood,
    /// The noises.
    pub noise: DriveNoise,
    /// What is expected of the tires.
    pub expected: TireRegularisation,
    /// SystematicErrors that are variables.
    pub active: Vec<SystematicError>,
    /// Where the other causes are held.
    pub held: SystematicErrors,
    /// Standard deviations of all causes before any data.
    pub std: SystematicErrors,
}

impl JointPosterior<'_> {
    /// The point of some unknowns.
    pub fn x_from_parameters(&self, tires: &Tires, causes: &SystematicErrors) -> DVector<f64> {
        let mut x = to_vector(tires).resize_vertically(SIZE + self.active.len(), 0.0);
        for (i, cause) in self.active.iter().enumerate() {
            x[SIZE + i] = causes[*cause] / cause.describe().std;
        }
        x
    }

    /// The causes at a point.
    pub fn systematic_errors_at(&self, x: &DVector<f64>) -> SystematicErrors {
        let mut causes = self.held;
        for (i, cause) in self.active.iter().enumerate() {
            causes[*cause] = x[SIZE + i] * cause.describe().std;
        }
        causes
    }

    /// Everything that the likelihood depends on at a point.
    pub fn unknowns_at(&self, x: &DVector<f64>) -> DriveUnknowns {
        DriveUnknowns {
            tires: from_vector(x),
            causes: self.systematic_errors_at(x),
            noise: self.noise,
            friction_change_row: self.likelihood.friction_change_row(),
        }
    }

    /// The directions of the variables.
    pub fn variable_directions(&self) -> Vec<DerivativeDirection> {
        let causes = self.active.iter().copied().map(DerivativeDirection::Error);
        (0..SIZE).map(DerivativeDirection::Tire).chain(causes).collect()
    }

    /// The corners of the box.
    pub fn box_corners(&self, bounds: &Bounds) -> [DVector<f64>; 2] {
        let [lower, upper] = box_corners(bounds);
        let n = SIZE + self.active.len();
        let mut corners = [lower.resize_vertically(n, -REACH), upper.resize_vertically(n, REACH)];
        for (i, cause) in self.active.iter().enumerate() {
            if SystematicError::TIRES.contains(cause) {
                corners[0][SIZE + i] = SHORTEST / cause.describe().std;
            }
            if SystematicError::LOW_PASSES.contains(cause) {
                corners[0][SIZE + i] = 0.0;
            }
        }
        corners
    }

    /// Precision of a cause before any data, in its usual standard deviations.
    pub fn prior_precision(&self, cause: SystematicError) -> f64 {
        (cause.describe().std / self.std[cause]).powi(2)
    }

    fn prior_cost(&self, x: &DVector<f64>) -> f64 {
        let of_cause =
            |(i, cause): (usize, &SystematicError)| self.prior_precision(*cause) * x[SIZE + i].powi(2);
        let causes: f64 = self.active.iter().enumerate().map(of_cause).sum();
        self.expected.cost(&from_vector(x)) + 0.5 * causes
    }

    /// Adds what was known before any data to a model of the likelihood.
    pub fn add_prior(&self, x: &DVector<f64>, model: &mut QuadraticModel) {
        self.expected.add_to_model(x, model);
        for (i, cause) in self.active.iter().enumerate() {
            let (index, precision) = (SIZE + i, self.prior_precision(*cause));
            model.cost += 0.5 * precision * x[index] * x[index];
            model.gradient[index] += precision * x[index];
            model.hessian[(index, index)] += precision;
        }
    }
}

impl Objective for JointPosterior<'_> {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let at = self.unknowns_at(x);
        let samples = self.likelihood.sample_count();
        let mut model = if self.active.is_empty() {
            self.likelihood.evaluate_by_tires(&at).to_sqp_model(samples)
        } else {
            self.likelihood
                .residual_rows(&at, &self.variable_directions())
                .total_expansion()
                .into_sqp_model(samples)
        };
        self.add_prior(x, &mut model);
        model
    }

    fn cost(&self, x: &DVector<f64>) -> f64 {
        self.likelihood.cost(&self.unknowns_at(x)) + self.prior_cost(x)
    }

    fn costs(&self, points: &[DVector<f64>]) -> Vec<f64> {
        let batch = |points: &[DVector<f64>]| -> Vec<f64> {
            // What is missing in the last ones is filled up.
            let all = std::array::from_fn(|index| {
                let x = &points[index.min(points.len() - 1)];
                (from_vector(x), self.systematic_errors_at(x))
            });
            let costs = self.likelihood.costs(&all, &self.noise);
            points.iter().zip(costs).map(|(x, cost)| cost + self.prior_cost(x)).collect()
        };
        points.par_chunks(WIDTH).flat_map_iter(batch).collect()
    }
}

/// Cost of tires alone, with causes that follow them as their conditional mean does: `−ln` of the posterior with the causes
/// integrated out, as far as they are normal given the tires, and their mean is linear in [`UnboundedCoordinates`].
pub struct MarginalPosterior<'a> {
    joint: &'a JointPosterior<'a>,
    best: DVector<f64>,
    coordinates: UnboundedCoordinates,
    /// By how much the causes follow each coordinate, less the sign: `H_φφ⁻¹ H_φz`.
    follow: DMatrix<f64>,
}

impl<'a> MarginalPosterior<'a> {
    /// About a minimum in a box, with its second derivatives.
    pub fn new(
        joint: &'a JointPosterior<'a>,
        best: &DVector<f64>,
        hessian: &DMatrix<f64>,
        corners: &[DVector<f64>; 2],
    ) -> Self {
        let n = joint.active.len();
        let coordinates = UnboundedCoordinates::new(corners, &from_vector(best));
        let by_z = coordinates.jacobian(&coordinates.z_from_tires(&from_vector(best)));
        let given = inverse_hessian(&hessian.view((SIZE, SIZE), (n, n)).into_owned());
        let follow = given * hessian.view((SIZE, 0), (n, SIZE)) * by_z;
        Self { joint, best: best.clone(), coordinates, follow }
    }

    /// The minimum with its surroundings.
    pub fn laplace_approximation(
        &self,
        minimum: &SqpMinimum,
        corners: [DVector<f64>; 2],
    ) -> LaplaceApproximation<'_> {
        let x = minimum.x.rows(0, SIZE).into_owned();
        let information = self.marginal_hessian(&x, &minimum.model.hessian);
        LaplaceApproximation { objective: self, x, cost: minimum.model.cost, information, corners }
    }

    /// The point with the causes that follow some tires.
    pub fn with_conditional_errors(&self, theta: &DVector<f64>) -> DVector<f64> {
        let z = |x: &DVector<f64>| self.coordinates.z_from_tires(&from_vector(x));
        let moved = z(theta) - z(&self.best);
        let causes = self.best.rows(SIZE, self.joint.active.len()) - &self.follow * moved;
        DVector::from_iterator(self.best.len(), theta.iter().chain(causes.iter()).copied())
    }

    /// By how much the causes follow each parameter, less the sign.
    fn by_tires(&self, theta: &DVector<f64>) -> DMatrix<f64> {
        let by_z = self.coordinates.jacobian(&self.coordinates.z_from_tires(&from_vector(theta)));
        &self.follow * by_z.try_inverse().unwrap_or_else(|| DMatrix::zeros(SIZE, SIZE))
    }

    /// Second derivatives by the tires with the causes following, from those by all.
    pub fn marginal_hessian(&self, theta: &DVector<f64>, hessian: &DMatrix<f64>) -> DMatrix<f64> {
        let (n, follow) = (self.joint.active.len(), self.by_tires(theta));
        let cross = hessian.view((0, SIZE), (SIZE, n));
        let causes = hessian.view((SIZE, SIZE), (n, n));
        hessian.view((0, 0), (SIZE, SIZE)) - cross * &follow - follow.tr_mul(&cross.transpose())
            + follow.tr_mul(&(causes * &follow))
    }
}

impl Objective for MarginalPosterior<'_> {
    fn model(&self, theta: &DVector<f64>) -> QuadraticModel {
        let joint = self.joint.model(&self.with_conditional_errors(theta));
        let n = self.joint.active.len();
        let [tires, others] = [joint.gradient.rows(0, SIZE), joint.gradient.rows(SIZE, n)];
        // By the chain rule along the causes that follow.
        QuadraticModel {
            cost: joint.cost,
            gradient: tires - self.by_tires(theta).tr_mul(&others),
            hessian: self.marginal_hessian(theta, &joint.hessian),
            scale: joint.scale,
        }
    }

    fn cost(&self, theta: &DVector<f64>) -> f64 {
        self.joint.cost(&self.with_conditional_errors(theta))
    }

    fn costs(&self, points: &[DVector<f64>]) -> Vec<f64> {
        let all: Vec<_> = points.iter().map(|theta| self.with_conditional_errors(theta)).collect();
        self.joint.costs(&all)
    }
}

/// Cost of noises, given all else: logarithms of the standard deviations of sensors, variances of the process, and correlation
/// and share of what lasts of the sensors' noises.
pub struct NoisePosterior<'a> {
    /// The likelihood.
    pub likelihood: &'a DriveLikelihood,
    /// What is held; of its noises only the channels that last are used.
    pub given: DriveUnknowns,
}

impl NoisePosterior<'_> {
    /// Channels of which some noise lasts.
    pub fn coloured_channels(&self) -> impl Iterator<Item = usize> + '_ {
        (0..4).filter(|i| self.given.noise.coloured[*i].share > 0.0)
    }

    /// The noises at a point.
    pub fn noise_at(&self, x: &DVector<f64>) -> DriveNoise {
        let mut coloured = [ColouredNoise::WHITE; 4];
        for (place, i) in self.coloured_channels().enumerate() {
            let index = SIZE + 2 * place;
            coloured[i] = ColouredNoise { correlation: x[index], share: x[index + 1] };
        }
        DriveNoise {
            sensor: std::array::from_fn(|i| x[i].exp()),
            process: std::array::from_fn(|i| x[4 + i].sqrt()),
            coloured,
        }
    }

    /// The point of some noises.
    pub fn x_from_noise(&self, noise: &DriveNoise) -> DVector<f64> {
        let sensor = noise.sensor.iter().map(|std| std.ln());
        let process = noise.process.iter().map(|std| std * std);
        let coloured = self.coloured_channels().map(|i| noise.coloured[i]);
        let coloured = coloured.flat_map(|it| [it.correlation, it.share]);
        DVector::from_vec(sensor.chain(process).chain(coloured).collect())
    }
}

impl Objective for NoisePosterior<'_> {
    fn model(&self, x: &DVector<f64>) -> QuadraticModel {
        let at = DriveUnknowns { noise: self.noise_at(x), ..self.given };
        let samples = self.likelihood.sample_count();
        if x.len() == SIZE {
            return self.likelihood.evaluate_by_noise(&at).to_sqp_model(samples);
        }
        let of_channel = |i| [DerivativeDirection::Correlation(i), DerivativeDirection::LastingShare(i)];
        let colours = self.coloured_channels().flat_map(of_channel);
        let directions: Vec<_> = (0..SIZE).map(DerivativeDirection::Noise).chain(colours).collect();
        self.likelihood.residual_rows(&at, &directions).total_expansion().into_sqp_model(samples)
    }
}
