//! Does what a scenario asks for: from its signals and settings to a result, a page, and start values for the next run.

use std::collections::BTreeMap;

use plugin::{Analysis, Host, Need, Request, Signal};
use serde_json::{Map, Value, json};

use crate::config::{Config, Sensitivity, Tires};
use crate::direction::Direction;
use crate::page::{self, Page, Section};
use crate::parameters::curve;
use crate::prepare::{Axle, Column, Points, Prepared, Recording, Stage};
use crate::prior::Prior;
use crate::start_values::{self, Tire};
use crate::study::{excitation, sensitivity};
use crate::tire::{self, Found};

/// The plugin.
struct Identify;

impl Analysis for Identify {
    const NEEDS: &'static [Need] = &[
        Need::optional("v_x", "m/s", "forward velocity of the centre of gravity"),
        Need::optional("v_y", "m/s", "velocity of the centre of gravity to the left"),
        Need::optional("a_x", "m/s2", "forward acceleration"),
        Need::optional("a_y", "m/s2", "acceleration to the left"),
        Need::optional("a_z", "m/s2", "vertical specific force; 9.81 on a level road"),
        Need::optional("r", "rad/s", "yaw rate"),
        Need::optional("delta", "rad", "steering angle of the front wheels"),
        Need::optional("omega_fl", "rad/s", "speed of the front left wheel"),
        Need::optional("omega_fr", "rad/s", "speed of the front right wheel"),
        Need::optional("omega_rl", "rad/s", "speed of the rear left wheel"),
        Need::optional("omega_rr", "rad/s", "speed of the rear right wheel"),
        Need::optional("gear", "", "gear"),
    ];

    fn check(request: &Request) -> Result<(), String> {
        match Config::read(request.config)? {
            Config::Tires(_) => {
                let mut recording = Recording::default();
                for signal in &request.signals {
                    recording.insert(signal.name, Vec::new(), Vec::new());
                }
                recording.complete().map_err(|error| error.to_string())
            }
            Config::ExcitationStudy(_) | Config::SensitivityStudy(_) => Ok(()),
        }
    }

    fn run(request: &Request, host: &mut dyn Host) -> Result<String, String> {
        let result = match Config::read(request.config)? {
            Config::Tires(config) => tires(&config, request, host)?,
            Config::ExcitationStudy(study) => excitation_study(&study, host)?,
            Config::SensitivityStudy(study) => sensitivity_study(&study, host),
        };
        Ok(result.to_string())
    }
}

plugin::export!(Identify);

/// What an analysis says that the program asked to give up.
const CANCELLED: &str = "cancelled";

fn go_on(host: &mut dyn Host, share: f64, what: &str) -> Result<(), String> {
    if host.progress(share, what) { Ok(()) } else { Err(CANCELLED.to_owned()) }
}

/// One curve of the car.
struct Curve<'a> {
    /// Its key in the result.
    key: &'static str,
    /// Its name on the page.
    name: &'static str,
    direction: Direction,
    points: &'a Points,
}

fn curves(prepared: &Prepared) -> Vec<Curve<'_>> {
    let of = |keys: [&'static str; 2], names: [&'static str; 2], axle: &'_ Axle| {
        let _ = (keys, names, axle);
    };
    let _ = of;
    let axles = [
        ("front", "front_x", "Front axle, lateral", "Front axle, longitudinal", &prepared.front),
        ("rear", "rear_x", "Rear axle, lateral", "Rear axle, longitudinal", &prepared.rear),
    ];
    let mut curves = Vec::new();
    for (key, key_x, name, name_x, axle) in axles {
        curves.push(Curve { key, name, direction: Direction::Lateral, points: &axle.lateral });
        curves.extend(axle.longitudinal.as_ref().map(|points| Curve {
            key: key_x,
            name: name_x,
            direction: Direction::Longitudinal,
            points,
        }));
    }
    curves
}
