//! Compares two recorded runs: the replay of both, and the errors of runs that don't fit each other.

use super::fmus::ours;
use super::harness::{Ended, Lab};
use super::python::python;

tests! {
    the_time_gap_at_constant_speeds_is_the_analytic_one: Python,
    the_viewer_loads_a_comparison_without_warnings: Python,
    comparisons_of_equal_runs_are_equal_with_zero_time_gap: Python,
    incomparable_runs_give_an_error_with_advice,
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

fn the_time_gap_at_constant_speeds_is_the_analytic_one() {
    let lab = Lab::new();
    run(&lab, "quick", &drive(20.0, 0.001), &[]);
    run(&lab, "slow", &drive(16.0, 0.01), &[]);
    let output = lab.trackside(&["view", "quick", "slow/run.mcap", "--save", "both.rrd"]).expect(0);
    assert!(output.stdout.contains("both.rrd"), "{}", output.stdout);
    let python = python();
    let path = lab.path("both.rrd");
    let rows = python.run("scalars.py", &[path.as_os_str(), "/time_gap".as_ref()]).stdout;
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

fn the_viewer_loads_a_comparison_without_warnings() {
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
    let output = lab.trackside(&["view", "light", "heavy", "--save", "both.rrd"]).expect(0);
    assert!(output.stderr.contains("only heavy has other.signal"), "{}", output.stderr);
    assert!(!output.stderr.contains("not used"), "{}", output.stderr);
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
        "/time_gap",
        "/world/road",
        "/world/car",
        "/world/versus/car/body",
        "/world/versus/path/line",
        "/signals/plant/outputs/v_x",
        "/versus/signals/plant/outputs/v_x",
        "/versus/signals/other/outputs/signal",
        "/versus/plots/1/1",
        "/xy_plots/1/versus/points",
    ] {
        assert!(entities.contains(entity), "no {entity}");
    }
    let card = python.run("document.py", &[replay.as_os_str(), "/run".as_ref()]).stdout;
    assert!(card.contains("plant.body.m") && card.contains("1200"), "{card}");
}

fn comparisons_of_equal_runs_are_equal_with_zero_time_gap() {
    let python = python();
    let lab = Lab::new();
    run(&lab, "a", &drive(20.0, 0.01), &[]);
    lab.trackside(&["view", "a", "a", "--save", "one.rrd"]).expect(0);
    lab.trackside(&["view", "a", "a", "--save", "two.rrd"]).expect(0);
    let mut rerun = python.rerun();
    rerun.args(["rrd", "compare", "--unordered"]).args(["one.rrd", "two.rrd"].map(|it| lab.path(it)));
    Ended::of(rerun.output().expect("it starts")).expect(0);
    let path = lab.path("one.rrd");
    let rows = python.run("scalars.py", &[path.as_os_str(), "/time_gap".as_ref()]).stdout;
    assert!(rows.lines().count() == 1_001 && rows.lines().all(|row| row.ends_with(" 0.0")), "{rows}");
}

fn incomparable_runs_give_an_error_with_advice() {
    let lab = Lab::new();
    run(&lab, "drive", &drive(20.0, 0.01), &[]);
    let other =
        "[time]\nstep = 0.1\nstop = 1.0\n[[signal]]\nname = \"tank.level\"\nunit = \"m\"\nconstant = 1.0\n";
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
    let output = compare("drive", "cut").expect(0);
    assert!(output.stderr.contains("cut/run.mcap was cut off"), "{}", output.stderr);
    // Another unit of the same dimension is converted; signals of different dimensions are shown apart.
    run(&lab, "far", &drive(20.0, 0.01).replace("unit = \"m\"", "unit = \"km\""), &[]);
    run(&lab, "odd", &drive(20.0, 0.01).replacen("unit = \"m\"", "unit = \"kg\"", 1), &[]);
    assert!(!compare("drive", "far").expect(0).stderr.contains("do not fit"));
    let output = compare("drive", "odd").expect(0).stderr;
    assert!(output.contains("`car.X` is in m and in kg"), "{output}");
}
