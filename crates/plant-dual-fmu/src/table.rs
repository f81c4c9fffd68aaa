//! Lists the variables of the FMU, and the parameters that they start with.

use fmu_export::{Variable, input, output, parameter};
use vehicle::dual_track::{AeroMap, Brakes, Drive, Parameters, Suspension};
use vehicle::{Aero, Body};

use super::Plant;

/// A sports car with rear-wheel drive.
pub(crate) fn parameters() -> Parameters {
    let body = Body { m: 1400.0, I_zz: 2200.0, l_f: 1.3, l_r: 1.25, h: 0.48 };
    let constant = Aero { area: 2.0, C_d: 0.33, ..Aero::default() };
    let suspension = Suspension { I_xx: 450.0, I_yy: 1900.0, ..Suspension::default() };
    let brakes = Brakes { front_share: 0.62, ..Brakes::default() };
    let drive = Drive { torque_max: 3500.0, power_max: 220e3, ..Drive::default() };
    Parameters {
        body,
        suspension,
        aero: AeroMap { constant, ..AeroMap::default() },
        drive,
        brakes,
        ..Parameters::default()
    }
}

/// What forces and accelerations follow at once: compliance lets the front axle steer under load, and slopes act on the body.
const ALL: &[&str] = &["F_x", "delta", "mu_fl", "mu_fr", "mu_rl", "mu_rr", "grade", "bank"];

pub(crate) const VARIABLES: &[Variable<Plant>] = &[
    input("F_x", "N", "Demanded sum of driving forces; braking when negative")
        .at(|p| &mut p.input.F_x),
    input("delta", "rad", "Mean road-wheel angle of the front wheels").at(|p| &mut p.input.delta),
    input(
        "mu_fl",
        "1",
        "Friction of the road under the front left wheel, relative to that of the tire file",
    )
    .optional()
    .at(|p| &mut p.input.mu[0]),
    input(
        "mu_fr",
        "1",
        "Friction of the road under the front right wheel, relative to that of the tire file",
    )
    .optional()
    .at(|p| &mut p.input.mu[1]),
    input(
        "mu_rl",
        "1",
        "Friction of the road under the rear left wheel, relative to that of the tire file",
    )
    .optional()
    .at(|p| &mut p.input.mu[2]),
    input(
        "mu_rr",
        "1",
        "Friction of the road under the rear right wheel, relative to that of the tire file",
    )
    .optional()
    .at(|p| &mut p.input.mu[3]),
    input("grade", "rad", "Slope of the road along the car, positive uphill")
        .optional()
        .at(|p| &mut p.input.grade),
    input(
        "bank",
        "rad",
        "Slope of the road across the car, positive while the left side is higher",
    )
    .optional()
    .at(|p| &mut p.input.bank),
    output("X", "m", "Position east").depends_on(&[]).at(|p| &mut p.state.planar.X),
    output("Y", "m", "Position north").depends_on(&[]).at(|p| &mut p.state.planar.Y),
    output("psi", "rad", "Heading, counter-clockwise from X")
        .depends_on(&[])
        .at(|p| &mut p.state.planar.psi),
    output("v_x", "m/s", "Forward speed of the centre of gravity")
        .depends_on(&[])
        .at(|p| &mut p.state.planar.v_x),
    output("v_y", "m/s", "Speed to the left of the centre of gravity")
        .depends_on(&[])
        .at(|p| &mut p.state.planar.v_y),
    output("r", "rad/s", "Yaw rate").depends_on(&[]).at(|p| &mut p.state.planar.r),
    output("a_x", "m/s2", "Forward acceleration along the road")
        .depends_on(ALL)
        .at(|p| &mut p.seen.a_x),
    output("a_y", "m/s2", "Acceleration to the left along the road")
        .depends_on(ALL)
        .at(|p| &mut p.seen.a_y),
    output("roll", "rad", "Roll angle, positive while the left side is up")
        .depends_on(&[])
        .at(|p| &mut p.state.attitude.phi),
    output("pitch", "rad", "Pitch angle, positive while the nose is down")
        .depends_on(&[])
        .at(|p| &mut p.state.attitude.theta),
    output("heave", "m", "Height of the centre of gravity over that at rest")
        .depends_on(&[])
        .at(|p| &mut p.state.attitude.z),
    output("wheel_fl.F_x", "N", "Front left wheel: longitudinal force")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[0].F_x),
    output("wheel_fl.F_y", "N", "Front left wheel: lateral force")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[0].F_y),
    output("wheel_fl.F_z", "N", "Front left wheel: load")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[0].F_z),
    output("wheel_fl.M_z", "N.m", "Front left wheel: aligning moment")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[0].M_z),
    output("wheel_fl.kappa", "1", "Front left wheel: longitudinal slip")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[0].kappa),
    output(
        "wheel_fl.alpha",
        "rad",
        "Front left wheel: slip angle, positive while the contact point moves to the left",
    )
    .depends_on(ALL)
    .at(|p| &mut p.seen.wheels[0].alpha),
    output(
        "wheel_fl.gamma",
        "rad",
        "Front left wheel: inclination to the road, positive to the right",
    )
    .depends_on(ALL)
    .at(|p| &mut p.seen.wheels[0].gamma),
    output("wheel_fl.torque", "N.m", "Front left wheel: driving less braking torque")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[0].torque),
    output("wheel_fl.omega", "rad/s", "Front left wheel: angular velocity")
        .depends_on(&[])
        .at(|p| &mut p.state.wheels[0].omega),
    output("wheel_fr.F_x", "N", "Front right wheel: longitudinal force")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[1].F_x),
    output("wheel_fr.F_y", "N", "Front right wheel: lateral force")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[1].F_y),
    output("wheel_fr.F_z", "N", "Front right wheel: load")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[1].F_z),
    output("wheel_fr.M_z", "N.m", "Front right wheel: aligning moment")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[1].M_z),
    output("wheel_fr.kappa", "1", "Front right wheel: longitudinal slip")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[1].kappa),
    output(
        "wheel_fr.alpha",
        "rad",
        "Front right wheel: slip angle, positive while the contact point moves to the left",
    )
    .depends_on(ALL)
    .at(|p| &mut p.seen.wheels[1].alpha),
    output(
        "wheel_fr.gamma",
        "rad",
        "Front right wheel: inclination to the road, positive to the right",
    )
    .depends_on(ALL)
    .at(|p| &mut p.seen.wheels[1].gamma),
    output("wheel_fr.torque", "N.m", "Front right wheel: driving less braking torque")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[1].torque),
    output("wheel_fr.omega", "rad/s", "Front right wheel: angular velocity")
        .depends_on(&[])
        .at(|p| &mut p.state.wheels[1].omega),
    output("wheel_rl.F_x", "N", "Rear left wheel: longitudinal force")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[2].F_x),
    output("wheel_rl.F_y", "N", "Rear left wheel: lateral force")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[2].F_y),
    output("wheel_rl.F_z", "N", "Rear left wheel: load")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[2].F_z),
    output("wheel_rl.M_z", "N.m", "Rear left wheel: aligning moment")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[2].M_z),
    output("wheel_rl.kappa", "1", "Rear left wheel: longitudinal slip")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[2].kappa),
    output(
        "wheel_rl.alpha",
        "rad",
        "Rear left wheel: slip angle, positive while the contact point moves to the left",
    )
    .depends_on(ALL)
    .at(|p| &mut p.seen.wheels[2].alpha),
    output(
        "wheel_rl.gamma",
        "rad",
        "Rear left wheel: inclination to the road, positive to the right",
    )
    .depends_on(ALL)
    .at(|p| &mut p.seen.wheels[2].gamma),
    output("wheel_rl.torque", "N.m", "Rear left wheel: driving less braking torque")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[2].torque),
    output("wheel_rl.omega", "rad/s", "Rear left wheel: angular velocity")
        .depends_on(&[])
        .at(|p| &mut p.state.wheels[2].omega),
    output("wheel_rr.F_x", "N", "Rear right wheel: longitudinal force")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[3].F_x),
    output("wheel_rr.F_y", "N", "Rear right wheel: lateral force")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[3].F_y),
    output("wheel_rr.F_z", "N", "Rear right wheel: load")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[3].F_z),
    output("wheel_rr.M_z", "N.m", "Rear right wheel: aligning moment")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[3].M_z),
    output("wheel_rr.kappa", "1", "Rear right wheel: longitudinal slip")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[3].kappa),
    output(
        "wheel_rr.alpha",
        "rad",
        "Rear right wheel: slip angle, positive while the contact point moves to the left",
    )
    .depends_on(ALL)
    .at(|p| &mut p.seen.wheels[3].alpha),
    output(
        "wheel_rr.gamma",
        "rad",
        "Rear right wheel: inclination to the road, positive to the right",
    )
    .depends_on(ALL)
    .at(|p| &mut p.seen.wheels[3].gamma),
    output("wheel_rr.torque", "N.m", "Rear right wheel: driving less braking torque")
        .depends_on(ALL)
        .at(|p| &mut p.seen.wheels[3].torque),
    output("wheel_rr.omega", "rad/s", "Rear right wheel: angular velocity")
        .depends_on(&[])
        .at(|p| &mut p.state.wheels[3].omega),
    output("tires.outside", "", "Wheels whose tire is outside of its limits of validity")
        .depends_on(&[])
        .at_integer(|p| &mut p.seen.outside),
    parameter("body.m", "kg", "Mass").min(1.0).at(|p| &mut p.parameters.body.m),
    parameter("body.I_zz", "kg.m2", "Yaw inertia").min(1.0).at(|p| &mut p.parameters.body.I_zz),
    parameter("body.I_xx", "kg.m2", "Roll inertia")
        .min(1.0)
        .at(|p| &mut p.parameters.suspension.I_xx),
    parameter("body.I_yy", "kg.m2", "Pitch inertia")
        .min(1.0)
        .at(|p| &mut p.parameters.suspension.I_yy),
    parameter("body.l_f", "m", "Centre of gravity to front axle")
        .min(0.01)
        .at(|p| &mut p.parameters.body.l_f),
    parameter("body.l_r", "m", "Centre of gravity to rear axle")
        .min(0.01)
        .at(|p| &mut p.parameters.body.l_r),
    parameter("body.h", "m", "Height of the centre of gravity")
        .min(0.0)
        .at(|p| &mut p.parameters.body.h),
    parameter("body.track_f", "m", "Track width of the front axle")
        .min(0.01)
        .at(|p| &mut p.parameters.suspension.track[0]),
    parameter("body.track_r", "m", "Track width of the rear axle")
        .min(0.01)
        .at(|p| &mut p.parameters.suspension.track[1]),
    parameter("ride.stiffness_f", "N/m", "Vertical stiffness at each front wheel, tire included")
        .min(1.0)
        .at(|p| &mut p.parameters.suspension.ride_stiffness[0]),
    parameter("ride.damping_f", "N.s/m", "Vertical damping at each front wheel")
        .min(0.0)
        .at(|p| &mut p.parameters.suspension.ride_damping[0]),
    parameter("roll.stiffness_f", "N.m/rad", "Roll stiffness of the front axle, springs and bar")
        .min(0.0)
        .at(|p| &mut p.parameters.suspension.roll_stiffness[0]),
    parameter("roll.damping_f", "N.m.s/rad", "Roll damping of the front axle")
        .min(0.0)
        .at(|p| &mut p.parameters.suspension.roll_damping[0]),
    parameter("roll.centre_f", "m", "Height of the roll centre of the front axle")
        .min(-10.0)
        .max(10.0)
        .at(|p| &mut p.parameters.suspension.roll_centre[0]),
    parameter("ride.stiffness_r", "N/m", "Vertical stiffness at each rear wheel, tire included")
        .min(1.0)
        .at(|p| &mut p.parameters.suspension.ride_stiffness[1]),
    parameter("ride.damping_r", "N.s/m", "Vertical damping at each rear wheel")
        .min(0.0)
        .at(|p| &mut p.parameters.suspension.ride_damping[1]),
    parameter("roll.stiffness_r", "N.m/rad", "Roll stiffness of the rear axle, springs and bar")
        .min(0.0)
        .at(|p| &mut p.parameters.suspension.roll_stiffness[1]),
    parameter("roll.damping_r", "N.m.s/rad", "Roll damping of the rear axle")
        .min(0.0)
        .at(|p| &mut p.parameters.suspension.roll_damping[1]),
    parameter("roll.centre_r", "m", "Height of the roll centre of the rear axle")
        .min(-10.0)
        .max(10.0)
        .at(|p| &mut p.parameters.suspension.roll_centre[1]),
    parameter("pitch.centre", "m", "Height of the pitch centre")
        .min(-10.0)
        .max(10.0)
        .at(|p| &mut p.parameters.suspension.pitch_centre),
    parameter(
        "suspension.dynamic",
        "",
        "Whether heave, roll and pitch swing; otherwise they are steady",
    )
    .at_boolean(|p| &mut p.parameters.suspension.dynamic),
    parameter("suspension.lag", "s", "Time in which links pass forces on to the loads")
        .min(0.001)
        .at(|p| &mut p.parameters.suspension.lag),
    parameter("steer.ackermann", "1", "Share of Ackermann's geometry")
        .min(-2.0)
        .max(2.0)
        .at(|p| &mut p.parameters.steering.ackermann),
    parameter(
        "steer.compliance",
        "rad/N",
        "Steering angle lost for a lateral force on the front axle",
    )
    .min(0.0)
    .at(|p| &mut p.parameters.steering.compliance),
    parameter("aero.rho", "kg/m3", "Density of the air")
        .min(0.0)
        .at(|p| &mut p.parameters.aero.constant.rho),
    parameter("aero.area", "m2", "Frontal area")
        .min(0.0)
        .at(|p| &mut p.parameters.aero.constant.area),
    parameter("aero.C_d", "1", "Drag coefficient")
        .min(0.0)
        .at(|p| &mut p.parameters.aero.constant.C_d),
    parameter("aero.C_lf", "1", "Downforce coefficient of the front axle")
        .at(|p| &mut p.parameters.aero.constant.C_lf),
    parameter("aero.C_lr", "1", "Downforce coefficient of the rear axle")
        .at(|p| &mut p.parameters.aero.constant.C_lr),
    parameter("drive.front_share", "1", "Share of the driving torque at the front axle")
        .min(0.0)
        .max(1.0)
        .at(|p| &mut p.parameters.drive.front_share),
    parameter("drive.torque_max", "N.m", "Largest driving torque of all wheels together")
        .min(0.0)
        .at(|p| &mut p.parameters.drive.torque_max),
    parameter("drive.power_max", "W", "Largest driving power")
        .min(0.0)
        .at(|p| &mut p.parameters.drive.power_max),
    parameter(
        "diff_f.drive_lock",
        "1",
        "Front differential: torque difference over torque while driving",
    )
    .min(0.0)
    .max(1.0)
    .at(|p| &mut p.parameters.drive.locks[0].drive),
    parameter(
        "diff_f.coast_lock",
        "1",
        "Front differential: torque difference over torque while coasting",
    )
    .min(0.0)
    .max(1.0)
    .at(|p| &mut p.parameters.drive.locks[0].coast),
    parameter("diff_f.preload", "N.m", "Front differential: torque difference without load")
        .min(0.0)
        .at(|p| &mut p.parameters.drive.locks[0].preload),
    parameter(
        "diff_f.sensitivity",
        "s/rad",
        "Front differential: growth of the locking with the speed difference",
    )
    .min(0.0)
    .at(|p| &mut p.parameters.drive.locks[0].sensitivity),
    parameter(
        "diff_r.drive_lock",
        "1",
        "Rear differential: torque difference over torque while driving",
    )
    .min(0.0)
    .max(1.0)
    .at(|p| &mut p.parameters.drive.locks[1].drive),
    parameter(
        "diff_r.coast_lock",
        "1",
        "Rear differential: torque difference over torque while coasting",
    )
    .min(0.0)
    .max(1.0)
    .at(|p| &mut p.parameters.drive.locks[1].coast),
    parameter("diff_r.preload", "N.m", "Rear differential: torque difference without load")
        .min(0.0)
        .at(|p| &mut p.parameters.drive.locks[1].preload),
    parameter(
        "diff_r.sensitivity",
        "s/rad",
        "Rear differential: growth of the locking with the speed difference",
    )
    .min(0.0)
    .at(|p| &mut p.parameters.drive.locks[1].sensitivity),
    parameter("brake.front_share", "1", "Share of the braking torque at the front axle")
        .min(0.0)
        .max(1.0)
        .at(|p| &mut p.parameters.brakes.front_share),
    parameter("brake.torque_max", "N.m", "Largest torque of all brakes together")
        .min(0.0)
        .at(|p| &mut p.parameters.brakes.torque_max),
    parameter("brake.windup", "rad", "Angle that a wheel at rest turns until its brake holds")
        .min(0.001)
        .at(|p| &mut p.parameters.brakes.windup),
    parameter("wheel.I_yy", "kg.m2", "Moment of inertia of a wheel about its axis")
        .min(0.001)
        .at(|p| &mut p.parameters.rims.I_yy),
    parameter("wheel.relaxation_min", "m", "Shortest relaxation length")
        .min(0.001)
        .at(|p| &mut p.parameters.rims.relaxation_min),
    parameter(
        "tire_f.tir",
        "",
        "Front tires: text of a .tir file or its path; empty for a sports tire",
    )
    .at_string(|p| &mut p.tires[0].tir),
    parameter("tire_f.LMUX", "1", "Front tires: factor to the longitudinal friction")
        .min(0.0)
        .at(|p| &mut p.tires[0].LMUX),
    parameter("tire_f.LMUY", "1", "Front tires: factor to the lateral friction")
        .min(0.0)
        .at(|p| &mut p.tires[0].LMUY),
    parameter("tire_f.LKX", "1", "Front tires: factor to the slip stiffness")
        .min(0.0)
        .at(|p| &mut p.tires[0].LKX),
    parameter("tire_f.LKY", "1", "Front tires: factor to the cornering stiffness")
        .min(0.0)
        .at(|p| &mut p.tires[0].LKY),
    parameter(
        "tire_r.tir",
        "",
        "Rear tires: text of a .tir file or its path; empty for a sports tire",
    )
    .at_string(|p| &mut p.tires[1].tir),
    parameter("tire_r.LMUX", "1", "Rear tires: factor to the longitudinal friction")
        .min(0.0)
        .at(|p| &mut p.tires[1].LMUX),
    parameter("tire_r.LMUY", "1", "Rear tires: factor to the lateral friction")
        .min(0.0)
        .at(|p| &mut p.tires[1].LMUY),
    parameter("tire_r.LKX", "1", "Rear tires: factor to the slip stiffness")
        .min(0.0)
        .at(|p| &mut p.tires[1].LKX),
    parameter("tire_r.LKY", "1", "Rear tires: factor to the cornering stiffness")
        .min(0.0)
        .at(|p| &mut p.tires[1].LKY),
    parameter("start.X", "m", "Initial position east").at(|p| &mut p.start.X),
    parameter("start.Y", "m", "Initial position north").at(|p| &mut p.start.Y),
    parameter("start.psi", "rad", "Initial heading").at(|p| &mut p.start.psi),
    parameter("start.v_x", "m/s", "Initial forward speed, at which the wheels roll")
        .at(|p| &mut p.start.v_x),
    parameter("start.v_y", "m/s", "Initial speed to the left").at(|p| &mut p.start.v_y),
    parameter("start.r", "rad/s", "Initial yaw rate").at(|p| &mut p.start.r),
    parameter(
        "solver.substep",
        "s",
        "Largest step of the integrator, which takes shorter ones where the car needs them",
    )
    .min(1e-6)
    .at(|p| &mut p.substep),
];
