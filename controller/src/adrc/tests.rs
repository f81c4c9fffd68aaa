//! Tests the control law on the car that it inverts.

use nalgebra::Vector6;

use super::*;

const H: f64 = 0.01;

/// The command after a step with the yaw-rate command `r_before`.
fn command(
    mode: ControlMode,
    reference: &ControlReference,
    estimate: &StateEstimate,
    r_before: f64,
) -> CarCommand {
    let before = CarCommand { r: r_before, ..CarCommand::default() };
    let mut memory = ControllerMemory { command: Some(before), mode, transfer_offset: [0.0; 2] };
    let (controller, driver) = (AdrcController::default(), CarCommand::default());
    controller.next_command(mode, reference, estimate, &driver, &mut memory, H)
}

fn at_30() -> StateEstimate {
    StateEstimate { v_x: 30.0, v_y: -0.4, r: 0.3, xi_x: -500.0, xi_psi: 800.0, ..StateEstimate::default() }
}

#[test]
fn the_nominal_car_with_the_estimated_disturbances_follows_the_reference_dynamics() {
    let x = at_30();
    let reference = ControlReference { v: 30.5, r: 0.32, ..ControlReference::default() };
    let command = command(ControlMode::YawRate, &reference, &x, 0.32);
    let state = vector![x.v_x, x.v_y, x.r, x.xi_x, x.xi_y, x.xi_psi];
    let rates = AdrcController::default().car.state_derivative(&state, command.F_x, command.delta);
    assert!((rates[0] - 4.0 * 0.5).abs() < 1e-9, "{rates}");
    assert!((rates[2] - 12.0 * 0.02).abs() < 1e-9, "{rates}");
}

#[test]
fn no_command_passes_its_limit() {
    for (v, r) in [(1e3, 1e3), (-1e3, -1e3), (30.0, 50.0)] {
        let reference = ControlReference { v, r, psi: 0.0 };
        let command = command(ControlMode::YawRate, &reference, &at_30(), 0.0);
        assert!((-6000.0..=6000.0).contains(&command.F_x));
        let rolling = (-0.4_f64 + 1.4 * 0.3).atan2(30.0);
        assert!(command.delta.abs() <= 0.30 && (command.delta - rolling).abs() <= 0.25 + 1e-12);
        assert!(command.r.abs() <= 20.0 * H + 1e-12);
    }
}

#[test]
fn a_heading_error_takes_the_short_way_round() {
    let reference = ControlReference { v: 30.0, psi: -3.1, r: 0.0 };
    let estimate = StateEstimate { psi: 3.1, ..at_30() };
    let command = command(ControlMode::Heading, &reference, &estimate, 0.0);
    assert!(command.r > 0.0, "{command:?}");
    assert!((wrap_angle(7.0) - (7.0 - TAU)).abs() < 1e-12 && (wrap_angle(-PI) + PI).abs() < 1e-12);
}

/// The nominal car under control from 30 m/s straight ahead; what `ask` wants at each step, and what comes of it.
fn drive(
    controller: &AdrcController,
    steps: usize,
    ask: impl Fn(usize) -> (ControlMode, ControlReference, CarCommand),
) -> Vec<(Vector6<f64>, CarCommand)> {
    let mut x = vector![30.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let (mut psi, mut memory) = (0.0, ControllerMemory::default());
    let one = |k: usize| {
        let (mode, reference, driver) = ask(k);
        let estimate = StateEstimate { v_x: x[0], v_y: x[1], r: x[2], psi, ..StateEstimate::default() };
        let command = controller.next_command(mode, &reference, &estimate, &driver, &mut memory, H);
        x = controller.car.advance(&x, command.F_x, command.delta, H);
        psi += H * x[2];
        (x, command)
    };
    (0..steps).map(one).collect()
}

#[test]
fn further_limits_hold() {
    let limit = CommandLimits { delta_rate: 0.5, power: 60e3, a_y: 4.0, ..AdrcController::default().limit };
    let controller = AdrcController { limit, ..AdrcController::default() };
    let reference = ControlReference { v: 60.0, r: 1.0, psi: 0.0 };
    let driven = drive(&controller, 300, |_| (ControlMode::YawRate, reference, CarCommand::default()));
    for pair in driven.windows(2) {
        let [(x, before), (_, after)] = pair else { continue };
        assert!((after.delta - before.delta).abs() <= 0.5 * H + 1e-12);
        assert!(after.F_x * x[0] <= 60e3 * (1.0 + 1e-9), "{}", after.F_x * x[0]);
        assert!(after.r * x[0] <= 4.0 * (1.0 + 1e-9), "{}", after.r * x[0]);
    }
    let (end, last) = driven[299];
    assert!((last.F_x * end[0] / 60e3 - 1.0).abs() < 0.01 && (end[2] * end[0] / 4.0 - 1.0).abs() < 0.02);
}

/// Time [s] that the yaw rate takes to follow a reference that turns round while the steering is at its limit.
fn turning_round(anti_windup: bool) -> f64 {
    // The reference of the yaw rate is slow, and out of reach of the steering.
    let limit = CommandLimits { delta: 0.02, r_rate: 1.0, anti_windup, ..AdrcController::default().limit };
    let controller = AdrcController { limit, ..AdrcController::default() };
    let ask = |k: usize| {
        let r = if k < 300 { 2.0 } else { -2.0 };
        (ControlMode::YawRate, ControlReference { v: 30.0, r, psi: 0.0 }, CarCommand::default())
    };
    let driven = drive(&controller, 800, ask);
    let back = driven[300..].iter().position(|(x, _)| x[2] < 0.0).expect("the car turns round");
    back as f64 * H
}

#[test]
fn a_limited_steering_angle_does_not_let_the_reference_run_away() {
    let (with, without) = (turning_round(true), turning_round(false));
    // r_cmd runs up to 2 rad/s at 1 rad/s², and has to come back from there.
    assert!(without > 1.5, "{without} s");
    assert!(with < 0.3 * without, "{with} s, and {without} s without");
}

#[test]
fn a_change_of_mode_makes_no_bump() {
    let limit = CommandLimits { delta: 0.3, ..AdrcController::default().limit };
    let controller = AdrcController { limit, transfer_time: 0.3, ..AdrcController::default() };
    let driver = CarCommand { F_x: 1500.0, delta: 0.03, r: 0.0 };
    let ask = |k: usize| {
        let mode =
            [ControlMode::Manual, ControlMode::YawRate, ControlMode::Heading, ControlMode::Manual][k / 100];
        (mode, ControlReference { v: 25.0, r: -0.1, psi: -0.5 }, driver)
    };
    let driven = drive(&controller, 400, ask);
    for k in [100, 200, 300] {
        let (before, after) = (driven[k - 1].1, driven[k].1);
        let jump = (after.delta - before.delta).abs();
        assert!(jump < 1e-9, "steering jumps by {jump} rad at step {k}");
        assert!((after.F_x - before.F_x).abs() < 1e-6, "force jumps at step {k}");
    }
    // After five times the transfer time less than 1 % is left.
    assert!((driven[399].1.delta - 0.03).abs() < 0.01);
    let abrupt = AdrcController { transfer_time: 0.0, ..controller };
    let driven = drive(&abrupt, 400, ask);
    assert!((driven[101].1.delta - driven[99].1.delta).abs() > 0.02, "the law alone jumps");
}
