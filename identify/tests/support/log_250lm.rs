//! Reads the recording of a 1964 Ferrari 250 LM, if it is at hand, and identifies its tires from parts of it by both tasks.
#![allow(dead_code, reason = "each user needs a part")]

use drive_inference::{Drive, DriveIdentification, identify_tires};
use identify::config::{ClosedLoop, IdentifyConfig, TiresConfig};
use preparation::direction::ForceDirection;
use preparation::{DriveLog, PreparationPipeline};
use tire_inference::axles::Axles;
use tire_inference::estimate::TireEstimate;
use tire_inference::fit::FitOptions;
use tire_inference::settings::{FitMethod, IdentificationSettings};

use crate::real_log::RealLog;

/// The car as `scenarios/tires_250lm.toml` has it.
const CAR: &str = "aero = \"none\"\n[car.body]\nm = 982.0\nI_zz = 1605.0\nl_f = 1.33\nl_r = 1.07\nh = { value = 0.45, std = 0.05 }";
const MASS: f64 = 982.0;

/// The file.
pub struct Log(RealLog);

impl Log {
    /// The recording; `None` where it is not at hand.
    pub fn read() -> Option<Self> {
        RealLog::read("revs_250lm.csv").map(Self)
    }

    /// A column between two times, from the beginning of the recording on [s].
    fn column(&self, title: &str, [from, until]: [f64; 2]) -> Vec<f64> {
        let time = self.0.column("t_s", 1.0);
        let inside = |t: f64| (from..until).contains(&(t - time[0]));
        let values = self.0.column(title, 1.0).into_iter();
        time.iter().zip(values).filter(|(t, _)| inside(**t)).map(|(_, value)| value).collect()
    }

    /// What `task = "closed_loop"` needs; the force is that of the forward acceleration.
    pub fn drive(&self, window: [f64; 2]) -> Drive {
        let of = |title: &str| self.column(title, window);
        Drive {
            t: of("t_s"),
            v_x: of("vx_mps"),
            v_y: of("vy_mps"),
            r: of("yaw_rate_radps"),
            a_y: of("ay_mps2"),
            F_x: of("ax_mps2").iter().map(|a_x| MASS * a_x).collect(),
            delta: of("delta_rad"),
            ..Drive::default()
        }
    }

    /// What `task = "tires"` needs.
    pub fn signals(&self, window: [f64; 2]) -> DriveLog<'static> {
        let mut log = DriveLog::default();
        for (name, title) in [
            ("v_x", "vx_mps"),
            ("v_y", "vy_mps"),
            ("a_x", "ax_mps2"),
            ("a_y", "ay_mps2"),
            ("r", "yaw_rate_radps"),
            ("delta", "delta_rad"),
        ] {
            log.insert(name, self.column("t_s", window), self.column(title, window));
        }
        log
    }
}

/// `task = "closed_loop"` of this car; `more` are further lines of the configuration, `of_car` of its car.
pub fn closed_loop(more: &str, of_car: &str) -> ClosedLoop {
    let text = format!("task = \"closed_loop\"\n{more}\n[car]\nbrake_front_share = 0.6\n{of_car}\n{CAR}");
    match IdentifyConfig::parse(&text) {
        Ok(IdentifyConfig::ClosedLoop(config)) => *config,
        other => panic!("{other:?}"),
    }
}

/// `task = "tires"` of this car.
pub fn tires(more: &str, of_car: &str) -> TiresConfig {
    let text = format!(
        "task = \"tires\"\n{more}\n[car]\nbrake_front_share = \"by_load\"\ndrive_front_share = 0.0\n{of_car}\n{CAR}"
    );
    match IdentifyConfig::parse(&text) {
        Ok(IdentifyConfig::Tires(config)) => *config,
        other => panic!("{other:?}"),
    }
}

/// Both axles by prediction errors.
pub fn by_drive(config: &ClosedLoop, drive: &Drive) -> DriveIdentification {
    let options = config.drive_options().expect("a car");
    identify_tires(std::slice::from_ref(drive), &options, &mut |_, _| true).expect("tires")
}

/// Both axles by their points, without what the car adds to their uncertainty.
pub fn by_points(config: &TiresConfig, log: &DriveLog) -> Axles<TireEstimate> {
    let (car, _) = config.car().expect("a car");
    let pipeline = PreparationPipeline { car, ..config.prepare.clone() };
    let prepared = pipeline.prepare(log).expect("points");
    let of = |axle: &preparation::AxleCurvePoints| {
        let points = &axle.lateral;
        let usual = config.lateral.fit_settings(ForceDirection::Lateral, points.shift, 0);
        let settings = IdentificationSettings { options: FitOptions::default(), ..usual };
        let settings = config.lateral.loss.apply_to_settings(settings, &points.samples).expect("a noise");
        let found =
            tire_inference::estimate::identify_tire(&points.samples, &settings, &[FitMethod::LeastSquares]);
        found.expect("a tire").estimates.swap_remove(0).1
    };
    Axles { front: of(&prepared.front), rear: of(&prepared.rear) }
}
