//! Sums of squares of the three relations of the motion, each with what the systematic errors of a log add to it.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use super::log_errors::{CONSTANT, LOG_ERRORS, effect_column};
use super::terms::{MotionRelation, SmoothedSignals};
use crate::blocks::{BlockNormalEquations, UsualRows, assign_rows_to_blocks, drop_outlier_rows};
use crate::case::ExaminedLog;
use crate::statistics::quantile;

/// Share of the highest lateral acceleration below which slip goes with force, but for its cube.
const LINEAR: f64 = 0.6;
/// Share of the usual top speed below which rows do not count.
const SLOWEST: f64 = 0.2;
/// Ranges of speed in each of which it is asked which forces are reached.
const SPEEDS: u32 = 8;
/// Fewest rows of a relation.
const LEAST_ROWS: usize = 400;

const RELATIONS: [MotionRelation; 3] =
    [MotionRelation::RigidBody, MotionRelation::Rear, MotionRelation::Front];
/// Columns of an axle that the car decides: force, its cube, its change with speed and with the load that braking moves, yaw
/// acceleration, distance to the axle; then those of rival explanations.
const PER_AXLE: usize = 11;
/// Place of the distance to the axle, and of the first rival.
const DISTANCE: usize = 5;
const FIRST_RIVAL: usize = 6;
/// Columns before those of the causes.
pub(super) const NUISANCES: usize = 2 * PER_AXLE;

/// The sums of one relation.
pub(super) struct RelationNormalEquations {
    pub relation: MotionRelation,
    /// Columns: those that the car decides, then those of the causes.
    pub blocks: BlockNormalEquations,
    /// Columns of its own that are fitted with the causes.
    pub own: Vec<usize>,
    /// Columns of its own by which the tires may explain what looks like an error: downforce to second order, a curve that
    /// bends more and with speed, inertia.
    pub rivals: Vec<usize>,
}

impl SmoothedSignals {
    /// Sums of all relations that the log has the channels for.
    /// `known` are errors, by their index, with which rows are told that no fit explains.
    pub fn all_normal_equations(
        &self,
        case: &ExaminedLog,
        known: &[(usize, f64)],
    ) -> Vec<RelationNormalEquations> {
        self.normal_equations_of_rows(case, known, |_| true)
    }

    /// The same in some rows only.
    pub fn normal_equations_of_rows(
        &self,
        case: &ExaminedLog,
        known: &[(usize, f64)],
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<RelationNormalEquations> {
        let split = self.split_into_blocks(wanted);
        RELATIONS
            .into_iter()
            .filter_map(|relation| self.relation_normal_equations(case, relation, &split, known))
            .collect()
    }

    /// Those of the motion of a rigid body alone, in all rows.
    pub fn rigid_body_normal_equations(&self, case: &ExaminedLog) -> Option<RelationNormalEquations> {
        let split = self.split_into_blocks(|_| true);
        self.relation_normal_equations(case, MotionRelation::RigidBody, &split, &[])
    }

    /// The block of each row that is wanted and in which the car drives.
    fn split_into_blocks(&self, wanted: impl Fn(usize) -> bool) -> Vec<Option<usize>> {
        let top = quantile(self.v_x[0].iter().copied(), 0.95);
        // Slow turns tell lengths and scales best.
        let moves = |(k, v_x): (usize, &f64)| *v_x > SLOWEST * top && wanted(k);
        let moves: Vec<bool> = self.v_x[0].iter().enumerate().map(moves).collect();
        assign_rows_to_blocks(&moves)
    }

    fn relation_normal_equations(
        &self,
        case: &ExaminedLog,
        relation: MotionRelation,
        split: &[Option<usize>],
        known: &[(usize, f64)],
    ) -> Option<RelationNormalEquations> {
        let rows = self.v_x[0].len();
        let arm = case.car.axles.map(|[l_f, l_r]| if relation == MotionRelation::Front { l_f } else { l_r });
        let target = self.relation_residual(relation, arm);
        let lightness = self.load_ratios(relation, case);
        let force = self.force_per_mass(relation, case, &lightness);
        let top = self.force_reached_by_speed(&force);
        // The mean of F³ while F moves by a standard deviation s within the filter is F³ + 3 F s².
        let reach = |k: usize| force[k].hypot(3.0_f64.sqrt() * self.quick[k]);
        let linear = |k: usize| relation == MotionRelation::RigidBody || reach(k) < LINEAR * top[k];
        let nuisances = self.nuisance_columns(force.clone(), &lightness);
        let first = match relation {
            MotionRelation::RigidBody => None,
            MotionRelation::Rear => Some(0),
            MotionRelation::Front => Some(PER_AXLE),
        };
        let own: Vec<usize> = match (first, arm) {
            (None, _) => Vec::new(),
            (Some(first), Some(_)) => (first..first + DISTANCE).collect(),
            (Some(first), None) => (first..=first + DISTANCE).collect(),
        };
        let rivals: Vec<usize> =
            first.map_or(Vec::new(), |first| (first + FIRST_RIVAL..first + PER_AXLE).collect());
        let mut used: Vec<_> = (0..rows).map(|k| split[k].filter(|_| linear(k))).collect();
        if first.is_some() {
            // Past its peak an axle has little force at much slip.
            let one = vec![1.0; rows];
            let columns = own.iter().map(|column| &nuisances[column % PER_AXLE][..]);
            let mut right = target.clone();
            let no_compliance = vec![0.0; rows];
            for &(index, value) in known {
                if let Some(column) = effect_column(LOG_ERRORS[index], relation, self, &no_compliance, arm) {
                    right.iter_mut().zip(&column).for_each(|(right, error)| *right -= value * error);
                }
            }
            let columns: Vec<&[f64]> = columns.chain([&one[..]]).collect();
            used = drop_outlier_rows(&columns, &right, &used, UsualRows::LargeTargets);
        }
        let sums = |at_rest: f64| {
            let compliance: Vec<f64> = lightness.iter().map(|ratio| at_rest * ratio).collect();
            let mut columns: Vec<Option<&[f64]>> = vec![None; NUISANCES];
            for &column in own.iter().chain(&rivals) {
                columns[column] = Some(&nuisances[column % PER_AXLE]);
            }
            let causes = LOG_ERRORS.map(|error| effect_column(error, relation, self, &compliance, arm));
            columns.extend(causes.iter().map(Option::as_deref));
            let mut blocks = BlockNormalEquations::new(columns.len());
            blocks.add_rows(&columns, &target, |k| used[k]);
            blocks
        };
        let mut blocks = sums(0.0);
        if blocks.rows < LEAST_ROWS {
            return None;
        }
        if first.is_some() {
            let alone = blocks.fit_columns(&[&own[..], &[NUISANCES + CONSTANT]].concat())?;
            if relation.is_tire_like(alone.t_value(0)) {
                blocks = sums(alone.values[0].abs());
            }
        }
        Some(RelationNormalEquations { relation, blocks, own, rivals })
    }

    /// What is 0 for true signals, but for the slip that the force of an axle makes.
    fn relation_residual(&self, relation: MotionRelation, arm: Option<f64>) -> Vec<f64> {
        let at = |k: usize| -> f64 {
            let reach = arm.unwrap_or(0.0) * self.curvature[0][k];
            match relation {
                MotionRelation::RigidBody => self.a_y[0][k] - self.turn[0][k] - self.v_y[0][k],
                MotionRelation::Rear => self.sideslip[0][k] - reach,
                MotionRelation::Front => self.delta[0][k] - self.sideslip[0][k] - reach,
            }
        };
        (0..self.v_x[0].len()).map(at).collect()
    }

    /// The load of an axle at rest over that at the speed of each row.
    fn load_ratios(&self, relation: MotionRelation, case: &ExaminedLog) -> Vec<f64> {
        let axle = usize::from(relation == MotionRelation::Rear);
        self.v_x[0].iter().map(|v_x| case.car.load_ratios(*v_x)[axle]).collect()
    }

    /// The force of an axle over the mass that its load carries [m/s²]: a_y + l_f r' in front and a_y − l_r r' in the rear, with
    /// I_zz of about m l_f l_r, at the load at rest.
    fn force_per_mass(&self, relation: MotionRelation, case: &ExaminedLog, lightness: &[f64]) -> Vec<f64> {
        let arm = match (relation, case.car.axles) {
            (MotionRelation::Front, Some([l_f, _])) => l_f,
            (MotionRelation::Rear, Some([_, l_r])) => -l_r,
            _ => 0.0,
        };
        let rows = self.a_y[0].iter().zip(&self.r[1]).zip(lightness);
        rows.map(|((a_y, rate), ratio)| ratio * (a_y + arm * rate)).collect()
    }

    /// The force that is reached at the speed of each row or below it: downforce lets tires carry more at higher speeds, so what is
    /// little there can be all that they carry at lower ones.
    fn force_reached_by_speed(&self, force: &[f64]) -> Vec<f64> {
        let tops: Vec<[f64; 2]> = (1..=SPEEDS)
            .map(|part| {
                let speed = quantile(self.v_x[0].iter().copied(), f64::from(part) / f64::from(SPEEDS));
                let rows = self.v_x[0].iter().zip(force).filter(|(v_x, _)| **v_x <= speed);
                [speed, quantile(rows.map(|(_, force)| force.abs()), 0.98)]
            })
            .collect();
        let mut most = 0.0_f64;
        let rising: Vec<[f64; 2]> = tops
            .into_iter()
            .map(|[speed, top]| {
                most = most.max(top);
                [speed, most]
            })
            .collect();
        let top = |v_x: &f64| rising.iter().find(|[speed, _]| v_x <= speed).map_or(f64::NAN, |it| it[1]);
        self.v_x[0].iter().map(top).collect()
    }

    fn nuisance_columns(&self, force: Vec<f64>, lightness: &[f64]) -> [Vec<f64>; PER_AXLE] {
        let product = |of_force: i32, of_speed: i32| -> Vec<f64> {
            let rows = force.iter().zip(&self.v_x[0]);
            rows.map(|(force, v_x)| force.powi(of_force) * v_x.powi(of_speed)).collect()
        };
        let [cube, with_speed] = [product(3, 0), product(1, 2)];
        let [second_order, bent_with_speed, bent] = [product(1, 4), product(3, 2), product(5, 0)];
        let distance = self.curvature[0].clone();
        let map = |f: &dyn Fn(usize) -> f64| (0..force.len()).map(f).collect::<Vec<f64>>();
        // A moment of inertia that is not m l_f l_r adds yaw acceleration to the force, wherever that goes.
        let yaw = map(&|k| lightness[k] * self.r[1][k]);
        let yaw_with_speed = map(&|k| yaw[k] * self.v_x[0][k].powi(2));
        let yaw_relaxed = map(&|k| lightness[k] * self.r[2][k] / self.v_x[0][k]);
        let load_transfer = map(&|k| lightness[k] * force[k] * self.v_x[1][k]);
        [
            force,
            cube,
            with_speed,
            load_transfer,
            yaw,
            distance,
            second_order,
            bent_with_speed,
            bent,
            yaw_with_speed,
            yaw_relaxed,
        ]
    }
}
