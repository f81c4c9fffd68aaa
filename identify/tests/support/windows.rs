//! Judges random windows of recordings of real cars by the fit of all their data.
#![allow(dead_code, reason = "each user needs a part")]

use std::time::Instant;

use preparation::{BrakeShare, Car, DriveLog, PreparationPipeline, PreparedRecording, ShareRule};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use tire_inference::axles::{Axle, Axles};
use tire_inference::local::{StretchFit, StretchPrior};
use tire_inference::parameters::Theta;
use tire_inference::window::{WindowIdentifiability, WindowRequirement};
use vehicle::{Aerodynamics, VehicleBody};

use crate::real_log::RealLog;

/// A recording, the car that it is of, and what is usual of its sensors.
pub struct Log {
    pub name: &'static str,
    pub recording: DriveLog<'static>,
    pub pipeline: PreparationPipeline,
    pub claims: Axles<WindowRequirement>,
}

const SIGNALS: [&str; 6] = ["v_x", "v_y", "a_x", "a_y", "r", "delta"];

impl Log {
    fn read(
        name: &'static str,
        time: &str,
        columns: [&str; 6],
        pipeline: PreparationPipeline,
        slip_offsets: [f64; 2],
    ) -> Option<Self> {
        let log = RealLog::read(name)?;
        let mut recording = DriveLog::default();
        for (signal, column) in SIGNALS.into_iter().zip(columns) {
            recording.insert(signal, log.column(time, 1.0), log.column(column, 1.0));
        }
        let [front, rear] = slip_offsets.map(|slip_offset| {
            let usual = StretchPrior { slip_offset, ..StretchPrior::default() };
            WindowRequirement { usual, ..WindowRequirement::default() }
        });
        Some(Self { name, recording, pipeline, claims: Axles { front, rear } })
    }

    /// A 1964 Ferrari 250 LM on a race track.
    pub fn of_250lm() -> Option<Self> {
        let body = VehicleBody { m: 982.0, I_zz: 1605.0, l_f: 1.33, l_r: 1.07, h: 0.45 };
        let columns = ["vx_mps", "vy_mps", "ax_mps2", "ay_mps2", "yaw_rate_radps", "delta_rad"];
        let pipeline =
            PreparationPipeline { car: car(body, 0.0), min_speed: 12.0, ..PreparationPipeline::default() };
        Self::read("revs_250lm.csv", "t_s", columns, pipeline, [0.001; 2])
    }

    /// A 1:10 car, driven freely; its steering has a play of 0.015 rad, and its body stands in the frame of the cameras at 0.0075 rad.
    pub fn of_dart(name: &'static str) -> Option<Self> {
        let body = VehicleBody { m: 1.58, I_zz: 0.0048, l_f: 0.0805, l_r: 0.093, h: 0.03 };
        let columns = ["v_x", "v_y", "a_x", "a_y", "yaw_rate", "steering_angle_lag_rad"];
        // Frames are smoothed already.
        let drop_held = false;
        let pipeline = PreparationPipeline {
            car: car(body, 0.5),
            min_speed: 0.6,
            drop_held,
            ..PreparationPipeline::default()
        };
        Self::read(name, "time_s", columns, pipeline, [0.015, 0.0075])
    }

    /// The curves of all data.
    pub fn of_all(&self) -> Axles<Theta> {
        let all = self.pipeline.prepare(&self.recording).expect("points of all data");
        let fit = |axle| {
            let (series, load) = self.axle(&all, axle);
            StretchFit::fit(series, load, &self.claims[axle].usual).expect("a curve of all data").theta
        };
        Axles { front: fit(Axle::Front), rear: fit(Axle::Rear) }
    }

    fn axle<'a>(
        &self,
        prepared: &'a PreparedRecording,
        axle: Axle,
    ) -> (&'a preparation::PointTimeSeries, f64) {
        let [front, rear] = self.pipeline.car.body.static_loads();
        match axle {
            Axle::Front => (&prepared.front.lateral.series, front),
            Axle::Rear => (&prepared.rear.lateral.series, rear),
        }
    }

    /// Both axles of a window from its raw signals, which know nothing of the rest; `None` where nothing is fast enough.
    pub fn window(&self, from: f64, length: f64) -> Option<Axles<WindowIdentifiability>> {
        let mut part = DriveLog::default();
        for name in SIGNALS {
            let signal = self.recording.get(name)?;
            let rows = signal.time.partition_point(|t| *t < from)
                ..signal.time.partition_point(|t| *t < from + length);
            part.insert(name, signal.time[rows.clone()].to_vec(), signal.value[rows].to_vec());
        }
        let prepared = self.pipeline.prepare(&part).ok()?;
        let of = |axle| {
            let (series, load) = self.axle(&prepared, axle);
            WindowIdentifiability::judge(series, load, &self.claims[axle])
        };
        Some(Axles { front: of(Axle::Front), rear: of(Axle::Rear) })
    }
}

fn car(body: VehicleBody, drive_front_share: f64) -> Car {
    let aero = Aerodynamics { C_d: 0.0, C_lf: 0.0, C_lr: 0.0, ..Aerodynamics::default() };
    let brake_front_share = BrakeShare::Rule(ShareRule::ByLoad);
    Car { body, aero, drive_front_share, brake_front_share, ..Car::default() }
}

/// What was found in many windows.
#[derive(Default)]
pub struct Tally {
    /// Windows with a drive.
    pub windows: usize,
    /// Errors of all curves, by axle, and whether the curve was claimed.
    pub errors: Axles<Vec<(f64, bool)>>,
    /// Wall time of each, both axles [s].
    pub seconds: Vec<f64>,
}

impl Tally {
    /// Windows at random times.
    pub fn of(log: &Log, count: usize, length: f64, seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let truth = log.of_all();
        let time = &log.recording.get("v_x").expect("a speed").time;
        let [first, last] = [time[0], time[time.len() - 1] - length];
        let mut tally = Self::default();
        for _ in 0..10 * count {
            if tally.windows == count {
                break;
            }
            let from = first + (last - first) * random.random::<f64>();
            let begin = Instant::now();
            let Some(found) = log.window(from, length) else { continue };
            tally.seconds.push(begin.elapsed().as_secs_f64());
            tally.windows += 1;
            for axle in Axle::ALL {
                let claimed = found[axle].obstacle.is_none();
                if let Some(error) = found[axle].curve_error(&truth[axle]) {
                    tally.errors[axle].push((error, claimed));
                }
            }
        }
        tally
    }

    /// Claims of an axle: how many, and how many of them are within a tolerance.
    pub fn claims(&self, axle: Axle, tolerance: f64) -> [usize; 2] {
        let claimed = self.errors[axle].iter().filter(|(_, claimed)| *claimed);
        [claimed.clone().count(), claimed.filter(|(error, _)| *error <= tolerance).count()]
    }
}
