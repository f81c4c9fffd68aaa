//! Finds fastest laps by `trackside lap`, and compares them with those of CasADi and IPOPT.

use std::path::Path;

use recording::table::{ColumnRequest, ReadRequest, TimeSeriesTable};
use serde_json::Value;
use track::{TrackLine, TrackSurvey};

use super::harness::{Ended, Lab, ROOT};
use super::python::python;
use super::requirement::logs_of_others;

tests! {
    a_lap_has_a_time_a_table_and_a_page,
    a_car_of_a_data_sheet_laps_and_its_ranges_give_an_interval,
    a_log_in_degrees_becomes_a_track_beside_whose_fastest_lap_it_lies,
    a_vbox_of_others_becomes_an_open_track: Logs,
    tracks_of_others_bend_as_their_cars_turned: Logs,
    roads_of_open_drive_and_open_crg_become_tracks_to_lap,
    tables_of_a_car_are_used_and_what_they_replace_is_told,
    casadi_and_ipopt_find_the_same_lap: Python,
    draws_of_an_identification_give_an_interval,
    the_fastest_lap_is_driven_in_the_plant,
    the_fastest_lap_drives_as_a_ghost_in_the_replay: Python,
    the_fastest_setup_is_faster_by_an_interval,
    what_is_wrong_is_told_with_its_place,
    what_is_wrong_with_the_log_of_a_track_is_told,
}

/// A car on tires by the simple formula; without track widths it is a single track.
fn car(widths: &str) -> String {
    format!(
        "[body]\nm = 1250.0\nI_zz = 1850.0\nl_f = 1.18\nl_r = 1.27\nh = 0.47\n{widths}\n\
         [roll]\nstiffness_f = 62e3\nstiffness_r = 44e3\n\
         [aero]\narea = 1.95\nC_d = 0.34\nC_lf = 0.05\nC_lr = 0.08\n\
         [brake]\nfront_share = 0.62\n[drive]\nfront_share = 0.0\npower_max = 190e3\n\
         [limit]\nF_x_min = -15e3\nF_x_max = 9e3\nF_x_rate = 40e3\ndelta = 0.5\ndelta_rate = 1.0\n\
         [tire_f]\nB = 12.0\nC = 1.5\nD = 1.1\nE = 0.3\n[tire_r]\nB = 12.0\nC = 1.5\nD = 1.15\nE = 0.3\n"
    )
}

fn track(name: &str) -> String {
    Path::new(ROOT).join("scenarios/tracks").join(name).display().to_string()
}

fn numbers(lab: &Lab) -> Value {
    let text = std::fs::read_to_string(lab.path("out/lap.json")).expect("a file");
    serde_json::from_str(&text).expect("JSON")
}

fn a_lap_has_a_time_a_table_and_a_page() {
    let lab = Lab::new();
    lab.write("car.toml", car(""));
    let arguments = ["lap", "car.toml", &track("oval.csv"), "--nodes", "120", "--out", "out"];
    let ended = lab.trackside(&arguments).expect(0);
    for words in [
        "car.toml on oval.csv, 1185 m, 120 nodes",
        "corner 2",
        "one percent more of",
        "tire_f.D",
        "out/lap.html",
    ] {
        assert!(ended.stdout.contains(words), "{words} in {}", ended.stdout);
    }
    let found = numbers(&lab);
    assert_eq!(found["status"], "converged");
    let lap_time = found["lap_time"].as_f64().expect("a time");
    assert!((28.0..34.0).contains(&lap_time), "{lap_time}");
    let page = std::fs::read_to_string(lab.path("out/lap.html")).expect("a page");
    assert!(!page.contains("NaN") && page.contains("What one percent is worth"));
    // The driven line is a track: kept to, it takes as long; another optimum on it is no faster than the first.
    let on_line = ["lap", "car.toml", "out/lap.csv", "--nodes", "120", "--on-line", "--out", "line"];
    lab.trackside(&on_line).expect(0);
    let text = std::fs::read_to_string(lab.path("line/lap.json")).expect("a file");
    let kept: Value = serde_json::from_str(&text).expect("JSON");
    let kept = kept["lap_time"].as_f64().expect("a time");
    assert!((kept / lap_time - 1.0).abs() < 5e-3, "{kept} {lap_time}");
}

fn a_car_of_a_data_sheet_laps_and_its_ranges_give_an_interval() {
    let lab = Lab::new();
    let sheet = Path::new(ROOT).join("scenarios/cars/data_sheet/car.toml").display().to_string();
    let track = track("oval.csv");
    let ranges = ["--vary", "body.m=1200 kg..1300 kg", "--vary", "tire_f.LMUY=0.97..1.03", "--samples", "6"];
    let arguments = [&["lap", &sheet, &track, "--nodes", "120", "--out", "out"], &ranges[..]].concat();
    let ended = lab.trackside(&arguments).expect(0);
    assert!(ended.stdout.contains("95 % of 6 draws: 0:3"), "{}", ended.stdout);
    assert!(ended.stderr.contains("the lap has no use for diff_r.coast_lock"), "{}", ended.stderr);
    let interval = numbers(&lab)["interval"].clone();
    assert_eq!(
        (interval["lap_times"].as_array().map(Vec::len), &interval["unsolved"]),
        (Some(6), &Value::from(0))
    );
    let again = lab.trackside(&arguments).expect(0);
    assert_eq!(ended.stdout, again.stdout, "the seed decides");
}

/// Two straights and two half circles, banked by 0.1 rad in the bends, on a hill of 2 m.
fn oval_of_open_drive() -> String {
    let bend = 60.0 * std::f64::consts::PI;
    let length = 2.0 * (200.0 + bend);
    let geometry = |s: f64, x: f64, y: f64, heading: f64, length: f64, shape: &str| {
        format!(
            "<geometry s=\"{s}\" x=\"{x}\" y=\"{y}\" hdg=\"{heading}\" length=\"{length}\"><{shape}/></geometry>"
        )
    };
    let (half_turn, arc) = (std::f64::consts::PI, "arc curvature=\"0.016666666667\"");
    let plan = [
        geometry(0.0, 0.0, 0.0, 0.0, 200.0, "line"),
        geometry(200.0, 200.0, 0.0, 0.0, bend, arc),
        geometry(200.0 + bend, 200.0, 120.0, half_turn, 200.0, "line"),
        geometry(400.0 + bend, 0.0, 120.0, half_turn, bend, arc),
    ];
    let link = |name: &str, point: &str| {
        format!("<{name} elementType=\"road\" elementId=\"7\" contactPoint=\"{point}\"/>")
    };
    let lane = |id: i32, width: f64| {
        format!(
            "<lane id=\"{id}\" type=\"driving\"><link><predecessor id=\"{id}\"/><successor id=\"{id}\"/></link>\
             <width sOffset=\"0\" a=\"{width}\" b=\"0\" c=\"0\" d=\"0\"/></lane>"
        )
    };
    format!(
        "<OpenDRIVE><header revMajor=\"1\" revMinor=\"7\"/><road id=\"7\" length=\"{length}\" junction=\"-1\"><link>{}{}</link>\
         <planView>{}</planView><elevationProfile><elevation s=\"0\" a=\"2\" b=\"0\" c=\"0\" d=\"0\"/></elevationProfile>\
         <lateralProfile><superelevation s=\"0\" a=\"-0.1\" b=\"0\" c=\"0\" d=\"0\"/></lateralProfile><lanes><laneSection s=\"0\">\
         <left>{}</left><center><lane id=\"0\" type=\"none\"/></center><right>{}{}</right></laneSection></lanes></road></OpenDRIVE>",
        link("predecessor", "end"),
        link("successor", "start"),
        plan.concat(),
        lane(1, 4.0),
        lane(-1, 4.0),
        lane(-2, 4.0)
    )
}

fn roads_of_open_drive_and_open_crg_become_tracks_to_lap() {
    let lab = Lab::new();
    lab.write("oval.xodr", oval_of_open_drive());
    lab.write("car.toml", car(""));
    let ended = lab.trackside(&["track", "oval.xodr", "--out", "oval.csv"]).expect(0);
    assert!(ended.stdout.contains("  777.0 m, closed, road 7; 11.9 to 11.9 m wide"), "{}", ended.stdout);
    assert!(ended.stdout.contains("banked by -5.7 to -5.7 deg"), "{}", ended.stdout);
    let lapped = ["lap", "car.toml", "oval.csv", "--nodes", "120", "--margin", "1.0", "--out", "out"];
    lab.trackside(&lapped).expect(0);
    let banked = numbers(&lab)["lap_time"].as_f64().expect("a time");
    // The same road without the bank takes longer: it leans into the bends.
    lab.write("flat.xodr", oval_of_open_drive().replace("a=\"-0.1\"", "a=\"0\""));
    let ended = lab.trackside(&["track", "flat.xodr", "--roads", "7", "--out", "oval.csv"]).expect(0);
    assert!(ended.stdout.contains("12.0 to 12.0 m wide\n"), "{}", ended.stdout);
    lab.trackside(&lapped).expect(0);
    let flat = numbers(&lab)["lap_time"].as_f64().expect("a time");
    assert!(banked < 0.99 * flat && banked > 0.9 * flat, "{banked} {flat}");

    // A map in Latin-1, as older tools write it.
    let latin = oval_of_open_drive().replace("\"7\"", "\"S\u{fc}d\"");
    lab.write("latin.xodr", latin.chars().map(|it| it as u8).collect::<Vec<u8>>());
    let ended = lab.trackside(&["track", "latin.xodr", "--out", "latin.csv"]).expect(0);
    assert!(ended.stdout.contains("closed, road S\u{fc}d;"), "{}", ended.stdout);

    // A road in two parts that do not meet is no track; the set-up of a number that a table replaces is told.
    let torn = oval_of_open_drive().replace("x=\"200\" y=\"120\"", "x=\"200\" y=\"150\"");
    lab.write("torn.xodr", torn);
    let ended = lab.trackside(&["track", "torn.xodr", "--out", "torn.csv"]).expect(2);
    assert!(ended.stderr.contains("the line jumps by 30."), "{}", ended.stderr);

    let heights = " 0.0000000 0.0000000 0.0000000\n".repeat(41);
    lab.write(
        "straight.crg",
        format!(
            "$ROAD_CRG\nREFERENCE_LINE_INCREMENT = 1.0\nLONG_SECTION_V_RIGHT = -3.0\nLONG_SECTION_V_INCREMENT = 3.0\n$\n\
             $KD_Definition\n#:LRFI\nD:long section 1,m\nD:long section 2,m\nD:long section 3,m\n$\n$$$$\n{heights}"
        ),
    );
    let ended = lab.trackside(&["track", "straight.crg", "--out", "straight.csv"]).expect(0);
    assert!(ended.stdout.contains("  40.0 m, open; 6.0 to 6.0 m wide"), "{}", ended.stdout);

    let wrong = |arguments: &[&str], words: &[&str]| {
        let ended = lab.trackside(arguments).expect(2);
        words.iter().for_each(|word| assert!(ended.stderr.contains(word), "{word} in {}", ended.stderr));
    };
    wrong(&["track", "oval.xodr", "--roads", "8"], &["found `8`; it has 7"]);
    wrong(&["track", "oval.xodr", "--noise", "1"], &["--noise is for a track of a log"]);
    wrong(&["track", "straight.crg", "--roads", "1"], &["--roads is for a track of OpenDRIVE"]);
    wrong(&["lap", "car.toml", "oval.xodr"], &["trackside track oval.xodr --out track.csv"]);
    lab.write("broken.xodr", "<OpenDRIVE><road>");
    wrong(&["track", "broken.xodr"], &["broken.xodr: expected XML: "]);
}

fn tables_of_a_car_are_used_and_what_they_replace_is_told() {
    let lab = Lab::new();
    let touring = Path::new(ROOT).join("scenarios/cars/touring/car.toml").display().to_string();
    let track = track("road_course.csv");
    let lap = |more: &[&str]| {
        let arguments = ["lap", &touring, &track, "--nodes", "150", "--out", "out"];
        let ended = lab.trackside(&[&arguments, more].concat()).expect(0);
        (ended.stderr, numbers(&lab)["lap_time"].as_f64().expect("a time"))
    };
    let (messages, lap_time) = lap(&[]);
    assert!(!messages.contains("warning"), "{messages}");
    let (messages, same) = lap(&["--set", "brake.front_share=0.3", "--set", "aero.C_lf=3"]);
    assert_eq!(same, lap_time);
    assert!(
        messages.contains(
            "warning: --set: `brake.front_share` changes nothing in this car: a table takes its place"
        ),
        "{messages}"
    );
    let (messages, faster_turning) = lap(&["--set", "drive.ratio=20"]);
    assert!(messages.contains("drive.map ends at 14000 rpm"), "{messages}");
    assert!(faster_turning > lap_time, "{faster_turning} {lap_time}");
    // A mistake in a table is in its file.
    lab.write("air.csv", "ride_height_f [m], C_dd\n0, 0.4\n");
    let text = std::fs::read_to_string(&touring).expect("a car").replace("../sport/", "SPORT/");
    let sport = Path::new(ROOT).join("scenarios/cars/sport").display().to_string();
    lab.write("car.toml", text.replace("SPORT", &sport).replace("\"aero.csv\"", "\"air.csv\""));
    for table in ["engine.csv", "brakes.csv", "kinematics_front.csv", "kinematics_rear.csv"] {
        std::fs::copy(Path::new(&touring).with_file_name(table), lab.path(table)).expect("a table");
    }
    let ended = lab.trackside(&["lap", "car.toml", &track]).expect(2);
    ended.says(&["air.csv:1: unknown column `C_dd`", "(aero.map of car.toml)"]);

    // A lower front has more downforce.
    let (_, lower) = lap(&["--set", "aero.ride_height_f=0.05"]);
    assert!(lower < lap_time - 0.05, "{lower} {lap_time}");
}

fn casadi_and_ipopt_find_the_same_lap() {
    let lab = Lab::new();
    let heights = [0.02, 0.15].into_iter().flat_map(|front| [0.02, 0.15].map(|rear| [front, rear]));
    let planes = heights.map(|[front, rear]| {
        let coefficients = [0.4 + front - 0.5 * rear, 1.1 - 6.0 * front, 1.0 - 2.0 * (rear - front)];
        format!("{front}, {rear}, {}, {}, {}\n", coefficients[0], coefficients[1], coefficients[2])
    });
    let map = format!(
        "ride_height_f = 0.07\nride_height_r = 0.09\nmap = \"\"\"\nride_height_f [m], ride_height_r [m], C_d, C_lf, C_lr\n{}\"\"\"",
        planes.collect::<String>()
    );
    let both_axles = car("track_f = 1.5\ntrack_r = 1.5");
    let platform = both_axles
        .replace("[aero]", &format!("[ride]\nstiffness_f = 70e3\nstiffness_r = 80e3\n[aero]\n{map}"));
    let swinging = platform
        .replace("[ride]", "[pitch]\ncentre = 0.04\n[ride]\ndamping_f = 3400.0\ndamping_r = 3100.0")
        .replace("track_f = 1.5", "track_f = 1.5\nI_xx = 380.0\nI_yy = 1650.0")
        .replace(
            "[roll]",
            "[roll]\ndamping_f = 3800.0\ndamping_r = 3500.0\ncentre_f = 0.045\ncentre_r = 0.08",
        );
    let transients: &[&str] = &["--transients"];
    let cars = [
        (car(""), "250", &[][..]),
        (both_axles, "250", &[]),
        (platform, "250", &[]),
        (swinging, "500", transients),
    ];
    for (text, nodes, more) in cars {
        lab.write("car.toml", text);
        let track = track("road_course.csv");
        let arguments = ["lap", "car.toml", &track, "--nodes", nodes, "--margin", "0.9", "--out", "out"];
        lab.trackside(&[&arguments[..], more].concat()).expect(0);
        let table = lab.path("out/lap.csv").display().to_string();
        let car = lab.path("car.toml").display().to_string();
        let arguments = [&[&car[..], &track, &table, "--margin", "0.9"], more].concat();
        let peer = python().run("lap_peer.py", &arguments).stdout;
        let peer: Value = serde_json::from_str(&peer).expect("JSON");
        let difference = peer["lap_time_difference"].as_f64().expect("a number");
        assert!(difference < 1e-5, "{peer}");
        let deviation = peer["largest_deviation"].as_f64().expect("a number");
        assert!(deviation < 0.05, "{peer}");
    }
}

fn draws_of_an_identification_give_an_interval() {
    let lab = Lab::new();
    let scenarios = Path::new(ROOT).join("scenarios");
    let drive = scenarios.join("tires_from_driving.toml").display().to_string();
    lab.trackside(&["run", &drive, "--out", "tires"]).expect(0);
    let demo = scenarios.join("cars/demo/car.toml").display().to_string();
    let track = track("oval.csv");
    let car = ["lap", &demo, &track, "--set", "drive.power_max=120 kW", "--nodes", "120", "--out", "out"];
    let draws = ["--draws", "tires/tires_draws.csv", "--samples", "10"];
    let ended = lab.trackside(&[&car[..], &draws].concat()).expect(0);
    assert!(ended.stdout.contains("95 % of 10 draws"), "{}", ended.stdout);
    // The drive leaves little of the tires open, and the tires that it was driven with are within.
    let found = numbers(&lab);
    let lap_time = found["lap_time"].as_f64().expect("a time");
    let ends = [0, 2].map(|k| found["interval"]["quantiles"][k].as_f64().expect("a quantile"));
    assert!(ends[0] < ends[1] && ends[1] - ends[0] < 0.1, "{ends:?}");
    assert!((ends[0] - 0.05..ends[1] + 0.05).contains(&lap_time), "{lap_time} {ends:?}");
    lab.write("draws.csv", "plant.tire_f.D\n1.08\nmuch\n");
    let wrong = ["--draws", "draws.csv"];
    let told = lab.trackside(&[&car[..], &wrong].concat()).expect(2);
    told.says(&["draws.csv: line 3: expected a number, found `much`"]);
    lab.write("draws.csv", "plant.tire_f.F\n1.08\n");
    lab.trackside(&[&car[..], &wrong].concat()).expect(2).says(&["no parameter `plant.tire_f.F`"]);
    // Draws of the simple formula say nothing of a car on tires of a file: an interval of no width would be none.
    let sheet = scenarios.join("cars/data_sheet/car.toml").display().to_string();
    let on_file = ["lap", &sheet, &track, "--nodes", "120", "--out", "out"];
    for known in [&["--draws", "tires/tires_draws.csv"], &["--vary", "tire_f.D=1..1.1"]] {
        let told = lab.trackside(&[&on_file[..], known].concat()).expect(2);
        told.says(&["changes nothing in this car", "lap a car without tire_f.tir"]);
    }
}

fn the_fastest_lap_is_driven_in_the_plant() {
    let lab = Lab::new();
    for widths in ["", "track_f = 1.5\ntrack_r = 1.5"] {
        lab.write("car.toml", car(widths));
        let track = track("oval.csv");
        lab.trackside(&["lap", "car.toml", &track, "--set", "body.m=1300 kg", "--out", "out"]).expect(0);
        let least = numbers(&lab)["lap_time"].as_f64().expect("a time");
        let share = "driver.profile.share=0.9";
        lab.trackside(&["run", "out/drive.toml", "--set", share, "--out", "run"]).expect(0);
        let report: Value =
            serde_json::from_str(&std::fs::read_to_string(lab.path("run/report.json")).expect("a file"))
                .expect("JSON");
        let driven = report["laps"][1]["duration"].as_f64().expect("a second lap");
        assert!((0.9 * driven / least - 1.0).abs() < 0.01, "{driven} {least}");
        // The recording is laid beside the lap: the same time, and every corner loses some of it.
        let beside = ["lap", "car.toml", &track, "--set", "body.m=1300 kg", "--log", "run", "--out", "out"];
        let ended = lab.trackside(&beside).expect(0);
        assert!(ended.stdout.contains("lap 2 of 2 in run.mcap, +3."), "{}", ended.stdout);
        let found = numbers(&lab)["driven"].clone();
        let logged = found["lap_time"].as_f64().expect("a time");
        assert!((logged - driven).abs() < 2e-3, "{logged} {driven}");
        let lost = found["time_lost_by_corner"].as_array().expect("corners");
        let sum: f64 = lost.iter().filter_map(Value::as_f64).sum();
        assert!((sum - (logged - least)).abs() < 1e-9 && lost.len() == 2, "{lost:?}");
        let page = std::fs::read_to_string(lab.path("out/lap.html")).expect("a page");
        assert!(page.contains("The fastest of 2 laps in run.mcap") && !page.contains("NaN"));
    }
}

fn the_fastest_lap_drives_as_a_ghost_in_the_replay() {
    let python = python();
    let lab = Lab::new();
    // A car that goes along the line at 20 m/s, for a lap and a half.
    let mut drive = "t,X,Y,psi\n".to_owned();
    let survey = std::fs::read_to_string(track("oval.csv")).expect("a track");
    let line = TrackLine::from_table_text(&survey).expect("a line");
    for k in 0..180 {
        let t = 0.5 * f64::from(k);
        let point = line.point_at(line.wrap_station(20.0 * t));
        drive += &format!("{t},{:?},{:?},{:?}\n", point.point[0], point.point[1], point.psi);
    }
    lab.write("drive.csv", drive);
    lab.write("car.toml", car(""));
    lab.write(
        "ghost.toml",
        format!(
            "[time]\nstep = 0.5\nstop = 89.0\n[[table]]\nname = \"log\"\npath = \"drive.csv\"\ntime = \"t\"\n\
             [table.columns]\nX = {{ column = \"X\", unit = \"m\" }}\nY = {{ column = \"Y\", unit = \"m\" }}\n\
             psi = {{ column = \"psi\", unit = \"rad\" }}\n\
             [view]\npose = {{ x = \"log.X\", y = \"log.Y\", heading = \"log.psi\" }}\n\
             [[analysis]]\nname = \"limit\"\ncrate = \"identify\"\nparameters = \"car.toml\"\n\
             signals = {{ x = \"log.X\", y = \"log.Y\" }}\nfiles = {{ track = {:?} }}\n\
             [analysis.config]\ntask = \"fastest_lap\"\nnodes = 120\n",
            track("oval.csv")
        ),
    );
    lab.trackside(&["run", "ghost.toml", "--out", "out", "--rerun", "save"]).expect(0);
    let entities = |words: &[&str]| {
        let mut rerun = python.rerun();
        rerun.args(words).arg(lab.path("out/run.rrd"));
        Ended::of(rerun.output().expect("it starts")).expect(0).stdout
    };
    let found = entities(&["rrd", "stats"]);
    for entity in ["/world/versus/car/body", "/world/versus/path/line", "/signals/limit/ghost/psi"] {
        assert!(found.contains(entity), "no {entity} in {found}");
    }
}

fn the_fastest_setup_is_faster_by_an_interval() {
    let lab = Lab::new();
    lab.write("car.toml", car("track_f = 1.5\ntrack_r = 1.5"));
    let track = track("oval.csv");
    let options =
        ["--nodes", "120", "--setup", "brake.front_share=0.5..0.8", "--setup", "body.h=400 mm..0.5"];
    let draws = ["--vary", "tire_f.D=1.08..1.12", "--samples", "4", "--out", "out"];
    let ended = lab.trackside(&[&["lap", "car.toml", &track], &options[..], &draws].concat()).expect(0);
    assert!(ended.stdout.contains("with the fastest set-up, 0."), "{}", ended.stdout);
    let setup = numbers(&lab)["setup"].clone();
    let gain = setup["seconds_faster"].as_f64().expect("a gain");
    let interval = [0, 1].map(|end| setup["seconds_faster_95_percent"][end].as_f64().expect("an end"));
    assert!(0.0 < interval[0] && interval[0] < gain && gain < interval[1], "{setup}");
    assert_eq!(setup["parameters"][1]["value"], 0.4, "a low centre of gravity loses no grip");
    // The set-up as a file gives the lap time that was told.
    let told = setup["lap_time"].as_f64().expect("a time");
    let brake = format!("brake.front_share={}", setup["parameters"][0]["value"]);
    let again =
        ["lap", "car.toml", &track, "--nodes", "120", "--set", &brake, "--set", "body.h=0.4", "--out", "out"];
    lab.trackside(&again).expect(0);
    let found = numbers(&lab)["lap_time"].as_f64().expect("a time");
    assert!((found - told).abs() < 1e-4, "{found} {told}");
    assert!(
        lab.has("out/set.toml") && !lab.has("out/setup.toml"),
        "a set-up of an earlier lap is none of this one"
    );
}

/// Rows of time, latitude and longitude of a drive round the oval at 20 m/s, near Melbourne.
fn drive_in_degrees(way: std::ops::Range<u32>) -> String {
    let text = std::fs::read_to_string(track("oval.csv")).expect("a file");
    let line = TrackLine::from_table_text(&text).expect("a line");
    let row = |i: u32| {
        let [x, y] = line.point_at((2.0 * f64::from(i)) % line.length()).point;
        // Lengths of a degree at 37.85 degrees of latitude, by WGS 84.
        let (latitude, longitude) = (-37.85 + y / 110_991.0, 144.97 + x / 88_001.0);
        format!("{:.1},{latitude:.8},{longitude:.8}\n", 0.1 * f64::from(i))
    };
    "Time [s],GPS Latitude,GPS Longitude\n".to_owned() + &way.map(row).collect::<String>()
}

fn a_log_in_degrees_becomes_a_track_beside_whose_fastest_lap_it_lies() {
    let lab = Lab::new();
    lab.write("session.csv", drive_in_degrees(100..2000));
    let ended = lab.trackside(&["track", "session.csv", "--half-width", "5", "--out", "track.csv"]).expect(0);
    for words in ["0:59.", "lap 2 from t = ", "closed, the mean of 3 laps", "track.csv"] {
        assert!(ended.stdout.contains(words), "{words} in {}", ended.stdout);
    }
    assert!(!ended.stderr.contains("note"), "{}", ended.stderr);
    let rows = (0..1000).map(|i| f64::from(i) / 80.0);
    let rows = rows.map(|a| format!("{:.0},{},{}\n", 8e4 * a, 200.0 * a.cos(), 150.0 * a.sin()));
    lab.write("milliseconds.csv", "t,x,y\n".to_owned() + &rows.collect::<String>());
    let ended = lab.trackside(&["track", "milliseconds.csv", "--out", "slow.csv"]).expect(0);
    assert!(ended.stderr.contains("such as milliseconds?"), "{}", ended.stderr);
    let table = std::fs::read_to_string(lab.path("track.csv")).expect("a table");
    assert!(table.starts_with("# closed\n# origin -37.8"), "{table}");
    lab.write("car.toml", car(""));
    let beside = ["lap", "car.toml", "track.csv", "--nodes", "150", "--log", "session.csv", "--out", "out"];
    lab.trackside(&beside).expect(0);
    let found = numbers(&lab);
    let logged = found["driven"]["lap_time"].as_f64().expect("a time");
    let way = found["length"].as_f64().expect("a length");
    assert!((logged - 59.27).abs() < 0.1 && (way - 1185.0).abs() < 3.0, "{logged} {way}");
    // The line of the lap is a track with the same origin.
    let again = ["lap", "car.toml", "out/lap.csv", "--nodes", "150", "--on-line", "--log", "session.csv"];
    lab.trackside(&[&again[..], &["--out", "again"]].concat()).expect(0);
    // Without the origin, nobody knows where the degrees are.
    lab.write("bare.csv", table.replacen("# origin", "# somewhere", 1));
    lab.trackside(&["lap", "car.toml", "bare.csv", "--log", "session.csv"]).expect(2).says(&[
        "session.csv: the positions are in degrees",
        "bare.csv",
        "# origin LATITUDE LONGITUDE",
    ]);
}

fn a_vbox_of_others_becomes_an_open_track() {
    let lab = Lab::new();
    let log = logs_of_others().join("vbo/vbox_hd2.vbo");
    let log = log.display().to_string();
    let ended = lab.trackside(&["track", &log, "--out", "track.csv"]).expect(0);
    assert!(ended.stdout.contains("open, no place is passed twice"), "{}", ended.stdout);
    assert!(ended.stderr.contains("--half-width"), "{}", ended.stderr);
    lab.write("car.toml", car(""));
    let lap = ["lap", "car.toml", "track.csv", "--half-width", "5", "--start-speed", "60", "--nodes", "300"];
    lab.trackside(&[&lap[..], &["--log", &log, "--out", "out"]].concat()).expect(0);
    let driven = numbers(&lab)["driven"]["lap_time"].as_f64().expect("a time");
    // 2,914 rows at 25 Hz.
    assert!((driven - 116.4).abs() < 0.2, "{driven}");
}

/// Doppler headings and yaw rates do not know the positions.
fn tracks_of_others_bend_as_their_cars_turned() {
    let lab = Lab::new();
    let vbox = logs_of_others().join("vbo/vbox_hd2.vbo");
    let rows = read_columns(&vbox, None, ["lat", "long", "velocity", "heading"]);
    // Over ten rows; the heading [deg] counts clockwise, the speed is in km/h.
    let curvature = |i: usize| {
        let [before, after] = [&rows[i - 5], &rows[i + 5]];
        let turn = (before.values[3] - after.values[3]).to_radians().sin().asin();
        turn / (after.t - before.t) / (rows[i].values[2] / 3.6)
    };
    let difference = curvature_difference(&lab, &vbox, &[], &rows, curvature);
    assert!(difference < 1e-3, "{difference}");

    let race = logs_of_others().join("../av21_putnam_park.csv");
    let rows = read_columns(&race, Some("time(s)"), ["x(m)", "y(m)", "vx(m/s)", "omega(rad/s)"]);
    let columns = ["--position", "x(m),y(m)", "--time", "time(s)"];
    let curvature = |i: usize| rows[i].values[3] / rows[i].values[2];
    let difference = curvature_difference(&lab, &race, &columns, &rows, curvature);
    assert!(difference < 1e-3, "{difference}");
}

/// A time and the values of four columns.
struct LogRow {
    t: f64,
    values: [f64; 4],
}

fn read_columns(path: &Path, time: Option<&str>, columns: [&str; 4]) -> Vec<LogRow> {
    let column = |name: &str| ColumnRequest {
        name: name.to_owned(),
        column: name.to_owned(),
        ..ColumnRequest::default()
    };
    let columns = columns.map(column).to_vec();
    let request = ReadRequest { time: time.map(str::to_owned), columns, ..ReadRequest::default() };
    let mut table = TimeSeriesTable::read(path, &request).expect("a log");
    let times = table.clock_times().swap_remove(table.column_clock(0));
    times.into_iter().map(|t| LogRow { t, values: [0, 1, 2, 3].map(|i| table.value_at(i, t)) }).collect()
}

/// The median difference between the curvature of the track of a log and the one that its car had where it drove faster than 10 m/s or
/// km/h [1/m].
fn curvature_difference(
    lab: &Lab,
    log: &Path,
    options: &[&str],
    rows: &[LogRow],
    curvature: impl Fn(usize) -> f64,
) -> f64 {
    let log = log.display().to_string();
    lab.trackside(&[&["track", &log, "--out", "track.csv"], options].concat()).expect(0);
    let text = std::fs::read_to_string(lab.path("track.csv")).expect("a table");
    let survey = TrackSurvey::from_table_text(&text).expect("a table");
    let line = TrackLine::from_survey(&survey).expect("a line");
    let difference = |i: usize| {
        let [a, b, speed, _] = rows[i].values;
        let position = survey.plane.map_or([a, b], |plane| plane.position(a, b));
        let station = line.locate_point(position, None);
        let is_driven = speed > 10.0 && station.lateral.abs() < 3.0;
        is_driven.then(|| (station.kappa - curvature(i)).abs())
    };
    let mut differences: Vec<f64> = (5..rows.len() - 5).step_by(5).filter_map(difference).collect();
    differences.sort_unstable_by(f64::total_cmp);
    differences[differences.len() / 2]
}

fn what_is_wrong_with_the_log_of_a_track_is_told() {
    let lab = Lab::new();
    lab.write("session.csv", drive_in_degrees(100..700));
    lab.write("standing.csv", "t,x,y\n0,1,1\n1,1,1\n2,1,1\n");
    lab.write("other.csv", "t,east,north\n0,1,1\n1,30,1\n2,60,1\n");
    for (arguments, words) in [
        (&["standing.csv"][..], &["standing.csv: expected the positions of a drive", "over 0 m"][..]),
        (&["other.csv"], &["expected columns plant.X and plant.Y", "--position LATITUDE,LONGITUDE"]),
        (&["other.csv", "--position", "east"], &["--position east: expected two columns"]),
        (&["other.csv", "--position", "east,up"], &["up"]),
        (&["session.csv", "--start", "1"], &["--start 1: expected two numbers"]),
        (&["session.csv", "--start", "-30,144"], &["expected a start beside the path of the log"]),
        (&["session.csv", "--noise", "1e9"], &["--noise: expected at most 10 m"]),
        (&["session.csv", "--noise=-1"], &["--noise: expected a number of at least 0, found -1"]),
        (&["session.csv", "--out", "session.csv"], &["session.csv would be overwritten", "--out FILE"]),
        (&["nowhere.csv"], &["nowhere.csv"]),
    ] {
        lab.trackside(&[&["track"], arguments].concat()).expect(2).says(words);
    }
}

fn what_is_wrong_is_told_with_its_place() {
    let lab = Lab::new();
    let oval = track("oval.csv");
    let good = car("");
    for (old, new, words) in [
        (
            "m = 1250.0",
            "mm = 1250.0",
            &["car.toml:2", "`body.mm` is no parameter of a car", "did you mean `body.m`?"][..],
        ),
        ("m = 1250.0", "m = \"1250 N\"", &["car.toml:2", "expected a value in [kg], found one in [N]"]),
        ("m = 1250.0", "m = -1.0", &["car.toml:2", "expected a number above 0, found -1"]),
        ("l_f = 1.18\n", "", &["the car has no body.l_f", "--set body.l_f="]),
        ("power_max = 190e3", "power_max = 190e3 W", &["car.toml"]),
    ] {
        lab.write("car.toml", good.replacen(old, new, 1));
        lab.trackside(&["lap", "car.toml", &oval, "--out", "out"]).expect(2).says(words);
    }
    lab.write("car.toml", &good);
    lab.write("bare.csv", "x,y\n0,0\n50,0\n100,50\n50,100\n0,100\n-50,50\n");
    lab.write("back.csv", "t,x,y\n0,100,0\n1,40,0\n2,10,0\n");
    std::fs::create_dir(lab.path("same")).expect("a folder");
    std::fs::copy(track("oval.csv"), lab.path("same/lap.csv")).expect("a file");
    lab.write("far.csv", "t,x,y\n0,600,0\n1,650,0\n2,700,0\n");
    lab.write("open.csv", "x_m,y_m,left_m,right_m\n0,0,5,5\n100,0,5,5\n200,0,5,5\n300,0,5,5\n");
    for (arguments, words) in [
        (&["bare.csv"][..], &["bare.csv: expected the ways from the line to its edges", "--half-width"][..]),
        (&[oval.as_str(), "--set", "body.M=3"], &["--set body.M=3", "no parameter `body.M`"]),
        (&[oval.as_str(), "--set", "tire_f.D=0.001"], &["a friction of at least 0.02", "at the front axle"]),
        (&[oval.as_str(), "--set", "body.m=heavy"], &["--set body.m=heavy", "expected a number"]),
        (&[oval.as_str(), "--vary", "body.m=1300..1200"], &["expected the lower number first"]),
        (&[oval.as_str(), "--samples", "5"], &["expected --draws or --vary with it"]),
        (&[oval.as_str(), "--seed", "5"], &["--vary <KEY=LOW..HIGH>"]),
        (
            &[oval.as_str(), "--transients"],
            &["the car has no body.I_xx, body.I_yy, body.track_f", "ride.stiffness_f", "roll.damping_r"],
        ),
        (&[oval.as_str(), "--vary", "roll.damping_f=1..2"], &["its body swings only with transients"]),
        (&[oval.as_str(), "--vary", "drive.power_max=-3..190e3"], &["expected a number above 0, found -3"]),
        (&[oval.as_str(), "--margin", "9"], &["the road is", "tell a smaller --margin"]),
        (&[oval.as_str(), "--start-speed", "20"], &["oval.csv: a closed line has no start"]),
        (&["open.csv", "--start-speed", "0"], &["expected a start speed of at least 3 m/s, found 0 m/s"]),
        (
            &[oval.as_str(), "--setup", "body.m=3..3"],
            &["--setup body.m=3..3: expected two different numbers"],
        ),
        (&[oval.as_str(), "--setup", "tire_f.LKY=0.9..1"], &["`tire_f.LKY` changes nothing in this car"]),
        (
            &[oval.as_str(), "--log", "back.csv"],
            &["back.csv: expected a lap", "90 m against the direction of the track"],
        ),
        (&[oval.as_str(), "--out", "far.csv"], &["far.csv: expected a folder, found a file", "--out DIR"]),
        (&["same/lap.csv", "--out", "same"], &["same/lap.csv would be overwritten by the results"]),
        (&["nowhere.csv"], &["the track nowhere.csv cannot be read"]),
        (
            &[oval.as_str(), "--log", "open.csv"],
            &["open.csv: expected columns plant.X and plant.Y", "--log-position"],
        ),
        (
            &[oval.as_str(), "--log", "open.csv", "--log-position", "x_m,y_m"],
            &["expected a time", "--log-time"],
        ),
        (&[oval.as_str(), "--log", "far.csv"], &["far.csv: expected positions on the track", "(650 m, 0 m)"]),
    ] {
        let out: &[&str] = if arguments.contains(&"--out") { &[] } else { &["--out", "out"] };
        let all = [&["lap", "car.toml"], arguments, out].concat();
        lab.trackside(&all).expect(2).says(words);
    }
    assert!(!lab.has("out"), "nothing is written for a lap that is none");
}
