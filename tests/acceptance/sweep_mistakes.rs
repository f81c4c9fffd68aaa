//! Mistakes in sweeps, and the messages about them.

use super::fmus::relay;
use super::harness::Lab;
use super::sweeps::ramp;

tests! {
    wrong_words_are_told_at_their_places: Compiler,
    wrong_files_are_told_with_their_lines: Compiler,
    a_plan_that_was_changed_is_refused: Compiler,
}

fn lab(sweep: &str) -> Lab {
    let lab = Lab::new();
    lab.write("relay.fmu", relay());
    lab.write("case.toml", ramp(sweep));
    lab
}

const SWEEP: [&str; 4] = ["sweep", "case.toml", "--out", "plan"];
const VARY: &str = "[[sweep.vary]]\nname = 'ramp.x'\n";

fn wrong_words_are_told_at_their_places() {
    let sample = "[sweep]\ndesign = 'sobol'\nvariants = 4\n";
    let values = "values = [1.0, 2.0]";
    for (text, says) in [
        (String::new(), ["the scenario has no variants", "add [sweep]"]),
        ("[sweep]\nseed = 2".to_owned(), ["nothing is varied", "[[sweep.vary]]"]),
        (format!("{VARY}{values}").replace("ramp.x", "ramp.y"), ["ramp.y", "case.toml:"]),
        (format!("{VARY}{values}").replace("ramp.x", "relay.why"), ["relay.why", "case.toml:"]),
        (VARY.to_owned(), ["needs one of `values`", "`draws`"]),
        (format!("{VARY}{values}\nuniform = [0.0, 1.0]"), ["needs one of", "ramp.x"]),
        (format!("{VARY}uniform = [0.0, 1.0]"), ["a grid needs `values`", "latin_hypercube"]),
        (format!("{sample}{VARY}uniform = [1.0, 0.0]"), ["expected [low, high]", "ramp.x"]),
        (
            format!("{sample}{VARY}normal = {{ mean = 0.0, std = -1.0 }}"),
            ["positive standard deviation", "case.toml:"],
        ),
        (
            format!("[sweep]\ndesign = 'sobol'\n{VARY}{values}"),
            ["a sample needs a number", "variants = 1000"],
        ),
        (
            format!("[sweep]\nvariants = 4\n{VARY}{values}"),
            ["as many variants as its values make", "leave `variants` out"],
        ),
        (format!("{VARY}{values}\n{VARY}{values}"), ["`ramp.x` is varied twice", "here again"]),
        (format!("{VARY}values = []"), ["has no values", "ramp.x"]),
        (format!("{VARY}values = [[1.0]]"), ["expected a number, a text", "found array"]),
        (format!("{VARY}values = ['fast']"), ["ramp.x", "fast"]),
        (
            "[[sweep.vary]]\nname = 'seed'\nvalues = [-1]".to_owned(),
            ["whole numbers from 0 on", "seed"],
        ),
        (
            format!("{VARY}{values}\n[sweep.collect]\na = 'relay.x_out'"),
            ["one value of the whole run", "max(...)"],
        ),
        (
            format!("{VARY}{values}\n[sweep.collect]\na = 'max(relay.x_oud)'"),
            ["relay.x_oud", "relay.x_out"],
        ),
        (
            format!("{VARY}{values}\n[sweep]\npass_share = 2.0"),
            ["a share from 0 to 1", "case.toml:"],
        ),
        (format!("{VARY}{values}\n[sweep]\ndesing = 'grid'"), ["desing", "design"]),
        (
            format!("{VARY}uniform = [0.0, 1.0]\n[sweep.search]\nminimise = 'a'"),
            ["has no value called `a`", "case.toml:"],
        ),
        (
            format!(
                "{VARY}uniform = [0.0, 1.0]\n[sweep.search]\nlimit = 'largest'\ncheck = 'hight'"
            ),
            ["no check called `hight`", "case.toml:"],
        ),
    ] {
        let lab = lab(&text);
        lab.trackside(&SWEEP).expect(2).says(&says);
        assert!(!lab.has("plan"), "nothing is left: {text}");
    }
}

fn wrong_files_are_told_with_their_lines() {
    let list = "[sweep]\ndesign = 'list'\nlist = 'variants.csv'";
    for (text, says) in [
        ("ramp.x\n1.0\n\"\"\n", "line 3: `ramp.x` has no value"),
        ("ramp.x\n", "no line with values"),
        ("speed\n1.0\n", "expected the names of what the columns set"),
        ("ramp.x,ramp.x\n1.0,2.0\n", "two columns set `ramp.x`"),
        ("ramp.x,seed\n1.0,-2\n", "line 2: expected a seed"),
        ("ramp.x,seed\n1.0\n", "found record with 1 fields"),
    ] {
        let lab = lab(list);
        lab.write("variants.csv", text);
        lab.trackside(&SWEEP).expect(2).says(&[says, "variants.csv"]);
    }
    lab(list).trackside(&SWEEP).expect(2).says(&["variants.csv", "cannot read"]);
    let draws = lab("[[sweep.vary]]\nname = 'tires'\ndraws = 'report.json'");
    draws.write("report.json", "{\"files\": [\"wheels_draws.csv\", \"car_draws.csv\"]}");
    draws.trackside(&SWEEP).expect(2).says(&["tires_draws.csv", "draws of `wheels`, `car`"]);
    draws.write("report.json", "{\"files\": [\"tires.toml\"]}");
    draws.trackside(&SWEEP).expect(2).says(&["tires_draws.csv", "left draws from a posterior"]);
}

fn a_plan_that_was_changed_is_refused() {
    let lab = lab(&format!("{VARY}values = [1.0, 2.0]"));
    lab.trackside(&["sweep", "plan", "case.toml", "--out", "plan"]).expect(0);
    lab.trackside(&["sweep", "run", "plan", "--chunk", "1"]).expect(2).says(&["expected 0 to 0"]);
    lab.trackside(&["sweep", "run", "plan", "--chunk", "0"]).expect(0);
    let text = lab.read("plan/scenario/case.toml");
    lab.write("plan/scenario/case.toml", text + "\n");
    lab.trackside(&["sweep", "run", "plan", "--chunk", "0"]).expect(2).says(&["were changed"]);
    lab.trackside(&["sweep", "run", "nowhere", "--chunk", "0"])
        .expect(2)
        .says(&["no plan of a sweep"]);
    lab.write("other/file.txt", "mine");
    lab.trackside(&["sweep", "case.toml", "--out", "other"])
        .expect(2)
        .says(&["it holds other files"]);
    assert_eq!(lab.read("other/file.txt"), "mine");
}
