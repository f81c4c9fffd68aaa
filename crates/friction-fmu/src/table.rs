//! Lists the variables of the estimator, and checks its parameters.

use fmu_export::{Causality, Variable, VariableAccess, input, output, parameter};

use crate::FrictionNode;

/// Everything but what is known before: a sample acts at the end of the step.
pub const VARIABLES: &[Variable<FrictionNode>] = &[
    input("v_x_meas", "m/s", "Measured forward speed").at(|f| &mut f.sample.v_x),
    input("v_y_meas", "m/s", "Measured speed to the left, with measured.v_y")
        .optional()
        .at(|f| &mut f.sample.v_y),
    input("r_meas", "rad/s", "Measured yaw rate").at(|f| &mut f.sample.r),
    input("a_y_meas", "m/s2", "Measured acceleration to the left").at(|f| &mut f.sample.a_y),
    input("delta", "rad", "Road-wheel angle").at(|f| &mut f.sample.delta),
    input("valid", "", "Whether this is a new sample: without it time passes")
        .optional()
        .at_boolean(|f| &mut f.valid),
    output("D_f", "1", "Peak factor of the front axle").at(|f| &mut f.axles[0].D),
    output("D_r", "1", "Peak factor of the rear axle").at(|f| &mut f.axles[1].D),
    output("K_f", "1/rad", "Stiffness of the front axle over its load").at(|f| &mut f.axles[0].K),
    output("K_r", "1/rad", "Stiffness of the rear axle over its load").at(|f| &mut f.axles[1].K),
    output("std.D_f", "1", "Standard deviation of D_f").at(|f| &mut f.axles[0].std_D),
    output("std.D_r", "1", "Standard deviation of D_r").at(|f| &mut f.axles[1].std_D),
    output("std.K_f", "1/rad", "Standard deviation of K_f").at(|f| &mut f.axles[0].std_K),
    output("std.K_r", "1/rad", "Standard deviation of K_r").at(|f| &mut f.axles[1].std_K),
    output("factor", "1", "Largest lateral force of both axles over the nominal one")
        .at(|f| &mut f.output.factor[0]),
    output("std.factor", "1", "Standard deviation of factor").at(|f| &mut f.output.factor[1]),
    output("v_y", "m/s", "Speed to the left").at(|f| &mut f.output.v_y[0]),
    output("std.v_y", "m/s", "Standard deviation of v_y").at(|f| &mut f.output.v_y[1]),
    output("beta", "rad", "Sideslip angle").at(|f| &mut f.output.beta[0]),
    output("std.beta", "rad", "Standard deviation of beta").at(|f| &mut f.output.beta[1]),
    output("informative_f", "", "Whether the slip of the front axle says something about D_f")
        .at_boolean(|f| &mut f.output.informative[0]),
    output("informative_r", "", "Whether the slip of the rear axle says something about D_r")
        .at_boolean(|f| &mut f.output.informative[1]),
    output("informative_time", "s", "For how long one of them did").at(|f| &mut f.output.informative_time),
    output("used", "", "Whether the sample was used").at_boolean(|f| &mut f.output.used),
    output("missing", "", "Samples that were no measurements of a car")
        .discrete()
        .at_integer(|f| &mut f.missing),
    output("alarm", "", "Whether friction is not the nominal one").at_boolean(|f| &mut f.output.alarm.raised),
    output("alarm_time", "s", "When that was told the last time; -1 before").at(|f| &mut f.output.alarm.time),
    output("alarm_since", "s", "When the estimate had left the band for it; -1 before")
        .at(|f| &mut f.output.alarm.since),
    parameter("body.m", "kg", "Mass").min(0.01).max(1e6).at(|f| &mut f.settings.body.m),
    parameter("body.I_zz", "kg.m2", "Yaw inertia").min(1e-6).max(1e8).at(|f| &mut f.settings.body.I_zz),
    parameter("body.l_f", "m", "Centre of gravity to front axle")
        .min(0.01)
        .max(100.0)
        .at(|f| &mut f.settings.body.l_f),
    parameter("body.l_r", "m", "Centre of gravity to rear axle")
        .min(0.01)
        .max(100.0)
        .at(|f| &mut f.settings.body.l_r),
    parameter("tire_f.B", "1/rad", "Nominal stiffness factor, front").at(|f| &mut f.tires[0].B),
    parameter("tire_f.C", "1", "Shape factor, front").at(|f| &mut f.tires[0].C),
    parameter("tire_f.D", "1", "Nominal peak factor, front").at(|f| &mut f.tires[0].D),
    parameter("tire_f.E", "1", "Curvature factor, front").at(|f| &mut f.tires[0].E),
    parameter("tire_f.S_h", "rad", "Horizontal shift, front").at(|f| &mut f.tires[0].S_h),
    parameter("tire_f.S_v", "1", "Vertical shift over the load, front").at(|f| &mut f.tires[0].S_v),
    parameter("tire_r.B", "1/rad", "Nominal stiffness factor, rear").at(|f| &mut f.tires[1].B),
    parameter("tire_r.C", "1", "Shape factor, rear").at(|f| &mut f.tires[1].C),
    parameter("tire_r.D", "1", "Nominal peak factor, rear").at(|f| &mut f.tires[1].D),
    parameter("tire_r.E", "1", "Curvature factor, rear").at(|f| &mut f.tires[1].E),
    parameter("tire_r.S_h", "rad", "Horizontal shift, rear").at(|f| &mut f.tires[1].S_h),
    parameter("tire_r.S_v", "1", "Vertical shift over the load, rear").at(|f| &mut f.tires[1].S_v),
    parameter("measured.v_y", "", "Whether v_y_meas is a measurement")
        .at_boolean(|f| &mut f.settings.measured_v_y),
    parameter("sensor.v_y", "m/s", "Standard deviation of the noise of v_y_meas")
        .min(1e-6)
        .max(100.0)
        .at(|f| &mut f.settings.noise.v_y),
    parameter("sensor.r", "rad/s", "Standard deviation of the noise of r_meas")
        .min(1e-9)
        .max(10.0)
        .at(|f| &mut f.settings.noise.r),
    parameter("sensor.a_y", "m/s2", "Standard deviation of the noise of a_y_meas")
        .min(1e-6)
        .max(100.0)
        .at(|f| &mut f.settings.noise.a_y),
    parameter(
        "model.alpha_f",
        "rad",
        "Standard deviation of the error of the front slip angle: trim, play, offsets",
    )
    .min(0.0)
    .max(0.5)
    .at(|f| &mut f.settings.noise.alpha[0]),
    parameter("model.alpha_r", "rad", "Standard deviation of the error of the rear slip angle")
        .min(0.0)
        .max(0.5)
        .at(|f| &mut f.settings.noise.alpha[1]),
    parameter("model.alpha_time", "s", "Correlation time of the errors of slip angles")
        .min(1e-4)
        .max(1e6)
        .at(|f| &mut f.settings.noise_times[1]),
    parameter("model.force", "1", "Standard deviation of the error of an axle force over its load")
        .min(1e-3)
        .max(10.0)
        .at(|f| &mut f.settings.noise.force),
    parameter("model.time", "s", "Correlation time of the errors of forces")
        .min(1e-4)
        .max(1e3)
        .at(|f| &mut f.settings.noise_times[0]),
    parameter("filter.time", "s", "Time constant of the low-pass of all channels")
        .min(1e-4)
        .max(10.0)
        .at(|f| &mut f.settings.filter_time),
    parameter("v_x_min", "m/s", "Slowest speed at which samples are used")
        .min(0.1)
        .max(100.0)
        .at(|f| &mut f.settings.v_x_min),
    parameter("start.std_D", "1", "Standard deviation of ln D in the beginning")
        .min(0.0)
        .max(2.0)
        .at(|f| &mut f.settings.start_std[0]),
    parameter("start.std_K", "1", "Standard deviation of ln K in the beginning")
        .min(0.0)
        .max(2.0)
        .at(|f| &mut f.settings.start_std[1]),
    parameter("process.D", "1/s", "Growth of the variance of ln D")
        .min(0.0)
        .max(1.0)
        .at(|f| &mut f.settings.drift.walk[0]),
    parameter("process.K", "1/s", "Growth of the variance of ln K")
        .min(0.0)
        .max(1.0)
        .at(|f| &mut f.settings.drift.walk[1]),
    parameter("process.v_y", "m2/s3", "Growth of the variance of v_y: banks, offsets of a_y_meas")
        .min(0.0)
        .max(1e3)
        .at(|f| &mut f.settings.process_v_y),
    parameter("surface.rate", "Hz", "Expected changes of the surface in a second")
        .min(0.0)
        .max(100.0)
        .at(|f| &mut f.settings.drift.changes),
    parameter("surface.std", "1", "Standard deviation of ln D after a change of the surface")
        .min(0.0)
        .max(2.0)
        .at(|f| &mut f.settings.drift.spread),
    parameter("surface.axles", "1", "Standard deviation of ln D_f - ln D_r, both over the nominal ones")
        .min(0.0)
        .max(10.0)
        .at(|f| &mut f.settings.difference),
    parameter("alarm.change", "1", "Change of friction that counts, as a share")
        .min(0.01)
        .max(1.0)
        .at(|f| &mut f.settings.change),
    parameter("alarm.deviations", "1", "Standard deviations of factor that it must be beyond that")
        .min(0.1)
        .max(10.0)
        .at(|f| &mut f.settings.deviations),
];

/// Says which parameter is outside of its limits: not every importer looks at them.
pub fn wrong_parameter(friction: &mut FrictionNode) -> Option<String> {
    VARIABLES.iter().filter(|it| it.row.causality == Causality::Parameter).find_map(|it| {
        let VariableAccess::Real(at) = it.access else { return None };
        let (value, row) = (*at(friction), &it.row);
        let limits = row.min.unwrap_or(f64::MIN)..=row.max.unwrap_or(f64::MAX);
        (!limits.contains(&value))
            .then(|| format!("{}: expected {} to {}, found {value}", row.name, limits.start(), limits.end()))
    })
}
