//! The unknowns of a fit without v_y: tires, car, sensors and white noises, with the coordinates and the prior that a fit works in.
#![allow(non_snake_case, reason = "parameters of the Magic Formula are written as in its source")]

use super::setup::EstimatorSetup;

/// Number of unknowns.
pub(super) const SIZE: usize = 22;

/// Names of the unknowns.
pub const NAMES: [&str; SIZE] = [
    "B_f",
    "C_f",
    "D_f",
    "E_f",
    "B_r",
    "C_r",
    "D_r",
    "E_r",
    "I_zz",
    "h",
    "load_sensitivity",
    "combined_slip",
    "pitch",
    "a_y_offset",
    "r_noise",
    "a_y_noise",
    "v_x_noise",
    "v_x_process",
    "v_y_process",
    "r_process",
    "r_delay",
    "a_y_delay",
];

/// The Magic Formula of an axle, force over load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxleTire {
    /// Stiffness factor [1/rad].
    pub B: f64,
    /// Shape factor, 1 or more, so that D is the peak.
    pub C: f64,
    /// Peak.
    pub D: f64,
    /// Curvature factor.
    pub E: f64,
}

impl AxleTire {
    /// Cornering stiffness over load [1/rad].
    #[must_use]
    pub fn stiffness(&self) -> f64 {
        self.B * self.C * self.D
    }

    /// Force over load at a slip angle [rad], and its slope [1/rad].
    #[must_use]
    pub fn force(&self, alpha: f64) -> [f64; 2] {
        let Self { B, C, D, E } = *self;
        let z = B * alpha;
        let bent = z - E * (z - z.atan());
        let bending = B * (1.0 - E * (1.0 - 1.0 / (1.0 + z * z)));
        let (sin, cos) = (C * bent.atan()).sin_cos();
        [D * sin, D * cos * C / (1.0 + bent * bent) * bending]
    }
}

/// The unknowns in the order of [`NAMES`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SideslipModelParameters(pub [f64; SIZE]);

impl SideslipModelParameters {
    /// Tires of the front and the rear axle.
    #[must_use]
    pub fn axle_tires(&self) -> [AxleTire; 2] {
        [0, 4].map(|i| AxleTire { B: self.0[i], C: self.0[i + 1], D: self.0[i + 2], E: self.0[i + 3] })
    }

    /// Yaw inertia [kg·m²].
    #[must_use]
    pub fn yaw_inertia(&self) -> f64 {
        self.0[8]
    }

    /// Height of the centre of gravity [m].
    #[must_use]
    pub fn centre_of_gravity_height(&self) -> f64 {
        self.0[9]
    }

    /// Relative loss of D for a load that doubles.
    pub(super) fn load_sensitivity(&self) -> f64 {
        self.0[10]
    }

    /// How much of the circle of friction a longitudinal force takes: 1 for all.
    pub(super) fn combined_slip(&self) -> f64 {
        self.0[11]
    }

    /// Pitch under longitudinal acceleration times g, as a share of that acceleration.
    pub(super) fn pitch_gain(&self) -> f64 {
        self.0[12]
    }

    /// Of the accelerometer [m/s²].
    pub(super) fn a_y_offset(&self) -> f64 {
        self.0[13]
    }

    /// Standard deviations of r, a_y and v_x.
    pub(super) fn sensor_noise(&self) -> [f64; 3] {
        [self.0[14], self.0[15], self.0[16]]
    }

    /// White accelerations of v_x, v_y and r [per root second].
    pub(super) fn process_noise(&self) -> [f64; 3] {
        [self.0[17], self.0[18], self.0[19]]
    }

    /// How late r and a_y are behind steering and speed [s].
    pub(super) fn sensor_delays(&self) -> [f64; 2] {
        [self.0[20], self.0[21]]
    }

    /// The same with noises of sensors that are sampled `times` as often: what matters to slow motion is their density.
    pub(super) fn with_sampling_factor(&self, times: f64) -> Self {
        let mut other = *self;
        for i in 14..17 {
            other.0[i] *= times.sqrt();
        }
        other
    }
}

/// How an unknown is searched for: in its logarithm or as it is, near a first guess.
#[derive(Clone, Copy, Debug)]
pub(super) struct SearchParameter {
    /// Whether the coordinate is the logarithm.
    pub log: bool,
    /// Where the search starts, of the unknown itself.
    pub start: f64,
    /// Centre of the prior, of the unknown itself.
    pub centre: f64,
    /// Its standard deviation, of the coordinate.
    pub std: f64,
    /// Bounds of the unknown itself.
    pub bounds: [f64; 2],
}

impl SearchParameter {
    fn logarithmic(start: f64, std: f64, bounds: [f64; 2]) -> Self {
        Self { log: true, start, centre: start, std, bounds }
    }

    fn linear(start: f64, std: f64, bounds: [f64; 2]) -> Self {
        Self { log: false, start, centre: start, std, bounds }
    }

    /// The coordinate of a value.
    pub fn coordinate_of(&self, value: f64) -> f64 {
        if self.log { value.ln() } else { value }
    }

    /// The value at a coordinate.
    pub fn value_at_coordinate(&self, coordinate: f64) -> f64 {
        if self.log { coordinate.exp() } else { coordinate }
    }

    /// Step of the differences that stand for derivatives.
    pub fn difference_step(&self) -> f64 {
        if self.log { 1e-4 } else { 1e-3 * self.std }
    }
}

/// All of them. Tires of road and race cars lie well inside the bounds; C, E, height, load sensitivity and combined slip are weak in most
/// drives, so their priors matter.
pub(super) fn fit_unknowns(setup: &EstimatorSetup, has_a_x: bool) -> [SearchParameter; SIZE] {
    let tire = [
        SearchParameter::logarithmic(10.0, 1.0, [2.0, 60.0]),
        SearchParameter::logarithmic(1.35, 0.02, [1.0, 2.0]),
        SearchParameter::logarithmic(1.1, 0.5, [0.2, 3.0]),
        SearchParameter::linear(0.0, 0.6, [-4.0, 0.99]),
    ];
    let [inertia, height] = setup.body_uncertainty;
    let around = |guess: f64| [guess / 4.0, guess * 4.0];
    let noise = |start: f64| SearchParameter::logarithmic(start, 2.0, [start * 1e-3, start * 1e2]);
    // Without an accelerometer the speed wanders as drivers push.
    let pushing = if has_a_x { 0.06 } else { 1.0 };
    let [r, a_y, v_x] = setup.sensor_noise;
    let body = setup.body;
    let [t, u] = [tire, tire];
    [
        t[0],
        t[1],
        t[2],
        t[3],
        u[0],
        u[1],
        u[2],
        u[3],
        SearchParameter::logarithmic(body.I_zz, inertia, around(body.I_zz)),
        SearchParameter::logarithmic(body.h, height, around(body.h)),
        SearchParameter::linear(0.1, 0.2, [-1.0, 2.0]),
        SearchParameter::linear(1.0, 0.5, [0.0, 1.5]),
        SearchParameter::linear(0.0, 0.05, [-0.3, 0.3]),
        SearchParameter::linear(0.0, 0.2, [-2.0, 2.0]),
        noise(r),
        noise(a_y),
        noise(v_x),
        noise(pushing),
        noise(0.05),
        noise(setup.yaw_process),
        SearchParameter::linear(0.0, setup.delay, [-0.1, 0.1]),
        SearchParameter::linear(0.0, setup.delay, [-0.1, 0.1]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_formula_has_its_peak_and_its_stiffness() {
        let tire = AxleTire { B: 10.0, C: 1.3, D: 1.1, E: 0.3 };
        let peak = (0..4000).map(|i| tire.force(f64::from(i) * 1e-3)[0]).fold(0.0, f64::max);
        assert!((peak - 1.1).abs() < 1e-3);
        assert!((tire.force(0.0)[1] - tire.stiffness()).abs() < 1e-12);
        for alpha in [-0.2, -0.01, 0.05, 0.3] {
            let slope = (tire.force(alpha + 1e-6)[0] - tire.force(alpha - 1e-6)[0]) / 2e-6;
            assert!((tire.force(alpha)[1] - slope).abs() < 1e-6);
        }
    }
}
