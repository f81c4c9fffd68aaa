//! Computes the line, the g-g-v diagram and the speed profile of a drive from the parameters.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::f64::consts::TAU;

use fmu_export::SharedText;
use serde::{Deserialize, Serialize};
use track::{Error, GgvDiagram, SpeedBounds, SpeedProfile, SteadyStateHandling, TrackLine, TrackSurvey};

use crate::car::{CommandLimits, DriverCar, ggv_diagram, peak_front_slip, steady_state_handling};

/// Radius of the circle that is driven without a track [m].
const CIRCLE: f64 = 100.0;

/// Parameters that a drive plan depends on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriveSettings {
    /// The table of the track, or the path of its file.
    pub track: SharedText,
    /// Half the width of a track whose table has no widths [m].
    pub half_width: f64,
    /// The car.
    pub car: DriverCar,
    /// Limits of the commands.
    pub limit: CommandLimits,
    /// Share of the grip that the speed profile uses [-].
    pub grip: f64,
    /// Share of the speeds of the track's table that the speed profile takes [-]; 0 for one by the grip.
    pub speed_share: f64,
}

impl Default for DriveSettings {
    fn default() -> Self {
        DriveSettings {
            track: SharedText::default(),
            half_width: 5.0,
            car: DriverCar::default(),
            limit: CommandLimits::default(),
            grip: 0.85,
            speed_share: 0.0,
        }
    }
}

/// A prepared drive.
#[derive(Debug)]
pub struct DrivePlan {
    /// The settings that it was computed from.
    pub source_settings: DriveSettings,
    /// The same with the track as its text.
    pub settings: DriveSettings,
    /// The line.
    pub line: TrackLine,
    /// What the car can do with all of its grip.
    pub ggv: GgvDiagram,
    /// The speeds.
    pub profile: SpeedProfile,
    /// Steady slip angles.
    pub handling: SteadyStateHandling,
    /// Largest slip angle of the front axle that still gives more force [rad].
    pub front_slip: f64,
}

impl DrivePlan {
    /// Prepares a drive.
    ///
    /// # Errors
    /// When the track cannot be read or cannot be driven by the car, with the parameter and the place.
    pub fn prepare(settings: &DriveSettings) -> Result<Self, String> {
        let track = settings.track.load_if_path("track.csv")?;
        let (source_settings, settings) = (settings.clone(), DriveSettings { track, ..settings.clone() });
        let DriveSettings { car, limit, grip, speed_share, .. } = &settings;
        let line = read_line(&settings.track).map_err(|error| format!("track.csv: {error}"))?;
        check_curvature(&line, car.body.wheelbase(), limit.delta)
            .map_err(|error| format!("track.csv: {error}"))?;
        let of_car = |error: Error| format!("the parameters of the car give no limits: {error}");
        let axles = car.build_axles()?;
        let ggv = ggv_diagram(car, &axles, limit).map_err(of_car)?;
        let handling = steady_state_handling(car, &axles).map_err(of_car)?;
        let bounds = SpeedBounds { top: limit.v, start: None, end: Some(0.0) };
        let profile = match *speed_share > 0.0 {
            true => SpeedProfile::from_line(&line, *speed_share, limit.v),
            false => SpeedProfile::fastest_on_line(&line, &ggv.with_grip(*grip), &bounds),
        };
        let profile = profile.map_err(|error| format!("track.csv: {error}"))?;
        let front_slip = peak_front_slip(car, &axles);
        Ok(DrivePlan { source_settings, line, ggv, profile, handling, front_slip, settings })
    }
}

fn read_line(text: &SharedText) -> Result<TrackLine, Error> {
    if !text.get().is_empty() {
        return TrackLine::from_table_text(text.get());
    }
    let point = |i: i32| {
        let angle = TAU * f64::from(i) / 180.0;
        [CIRCLE * angle.sin(), CIRCLE * (1.0 - angle.cos())]
    };
    let points = (0..180).map(point).collect();
    TrackLine::from_survey(&TrackSurvey { points, closed: true, ..TrackSurvey::default() })
}

/// Whether a car that rolls without slip can follow the line with its largest steering angle: |κ| L ≤ δ.
fn check_curvature(line: &TrackLine, wheelbase: f64, delta: f64) -> Result<(), Error> {
    let tightest = delta / wheelbase;
    match line.knot_stations().find(|s| line.curvature_at(*s).abs() > tightest) {
        None => Ok(()),
        Some(s) => {
            let (found, least) = (1.0 / line.curvature_at(s).abs(), 1.0 / tightest);
            let message = format!(
                "expected a radius of at least {least:.1} m, which is what limit.delta and the wheelbase allow, found {found:.1} m"
            );
            Err(Error::Place { s, message })
        }
    }
}
