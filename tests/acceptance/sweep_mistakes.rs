//! Mistakes in sweeps, and the messages about them.

use super::fmus::relay;
use super::harness::Lab;
use super::sweeps::ramp;

tests! {
    wrong_words_are_told_at_their_places: Compiler,
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
    let values = "values = [1.0, 2.0]";
    for (text, says) in [
        (String::new(), ["the scenario has no variants", "add [sweep]"]),
        (format!("{VARY}{values}").replace("ramp.x", "ramp.y"), ["ramp.y", "case.toml:"]),
        (format!("{VARY}{values}").replace("ramp.x", "relay.why"), ["relay.why", "case.toml:"]),
        (VARY.to_owned(), ["needs one of `values`", "`draws`"]),
        (format!("{VARY}values = ['fast']"), ["ramp.x", "fast"]),
    ] {
        let lab = lab(&text);
        lab.trackside(&SWEEP).expect(2).says(&says);
        assert!(!lab.has("plan"), "nothing is left: {text}");
    }
}

fn a_plan_that_was_changed_is_refused() {
    let lab = lab(&format!("{VARY}values = [1.0, 2.0]"));
    lab.trackside(&["sweep", "plan", "case.toml", "--out", "plan"]).expect(0);
    lab.trackside(&["sweep", "run", "plan", "--chunk", "1"]).expect(2).says(&["expected 0 to 0"]);
    lab.trackside(&["sweep", "run", "plan", "--chunk", "0"]).expect(0);
    let plan = lab.read("plan/plan.json");
    for (word, other, says) in [
        ("\"chunk\": 50", "\"chunk\": 0", "expected a `chunk` of 1 variant or more"),
        ("\"pass_share\": 1.0", "\"pass_share\": 0.5", "were changed"),
    ] {
        assert!(plan.contains(word), "{plan}");
        lab.write("plan/plan.json", plan.replace(word, other));
        lab.trackside(&["sweep", "run", "plan", "--chunk", "0"]).expect(2).says(&[says]);
        lab.trackside(&["sweep", "gather", "plan"]).expect(2).says(&[says]);
    }
    lab.write("plan/plan.json", &plan);
    let text = lab.read("plan/scenario/case.toml");
    lab.write("plan/scenario/case.toml", text + "\n");
    lab.trackside(&["sweep", "run", "plan", "--chunk", "0"]).expect(2).says(&["were changed"]);
    lab.trackside(&["sweep", "run", "nowhere", "--chunk", "0"]).expect(2).says(&["no plan of a sweep"]);
    lab.write("other/file.txt", "mine");
    lab.trackside(&["sweep", "case.toml", "--out", "other"]).expect(2).says(&["it holds other files"]);
    assert_eq!(lab.read("other/file.txt"), "mine");
}
