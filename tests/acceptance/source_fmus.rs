//! Runs FMUs of C sources: they are compiled once, with the bits of a library that came along; mistakes in them, and what refuses to compile.

use std::path::Path;
use std::process::{Command, Stdio};

use super::fixture::Scenario;
use super::fmus::{archive, changed, resizable};
use super::harness::{Ended, Lab, ROOT, trackside};
use super::requirement::reference_fmus;

tests! {
    sources_are_compiled_once_and_their_fmu_is_isolated: Compiler,
    a_list_of_sources_and_files_of_headers_are_obeyed: Compiler,
    a_build_description_is_obeyed: Compiler,
    a_mistake_in_sources_is_told_with_its_line: Compiler,
    whoever_looks_or_forbids_it_compiles_nothing: Compiler,
    without_a_compiler_the_cure_is_told,
    two_runs_at_once_compile_one_library: Compiler,
    sources_of_reference_fmus_give_the_bits_of_their_libraries: ReferenceFmus,
}

/// The description and the sources of the FMU that adds `rate` per second.
fn counter(lab: &Lab, description: impl Fn(String) -> String, rate: &str, more: &[(&str, &str)]) {
    let tests = Path::new(ROOT).join("tests/acceptance/fmu");
    let shared = Path::new(ROOT).join("crates/fmu-import/tests/support");
    let text = |path: std::path::PathBuf| std::fs::read_to_string(path).expect("a text");
    let model = format!("{rate}\n{}", text(tests.join("counter.c")));
    let mut entries = vec![
        ("modelDescription.xml", description(text(tests.join("counter.xml")))),
        ("sources/counter.c", model),
        ("sources/refusals.c", text(shared.join("refusals.c"))),
        ("sources/fmi2.h", text(shared.join("fmi2.h"))),
    ];
    entries.extend(more.iter().map(|(name, text)| (*name, (*text).to_owned())));
    let entries: Vec<_> = entries.iter().map(|(name, text)| (*name, text.as_bytes())).collect();
    lab.write("counter.fmu", archive(&entries));
}

fn lab(rate: &str) -> Lab {
    let lab = Lab::new();
    counter(&lab, |text| text, rate, &[]);
    lab.write("case.toml", scenario().text());
    lab
}

fn scenario() -> Scenario {
    Scenario::new().time(0.25, 1.0).fmu("it", "counter.fmu", "").check("it counts", "last(it.y) == 3.0")
}

/// The program with a cache folder of the lab, which is empty at first.
fn command(lab: &Lab) -> Command {
    let mut command = trackside(&lab.path(""));
    command.env("XDG_CACHE_HOME", lab.path("cache")).env_remove("CC").env_remove("CXX");
    command
}

fn run(lab: &Lab, arguments: &[&str]) -> Ended {
    Ended::of(command(lab).args(arguments).output().expect("it starts"))
}

const RUN: [&str; 5] = ["run", "case.toml", "--rerun", "off", "--csv"];

/// The libraries that are kept.
fn libraries(lab: &Lab) -> Vec<String> {
    let entries = std::fs::read_dir(lab.path("cache/trackside/fmu-libraries"));
    let names = entries.into_iter().flatten().map(|it| it.expect("an entry").file_name().into_string());
    names.collect::<Result<_, _>>().expect("names")
}

const RATE: &str = "#define RATE 3.0";

fn sources_are_compiled_once_and_their_fmu_is_isolated() {
    let lab = lab(RATE);
    let told =
        ["`it` runs in a process of its own", "the library of counter.fmu is compiled from its sources"];
    run(&lab, &RUN)
        .expect(0)
        .says(&told)
        .says(&["counter.fmu: its sources were compiled by ", "fmu-libraries/counter-"]);
    let kept = libraries(&lab);
    assert!(kept.len() == 1 && kept[0].ends_with(".so"), "{kept:?}");
    run(&lab, &RUN).expect(0).says(&["counter.fmu: its sources were compiled before by "]);
    let judged = run(&lab, &["conform", "counter.fmu"]).stdout;
    assert!(judged.contains("its sources were compiled before by "), "{judged}");
    run(&lab, &["test", "case.toml"]).expect(0);
    lab.write("case.toml", scenario().text().replace("[[check]]", "isolate = false\n\n[[check]]"));
    let inside = run(&lab, &RUN).expect(0);
    assert!(!inside.stderr.contains("process of its own"), "{}", inside.stderr);
    assert_eq!(libraries(&lab), kept);
    // What was damaged in the folder is made again.
    lab.write(&format!("cache/trackside/fmu-libraries/{}", kept[0]), "half of it");
    run(&lab, &RUN).expect(0).says(&["its sources were compiled by "]);
    // Other sources are another library.
    counter(&lab, |text| text, "#define RATE (1.5 + 1.5)", &[]);
    run(&lab, &RUN).expect(0).says(&["its sources were compiled by "]);
    assert_eq!(libraries(&lab).len(), 2);
}

fn a_list_of_sources_and_files_of_headers_are_obeyed() {
    let lab = lab(RATE);
    let listed = |text: String| {
        let list =
            "<SourceFiles><File name=\"counter.c\"/><File name=\"refusals.c\"/></SourceFiles></CoSimulation>";
        text.replace("StepSize=\"true\"/>", &format!("StepSize=\"true\">{list}"))
    };
    let more = [("sources/more/rate.h", RATE), ("sources/broken.c", "This is no C.\n")];
    counter(&lab, listed, "", &more);
    run(&lab, &RUN).expect(0);
    // Without the list a file that another one includes is a part of that one.
    let more = [
        ("sources/rate.h", "#include \"part.c\"\n"),
        ("sources/part.c", "#define RATE 3.0\nstatic int rate;\n"),
    ];
    counter(&lab, |text| text, "", &more);
    run(&lab, &RUN).expect(0);
}

/// The sources of an FMU of FMI 3.0 in place of its library; `sets` of its build description.
fn sources_of_three(lab: &Lab, sets: &str) {
    let path = lab.write("three.fmu", resizable());
    let model = std::fs::read(Path::new(ROOT).join("tests/acceptance/fmu/resizable.c")).expect("a text");
    let build = format!(
        "<?xml version=\"1.0\"?><fmiBuildDescription fmiVersion=\"3.0\"><BuildConfiguration modelIdentifier=\"resizable\">{sets}</BuildConfiguration></fmiBuildDescription>"
    );
    let check = "#include <fmi3Functions.h>\n#include \"scale.h\"\n#if SCALE != 7 || !defined PLAIN\n#error nothing is defined\n#endif\nfmi3Status trackside_check(void) { return fmi3OK; }\n";
    let bytes =
        changed(&path, |name, bytes| (!name.starts_with("binaries")).then(|| (name.to_owned(), bytes)));
    lab.write("three.fmu", bytes);
    let files: [(&str, &[u8]); 5] = [
        ("sources/model/resizable.c", &model),
        ("sources/check.c", check.as_bytes()),
        ("sources/unused.c", b"This is no C.\n"),
        ("sources/more/scale.h", b"#define SCALE FACTOR\n"),
        ("sources/buildDescription.xml", build.as_bytes()),
    ];
    for (name, bytes) in files {
        let text = std::str::from_utf8(bytes).expect("a text");
        let archive = super::fmus::with(&lab.path("three.fmu"), name, text);
        lab.write("three.fmu", archive);
    }
}

fn a_build_description_is_obeyed() {
    let lab = Lab::new();
    let sets = "<SourceFileSet language=\"C99\"><SourceFile name=\"model/resizable.c\"/></SourceFileSet>\
        <SourceFileSet compiler=\"gcc\" compilerOptions=\"-fno-common -fplugin=x\"><SourceFile name=\"check.c\"/>\
        <PreprocessorDefinition name=\"FACTOR\" value=\"7\"/><PreprocessorDefinition name=\"PLAIN\"/>\
        <IncludeDirectory name=\"more\"/></SourceFileSet>";
    sources_of_three(&lab, sets);
    lab.write("plain.fmu", resizable());
    let case = |path: &str| {
        let text = Scenario::new().time(0.1, 0.3).fmu("one", path, "n = 3, u = [1, 10, 100]");
        lab.write("case.toml", text.key("unconnected = \"start\"").text());
        let ended = run(&lab, &[&RUN[..], &["--out", "out"]].concat()).expect(0);
        (ended, lab.read("out/run.csv"))
    };
    let (ended, compiled) = case("three.fmu");
    ended.says(&["its compiler option `-fplugin=x` is left out"]);
    assert_eq!(compiled, case("plain.fmu").1);
    sources_of_three(&lab, "<SourceFileSet><SourceFile name=\"absent.c\"/></SourceFileSet>");
    lab.write("case.toml", Scenario::new().time(0.1, 0.3).fmu("one", "three.fmu", "").text());
    let told = [
        "case.toml:",
        "sources/buildDescription.xml: it lists absent.c, and the archive has no sources/absent.c",
    ];
    run(&lab, &RUN).expect(2).says(&told);
}

fn a_mistake_in_sources_is_told_with_its_line() {
    let lab = lab("#define RATE 3.0;\n#error rates are for clocks");
    let told =
        ["node `it`", "counter.fmu: its sources: sources/counter.c:2:2: error: #error rates are for clocks"];
    run(&lab, &RUN).expect(3).says(&told);
    assert!(libraries(&lab).is_empty(), "{:?}", libraries(&lab));
    let judged = run(&lab, &["conform", "counter.fmu"]).expect(1).stdout;
    assert!(judged.contains("sources/counter.c:2:2: error:"), "{judged}");
    counter(&lab, |text| text, "", &[("sources/rate.h", "#define RATE missing_rate()\n")]);
    run(&lab, &RUN).expect(3).says(&["missing_rate"]);
    let empty = changed(&lab.path("counter.fmu"), |name, bytes| {
        let is_model = name == "sources/counter.c";
        Some((name.to_owned(), if is_model { b"int nothing;\n".to_vec() } else { bytes }))
    });
    lab.write("counter.fmu", empty);
    run(&lab, &RUN)
        .expect(3)
        .says(&["they define none of the functions that FMI has, such as fmi2FreeInstance"]);
}

fn whoever_looks_or_forbids_it_compiles_nothing() {
    let lab = lab(RATE);
    let about = run(&lab, &["inspect", "counter.fmu"]).expect(0).stdout;
    assert!(about.contains("once a run has compiled its sources: 2 files in sources, by "), "{about}");
    run(&lab, &["inspect", "case.toml"]).expect(0);
    run(&lab, &["pack", "case.toml", "--ssp", "--out", "case.ssp"]).expect(0);
    run(&lab, &["inspect", "case.ssp"]).expect(0);
    lab.write("case.toml", scenario().text().replace("[[check]]", "compile = false\n\n[[check]]"));
    let told = [
        "case.toml:9",
        "counter.fmu has no library for this machine, only sources, which are not to be compiled",
    ];
    run(&lab, &RUN).expect(2).says(&told);
    assert!(!lab.has("cache"), "something was compiled");
}

fn without_a_compiler_the_cure_is_told() {
    let lab = lab(RATE);
    let bare = |arguments: &[&str]| {
        let mut command = command(&lab);
        Ended::of(command.env("PATH", lab.path("")).args(arguments).output().expect("it starts"))
    };
    let told =
        ["found none, and sources, which cannot be compiled: no compiler for C is there", "apt install gcc"];
    bare(&RUN).expect(2).says(&told);
    let about = bare(&["inspect", "counter.fmu"]).expect(0).stdout;
    assert!(told.iter().all(|part| about.contains(part)), "{about}");
    let mut named = command(&lab);
    let ended = Ended::of(named.env("CC", "no-such-cc -O1").args(RUN).output().expect("it starts"));
    ended
        .expect(2)
        .says(&["the environment variable CC names the compiler `no-such-cc`, which is not there"]);
}

fn two_runs_at_once_compile_one_library() {
    let lab = lab(RATE);
    let start = |out: &str| {
        let mut command = command(&lab);
        command.args(RUN).args(["--out", out]).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.spawn().expect("it starts")
    };
    let both = ["one", "two"].map(start);
    let ended = both.map(|child| Ended::of(child.wait_with_output().expect("it ends")).expect(0).stderr);
    let made = ended.iter().filter(|text| text.contains("its sources were compiled by ")).count();
    assert_eq!(made, 1, "{ended:?}");
    assert_eq!(libraries(&lab).len(), 1);
}

/// In co-simulation and in model exchange, as far as an FMU has them and a scenario of one node runs.
fn sources_of_reference_fmus_give_the_bits_of_their_libraries() {
    let mut compared = 0;
    for version in ["2.0", "3.0"] {
        let folder = std::fs::read_dir(reference_fmus().join(version)).expect("FMUs");
        for path in folder.map(|entry| entry.expect("an FMU").path()) {
            let lab = Lab::new();
            lab.add(&path);
            let without_library =
                |name: &str, bytes| (!name.starts_with("binaries")).then(|| (name.to_owned(), bytes));
            lab.write("sources.fmu", changed(&path, without_library));
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            for interface in ["co-simulation", "model-exchange"] {
                let table = |fmu: &str| {
                    let text =
                        Scenario::new().time(0.1, 2.0).fmu("it", fmu, "").key("unconnected = \"start\"");
                    lab.write("case.toml", text.key(&format!("interface = {interface:?}")).text());
                    let ended = run(&lab, &[&RUN[..], &["--out", &format!("{fmu}.out")]].concat());
                    (ended.code() == Some(0)).then(|| lab.read(&format!("{fmu}.out/run.csv")))
                };
                let [compiled, shipped] = ["sources.fmu", &name].map(table);
                assert_eq!(compiled, shipped, "{version} {name} {interface}");
                compared += usize::from(shipped.is_some());
            }
        }
    }
    assert!(compared >= 20, "{compared}");
}
