//! Turns forces and moments of TYDEX's C and H axes, which are at the centre of the wheel, into W axes at the contact.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

/// Axes of TYDEX: x forward, y left, z up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TydexAxes {
    /// At the contact; z is normal to the road.
    W,
    /// At the centre of the wheel, parallel to W.
    H,
    /// At the centre of the wheel, leaning with it: y is its axis.
    C,
}

/// F_x, F_y, F_z [N], M_y and M_z [N m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wrench {
    pub F: [f64; 3],
    pub M_y: f64,
    pub M_z: f64,
}

impl Wrench {
    /// The same in W axes. `gamma` is the camber [rad], `radius` the distance from the contact to the centre in the plane of the wheel [m].
    pub fn moved_to_contact(self, axes: TydexAxes, gamma: f64, radius: f64) -> Self {
        let (sin, cos) = gamma.sin_cos();
        let mut turned = self;
        if axes == TydexAxes::C {
            let [F_x, F_y, F_z] = self.F;
            turned.F = [F_x, F_y * cos - F_z * sin, F_y * sin + F_z * cos];
            // M_x turns along with M_y; nothing here needs it.
            turned.M_z = self.M_y * sin + self.M_z * cos;
        }
        if axes != TydexAxes::W {
            // The centre is at R (0, -sin γ, cos γ) from the contact; the moment of the force is that crossed with it.
            turned.M_z += radius * sin * turned.F[0];
            turned.M_y += radius * cos * turned.F[0];
        }
        turned
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_at_the_contact_is_found_again_from_the_centre_of_a_leaning_wheel() {
        let (gamma, R) = (0.1f64, 0.3);
        let (sin, cos) = gamma.sin_cos();
        let F = [500.0, -800.0, 3000.0];
        let (M_y, M_z) = (-20.0, 15.0);
        // Moments about the centre: those about the contact less d x F with d = R (0, -sin, cos), M_x included.
        let M_H = [7.0 - (-R * sin * F[2] - R * cos * F[1]), M_y - R * cos * F[0], M_z - R * sin * F[0]];
        let found = Wrench { F, M_y: M_H[1], M_z: M_H[2] }.moved_to_contact(TydexAxes::H, gamma, R);
        assert!((found.M_z - M_z).abs() < 1e-12 && (found.M_y - M_y).abs() < 1e-12, "{found:?}");
        // Leaning axes: turned by -gamma about x.
        let leaning = |v: [f64; 3]| [v[0], v[1] * cos + v[2] * sin, -v[1] * sin + v[2] * cos];
        let M = leaning(M_H);
        let found = Wrench { F: leaning(F), M_y: M[1], M_z: M[2] }.moved_to_contact(TydexAxes::C, gamma, R);
        assert!((found.M_z - M_z).abs() < 1e-12, "{found:?}");
        assert!(found.F.iter().zip(F).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
        let same = Wrench { F, M_y, M_z };
        assert_eq!(same.moved_to_contact(TydexAxes::W, gamma, R), same);
    }
}
