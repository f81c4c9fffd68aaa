//! Connects terminals: each member reaches the other one by its rule, in its direction and with its sign.

use super::fixture::Scenario;
use super::fmus::{ours, relay};
use super::harness::Lab;

tests! {
    the_buses_of_our_car_close_its_loop,
    flows_change_their_sign_and_streams_cross: Compiler,
    members_meet_by_name_by_order_and_inside_each_other: Compiler,
    parameters_of_connected_terminals_are_equal,
    a_scenario_with_terminals_leaves_as_system_and_as_fmu: Compiler,
    mistakes_about_terminals_are_told: Compiler,
    inspect_and_conform_read_the_terminals: Compiler,
}

/// The relay with these terminals.
fn with_terminals(terminals: &str) -> Vec<u8> {
    let text = format!(
        "<fmiTerminalsAndIcons fmiVersion=\"3.0\"><Terminals>{terminals}</Terminals></fmiTerminalsAndIcons>"
    );
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    super::fmus::with(&lab.path("relay.fmu"), "terminalsAndIcons/terminalsAndIcons.xml", &text)
}

fn terminal(name: &str, rule: &str, inside: &str) -> String {
    format!("<Terminal name=\"{name}\" matchingRule=\"{rule}\">{inside}</Terminal>")
}

fn member(name: &str, variable: &str, kind: &str) -> String {
    format!(
        "<TerminalMemberVariable memberName=\"{name}\" variableName=\"{variable}\" variableKind=\"{kind}\"/>"
    )
}

/// Two relays with these terminals, and the connection of `a.port` to `b.port`.
fn two(a: &str, b: &str) -> (Lab, Scenario) {
    let lab = Lab::new();
    lab.write("a.fmu", with_terminals(a));
    lab.write("b.fmu", with_terminals(b));
    let scenario = Scenario::headed("seed = 1")
        .time(0.5, 2.0)
        .fmu("a", "a.fmu", "")
        .key("unconnected = \"start\"")
        .fmu("b", "b.fmu", "")
        .key("unconnected = \"start\"")
        .connect("a.port", "b.port");
    (lab, scenario)
}

/// The cells of a column of `out/run.csv`.
fn column(lab: &Lab, name: &str) -> Vec<f64> {
    let table = lab.table("out/run.csv");
    let mut lines = table.lines();
    let titles = lines.next().expect("titles");
    let place = titles.split(',').position(|title| title == name);
    let place = place.unwrap_or_else(|| panic!("no {name} in {titles}"));
    let cell = |line: &str| line.split(',').nth(place).expect("a cell").parse().expect("a number");
    lines.map(cell).collect()
}

fn run(lab: &Lab, scenario: &Scenario) -> super::harness::Ended {
    lab.write("case.toml", scenario.clone().text());
    lab.trackside(&["run", "case.toml", "--csv", "--rerun", "off", "--out", "out"])
}

/// The loop of plant, estimator and controller over buses has the numbers of the loop over single connections. A sensor effect
/// stands at the input that has a connection of its own.
fn the_buses_of_our_car_close_its_loop() {
    let lab = Lab::new();
    let mut nodes = Scenario::headed("seed = 4").time(0.01, 2.0);
    for node in ["plant", "estimator", "controller"] {
        let archive = format!("{node}_fmi3.fmu");
        lab.add(&ours().join(&archive));
        nodes = nodes.fmu(node, &archive, "");
    }
    for (name, value) in [("v", "16.0\nunit = \"m/s\""), ("r", "0.2\nunit = \"rad/s\"")] {
        nodes = nodes.signal(&format!("reference.{name}"), &format!("constant = {value}"));
        nodes = nodes.connect(&format!("reference.{name}"), &format!("controller.{name}_ref"));
    }
    let noise = nodes
        .key("at = \"end\"")
        .signal("reference.psi", "constant = 0.0\nunit = \"rad\"")
        .connect("reference.psi", "controller.psi_ref")
        .connect("plant.a_y", "estimator.a_y_meas")
        .key("noise = { std = 0.1 }");
    let buses = noise
        .clone()
        .connect("controller.actuators", "plant.actuators")
        .key("at = \"start\"")
        .connect("controller.actuators", "estimator.actuators")
        .key("at = \"start\"")
        .connect("plant.sensors", "estimator.sensors")
        .connect("plant.sensors", "controller.sensors")
        .connect("estimator.estimates", "controller.estimates");
    let mut single = noise;
    for receiver in ["plant", "estimator"] {
        for input in ["F_x", "delta"] {
            single = single
                .connect(&format!("controller.{input}"), &format!("{receiver}.{input}"))
                .key("at = \"start\"");
        }
    }
    for output in ["v_x", "v_y", "r"] {
        single = single.connect(&format!("plant.{output}"), &format!("estimator.{output}_meas"));
    }
    single = single.connect("plant.psi", "controller.psi");
    for output in ["v_x", "v_y", "r", "xi_x", "xi_y", "xi_psi"] {
        single = single.connect(&format!("estimator.{output}"), &format!("controller.{output}"));
    }
    run(&lab, &single).expect(0);
    let expected = lab.table("out/run.csv");
    run(&lab, &buses).expect(0);
    assert!(lab.table("out/run.csv") == expected, "the buses carry other numbers");
    let rates = column(&lab, "plant.r");
    assert!(rates.last() > Some(&0.05), "the car turns: {:?}", rates.last());
}

fn flows_change_their_sign_and_streams_cross() {
    let a = member("flow", "x_out", "outflow");
    let plug = |inside: &str| terminal("port", "plug", inside);
    // Two flows of one direction add up to 0; one out and one in are the same.
    for (kind, sign) in [("outflow", -1.0), ("inflow", 1.0)] {
        let (lab, scenario) = two(&plug(&a), &plug(&member("flow", "x", kind)));
        let scenario = scenario
            .signal("drive.x", "sine = { amplitude = 3.0, frequency = 0.1 }")
            .connect("drive.x", "a.x");
        run(&lab, &scenario).expect(0);
        let given = column(&lab, "a.x_out");
        let expected: Vec<_> = given.iter().map(|value| sign * value).collect();
        assert_eq!(column(&lab, "b.x"), expected, "{kind}");
        assert!(given[4] > 2.0, "{given:?}");
    }
    let stream = "<TerminalStreamMemberVariable inStreamMemberName=\"h_in\" outStreamMemberName=\"h\" inStreamVariableName=\"x\" outStreamVariableName=\"x_out\"/>";
    let (lab, scenario) = two(&plug(stream), &plug(stream));
    // Each relay gives what it gets: a loop, which the connection breaks in its own direction.
    run(&lab, &scenario).expect(2).says(&["loop", "a.x", "b.x"]);
    run(&lab, &scenario.clone().key("at = \"start\"")).expect(0);
    // One of both directions has a connection of its own.
    let scenario =
        scenario.signal("drive.x", "sine = { amplitude = 2.0, frequency = 0.1 }").connect("drive.x", "a.x");
    run(&lab, &scenario).expect(0);
    assert_eq!(column(&lab, "b.x"), column(&lab, "a.x_out"));
    assert!(column(&lab, "b.x")[4] > 1.0);
}

fn members_meet_by_name_by_order_and_inside_each_other() {
    let drive = |scenario: Scenario| {
        scenario
            .signal("drive.x", "sine = { amplitude = 2.0, frequency = 0.1 }")
            .connect("drive.x", "a.x")
            .signal("drive.n", "constant = 7")
            .connect("drive.n", "a.n")
    };
    // By name, in any order.
    let a = member("level", "x_out", "signal") + &member("count", "n_out", "signal");
    let b = member("count", "n", "signal") + &member("level", "x", "signal");
    // By order, with other names.
    let c = member("number", "x", "signal") + &member("whole", "n", "signal");
    let unnamed = c.replace("memberName=\"number\" ", "").replace("memberName=\"whole\" ", "");
    let port = |rule: &str, inside: &str| terminal("port", rule, inside);
    let nested = |inside: &str| port("bus", &terminal("inner", "plug", inside));
    let more = b.clone() + &member("mode", "mode", "signal");
    let cases = [
        (port("plug", &a), port("plug", &b)),
        (port("bus", &a), port("plug", &b)),
        // A bus leaves out what the other one lacks.
        (port("bus", &a), port("bus", &more)),
        (port("sequence", &a), port("sequence", &unnamed)),
        (nested(&a), nested(&b)),
    ];
    for (a, b) in cases {
        let (lab, scenario) = two(&a, &b);
        run(&lab, &drive(scenario)).expect(0);
        assert_eq!(column(&lab, "b.x"), column(&lab, "a.x_out"), "{a} {b}");
        assert_eq!(column(&lab, "b.n"), [7.0; 5], "{a} {b}");
    }
    // A terminal inside another one has a name of its own.
    let (lab, scenario) = two(&nested(&a), &port("plug", &b));
    let text = scenario.text().replace("a.port", "a.port.inner");
    run(&lab, &drive(Scenario::headed(&text))).expect(0);
    assert_eq!(column(&lab, "b.n"), [7.0; 5]);
}

fn parameters_of_connected_terminals_are_equal() {
    let lab = Lab::new();
    let mass = "<fmiTerminalsAndIcons fmiVersion=\"3.0\"><Terminals><Terminal name=\"body\" matchingRule=\"plug\"><TerminalMemberVariable memberName=\"m\" variableName=\"body.m\" variableKind=\"signal\"/></Terminal></Terminals></fmiTerminalsAndIcons>";
    let file = "terminalsAndIcons/terminalsAndIcons.xml";
    lab.write("car.fmu", super::fmus::with(&ours().join("plant_fmi3.fmu"), file, mass));
    let cars = |start: &str| {
        Scenario::new()
            .time(0.01, 0.1)
            .fmu("a", "car.fmu", "body.m = 700.0")
            .key("unconnected = \"start\"")
            .fmu("b", "car.fmu", start)
            .key("unconnected = \"start\"")
            .connect("a.body", "b.body")
    };
    run(&lab, &cars("body.m = 700.0")).expect(0);
    run(&lab, &cars("body.m = 701.0")).expect(2).says(&[
        "parameters of connected terminals are equal",
        "`a.body.m` is 700.0",
        "`b.body.m` is 701.0",
    ]);
}

fn a_scenario_with_terminals_leaves_as_system_and_as_fmu() {
    let a = terminal("port", "plug", &member("flow", "x_out", "outflow"));
    let b = terminal("port", "plug", &member("flow", "x", "outflow"));
    let (lab, scenario) = two(&a, &b);
    let scenario =
        scenario.signal("drive.x", "sine = { amplitude = 3.0, frequency = 0.1 }").connect("drive.x", "a.x");
    run(&lab, &scenario).expect(0);
    let direct = column(&lab, "b.x_out");
    lab.trackside(&["pack", "case.toml", "--ssp", "--out", "ssp"]).expect(0);
    let system = ["run", "ssp/case.ssp", "--csv", "--rerun", "off", "--out", "out"];
    lab.trackside(&system).expect(0);
    assert_eq!(column(&lab, "b.x_out"), direct);
    // The input of a member can be led outside, too.
    let pack = ["pack", "case.toml", "--fmu", "case", "--out", "fmu", "--inputs", "b.x"];
    lab.trackside(&pack).expect(0);
    let outer = Scenario::new()
        .time(0.5, 2.0)
        .fmu("box", "fmu/case.fmu", "")
        .signal("level.x", "constant = 9.0")
        .connect("level.x", "box.b.x");
    run(&lab, &outer).expect(0);
    assert_eq!(column(&lab, "box.b.x_out")[4], 9.0);
    assert_eq!(column(&lab, "box.a.x_out")[4], direct[4].abs());
}

fn mistakes_about_terminals_are_told() {
    let port = |rule: &str, inside: &str| terminal("port", rule, inside);
    let x = member("x", "x", "signal");
    let out = member("x", "x_out", "signal");
    let cases: [(String, String, &[&str]); 9] = [
        (port("plug", &out), port("plug", ""), &["`b.port` has no member `x`", "plug", "`a.port`"]),
        (port("bus", &out), port("bus", ""), &["no member in common"]),
        (port("plug", &out), port("sequence", &x), &["by order", "by name"]),
        (port("org.example.can", &out), port("plug", &x), &["`org.example.can`", "sequence"]),
        (port("plug", &x), port("plug", &x), &["`a.x` is an input", "`b.x` is an input"]),
        (port("plug", &out), port("plug", &member("x", "x", "inflow")), &["`signal` and `inflow`"]),
        (
            port("plug", &member("x", "x_out", "heat")),
            port("plug", &member("x", "x", "heat")),
            &["`heat`", "only `signal`, `inflow` and `outflow`"],
        ),
        (port("plug", &out), port("plug", &member("x", "n", "signal")), &["Real", "Integer"]),
        (port("plug", &out), port("plug", &member("x", "y", "signal")), &["`y`", "no variable"]),
    ];
    for (a, b, parts) in cases {
        let (lab, scenario) = two(&a, &b);
        run(&lab, &scenario).expect(2).says(&["case.toml", "b.port"]).says(parts);
    }
    let (lab, scenario) = two(&port("plug", &out), &port("plug", &x));
    run(&lab, &scenario.clone().key("noise = { std = 0.1 }"))
        .expect(2)
        .says(&["`noise` belongs to one value", "terminals"]);
    let single = scenario.clone().text().replace("b.port", "b.x");
    run(&lab, &Scenario::headed(&single)).expect(2).says(&["`a.port` is a terminal", "`b.x` is none"]);
    let typo = scenario.clone().text().replace("b.port", "b.prt");
    run(&lab, &Scenario::headed(&typo)).expect(2).says(&["unknown terminal `b.prt`", "b.port"]);
    let twice = scenario.connect("a.port", "b.port");
    run(&lab, &twice).expect(2).says(&["connected twice"]);
    // What cannot be read matters only to those who name it.
    lab.write(
        "a.fmu",
        super::fmus::with(&lab.path("b.fmu"), "terminalsAndIcons/terminalsAndIcons.xml", "<fmi"),
    );
    let text = Scenario::new().time(0.5, 2.0).fmu("a", "a.fmu", "").key("unconnected = \"start\"");
    run(&lab, &text).expect(0);
    let text = text.fmu("b", "b.fmu", "").key("unconnected = \"start\"").connect("a.port", "b.port");
    run(&lab, &text).expect(2).says(&["a.port", "terminalsAndIcons.xml"]);
}

fn inspect_and_conform_read_the_terminals() {
    let lab = Lab::new();
    lab.add(&ours().join("estimator_fmi3.fmu"));
    let ended = lab.trackside(&["inspect", "estimator_fmi3.fmu"]).expect(0);
    for part in ["3 terminals", "sensors (bus)", "a_y: a_y_meas"] {
        assert!(ended.stdout.contains(part), "{part}: {}", ended.stdout);
    }
    let file = "terminalsAndIcons/terminalsAndIcons.xml";
    let wrong = "<fmiTerminalsAndIcons fmiVersion=\"3.0\"><Terminals><Terminal name=\"a\" matchingRule=\"bus\"><TerminalMemberVariable memberName=\"m\" variableName=\"absent\" variableKind=\"signal\"/></Terminal></Terminals></fmiTerminalsAndIcons>";
    lab.write("wrong.fmu", super::fmus::with(&lab.path("estimator_fmi3.fmu"), file, wrong));
    let ended = lab.trackside(&["conform", "wrong.fmu"]).expect(1);
    assert!(ended.stdout.contains("there is no variable `absent`"), "{}", ended.stdout);
}
