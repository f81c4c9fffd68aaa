//! Fills disks: it is told as what it is, and nothing that is left looks complete.

use std::path::Path;
use std::process::Command;

use super::fixture::Scenario;
use super::harness::{Ended, Lab, trackside};

tests! {
    a_full_disk_is_told_and_leaves_nothing_that_looks_complete: SmallDisk,
    a_full_disk_fails_a_test: SmallDisk,
    a_limit_of_file_sizes_is_told_as_what_it_is,
    what_is_printed_is_whole_or_an_error,
    where_nobody_takes_errors_the_exit_code_stays,
}

/// A shell command with a disk of this size at a folder, which is gone when it ends.
pub fn on_disk(size: &str, folder: &str, command: &str) -> Command {
    let mut shell = Command::new("unshare");
    let script = format!("mount -t tmpfs -o size={size} none '{folder}' && {command}");
    shell.args(["--map-root-user", "--mount", "sh", "-c", &script]);
    shell
}

fn scenario() -> String {
    let two = Scenario::new()
        .time(0.001, 1000.0)
        .signal("a.x", "constant = 1.0")
        .signal("a.y", "sine = { amplitude = 1.0, frequency = 1.3 }");
    two.check("passes", "time >= 0").text()
}

/// Runs the program with these arguments in a lab whose folder `disk` is a disk of this size. What it leaves there comes to `left`.
fn run(lab: &Lab, size: &str, arguments: &str) -> Ended {
    let disk = lab.path("disk");
    std::fs::create_dir_all(&disk).expect("a folder");
    lab.write("case.toml", scenario());
    let own = trackside(Path::new(""));
    let program = own.get_program().to_str().expect("a path of letters");
    let command = format!("{program} {arguments}; code=$?; cp -r disk left; exit $code");
    let mut shell = on_disk(size, disk.to_str().expect("a path of letters"), &command);
    Ended::of(shell.current_dir(lab.path("")).output().expect("it starts"))
}

fn a_full_disk_is_told_and_leaves_nothing_that_looks_complete() {
    // Full at the start, in the first chunk, and after many.
    for (size, recovers) in [("4k", false), ("64k", false), ("1m", true)] {
        for more in ["", "--csv"] {
            let lab = Lab::new();
            let arguments = format!("run case.toml --rerun off --out disk/out {more}");
            let ended = run(&lab, size, &arguments).expect(2);
            ended.says(&["could not write", "No space left on device", "disk/out/run."]);
            for complete in ["report.json", "report.html", "run.csv"] {
                assert!(!lab.has(&format!("left/out/{complete}")), "{size} {more}: {complete}");
            }
            if recovers {
                let found = lab.trackside(&["recover", "left/out/run.mcap", "--out", "new.mcap"]);
                found.expect(0);
                let bytes = std::fs::read(lab.path("new.mcap")).expect("a recording");
                let rows = mcap::MessageStream::new(&bytes).expect("a recording").count();
                assert!(rows > 1000, "{rows}");
            }
        }
    }
}

fn a_full_disk_fails_a_test() {
    let lab = Lab::new();
    let ended = run(&lab, "64k", "test case.toml --junit disk/junit.xml").expect(0);
    assert!(ended.stdout.contains("1 passed"), "{}", ended.stdout);
    // Its results go to `target/runs`, which is another disk here.
    let full = "yes > disk/full; ";
    let own = trackside(Path::new(""));
    let program = own.get_program().to_str().expect("a path of letters").to_owned();
    let script = format!("({full} true) 2> /dev/null; {program} test case.toml --junit disk/junit.xml");
    let disk = lab.path("disk");
    let mut shell = on_disk("64k", disk.to_str().expect("a path of letters"), &script);
    let ended = Ended::of(shell.current_dir(lab.path("")).output().expect("it starts")).expect(2);
    ended.says(&["junit.xml", "could not write", "No space left on device"]);
}

fn what_is_printed_is_whole_or_an_error() {
    let lab = Lab::new();
    let print = |output: &str| {
        let output = std::fs::File::create(output).expect("a device");
        let mut schema = trackside(&lab.path(""));
        Ended::of(schema.arg("schema").stdout(output).output().expect("it starts"))
    };
    print("/dev/null").expect(0);
    print("/dev/full").expect(2).says(&["standard output: could not write", "No space left"]);
}

fn a_limit_of_file_sizes_is_told_as_what_it_is() {
    let lab = Lab::new();
    lab.write("case.toml", scenario());
    let own = trackside(Path::new(""));
    let program = own.get_program().to_str().expect("a path of letters");
    let script = format!("ulimit -f 100; {program} run case.toml --rerun off --out out");
    let mut shell = Command::new("sh");
    let ended = shell.args(["-c", &script]).current_dir(lab.path("")).output().expect("it starts");
    Ended::of(ended).expect(2).says(&["out/run.mcap", "could not write", "File too large", "ulimit -f"]);
    assert!(!lab.has("out/report.json"));
}

fn where_nobody_takes_errors_the_exit_code_stays() {
    let lab = Lab::new();
    lab.write("case.toml", scenario().replace("1000.0", "0.01").replace("time >= 0", "time < 0"));
    for (arguments, code) in [("run nope.toml", 2), ("run case.toml --rerun off", 1), ("tset", 2)] {
        for output in ["2> /dev/full", "2>&-", "2>&1 > /dev/null | true"] {
            let own = trackside(Path::new(""));
            let program = own.get_program().to_str().expect("a path of letters");
            let script = format!("({program} {arguments}; echo $? > code) {output}");
            let mut shell = Command::new("sh");
            assert!(
                shell.args(["-c", &script]).current_dir(lab.path("")).status().expect("it starts").success()
            );
            assert_eq!(lab.read("code").trim(), code.to_string(), "{arguments} {output}");
        }
    }
}
