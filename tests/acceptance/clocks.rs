//! Runs an FMU of FMI 3.0 with event mode, clocks, early returns and intermediate updates. It refuses calls that the standard forbids.

use super::fixture::Scenario;
use super::fmus::{changed, clocked};
use super::harness::{Ended, Lab};

tests! {
    clocks_tick_at_their_times_and_by_connection: Compiler,
    discrete_inputs_are_set_at_events: Compiler,
    a_step_goes_on_after_an_early_return: Compiler,
    an_fmu_gets_the_events_that_it_wants: Compiler,
    events_without_end_and_steps_that_stand_still_end_the_run: Compiler,
    a_tick_between_steps_of_one_length_is_refused: Compiler,
}

pub fn scenario() -> Scenario {
    let nodes = Scenario::new().time(0.1, 1.2).fmu("one", "clocked.fmu", "");
    let signals = nodes
        .fmu("two", "clocked.fmu", "u = 5.0, mode = 1")
        .signal("s.u", "ramp = { start = 0.0, end = 2.0, after = 2.0 }")
        .signal("s.mode", "step = { at = 0.5, after = 7.0 }");
    let connected = signals.connect("s.u", "one.u").connect("s.mode", "one.mode");
    connected.connect("one.alarm", "two.reset")
}

fn run(fmu: &[u8], set: &str) -> (Lab, Ended) {
    let lab = Lab::new();
    lab.write("clocked.fmu", fmu);
    lab.write("case.toml", scenario().text());
    let ended = lab.trackside(&["run", "case.toml", "--set", set, "--out", "out", "--csv"]);
    (lab, ended)
}

fn good() -> Lab {
    let (lab, ended) = run(clocked(), "one.behaviour=0");
    ended.expect(0);
    lab
}

/// The cells of a column.
pub fn column(lab: &Lab, name: &str) -> Vec<String> {
    let table = lab.table("out/run.csv");
    let mut lines = table.lines();
    let place = lines.next().expect("titles").split(',').position(|title| title == name);
    let place = place.unwrap_or_else(|| panic!("no {name}"));
    lines.map(|line| line.split(',').nth(place).expect("a cell").to_owned()).collect()
}

/// The numbers of the rows whose cell is 1.
fn ticks(lab: &Lab, name: &str) -> Vec<usize> {
    let cells = column(lab, name);
    (0..cells.len()).filter(|row| cells[*row] == "1").collect()
}

/// A tick belongs to the step that it begins or that it is in: row 2 is the end of the step from 0.1 s to 0.2 s.
fn clocks_tick_at_their_times_and_by_connection() {
    let lab = good();
    // 0.1 s, 0.35 s, 0.6 s, 0.85 s and 1.1 s.
    assert_eq!(ticks(&lab, "one.sample"), [2, 4, 7, 9, 12]);
    // 0 s, and then at intervals of 0.2 s and 0.4 s.
    assert_eq!(ticks(&lab, "one.slower"), [1, 3, 7]);
    assert_eq!(ticks(&lab, "one.alarm"), [4]);
    // The alarm resets the other one, whose fuse burns 0.15 s.
    assert_eq!(ticks(&lab, "two.reset"), [4]);
    assert_eq!(ticks(&lab, "two.fuse"), [5]);
    assert_eq!(column(&lab, "two.count")[3..8], ["1", "1", "1", "1", "2"]);
    assert_eq!(column(&lab, "two.burnt").last().map(String::as_str), Some("1"));
    // Values of a clock stay until the next tick, and are those of the tick.
    assert_eq!(column(&lab, "one.sampled")[2..5], ["0.1", "0.1", "0.30000000000000004"]);
    assert_eq!(column(&lab, "two.sampled")[1..3], ["0", "5"]);
    assert_eq!(column(&lab, "one.note")[3..5], ["\"\"", "\"alarm at 0.35\""]);
    // An update more for each tick of `sample`, which asks for one.
    assert_eq!(column(&lab, "one.updates")[..3], ["1", "2", "4"]);
}

fn discrete_inputs_are_set_at_events() {
    let lab = good();
    assert_eq!(column(&lab, "one.shown_mode")[4..8], ["0", "0", "7", "7"]);
    assert_eq!(column(&lab, "two.shown_mode")[0], "1");
}

fn a_step_goes_on_after_an_early_return() {
    let whole = column(&good(), "one.sampled");
    let (lab, ended) = run(clocked(), "one.behaviour=2");
    ended.expect(0);
    assert_eq!(column(&lab, "one.sampled"), whole);
}

fn an_fmu_gets_the_events_that_it_wants() {
    let updates = |set: &str| {
        let (lab, ended) = run(clocked(), set);
        ended.expect(0);
        column(&lab, "one.updates")
    };
    // It wants one at 0.33 s.
    let (usual, one_more) = (updates("one.behaviour=0"), updates("one.behaviour=4"));
    assert_eq!((usual[3].as_str(), one_more[3].as_str()), ("5", "5"));
    assert_eq!((usual[4].as_str(), one_more[4].as_str()), ("7", "8"));
    let (_, ended) = run(clocked(), "one.behaviour=5");
    ended.expect(0).says(&["`one` ended the simulation at 0.35 s"]);
}

fn events_without_end_and_steps_that_stand_still_end_the_run() {
    let (_, ended) = run(clocked(), "one.behaviour=1");
    ended.expect(3).says(&["`one`", "fmi3UpdateDiscreteStates at t = 0 s", "after 1000 of them"]);
    let (_, ended) = run(clocked(), "one.behaviour=3");
    ended.expect(3).says(&["`one`", "fmi3DoStep at t = 0 s", "without coming further"]);
}

fn a_tick_between_steps_of_one_length_is_refused() {
    let lab = Lab::new();
    let fixed = changed(&lab.write("clocked.fmu", clocked()), |name, bytes| {
        let flag = "canHandleVariableCommunicationStepSize=\"true\"";
        let bytes = match name {
            "modelDescription.xml" => String::from_utf8(bytes).expect("text").replace(flag, "").into_bytes(),
            _ => bytes,
        };
        Some((name.to_owned(), bytes))
    });
    let (_, ended) = run(&fixed, "one.behaviour=0");
    ended.expect(3).says(&["the clock `sample` ticks at 0.35 s, between two communication points"]);
}
