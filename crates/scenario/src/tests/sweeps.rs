//! Messages about `[sweep]`: its axes, designs, searches, and files of samples.

use super::fmus;
use super::lab::Lab;

/// A relay that gets a constant speed, with this sweep.
fn ramp(sweep: &str) -> String {
    format!(
        r#"[time]
step = 0.1
stop = 1.0

[[fmu]]
name = "relay"
path = "relay.fmu"
unconnected = "start"

[[signal]]
name = "ramp.x"
unit = 'km/h'
constant = 3.6

[[connect]]
from = "ramp.x"
to = "relay.x"
unit = 'km/h'

[[check]]
name = "low"
that = "max(relay.x_out) < 30"

{sweep}
"#
    )
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.fmu("relay.fmu", fmus::RELAY);
    lab
}

const VARY: &str = "[[sweep.vary]]\nname = 'ramp.x'\n";

#[test]
fn wrong_keys_are_told_at_their_places() {
    let lab = lab();
    let sample = "[sweep]\ndesign = 'sobol'\nvariants = 4\n";
    let values = "values = [1.0, 2.0]";
    for (text, parts) in [
        ("[sweep]\nseed = 2".to_owned(), ["nothing is varied", "[[sweep.vary]]"]),
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
        (
            format!("{VARY}{values}\n[[sweep.variant]]\nname = 'a'\nset = {{ 'ramp.x' = 1.0 }}"),
            ["variants by hand say all their values", "case.toml:"],
        ),
        (
            "[[sweep.variant]]\nname = 'a'\nset.ramp.x = 1.0\n[[sweep.variant]]\nname = 'a'".to_owned(),
            ["two variants are called `a`", "case.toml:"],
        ),
        ("[[sweep.variant]]\nname = 'a'".to_owned(), ["no variant sets anything", "give them `set`"]),
        (
            "[[sweep.variant]]\nname = 'a'\nset = { speed = 1.0 }".to_owned(),
            ["`speed`: expected node.variable", "case.toml:"],
        ),
        (format!("{VARY}values = []"), ["has no values", "ramp.x"]),
        (format!("{VARY}values = [[1.0]]"), ["expected a number, a text", "found array"]),
        ("[[sweep.vary]]\nname = 'seed'\nvalues = [-1]".to_owned(), ["whole numbers from 0 on", "seed"]),
        (
            format!("{VARY}{values}\n[sweep.collect]\na = 'relay.x_out'"),
            ["one value of the whole run", "max(...)"],
        ),
        (format!("{VARY}{values}\n[sweep.collect]\na = 'max(relay.x_oud)'"), ["relay.x_oud", "relay.x_out"]),
        (format!("{VARY}{values}\n[sweep]\npass_share = 2.0"), ["a share from 0 to 1", "case.toml:"]),
        (format!("{VARY}{values}\n[sweep]\ndesing = 'grid'"), ["desing", "design"]),
        (
            format!("{VARY}uniform = [0.0, 1.0]\n[sweep.search]\nminimise = 'a'"),
            ["has no value called `a`", "case.toml:"],
        ),
        (
            format!("{VARY}uniform = [0.0, 1.0]\n[sweep.search]\nlimit = 'largest'\ncheck = 'hight'"),
            ["no check called `hight`", "case.toml:"],
        ),
    ] {
        lab.sweep_message(&ramp(&text)).says(&parts);
    }
}

#[test]
fn wrong_files_are_told_with_their_lines() {
    let lab = lab();
    let list = ramp("[sweep]\ndesign = 'list'\nlist = 'variants.csv'");
    lab.sweep_message(&list).says(&["variants.csv", "cannot read"]);
    for (text, part) in [
        ("ramp.x\n1.0\n\"\"\n", "line 3: `ramp.x` has no value"),
        ("ramp.x\n", "no line with values"),
        ("speed\n1.0\n", "expected the names of what the columns set"),
        ("ramp.x,ramp.x\n1.0,2.0\n", "two columns set `ramp.x`"),
        ("name,ramp.x\na,1.0\na,2.0\n", "line 3: two variants are called `a`"),
        ("ramp.x,seed\n1.0,-2\n", "line 2: expected a seed"),
        ("ramp.x,seed\n1.0\n", "found record with 1 fields"),
    ] {
        lab.write("variants.csv", text);
        lab.sweep_message(&list).says(&[part, "variants.csv"]);
    }
    let draws = ramp("[[sweep.vary]]\nname = 'tires'\ndraws = 'report.json'");
    lab.write("report.json", "{\"files\": [\"wheels_draws.csv\", \"car_draws.csv\"]}");
    lab.sweep_message(&draws).says(&["tires_draws.csv", "draws of `wheels`, `car`"]);
    lab.write("report.json", "{\"files\": [\"tires.toml\"]}");
    lab.sweep_message(&draws).says(&["tires_draws.csv", "left draws from a posterior"]);
}
