//! Holds what is found of cars that predict drives, and how good they are: for results and pages.

use drive_prediction::agreement::ChannelRatings;
use drive_prediction::predictor::LateralState;
use drive_prediction::score::{LateralScore, RolloutScore};
use serde::Serialize;
use tire_inference::verdict::Identifiability;

/// A model on some drives: one score for each of them and each horizon.
#[derive(Clone, Debug, Serialize)]
pub struct ModelAssessment {
    /// For people.
    #[serde(skip)]
    pub name: String,
    /// Lateral acceleration from measured states; of a model without forces none.
    pub a_y: Option<LateralScore>,
    /// Open-loop predictions, one for each horizon that a stretch is long enough for.
    #[serde(flatten, serialize_with = "by_horizon")]
    pub open_loop: Vec<RolloutScore>,
    /// Ratings by ISO/TS 18571; predictions over the longest horizon.
    pub iso_18571: ChannelRatings,
}

/// What was found of a parameter.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterAssessment {
    /// As `front_K`.
    #[serde(skip)]
    pub name: String,
    /// For people.
    #[serde(skip)]
    pub what: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Its value: of logs in common.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Its 95 % interval.
    pub interval: [f64; 2],
    /// The standard deviation of what one log has of its own; 0 where logs do not differ.
    pub between: f64,
    /// The verdict.
    pub verdict: Identifiability,
    /// Why.
    pub reason: String,
}

impl ParameterAssessment {
    /// Caps the verdict by an error of the log that no fit makes up for.
    pub fn cap_verdict(&mut self, sentence: &str) {
        self.verdict = Identifiability::NotIdentifiable;
        self.reason = format!("The log is wrong: {sentence}");
    }
}

/// A time [s], a state [m/s, rad/s], and its standard deviations where the model says any.
pub type PredictedState = (f64, LateralState, Option<LateralState>);

/// Measured states of a stretch and what was predicted of them.
#[derive(Clone, Debug)]
pub struct PredictionTrace {
    /// Where it is.
    pub name: String,
    /// Times [s] and states.
    pub measured: Vec<(f64, LateralState)>,
    /// One prediction after the other.
    pub predicted: Vec<Vec<PredictedState>>,
}

/// The key of a horizon: `after_0_6_s`.
fn horizon_key(horizon: f64) -> String {
    format!("after_{}_s", horizon.to_string().replace('.', "_"))
}

fn by_horizon<S: serde::Serializer>(scores: &[RolloutScore], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(scores.iter().map(|score| (horizon_key(score.horizon), score)))
}

/// A number with its interval and verdict.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterInterval {
    /// As `front.K`.
    #[serde(skip)]
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its 95 % interval.
    pub interval: [f64; 2],
    /// The verdict.
    pub verdict: Identifiability,
}

/// How good an estimate of a hidden v_y is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SideslipScore {
    /// Root mean square error of v_y [m/s].
    pub v_y: f64,
    /// That of the sideslip angle [rad].
    pub sideslip: f64,
    /// Share of v_y inside the 95 % band.
    pub coverage: f64,
    /// Rows.
    pub rows: usize,
}

/// A stretch of an estimate: time [s], v_y, its standard deviation, and v_y as it was measured [m/s].
pub type SideslipTrace = Vec<(f64, f64, f64, f64)>;
