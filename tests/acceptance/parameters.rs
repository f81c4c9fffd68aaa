//! Gives several FMUs their values from one file, and makes mistakes in it.

use super::fixture::Scenario;
use super::fmus::ours;
use super::harness::{Ended, Lab};

tests! {
    one_file_gives_its_values_to_all_fmus_that_name_it: Compiler,
    own_values_win_over_those_of_the_file: Compiler,
    mistakes_in_a_file_are_pointed_at_there: Compiler,
    a_scenario_with_parameters_is_swept: Compiler,
}

const CAR: &str = "\
title_of_nothing = 1.0

[body]
m = 900.0
I_zz = 1200.0
";

fn scenario(keys: &str) -> String {
    Scenario::new()
        .time(0.01, 0.1)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 900.0, delta = 0.0")
        .key("parameters = \"cars/car.toml\"")
        .key(keys)
        .section("[[check]]\nname = \"mass\"\nthat = \"abs(plant.a_x - 0.8775) < 0.01\"")
        .text()
}

fn run(car: &str, scenario: &str) -> (Lab, Ended) {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab.write("cars/car.toml", car);
    lab.write("case.toml", scenario);
    let ended = lab.trackside(&["run", "case.toml", "--rerun", "off"]);
    (lab, ended)
}

fn sound() -> String {
    CAR.replace("title_of_nothing = 1.0\n", "")
}

fn one_file_gives_its_values_to_all_fmus_that_name_it() {
    let (_lab, ended) = run(&sound(), &scenario(""));
    ended.expect(0);
}

fn own_values_win_over_those_of_the_file() {
    let heavier = sound().replace("m = 900.0", "m = 1800.0");
    run(&heavier, &scenario("")).1.expect(1);
    let own = scenario("").replace("start.v_x = 20.0,", "start.v_x = 20.0, body.m = 900.0,");
    run(&heavier, &own).1.expect(0);
}

fn mistakes_in_a_file_are_pointed_at_there() {
    run(CAR, &scenario(""))
        .1
        .expect(2)
        .says(&["cars/car.toml:1:", "`plant` has no variable `title_of_nothing`"]);
    run(CAR, &scenario("unused = \"tell\"")).1.expect(0).says(&["title_of_nothing", "left out"]);
    for (from, to, said) in [
        ("m = 900.0", "m = -3.0", "`body.m` is at least 1 kg, found -3 kg"),
        ("m = 900.0", "mass = 3.0", "`plant` has no variable `body.mass`"),
        ("m = 900.0", "m = true", "`body.m` is Real, found boolean true"),
        ("m = 900.0", "m = \"900 m\"", "body.m"),
        ("m = 900.0", "m = { text_of = \"none.tir\" }", "none.tir"),
        ("m = 900.0", "m = ", "cars/car.toml:3:"),
    ] {
        let (_lab, ended) = run(&sound().replace(from, to), &scenario(""));
        ended.expect(2).says(&["cars/car.toml:", said]);
    }
    let (_lab, ended) = run(&sound(), &scenario("").replace("cars/car.toml", "cars/cat.toml"));
    ended.expect(2).says(&["case.toml:", "cars/cat.toml cannot be read"]);
}

fn a_scenario_with_parameters_is_swept() {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    lab.write("cars/car.toml", sound());
    let vary = "\n[[sweep.vary]]\nname = \"plant.body.h\"\nvalues = [0.3, 0.4]\n";
    lab.write("case.toml", format!("{}\n[sweep]\n{vary}", scenario("")));
    lab.trackside(&["sweep", "case.toml", "--out", "sweep"]).expect(0);
}
