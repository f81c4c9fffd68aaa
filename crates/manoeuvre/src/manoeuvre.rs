//! A manoeuvre: its kind and the common parameters. Checks the parameters, and cuts the log of the test out of a run.

use std::sync::Arc;

use crate::action::TestStage;
use crate::channel::Channel;
use crate::characteristic_value::{CharacteristicValues, ParameterError};
use crate::common::CommonParameters;
use crate::diagram::TestDiagram;
use crate::kind::{ManoeuvreKind, ShortestPhase};
use crate::log::ManoeuvreLog;

/// A kind of manoeuvre with the parameters that all kinds share.
#[derive(Debug, Clone)]
pub struct Manoeuvre {
    /// The parameters that all kinds share.
    pub common: CommonParameters,
    /// The kind.
    pub kind: Arc<dyn ManoeuvreKind>,
}

/// So many communication steps the shortest part of a manoeuvre must have.
const STEPS: f64 = 10.0;

impl Manoeuvre {
    /// Checks all numbers.
    ///
    /// # Errors
    /// With the first one that no test can be driven with.
    pub fn check_parameters(&self) -> Result<(), ParameterError> {
        let CommonParameters { entry_speed, speed_tolerance, settle, wheelbase, step, .. } = self.common;
        let common = |it: ParameterError| ParameterError { of_kind: false, ..it };
        let run_up = self.kind.test_entry_speed(&self.common);
        if !(entry_speed.is_finite() && entry_speed >= 0.0) || (run_up > 0.0 && entry_speed == 0.0) {
            let message = format!("expected an entry speed above 0 m/s, found {entry_speed} m/s");
            return Err(ParameterError::at_common_key("entry_speed", message));
        }
        let keys = [("speed_tolerance", speed_tolerance, "m/s"), ("settle", settle, "s")];
        ParameterError::check_positive(keys).map_err(common)?;
        let wheelbase = wheelbase.unwrap_or(1.0);
        ParameterError::check_positive([("wheelbase", wheelbase, "m")]).map_err(common)?;
        self.common.speed_controller.check_gains()?;
        self.common.path_follower.check_gains()?;
        self.kind.check_parameters(&self.common)?;
        match self.kind.shortest_phase() {
            Some(ShortestPhase { key, duration }) if step * STEPS > duration * (1.0 + 1e-9) => {
                let message = format!(
                    "its shortest part lasts {duration:.4} s, which needs a communication step of at most {:.4} s, found {step} s",
                    duration / STEPS
                );
                Err(ParameterError::at_kind_key(key, message))
            }
            _ => Ok(()),
        }
    }

    /// The diagrams of a test with these values; `begin` is the time of the run at which it began [s].
    #[must_use]
    pub fn test_diagrams(
        &self,
        log: &ManoeuvreLog,
        values: &CharacteristicValues,
        begin: f64,
    ) -> Vec<TestDiagram> {
        let mut diagrams = self.kind.diagrams(&self.common, log, values);
        diagrams.iter_mut().for_each(|diagram| diagram.shift_time(begin));
        diagrams
    }

    /// The test in a whole run: `commands` are steering, drive and phase, `inputs` what the kind needs, in that order.
    ///
    /// # Errors
    /// In words, when the test did not begin or did not end.
    pub fn test_log(
        &self,
        time: &[f64],
        [steer, drive, phase]: [&[f64]; 3],
        inputs: &[Vec<f64>],
    ) -> Result<ManoeuvreLog, String> {
        let common = &self.common;
        let channels = self.kind.required_channels();
        let [first, last] = [time.first(), time.last()].map(|it| it.copied().unwrap_or(0.0));
        let begin = phase.iter().position(|phase| *phase != 0.0);
        let Some(begin) = begin else {
            let wanted = self.kind.test_entry_speed(common);
            let speed = channels.iter().position(|it| *it == Channel::ForwardSpeed);
            let speeds = speed.map_or(&[][..], |place| &inputs[place]);
            let near = |a: &f64, b: &f64| (a - wanted).abs().total_cmp(&(b - wanted).abs());
            let nearest = speeds.iter().copied().min_by(near).unwrap_or(0.0);
            let (settle, tolerance) = (common.settle, common.speed_tolerance);
            return Err(format!(
                "the car did not keep its entry speed of {wanted:.2} m/s to {tolerance:.2} m/s for {settle:.2} s before the run ended at {last:.2} s: \
                 it came as near as {nearest:.2} m/s"
            ));
        };
        if begin == 0 && phase[0] != 0.0 {
            return Err(format!(
                "the run begins at {first:.2} s, when the manoeuvre goes on already: its beginning was not measured"
            ));
        }
        let over = phase.iter().position(|phase| *phase == f64::from(TestStage::OVER));
        let Some(over) = over else {
            let (stage, began) = (phase[phase.len() - 1], time[begin]);
            let what = self.kind.stage_names().get(stage as usize - 1).copied().unwrap_or("test");
            return Err(format!(
                "the run ended at {last:.2} s, before the manoeuvre that began at {began:.2} s did: it was still at \"{what}\""
            ));
        };
        let sign = common.direction.left_positive_sign();
        let cut = |values: &[f64], sign: f64| values[begin..=over].iter().map(|it| sign * it).collect();
        let mut all: [Vec<f64>; Channel::ALL.len()] = Default::default();
        for channel in Channel::ALL {
            let place = channels.iter().position(|it| *it == channel);
            let mirror = if sign < 0.0 { channel.mirror_sign() } else { 1.0 };
            all[channel.index()] =
                place.map_or(vec![0.0; over + 1 - begin], |place| cut(&inputs[place], mirror));
        }
        let [v_x, v_y, r, a_y, east, north, heading] = all;
        let mut log = ManoeuvreLog {
            t: time[begin..=over].iter().map(|it| it - time[begin]).collect(),
            phase: cut(phase, 1.0),
            steer: cut(steer, sign),
            drive: cut(drive, 1.0),
            v_x,
            v_y,
            r,
            a_y,
            ..ManoeuvreLog::default()
        };
        log.set_positions(&east, &north, &heading);
        Ok(log)
    }
}
