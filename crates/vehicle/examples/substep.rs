//! Measures what one Runge-Kutta sub-step of each car costs: `cargo run --release -p vehicle --example substep [tires|single|dual]`.

use std::hint::black_box;
use std::time::Instant;

use tire::{
    Coefficients, MagicFormula, MagicFormulaVersion, MfSet, MfTire, Tire, TireOperatingPoint, TireSet,
};
use vehicle::detailed_track::{self, DetailedTrack, SteeringActuator, TireMounting, WheelDynamicsOptions};
use vehicle::dual_track::{DualTrack, DualTrackInput, DualTrackParameters, EngineTorque};
use vehicle::{BilinearMap, PiecewiseLinearCurve, PlanarState, RoadConditions, SingleTrackCar};

/// Time that this thread has had of a processor, so that other work on the machine matters little [s].
fn processor_time() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
}

/// Median of the times of one call [ns], over nine rounds; of the clock where the system does not tell that of the processor.
fn median(calls: u32, mut round: impl FnMut(u32)) -> f64 {
    let mut times: Vec<_> = (0..9)
        .map(|_| {
            let (start, before) = (Instant::now(), processor_time());
            round(calls);
            let elapsed = start.elapsed().as_secs_f64();
            let spent = before.zip(processor_time()).map_or(elapsed, |(a, b)| b - a);
            spent * 1e9 / f64::from(calls)
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[4]
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let only = std::env::args().nth(1);
    let wanted = |name: &str| only.as_deref().is_none_or(|it| it == name);
    if wanted("tires") {
        tires()?;
    }
    if wanted("single") {
        single_track()?;
    }
    if wanted("dual") {
        dual_track()?;
    }
    Ok(())
}

fn tires() -> Result<(), Box<dyn std::error::Error>> {
    for version in [MagicFormulaVersion::Mf52, MagicFormulaVersion::Mf61, MagicFormulaVersion::Mf62] {
        let tire = MfTire::new(Coefficients { version, ..Coefficients::sports_tire() })?;
        let slip = TireOperatingPoint {
            kappa: 0.02,
            alpha: -0.04,
            gamma: 0.02,
            F_z: 4200.0,
            v_x: 30.0,
            ..TireOperatingPoint::default()
        };
        let whole = median(200_000, |n| {
            for _ in 0..n {
                black_box(tire.forces(black_box(&slip)));
            }
        });
        let two = median(200_000, |n| {
            for _ in 0..n {
                black_box(tire.F_xy(black_box(&slip)));
            }
        });
        let set = MfSet::from([tire; 2]);
        let slips = [slip; 4];
        let four = median(500_000, |n| {
            for _ in 0..n {
                black_box(set.forces(black_box(&slips)));
            }
        });
        println!("{version}: {four:.0} ns for all forces and moments of four wheels");
        println!("{version}: {whole:.0} ns for all forces and moments, {two:.0} ns for F_x and F_y");
    }
    Ok(())
}

fn single_track() -> Result<(), Box<dyn std::error::Error>> {
    let plain = SingleTrackCar::default();
    let start = PlanarState { v_x: 30.0, ..PlanarState::default() };
    let input = vehicle::SingleTrackInput { F_x: 500.0, delta: 0.03 };
    let one = median(500_000, |n| {
        let mut state = start;
        for _ in 0..n {
            state = plain.advance(&state, black_box(&input), 1e-3, 1e-3);
        }
        black_box(state);
    });
    println!("single track on {:?}: {one:.0} ns a sub-step", MagicFormula::default());

    let mf61 = Coefficients { version: MagicFormulaVersion::Mf61, ..Coefficients::sports_tire() };
    let tires = MfSet::from([MfTire::new(mf61)?; 2]);
    let (none, all) = (
        WheelDynamicsOptions::default(),
        WheelDynamicsOptions { spin: true, combined: true, relaxation: true },
    );
    let steering = SteeringActuator { lag: 0.03, rate_max: 1.0, compliance: 1e-6 };
    for (options, steering, name) in [
        (none, SteeringActuator::default(), "MF 6.1"),
        (
            WheelDynamicsOptions { combined: true, ..none },
            SteeringActuator::default(),
            "MF 6.1, combined slip",
        ),
        (all, steering, "MF 6.1, every option"),
    ] {
        let parameters =
            detailed_track::DetailedSingleTrackParameters { options, steering, ..Default::default() };
        let car = DetailedTrack::new(parameters, tires.clone(), TireMounting::Mirrored)?;
        let start = car.rolling_state(PlanarState { v_x: 30.0, ..PlanarState::default() }, 0.03);
        let input = detailed_track::DetailedSingleTrackInput {
            F_x: 500.0,
            delta: 0.03,
            road: RoadConditions::default(),
        };
        let one = median(200_000, |n| {
            let mut state = start;
            for _ in 0..n {
                state = car.advance(&state, black_box(&input), 5e-4, 5e-4);
            }
            black_box(state);
        });
        println!("single track on {name}: {one:.0} ns a sub-step");
    }
    Ok(())
}

fn dual_track() -> Result<(), Box<dyn std::error::Error>> {
    for (name, parameters) in
        [("with roll and pitch", DualTrackParameters::default()), ("and every table", with_tables()?)]
    {
        let tires = [MfTire::new(Coefficients::sports_tire())?; 2];
        let car = DualTrack::new(parameters, MfSet::from(tires))?;
        let start = car.straight_rolling_state(30.0);
        let input = DualTrackInput { F_x: 500.0, delta: 0.03, ..DualTrackInput::default() };
        let one = median(200_000, |n| {
            let mut state = start;
            for _ in 0..n {
                state = car.advance(&state, black_box(&input), 5e-4, 5e-4);
            }
            black_box(state);
        });
        println!(
            "dual track on MF 6.2, {name}: {one:.0} ns a sub-step; the longest takes {:.2e} s",
            car.longest_substep()
        );
    }
    Ok(())
}

/// The car with tables of usual size: 9 points of kinematics, 5 by 5 of the air, 11 of the brakes, 10 by 6 of the engine.
fn with_tables() -> Result<DualTrackParameters, Box<dyn std::error::Error>> {
    let axis = |from: f64, to: f64, count: usize| -> Vec<f64> {
        (0..count).map(|i| from + (to - from) * i as f64 / (count - 1) as f64).collect()
    };
    let curve = |from, to, count, slope: f64| {
        let x = axis(from, to, count);
        let y = x.iter().map(|x| slope * x).collect();
        PiecewiseLinearCurve::new(x, y)
    };
    let mut parameters = DualTrackParameters::default();
    let steering = &mut parameters.steering;
    steering.toe = [curve(-0.08, 0.08, 9, -0.05)?, curve(-0.08, 0.08, 9, 0.04)?];
    steering.camber = [curve(-0.08, 0.08, 9, -0.4)?, curve(-0.08, 0.08, 9, -0.5)?];
    parameters.aero.ride_height = [0.08, 0.1];
    let air = (0..25).flat_map(|i| [0.4, 0.3 + 0.01 * f64::from(i), 0.6]).collect();
    parameters.aero.map = Some(BilinearMap::new(axis(0.03, 0.13, 5), axis(0.05, 0.15, 5), air)?);
    parameters.brakes.map = Some([curve(0.0, 1.0, 11, 4e3)?, curve(0.0, 1.0, 11, 2e3)?]);
    let torque = (0..60).map(|i| f64::from(i % 6) * 50.0 - f64::from(i)).collect();
    let engine = BilinearMap::new(axis(0.0, 1000.0, 10), axis(0.0, 1.0, 6), torque)?;
    parameters.drive.engine = Some(EngineTorque::Pedal(engine));
    parameters.drive.ratio = 5.0;
    Ok(parameters)
}
