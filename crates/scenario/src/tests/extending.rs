//! Messages about a scenario that extends another one: each points at the file with the mistake.

use super::fmus;
use super::lab::Lab;

/// A scenario in a folder of its own, whose paths are relative to it.
const BASE: &str = include_str!("files/base.toml");

/// A scenario that extends it.
const CHANGED: &str = include_str!("files/changed.toml");

/// A scenario that changes an ambiguous check.
const TWICE: &str = "extends = \"twice.toml\"\n[[check]]\nname = \"ever\"\nthat = \"1 < 2\"\n";

/// A mistake in a text: the text, what is replaced and by what, the file and line of the error, and a part of the message.
type Case = (&'static str, &'static str, &'static str, &'static str, &'static str);

#[rustfmt::skip]
const CASES: &[Case] = &[
    // The extended file, and the keys for extending.
    (CHANGED, "\"base/base.toml\"", "\"none.toml\"", "case.toml:1:", "cannot read the scenario none.toml"),
    (CHANGED, "\"base/base.toml\"", "3", "case.toml:1:", "expected a text, found a whole number"),
    (CHANGED, "\"base/base.toml\"", "\"case.toml\"", "case.toml:1:", "extends itself: case.toml -> case.toml"),
    (CHANGED, "\"base/base.toml\"", "\"self.toml\"", "self.toml:1:", "extends itself: case.toml -> self.toml -> case.toml"),
    (CHANGED, "\"base/base.toml\"", "\"broken.toml\"", "broken.toml:1:", "invalid"),
    (CHANGED, "\"base/base.toml\"", "\"link0.toml\"", "link98.toml:1:", "a chain of at most 100 scenarios"),
    (BASE, "title =", "extend =", "case.toml:1:", "did you mean `extends`?"),
    (CHANGED, "\"never*\"", "\"newer\"", "case.toml:5:", "unknown inherited [[check]] `newer`"),
    (CHANGED, "check = [\"n", "chek = [\"n", "case.toml:5:", "the extended scenario has no [[chek]]"),
    (CHANGED, "[\"never*\"]", "\"never\"", "case.toml:5:", "expected a list, found a text"),
    (BASE, "\n[time]", "\n[without]\ncheck = [\"never\"]\n[time]", "case.toml:5:", "extends no other"),
    (TWICE, "ever", "never", "case.toml:3:", "2 [[check]] of this name"),
    // Words of the extending file.
    (CHANGED, "stop =", "stpo =", "case.toml:8:", "did you mean `stop`?"),
    (CHANGED, "tire_f.D", "tire_f.G", "case.toml:12:", "unknown variable `tire_f.G`"),
    (CHANGED, "\"plant.delta\"", "\"plant.delt\"", "case.toml:19:", "the key `from` is missing"),
    (CHANGED, "name = \"log\"", "nam = \"log\"", "case.toml:28:", "unknown key `nam`"),
    (CHANGED, "abs(plant.v_x - driver.v)", "abs(plant.v_z)", "case.toml:25:", "did you mean `plant.v_x`?"),
    (CHANGED, "unit = \"km/h\"\nramp", "unit = \"fortnight\"\nramp", "case.toml:16:", "fortnight"),
];

/// Mistakes in the extended scenario.
#[rustfmt::skip]
const BASE_CASES: &[(&str, &str, &str, &str)] = &[
    ("step = 0.01", "stepp = 0.01", "base/base.toml:5:", "did you mean `step`?"),
    ("step = 0.01", "step = 0.0", "base/base.toml:5:", "must be positive"),
    ("step = 0.01\n", "", "case.toml:7:", "the key `step` is missing"),
    ("plant.fmu", "plan.fmu", "base/base.toml:10:", "cannot read base/plan.fmu"),
    ("body.m", "body.mm", "base/base.toml:11:", "did you mean `body.m`?"),
    ("log.csv", "lag.csv", "base/base.toml:25:", "base/lag.csv"),
    ("driver.delta\"\nto", "driver.dleta\"\nto", "base/base.toml:30:", "unknown output `driver.dleta`"),
    ("\"log.*\"", "\"lag.*\"", "base/base.toml:48:", "`lag.*`"),
    ("plant.psi", "plant.pis", "base/base.toml:53:", "did you mean `plant.psi`?"),
];

fn lab() -> Lab {
    let lab = Lab::new();
    lab.fmu("base/plant.fmu", &fmus::plant());
    lab.write("base/log.csv", "t,v\n0,20\n1,20\n");
    lab.write("base/base.toml", BASE);
    lab.write("self.toml", "extends = \"case.toml\"\n");
    lab.write("broken.toml", "title = \"Broken");
    for link in 0..110 {
        lab.write(&format!("link{link}.toml"), format!("extends = \"link{}.toml\"\n", link + 1));
    }
    lab.write("twice.toml", BASE.replace("path = \"", "path = \"base/").replace("never ever", "never"));
    lab
}

#[test]
fn a_mistake_in_the_extending_scenario_is_told_there() {
    let lab = lab();
    assert!(lab.resolve(CHANGED).is_ok());
    for (good, old, new, line, part) in CASES {
        let text = good.replacen(old, new, 1);
        assert_ne!(text, *good, "{old}");
        lab.message(&text).says(&[line, part]);
    }
    // All of them in one go, with the form of the file.
    let text = CHANGED.replacen("\"never*\"", "\"newer\", \"nada\"", 1).replacen("stop =", "stpo =", 1);
    assert_eq!(lab.message(&text).says(&["case.toml:5:"]).count, 3);
}

#[test]
fn a_mistake_in_the_extended_scenario_is_told_there() {
    let lab = lab();
    for (old, new, line, part) in BASE_CASES {
        let text = BASE.replacen(old, new, 1);
        assert_ne!(text, BASE, "{old}");
        lab.write("base/base.toml", text);
        lab.message(CHANGED).says(&[line, part]);
    }
}
