//! Asks four tires of the Magic Formula side by side, in the vectors of the processor.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use elementary::NumberGroup;
use pulp::{Arch, NullaryFnOnce, Simd};

use super::MfTire;
use crate::coefficients::KEYS;
use crate::lanes::SimdLanes;
use crate::set::TireSet;
use crate::slip::{TireForces, TireOperatingPoint};

/// The tires of a car by the Magic Formula: four wheels take hardly longer than one.
///
/// Its forces are those of [`MfTire`] but for rounding, and have the same bits on all processors.
#[derive(Clone, Debug)]
pub struct MfSet {
    axles: [MfTire; 2],
    vectors: Option<SimdTires>,
}

/// The tires in vectors of the processor; none for axles of different versions or readings.
#[derive(Clone, Debug)]
enum SimdTires {
    /// All wheels in one vector.
    #[cfg(target_arch = "x86_64")]
    Four(pulp::x86::V3, Box<MfTire<SimdLanes<pulp::x86::V3>>>),
    /// Each wheel for itself.
    One(pulp::Scalar, Box<[MfTire<SimdLanes<pulp::Scalar>>; 2]>),
}

impl From<[MfTire; 2]> for MfSet {
    fn from(axles: [MfTire; 2]) -> Self {
        let [front, rear] = &axles;
        let same = front.coefficients.version == rear.coefficients.version && front.reading == rear.reading;
        let vectors = same.then(|| match Arch::new() {
            #[cfg(target_arch = "x86_64")]
            Arch::V4(simd) => SimdTires::with_four_lanes(*simd, &axles),
            #[cfg(target_arch = "x86_64")]
            Arch::V3(simd) => SimdTires::with_four_lanes(simd, &axles),
            _ => SimdTires::with_one_lane(&axles),
        });
        Self { axles, vectors }
    }
}

impl SimdTires {
    #[cfg(target_arch = "x86_64")]
    fn with_four_lanes(simd: pulp::x86::V3, [front, rear]: &[MfTire; 2]) -> Self {
        Self::Four(simd, Box::new(join_tires_in_lanes(simd, [front, front, rear, rear])))
    }

    fn with_one_lane(axles: &[MfTire; 2]) -> Self {
        let simd = pulp::Scalar::new();
        Self::One(simd, Box::new(axles.each_ref().map(|tire| join_tires_in_lanes(simd, [tire]))))
    }

    #[inline]
    fn wheel_forces(&self, slips: &[TireOperatingPoint; 4]) -> [TireForces; 4] {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Four(simd, tire) => simd.vectorize(SimdForceEvaluation { simd: *simd, tire, slips }),
            Self::One(simd, axles) => {
                let [front, rear] = &**axles;
                let [fl, fr, rl, rr] = slips.each_ref().map(std::array::from_ref);
                let ask = |tire, slips| SimdForceEvaluation { simd: *simd, tire, slips }.call();
                let all = [ask(front, fl), ask(front, fr), ask(rear, rl), ask(rear, rr)];
                all.map(|[forces]: [TireForces; 1]| forces)
            }
        }
    }
}

/// As many tires as the vectors of `S` have places, as one.
fn join_tires_in_lanes<S: Simd, const N: usize>(simd: S, tires: [&MfTire; N]) -> MfTire<SimdLanes<S>> {
    let mut coefficients = tires[0].coefficients.map(|value| SimdLanes::new(simd, |_| value));
    for key in KEYS {
        let places = SimdLanes::new(simd, |i| key.get(&tires[i].coefficients));
        key.set(&mut coefficients, places);
    }
    MfTire::from_checked_coefficients(coefficients, tires[0].reading)
}

/// A question to as many tires as the vectors of `S` have places.
struct SimdForceEvaluation<'a, S: Simd, const N: usize> {
    simd: S,
    tire: &'a MfTire<SimdLanes<S>>,
    slips: &'a [TireOperatingPoint; N],
}

impl<S: Simd, const N: usize> SimdForceEvaluation<'_, S, N> {
    #[inline(always)]
    fn slip_in_lanes(&self) -> TireOperatingPoint<SimdLanes<S>> {
        let slips = self.slips;
        let all = |of: fn(&TireOperatingPoint) -> f64| SimdLanes::new(self.simd, |i| of(&slips[i]));
        let own = &self.tire.coefficients.INFLPRES;
        let pressure = |i: usize| slips[i].pressure.unwrap_or(own.lane_values()[i]);
        TireOperatingPoint {
            kappa: all(|slip| slip.kappa),
            alpha: all(|slip| slip.alpha),
            gamma: all(|slip| slip.gamma),
            F_z: all(|slip| slip.F_z),
            v_x: all(|slip| slip.v_x),
            pressure: Some(SimdLanes::new(self.simd, pressure)),
            mu: all(|slip| slip.mu),
        }
    }
}

impl<S: Simd, const N: usize> NullaryFnOnce for SimdForceEvaluation<'_, S, N> {
    type Output = [TireForces; N];

    #[inline(always)]
    fn call(self) -> [TireForces; N] {
        let (TireForces { F_x, F_y, M_x, M_y, M_z }, _) = self.tire.forces_and_details(&self.slip_in_lanes());
        std::array::from_fn(|i| TireForces {
            F_x: F_x.lane_values()[i],
            F_y: F_y.lane_values()[i],
            M_x: M_x.lane_values()[i],
            M_y: M_y.lane_values()[i],
            M_z: M_z.lane_values()[i],
        })
    }
}

impl TireSet<f64> for MfSet {
    type Tire = MfTire;

    #[inline]
    fn axle_tires(&self) -> [&MfTire; 2] {
        self.axles.each_ref()
    }

    #[inline]
    fn slip_angles(&self, tangents: [f64; 4]) -> [f64; 4] {
        elementary::atan(NumberGroup(tangents)).0
    }

    #[inline]
    fn forces(&self, slips: &[TireOperatingPoint; 4]) -> [TireForces; 4] {
        match &self.vectors {
            Some(vectors) => vectors.wheel_forces(slips),
            None => self.axles.forces(slips),
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    use super::*;
    use crate::{Coefficients, MagicFormulaVersion, Tire};

    fn slips() -> impl Strategy<Value = TireOperatingPoint> {
        let speeds = prop_oneof![Just(0.0), -2.0..2.0f64, -60.0..60.0f64];
        let loads = prop_oneof![Just(0.0), -10.0..100.0f64, 100.0..20e3f64];
        let pressure = proptest::option::of(5e4..4e5f64);
        (-2.0..2.0f64, -1.6..1.6f64, -0.6..0.6f64, loads, speeds, pressure, 0.0..1.5f64).prop_map(
            |(kappa, alpha, gamma, F_z, v_x, pressure, mu)| TireOperatingPoint {
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

    fn set(version: MagicFormulaVersion) -> MfSet {
        let front = Coefficients { version, ..Coefficients::sports_tire() };
        let rear = Coefficients { LMUY: 1.1, LKX: 0.8, ..front };
        [front, rear].map(|it| MfTire::new(it).expect("a tire")).into()
    }

    proptest! {
        #[test]
        fn four_wheels_have_the_forces_of_each(slips in [slips(), slips(), slips(), slips()]) {
            for version in [MagicFormulaVersion::Mf52, MagicFormulaVersion::Pac2002, MagicFormulaVersion::Mf61, MagicFormulaVersion::Mf62] {
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
        let set = set(MagicFormulaVersion::Mf62);
        let at = |i: usize| TireOperatingPoint {
            kappa: 0.013 * i as f64 - 0.7,
            alpha: 0.3 - 0.007 * i as f64,
            gamma: 0.02,
            F_z: 40.0 * i as f64,
            v_x: 0.2 * i as f64,
            ..TireOperatingPoint::default()
        };
        let one = SimdTires::with_one_lane(&set.axles);
        for i in 0..100 {
            let slips = [at(i), at(i + 1), at(2 * i), at(3 * i)];
            assert_eq!(set.forces(&slips), one.wheel_forces(&slips));
        }
    }

    #[test]
    fn axles_of_different_versions_are_asked_one_by_one() {
        let tire = |version| MfTire::new(Coefficients { version, ..Coefficients::sports_tire() });
        let axles =
            [MagicFormulaVersion::Mf52, MagicFormulaVersion::Mf62].map(|it| tire(it).expect("a tire"));
        let set = MfSet::from(axles);
        let slip = TireOperatingPoint { alpha: 0.1, F_z: 3000.0, v_x: 20.0, ..TireOperatingPoint::default() };
        let [fl, _, rl, _] = set.forces(&[slip; 4]);
        assert_eq!((fl, rl), (axles[0].forces(&slip), axles[1].forces(&slip)));
    }
}
