//! Couples masses and adders by each algorithm, and compares them with the closed form.

mod mass;

use fmu_import::CallError;
use nalgebra::{Matrix4, Vector4};

use self::mass::Mass;
use crate::builder::{ConnectionOptions, SystemBuilder};
use crate::clock::{CommunicationClock, StepBoundary};
use crate::extrapolation::ExtrapolationOrder;
use crate::node::{DirectionalDerivatives, Node, NodeState, Stateful};
use crate::system::{
    Algorithm, BondPlan, ErrorEstimate, LoopIteration, LoopSolverMethod, NodeBlock, StepDivision, StepRatio,
    System, TearConnection,
};
use crate::testing::{RecordingSink, idle_node, mock_system, run_mock_system, run_mock_system_with_step};

/// Two masses of 1 kg in a row, and the wall that the first one hangs on: position and speed of the first one go to the second one, its
/// force comes back. Rows are `x_1`, `v_1`, `-F_1`, `x_2`, `v_2`, `F`, position and speed of the wall, then the inputs.
fn two_masses(algorithm: Algorithm, step: f64, stop: f64) -> System {
    let clock = CommunicationClock { start: 0.0, step, steps: (stop / step).round() as u64 };
    let mut builder = SystemBuilder::new(clock, algorithm);
    let outputs = ["x", "v", "F_0"];
    builder.add_node("first", idle_node(), &["x_0", "v_0", "F"], &outputs).expect("a new name");
    builder.add_node("second", idle_node(), &["x_0", "v_0"], &outputs).expect("a new name");
    builder.add_node("wall", idle_node(), &[], &["x", "v"]).expect("a new name");
    let extrapolation = (algorithm == Algorithm::Iterate).then_some(ExtrapolationOrder::Linear);
    for (output, input) in [("second.F_0", "first.F"), ("first.x", "second.x_0"), ("first.v", "second.v_0")] {
        let options = ConnectionOptions { extrapolation, ..ConnectionOptions::default() };
        builder.connect_with(output, input, options).expect("both are there");
    }
    for (output, input) in [("wall.x", "first.x_0"), ("wall.v", "first.v_0")] {
        let options = ConnectionOptions { at: Some(StepBoundary::Start), ..ConnectionOptions::default() };
        builder.connect_with(output, input, options).expect("both are there");
    }
    builder.build_system().expect("a system").0
}

const STIFF: [f64; 2] = [40.0, 25.0];

fn masses(damping: f64) -> Vec<Box<dyn Node>> {
    let masses = [0.0, 0.1].into_iter().zip(STIFF);
    let masses = masses.map(|(position, stiffness)| Mass::new(stiffness, damping, position));
    hung(masses.collect())
}

/// Masses, and the wall.
fn hung(masses: Vec<Mass>) -> Vec<Box<dyn Node>> {
    let masses = masses.into_iter().map(|mass| Box::new(mass) as Box<dyn Node>);
    masses.chain([idle_node()]).collect()
}

/// Positions and speeds of both masses at a time [s]: `exp(A t)`.
fn exact(damping: f64, time: f64) -> Vector4<f64> {
    let ([k1, k2], d) = (STIFF, damping);
    #[rustfmt::skip]
    let a = Matrix4::new(
        0.0, 1.0, 0.0, 0.0,
        -k1 - k2, -2.0 * d, k2, d,
        0.0, 0.0, 0.0, 1.0,
        k2, d, -k2, -d,
    );
    (a * time).exp() * Vector4::new(0.0, 0.0, 0.1, 0.0)
}

fn state(row: &[f64]) -> Vector4<f64> {
    Vector4::new(row[0], row[1], row[3], row[4])
}

fn last(record: &RecordingSink) -> &[f64] {
    record.rows.last().expect("a row")
}

fn run(mut system: System, nodes: Vec<Box<dyn Node>>) -> RecordingSink {
    let step = system.clock.step;
    let (record, _, result) = run_mock_system_with_step(&mut system, nodes, step);
    result.expect("the run comes to its end");
    record
}

fn error(algorithm: Algorithm, damping: f64, step: f64) -> f64 {
    let record = run(two_masses(algorithm, step, 2.0), masses(damping));
    (state(last(&record)) - exact(damping, 2.0)).norm()
}

#[test]
fn iterate_converges_with_the_second_order_and_the_others_with_the_first() {
    for (algorithm, from, to) in
        [(Algorithm::Iterate, 1.95, 2.05), (Algorithm::GaussSeidel, 0.8, 1.2), (Algorithm::Jacobi, 0.8, 1.3)]
    {
        let errors = [0.005, 0.0025, 0.00125].map(|step| error(algorithm, 0.3, step));
        let orders = [0, 1].map(|place: usize| (errors[place] / errors[place + 1]).log2());
        assert!(orders.iter().all(|it| (from..to).contains(it)), "{algorithm:?}: {errors:?} {orders:?}");
    }
    let (iterate, seidel) = (error(Algorithm::Iterate, 0.3, 0.01), error(Algorithm::GaussSeidel, 0.3, 0.01));
    assert!(iterate < seidel / 20.0, "{iterate:e} {seidel:e}");
}

#[test]
fn only_iterate_keeps_the_energy() {
    let energy = |row: &[f64]| {
        let [x1, v1, x2, v2] = state(row).into();
        0.5 * (v1 * v1 + v2 * v2 + STIFF[0] * x1 * x1 + STIFF[1] * (x2 - x1).powi(2))
    };
    let drift = |algorithm| {
        let record = run(two_masses(algorithm, 0.01, 20.0), masses(0.0));
        energy(last(&record)) / energy(&record.rows[0]) - 1.0
    };
    let [iterate, seidel, jacobi] =
        [Algorithm::Iterate, Algorithm::GaussSeidel, Algorithm::Jacobi].map(drift);
    // The held force of the step is that of its start, which comes too late and adds energy.
    assert!(iterate.abs() < 0.01, "{iterate}");
    assert!(jacobi > 10.0 * iterate.abs() && jacobi > 1.0, "{jacobi} {iterate}");
    assert!(seidel.abs() > 10.0 * iterate.abs(), "{seidel} {iterate}");
}

#[test]
fn slopes_of_inputs_are_better_than_means() {
    let error = |takes_slopes| {
        let masses = [0.0, 0.1].into_iter().zip(STIFF);
        let masses =
            masses.map(|(position, stiffness)| Mass { takes_slopes, ..Mass::new(stiffness, 0.3, position) });
        let record = run(two_masses(Algorithm::Iterate, 0.02, 2.0), hung(masses.collect()));
        (state(last(&record)) - exact(0.3, 2.0)).norm()
    };
    let [means, slopes] = [false, true].map(error);
    assert!(slopes < means, "{slopes:e} {means:e}");
}

#[test]
fn a_tolerance_divides_steps_until_the_error_is_small() {
    for algorithm in [Algorithm::Iterate, Algorithm::GaussSeidel, Algorithm::Jacobi] {
        let error = |tolerance| {
            let mut system = two_masses(algorithm, 0.1, 2.0);
            let control = Some((ErrorEstimate::Richardson, tolerance));
            system.coupling.division = Some(StepDivision { control, ..StepDivision::default() });
            let record = run(system, masses(0.3));
            assert_eq!(record.rows.len(), 21, "rows are those of communication points");
            // The largest speed is about 0.5 m/s.
            (state(last(&record)) - exact(0.3, 2.0)).norm() / 0.5
        };
        let [coarse, fine] = [1e-2, 1e-4].map(error);
        // The error of a part goes with the square of its length, or more, and that of the run with the number of parts.
        assert!(coarse < 0.5 && fine < coarse / 8.0, "{algorithm:?} {coarse:e} {fine:e}");
    }
}

#[test]
fn energy_that_a_bond_loses_divides_steps_without_repeating_any() {
    let play = |tolerance| {
        let mut system = two_masses(Algorithm::GaussSeidel, 0.05, 2.0);
        let bond = BondPlan {
            name: "F, v".to_owned(),
            effort: TearConnection { node: 0, place: 2 },
            flow: TearConnection { node: 1, place: 1 },
        };
        let control = Some((ErrorEstimate::Energy, tolerance));
        system.coupling.division =
            Some(StepDivision { control, bonds: vec![bond], ..StepDivision::default() });
        let (record, progress, result) = run_mock_system_with_step(&mut system, masses(0.3), 0.05);
        result.expect("the run comes to its end");
        let division = progress.coupling.division.expect("the division");
        assert_eq!(division.repeated, 0);
        ((state(last(&record)) - exact(0.3, 2.0)).norm(), division)
    };
    let ((coarse, few), (fine, many)) = (play(0.9), play(0.02));
    assert!(many.parts > 3 * few.parts && many.shortest.0 < few.shortest.0, "{few:?} {many:?}");
    assert!(fine < coarse / 3.0, "{fine:e} {coarse:e}");
    assert!(many.errors[0].largest > 0.0 && many.errors[0].largest < few.errors[0].largest);
}

#[test]
fn a_discarded_step_is_done_in_halves() {
    let mut system = two_masses(Algorithm::GaussSeidel, 0.1, 1.0);
    let nodes = |longest| -> Vec<Box<dyn Node>> {
        let second = Mass { longest, ..Mass::new(STIFF[1], 0.3, 0.1) };
        hung(vec![Mass::new(STIFF[0], 0.3, 0.0), second])
    };
    let (.., result) = run_mock_system_with_step(&mut system, nodes(0.03), 0.1);
    let failed = result.expect_err("nobody halves").to_string();
    assert!(failed.contains("second") && failed.contains("is too long"), "{failed}");
    system.coupling.division = Some(StepDivision { halves_discarded: true, ..StepDivision::default() });
    let (record, progress, result) = run_mock_system_with_step(&mut system, nodes(0.03), 0.1);
    result.expect("halves are short enough");
    assert_eq!(record.rows.len(), 11);
    let division = progress.coupling.division.expect("the division");
    assert_eq!(division.shortest.0, 0.025);
    let fine = run(two_masses(Algorithm::GaussSeidel, 0.025, 1.0), nodes(1.0));
    // After each success it tries a longer step again, so not all parts are the shortest.
    assert!((state(last(&record)) - state(last(&fine))).norm() < 1e-12);
    // No step is short enough.
    let (.., result) = run_mock_system_with_step(&mut system, nodes(1e-9), 0.1);
    result.expect_err("that is too short");
}

/// An adder `y = gain u + offset` without memory.
#[derive(Clone)]
struct Adder {
    gain: f64,
    offset: f64,
    input: f64,
    knows: bool,
}

impl Node for Adder {
    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.input = inputs[0];
        Ok(())
    }
    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        outputs[0] = self.gain * self.input + self.offset;
        Ok(())
    }
    fn do_step(&mut self, _clock: &CommunicationClock, _tick: u64) -> Result<(), CallError> {
        Ok(())
    }
    fn as_stateful(&mut self) -> Option<&mut dyn Stateful> {
        Some(self)
    }
    fn as_directional_derivatives(&mut self) -> Option<&mut dyn DirectionalDerivatives> {
        Some(self)
    }
}

impl DirectionalDerivatives for Adder {
    fn directional_derivatives(&mut self, changes: &[f64], outputs: &mut [f64]) -> Result<bool, CallError> {
        outputs[0] = self.gain * changes[0];
        Ok(self.knows)
    }
}

impl Stateful for Adder {
    fn save_state(&mut self) -> Result<NodeState, CallError> {
        Ok(NodeState::new(()))
    }
    fn restore_state(&mut self, _state: &NodeState) -> Result<(), CallError> {
        Ok(())
    }
}

/// Two adders in a loop: `u = gain y + 1`, `y = u + 0.5`.
fn adders(method: LoopSolverMethod, passes: u32) -> System {
    let mut system = mock_system(2, &[(0, 1, StepBoundary::End), (1, 0, StepBoundary::End)], 3);
    system.coupling.algorithm = Algorithm::Iterate;
    system.coupling.iteration = LoopIteration { method, tolerance: 1e-12, passes };
    let block = NodeBlock { nodes: vec![0, 1], tears: vec![TearConnection { node: 0, place: 0 }] };
    system.coupling.blocks = vec![block.clone()];
    system.coupling.initial = vec![block];
    system
}

fn loop_of(gain: f64, knows: bool) -> Vec<Box<dyn Node>> {
    let first = Adder { gain, offset: 1.0, input: 0.0, knows };
    vec![Box::new(first), Box::new(Adder { gain: 1.0, offset: 0.5, input: 0.0, knows })]
}

#[test]
fn an_algebraic_loop_is_solved_from_the_first_communication_point_on() {
    for (method, gain) in [
        (LoopSolverMethod::FixedPoint, 0.5),
        (LoopSolverMethod::Aitken, -30.0),
        (LoopSolverMethod::Anderson, -30.0),
        (LoopSolverMethod::Newton, -30.0),
        (LoopSolverMethod::Newton, 3.0),
    ] {
        for knows in [true, false] {
            let mut system = adders(method, 60);
            let (record, progress, result) = run_mock_system(&mut system, loop_of(gain, knows));
            result.expect("a solution");
            let y = 1.5 / (1.0 - gain);
            for row in &record.rows {
                assert!((row[1] - y).abs() < 1e-10, "{method:?} {gain}: {row:?}");
                assert!((row[2] - row[1]).abs() < 1e-10, "{row:?}");
            }
            let account = &progress.coupling.loops[0];
            assert_eq!((account.steps, account.inputs.len()), (3, 1));
            // From the second step on, the first guess fits.
            assert!(account.passes <= 3 + u64::from(account.most.0), "{account:?}");
        }
    }
}

#[test]
fn a_loop_without_a_solution_is_named_with_what_does_not_fit() {
    let (.., result) = run_mock_system(&mut adders(LoopSolverMethod::FixedPoint, 20), loop_of(-30.0, true));
    let error = result.expect_err("it diverges").to_string();
    assert!(error.contains("first communication point") && error.contains("n0.u0"), "{error}");
    // The same loop with a step in it is left to the step.
    let mut system = adders(LoopSolverMethod::FixedPoint, 20);
    system.coupling.initial.clear();
    let (record, _, result) = run_mock_system(&mut system, loop_of(-30.0, true));
    let error = result.expect_err("it diverges").to_string();
    assert!(error.contains("not solved at t = 0 s after 20 passes"), "{error}");
    assert_eq!(record.rows.len(), 1);
}

/// Shows the time of its inputs.
struct Clocked {
    input: f64,
    output: f64,
    /// Times of its steps.
    steps: std::sync::Arc<std::sync::Mutex<Vec<(f64, f64)>>>,
}

impl Node for Clocked {
    fn set_inputs(&mut self, inputs: &[f64]) -> Result<(), CallError> {
        self.input = inputs.first().copied().unwrap_or_default();
        Ok(())
    }
    fn get_outputs(&mut self, outputs: &mut [f64]) -> Result<(), CallError> {
        outputs[0] = self.output;
        Ok(())
    }
    fn do_step(&mut self, clock: &CommunicationClock, tick: u64) -> Result<(), CallError> {
        self.steps.lock().expect("no panic").push((clock.time_at(tick), self.input));
        self.output = self.input + 100.0;
        Ok(())
    }
}

#[test]
fn a_node_with_a_step_of_its_own_takes_inputs_where_its_step_begins_or_ends() {
    for (step_ratio, at, times, inputs) in [
        (StepRatio::Coarser(2), StepBoundary::End, vec![0.0, 1.0], vec![1.0, 2.0]),
        (StepRatio::Coarser(2), StepBoundary::Start, vec![0.0, 1.0], vec![0.0, 1.0]),
        (StepRatio::Finer(2), StepBoundary::End, vec![0.0, 0.25, 0.5], vec![0.5, 0.5, 1.0]),
    ] {
        let mut system = mock_system(2, &[(0, 1, at)], 4);
        system.nodes[1].step_ratio = Some(step_ratio);
        let steps = std::sync::Arc::default();
        let clocked = Clocked { input: 0.0, output: 0.0, steps: std::sync::Arc::clone(&steps) };
        let plan = &system.nodes[1];
        let paced = crate::node::wrap_sub_stepping(Box::new(clocked), plan, system.clock);
        let clock = crate::testing::mock_node(|time, _| Ok(time));
        let (record, _, result) = run_mock_system(&mut system, vec![clock, paced]);
        result.expect("the run comes to its end");
        let seen = steps.lock().expect("no panic").clone();
        let seen = &seen[..times.len()];
        assert_eq!(seen, times.into_iter().zip(inputs).collect::<Vec<_>>(), "{step_ratio:?} {at:?}");
        if let StepRatio::Coarser(_) = step_ratio {
            let shown: Vec<_> = record.rows.iter().map(|row| row[1]).collect();
            assert_eq!(shown[0], shown[1], "it keeps its output until its step ends");
            assert_eq!(shown[2], shown[3]);
            assert!(shown[2] > 99.0);
        }
    }
}
