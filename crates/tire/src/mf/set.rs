//! Asks four tires of the Magic Formula side by side, in the vectors of the processor.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use elementary::Group;
use pulp::{Arch, NullaryFnOnce, Simd};

use super::MfTire;
use crate::coefficients::KEYS;
use crate::lanes::Lanes;
use crate::set::TireSet;
use crate::slip::{Forces, Slip};

/// The tires of a car by the Magic Formula: four wheels take hardly longer than one.
///
/// Its forces are those of [`MfTire`] but for rounding, and have the same bits on all processors.
#[derive(Clone, Debug)]
pub struct MfSet {
    axles: [MfTire; 2],
    vectors: Option<Vectors>,
}

/// The tires in vectors of the processor; none for axles of different versions or readings.
#[derive(Clone, Debug)]
enum Vectors {
    /// All wheels in one vector.
    #[cfg(target_arch = "x86_64")]
    Four(pulp::x86::V3, Box<MfTire<Lanes<pulp::x86::V3>>>),
    /// Each wheel for itself.
    One(pulp::Scalar, Box<[MfTire<Lanes<pulp::Scalar>>; 2]>),
}

impl From<[MfTire; 2]> for MfSet {
    fn from(axles: [MfTire; 2]) -> Self {
        let [front, rear] = &axles;
        let same = front.coefficients.version == rear.coefficients.version
            && front.reading == rear.reading;
        let vectors = same.then(|| match Arch::new() {
            #[cfg(target_arch = "x86_64")]
            Arch::V4(simd) => Vectors::four(*simd, &axles),
            #[cfg(target_arch = "x86_64")]
            Arch::V3(simd) => Vectors::four(simd, &axles),
            _ => Vectors::one(&axles),
        });
        Self { axles, vectors }
    }
}

impl Vectors {
    #[cfg(target_arch = "x86_64")]
    fn four(simd: pulp::x86::V3, [front, rear]: &[MfTire; 2]) -> Self {
        Self::Four(simd, Box::new(joined(simd, [front, front, rear, rear])))
    }

    fn one(axles: &[MfTire; 2]) -> Self {
        let simd = pulp::Scalar::new();
        Self::One(simd, Box::new(axles.each_ref().map(|tire| joined(simd, [tire]))))
    }

    #[inline]
    fn forces(&self, slips: &[Slip; 4]) -> [Forces; 4] {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Four(simd, tire) => simd.vectorize(VectorForces { simd: *simd, tire, slips }),
            Self::One(simd, axles) => {
                let [front, rear] = &**axles;
                let [fl, fr, rl, rr] = slips.each_ref().map(std::array::from_ref);
                let ask = |tire, slips| VectorForces { simd: *simd, tire, slips }.call();
                let all = [ask(front, fl), ask(front, fr), ask(rear, rl), ask(rear, rr)];
                all.map(|[forces]: [Forces; 1]| forces)
            }
        }
    }
}

/// As many tires as the vectors of `S` have places, as one.
fn joined<S: Simd, const N: usize>(simd: S, tires: [&MfTire; N]) -> MfTire<Lanes<S>> {
    let mut coefficients = tires[0].coefficients.map(|value| Lanes::new(simd, |_| value));
    for key in KEYS {
        let places = Lanes::new(simd, |i| key.get(&tires[i].coefficients));
        key.set(&mut coefficients, places);
    }
    MfTire::made_of(coefficients, tires[0].reading)
}

/// A question to as many tires as the vectors of `S` have places.
struct VectorForces<'a, S: Simd, const N: usize> {
    simd: S,
    tire: &'a MfTire<Lanes<S>>,
    slips: &'a [Slip; N],
}

impl<S: Simd, const N: usize> VectorForces<'_, S, N> {
    #[inline(always)]
    fn slip(&self) -> Slip<Lanes<S>> {
        let slips = self.slips;
        let all = |of: fn(&Slip) -> f64| Lanes::new(self.simd, |i| of(&slips[i]));
        let own = &self.tire.coefficients.INFLPRES;
        let pressure = |i: usize| slips[i].pressure.unwrap_or(own.places()[i]);
        Slip {
            kappa: all(|slip| slip.kappa),
            alpha: all(|slip| slip.alpha),
            gamma: all(|slip| slip.gamma),
            F_z: all(|slip| slip.F_z),
            v_x: all(|slip| slip.v_x),
            pressure: Some(Lanes::new(self.simd, pressure)),
            mu: all(|slip| slip.mu),
        }
    }
}

impl<S: Simd, const N: usize> NullaryFnOnce for VectorForces<'_, S, N> {
    type Output = [Forces; N];

    #[inline(always)]
    fn call(self) -> [Forces; N] {
        let (Forces { F_x, F_y, M_x, M_y, M_z }, _) = self.tire.details(&self.slip());
        std::array::from_fn(|i| Forces {
            F_x: F_x.places()[i],
            F_y: F_y.places()[i],
            M_x: M_x.places()[i],
            M_y: M_y.places()[i],
            M_z: M_z.places()[i],
        })
    }
}

impl TireSet<f64> for MfSet {
    type Tire = MfTire;

    #[inline]
    fn axles(&self) -> [&MfTire; 2] {
        self.axles.each_ref()
    }

    #[inline]
    fn slip_angles(&self, tangents: [f64; 4]) -> [f64; 4] {
        elementary::atan(Group(tangents)).0
    }

    #[inline]
    fn forces(&self, slips: &[Slip; 4]) -> [Forces; 4] {
        match &self.vectors {
            Some(vectors) => vectors.forces(slips),
            None => self.axles.forces(slips),
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;
    use crate::{Coefficients, Tire, Version};

    fn slips() -> impl Strategy<Value = Slip> {
        let speeds = prop_oneof![Just(0.0), -2.0..2.0f64, -60.0..60.0f64];
        let loads = prop_oneof![Just(0.0), -10.0..100.0f64, 100.0..20e3f64];
        let pressure = proptest::option::of(5e4..4e5f64);
        (-2.0..2.0f64, -1.6..1.6f64, -0.6..0.6f64, loads, speeds, pressure, 0.0..1.5f64).prop_map(
            |(kappa, alpha, gamma, F_z, v_x, pressure, mu)| Slip {
                kappa,
                alpha,
                gamma,
                F_z,
                v_x,
                pressure,
                mu,
            },
        )
    }

    fn set(version: Version) -> MfSet {
        let front = Coefficients { version, ..Coefficients::sports_tire() };
        let rear = Coefficients { LMUY: 1.1, LKX: 0.8, ..front };
        [front, rear].map(|it| MfTire::new(it).expect("a tire")).into()
    }

    proptest! {
        #[test]
        fn four_wheels_have_the_forces_of_each(slips in [slips(), slips(), slips(), slips()]) {
            for version in [Version::Mf52, Version::Pac2002, Version::Mf61, Version::Mf62] {
                let set = set(version);
                let one_by_one = set.axles.forces(&slips);
                for (found, expected) in set.forces(&slips).into_iter().zip(one_by_one) {
                    for (found, expected) in [
                        (found.F_x, expected.F_x),
                        (found.F_y, expected.F_y),
                        (found.M_x, expected.M_x),
                        (found.M_y, expected.M_y),
                        (found.M_z, expected.M_z),
                    ] {
                        assert_relative_eq!(found, expected, max_relative = 1e-11, epsilon = 1e-9);
                    }
                }
            }
        }
    }

    #[test]
    fn all_processors_give_the_same_bits() {
        let set = set(Version::Mf62);
        let at = |i: usize| Slip {
            kappa: 0.013 * i as f64 - 0.7,
            alpha: 0.3 - 0.007 * i as f64,
            gamma: 0.02,
            F_z: 40.0 * i as f64,
            v_x: 0.2 * i as f64,
            ..Slip::default()
        };
        let one = Vectors::one(&set.axles);
        for i in 0..100 {
            let slips = [at(i), at(i + 1), at(2 * i), at(3 * i)];
            assert_eq!(set.forces(&slips), one.forces(&slips));
        }
    }

    #[test]
    fn axles_of_different_versions_are_asked_one_by_one() {
        let tire = |version| MfTire::new(Coefficients { version, ..Coefficients::sports_tire() });
        let axles = [Version::Mf52, Version::Mf62].map(|it| tire(it).expect("a tire"));
        let set = MfSet::from(axles);
        let slip = Slip { alpha: 0.1, F_z: 3000.0, v_x: 20.0, ..Slip::default() };
        let [fl, _, rl, _] = set.forces(&[slip; 4]);
        assert_eq!((fl, rl), (axles[0].forces(&slip), axles[1].forces(&slip)));
    }
}
