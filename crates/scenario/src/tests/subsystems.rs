//! Messages about `[[system]]` and `[[connector]]`.

use super::fmus;
use super::lab::Lab;

const TIME: &str = "[time]\nstep = 0.25\nstop = 2.0\n";
const RIG: &str = "[[system]]\npath = \"rig.ssp\"\n";
const DRIVE: &str =
    "[[signal]]\nname = \"drive.x\"\nunit = \"m\"\nsine = { amplitude = 2.0, frequency = 0.7 }\n";

/// The description of a system of two relays that get one input in metres, and whose output is in millimetres.
const STRUCTURE: &str = include_str!("files/rig.ssd");

/// A folder with the archive `rig.ssp`.
fn lab() -> Lab {
    let lab = Lab::new();
    lab.fmu("relay.fmu", fmus::RELAY);
    write_rig(&lab, STRUCTURE);
    lab
}

fn write_rig(lab: &Lab, structure: &str) {
    let relay = fmus::archive(fmus::RELAY);
    let entries = [("SystemStructure.ssd", structure.as_bytes()), ("relay.fmu", relay.as_slice())];
    lab.write("rig.ssp", fmus::zipped(&entries));
}

fn connect(from: &str, to: &str, more: &str) -> String {
    format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\"\n{more}")
}

fn node(name: &str) -> String {
    format!("[[fmu]]\nname = \"{name}\"\npath = \"relay.fmu\"\nunconnected = \"start\"\n")
}

#[test]
fn inputs_of_a_system_are_not_forgotten() {
    let text = format!("[[system]]\nname = \"test\"\npath = \"rig.ssp\"\n{TIME}");
    lab().message(&text).says(&[
        "case.toml:2:8",
        "nothing is connected to `u` of `test`",
        "to = \"test.u\"",
        "unconnected = \"start\"",
    ]);
}

#[test]
fn mistakes_about_systems_point_at_their_words() {
    let lab = lab();
    lab.write("other.toml", "title = \"no system\"\n");
    lab.write("rig/SystemStructure.ssd", STRUCTURE);
    lab.write("rig/winter.ssd", STRUCTURE);
    lab.write("rig/relay.fmu", fmus::archive(fmus::RELAY));
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
        (format!("{rig}{}", node("rig")), &["case.toml:2:8", "`rig` is a node of the scenario already"]),
        (
            format!("{rig}{}", signal("rig_a.x")),
            &["case.toml:5:8", "`rig_a` is a node of the system `rig` already"],
        ),
    ] {
        lab.message(&(text.clone() + TIME)).says(told);
    }
}

#[test]
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
        (rig.clone() + &connect("rig.z", "rig.u", ""), &["case.toml:5:8", "unknown output `rig.z`"]),
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
        lab.message(&(text.clone() + TIME)).says(told);
    }
}

#[test]
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
        let text = STRUCTURE.replace("<ssd:Units>", seconds);
        assert!(text.contains(from), "{text}");
        write_rig(&lab, &text.replacen(from, to, 1));
        lab.message(RIG).says(told).says(&["case.toml:2:8", "the system cannot be used"]);
    }
}

#[test]
fn names_of_systems_do_not_meet() {
    let lab = lab();
    // Two systems may meet in the names of their nodes.
    let nested = STRUCTURE.replace("name=\"b\"", "name=\"b_a\"").replace("\"b\"", "\"b_a\"");
    lab.write("nested/SystemStructure.ssd", nested);
    lab.fmu("nested/relay.fmu", fmus::RELAY);
    let text =
        "[[system]]\nname = \"t\"\npath = \"nested\"\n[[system]]\nname = \"t_b\"\npath = \"rig.ssp\"\n";
    lab.message(&format!("{text}{TIME}"))
        .says(&["case.toml:5:8", "the systems `t` and `t_b` would both have a node called `t_b_a`"]);
    // Another FMU in the place of one of the system is told.
    let text = format!("{RIG}unconnected = \"start\"\n{}{TIME}", node("rig_a"));
    let plan = lab.resolve(&text).expect("a plan");
    let told = "case.toml:5: `rig_a` takes the place of the FMU";
    assert!(plan.system.warnings.iter().any(|it| it.contains(told)), "{:?}", plan.system.warnings);
}
