//! Tells how stiffness and friction of both axles change with the load, and what longitudinal forces and slips say of them.

use preparation::{PreparationPipeline, PreparedRecording};
use serde_json::{Value, json};
use tire_inference::estimate::TireEstimate;
use tire_inference::load::{AxleLoadFit, CarDataEffects, EFFECTS, LoadEffect, LoadEffects};
use tire_inference::local::StretchPrior;
use tire_inference::quantity::Quantity;
use tire_inference::verdict::Identifiability;

use crate::stretches::lateral_series_and_loads;

/// Effects of both axles with one car; absent where they cannot be fitted.
pub type CarLoadEffects = [Option<[f64; EFFECTS]>; 2];

/// Both axles, with what other data of the car say.
pub struct LoadEffectFits {
    axles: [(Option<AxleLoadFit>, Vec<CarDataEffects>); 2],
}

/// What is told of an axle.
#[derive(Clone, Debug)]
pub struct AxleLoadEffects {
    /// Key of the axle in the result.
    pub axle: &'static str,
    /// What its lateral points tell; absent where there are too few.
    pub effects: Option<LoadEffects>,
    /// Stiffness over longitudinal slip.
    pub slip_stiffness: SlipStiffness,
}

/// Stiffness over longitudinal slip, K of the curve.
#[derive(Clone, Debug)]
pub struct SlipStiffness {
    /// Value and 95 % interval [-].
    pub found: Option<(f64, [f64; 2])>,
    /// Whether the data tell it.
    pub verdict: Identifiability,
    /// Why, or what is missing.
    pub reason: String,
}

impl LoadEffectFits {
    /// Fits both axles.
    pub fn fit(prepared: &PreparedRecording, pipeline: &PreparationPipeline) -> Self {
        let fit = |(_, series, load)| (AxleLoadFit::fit(series, load, &StretchPrior::default()), Vec::new());
        Self { axles: lateral_series_and_loads(prepared, pipeline).map(fit) }
    }

    /// The effects with another car.
    pub fn refit_with_car(
        &self,
        prepared: &PreparedRecording,
        pipeline: &PreparationPipeline,
    ) -> CarLoadEffects {
        let series = lateral_series_and_loads(prepared, pipeline);
        std::array::from_fn(|at| {
            let (_, series, load) = series[at];
            self.axles[at].0.as_ref()?.refit_effects(series, load, &StretchPrior::default())
        })
    }

    /// Adds what a datum of the car does, at minus and plus one standard deviation.
    pub fn add_car_uncertainty(&mut self, name: &'static str, [low, high]: [CarLoadEffects; 2]) {
        for (at, (_, moves)) in self.axles.iter_mut().enumerate() {
            moves.extend(low[at].zip(high[at]).map(|(low, high)| (name, [low, high])));
        }
    }

    /// What is told, with the longitudinal curves of both axles.
    pub fn axle_load_effects(&self, longitudinal: [Option<&TireEstimate>; 2]) -> Vec<AxleLoadEffects> {
        let told =
            |(at, (fit, moves)): (usize, &(Option<AxleLoadFit>, Vec<CarDataEffects>))| AxleLoadEffects {
                axle: ["front", "rear"][at],
                effects: fit.as_ref().map(|fit| fit.judge_effects(moves)),
                slip_stiffness: SlipStiffness::from_estimate(at, longitudinal[at]),
            };
        self.axles.iter().enumerate().map(told).collect()
    }
}

impl SlipStiffness {
    fn from_estimate(axle: usize, estimate: Option<&TireEstimate>) -> Self {
        let Some(estimate) = estimate else {
            let [left, right] = [["omega_fl", "omega_fr"], ["omega_rl", "omega_rr"]][axle];
            return Self {
                found: None,
                verdict: Identifiability::NotIdentifiable,
                reason: format!(
                    "The wheel speeds `{left}` and `{right}` are missing: there is no longitudinal slip. Log them, and give the radius of the wheels."
                ),
            };
        };
        Self {
            found: estimate.mean.get(&Quantity::K).copied().zip(estimate.interval.get(&Quantity::K).copied()),
            verdict: estimate
                .identified
                .get(&Quantity::K)
                .copied()
                .unwrap_or(Identifiability::NotIdentifiable),
            reason: estimate.reason.get(&Quantity::K).cloned().unwrap_or_default(),
        }
    }
}

impl AxleLoadEffects {
    /// All that has a verdict of the lateral points.
    pub fn effects_mut(&mut self) -> impl Iterator<Item = &mut LoadEffect> {
        self.effects.iter_mut().flat_map(|it| [&mut it.K, &mut it.D, &mut it.mu_x])
    }
}

/// Why nothing is told of an axle.
pub const TOO_FEW: &str = "There are too few rows with a slip. Drive corners.";

/// What is told under `load_sensitivity` and `combined_slip`, by axle.
pub fn load_effects_json(told: &[AxleLoadEffects]) -> [Value; 2] {
    let (mut sensitivity, mut combined) = (json!({}), json!({}));
    for AxleLoadEffects { axle, effects, slip_stiffness } in told {
        let nothing = || json!({ "verdict": Identifiability::NotIdentifiable, "reason": TOO_FEW });
        let effect =
            |of: fn(&LoadEffects) -> &LoadEffect| effects.as_ref().map_or_else(nothing, |it| json!(of(it)));
        sensitivity[axle] = json!({
            "K": effect(|it| &it.K),
            "D": effect(|it| &it.D),
            "load": effects.as_ref().map(|it| it.load),
        });
        let SlipStiffness { found, verdict, reason } = slip_stiffness;
        combined[axle] = json!({
            "mu_x": effect(|it| &it.mu_x),
            "longitudinal_force": effects.as_ref().map(|it| it.longitudinal),
            "slip_stiffness": {
                "value": found.map(|it| it.0),
                "interval": found.map(|it| it.1),
                "verdict": verdict,
                "reason": reason,
            },
        });
    }
    [sensitivity, combined]
}
