//! Compares two recorded runs: what is in the replay of both, and what may be wrong with them.

use super::fmus::ours;
use super::harness::{Ended, Lab};
use super::python::python;

tests! {
    at_constant_speeds_the_time_between_two_cars_is_the_distance_by_both_speeds: Python,
    the_viewer_loads_two_runs_over_each_other_without_a_warning: Python,
    comparisons_of_equal_runs_are_equal_and_a_run_is_level_with_itself: Python,
    what_cannot_be_compared_is_told_with_what_to_do,
}

/// A drive along x at a constant speed [m/s], 10 s in steps of so many seconds.
fn drive(speed: f64, step: f64) -> String {
    format!(
        "title = \"Straight on\"\n[time]\nstep = {step}\nstop = 10.0\n\
         [[signal]]\nname = \"car.X\"\nunit = \"m\"\nramp = {{ start = 0.0, end = 10.0, after = {} }}\n\
         [[signal]]\nname = \"car.Y\"\nunit = \"m\"\nconstant = 0.0\n\
         [[signal]]\nname = \"car.psi\"\nunit = \"rad\"\nconstant = 0.0\n\
         [[check]]\nname = \"far\"\nthat = \"max(car.X) > 180\"\n\
         [view.pose]\nx = \"car.X\"\ny = \"car.Y\"\nheading = \"car.psi\"\n",
        speed * 10.0
    )
}

/// Records a scenario into a folder of its name.
fn run(lab: &Lab, name: &str, scenario: &str, more: &[&str]) {
    lab.write(&format!("{name}.toml"), scenario);
    let file = format!("{name}.toml");
    let words = [&["run", &file, "--out", name, "--rerun", "off"], more].concat();
    lab.trackside(&words).completes();
}

fn at_constant_speeds_the_time_between_two_cars_is_the_distance_by_both_speeds() {
    let lab = Lab::new();
    run(&lab, "quick", &drive(20.0, 0.001), &[]);
    run(&lab, "slow", &drive(16.0, 0.01), &[]);
    let told = lab.trackside(&["view", "quick", "slow/run.mcap", "--save", "both.rrd"]).expect(0);
    assert!(told.stdout.contains("both.rrd"), "{}", told.stdout);
    let python = python();
    let path = lab.path("both.rrd");
    let rows = python.run("scalars.py", &[path.as_os_str(), "/delta".as_ref()]).stdout;
    let mut last = 0.0;
    for row in rows.lines() {
        let numbers: Vec<f64> = row.split(' ').map(|it| it.parse().expect("a number")).collect();
        let [time, distance, delta] = numbers[..] else { panic!("{row}") };
        let expected = 20.0 * time / 16.0 - time;
        assert!((delta - expected).abs() < 1e-9, "{row}: expected {expected}");
        assert!((distance - 2_000.0 * time).abs() <= 0.5, "{row}");
        last = time;
    }
    // The slow car comes as far as 160 m, where the quick one is after 8 s.
    assert!((7.99..=8.0 + 1e-9).contains(&last), "{last}");
    assert!(rows.lines().count() > 1_500, "{}", rows.lines().count());
    let card = python.run("document.py", &[path.as_os_str(), "/run".as_ref()]).stdout;
    for words in ["quick", "slow", "FAILED", "passed", "+2.000 s", "signal.car.X.ramp.after"] {
        assert!(card.contains(words), "no {words} in {card}");
    }
}

fn the_viewer_loads_two_runs_over_each_other_without_a_warning() {
    let python = python();
    let lab = Lab::new();
    lab.add(&ours().join("plant.fmu"));
    let scenario = |more: &str| {
        format!(
            "extends = \"base.toml\"\n[[fmu]]\nname = \"plant\"\npath = \"plant.fmu\"\n\
             start = {{ start.v_x = 27.8, F_x = 0.0 }}\n{more}"
        )
    };
    // The edges of the road are in a file, which the recording must hold.
    lab.write("road/track.csv", "x,y\n0,0\n50,0\n100,1\n");
    lab.write(
        "base.toml",
        "[time]\nstep = 0.01\nstop = 4.0\n\
         [[signal]]\nname = \"driver.delta\"\nunit = \"deg\"\nstep = { at = 1.0, after = 1.5 }\n\
         [[connect]]\nfrom = \"driver.delta\"\nto = \"plant.delta\"\n\
         [[check]]\nname = \"turns\"\nthat = \"max(plant.r) > 0.1\"\n\
         [view.pose]\nx = \"plant.X\"\ny = \"plant.Y\"\nheading = \"plant.psi\"\nspeed = \"plant.v_x\"\n\
         [view.track]\npath = \"road/track.csv\"\ncenter = [\"x\", \"y\"]\nhalf_width = 4.0\n\
         [[view.xy_plot]]\ntitle = \"Forces\"\nx = { label = \"a_y [m/s2]\", range = [-9, 9] }\n\
         y = { label = \"a_x [m/s2]\", range = [-9, 9] }\n\
         points = [{ label = \"car\", x = \"plant.a_y\", y = \"plant.a_x\" }]\n\
         [[view.plot]]\ntitle = \"Yaw rate\"\nunit = \"deg/s\"\nsignals = [{ signal = \"plant.r\", role = \"plant\" }]\n",
    );
    run(&lab, "light", &scenario(""), &[]);
    let more = "[[signal]]\nname = \"other.signal\"\nconstant = 1.0\n";
    run(&lab, "heavy", &scenario(more), &["--set", "plant.body.m=1200"]);
    std::fs::remove_dir_all(lab.path("road")).expect("it was there");
    let told = lab.trackside(&["view", "light", "heavy", "--save", "both.rrd"]).expect(0);
    assert!(told.stderr.contains("only heavy has other.signal"), "{}", told.stderr);
    assert!(!told.stderr.contains("not used"), "{}", told.stderr);
    let replay = lab.path("both.rrd");
    let rerun = |words: &[&str]| {
        let mut rerun = python.rerun();
        rerun.env("RERUN_PANIC_ON_WARN", "1").args(words).arg(&replay);
        Ended::of(rerun.output().expect("it starts")).expect(0).stdout
    };
    rerun(&["rrd", "verify"]);
    rerun(&["--test-receive", "--headless", "--port", "auto"]);
    let entities = rerun(&["rrd", "stats"]);
    for entity in [
        "/delta",
        "/world/road",
        "/world/car",
        "/world/versus/car/body",
        "/world/versus/path/line",
        "/signals/plant/outputs/v_x",
        "/versus/signals/plant/outputs/v_x",
        "/versus/signals/other/outputs/signal",
        "/versus/plots/1/1",
        "/xy_plots/1/versus/points/1",
    ] {
        assert!(entities.contains(entity), "no {entity}");
    }
    let card = python.run("document.py", &[replay.as_os_str(), "/run".as_ref()]).stdout;
    assert!(card.contains("fmu.plant.start.body.m") && card.contains("1200"), "{card}");
}

fn comparisons_of_equal_runs_are_equal_and_a_run_is_level_with_itself() {
    let python = python();
    let lab = Lab::new();
    run(&lab, "a", &drive(20.0, 0.01), &[]);
    lab.trackside(&["view", "a", "a", "--save", "one.rrd"]).expect(0);
    lab.trackside(&["view", "a", "a", "--save", "two.rrd"]).expect(0);
    let mut rerun = python.rerun();
    rerun
        .args(["rrd", "compare", "--unordered"])
        .args(["one.rrd", "two.rrd"].map(|it| lab.path(it)));
    Ended::of(rerun.output().expect("it starts")).expect(0);
    let path = lab.path("one.rrd");
    let rows = python.run("scalars.py", &[path.as_os_str(), "/delta".as_ref()]).stdout;
    assert!(
        rows.lines().count() == 1_001 && rows.lines().all(|row| row.ends_with(" 0.0")),
        "{rows}"
    );
}

fn what_cannot_be_compared_is_told_with_what_to_do() {
    let lab = Lab::new();
    run(&lab, "drive", &drive(20.0, 0.01), &[]);
    let other = "[time]\nstep = 0.1\nstop = 1.0\n[[signal]]\nname = \"tank.level\"\nunit = \"m\"\nconstant = 1.0\n";
    run(&lab, "tank", other, &[]);
    let compare = |a: &str, b: &str| lab.trackside(&["view", a, b, "--save", "both.rrd"]);
    compare("drive", "nowhere").expect(2).says(&["nowhere", "no recording", "the folder of a run"]);
    compare("drive", "tank").expect(2).says(&[
        "no signal in common",
        "two runs of one scenario",
        "drive/run.mcap has car",
        "tank/run.mcap has tank",
    ]);
    lab.write("text/run.mcap", "no recording");
    compare("text", "drive").expect(2).says(&["text/run.mcap"]);
    lab.trackside(&["view", "drive", "--save", "both.rrd"]).expect(2);
    assert!(!lab.has("both.rrd"));
    // A recording that was cut off is used up to its end.
    let whole = std::fs::read(lab.path("drive/run.mcap")).expect("the recording");
    lab.write("cut/run.mcap", &whole[..whole.len() / 2]);
    let told = compare("drive", "cut").expect(0);
    assert!(told.stderr.contains("cut/run.mcap was cut off"), "{}", told.stderr);
    // What the other run tells in another unit is converted; of another dimension it is shown apart.
    run(&lab, "far", &drive(20.0, 0.01).replace("unit = \"m\"", "unit = \"km\""), &[]);
    run(&lab, "odd", &drive(20.0, 0.01).replacen("unit = \"m\"", "unit = \"kg\"", 1), &[]);
    assert!(!compare("drive", "far").expect(0).stderr.contains("do not fit"));
    let told = compare("drive", "odd").expect(0).stderr;
    assert!(told.contains("`car.X` is in m and in kg"), "{told}");
}
