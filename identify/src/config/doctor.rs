//! Configuration of `task = "doctor"`.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use drive_doctor::CarData;
use plugin::ConfigError;
use schemars::JsonSchema;
use serde::Deserialize;

use vehicle::Aerodynamics;

use super::car::checked_aero;
use super::rules;
use super::uncertain_value::AeroChoice;

/// Looks for errors in a log. What is known of the car makes more checks possible; none of it is needed.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DoctorConfig {
    /// Distance between the axles [m].
    pub wheelbase: Option<f64>,
    /// Distance from the centre of gravity to the front axle [m].
    pub l_f: Option<f64>,
    /// Distance from the centre of gravity to the rear axle [m].
    pub l_r: Option<f64>,
    /// Mass [kg].
    pub m: Option<f64>,
    /// Drag and downforce, or "none": tires stiffen with the load that downforce adds, which can look like an error of the steering.
    pub aero: Option<AeroChoice>,
    /// The log is a staircase: the signal `delta` is a command that was held step by step while the car rolled slowly. Its map and the play of
    /// the steering are found.
    pub staircase: bool,
}

impl DoctorConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let Self { wheelbase, l_f, l_r, m, aero, staircase } = *self;
        aero.map_or(Ok(()), |air| checked_aero(air).map(|_| ()))?;
        let length = wheelbase.is_some() || (l_f.is_some() && l_r.is_some());
        rules::check_rule(!staircase || length, "staircase", "`wheelbase` with it", "none")?;
        for (name, value) in [("wheelbase", wheelbase), ("l_f", l_f), ("l_r", l_r), ("m", m)] {
            value.map_or(Ok(()), |value| rules::check_positive(name, value))?;
        }
        let rest = |arm: Option<f64>| wheelbase.zip(arm).is_none_or(|(whole, arm)| arm < whole);
        let expected =
            |name: &str| ConfigError::at_key(name, "expected less than the wheelbase, of which it is a part");
        match (rest(l_f), rest(l_r)) {
            (false, _) => return Err(expected("l_f")),
            (_, false) => return Err(expected("l_r")),
            _ => {}
        }
        // All three: a centimetre is how well lengths are measured.
        let (Some(whole), Some(l_f), Some(l_r)) = (wheelbase, l_f, l_r) else { return Ok(()) };
        let agree = (l_f + l_r - whole).abs() <= 0.01;
        let sum = format!("l_f + l_r = {} m, or one of the three left out", l_f + l_r);
        rules::check_rule(agree, "wheelbase", &sum, whole)
    }

    /// What is known of the car; of three lengths two are enough.
    pub fn car_data(&self) -> CarData {
        let Self { wheelbase, l_f, l_r, m, aero, .. } = *self;
        let rest = |arm: Option<f64>| Some(wheelbase? - arm?);
        let axles = l_f.or(rest(l_r)).zip(l_r.or(rest(l_f)));
        CarData {
            wheelbase,
            axles: axles.map(|(l_f, l_r)| [l_f, l_r]),
            m,
            aero: aero.map(Aerodynamics::from),
        }
    }
}
