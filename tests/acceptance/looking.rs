//! Checks that whoever looks at a scenario or a system loads no code of it, and that code out of an archive runs only where it is trusted.

use std::process::Command;

use super::fmus::{changed, relay, with};
use super::harness::{Ended, Lab};

tests! {
    a_script_is_not_run_by_looking: Compiler,
    a_plugin_is_not_loaded_by_looking: Compiler,
    a_workspace_in_an_archive_is_never_built: Compiler,
    a_script_out_of_an_archive_runs_only_where_it_is_trusted: Compiler,
    paths_of_an_archive_stay_in_it: Compiler,
}

const NODE: &str =
    "[time]\nstep = 0.25\nstop = 1.0\n[[fmu]]\nname = \"a\"\npath = \"relay.fmu\"\nunconnected = \"start\"\n";

/// A folder with an FMU, and the system `case.ssp` whose annotation is a scenario with `words`.
fn system(words: &str) -> Lab {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab.write("case.toml", NODE);
    lab.trackside(&["pack", "case.toml", "--ssp", "--out", "case.ssp"]).expect(0);
    let archive = changed(&lab.path("case.ssp"), |name, bytes| {
        let is_description = name.ends_with(".ssd");
        let text = |bytes| String::from_utf8(bytes).expect("a text").replace("[[fmu]]", words);
        let bytes = if is_description { text(bytes).into_bytes() } else { bytes };
        Some((name.to_owned(), bytes))
    });
    lab.write("case.ssp", archive);
    lab
}

/// Puts a text file into the system.
fn add(lab: &Lab, file: &str, text: &str) {
    let archive = with(&lab.path("case.ssp"), file, text);
    lab.write("case.ssp", archive);
}

/// The words of an analysis by the code that `key` names, before those of the FMU.
fn analysis(code: &str) -> String {
    format!("[[analysis]]\nname = \"t\"\n{code}\nsignals = {{ x = \"a.x_out\" }}\n\n[[fmu]]")
}

/// Looks at `file` in each way. The analysis is told, and nothing leaves the mark.
fn look(lab: &Lab, file: &str, analysis: &str) {
    let lines = lab.trackside(&["inspect", file]).expect(0).stdout;
    assert!(lines.contains("analyses, whose code was not loaded"), "{lines}");
    assert!(lines.contains(analysis), "{lines}");
    let json = lab.trackside(&["inspect", "--json", file]).expect(0).stdout;
    let about: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(about["analyses"][0]["code"], analysis, "{about}");
    lab.trackside(&["inspect", "--dot", file]).expect(0);
    assert!(!lab.has("mark"), "looking at {file} ran the code of its analysis");
}

/// Runs the scenario, which loads the code: without the mark the other tests would prove nothing.
fn run(lab: &Lab) {
    let ended = lab.trackside(&["run", "case.toml", "--rerun", "off"]);
    assert!(lab.has("mark"), "{}", ended.message());
    std::fs::remove_file(lab.path("mark")).expect("the mark");
}

fn a_script_is_not_run_by_looking() {
    let code = "python = \"spy.py\"";
    let lab = system(&analysis(code));
    let script = format!("open({:?}, \"w\").close()\n", lab.path("mark"));
    lab.write("spy.py", &script);
    add(&lab, "spy.py", &script);
    look(&lab, "case.ssp", code);
    lab.write("case.toml", NODE.replace("[[fmu]]", &analysis(code)));
    look(&lab, "case.toml", code);
    run(&lab);
}

fn a_plugin_is_not_loaded_by_looking() {
    let code = "path = \"spy.so\"";
    let lab = system(&analysis(code));
    let spy = format!(
        "#include <stdio.h>\n__attribute__((constructor)) static void spy(void) {{ fclose(fopen({:?}, \"w\")); }}\n",
        lab.path("mark")
    );
    lab.write("spy.c", spy);
    let mut cc = Command::new("cc");
    cc.args(["-shared", "-fPIC", "-o"]).arg(lab.path("spy.so")).arg(lab.path("spy.c"));
    Ended::of(cc.output().expect("a C compiler")).expect(0);
    look(&lab, "case.ssp", code);
    lab.write("case.toml", NODE.replace("[[fmu]]", &analysis(code)));
    look(&lab, "case.toml", code);
    run(&lab);
}

fn a_workspace_in_an_archive_is_never_built() {
    let words = "[[fmu]]\nname = \"b\"\ncrate = \"spy\"\n\n[[fmu]]";
    let lab = system(words);
    let manifest = "[package]\nname = \"spy\"\nversion = \"0.1.0\"\nedition = \"2024\"\n[lib]\ncrate-type = [\"cdylib\"]\n[workspace]\n";
    let mark = lab.path("mark");
    add(&lab, "Cargo.toml", manifest);
    add(&lab, "build.rs", &format!("fn main() {{ std::fs::write({mark:?}, \"\").unwrap() }}\n"));
    add(&lab, "src/lib.rs", "");
    for command in ["inspect", "run"] {
        let says = ["case.ssp", "spy", "crate", "workspace"];
        lab.trackside(&[command, "case.ssp"]).expect(2).says(&says);
        assert!(!lab.has("mark"), "{command} ran a build script of the archive");
    }
}

fn a_script_out_of_an_archive_runs_only_where_it_is_trusted() {
    let lab = system(&analysis("python = \"spy.py\""));
    let script = format!(
        "open({:?}, \"w\").close()\nsignals = {{\"x\": \"\"}}\ndef analyse(signals, config, run): return {{\"y\": 1.0}}\n",
        lab.path("mark")
    );
    add(&lab, "spy.py", &script);
    let run = |file: &str, more: &[&str]| {
        let arguments = [&["run", file, "--rerun", "off"], more].concat();
        let ended = lab.trackside(&arguments);
        let ran = lab.has("mark");
        let _ = std::fs::remove_file(lab.path("mark"));
        (ended, ran)
    };
    for more in [&[][..], &["--isolate"]] {
        let (ended, ran) = run("case.ssp", more);
        ended.expect(2).says(&["`spy.py` is code out of an archive", "case.ssp", "--trust", "[trust]"]);
        assert!(!ran, "{more:?}");
    }
    let (ended, ran) = run("case.ssp", &["--trust"]);
    ended.expect(0);
    assert!(ran);
    let hash = fmu_import::sha256_hex(script.as_bytes());
    for (hash, code) in [(hash.as_str(), 0), (&"0".repeat(64), 2)] {
        lab.write("own.toml", format!("extends = \"case.ssp\"\n[trust]\n\"spy.py\" = \"{hash}\"\n"));
        let (ended, ran) = run("own.toml", &[]);
        ended.expect(code);
        assert_eq!(ran, code == 0, "{hash}");
    }
    // An archive does not vouch for itself.
    let lab = system(&format!("[trust]\n\"spy.py\" = \"{hash}\"\n\n{}", analysis("python = \"spy.py\"")));
    add(&lab, "spy.py", &script);
    lab.trackside(&["run", "case.ssp"]).expect(2).says(&["`spy.py` is code out of an archive"]);
}

fn paths_of_an_archive_stay_in_it() {
    let outside = Lab::new();
    let secret = outside.write("secret.csv", "time,x\n0,42\n1,43\n");
    for path in [secret.display().to_string(), format!("{}{}", "../".repeat(20), secret.display())] {
        let table = format!("[[table]]\nname = \"t\"\nfile = \"{path}\"\n\n[[fmu]]");
        let ended = system(&table).trackside(&["run", "case.ssp", "--rerun", "off"]).expect(2);
        assert!(!ended.message().contains("42"), "{}", ended.message());
    }
}
