//! Lets libcosim and Ecos simulate our FMUs, alone and in their own coupling, and compares every value with
//! ours; and runs an FMU that another tool made.

use std::path::Path;

use serde_json::json;

use super::fixture::Scenario;
use super::fmus::{changed, example, ours};
use super::harness::{Ended, Lab, ROOT, record, trackside};
use super::python::{Python, python};

tests! {
    the_plant_gives_equal_results_in_other_importers: Masters,
    the_jacobi_closed_loop_gives_equal_results_in_other_importers: Masters,
    the_closed_loop_as_a_system_gives_equal_results_in_other_importers: Masters,
    the_example_gives_equal_results_in_other_importers: Masters,
    a_scenario_in_one_fmu_gives_equal_results_in_other_importers: Masters,
    two_fmus_made_in_python_exchange_values_of_all_types: PythonLibrary,
    an_fmu_made_in_python_runs: PythonLibrary,
    fmus_made_in_python_find_their_python_and_name_what_it_lacks: PythonLibrary,
}

/// The closed loop: the connections of the three FMUs.
const LOOP: [(&str, &str); 15] = [
    ("controller.F_x", "plant.F_x"),
    ("controller.delta", "plant.delta"),
    ("controller.F_x", "estimator.F_x"),
    ("controller.delta", "estimator.delta"),
    ("plant.v_x", "estimator.v_x_meas"),
    ("plant.v_y", "estimator.v_y_meas"),
    ("plant.r", "estimator.r_meas"),
    ("plant.a_y", "estimator.a_y_meas"),
    ("plant.psi", "controller.psi"),
    ("estimator.v_x", "controller.v_x"),
    ("estimator.v_y", "controller.v_y"),
    ("estimator.r", "controller.r"),
    ("estimator.xi_x", "controller.xi_x"),
    ("estimator.xi_y", "controller.xi_y"),
    ("estimator.xi_psi", "controller.xi_psi"),
];

fn head(stop: f64) -> Scenario {
    Scenario::headed("title = 'Importers'").time(0.01, stop)
}

fn fmu(name: &str, start: &str) -> String {
    let path = ours().join(format!("{name}.fmu"));
    Scenario::new().fmu(name, &path.display().to_string(), start).text()
}

/// Runs the scenario with us, then the same system with both tools; gives the folder with our run.
fn compare(scenario: &str, mut system: serde_json::Value) -> Lab {
    let python = python();
    let lab = Lab::new();
    lab.write("importers.toml", scenario);
    record(&lab, "importers.toml", "run", &["--rerun", "off"]);
    let header = lab.table("run/run.csv").lines().next().unwrap_or_default().to_owned();
    let targets: Vec<_> = LOOP.iter().map(|(_, to)| *to).collect();
    let fmus: Vec<String> =
        system["fmus"].as_object().into_iter().flatten().map(|fmu| fmu.0.clone()).collect();
    let of_an_fmu = |name: &&str| fmus.iter().any(|fmu| name.starts_with(&format!("{fmu}.")));
    let inputs = system["inputs"].clone();
    let given = |name: &str| inputs.as_array().into_iter().flatten().any(|input| input == name);
    let outputs: Vec<_> =
        header.split(',').filter(of_an_fmu).filter(|name| !targets.contains(name) && !given(name)).collect();
    assert!(!outputs.is_empty(), "{header}");
    system["outputs"] = json!(outputs);
    let description = lab.write("system.json", system.to_string());
    for tool in ["libcosim", "ecos"] {
        let (description, csv) = (description.as_os_str(), lab.path("run/run.csv"));
        python.run("coupled.py", &[tool.as_ref(), description, csv.as_os_str()]);
    }
    lab
}

fn the_plant_gives_equal_results_in_other_importers() {
    let scenario = head(10.0).text()
        + &fmu("plant", "start.v_x = 25.0")
        + "
[[signal]]
name = 'driver.delta'
unit = 'rad'
multisine = { peak = 0.05, frequencies = [0.2, 0.5, 1.1] }
[[signal]]
name = 'driver.F_x'
unit = 'N'
sine = { amplitude = 2000.0, frequency = 0.3 }
[[connect]]
from = 'driver.delta'
to = 'plant.delta'
[[connect]]
from = 'driver.F_x'
to = 'plant.F_x'
";
    let system = json!({
        "step": 0.01,
        "fmus": { "plant": ours().join("plant.fmu") },
        "start": { "plant.start.v_x": 25.0 },
        "connections": [],
        "inputs": ["plant.F_x", "plant.delta"],
    });
    compare(&scenario, system);
}

/// The scenario of the closed loop.
fn closed_loop(stop: f64) -> String {
    let connect = |(from, to): &(&str, &str)| format!("[[connect]]\nfrom = '{from}'\nto = '{to}'\n");
    head(stop).text()
        + "[coupling]\nalgorithm = 'jacobi'\n"
        + &fmu("plant", "")
        + &fmu("estimator", "")
        + &fmu("controller", "v_ref = 25.0, r_ref = 0.2, psi_ref = 0.0")
        + &LOOP.iter().map(connect).collect::<String>()
}

/// Both tools read the system of SSP that the scenario is packed as.
fn the_closed_loop_as_a_system_gives_equal_results_in_other_importers() {
    let lab = Lab::new();
    lab.write("case.toml", closed_loop(4.0));
    lab.trackside(&["pack", "case.toml", "--ssp", "--out", "."]).expect(0);
    record(&lab, "case.ssp", "run", &["--rerun", "off"]);
    let (system, csv) = (lab.path("case.ssp"), lab.path("run/run.csv"));
    for tool in ["libcosim", "ecos"] {
        let arguments = [tool.as_ref(), system.as_os_str(), "0.01".as_ref(), csv.as_os_str()];
        python().run("system_ssp.py", &arguments);
    }
}

fn the_jacobi_closed_loop_gives_equal_results_in_other_importers() {
    let scenario = closed_loop(10.0);
    let system = |version: &str| {
        let path = |name: &str| ours().join(format!("{name}{version}.fmu"));
        json!({
            "step": 0.01,
            "fmus": {
                "plant": path("plant"),
                "estimator": path("estimator"),
                "controller": path("controller"),
            },
            "start": {
                "controller.v_ref": 25.0, "controller.r_ref": 0.2, "controller.psi_ref": 0.0
            },
            "connections": LOOP,
            "inputs": [],
            "outputs": ["plant.X", "plant.Y", "plant.r", "controller.F_x", "estimator.v_x"],
        })
    };
    let lab = compare(&scenario, system(""));
    // libcosim has no FMI 3.0.
    let description = lab.write("system3.json", system("_fmi3").to_string());
    let csv = lab.path("run/run.csv");
    python().run("coupled.py", &["ecos".as_ref(), description.as_os_str(), csv.as_os_str()]);
}

/// libcosim unloads the library of an FMU before its threads end.
fn a_scenario_in_one_fmu_gives_equal_results_in_other_importers() {
    let packed = Lab::new();
    let mut pack = trackside(Path::new(ROOT));
    pack.args(["pack", "scenarios/double_lane_change.toml", "--fmu", "rig"]);
    pack.args(["--inputs", "reference.v", "--outputs", "plant.*", "controller.*", "--out"]);
    Ended::of(pack.arg(packed.path("")).output().expect("it starts")).expect(0);
    let path = packed.path("rig.fmu");
    let scenario = head(4.0).fmu("rig", &path.display().to_string(), "").text()
        + "
[[signal]]
name = 'driver.v'
unit = 'km/h'
ramp = { before = 70.0, after = 76.0, start = 0.5, end = 3.5 }
[[connect]]
from = 'driver.v'
to = 'rig.reference.v'
";
    let system = json!({
        "step": 0.01,
        "fmus": { "rig": path },
        "start": {},
        "connections": [],
        "inputs": ["rig.reference.v"],
    });
    compare(&scenario, system);
}

/// Also in fmpy's own loop: the example is the pattern for FMUs of users, so it should run everywhere.
fn the_example_gives_equal_results_in_other_importers() {
    let path = example().display().to_string();
    let scenario = head(10.0).fmu("mass", &path, "m = 2.5").text()
        + "
[[signal]]
name = 'driver.F'
unit = 'N'
multisine = { peak = 20.0, frequencies = [0.3, 1.1, 2.9] }
[[connect]]
from = 'driver.F'
to = 'mass.F'
";
    let system = json!({
        "step": 0.01,
        "fmus": { "mass": example() },
        "start": { "mass.m": 2.5 },
        "connections": [],
        "inputs": ["mass.F"],
    });
    let lab = compare(&scenario, system);
    let (csv, start) = (lab.path("run/run.csv"), "{\"m\": 2.5}");
    let arguments = ["mass".as_ref(), example().as_os_str(), csv.as_os_str(), start.as_ref()];
    python().run("simulate.py", &arguments);
}

/// A node of an FMU with variables of all types that was made in Python.
fn made_in_python(name: &str, archive: &str, inputs: &str) -> String {
    let start = format!("count = 3, on = true, label = 'hello'{inputs}");
    Scenario::new().fmu(name, archive, &start).key(PYTHON_UNITS).text()
}

/// pythonfmu writes no units.
const PYTHON_UNITS: &str = "unit = { u = 'rad', y = 'rad' }";

/// Runs a scenario that is made of the path of the archive, with the Python that the FMU needs.
#[track_caller]
fn run_python(python: &Python, lab: &Lab, scenario: impl Fn(&str) -> String, code: i32) -> Ended {
    let [_, archive, _] = python.fmus(&lab.path("made"));
    lab.write("python.toml", scenario(&archive));
    let mut command = trackside(&lab.path(""));
    command
        .args(["run", "python.toml", "--out", "run", "--csv", "--rerun", "off"])
        .env("TRACKSIDE_PYTHON", python.program());
    Ended::of(command.output().expect("it starts")).expect(code)
}

/// The outputs of one instance go to the inputs of a second one, in all types.
fn two_fmus_made_in_python_exchange_values_of_all_types() {
    let python = python();
    for (algorithm, late) in [("gauss_seidel", 0), ("jacobi", 1)] {
        let lab = Lab::new();
        let head = head(0.2).text();
        let scenario = |archive: &str| {
            let mut text = format!("{head}[coupling]\nalgorithm = '{algorithm}'\n")
                + &made_in_python("second", archive, "")
                + &made_in_python("first", archive, ", u = 0.1, k = 0, c = false, t = ''");
            for (from, to) in [("y", "u"), ("n", "k"), ("b", "c"), ("s", "t")] {
                text += &format!("[[connect]]\nfrom = 'first.{from}'\nto = 'second.{to}'\n");
            }
            text + &format!(
                "[[check]]\nname = 'numbers'\nduring = [0.02, 0.2]\n\
                 that = 'first.n - second.k_out == {late} and abs(first.b - second.c_out) == {late}'\n\
                 [[check]]\nname = 'reals'\nthat = 'last(second.y) == 3 * last(first.y)'\n\
                 [[check]]\nname = 'texts'\nduring = [0.02, 0.2]\n\
                 that = \"(second.t_out == first.s) == {}\"\n\
                 [[check]]\nname = 'the text'\nthat = \"last(first.s == 'hello 20') == 1\"\n",
                1 - late
            )
        };
        run_python(python, &lab, scenario, 0);
        python.run("compare_mcap.py", &[lab.path("run/run.mcap"), lab.path("run/run.csv")]);
    }
}

/// The same FMU alone and in front of our plant.
fn an_fmu_made_in_python_runs() {
    let python = python();
    let lab = Lab::new();
    let scenario = |archive: &str| {
        head(10.0).text()
            + &made_in_python("demo", archive, ", k = 0, c = false, t = ''")
            + &fmu("plant", "F_x = 0.0")
            + "
[[signal]]
name = 'driver.delta'
unit = 'rad'
sine = { amplitude = 0.01, frequency = 0.5 }
[[connect]]
from = 'driver.delta'
to = 'demo.u'
[[connect]]
from = 'demo.y'
to = 'plant.delta'
[[check]]
name = 'integer parameter, real input and output'
that = 'abs(demo.y - 3 * demo.u) < 1e-12 and plant.delta == demo.y'
during = [0.01, 10.0]
[[check]]
name = 'integer and boolean outputs'
that = 'last(demo.n) == 1000 and min(demo.b) == 0 and max(demo.b) == 1'
"
    };
    let without = |archive: &str| scenario(archive).replace(PYTHON_UNITS, "");
    run_python(python, &Lab::new(), without, 2).says(&[
        "`demo` have no unit: `u` meets `driver.delta` [rad], `y` meets `plant.delta` [rad]",
        "in [[fmu]] `demo` which units they have, such as unit = { u = \"rad\", y = \"rad\" }",
    ]);
    let ended = run_python(python, &lab, scenario, 0);
    assert!(ended.stdout.contains("all 2 checks passed"), "{}", ended.stdout);
}

/// Two scripts do not share the modules of one Python; both find it, also in a sandbox.
fn fmus_made_in_python_find_their_python_and_name_what_it_lacks() {
    let python = python();
    let lab = Lab::new();
    let [_, demo, sum] = python.fmus(&lab.path("made"));
    let run = |scenario: Scenario| {
        lab.write("python.toml", scenario.text());
        let mut command = trackside(&lab.path(""));
        command.args(["run", "python.toml", "--out", "run"]).env("TRACKSIDE_PYTHON", python.program());
        Ended::of(command.output().expect("it starts"))
    };
    let adds = |key: &str| {
        let node =
            head(0.2).fmu("sum", &sum, "u = 1.0").key(&format!("unit = {{ u = '1', y = '1' }}\n{key}"));
        node.check("it adds", "abs(last(sum.y) - 0.4) < 1e-9")
    };
    run(adds("isolate = true")).expect(0);
    let inputs = "count = 3, on = true, label = 'hello', u = 0.1, k = 0, c = false, t = ''";
    let told = "expect Python in the process, and a process has only one, with one module of a name";
    run(adds("").fmu("demo", &demo, inputs)).expect(0).says(&[told]);
    let lacks = changed(Path::new(&sum), |name, bytes| match name {
        "resources/integrator.py" => Some((name.to_owned(), [b"import of_nobody\n", &bytes[..]].concat())),
        _ => Some((name.to_owned(), bytes)),
    });
    lab.write("lacks.fmu", lacks);
    let told = ["No module named 'of_nobody'", "-m pip install of_nobody`", "TRACKSIDE_PYTHON"];
    run(head(0.2).fmu("sum", "lacks.fmu", "u = 1.0")).expect(3).says(&told);
}
