//! Sweeps of this machine: what varies, what is in the table, what survives crashes, kills and FMUs that do not reset.

use std::path::Path;
use std::process::Stdio;

use sweep::table::{self, SweepColumn, SweepTable};

use super::cluster::{lab as noisy, same_table};
use super::fixture::Scenario;
use super::fmus::{drifting_relay, forgetful, misbehave, relay};
use super::harness::{Ended, Lab, ROOT, limit, signal, signalled, trackside, wait_while_it_runs};

tests! {
    a_grid_has_every_combination_with_units_margins_and_collected_values: Compiler,
    any_number_of_jobs_and_any_chunks_give_the_same_table: Compiler,
    a_sweep_that_was_killed_goes_on: Compiler,
    a_sweep_that_was_asked_to_end_keeps_what_is_done: Compiler,
    a_crash_is_a_result_with_node_call_and_time: Compiler,
    a_hang_is_a_result_with_node_call_and_time: Compiler,
    an_fmu_that_does_not_reset_gets_new_instances: Compiler,
    whole_fmus_signals_effects_faults_and_seeds_vary: Compiler,
    a_list_and_joint_draws_are_taken_line_by_line: Compiler,
    the_draws_of_an_identification_are_swept_over,
    a_replay_gives_the_same_bits_and_chosen_variants_are_recorded: Compiler,
    a_search_finds_the_limit_of_a_check_and_the_least_of_a_value: Compiler,
    settings_of_the_command_line_hold_in_all_variants: Compiler,
}

/// The table of a sweep in a folder of a lab.
pub fn results(lab: &Lab, folder: &str) -> SweepTable {
    table::read_table(&lab.path(folder).join("sweep.parquet")).expect("a table")
}

fn column<'t>(table: &'t SweepTable, name: &str) -> &'t SweepColumn {
    let names: Vec<_> = table.columns.iter().map(|it| &it.name).collect();
    table.column(name).unwrap_or_else(|| panic!("expected {name} among {names:?}"))
}

pub fn numbers(table: &SweepTable, name: &str) -> Vec<f64> {
    let column = column(table, name);
    let integers = || column.as_integers().map(|all| all.iter().map(|it| *it as f64).collect());
    column.as_numbers().map(<[f64]>::to_vec).or_else(integers).expect("numbers")
}

fn texts(table: &SweepTable, name: &str) -> Vec<String> {
    let texts = column(table, name).as_texts().expect("texts");
    texts.iter().map(|it| it.clone().unwrap_or_default()).collect()
}

/// A relay that follows a ramp up to a start value.
pub fn ramp(sweep: &str) -> String {
    Scenario::new()
        .time(0.1, 1.0)
        .fmu("relay", "relay.fmu", "")
        .key("unconnected = \"start\"")
        .signal("ramp.x", "unit = 'km/h'\nconstant = 3.6")
        .connect("ramp.x", "relay.x")
        .key("unit = 'km/h'")
        .check("low", "max(relay.x_out) < 30")
        .section(sweep)
        .text()
}

fn ramp_lab(sweep: &str) -> Lab {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab.write("case.toml", ramp(sweep));
    lab
}

const SWEEP: [&str; 4] = ["sweep", "case.toml", "--out", "plan"];

fn a_grid_has_every_combination_with_units_margins_and_collected_values() {
    let words = "[[sweep.vary]]\nname = 'ramp.x'\nunit = 'm/s'\nvalues = [5.0, 10.0]
        [[sweep.vary]]\nname = 'seed'\nrange = { from = 3, to = 5, count = 3 }
        [sweep.collect]\nlargest = 'max(relay.x_out)'\nmean = 'mean(abs(relay.x_out))'
        high = 'max(relay.x_out) > 20'";
    let lab = ramp_lab(words);
    let said = lab.trackside(&SWEEP).expect(1).stdout;
    assert!(said.contains("3 of 6 variants passed: 50.0 %"), "{said}");
    assert!(said.contains("low: fails by 6.0"), "{said}");
    assert!(said.contains("plan/sweep.html"), "{said}");
    let table = results(&lab, "plan");
    assert_eq!(numbers(&table, "variant"), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    assert_eq!(numbers(&table, "seed"), [3.0, 4.0, 5.0, 3.0, 4.0, 5.0]);
    assert_eq!(numbers(&table, "ramp.x"), [5.0, 5.0, 5.0, 10.0, 10.0, 10.0]);
    assert_eq!(column(&table, "ramp.x").unit.as_deref(), Some("m/s"));
    assert_eq!(texts(&table, "verdict"), ["passed", "passed", "passed", "failed", "failed", "failed"]);
    // The relay gets the signal in its own unit.
    let largest = numbers(&table, "collect.largest");
    assert!((largest[0] - 18.0).abs() < 1e-9 && (largest[5] - 36.0).abs() < 1e-9, "{largest:?}");
    assert_eq!(numbers(&table, "collect.high"), [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    let margins = numbers(&table, "margin.low");
    assert!((margins[0] - 12.0).abs() < 1e-9 && (margins[5] + 6.0).abs() < 1e-9, "{margins:?}");
    assert_eq!(numbers(&table, "steps"), [10.0; 6]);
    let page = lab.read("plan/sweep.html");
    assert!(page.contains("<td>low: smallest margin</td>"), "the page names the worst case");
    assert!(page.contains("trackside replay plan/0"), "and how to run a variant again");
}

fn any_number_of_jobs_and_any_chunks_give_the_same_table() {
    let (one, three) = (noisy(60), noisy(60));
    one.trackside(&["sweep", "case.toml", "--out", "plan", "--jobs", "1"]);
    three.trackside(&["sweep", "case.toml", "--out", "plan", "--jobs", "3", "--chunk-size", "7"]);
    same_table(&one, &three);
}

fn a_sweep_that_was_killed_goes_on() {
    let (whole, killed) = (noisy(400), noisy(400));
    let words = ["sweep", "case.toml", "--out", "plan", "--chunk-size", "20"];
    let code = whole.trackside(&words).code();
    for parts in [2, 7] {
        let mut child = trackside(&killed.path("")).args(words).spawn().expect("it starts");
        let done = || count(&killed.path("plan/parts")) >= parts;
        wait_while_it_runs(&mut child, "parts are done", done);
        child.kill().and_then(|()| child.wait()).expect("it dies");
    }
    assert!(!killed.has("plan/sweep.json"), "it was killed before its end");
    assert_eq!(killed.trackside(&words).code(), code);
    same_table(&killed, &whole);
}

fn count(folder: &Path) -> usize {
    std::fs::read_dir(folder).map_or(0, Iterator::count)
}

fn a_sweep_that_was_asked_to_end_keeps_what_is_done() {
    let (whole, ended) = (noisy(400), noisy(400));
    let words = ["sweep", "case.toml", "--out", "plan", "--chunk-size", "50"];
    let code = whole.trackside(&words).code();
    let mut child = signalled(&ended.path(""));
    let mut child = child.args(words).stderr(Stdio::piped()).spawn().expect("it starts");
    let done = || count(&ended.path("plan/parts")) >= 2;
    wait_while_it_runs(&mut child, "a part is done", done);
    signal(&child, "INT");
    let output = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("the same command goes on"), "{said}");
    assert!(!ended.has("plan/sweep.parquet"));
    let missing = ended.trackside(&["sweep", "gather", "plan"]).expect(2);
    missing.says(&["chunks of plan are not done", "trackside sweep run plan --chunk"]);
    assert_eq!(ended.trackside(&words).code(), code);
    same_table(&ended, &whole);
}

fn failing(fault: &str, more: &str) -> Lab {
    let lab = Lab::new();
    lab.write("misbehave.fmu", misbehave());
    let text = Scenario::new()
        .time(0.1, 1.0)
        .fmu("tank", "misbehave.fmu", &format!("fault = '{fault}'"))
        .key("unconnected = 'start'")
        .check("there", "count(time > 0) > 0")
        .section("[[sweep.vary]]\nname = 'tank.at'\nvalues = [5.0, 0.25, 7.0, 0.75, 9.0]")
        .text();
    lab.write("case.toml", text.replace("stop = 1", &format!("{more}\nstop = 1")));
    lab
}

fn a_crash_is_a_result_with_node_call_and_time() {
    for (fault, what) in [("crash", "SIGSEGV"), ("exit", "called exit"), ("abort", "SIGABRT")] {
        let lab = failing(fault, "");
        let said = lab.trackside(&SWEEP).expect(3).stdout;
        assert!(
            said.contains("3 of 5 variants passed") && said.contains("2 did not come to their end"),
            "{said}"
        );
        let table = results(&lab, "plan");
        assert_eq!(texts(&table, "verdict"), ["passed", "error", "passed", "error", "passed"]);
        assert_eq!(texts(&table, "error.node"), ["", "tank", "", "tank", ""]);
        assert_eq!(texts(&table, "error.call")[1], "fmi2DoStep");
        let times = numbers(&table, "error.time");
        assert!((times[1] - 0.3).abs() < 0.11 && (times[3] - 0.8).abs() < 0.11, "{times:?}");
        let error = &texts(&table, "error")[1];
        assert!(error.contains(what), "{error}");
        assert!(lab.read("plan/sweep.html").contains(what), "the page tells it");
    }
}

fn a_hang_is_a_result_with_node_call_and_time() {
    let lab = failing("sleep", &format!("limit = {:?}", limit(1.0)));
    lab.trackside(&SWEEP).expect(3);
    let table = results(&lab, "plan");
    assert_eq!(texts(&table, "verdict"), ["passed", "error", "passed", "error", "passed"]);
    assert_eq!(texts(&table, "error.node")[3], "tank");
    assert_eq!(texts(&table, "error.call")[3], "fmi2DoStep");
    assert!(texts(&table, "error")[3].contains("its time limit"), "{:?}", texts(&table, "error"));
}

fn an_fmu_that_does_not_reset_gets_new_instances() {
    let lab = Lab::new();
    // Its reset returns OK and does nothing.
    lab.write("adder.fmu", forgetful(&[]));
    let text = Scenario::new()
        .time(0.1, 1.0)
        .fmu("adder", "adder.fmu", "")
        .signal("s.u", "constant = 2.0")
        .connect("s.u", "adder.u")
        .section("[[sweep.vary]]\nname = 's.u'\nrange = { from = 1, to = 6, count = 6 }")
        .section("[sweep.collect]\nsum = 'last(adder.sum)'")
        .text();
    lab.write("case.toml", text);
    lab.trackside(&["sweep", "case.toml", "--out", "plan", "--jobs", "1"]).expect(0);
    let sums = numbers(&results(&lab, "plan"), "collect.sum");
    for (sum, expected) in sums.iter().zip([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]) {
        assert!((sum - expected).abs() < 1e-9, "{sums:?}");
    }
}

fn whole_fmus_signals_effects_faults_and_seeds_vary() {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab.write("other/drifting.fmu", drifting_relay(1.0));
    let text = ramp(
        "[[sweep.vary]]\nname = 'relay.path'\nvalues = ['relay.fmu', 'other/drifting.fmu']
        [[sweep.vary]]\nname = 'relay.x.noise.std'\nvalues = [0.0, 1.0]
        [[sweep.vary]]\nname = 'relay.x.fault.value'\nvalues = [2.0, 4.0]
        [[sweep.vary]]\nname = 'seed'\nvalues = [1, 2]
        [sweep.collect]\nlast = 'last(relay.x_out)'\nmean = 'mean(relay.x_out)'",
    );
    let text = text.replace("unit = 'km/h'\n\n", "unit = 'km/h'\nnoise = { std = 0.5 }\n\n");
    lab.write("case.toml", text + "\n[[fault]]\ninput = 'relay.x'\nvalue = 1.0\nfrom = 0.85\n");
    lab.trackside(&SWEEP).completes();
    let table = results(&lab, "plan");
    let (last, mean) = (numbers(&table, "collect.last"), numbers(&table, "collect.mean"));
    assert_eq!(texts(&table, "relay.path")[15], "fmus/drifting.fmu");
    assert_eq!((last[0], last[2]), (2.0, 4.0), "a fault");
    assert!(last[8] != last[0], "another FMU");
    assert_eq!(mean[0], mean[1], "without noise the seed does nothing");
    assert!(mean[4] != mean[5] && mean[4] != mean[0], "noise and seeds");
}

fn a_list_and_joint_draws_are_taken_line_by_line() {
    let lab = ramp_lab(
        "[sweep]\ndesign = 'list'\nlist = 'variants.csv'\n[sweep.collect]\nmax = 'max(relay.x_out)'",
    );
    lab.write("variants.csv", "# by hand\nramp.x [m/s], seed\n1.0, 4\n2.5, 9\n");
    lab.trackside(&SWEEP).expect(0);
    let table = results(&lab, "plan");
    assert_eq!(numbers(&table, "seed"), [4.0, 9.0]);
    let largest = numbers(&table, "collect.max");
    assert!((largest[0] - 3.6).abs() < 1e-9 && (largest[1] - 9.0).abs() < 1e-9, "{largest:?}");
    // Names are in the table, and name variants.
    lab.write("variants.csv", "name,ramp.x [m/s],seed\nslow one,1.0,4\nfast,2.5,9\n");
    let said = lab.trackside(&[SWEEP.as_slice(), &["--replace"]].concat()).expect(0).stdout;
    assert!(said.contains("#  name      verdict") && said.contains("0  slow one  passed"), "{said}");
    assert_eq!(texts(&results(&lab, "plan"), "name"), ["slow one", "fast"]);
    assert!(lab.read("plan/sweep.csv").starts_with("variant,name,seed,ramp.x [m/s],verdict"));
    let again = lab.trackside(&["replay", "plan/slow one", "--rerun", "off"]).expect(0);
    assert!(again.stdout.contains("the same results") && again.stderr.contains("variant 0 slow one"));
    assert!(lab.has("plan/variants/0_slow_one/report.html"));
    let page = lab.read("plan/sweep.html");
    assert!(page.contains("<a href=\"./variants/0_slow_one/report.html\">report</a>"), "it links the replay");
    // A value with a unit of its own is a number in that of its column.
    let hand = "[[sweep.variant]]\nname = 'stock'\n[[sweep.variant]]\nname = 'five'\nset.ramp.x = 5.0
        [[sweep.variant]]\nname = 'two metres per second'\nset.ramp.x = '2 m/s'
        [sweep.collect]\nmax = 'max(relay.x_out)'";
    lab.write("case.toml", ramp(hand));
    lab.trackside(&["sweep", "case.toml", "--out", "hand"]).expect(0);
    let table = results(&lab, "hand");
    let largest = numbers(&table, "collect.max");
    assert!((largest[0] - 3.6).abs() < 1e-9 && (largest[1] - 5.0).abs() < 1e-9, "{largest:?}");
    assert!((largest[2] - 7.2).abs() < 1e-9, "{largest:?}");
    let set = numbers(&table, "ramp.x");
    assert!(set[0] == 3.6 && set[1] == 5.0 && (set[2] - 7.2).abs() < 1e-12, "{set:?}");
    assert!(lab.read("hand/sweep.csv").contains("ramp.x [km/h]"));
    let page = lab.read("hand/sweep.html");
    assert!(page.contains("<span class=\" own\">3.6</span>") && !page.contains("95 %"), "{page}");
    let draws = "[[sweep.vary]]\nname = 'posterior'\ndraws = 'runs/report.json'";
    lab.write("case.toml", ramp(draws));
    lab.write("runs/report.json", "{\"files\": [\"posterior_draws.csv\"]}");
    lab.write("runs/posterior_draws.csv", "ramp.x [km/h],relay.n\n1.0,7\n2.0,8\n3.0,9\n");
    lab.trackside(&["sweep", "case.toml", "--out", "draws"]).expect(0);
    let table = results(&lab, "draws");
    assert_eq!(numbers(&table, "ramp.x"), [1.0, 2.0, 3.0]);
    assert_eq!(numbers(&table, "relay.n"), [7.0, 8.0, 9.0]);
}

/// A tenth of a second on the tires that are varied.
const ON_TIRES: &str = r#"
[time]
step = 0.01
stop = 0.1

[[fmu]]
name = "plant"
crate = "plant-fmu"
start = { start.v_x = 30.0 }
unconnected = "start"

[[signal]]
name = "driver.delta"
unit = "rad"
constant = 0.05

[[connect]]
from = "driver.delta"
to = "plant.delta"

[[sweep.vary]]
name = "tires"
draws = "identified/report.json"

[sweep.collect]
a_y = "max(plant.a_y)"
"#;

fn the_draws_of_an_identification_are_swept_over() {
    let lab = Lab::new();
    // The plugin is found from the workspace.
    let start = |words: &[&str]| {
        let output = trackside(Path::new(ROOT)).args(words).output();
        Ended::of(output.expect("it starts")).expect(0)
    };
    let path = |name: &str| lab.path(name).display().to_string();
    let driving = include_str!("../../scenarios/tires_from_driving.toml");
    let driving = &driving[..driving.find("[[check]]").expect("it has checks")];
    let driving = driving.replace("stop = 40.0", "stop = 10.0");
    // A drive this short may leave a doubt; the draws are there in either case.
    lab.write(
        "driving.toml",
        driving.replace("crate = \"identify\"", "crate = \"identify\"\nexpect = \"any\""),
    );
    lab.write("cars/demo/car.toml", include_str!("../../scenarios/cars/demo/car.toml"));
    let identify = || {
        start(&["run", &path("driving.toml"), "--out", &path("identified")]);
        lab.read("identified/tires_draws.csv")
    };
    let draws = identify();
    assert!(lab.report("identified")["files"].to_string().contains("\"tires_draws.csv\""));
    assert_eq!(identify(), draws, "the same bits again");

    lab.write("case.toml", ON_TIRES);
    start(&["sweep", &path("case.toml"), "--out", &path("plan")]);
    let table = results(&lab, "plan");
    let mut lines = draws.lines();
    let heads: Vec<_> = lines.next().expect("a first line").split(',').collect();
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|it| it.parse().expect("a number")).collect()).collect();
    assert_eq!(rows.len(), 1000);
    let starts: toml::Table = toml::from_str(&lab.read("identified/tires.toml")).expect("TOML");
    assert!(heads.len() >= 8 && heads.iter().all(|it| starts.contains_key(*it)), "{heads:?}");
    assert_eq!(heads.len(), starts.len());
    for (place, head) in heads.into_iter().enumerate() {
        let drawn: Vec<f64> = rows.iter().map(|row| row[place]).collect();
        assert_eq!(numbers(&table, head), drawn, "{head}");
    }
    let a_y = numbers(&table, "collect.a_y");
    assert!(a_y.iter().all(|it| it.is_finite()) && a_y.iter().any(|it| *it != a_y[0]), "{a_y:?}");
}

fn a_replay_gives_the_same_bits_and_chosen_variants_are_recorded() {
    let lab = noisy(30);
    let text = lab.read("case.toml") + "\n[sweep.record]\nworst = 1\nfailed = 1\nevery = 20\n";
    lab.write("case.toml", text);
    lab.trackside(&SWEEP);
    let summary: serde_json::Value = serde_json::from_str(&lab.read("plan/sweep.json")).expect("JSON");
    let recorded = summary["recorded"].as_array().expect("a list");
    assert!((3..=4).contains(&recorded.len()), "{recorded:?}");
    for variant in recorded {
        assert!(lab.has(&format!("plan/variants/{variant}/run.mcap")), "{variant}");
    }
    let verdicts = texts(&results(&lab, "plan"), "verdict");
    let sound = verdicts.iter().rposition(|it| it != "error").expect("one that ends");
    let again = lab.trackside(&["replay", &format!("plan/{sound}"), "--rerun", "off", "--csv"]);
    assert!(again.stdout.contains("the same results as in the sweep, to the last bit"), "{}", again.stderr);
    assert!(lab.has(&format!("plan/variants/{sound}/run.csv")));
    lab.trackside(&["replay", "plan/30"]).expect(2).says(&["variants 0 to 29, found 30"]);
    lab.trackside(&["replay", "plan"]).expect(2).says(&["the number of a variant", "lane_change/17"]);
}

fn a_search_finds_the_limit_of_a_check_and_the_least_of_a_value() {
    let words = "[[sweep.vary]]\nname = 'ramp.x'\nuniform = [0.0, 100.0]\n[sweep.search]\ntolerance = 1e-4\n";
    let lab = ramp_lab(&format!("{words}limit = 'largest'"));
    let said = lab.trackside(&SWEEP).expect(0).stdout;
    assert!(said.contains("passes up to ramp.x = 29.99") && said.contains("converged"), "{said}");
    // The same again, without a run.
    let again = lab.trackside(&SWEEP).expect(0).stdout;
    assert_eq!(again, said);
    let low = ramp_lab(&format!("{words}limit = 'largest'").replace("100.0", "20.0"));
    low.trackside(&SWEEP).expect(1).stdout.contains("no limit").then_some(()).expect("no limit");
    let least = "minimise = 'off'\n[sweep.collect]\noff = 'max(abs(relay.x_out - 40))'";
    let lab = ramp_lab(&format!("{words}{least}"));
    let said = lab.trackside(&SWEEP).expect(0).stdout;
    let found = said.split("ramp.x = ").nth(1).and_then(|rest| rest.split(' ').next());
    let found: f64 = found.and_then(|text| text.parse().ok()).expect("a value");
    assert!((found - 40.0).abs() < 0.1, "{said}");
}

fn settings_of_the_command_line_hold_in_all_variants() {
    let words =
        "[[sweep.vary]]\nname = 'ramp.x'\nvalues = [1.0, 2.0]\n[[sweep.vary]]\nname = 'relay.n'\nvalues = [1, 2, 3]
        [sweep.collect]\nmax = 'max(relay.x_out)'";
    let lab = ramp_lab(words);
    let run = [SWEEP.as_slice(), &["--set", "ramp.x=7"]].concat();
    let said = lab.trackside(&run).expect(0);
    assert!(said.stderr.contains("--set ramp.x holds in all variants"), "{}", said.stderr);
    let table = results(&lab, "plan");
    assert_eq!(numbers(&table, "collect.max"), [7.0, 7.0, 7.0]);
    assert!(table.column("ramp.x").is_none());
    // Another sweep does not replace it without a word.
    lab.trackside(&SWEEP).expect(2).says(&["has results of another sweep", "--replace"]);
    assert_eq!(results(&lab, "plan"), table, "it is still there");
    lab.trackside(&[SWEEP.as_slice(), &["--replace"]].concat()).expect(0);
    assert_eq!(results(&lab, "plan").row_count(), 6);
}
