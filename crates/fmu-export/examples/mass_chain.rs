//! Exports three masses in a row with springs between them: an FMU with arrays.
#![allow(non_snake_case, reason = "symbols as in mechanics")]

use fmu_export::*;

/// Masses on a line, the first of which a spring holds at a wall.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
struct MassChain {
    k: f64,
    d: f64,
    m: [f64; 3],
    F: [f64; 3],
    x: [f64; 3],
    v: [f64; 3],
}

impl Default for MassChain {
    fn default() -> Self {
        MassChain { k: 50.0, d: 0.5, m: [1.0, 2.0, 3.0], F: [0.0; 3], x: [0.0; 3], v: [0.0; 3] }
    }
}

const fn position(name: &'static str, description: &'static str) -> VariableRow {
    output(name, "m", description).exact().depends_on(&[])
}

const fn speed(name: &'static str, description: &'static str) -> VariableRow {
    output(name, "m/s", description).exact().depends_on(&[])
}

impl Model for MassChain {
    const INFO: Info = Info::new("mass_chain", "Three masses with springs between them", 0.01).stop(10.0);
    const VARIABLES: &'static [Variable<Self>] = &[
        parameter("k", "N/m", "Stiffness of each spring").min(0.0).at(|s| &mut s.k),
        parameter("d", "N.s/m", "Damping of each spring").min(0.0).at(|s| &mut s.d),
        parameter("m[1]", "kg", "Mass at the wall").min(1e-3).at(|s| &mut s.m[0]),
        parameter("m[2]", "kg", "Mass in the middle").min(1e-3).at(|s| &mut s.m[1]),
        parameter("m[3]", "kg", "Mass at the end").min(1e-3).at(|s| &mut s.m[2]),
        input("F[1]", "N", "Force on a mass").at(|s| &mut s.F[0]),
        input("F[2]", "N", "Force on a mass").at(|s| &mut s.F[1]),
        input("F[3]", "N", "Force on a mass").at(|s| &mut s.F[2]),
        position("x[1]", "Position of a mass").at(|s| &mut s.x[0]),
        position("x[2]", "Position of a mass").at(|s| &mut s.x[1]),
        position("x[3]", "Position of a mass").at(|s| &mut s.x[2]),
        speed("v[1]", "Speed of a mass").at(|s| &mut s.v[0]),
        speed("v[2]", "Speed of a mass").at(|s| &mut s.v[1]),
        speed("v[3]", "Speed of a mass").at(|s| &mut s.v[2]),
    ];

    fn step(&mut self, _time: f64, step: f64) -> Result<(), ModelError> {
        let n = (step / 1e-3).ceil();
        for _ in 0..n as u32 {
            // The force of the spring before each mass; there is none behind the last one.
            let mut springs = [0.0; 4];
            let mut before = (0.0, 0.0);
            for (spring, here) in springs.iter_mut().zip(self.x.into_iter().zip(self.v)) {
                *spring = self.k * (before.0 - here.0) + self.d * (before.1 - here.1);
                before = here;
            }
            for (i, pair) in springs.windows(2).enumerate() {
                self.v[i] += (self.F[i] + pair[0] - pair[1]) / self.m[i] * step / n;
                self.x[i] += self.v[i] * step / n;
            }
        }
        Ok(())
    }
}

export!(MassChain);
