//! Runs sweeps by a Slurm and a HyperQueue of this machine, disturbs them, and compares the tables with that of one process.

use std::collections::BTreeSet;
use std::process::Child;
use std::sync::OnceLock;
use std::time::Duration;

use sweep::table;

use super::engines::{Machines, Random, ends_with, hyperqueue, said, signal, slurm};
use super::fixture::Scenario;
use super::fmus::{misbehave, relay};
use super::harness::{Lab, wait_until};

tests! {
    slurm_gives_the_table_of_one_process_whatever_is_killed: Compiler + Slurm,
    a_slurm_that_is_left_alone_gives_the_table_without_a_second_submission: Compiler + Slurm,
    what_slurm_refuses_is_told_in_its_words: Compiler + Slurm,
    hyperqueue_gives_the_table_of_one_process_whatever_is_killed: Compiler + Python,
}

/// Noise on a relay, beside an FMU that fails in some variants.
pub fn scenario(variants: u32) -> String {
    Scenario::new()
        .time(0.01, 40.0)
        .fmu("relay", "relay.fmu", "")
        .key("unconnected = \"start\"")
        .fmu("tank", "misbehave.fmu", "fault = 'fmi2DoStep', status = 3")
        .signal("wave.x", "sine = { amplitude = 1.0, frequency = 0.5 }")
        .connect("wave.x", "relay.x")
        .key("noise = { std = 0.1 }")
        .connect("relay.x_out", "tank.u")
        .check("bounded", "max(abs(relay.x_out)) < 2.2")
        .section(&format!("[sweep]\ndesign = \"monte_carlo\"\nvariants = {variants}"))
        .section("[[sweep.vary]]\nname = \"relay.x.noise.std\"\nuniform = [0.1, 0.6]")
        .section("[[sweep.vary]]\nname = \"tank.at\"\nuniform = [20.0, 120.0]")
        .section("[sweep.collect]\nlargest = \"max(relay.x_out)\"\nspread = \"std(relay.x_out)\"")
        .text()
}

/// A folder with the scenario and its FMUs.
pub fn lab(variants: u32) -> Lab {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab.write("misbehave.fmu", misbehave());
    lab.write("case.toml", scenario(variants));
    lab
}

const CHUNK: &str = "20";
const CHUNKS: usize = 25;

/// The same sweep of 500 variants by one process, made once.
fn alone() -> &'static (Lab, Option<i32>) {
    static RUN: OnceLock<(Lab, Option<i32>)> = OnceLock::new();
    RUN.get_or_init(|| {
        let lab = lab(500);
        let ended = lab.trackside(&["sweep", "case.toml", "--out", "plan", "--chunk-size", CHUNK]);
        assert!(matches!(ended.code(), Some(0 | 3)), "{}", ended.stderr);
        (lab, ended.code())
    })
}

/// Insists on the table that a sweep by one process gave: each variant once, and every value but the times by the clock equal to the bit.
pub fn same_table(found: &Lab, expected: &Lab) {
    let results = |lab: &Lab| {
        let summary: serde_json::Value = serde_json::from_str(&lab.read("plan/sweep.json")).expect("JSON");
        summary["results"].as_str().expect("a digest").to_owned()
    };
    assert_eq!(results(found), results(expected));
    let [found, expected] =
        [found, expected].map(|lab| table::read_table(&lab.path("plan/sweep.parquet")).expect("a table"));
    let variants = found.column("variant").and_then(|it| it.as_integers()).expect("numbers");
    let each: Vec<i64> = (0..variants.len() as i64).collect();
    assert_eq!(variants, each);
    assert_eq!(found.columns.len(), expected.columns.len());
    for (column, other) in found.columns.iter().zip(&expected.columns) {
        assert_eq!(column.name, other.name);
        if column.name != "seconds" {
            // Missing numbers are equal, too.
            assert_eq!(format!("{:?}", column.values), format!("{:?}", other.values));
        }
    }
}

/// The chunks of all submissions to an engine, one for each time.
pub fn submitted(lab: &Lab, engine: &str) -> Vec<String> {
    let folders = std::fs::read_dir(lab.path("plan/submit").join(engine)).expect("submissions");
    let texts = folders.map(|it| std::fs::read_to_string(it.expect("a file").path().join("chunks")));
    let texts: Vec<_> = texts.map(|text| text.expect("chunks")).collect();
    texts.iter().flat_map(|text| text.lines().map(str::to_owned)).collect()
}

fn submit(machines: &Machines, engine: &str, output: &str) -> Child {
    let words = ["sweep", "submit", "plan", "--engine", engine];
    machines.start(machines.trackside(&words), output)
}

fn plan(machines: &Machines) {
    let words = ["sweep", "plan", "case.toml", "--out", "plan", "--chunk-size", CHUNK];
    said(machines.trackside(&words)).expect(0);
}

/// Kills chunks while the sweep goes on, until so many were killed or all are done; `disturb` does more at each moment.
fn kill(machines: &mut Machines, kills: usize, mut disturb: impl FnMut(&mut Machines, usize)) {
    let (mut killed, mut random) = (BTreeSet::new(), Random(0x5eed));
    let mut moment = 0;
    while killed.len() < kills && !machines.lab.has("plan/sweep.json") {
        std::thread::sleep(Duration::from_millis(50 + random.below(200) as u64));
        machines.kill_a_chunk(&mut killed, &mut random);
        disturb(machines, moment);
        moment += 1;
    }
    println!("{} chunks were killed", killed.len());
    assert!(killed.len() > 1, "the sweep was over too early");
}

fn slurm_gives_the_table_of_one_process_whatever_is_killed() {
    let (expected, code) = alone();
    let mut machines = slurm(lab(500)).expect("Slurm");
    plan(&machines);
    // By mistake two of them, at the same moment.
    let twice = ["first.out", "second.out"].map(|output| submit(&machines, "slurm", output));
    wait_until("a task is submitted", || machines.lab.has("plan/submit/slurm/0001/job"));
    // On machines whose file system does not lock, all might come once more: so it does here.
    let again = machines.lab.path("plan/submit/slurm/0001");
    let mut sbatch = machines.command("sbatch");
    sbatch.args(["--array=0-5", "--output=again_%a.log"]);
    said({
        sbatch.arg(machines.lab.path("plan/submit/slurm.sh")).arg(again);
        sbatch
    })
    .expect(0);
    kill(&mut machines, 8, |machines, moment| match moment {
        3 => machines.stop("slurmd", "TERM"),
        4 => machines.start_node(),
        // A machine that goes down takes all with it.
        6 => {
            machines.stop("slurmd", "KILL");
            for process in machines.processes() {
                let name = process.line.first().map(String::as_str).unwrap_or_default();
                if name.starts_with("slurmstepd") || name.ends_with("/sh") {
                    signal(process.number, "KILL");
                }
            }
            machines.start_node();
        }
        _ => {}
    });
    for (child, output) in twice.into_iter().zip(["first.out", "second.out"]) {
        ends_with(child, code.expect("a code"), output, &machines.lab);
    }
    same_table(&machines.lab, expected);
    assert!(submitted(&machines.lab, "slurm").len() > CHUNKS, "nothing was submitted again");
}

fn a_slurm_that_is_left_alone_gives_the_table_without_a_second_submission() {
    let machines = slurm(lab(60)).expect("Slurm");
    let words = ["sweep", "case.toml", "--out", "plan", "--chunk-size", "2"];
    let words = [&words[..1], &["submit"], &words[1..]].concat();
    let detached = [&words[..], &["--engine", "slurm", "--detach"]].concat();
    for _ in 0..2 {
        let ended = said(machines.trackside(&detached)).expect(0);
        assert!(ended.stdout.contains(" of 30 chunks done"), "{}", ended.stdout);
    }
    // Ended while it follows, it leaves the tasks alone.
    let following = [&words[..], &["--engine", "slurm"]].concat();
    let child = machines.start(machines.trackside(&following), "following.out");
    wait_until("it follows", || machines.lab.read("following.out").contains("chunks done"));
    signal(child.id(), "INT");
    ends_with(child, 130, "following.out", &machines.lab);
    let message = machines.lab.read("following.out");
    assert!(message.contains("the tasks go on, and the same command follows them"), "{message}");
    let ended = said(machines.trackside(&following));
    assert!(matches!(ended.code(), Some(0 | 3)), "{}", ended.stderr);
    // An array has at most 11 tasks here.
    let chunks = submitted(&machines.lab, "slurm");
    assert_eq!((chunks.len(), BTreeSet::from_iter(&chunks).len()), (30, 30));
    assert!(machines.lab.has("plan/submit/slurm/0003"));
    let alone = lab(60);
    let ended = alone.trackside(&["sweep", "case.toml", "--out", "plan", "--chunk-size", "2"]);
    assert!(matches!(ended.code(), Some(0 | 3)), "{}", ended.stderr);
    same_table(&machines.lab, &alone);
}

fn what_slurm_refuses_is_told_in_its_words() {
    let machines = slurm(lab(4)).expect("Slurm");
    plan(&machines);
    let submit = ["sweep", "submit", "plan", "--engine", "slurm", "--", "--partition=nowhere"];
    said(machines.trackside(&submit))
        .expect(2)
        .says(&["the chunks cannot be submitted", "invalid partition specified: nowhere"]);
    assert!(!machines.lab.has("plan/submit/slurm/0001"));
}

fn hyperqueue_gives_the_table_of_one_process_whatever_is_killed() {
    let (expected, code) = alone();
    let mut machines = hyperqueue(lab(500));
    plan(&machines);
    let twice = ["first.out", "second.out"].map(|output| submit(&machines, "hyperqueue", output));
    for output in ["first.out", "second.out"] {
        wait_until("it follows", || machines.lab.read(output).contains("chunks done"));
    }
    kill(&mut machines, 8, |machines, moment| {
        // With its server all of its jobs are lost.
        if moment == 5 {
            machines.stop("server", "KILL");
            machines.start_server();
        }
    });
    for (child, output) in twice.into_iter().zip(["first.out", "second.out"]) {
        ends_with(child, code.expect("a code"), output, &machines.lab);
    }
    same_table(&machines.lab, expected);
    assert!(submitted(&machines.lab, "hyperqueue").len() > CHUNKS, "nothing was submitted again");
}
