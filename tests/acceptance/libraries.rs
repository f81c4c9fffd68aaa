//! Runs FMUs that bring libraries along, share symbols or leave threads: each gets its own, and all ways to run give the same numbers.

use std::path::Path;
use std::process::Command;

use super::fixture::Scenario;
use super::fmus::archive;
use super::harness::{Ended, Lab, ROOT};

tests! {
    each_fmu_gets_its_own_library_of_a_name: Compiler,
    a_library_of_a_name_that_another_needs_is_not_given_to_it: Compiler,
    each_fmu_gets_its_own_variable_of_the_process: Compiler,
    equal_constants_and_instances_of_one_fmu_share_a_process: Compiler,
    what_an_earlier_run_left_is_not_shared: Compiler,
    fmus_that_cannot_share_a_process_are_not_packed_into_one: Compiler,
    a_library_beside_the_fmu_is_loaded: Compiler,
    a_library_that_cannot_be_found_by_its_name_is_told: Compiler,
    a_thread_that_outlives_its_fmu_ends_nothing: Compiler,
    threads_of_openmp_end_nothing: Compiler,
}

/// A compiled shared library.
fn compile(lab: &Lab, name: &str, source: &str, arguments: &[&str]) -> Vec<u8> {
    let path = lab.path(name);
    let tests = Path::new(ROOT).join("tests/acceptance/fmu");
    let shared = Path::new(ROOT).join("crates/fmu-import/tests/support");
    let mut cc = Command::new("cc");
    cc.args(["-shared", "-fPIC", "-O1"]).arg("-I").arg(&shared);
    match source {
        "" => cc.arg(tests.join("dependent.c")).arg(shared.join("refusals.c")),
        text => cc.arg(lab.write("source.c", text)),
    };
    cc.arg("-o").arg(&path).args(arguments).arg("-lpthread").current_dir(lab.path(""));
    Ended::of(cc.output().expect("a C compiler")).expect(0);
    std::fs::read(path).expect("the library")
}

/// The description of an FMU with the output `y` and the parameter `p`.
pub fn description(name: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{{dependent}}">
  <CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="p" valueReference="1" causality="parameter" variability="fixed"><Real start="1"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1"/></Outputs><InitialUnknowns><Unknown index="1"/></InitialUnknowns></ModelStructure>
</fmiModelDescription>
"#
    )
}

/// The library of the FMU `name`, compiled with these arguments.
pub fn library(lab: &Lab, name: &str, arguments: &[&str]) -> Vec<u8> {
    compile(lab, &format!("{name}.so"), "", arguments)
}

/// Puts the FMU `name` of this library, with more files beside it, into the lab.
fn write(lab: &Lab, name: &str, library: &[u8], beside: &[(&str, &[u8])]) {
    let path = format!("binaries/linux64/{name}.so");
    let text = description(name);
    let mut entries = vec![("modelDescription.xml", text.as_bytes()), (&path, library)];
    let more: Vec<_> =
        beside.iter().map(|(file, bytes)| (format!("binaries/linux64/{file}"), *bytes)).collect();
    entries.extend(more.iter().map(|(file, bytes)| (file.as_str(), *bytes)));
    lab.write(&format!("{name}.fmu"), archive(&entries));
}

/// The FMU `name` that shows what its own library of the name `libnext_rt.so` says.
fn bringing(lab: &Lab, name: &str, says: &str, arguments: &[&str]) {
    let source = format!("static double count; double dependent_next(void) {{ {says} }}");
    let beside = compile(lab, "libnext_rt.so", &source, &["-Wl,-soname,libnext_rt.so"]);
    let all = [&["-DLIBRARY", "-L.", "-lnext_rt"], arguments].concat();
    write(lab, name, &library(lab, name, &all), &[("libnext_rt.so", &beside)]);
}

const ORIGIN: &str = "-Wl,-rpath,$ORIGIN";

/// A scenario of ten steps with nodes of these FMUs, which end at these values.
fn scenario(nodes: &[(&str, &str, f64)]) -> Scenario {
    let mut text = Scenario::new().time(0.1, 1.0);
    for (node, fmu, _) in nodes {
        text = text.fmu(node, &format!("{fmu}.fmu"), "");
    }
    for (node, _, value) in nodes {
        text = text.check(&format!("{node} is its own"), &format!("last({node}.y) == {value:?}"));
    }
    text
}

/// Runs `case.toml` in all ways. The notices of a plain run name these words; without words there are none.
#[track_caller]
fn passes(lab: &Lab, words: &[&str]) {
    let run = |more: &str| {
        let given = ["run", "case.toml", "--out", "out", "--csv", "--rerun", "off", more];
        let ended = lab.trackside(&given).expect(0);
        assert!(!ended.stderr.contains("SIG"), "{more}: {}", ended.stderr);
        (ended, lab.report("out")["warnings"].to_string(), lab.read("out/run.csv"))
    };
    let (plain, warnings, numbers) = run("--isolate=none");
    for word in words {
        assert!(warnings.contains(word), "expected {word} in {warnings}");
    }
    match words {
        [] => assert_eq!(warnings, "[]"),
        _ => drop(plain.says(words)),
    }
    let (_, warnings, apart) = run("--isolate=all");
    assert_eq!(apart, numbers);
    assert!(!warnings.contains("a process of its own"), "{warnings}");
    for isolate in ["none", "foreign"] {
        lab.trackside(&["test", "case.toml", "--isolate", isolate]).expect(0);
    }
}

/// Adds a sweep to the scenario, runs it, and insists on the value of `one.y` in all variants.
#[track_caller]
fn sweeps(lab: &Lab, text: Scenario, words: &[&str]) {
    let node = "one";
    let sweep = format!(
        "[sweep]\ndesign = 'latin_hypercube'\nvariants = 12\n\n[[sweep.vary]]\nname = '{node}.p'\nuniform = [0.0, 1.0]\n\n[sweep.collect]\ny = 'max({node}.y)'"
    );
    lab.write("sweep.toml", text.section(&sweep).text());
    lab.trackside(&["sweep", "sweep.toml", "--out", "swept", "--jobs", "2"]).expect(0).says(words);
}

fn each_fmu_gets_its_own_library_of_a_name() {
    for says in ["return GAIN;", "return count += GAIN;"] {
        let lab = Lab::new();
        let [one, two] = ["1.0", "2.0"].map(|gain| says.replace("GAIN", gain));
        bringing(&lab, "first", &one, &[ORIGIN]);
        bringing(&lab, "second", &two, &[ORIGIN]);
        let factor = if says.contains("count") { 10.0 } else { 1.0 };
        let text = scenario(&[("one", "first", factor), ("two", "second", 2.0 * factor)]);
        lab.write("case.toml", text.clone().text());
        let words = ["`two` runs in a process of its own", "first.fmu", "second.fmu", "`libnext_rt.so`"];
        passes(&lab, &words);
        if factor == 1.0 {
            sweeps(&lab, text, &words);
        }
    }
    // The same file in both has a variable for each.
    let lab = Lab::new();
    bringing(&lab, "first", "return count += 1.0;", &[ORIGIN]);
    bringing(&lab, "second", "return count += 1.0;", &[ORIGIN]);
    lab.write("case.toml", scenario(&[("one", "first", 10.0), ("two", "second", 10.0)]).text());
    passes(&lab, &["`libnext_rt.so`"]);
}

fn a_library_of_a_name_that_another_needs_is_not_given_to_it() {
    let lab = Lab::new();
    // One has it from its archive, the other from a folder of the system; they come in either order. A RUNPATH would be searched later.
    bringing(&lab, "first", "return 1.0;", &["-Wl,--disable-new-dtags", ORIGIN]);
    let source = "double dependent_next(void) { return 2.0; }";
    let name = "libnext_rt.so";
    let system = compile(&lab, name, source, &["-Wl,-soname,libnext_rt.so"]);
    lab.write("system/libnext_rt.so", system);
    write(&lab, "second", &library(&lab, "second", &["-DLIBRARY", "-L.", "-lnext_rt"]), &[]);
    for nodes in
        [[("one", "first", 1.0), ("two", "second", 2.0)], [("two", "second", 2.0), ("one", "first", 1.0)]]
    {
        lab.write("case.toml", scenario(&nodes).text());
        let mut run = super::harness::trackside(&lab.path(""));
        run.args(["run", "case.toml", "--rerun", "off"]);
        run.env("LD_LIBRARY_PATH", lab.path("system"));
        let ended = Ended::of(run.output().expect("it starts")).expect(0);
        ended.says(&["runs in a process of its own", "`libnext_rt.so`"]);
    }
}

fn each_fmu_gets_its_own_variable_of_the_process() {
    for kind in ["UNIQUE", "CONSTANT"] {
        let lab = Lab::new();
        for (name, gain) in [("first", "1.0"), ("second", "10.0")] {
            write(&lab, name, &library(&lab, name, &[&format!("-D{kind}={gain}")]), &[]);
        }
        let text = scenario(&[("one", "first", 1.0), ("two", "second", 10.0)]);
        lab.write("case.toml", text.clone().text());
        let words = ["`two` runs in a process of its own", "`dependent_gain`", "STB_GNU_UNIQUE"];
        passes(&lab, &words);
        sweeps(&lab, text, &words);
    }
}

fn equal_constants_and_instances_of_one_fmu_share_a_process() {
    let lab = Lab::new();
    for name in ["first", "second"] {
        write(&lab, name, &library(&lab, name, &["-DCONSTANT=3.0"]), &[]);
    }
    let nodes = [("one", "first", 3.0), ("two", "second", 3.0), ("three", "first", 3.0)];
    lab.write("case.toml", scenario(&nodes).text());
    passes(&lab, &[]);
    bringing(&lab, "third", "return 3.0;", &[ORIGIN]);
    lab.write("case.toml", scenario(&[("one", "third", 3.0), ("two", "third", 3.0)]).text());
    passes(&lab, &[]);
}

fn what_an_earlier_run_left_is_not_shared() {
    let lab = Lab::new();
    for (name, gain) in [("first", "1.0"), ("second", "10.0")] {
        let unique = format!("-DUNIQUE={gain}");
        write(&lab, name, &library(&lab, name, &[&unique]), &[]);
        let value = gain.parse().expect("a number");
        lab.write(&format!("{name}.toml"), scenario(&[("one", name, value)]).text());
    }
    lab.write("third.toml", lab.read("first.toml"));
    // The library of the first one stays: the loader never unloads such symbols.
    let both = ["run", "first.toml", "second.toml", "third.toml", "--rerun", "off"];
    lab.trackside(&both).expect(0).says(&["runs in a process of its own", "`dependent_gain`"]);
    let validated = scenario(&[("one", "first", 1.0)]);
    let validation = "[[validation]]\nname = 'other'\nscenario = 'second.toml'";
    lab.write("case.toml", validated.section(validation).text());
    lab.trackside(&["run", "case.toml", "--rerun", "off"]).expect(0);
}

fn fmus_that_cannot_share_a_process_are_not_packed_into_one() {
    let lab = Lab::new();
    bringing(&lab, "first", "return 1.0;", &[ORIGIN]);
    bringing(&lab, "second", "return 2.0;", &[ORIGIN]);
    lab.write("case.toml", scenario(&[("one", "first", 1.0), ("two", "second", 2.0)]).text());
    let path = lab.path("case.toml");
    let mut pack = super::harness::trackside(Path::new(ROOT));
    pack.arg("pack").arg(path).args(["--fmu", "both", "--out"]).arg(lab.path("packed"));
    let ended = Ended::of(pack.output().expect("it starts")).expect(2);
    ended.says(&["`one` and `two` cannot be in one FMU", "`libnext_rt.so`", "--ssp"]);
}

fn a_library_beside_the_fmu_is_loaded() {
    let lab = Lab::new();
    bringing(&lab, "first", "return 3.0;", &[]);
    let text = scenario(&[("one", "first", 3.0)]);
    lab.write("case.toml", text.clone().text());
    passes(&lab, &[]);
    sweeps(&lab, text, &[]);
    let judged = lab.trackside(&["conform", "first.fmu"]);
    assert!(!judged.stdout.contains("does not load"), "{}", judged.stdout);
    // Two of them are a matter of names again.
    bringing(&lab, "second", "return 4.0;", &[]);
    lab.write("case.toml", scenario(&[("one", "first", 3.0), ("two", "second", 4.0)]).text());
    passes(&lab, &["`libnext_rt.so`"]);
}

fn a_library_that_cannot_be_found_by_its_name_is_told() {
    let lab = Lab::new();
    let source = "double dependent_next(void) { return 3.0; }";
    let beside = compile(&lab, "libnext_rt.so", source, &[]);
    let main = library(&lab, "first", &["-DLIBRARY", "-L.", "-lnext_rt"]);
    write(&lab, "first", &main, &[("libnext_rt.so", &beside)]);
    lab.write("case.toml", scenario(&[("one", "first", 3.0)]).text());
    for more in ["--isolate=none", "--isolate=all"] {
        let ended = lab.trackside(&["run", "case.toml", "--rerun", "off", more]).expect(3);
        ended.says(&["binaries/linux64/libnext_rt.so", "patchelf --set-rpath", "LD_LIBRARY_PATH"]);
    }
}

fn stays(lab: &Lab) {
    let text = scenario(&[("one", "first", 3.0)]);
    lab.write("case.toml", text.clone().text());
    lab.write("second.toml", text.clone().text());
    passes(lab, &[]);
    for _ in 0..10 {
        let both = ["run", "case.toml", "second.toml", "--rerun", "off"];
        let ended = lab.trackside(&both).expect(0);
        assert!(!ended.stderr.contains("SIG"), "{}", ended.stderr);
    }
    sweeps(lab, text, &[]);
}

fn a_thread_that_outlives_its_fmu_ends_nothing() {
    let lab = Lab::new();
    write(&lab, "first", &library(&lab, "first", &["-DTHREAD"]), &[]);
    stays(&lab);
}

fn threads_of_openmp_end_nothing() {
    let lab = Lab::new();
    write(&lab, "first", &library(&lab, "first", &["-DOPENMP", "-fopenmp"]), &[]);
    stays(&lab);
}
