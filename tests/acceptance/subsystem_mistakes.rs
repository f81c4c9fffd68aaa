//! Makes mistakes with systems that are parts of scenarios, and reads the messages.

use super::fmus::{archive, relay};
use super::subsystems::{DRIVE, RIG, TIME, column, columns, connect, lab, structure};

tests! {
    inputs_of_a_system_are_not_forgotten: Compiler,
    mistakes_about_systems_point_at_their_words: Compiler,
    mistakes_about_connectors_point_at_their_words: Compiler,
    names_of_systems_do_not_meet: Compiler,
    mistakes_in_the_archive_name_its_file_and_line: Compiler,
}

fn node(name: &str) -> String {
    format!("[[fmu]]\nname = \"{name}\"\npath = \"relay.fmu\"\nunconnected = \"start\"\n")
}

fn inputs_of_a_system_are_not_forgotten() {
    let lab = lab();
    lab.write("case.toml", format!("[[system]]\nname = \"test\"\npath = \"rig.ssp\"\n{TIME}"));
    lab.trackside(&["run", "case.toml"]).expect(2).says(&[
        "case.toml:2:8",
        "nothing is connected to `u` of `test`",
        "to = \"test.u\"",
        "unconnected = \"start\"",
    ]);
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

fn mistakes_about_systems_point_at_their_words() {
    let lab = lab();
    lab.write("other.toml", "title = \"no system\"\n");
    lab.write("rig/SystemStructure.ssd", structure());
    lab.write("rig/winter.ssd", structure());
    lab.write("rig/relay.fmu", relay());
    let rig = format!("{RIG}unconnected = \"start\"\n");
    let signal = |name: &str| format!("[[signal]]\nname = \"{name}\"\nconstant = 1\n");
    for (text, told) in [
        ("[[system]]\npath = \"absent.ssp\"\n".to_owned(), &["case.toml:2:8", "absent.ssp"][..]),
        (
            "[[system]]\npath = \"other.toml\"\n".to_owned(),
            &["case.toml:2:8", "expected a system of SSP, found other.toml", "`extends`"],
        ),
        (
            "[[system]]\npath = \"rig\"\nvariant = \"wintr\"\n".to_owned(),
            &["case.toml:3:11", "did you mean `winter`"],
        ),
        (
            "[[system]]\nname = \"a.b\"\npath = \"rig.ssp\"\n".to_owned(),
            &["case.toml:2:8", "expected a name without `.`"],
        ),
        ("[[system]]\nname = \"rig\"\n".to_owned(), &["case.toml:1", "path"]),
        (format!("{RIG}varient = \"x\"\n"), &["case.toml:3:1", "varient", "variant"]),
        (format!("{rig}{RIG}"), &["case.toml:5:8", "two systems called `rig`", "name = \"rig_2\""]),
        (
            format!("{rig}{}", node("rig")),
            &["case.toml:2:8", "`rig` is a node of the scenario already"],
        ),
        (
            format!("{rig}{}", signal("rig_a.x")),
            &["case.toml:5:8", "`rig_a` is a node of the system `rig` already"],
        ),
    ] {
        lab.write("case.toml", text.clone() + TIME);
        lab.trackside(&["run", "case.toml"]).expect(2).says(told);
    }
}

fn mistakes_in_the_archive_name_its_file_and_line() {
    let lab = lab();
    for (from, to, told) in [
        ("relay.fmu", "absent.fmu", &["SystemStructure.ssd:6:", "absent.fmu"][..]),
        ("endConnector=\"x\"><", "endConnector=\"z\"><", &["SystemStructure.ssd:10:", "`z`"]),
        ("factor=\"10\"", "factor=\"ten\"", &["SystemStructure.ssd:12:", "ten"]),
        (
            "name=\"y\" kind=\"output\"><ssc:Real unit=\"mm\"/>",
            "name=\"y\" kind=\"output\"><ssc:Real unit=\"s\"/>",
            &["SystemStructure.ssd:12:", "[m]", "[s]"],
        ),
    ] {
        let seconds = "<ssd:Units><ssc:Unit name=\"s\"><ssc:BaseUnit s=\"1\"/></ssc:Unit>";
        let text = structure().replace("<ssd:Units>", seconds);
        assert!(text.contains(from), "{text}");
        let text = text.replacen(from, to, 1);
        let entries = [("SystemStructure.ssd", text.as_bytes()), ("relay.fmu", relay())];
        lab.write("rig.ssp", archive(&entries));
        lab.write("case.toml", RIG);
        let ended = lab.trackside(&["run", "case.toml"]).expect(2).says(told);
        ended.says(&["case.toml:2:8", "the system cannot be used"]);
    }
}

fn mistakes_about_connectors_point_at_their_words() {
    let lab = lab();
    let rig = format!("{RIG}unconnected = \"start\"\n");
    let driven = [RIG, DRIVE].concat();
    for (text, told) in [
        (
            driven.clone() + &connect("drive.x", "rig.v", ""),
            &["case.toml:9:6", "unknown input `rig.v`", "did you mean `rig.u`"][..],
        ),
        (
            driven.clone() + &connect("drive.x", "rig.open", ""),
            &["case.toml:9:6", "unknown input `rig.open`"],
        ),
        (
            rig.clone() + &connect("rig.z", "rig.u", ""),
            &["case.toml:5:8", "unknown output `rig.z`"],
        ),
        (
            driven.clone()
                + &connect("drive.x", "rig.u", "")
                + "[[fault]]\ninput = \"rig.w\"\nfrom = 1\nvalue = 1\n",
            &["case.toml:11:9", "`rig.w`"],
        ),
        (
            rig.clone() + &connect("rig.y", "rig.u", ""),
            &["case.toml:6:6", "form a loop", "rig.y -> rig.u", "at = \"start\""],
        ),
        (
            rig.clone() + "[[connect]]\nto = \"rig.y\"\nat = \"start\"\n",
            &["case.toml:6:6", "`rig.y` hands on its value"],
        ),
        (
            format!("{rig}[[connector]]\nname = \"rig.x\"\nkind = \"output\"\n"),
            &["case.toml:5:8", "nothing is connected to `rig.x`"],
        ),
        (
            format!("{rig}[[connector]]\nname = \"rig_a.x\"\nkind = \"output\"\n"),
            &["case.toml:5:8", "two nodes called `rig_a`"],
        ),
        (
            format!("[without]\nfmu = [\"rig_c\"]\n{rig}"),
            &["case.toml:2:8", "unknown inherited [[fmu]] `rig_c`", "rig_a"],
        ),
    ] {
        lab.write("case.toml", text.clone() + TIME);
        lab.trackside(&["run", "case.toml"]).expect(2).says(told);
    }
}

fn names_of_systems_do_not_meet() {
    let lab = lab();
    let rig = format!("{RIG}unconnected = \"start\"\n");
    // Two systems may meet in the names of their nodes.
    let nested = structure().replace("name=\"b\"", "name=\"b_a\"").replace("\"b\"", "\"b_a\"");
    lab.write("nested/SystemStructure.ssd", nested);
    lab.write("nested/relay.fmu", relay());
    let text = "[[system]]\nname = \"t\"\npath = \"nested\"\n[[system]]\nname = \"t_b\"\npath = \"rig.ssp\"\n";
    lab.write("case.toml", format!("{text}{TIME}"));
    let told = ["case.toml:5:8", "the systems `t` and `t_b` would both have a node called `t_b_a`"];
    lab.trackside(&["run", "case.toml"]).expect(2).says(&told);
    // Another FMU in the place of one of the system is told.
    lab.write("case.toml", format!("{rig}{}{TIME}", node("rig_a")));
    let run = ["run", "case.toml", "--rerun", "off"];
    lab.trackside(&run).expect(0).says(&["case.toml:5: `rig_a` takes the place of the FMU"]);
}
