//! Messages about `[coupling]`, loops and extrapolation.

use super::fmus;
use super::lab::Lab;

/// Two masses on springs, one on the other.
fn two_masses(coupling: &str, last: &str) -> String {
    format!(
        r#"[time]
step = 0.1
stop = 1.0

[coupling]
{coupling}

[[fmu]]
name = "low"
path = "sprung_mass.fmu"
start = {{ k = 40.0, d = 0.3, x_below = 0.0, v_below = 0.0 }}

[[fmu]]
name = "high"
path = "sprung_mass.fmu"
start = {{ k = 25.0, d = 0.3, F = 0.0 }}

[[connect]]
from = "low.x"
to = "high.x_below"

[[connect]]
from = "low.v"
to = "high.v_below"

[[connect]]
from = "high.F_below"
to = "low.F"
{last}
"#
    )
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.fmu("sprung_mass.fmu", &fmus::sprung_mass());
    lab
}

#[test]
fn keys_of_a_coupling_that_mean_nothing_are_mistakes() {
    let lab = lab();
    let delayed = "at = \"start\"";
    assert!(lab.resolve(&two_masses("algorithm = \"gauss_seidel\"", delayed)).is_ok());
    for (keys, parts) in [
        ("tolerance = 2.0", &["between 0 and 1, found 2"][..]),
        ("error = \"richardson\"", &["nothing to decide", "add `tolerance`"]),
        ("tolerance = 0.1\nerror = \"energy\"", &["carry power", "[[coupling.bond]]"]),
        ("iteration = { tolerance = 0.0 }", &["relative tolerance between 0 and 1"]),
        ("iteration = { passes = 0 }", &["at least 1 for `passes`"]),
        ("iteration = { method = \"newtons\" }", &["newtons", "newton"]),
        ("[[coupling.bond]]\neffort = \"low.F\"\nflow = \"high.v_below\"", &["error = \"energy\""]),
        (
            "tolerance = 0.1\nerror = \"energy\"\n[[coupling.bond]]\neffort = \"low.G\"\nflow = \"low.F\"",
            &["low.G", "low.F"],
        ),
        (
            "tolerance = 0.1\nerror = \"energy\"\n[[coupling.bond]]\neffort = \"high.x_below\"\nflow = \"high.v_below\"",
            &["expected a flow that comes from the node"],
        ),
    ] {
        let coupling = format!("algorithm = \"gauss_seidel\"\n{keys}");
        lab.message(&two_masses(&coupling, delayed)).says(parts);
    }
    let extrapolated = "extrapolate = \"linear\"\nhold = 0.5";
    lab.message(&two_masses("algorithm = \"iterate\"", extrapolated))
        .says(&["`hold` makes samples", "leave `extrapolate` out"]);
}

#[test]
fn a_loop_that_nothing_breaks_says_what_works() {
    lab().message(&two_masses("algorithm = \"gauss_seidel\"", "")).says(&[
        "form a loop",
        "at = \"start\"",
        "algorithm = \"iterate\"",
    ]);
}
