//! What tries damaged scenarios: reads them, and makes plans of them.

use std::path::Path;

use damage::FuzzTarget;
use scenario::plan::RunPlan;
use scenario::resolve::Overrides;
use scenario::{BuildArtifacts, Scenario};

use super::everything;

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "scenarios",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../scenario/tests/corpus/scenarios"),
    sound,
    words: &[
        "[[fmu]]",
        "[[signal]]",
        "[[signal.part]]",
        "[[table]]",
        "[[connect]]",
        "[[fault]]",
        "[[check]]",
        "[[baseline]]",
        "[[analysis]]",
        "[[validation]]",
        "[[system]]",
        "[[connector]]",
        "[view]",
        "[view.pose]",
        "[[view.arrow]]",
        "[record]",
        "[coupling]",
        "[without]",
        "extends",
        "algorithm = \"jacobi\"",
        "at = \"start\"",
        "at = \"end\"",
        "relay.x",
        "relay.n",
        "relay.on",
        "relay.text",
        "relay.mode",
        "relay.gear",
        "relay.x_out",
        "relay.mode_out",
        "s.sine",
        "s.step",
        "log.v",
        "c.speed",
        "nowhere.x",
        "convert = \"boolean_to_integer\"",
        "convert = \"integer_to_real\"",
        "map = [[0.0, 1.0]]",
        "unconnected = \"start\"",
        "kind = \"input\"",
        "gaps = \"drop\"",
        "separator = \";\"",
        "decimal = \",\"",
        "unit_row = true",
        "unit = \"km/h\"",
        "unit = \"degC\"",
        "config = {}",
        "plugin",
        "crate = \"plant-fmu\"",
        "log.csv",
        "golden.csv",
        "relay.fmu",
        "x.toml",
        "..",
        "*",
        "=",
        "{",
        "}",
        "[",
        "]",
        "\"",
        "'''",
        "\"\"\"",
        "#",
        "\n",
        "time",
        "\u{1f980}",
    ],
    own: None,
    attempt,
};

/// The scenario with all keys, and its parts, of which more is left when something is damaged.
fn sound() -> Vec<Vec<u8>> {
    let text = everything::TEXT;
    let time = "[time]\nstep = 0.25\nstop = 1.0\n\n";
    let parts: Vec<&str> = text.split("\n\n").collect();
    let signals: Vec<_> = parts.iter().copied().filter(|part| part.starts_with("[[signal")).collect();
    let view = text.find("[view]").map_or("", |at| &text[at..]);
    let check = "\n\n[[check]]\nname = \"small\"\nthat = \"abs(s.sine) < 3 and s.step > 0.5 m/s\"\n";
    vec![
        text.as_bytes().to_vec(),
        [time, &signals.join("\n\n"), check].concat().into_bytes(),
        [time, &signals.join("\n\n"), "\n\n", view].concat().into_bytes(),
        "extends = \"everything.toml\"\nwithout = { check = [\"it*\"], fault = [\"relay.x\"] }\n\n[time]\nstop = 2.0\n"
            .as_bytes()
            .to_vec(),
    ]
}

/// Makes a plan of the scenario, and asks its signals for values.
fn attempt(bytes: &[u8], folder: &Path) -> bool {
    if !folder.join("relay.fmu").exists() {
        everything::write(folder).expect("it can be written");
        std::fs::write(folder.join("everything.toml"), everything::TEXT).expect("it can be written");
    }
    let path = folder.join("x.toml");
    std::fs::write(&path, bytes).expect("it can be written");
    let scenario = match Scenario::read(&path) {
        Ok(scenario) => scenario,
        Err(error) => {
            assert!(!format!("{error:?}").is_empty());
            return false;
        }
    };
    let _ = scenario.flattened_values();
    let out = folder.join("out");
    match RunPlan::resolve(&scenario, &BuildArtifacts::default(), &Overrides::default(), out) {
        Ok(RunPlan { system, .. }) => {
            assert!(system.clock.step > 0.0 && system.clock.steps > 0 || system.nodes.is_empty());
            true
        }
        Err(error) => {
            assert!(!format!("{error:?}").is_empty());
            false
        }
    }
}
