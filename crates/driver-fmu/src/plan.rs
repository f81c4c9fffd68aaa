//! Prepares a drive: line, limits of the car and speed profile, from the parameters.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::f64::consts::TAU;

use fmu_export::Text;
use serde::{Deserialize, Serialize};
use track::{Bounds, Error, Ggv, Handling, Line, Profile, Survey};

use crate::car::{Car, Limit, ggv, handling, most_front_slip};

/// Radius of the circle that is driven without a track [m].
const CIRCLE: f64 = 100.0;

/// What a drive depends on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The table of the track, or the path of its file.
    pub track: Text,
    /// Half the width of a track whose table has no widths [m].
    pub half_width: f64,
    /// The car.
    pub car: Car,
    /// Limits of the commands.
    pub limit: Limit,
    /// Share of the grip that the speed profile uses [-].
    pub grip: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            track: Text::default(),
            half_width: 5.0,
            car: Car::default(),
            limit: Limit::default(),
            grip: 0.85,
        }
    }
}

/// A prepared drive.
#[derive(Debug)]
pub struct Plan {
    /// What it was made of.
    pub made_of: Settings,
    /// The same with the track as its text.
    pub settings: Settings,
    /// The line.
    pub line: Line,
    /// What the car can do with all of its grip.
    pub ggv: Ggv,
    /// The speeds.
    pub profile: Profile,
    /// Steady slip angles.
    pub handling: Handling,
    /// Largest slip angle of the front axle that still gives more force [rad].
    pub front_slip: f64,
}

impl Plan {
    /// Prepares a drive.
    ///
    /// # Errors
    /// When the track cannot be read or cannot be driven by the car, with the parameter and the place.
    pub fn of(settings: &Settings) -> Result<Self, String> {
        let track = settings.track.loaded("track.csv")?;
        let (made_of, settings) = (settings.clone(), Settings { track, ..settings.clone() });
        let Settings { car, limit, grip, .. } = &settings;
        let line = line(&settings.track).map_err(|error| format!("track.csv: {error}"))?;
        follows(&line, car.body.wheelbase(), limit.delta)
            .map_err(|error| format!("track.csv: {error}"))?;
        let of_car = |error: Error| format!("the parameters of the car give no limits: {error}");
        let axles = car.axles()?;
        let ggv = ggv(car, &axles, limit).map_err(of_car)?;
        let handling = handling(car, &axles).map_err(of_car)?;
        let bounds = Bounds { top: limit.v, start: None, end: Some(0.0) };
        let profile = Profile::of(&line, &ggv.with_grip(*grip), &bounds)
            .map_err(|error| format!("track.csv: {error}"))?;
        let front_slip = most_front_slip(car, &axles);
        Ok(Plan { made_of, line, ggv, profile, handling, front_slip, settings })
    }
}

fn line(text: &Text) -> Result<Line, Error> {
    if !text.get().is_empty() {
        return Line::read(text.get());
    }
    let point = |i: i32| {
        let angle = TAU * f64::from(i) / 180.0;
        [CIRCLE * angle.sin(), CIRCLE * (1.0 - angle.cos())]
    };
    let points = (0..180).map(point).collect();
    Line::through(&Survey { points, closed: true, ..Survey::default() })
}

/// Whether a car that rolls without slip can follow the line with its largest steering angle: |κ| L ≤ δ.
fn follows(line: &Line, wheelbase: f64, delta: f64) -> Result<(), Error> {
    let tightest = delta / wheelbase;
    match line.stations().find(|s| line.curvature(*s).abs() > tightest) {
        None => Ok(()),
        Some(s) => {
            let (found, least) = (1.0 / line.curvature(s).abs(), 1.0 / tightest);
            let message = format!(
                "expected a radius of at least {least:.1} m, which is what limit.delta and the wheelbase allow, found {found:.1} m"
            );
            Err(Error::Place { s, message })
        }
    }
}
