//! Clicks through the player of `report.html` in a browser, and checks its size.

use super::fixture::Scenario;
use super::fmus::{ours, relay};
use super::harness::Lab;
use super::python::python;

tests! {
    the_page_of_a_run_is_played_in_a_browser: Compiler + Browser,
    the_page_of_a_long_run_is_small: Compiler,
}

/// The program of the browser, if there is one.
pub fn browser() -> Option<&'static str> {
    let starts = |name: &&str| std::process::Command::new(name).arg("--version").output().is_ok();
    ["chromium", "chromium-browser", "google-chrome"].into_iter().find(starts)
}

/// A check whose name would end the script, and start another one, if it were not text.
const FOREIGN: &str = "</script><script>alert(1)</script><!--";

fn the_page_of_a_run_is_played_in_a_browser() {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    let driven = Scenario::headed("title = 'Double lane change'")
        .time(0.01, 13.0)
        .fmu("plant", "plant.fmu", "start.v_x = 22.2, delta = 0.0, F_x = 0.0")
        .section(
            "[[manoeuvre]]\nname = 'test'\ncar = 'plant'\nentry_speed = 22.2\nwheelbase = 3.0\npath_follower = { yaw_gain = 0.2 }\n\
             lane_change = { course = 'iso_3888_1', width = 1.8, rear = 9.0 }",
        )
        // Nine metres behind the centre of gravity the car cuts corners, and hits cones.
        .check("no cone is hit", "test.passed == 1")
        .signal("timer.lap", "step = { at = 5.0, after = 1.0 }")
        .signal("timer.lap_time", "unit = 's'\nconstant = 83.456")
        .connect("driver.steer", "plant.delta")
        .connect("driver.drive", "plant.F_x")
        .section("[[fault]]\ninput = 'plant.F_x'\nfrom = 3.0\nuntil = 4.0\nvalue = 0.0")
        .check(FOREIGN, "abs(plant.a_y) < 0.5")
        .check("drives on", "plant.X >= 0")
        .pose("plant")
        .key("steer = 'plant.delta'\nspeed = 'plant.v_x'")
        .section(
            "[[view.xy_plot]]\ntitle = 'Accelerations'\nx = { label = 'a_y [m/s2]', range = [8, -8] }\n\
             y = { label = 'a_x [m/s2]', range = [-4, 4] }\npoints = [{ label = 'car', x = 'plant.a_y', y = 'plant.a_x' }]\n\
             curves = [{ label = 'bound', y = 'x * plant.a_y / 10' }]",
        );
    lab.write("driven.toml", driven.text());
    let set = ["--set", "test.entry_speed=78 km/h"];
    let run =
        lab.trackside(&[&["run", "driven.toml", "--out", "driven", "--rerun", "off"][..], &set].concat());
    let summary = run.expect(1).stdout;
    for line in ["run with test.entry_speed = 78 km/h", "lap 1: 1:23.456"] {
        assert!(summary.contains(line), "no {line}: {summary}");
    }
    assert_eq!(lab.report("driven")["laps"][0]["duration"], 83.456);
    lab.write("relay.fmu", relay());
    let relayed = Scenario::new().time(0.01, 1.0).fmu("relay", "relay.fmu", "").key("unconnected = 'start'");
    lab.write("relayed.toml", relayed.text());
    lab.trackside(&["run", "relayed.toml", "--out", "relayed", "--rerun", "off"]).expect(0);
    let [driven, relayed] = ["driven/report.html", "relayed/report.html"].map(|page| lab.path(page));
    let browser = browser().expect("a browser");
    python().run("player.py", &[browser.as_ref(), driven.as_os_str(), relayed.as_os_str(), FOREIGN.as_ref()]);
}

fn the_page_of_a_long_run_is_small() {
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    let scenario = Scenario::new()
        .time(0.01, 1_000.0)
        .fmu("plant", "plant.fmu", "start.v_x = 20.0, F_x = 800.0")
        .signal("driver.delta", "unit = 'rad'\nsine = { amplitude = 0.03, frequency = 0.37 }")
        .connect("driver.delta", "plant.delta")
        .check("turns", "max(abs(plant.r)) > 0.1")
        .pose("plant");
    lab.write("case.toml", scenario.text());
    lab.trackside(&["run", "case.toml", "--out", "out", "--rerun", "off"]).expect(0);
    let page = lab.read("out/report.html");
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    assert!(page.contains("so no peak is lost"), "the page says how fine it is");
}
