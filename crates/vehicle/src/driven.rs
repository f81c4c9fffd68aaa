//! Finds the slip at which a tire transmits a longitudinal force, for cars that know no wheel speeds.
#![allow(non_snake_case, reason = "forces are written as in the equations")]

use tire::{Number, Tire, TireForces, TireOperatingPoint, TireSet};

/// Longitudinal slip [-] that a tire is never given more of: beyond it a wheel locks or spins.
pub(crate) const MOST_SLIP: f64 = 0.2;

/// Steps of the secant method; its order is 1.6.
const SECANTS: usize = 7;

/// The secant method for the slip of a force. It carries derivatives along, which are exact one step after the slip is.
struct SlipSecantSearch<T> {
    /// The force [N].
    F_x: T,
    /// The slip [-] that is tried next.
    kappa: T,
    /// The slip before, and by how much its force was too large [N].
    before: (T, T),
    /// Whether another slip makes nothing better.
    is_over: bool,
}

impl<T: Number> SlipSecantSearch<T> {
    /// Begins with what the tire transmits without slip.
    #[inline]
    fn new(F_x: T, slip: &TireOperatingPoint<T>, free: T) -> Self {
        // A force from a hundredth of slip gives the stiffness: all tires have their peak far beyond it.
        let kappa: T = if F_x > 0.0 { 0.01.into() } else { (-0.01).into() };
        let is_over = F_x == 0.0 || slip.F_z <= 0.0;
        Self { F_x, kappa, before: (T::zero(), free - F_x), is_over }
    }

    /// Goes on from the force that the slip has.
    #[inline]
    fn update_slip(&mut self, force: T) {
        let miss = force - self.F_x;
        let (dk, df) = (self.kappa - self.before.0, miss - self.before.1);
        // Past the peak, or on the spot: there is no better slip.
        if df.re() * dk.re() <= 1e-12 * (df.re() * df.re()).max(f64::MIN_POSITIVE) {
            self.is_over = true;
            return;
        }
        self.before = (self.kappa, miss);
        let kappa = self.kappa - miss * dk / df;
        self.kappa = if kappa > MOST_SLIP {
            MOST_SLIP.into()
        } else if kappa < -MOST_SLIP {
            (-MOST_SLIP).into()
        } else {
            kappa
        };
    }
}

/// Forces [N] of a tire that transmits the longitudinal force `F_x` [N], or as much of it as it can at [`MOST_SLIP`].
#[inline]
pub(crate) fn tire_forces_for_F_x<T: Number>(
    tire: &impl Tire<T>,
    slip: TireOperatingPoint<T>,
    F_x: T,
) -> [T; 2] {
    let mut forces = tire.F_xy(&slip);
    let mut search = SlipSecantSearch::new(F_x, &slip, forces[0]);
    for _ in 0..=SECANTS {
        if search.is_over {
            break;
        }
        forces = tire.F_xy(&TireOperatingPoint { kappa: search.kappa, ..slip });
        search.update_slip(forces[0]);
    }
    forces
}

/// The same of all four tires of a car, which answer together; `free` is what they do without slip.
#[inline]
pub(crate) fn all_tire_forces_for_F_x<T: Number>(
    tires: &impl TireSet<T>,
    slips: &[TireOperatingPoint<T>; 4],
    F_x: [T; 4],
    free: &[TireForces<T>; 4],
) -> [[T; 2]; 4] {
    let mut found = free.each_ref().map(|it| [it.F_x, it.F_y]);
    let mut searches: [_; 4] = std::array::from_fn(|i| SlipSecantSearch::new(F_x[i], &slips[i], free[i].F_x));
    for _ in 0..=SECANTS {
        if searches.iter().all(|it| it.is_over) {
            break;
        }
        let tried = std::array::from_fn(|i| TireOperatingPoint { kappa: searches[i].kappa, ..slips[i] });
        let forces = tires.forces(&tried);
        for ((search, it), found) in searches.iter_mut().zip(&forces).zip(&mut found) {
            if !search.is_over {
                *found = [it.F_x, it.F_y];
                search.update_slip(it.F_x);
            }
        }
    }
    found
}
