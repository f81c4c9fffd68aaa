//! The kinds of manoeuvres: each says what it needs, what the driver does, and which values come of it.

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

pub use acceleration::Acceleration;
pub use braking_in_a_turn::BrakingInATurn;
pub use frequency_response::{Excitation, FrequencyResponse};
pub use lane_change::{Course, LaneChange};
pub use mu_split_braking::{MuSplitBraking, Steering};
pub use sine_with_dwell::SineWithDwell;
pub use slowly_increasing_steer::SlowlyIncreasingSteer;
pub use steady_circle::{Constant, SteadyCircle};
pub use step_steer::StepSteer;
pub use stop_and_go::StopAndGo;
pub use tip_in::TipIn;

use crate::action::{Action, Now, Stage};
use crate::channel::Channel;
use crate::common::Common;
use crate::log::Log;
use crate::path::Path;
use crate::value::{Known, Values, Wrong};

/// Hands the keys and the words of all kinds to a macro: a new kind is a file and a line here.
#[macro_export]
macro_rules! for_each_kind {
    ($callback:ident) => {
        $callback! {
            acceleration: Acceleration,
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

/// A kind of manoeuvre. All of it is written for a test to the left.
pub trait Kind: Debug + Send + Sync {
    /// What it is called, with its standard.
    fn title(&self) -> &'static str;

    /// What it measures.
    fn needs(&self) -> Vec<Channel>;

    /// The stages of the test in words, from stage 1 on.
    fn stages(&self) -> &'static [&'static str];

    /// The values that come of it.
    fn known(&self) -> &'static [Known];

    /// The path that it follows, if it follows one.
    fn path(&self) -> Option<Path> {
        None
    }

    /// The speed at which the test begins [m/s].
    fn run_up(&self, common: &Common) -> f64 {
        common.entry_speed
    }

    /// The key and the duration [s] of its shortest part, which the communication step must resolve.
    fn shortest(&self) -> Option<(&'static str, f64)> {
        None
    }

    /// Checks its numbers.
    ///
    /// # Errors
    /// With the first one that no test can be driven with.
    fn check(&self, common: &Common) -> Result<(), Wrong>;

    /// What the driver does at a moment of the test.
    fn act(&self, common: &Common, stage: &mut Stage, now: &Now) -> Action;

    /// The values of a test that came to its end.
    ///
    /// # Errors
    /// In words, when what they are values of did not take place.
    fn values(&self, common: &Common, log: &Log) -> Result<Values, String>;
}

/// A value in the table of a kind.
const fn known(name: &'static str, unit: &'static str, about: &'static str) -> Known {
    Known { name, unit, about }
}
