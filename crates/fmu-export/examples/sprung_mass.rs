//! Exports a mass on a spring and a damper that stand on something that moves: half of a system that has to be coupled.
#![allow(non_snake_case, reason = "symbols as in mechanics")]

use fmu_export::*;

/// A mass on a spring and a damper. All positions are those beside the rest.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
struct SprungMass {
    m: f64,
    k: f64,
    d: f64,
    x_below: f64,
    v_below: f64,
    F: f64,
    x: f64,
    v: f64,
    a: f64,
    F_below: f64,
}

impl Default for SprungMass {
    fn default() -> Self {
        SprungMass {
            m: 1.0,
            k: 40.0,
            d: 0.3,
            x_below: 0.0,
            v_below: 0.0,
            F: 0.0,
            x: 0.0,
            v: 0.0,
            a: 0.0,
            F_below: 0.0,
        }
    }
}

impl Equations<3, 2> for SprungMass {
    const KNOWN: [&str; 3] = ["x_below", "v_below", "F"];
    const UNKNOWN: [&str; 2] = ["a", "F_below"];
    fn equations<T: Number>(&self, [x_below, v_below, F]: [T; 3]) -> [T; 2] {
        let F_below = (x_below - self.x) * self.k + (v_below - self.v) * self.d;
        [(F + F_below) / self.m, -F_below]
    }
}

impl SprungMass {
    fn slope(&self, [x, v]: [f64; 2]) -> [f64; 2] {
        let here = SprungMass { x, v, ..self.clone() };
        [v, here.equations([self.x_below, self.v_below, self.F])[0]]
    }
}

impl Model for SprungMass {
    const INFO: Info = Info::new("sprung_mass", "A mass on a spring that stands on something", 0.01)
        .stop(10.0)
        .substep(1e-3);
    const VARIABLES: &'static [Variable<Self>] = &[
        parameter("m", "kg", "Mass").min(1e-3).at(|s| &mut s.m),
        parameter("k", "N/m", "Stiffness of the spring").min(0.0).at(|s| &mut s.k),
        parameter("d", "N.s/m", "Damping").min(0.0).at(|s| &mut s.d),
        input("x_below", "m", "Position of what the spring stands on").at(|s| &mut s.x_below),
        input("v_below", "m/s", "Speed of what the spring stands on").at(|s| &mut s.v_below),
        input("F", "N", "Force on the mass from above").at(|s| &mut s.F),
        output("x", "m", "Position").exact().depends_on(&[]).at(|s| &mut s.x),
        output("v", "m/s", "Speed").exact().depends_on(&[]).at(|s| &mut s.v),
        output("a", "m/s2", "Acceleration").at(|s| &mut s.a),
        output("F_below", "N", "Force on what the spring stands on")
            .depends_on(&["x_below", "v_below"])
            .at(|s| &mut s.F_below),
    ];
    const DERIVATIVES: Option<EquationDerivatives<Self>> = Some(EquationDerivatives::of());

    fn step(&mut self, _time: f64, step: f64) -> Result<(), ModelError> {
        // Runge and Kutta, with steps so short that what is left of the error is the coupling's.
        let n = (step / 1e-3 - 1e-9).ceil().max(1.0);
        let h = step / n;
        for _ in 0..n as u32 {
            let [x, v] = [self.x, self.v];
            let plus = |k: [f64; 2], h: f64| [x + h * k[0], v + h * k[1]];
            let k1 = self.slope([x, v]);
            let k2 = self.slope(plus(k1, h / 2.0));
            let k3 = self.slope(plus(k2, h / 2.0));
            let k4 = self.slope(plus(k3, h));
            let mean = |i: usize| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0;
            [self.x, self.v] = [x + h * mean(0), v + h * mean(1)];
        }
        Ok(())
    }

    fn compute_outputs(&mut self) {
        [self.a, self.F_below] = self.equations([self.x_below, self.v_below, self.F]);
    }
}

export!(SprungMass);
