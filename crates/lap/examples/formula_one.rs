//! Laps the Formula One car of the program fastest-lap on its Catalunya, and compares the lap time with the one that it keeps for its tests.
//!
//! `cargo run --release --package lap --example formula_one -- FOLDER`, with a checkout of github.com/juanmanzanero/fastest-lap.
//! The car is that of G. Perantoni and D. Limebeer, Vehicle System Dynamics 52 (2014), 653.
#![allow(non_snake_case, reason = "symbols as in vehicle dynamics")]

use std::error::Error;
use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use lap::{
    ActuatorLimits, BrakeBalance, LapCar, LapDifferential, LapOptimum, LapOptions, LapTire, SlipDual,
    TireModel,
};
use roxmltree::{Document, Node};
use tire::{Number, TireOperatingPoint};
use track::TrackLine;
use vehicle::{Aerodynamics, VehicleBody};

const CAR: &str = "database/vehicles/f1/limebeer-2014-f1.xml";
const TRACK: &str = "database/tracks/catalunya/catalunya_adapted.xml";
const REFERENCE: &str = "src/test/applications/data/f1_optimal_laptime_catalunya_adapted.xml";

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("expected the folder of fastest-lap")?;
    let read = |file: &str| std::fs::read_to_string(Path::new(&folder).join(file));
    let (car, track, reference) = (read(CAR)?, read(TRACK)?, read(REFERENCE)?);
    let (car, track, reference) =
        (Document::parse(&car)?, Document::parse(&track)?, Document::parse(&reference)?);
    let expected = number(&reference, "optimal_laptime/laptime")?;
    let line = line(&track)?;
    let car = car_of(&car)?;
    println!("{:.1} m, lap time of fastest-lap {expected:.3} s with 697 nodes", line.length());
    for nodes in [697, 1394] {
        let options =
            LapOptions { nodes: Some(nodes), margin: 0.5 * car.track_widths[0], ..LapOptions::default() };
        let begin = Instant::now();
        let lap = LapOptimum::find(&car, &line, &options)?;
        println!(
            "{nodes} nodes: {:.3} s, {:+.2} %, {:?} after {} steps in {:.1} s",
            lap.lap_time,
            100.0 * (lap.lap_time / expected - 1.0),
            lap.status,
            lap.iterations,
            begin.elapsed().as_secs_f64()
        );
    }
    Ok(())
}

/// The element that a path of names leads to.
fn element<'a>(document: &'a Document, path: &str) -> Result<Node<'a, 'a>, String> {
    path.split('/').try_fold(document.root(), |node, name| {
        node.children().find(|child| child.has_tag_name(name)).ok_or_else(|| format!("there is no {path}"))
    })
}

fn number(document: &Document, path: &str) -> Result<f64, Box<dyn Error>> {
    Ok(element(document, path)?.text().unwrap_or_default().trim().parse()?)
}

fn numbers(document: &Document, path: &str) -> Result<Vec<f64>, Box<dyn Error>> {
    let text = element(document, path)?.text().unwrap_or_default();
    Ok(text.split(',').map(|it| it.trim().parse()).collect::<Result<_, _>>()?)
}

/// The centre line with its widths. Axes there point to the right and down.
fn line(track: &Document) -> Result<TrackLine, Box<dyn Error>> {
    let column = |name: &str| numbers(track, &format!("circuit/data/{name}"));
    let (x, y) = (column("centerline/x")?, column("centerline/y")?);
    let (left, right) = (column("nl")?, column("nr")?);
    let mut text = String::from("# closed\nx_m,y_m,left_m,right_m\n");
    for k in 0..x.len() {
        writeln!(text, "{},{},{},{}", x[k], -y[k], left[k], right[k])?;
    }
    Ok(TrackLine::from_table_text(&text)?)
}

fn car_of(car: &Document) -> Result<LapCar, Box<dyn Error>> {
    let of = |path: &str| number(car, &format!("vehicle/{path}"));
    let (l_f, l_r) = (of("chassis/front_axle/x")?, -of("chassis/rear_axle/x")?);
    let body = VehicleBody {
        m: of("chassis/mass")?,
        I_zz: of("chassis/inertia/Izz")?,
        l_f,
        l_r,
        h: -of("chassis/com/z")?,
    };
    let (C_l, centre) = (of("chassis/aerodynamics/cl")?, of("chassis/pressure_center/x")?);
    let front = (l_r + centre) / (l_f + l_r);
    let aero = Aerodynamics {
        rho: of("chassis/aerodynamics/rho")?,
        area: of("chassis/aerodynamics/area")?,
        C_d: of("chassis/aerodynamics/cd")?,
        C_lf: front * C_l,
        C_lr: (1.0 - front) * C_l,
    };
    let roll_balance = of("chassis/roll_balance_coefficient")?;
    let radius = of("rear-tire/radius")?;
    let tire = |name: &str| -> Result<LapTire, Box<dyn Error>> {
        let model: Arc<dyn TireModel> = Arc::new(NormalisedSlipTire::read(car, name)?);
        Ok(model.into())
    };
    let brake_force = 2.0 * of("front-axle/brakes/max_torque")? / radius;
    Ok(LapCar {
        body,
        aero: aero.into(),
        track_widths: [of("front-axle/track")?, of("rear-axle/track")?],
        roll_stiffness: [roll_balance, 1.0 - roll_balance],
        suspension: None,
        brake_balance: BrakeBalance::FrontShare(of("chassis/brake_bias")?),
        drive_front_share: 0.0,
        differentials: [
            None,
            Some(viscous_differential(of("rear-axle/differential_stiffness")? / (radius * radius))),
        ],
        tires: [tire("front-tire")?, tire("rear-tire")?],
        engine_power: None,
        limits: ActuatorLimits {
            delta: 20_f64.to_radians(),
            delta_rate: 1.0,
            F_x_rate: 10.0 * brake_force,
            drive_force: brake_force,
            brake_force,
            power: 1e3 * of("rear-axle/engine/maximum-power")?,
        },
    })
}

/// A differential whose torque difference is proportional to that of the speeds, with the damping of one wheel [N s/m]: one that its
/// preload locks, far from its end.
fn viscous_differential(damping: f64) -> LapDifferential {
    const PRELOAD: f64 = 1e5;
    LapDifferential { drive_lock: 0.0, preload: PRELOAD, sensitivity: 2.0 * damping / PRELOAD }
}

/// Peaks that are linear in the load, over the slip vector normalised by the slips at them.
#[derive(Debug)]
struct NormalisedSlipTire {
    loads: [f64; 2],
    mu_x: [f64; 2],
    mu_y: [f64; 2],
    kappa: [f64; 2],
    alpha: [f64; 2],
    Q: [f64; 2],
}

impl NormalisedSlipTire {
    fn read(car: &Document, name: &str) -> Result<Self, Box<dyn Error>> {
        let of = |key: &str| number(car, &format!("vehicle/{name}/{key}"));
        let pair = |key: &str| -> Result<[f64; 2], Box<dyn Error>> {
            Ok([of(&format!("{key}-1"))?, of(&format!("{key}-2"))?])
        };
        Ok(NormalisedSlipTire {
            loads: pair("reference-load")?,
            mu_x: pair("mu-x-max")?,
            mu_y: pair("mu-y-max")?,
            kappa: pair("kappa-max")?,
            alpha: pair("lambda-max")?.map(f64::to_radians),
            Q: [of("Qx")?, of("Qy")?],
        })
    }

    fn forces<T: Number>(&self, slip: &TireOperatingPoint<T>) -> [T; 2] {
        let at_load = |[low, high]: [f64; 2]| {
            let [first, second] = self.loads;
            (slip.F_z - first) * ((high - low) / (second - first)) + low
        };
        let (kappa, alpha) = (slip.kappa / at_load(self.kappa), slip.alpha / at_load(self.alpha));
        let rho = (kappa * kappa + alpha * alpha + 1e-12).sqrt();
        let mu = |peak: [f64; 2], Q: f64| at_load(peak) * ((rho * (FRAC_PI_2 / Q.atan())).atan() * Q).sin();
        let [along, across] = [mu(self.mu_x, self.Q[0]), mu(self.mu_y, self.Q[1])];
        [along * slip.F_z * kappa / rho, -(across * slip.F_z * alpha / rho)]
    }
}

impl TireModel for NormalisedSlipTire {
    fn F_xy(&self, slip: &TireOperatingPoint) -> [f64; 2] {
        self.forces(slip)
    }

    fn F_xy_dual(&self, slip: &TireOperatingPoint<SlipDual>) -> [SlipDual; 2] {
        self.forces(slip)
    }
}
