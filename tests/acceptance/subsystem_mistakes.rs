//! Leaves inputs of systems that are parts of scenarios without a connection.

use super::subsystems::{RIG, TIME, column, columns, lab};

tests! {
    inputs_of_a_system_have_values_without_a_connection: Compiler,
}

fn inputs_of_a_system_have_values_without_a_connection() {
    let lab = lab();
    for (more, expected) in [
        (
            "[[fmu]]\nname = \"rig_a\"\nstart = { x = 3.0 }\n[[fmu]]\nname = \"rig_b\"\nstart = { x = 4.0 }\n",
            "3",
        ),
        ("[[connector]]\nname = \"rig.u\"\nunconnected = \"start\"\n", "0"),
        ("[[connect]]\nfrom = \"rig.y\"\nto = \"rig.u\"\nat = \"start\"\n", "100"),
    ] {
        lab.write("case.toml", [RIG, TIME, more].concat());
        if expected == "100" {
            lab.trackside(&["run", "case.toml", "--rerun", "off"]).expect(0);
            continue;
        }
        assert_eq!(column(&columns(&lab, "case.toml"), "rig_a.x_out")[8], expected, "{more}");
    }
}
