//! Exports a mass on a spring and a damper: a complete FMU.
#![allow(non_snake_case, reason = "symbols as in mechanics")]

use fmu_export::*;

/// A mass that a force moves against a spring and a damper.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
struct SpringDamper {
    m: f64,
    k: f64,
    d: f64,
    F: f64,
    x: f64,
    v: f64,
    a: f64,
}

impl Default for SpringDamper {
    fn default() -> Self {
        SpringDamper { m: 1.0, k: 100.0, d: 2.0, F: 0.0, x: 0.1, v: 0.0, a: 0.0 }
    }
}

impl Equations<1, 1> for SpringDamper {
    const KNOWN: [&str; 1] = ["F"];
    const UNKNOWN: [&str; 1] = ["a"];
    fn equations<T: Number>(&self, [F]: [T; 1]) -> [T; 1] {
        [(F - self.k * self.x - self.d * self.v) / self.m]
    }
}

impl Model for SpringDamper {
    const INFO: Info = Info::new("spring_damper", "A mass on a spring and a damper", 0.01).stop(10.0);
    const VARIABLES: &'static [Variable<Self>] = &[
        parameter("m", "kg", "Mass").min(1e-3).at(|s| &mut s.m),
        parameter("k", "N/m", "Stiffness of the spring").min(0.0).at(|s| &mut s.k),
        parameter("d", "N.s/m", "Damping").min(0.0).tunable().at(|s| &mut s.d),
        input("F", "N", "Force on the mass").at(|s| &mut s.F),
        output("x", "m", "Position").exact().depends_on(&[]).at(|s| &mut s.x),
        output("v", "m/s", "Speed").exact().depends_on(&[]).at(|s| &mut s.v),
        output("a", "m/s2", "Acceleration").at(|s| &mut s.a),
    ];
    const DERIVATIVES: Option<EquationDerivatives<Self>> = Some(EquationDerivatives::of());

    fn step(&mut self, _time: f64, step: f64) -> Result<(), ModelError> {
        // Semi-implicit Euler: the oscillation neither grows nor decays by the method alone. Sub-steps
        // of at most 1 ms are far below the period of a spring that is used with a step of 10 ms.
        let n = (step / 1e-3).ceil();
        for _ in 0..n as u32 {
            [self.a] = self.equations([self.F]);
            self.v += self.a * step / n;
            self.x += self.v * step / n;
        }
        Ok(())
    }

    fn compute_outputs(&mut self) {
        [self.a] = self.equations([self.F]);
    }
}

export!(SpringDamper);
