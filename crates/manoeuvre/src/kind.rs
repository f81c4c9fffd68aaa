//! The trait of all kinds of manoeuvres, and the list of kinds: measured channels, driver actions, characteristic values.

mod acceleration;
mod bend;
mod braking_in_a_turn;
mod frequency_response;
mod lane_change;
mod mu_split_braking;
mod sine_with_dwell;
mod slowly_increasing_steer;
mod steady_circle;
mod step_steer;
mod stop_and_go;
mod tip_in;

use std::fmt::Debug;

pub use acceleration::AccelerationTest;
pub use braking_in_a_turn::BrakingInATurn;
pub use frequency_response::{FrequencyResponse, SteerExcitation};
pub use lane_change::{LaneChange, LaneChangeCourse};
pub use mu_split_braking::{MuSplitBraking, SteeringDuringBraking};
pub use sine_with_dwell::SineWithDwell;
pub use slowly_increasing_steer::SlowlyIncreasingSteer;
pub use steady_circle::{ConstantQuantity, SteadyCircle};
pub use step_steer::StepSteer;
pub use stop_and_go::StopAndGo;
pub use tip_in::TipIn;

use crate::action::{CarState, DriverAction, TestStage};
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValueInfo, CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::diagram::TestDiagram;
use crate::log::ManoeuvreLog;
use crate::path::GroundPath;

/// Hands the keys and the words of all kinds to a macro: a new kind is a file and a line here.
#[macro_export]
macro_rules! for_each_kind {
    ($callback:ident) => {
        $callback! {
            acceleration: AccelerationTest,
            braking_in_a_turn: BrakingInATurn,
            frequency_response: FrequencyResponse,
            lane_change: LaneChange,
            mu_split_braking: MuSplitBraking,
            sine_with_dwell: SineWithDwell,
            slowly_increasing_steer: SlowlyIncreasingSteer,
            steady_circle: SteadyCircle,
            step_steer: StepSteer,
            stop_and_go: StopAndGo,
            tip_in: TipIn,
        }
    };
}

/// A phase of a test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShortestPhase {
    /// The key that sets its duration.
    pub key: &'static str,
    /// [s]
    pub duration: f64,
}

/// A kind of manoeuvre. All of it is written for a test to the left.
pub trait ManoeuvreKind: Debug + Send + Sync {
    /// What it is called, with its standard.
    fn kind_title(&self) -> &'static str;

    /// The variables of the car that it measures.
    fn required_channels(&self) -> Vec<Channel>;

    /// The stages of the test in words, from stage 1 on.
    fn stage_names(&self) -> &'static [&'static str];

    /// Its characteristic values.
    fn value_descriptions(&self) -> &'static [CharacteristicValueInfo];

    /// The path that it follows, if it follows one.
    fn reference_path(&self) -> Option<GroundPath> {
        None
    }

    /// The cones of its course, in the frame of the test [m].
    fn cones(&self) -> Vec<[f64; 2]> {
        Vec::new()
    }

    /// When the outline of the car first touched each of these cones, over the time of the log [s]; none of those that stand.
    fn cone_hit_times(&self, _log: &ManoeuvreLog) -> Vec<Option<f64>> {
        Vec::new()
    }

    /// The diagrams that its standard shows of a completed test with these values, over the time of the log.
    fn diagrams(
        &self,
        _common: &CommonParameters,
        _log: &ManoeuvreLog,
        _values: &CharacteristicValues,
    ) -> Vec<TestDiagram> {
        Vec::new()
    }

    /// The speed at which the test begins [m/s].
    fn test_entry_speed(&self, common: &CommonParameters) -> f64 {
        common.entry_speed
    }

    /// Its shortest phase, which the communication step must resolve.
    fn shortest_phase(&self) -> Option<ShortestPhase> {
        None
    }

    /// Checks its numbers.
    ///
    /// # Errors
    /// With the first one that no test can be driven with.
    fn check_parameters(&self, common: &CommonParameters) -> Result<(), ParameterError>;

    /// The action of the driver at a moment of the test.
    fn next_action(&self, common: &CommonParameters, stage: &mut TestStage, now: &CarState) -> DriverAction;

    /// The characteristic values of a completed test.
    ///
    /// # Errors
    /// In words, when what they are values of did not take place.
    fn characteristic_values(
        &self,
        common: &CommonParameters,
        log: &ManoeuvreLog,
    ) -> Result<CharacteristicValues, String>;
}

/// An entry in the value table of a kind.
const fn characteristic_value_info(
    name: &'static str,
    unit: &'static str,
    about: &'static str,
) -> CharacteristicValueInfo {
    CharacteristicValueInfo { name, unit, about }
}
