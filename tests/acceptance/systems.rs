//! Runs systems of SSP: archives and folders, transformations, nested systems, bindings and units; and scenarios that extend one.

use super::fmus::{archive, relay, resizable};
use super::harness::{Ended, Lab};
use super::requirement::reference_fmus;

tests! {
    a_system_runs_as_an_archive_a_folder_and_a_file: Compiler,
    values_are_transformed_on_their_way: Compiler,
    nested_systems_and_bindings_reach_the_fmus: Compiler,
    units_are_converted_unless_that_is_suppressed: Compiler,
    a_scenario_extends_a_system: Compiler,
    a_loop_of_a_system_is_stepped_as_by_libcosim_and_ecos: Compiler,
    a_system_is_stepped_as_its_tool_noted: Compiler,
    fmus_of_both_versions_meet_in_a_system: Compiler,
    a_wrong_system_is_told_with_file_line_and_cure: Compiler,
    public_systems_give_the_values_that_one_computes_by_hand: ReferenceFmus,
    connections_between_parameters_are_start_values: ReferenceFmus,
}

/// A description with these elements, connections and bindings of the system, and things behind it.
fn description(elements: &str, connections: &str, bindings: &str, behind: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription version="1.0" name="case"
    xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
    xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues">
  <ssd:System name="root">
    <ssd:ParameterBindings>{bindings}</ssd:ParameterBindings>
    <ssd:Elements>{elements}</ssd:Elements>
    <ssd:Connections>{connections}</ssd:Connections>
  </ssd:System>
  {behind}
</ssd:SystemStructureDescription>"#
    )
}

/// A relay whose connectors are x, n, on, mode and their outputs; x in a unit, if there is one.
fn component(name: &str, unit: &str) -> String {
    let connector = |variable: &str, kind: &str| {
        let inner = match &variable[..1] {
            "x" if unit.is_empty() => "<ssc:Real/>".to_owned(),
            "x" => format!("<ssc:Real unit=\"{unit}\"/>"),
            "n" => "<ssc:Integer/>".to_owned(),
            "m" => "<ssc:Enumeration name=\"Mode\"/>".to_owned(),
            _ => "<ssc:Boolean/>".to_owned(),
        };
        format!("<ssd:Connector name=\"{variable}\" kind=\"{kind}\">{inner}</ssd:Connector>")
    };
    let inputs: String = ["x", "n", "on", "mode"].iter().map(|it| connector(it, "input")).collect();
    let outputs = ["x_out", "n_out", "on_out", "mode_out"];
    let outputs: String = outputs.iter().map(|it| connector(it, "output")).collect();
    format!(
        "<ssd:Component name=\"{name}\" source=\"resources/relay.fmu\"><ssd:Connectors>{inputs}{outputs}</ssd:Connectors></ssd:Component>"
    )
}

fn connection(from: &str, to: &str, inner: &str) -> String {
    connection_with(from, to, "", inner)
}

fn connection_with(from: &str, to: &str, attribute: &str, inner: &str) -> String {
    let side = |side: &str, name: &str| {
        let (element, connector) = name.split_once('.').expect("element.connector");
        format!("{side}Element=\"{element}\" {side}Connector=\"{connector}\"")
    };
    let (start, end) = (side("start", from), side("end", to));
    format!("<ssd:Connection {start} {end} {attribute}>{inner}</ssd:Connection>")
}

/// Start values of the system by name.
fn binding(values: &[(&str, &str)]) -> String {
    let parameter =
        |(name, value): &(&str, &str)| format!("<ssv:Parameter name=\"{name}\">{value}</ssv:Parameter>");
    let parameters: String = values.iter().map(parameter).collect();
    format!(
        "<ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version=\"1.0\" name=\"p\"><ssv:Parameters>{parameters}</ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding>"
    )
}

const STOP: &str = "<ssd:DefaultExperiment startTime=\"0\" stopTime=\"1\"/>";

/// Runs the system as an archive.
fn run(ssd: &str) -> (Lab, Ended) {
    let lab = Lab::new();
    write(&lab, ssd);
    let ended = lab.trackside(&["run", "case.ssp", "--out", "out", "--csv"]);
    (lab, ended)
}

fn write(lab: &Lab, ssd: &str) {
    let entries: [(&str, &[u8]); 3] = [
        ("SystemStructure.ssd", ssd.as_bytes()),
        ("resources/relay.fmu", relay()),
        ("resources/resizable.fmu", resizable()),
    ];
    lab.write("case.ssp", archive(&entries));
}

fn last(lab: &Lab, column: &str) -> String {
    let table = lab.table("out/run.csv");
    let mut lines = table.lines();
    let titles: Vec<_> = lines.next().expect("titles").split(',').collect();
    let place = titles.iter().position(|title| *title == column);
    let place = place.unwrap_or_else(|| panic!("no {column} in {titles:?}"));
    lines.last().expect("a row").split(',').nth(place).expect("a cell").to_owned()
}

/// Two relays: x of the second is twice that of the first, plus 1.
fn chain() -> String {
    let transformation = "<ssc:LinearTransformation factor=\"2\" offset=\"1\"/>";
    description(
        &(component("a", "") + &component("b", "")),
        &connection("a.x_out", "b.x", transformation),
        &binding(&[("a.x", "<ssv:Real value=\"3\"/>")]),
        STOP,
    )
}

fn a_system_runs_as_an_archive_a_folder_and_a_file() {
    let (lab, ended) = run(&chain());
    ended
        .expect(0)
        .says(&["runs from 0 s to 1 s (its DefaultExperiment)", "500 steps, since no FMU proposes one"]);
    assert_eq!(last(&lab, "b.x_out"), "7");
    let archived = lab.table("out/run.csv");
    lab.write("folder/SystemStructure.ssd", chain());
    lab.write("folder/resources/relay.fmu", relay());
    for path in ["folder", "folder/SystemStructure.ssd"] {
        lab.trackside(&["run", path, "--out", "out", "--csv"]).expect(0);
        assert_eq!(lab.table("out/run.csv"), archived);
    }
    // What a run takes from the command line it takes here too.
    lab.trackside(&["run", "case.ssp", "--set", "a.x=4", "--out", "out", "--csv"]).expect(0);
    assert_eq!(last(&lab, "b.x_out"), "9");
}

fn values_are_transformed_on_their_way() {
    let entry = |kind: &str, from: &str, to: &str| {
        format!(
            "<ssc:{kind}MappingTransformation><ssc:MapEntry source=\"{from}\" target=\"{to}\"/></ssc:{kind}MappingTransformation>"
        )
    };
    let connections = connection("a.n_out", "b.n", &entry("Integer", "5", "-7"))
        + &connection("a.on_out", "b.on", &entry("Boolean", "true", "false"))
        + &connection("a.mode_out", "b.mode", &entry("Enumeration", "off", "tripped"));
    let bindings =
        binding(&[("a.n", "<ssv:Integer value=\"5\"/>"), ("a.on", "<ssv:Boolean value=\"true\"/>")]);
    let enumeration = "<ssd:Enumerations><ssc:Enumeration name=\"Mode\"><ssc:Item name=\"off\" value=\"1\"/><ssc:Item name=\"armed\" value=\"2\"/><ssc:Item name=\"tripped\" value=\"4\"/></ssc:Enumeration></ssd:Enumerations>";
    let elements = component("a", "") + &component("b", "");
    let (lab, ended) =
        run(&description(&elements, &connections, &bindings, &(enumeration.to_owned() + STOP)));
    ended.expect(0);
    let seen = ["a.n_out", "b.n_out", "a.on_out", "b.on_out", "a.mode_out", "b.mode_out"];
    assert_eq!(seen.map(|column| last(&lab, column)), ["5", "-7", "1", "0", "1", "4"]);
}

fn nested_systems_and_bindings_reach_the_fmus() {
    // The inner system doubles, the outer one adds 10 to what comes out of it.
    let inner = format!(
        "<ssd:System name=\"sub\"><ssd:Connectors><ssd:Connector name=\"in\" kind=\"input\"><ssc:Real/></ssd:Connector><ssd:Connector name=\"out\" kind=\"output\"><ssc:Real/></ssd:Connector></ssd:Connectors><ssd:Elements>{}</ssd:Elements><ssd:Connections><ssd:Connection startConnector=\"in\" endElement=\"b\" endConnector=\"x\"><ssc:LinearTransformation factor=\"2\"/></ssd:Connection><ssd:Connection startElement=\"b\" startConnector=\"x_out\" endConnector=\"out\"/></ssd:Connections></ssd:System>",
        component("b", "")
    );
    let connections = connection("a.x_out", "sub.in", "")
        + &connection("sub.out", "c.x", "<ssc:LinearTransformation offset=\"10\"/>");
    let bindings = binding(&[("a.x", "<ssv:Real value=\"3\"/>"), ("sub.b.n", "<ssv:Integer value=\"42\"/>")]);
    let elements = component("a", "") + &inner + &component("c", "");
    let (lab, ended) = run(&description(&elements, &connections, &bindings, STOP));
    ended.expect(0);
    let seen = ["sub_b.x_out", "c.x_out", "sub_b.n_out"];
    assert_eq!(seen.map(|column| last(&lab, column)), ["6", "16", "42"]);
}

fn units_are_converted_unless_that_is_suppressed() {
    let units = "<ssd:Units><ssc:Unit name=\"m/s\"><ssc:BaseUnit m=\"1\" s=\"-1\"/></ssc:Unit><ssc:Unit name=\"km/h\"><ssc:BaseUnit m=\"1\" s=\"-1\" factor=\"0.25\"/></ssc:Unit><ssc:Unit name=\"kg\"><ssc:BaseUnit kg=\"1\"/></ssc:Unit></ssd:Units>";
    let elements = component("a", "m/s") + &component("b", "km/h") + &component("c", "km/h");
    let connections = connection("a.x_out", "b.x", "<ssc:LinearTransformation factor=\"1\" offset=\"0.5\"/>")
        + &connection_with("a.x_out", "c.x", "suppressUnitConversion=\"true\"", "");
    let bindings = binding(&[("a.x", "<ssv:Real value=\"8\" unit=\"km/h\"/>")]);
    // A set of parameters has units of its own.
    let own = units.replace("ssd:Units", "ssv:Units");
    let bindings = bindings.replace("</ssv:Parameters>", &format!("</ssv:Parameters>{own}"));
    let behind = units.to_owned() + STOP;
    let (lab, ended) = run(&description(&elements, &connections, &bindings, &behind));
    ended.expect(0);
    // 8 quarters of a m/s are 2 m/s, which are 8 of those units again.
    let seen = ["a.x_out", "b.x_out", "c.x_out"];
    assert_eq!(seen.map(|column| last(&lab, column)), ["2", "8.5", "2"]);
    let elements = component("a", "m/s") + &component("b", "kg");
    let wrong = description(&elements, &connection("a.x_out", "b.x", ""), "", &behind);
    run(&wrong).1.expect(2).says(&["SystemStructure.ssd:", "[m/s]", "[kg]", "suppressUnitConversion"]);
}

fn a_scenario_extends_a_system() {
    let lab = Lab::new();
    write(&lab, &chain());
    let scenario = "extends = \"case.ssp\"\n[time]\nstep = 0.25\nstop = 2.0\n[[fault]]\ninput = \"b.x\"\nfrom = 1.0\nvalue = -1.0\n[[check]]\nname = \"doubled\"\nthat = \"max(b.x_out) == 7\"\n[[check]]\nname = \"faulty\"\nthat = \"last(b.x_out) == -1\"\n";
    lab.write("scenario.toml", scenario);
    let ended = lab.trackside(&["run", "scenario.toml", "--out", "out", "--csv"]).expect(0);
    assert!(ended.stdout.contains("all 2 checks passed"), "{}", ended.stdout);
    assert_eq!(lab.table("out/run.csv").lines().count(), 10);
}

/// Two relays in a loop. The first one counts its steps, so the other one shows how late the count reaches it.
fn ring() -> String {
    let ways = connection("a.x_out", "b.x", "") + &connection("b.x_out", "a.x", "");
    let counts = binding(&[("a.gear", "<ssv:Enumeration value=\"reverse\"/>")]);
    let elements = component("a", "") + &component("b", "");
    description(&elements, &ways, &counts, STOP)
}

fn a_loop_of_a_system_is_stepped_as_by_libcosim_and_ecos() {
    let (lab, ended) = run(&ring());
    let told = ["coupled by jacobi (its connections form a loop, and libcosim and Ecos give"];
    let ended = ended.expect(0).says(&told);
    assert!(!ended.stderr.contains("delayed") && !ended.stderr.contains("gauss"), "{}", ended.stderr);
    let steps = |steps: f64| (steps / 3.0).to_string();
    assert_eq!(["a.x_out", "b.x_out"].map(|it| last(&lab, it)), [steps(500.0), steps(499.0)]);
    // Gauss-Seidel delays one of them.
    let told = [
        "form a loop: b.x_out -> a.x, a.x_out -> b.x; delayed by a step, with the value of its start: b.x_out -> a.x.",
        "--coupling jacobi",
        "[[connect]] to = \"b.x\" and at = \"start\"",
        "coupled by gauss_seidel;",
    ];
    let seidel = ["run", "case.ssp", "--coupling", "gauss_seidel", "--out", "out", "--csv"];
    lab.trackside(&seidel).expect(0).says(&told);
    assert_eq!(last(&lab, "b.x_out"), steps(500.0));
    // A scenario says which one, or that it wants to say so.
    let other = "extends = \"case.ssp\"\n[coupling]\nalgorithm = \"gauss_seidel\"\n";
    lab.write("other.toml", format!("{other}[[connect]]\nto = \"b.x\"\nat = \"start\"\n"));
    let ended = lab.trackside(&["run", "other.toml", "--out", "out", "--csv"]).expect(0);
    assert!(!ended.stderr.contains("loop"), "{}", ended.stderr);
    assert_eq!(last(&lab, "b.x_out"), steps(499.0));
    lab.write("strict.toml", format!("{other}loops = \"refuse\"\n"));
    let told = ["case.ssp/SystemStructure.ssd:", "form a loop", "loops = \"delay\""];
    let ended = lab.trackside(&["run", "strict.toml"]).expect(2).says(&told);
    assert!(!ended.stderr.contains("/tmp/"), "{}", ended.stderr);
    // A gathered scenario is the same one.
    lab.write("twice.toml", "extends = \"case.ssp\"\ntitle = \"twice\"\n");
    lab.trackside(&["pack", "twice.toml", "--ssp", "--out", "twice.ssp"]).expect(0);
    lab.trackside(&["run", "twice.ssp", "--out", "out", "--csv"]).expect(0);
    assert_eq!(last(&lab, "b.x_out"), steps(499.0));
}

fn a_system_is_stepped_as_its_tool_noted() {
    let noted = |step: &str| {
        let inner = format!(
            "<ssd:Annotations><ssc:Annotation type=\"com.opensimulationplatform\"><osp:Algorithm xmlns:osp=\"http://osp\"><osp:FixedStepAlgorithm baseStepSize=\"{step}\"/></osp:Algorithm></ssc:Annotation></ssd:Annotations>"
        );
        let stop = STOP.replace("/>", &format!(">{inner}</ssd:DefaultExperiment>"));
        ring().replace(STOP, &stop)
    };
    let (lab, ended) = run(&noted("0.2"));
    let told = [
        "the step 0.2 s (noted at case.ssp/SystemStructure.ssd:",
        "coupled by jacobi (the FixedStepAlgorithm of case.ssp/SystemStructure.ssd:",
    ];
    let ended = ended.expect(0).says(&told);
    assert!(!ended.stderr.contains("is ignored"), "{}", ended.stderr);
    let seen = ["a.x_out", "b.x_out"].map(|it| last(&lab, it));
    assert_eq!(seen, [5.0, 4.0].map(|steps| (steps / 3.0).to_string()));
    // The command line counts more.
    let run = ["run", "case.ssp", "--coupling", "gauss_seidel", "--out", "out", "--csv"];
    lab.trackside(&run).expect(0).says(&["coupled by gauss_seidel;", "form a loop"]);
}

fn fmus_of_both_versions_meet_in_a_system() {
    let three = "<ssd:Component name=\"b\" source=\"resources/resizable.fmu\"><ssd:Connectors><ssd:Connector name=\"u[2]\" kind=\"input\"><ssc:Real/></ssd:Connector></ssd:Connectors></ssd:Component>";
    let elements = component("a", "") + three;
    let bindings = binding(&[("a.x", "<ssv:Real value=\"3\"/>"), ("b.gain", "<ssv:Real value=\"1\"/>")]);
    let bindings =
        bindings.replace("<ssv:Parameter name=\"b.gain\"><ssv:Real value=\"1\"/></ssv:Parameter>", "");
    let ssd = description(&elements, &connection("a.x_out", "b.u[2]", ""), &bindings, STOP);
    let (lab, ended) = run(&ssd);
    ended.expect(0).says(&["the step 0.1 s (the shortest one that its FMUs propose)"]);
    assert_eq!(last(&lab, "b.y[2]"), "3");
}

fn a_wrong_system_is_told_with_file_line_and_cure() {
    let good = chain();
    for (from, to, told) in [
        ("relay.fmu", "absent.fmu", &["case.ssp", "SystemStructure.ssd:8:", "absent.fmu"][..]),
        ("startConnector=\"x_out\"", "startConnector=\"y\"", &["SystemStructure.ssd:9:", "`y`"]),
        ("startTime=\"0\"", "startTime=\"1\"", &["expected a stop time after the start time 1 s, found 1 s"]),
        ("factor=\"2\"", "factor=\"two\"", &["SystemStructure.ssd:9:", "two"]),
        (
            "<ssd:Component name=\"a\"",
            "<ssd:Component implementation=\"ModelExchange\" name=\"a\"",
            &["SystemStructure.ssd:8:", "expected the interface ModelExchange, found CoSimulation"],
        ),
        ("x_out", "missing", &["SystemStructure.ssd:9:", "`missing`", "does not have"]),
        // What only the resolved scenario knows is told at the element, too.
        ("<ssv:Real value=\"3\"/>", "<ssv:String value=\"three\"/>", &["SystemStructure.ssd:7:", "three"]),
        ("relay.fmu", "resizable.fmu", &["SystemStructure.ssd:9:", "does not have"]),
        ("resources/relay.fmu", "resources", &["SystemStructure.ssd:8:", "found a folder", "ZIP"]),
    ] {
        run(&good.replace(from, to)).1.expect(2).says(told);
    }
    let lab = Lab::new();
    lab.write("system.ssp", [0xff, 0xfe, 0x00]);
    lab.trackside(&["run", "system.ssp"]).expect(2).says(&["system.ssp is not an .ssp archive"]);
    lab.write("scenario.toml", "extends = \"system.ssp\"\n");
    lab.trackside(&["run", "scenario.toml"]).expect(2).says(&["scenario.toml:1", "system.ssp"]);
}

fn public_systems_give_the_values_that_one_computes_by_hand() {
    let lab = Lab::new();
    // k = 30 and 20, u1 = -20, and u2 keeps the 0 of its FMU.
    for (system, column, expected) in
        [("LinearTransformation3", "Add1.y", "182"), ("import_export_parameters2", "addP.y", "-600")]
    {
        let path = reference_fmus().join("../ssp").join(system);
        let path = path.to_str().expect("a readable path");
        lab.trackside(&["run", path, "--out", "out", "--csv"]).expect(0);
        assert_eq!(last(&lab, column), expected, "{system}");
    }
}

fn connections_between_parameters_are_start_values() {
    let gain = |name: &str, kind: &str| {
        format!(
            "<ssd:Component name=\"{name}\" source=\"Gain.fmu\"><ssd:Connectors><ssd:Connector name=\"k\" kind=\"{kind}\"><ssc:Real/></ssd:Connector></ssd:Connectors></ssd:Component>"
        )
    };
    let system = |source: &str, bound: &str| {
        let elements = gain("a", "unspecified") + &gain("b", "parameter");
        let factor = "<ssc:LinearTransformation factor=\"2\" offset=\"1\"/>";
        let connection = connection(source, "b.k", factor);
        let bindings = binding(&[(bound, "<ssv:Real value=\"3\"/>"), ("b.u", "<ssv:Real value=\"2\"/>")]);
        description(&elements, &connection, &bindings, STOP)
            .replace("version=\"1.0\" name=\"case\"", "version=\"2.0\" name=\"case\"")
    };
    let lab = Lab::new();
    lab.add(&reference_fmus().join("../ssp/LinearTransformation3/resources/Gain.fmu"));
    // 2 k + 1 times u = 2; k is 3, or the 1 of the description.
    for (bound, expected) in [("a.k", "14"), ("a.u", "6")] {
        lab.write("SystemStructure.ssd", system("a.k", bound));
        lab.trackside(&["run", "SystemStructure.ssd", "--out", "out", "--csv"]).expect(0);
        assert_eq!(last(&lab, "b.y"), expected, "{bound}");
    }
    // An output of the FMU is known too late, whatever its connector is called.
    let late = system("a.y", "a.k").replacen("name=\"k\"", "name=\"y\"", 1);
    lab.write("SystemStructure.ssd", late);
    let told = ["SystemStructure.ssd:", "a constant or a parameter", "`y`", "ParameterBinding"];
    lab.trackside(&["run", "SystemStructure.ssd"]).expect(2).says(&told);
}
