//! Bags of ROS 2, read as the readers of others read them: mcap-ros2-support and rosbags.

use std::path::{Path, PathBuf};

use recording::survey::SurveyExtent;
use recording::table::{ColumnType, ReadRequest, TimeSeriesTable, read_titles, survey_file};
use serde_json::Value;

use super::harness::{Lab, ROOT};
use super::python::python;
use super::requirement::logs_of_others;

tests! {
    bags_have_the_values_that_other_readers_find: Python,
    bags_of_others_have_the_values_that_other_readers_find: Python + Logs,
    bags_are_played_back_and_inspected: Python,
    bags_that_cannot_be_read_are_refused_with_the_cure,
}

/// What the judges found in a column.
struct Judged<'j> {
    name: &'j str,
    reading: ColumnType,
    times: Vec<i128>,
    values: Vec<&'j str>,
}

fn judged(columns: &Value) -> Vec<Judged<'_>> {
    let columns = columns.as_object().expect("columns").iter();
    columns
        .map(|(name, column)| {
            let all = |key: &str| column[key].as_array().expect("a list").iter();
            let first = all("values").next().and_then(Value::as_object).expect("a value");
            let (kind, _) = first.iter().next().expect("a kind");
            let reading = match kind.as_str() {
                "text" => ColumnType::Text,
                "integer" => ColumnType::Integer,
                _ => ColumnType::Number,
            };
            let text = |it: &Value| it.as_str().expect("a text").parse().expect("a time");
            let values = all("values").map(|it| it[kind].as_str().expect("a text")).collect();
            Judged { name, reading, times: all("times").map(text).collect(), values }
        })
        .collect()
}

/// Reads all columns that the judge found, and insists on each value, each time, and no column besides.
fn compare(bag: &Path, judge: &str, columns: &Value) {
    let columns = judged(columns);
    let at = bag.display();
    assert!(!columns.is_empty(), "{judge} found nothing in {at}");
    let names: Vec<&str> = columns.iter().map(|it| it.name).collect();
    let mut wanted = ReadRequest::from_names("log_time", &names);
    for (wanted, judged) in wanted.columns.iter_mut().zip(&columns) {
        wanted.column_type = judged.reading;
        wanted.gaps = recording::table::GapRule::Hold;
    }
    let rises = |it: &Judged| it.times.windows(2).all(|pair| pair[0] < pair[1]);
    if !columns.iter().all(rises) {
        // A bag that was made for tests of rosbag2 has two messages of a topic at one time.
        let error = TimeSeriesTable::read(bag, &wanted).expect_err("times repeat").to_string();
        assert!(error.contains("have the same log_time"), "{at}: {error}");
        return;
    }
    let mut table = TimeSeriesTable::read(bag, &wanted).unwrap_or_else(|error| panic!("{at}: {error}"));
    let zero = columns.iter().flat_map(|it| &it.times).min().copied().unwrap_or(0);
    for (column, judged) in columns.iter().enumerate() {
        let times = table.clock_times()[table.column_clock(column)].clone();
        let right: Vec<f64> = judged.times.iter().map(|time| (time - zero) as f64 / 1e9).collect();
        let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9;
        assert!(times.len() == right.len() && times.iter().zip(&right).all(near), "{at} {}", judged.name);
        for (row, value) in judged.values.iter().enumerate() {
            let found = match judged.reading {
                ColumnType::Text => table.text_at(column, times[row]).expect("a text").to_owned(),
                ColumnType::Integer => table.integer_at(column, times[row]).expect("an integer").to_string(),
                ColumnType::Number => {
                    let right = hex(value);
                    let found = table.column_values(column)[row];
                    let same = found == right || found.is_nan() && right.is_nan();
                    if same { (*value).to_owned() } else { found.to_string() }
                }
            };
            assert_eq!(found, *value, "{at} {} row {row}, by {judge}", judged.name);
        }
    }
    let survey = survey_file(bag, SurveyExtent::Whole).unwrap_or_else(|error| panic!("{at}: {error}"));
    assert!(survey.warnings.is_empty(), "{at}: {:?}", survey.warnings);
    let mut found: Vec<&str> = survey.channels.iter().map(|it| it.name.as_str()).collect();
    let mut right = names.clone();
    found.sort_unstable();
    right.sort_unstable();
    assert_eq!(found, right, "{at}, by {judge}");
    assert!(read_titles(bag).is_ok_and(|titles| titles.has_time), "{at}");
}

/// A number as Python writes it in hexadecimal digits, `-0x1.8p+3`.
fn hex(text: &str) -> f64 {
    let (sign, digits) = text.strip_prefix('-').map_or((1.0, text), |rest| (-1.0, rest));
    let Some(digits) = digits.strip_prefix("0x") else { return text.parse().expect("a number") };
    let (mantissa, power) = digits.split_once('p').expect("a power");
    let (whole, broken) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let bits = u64::from_str_radix(&format!("{whole}{broken}"), 16).expect("digits");
    let power: i32 = power.parse::<i32>().expect("a power") - 4 * broken.len() as i32;
    // Two steps, so that the smallest numbers keep their digits.
    sign * bits as f64 * 2f64.powi(power / 2) * 2f64.powi(power - power / 2)
}

fn compare_all(lab: &Lab, others: &[PathBuf]) {
    let folder = lab.path("made");
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut arguments = vec![folder.clone()];
    arguments.extend_from_slice(others);
    python().run("ros_bags.py", &arguments);
    let expected = std::fs::read(folder.join("expected.json")).expect("it is there");
    let expected: Value = serde_json::from_slice(&expected).expect("it is JSON");
    for bag in expected.as_array().expect("a list") {
        let text = |key: &str| bag[key].as_str().expect("a text");
        compare(Path::new(text("bag")), text("judge"), &bag["columns"]);
    }
}

fn bags_have_the_values_that_other_readers_find() {
    compare_all(&Lab::new(), &[]);
}

fn bags_of_others_have_the_values_that_other_readers_find() {
    let shared = Path::new(ROOT).join("../shared");
    let mut bags = vec![shared.join("cases/logs/mcap_ros2/drive.mcap")];
    for file in std::fs::read_dir(logs_of_others().join("mcap")).expect("a folder") {
        bags.push(file.expect("a file").path());
    }
    compare_all(&Lab::new(), &bags);
}

/// A scenario that plays a drive back.
fn drive(path: &str, more: &str) -> String {
    format!(
        "[time]\nstep = 0.01\nstop = 1.0\n[[table]]\nname = \"log\"\npath = \"{path}\"\n{more}\
         columns = {{ v_x = {{ column = \"/odom.twist.twist.linear.x\" }}, r = {{ column = \"/imu/data.angular_velocity.z\", unit = \"rad/s\" }}, \
         delta = {{ column = \"/steer.steering_angle\" }} }}\n"
    )
}

fn bags_are_played_back_and_inspected() {
    let lab = Lab::new();
    let folder = lab.path("made");
    std::fs::create_dir_all(&folder).expect("a folder");
    python().run("ros_bags.py", &[folder]);
    let inspected = lab.trackside(&["inspect", "made/drive"]).expect(0);
    for says in [
        "format             bag of ROS 2: 2 of SQLite (rosbag2)",
        "time               `header.stamp` where a message has one (0.0010 to 0.0030 s before `log_time`), or else `log_time`",
        "/imu/data.angular_velocity.z",
        "[rad/s]",
        "101 100 Hz",
    ] {
        assert!(inspected.stdout.contains(says), "{says}: {}", inspected.stdout);
    }
    // The messages came up to 3 ms late, and their stamps say when they were measured.
    lab.write("case.toml", drive("made/drive", "origin = 1700000000.123456789\n"));
    lab.trackside(&["run", "case.toml", "--out", "out", "--csv", "--rerun", "off"]).expect(0);
    let numbers = |name: &str| -> Vec<f64> {
        let text = lab.read("out/run.csv");
        let mut lines = text.lines();
        let titles = lines.next().expect("titles").split(',');
        let place = titles.clone().position(|title| title.split(' ').next() == Some(name)).expect(name);
        lines.map(|line| line.split(',').nth(place).expect("a cell").parse().expect("a number")).collect()
    };
    let (v_x, r, delta) = (numbers("log.v_x"), numbers("log.r"), numbers("log.delta"));
    assert_eq!(v_x.len(), 101);
    for row in 0..=100 {
        let k = row as f64;
        let near = |found: f64, right: f64| (found - right).abs() < 1e-6;
        assert!(near(v_x[row], 20.0 + k / 100.0), "{row}: {}", v_x[row]);
        assert!(near(r[row], k / 1000.0), "{row}: {}", r[row]);
        assert!(near(delta[row], k / 1024.0), "{row}: {}", delta[row]);
    }
    let wrong = drive("made/drive", "").replace("\"rad/s\"", "\"deg/s\"");
    lab.write("case.toml", wrong);
    let ended = lab.trackside(&["run", "case.toml", "--out", "bad"]).expect(2);
    ended.says(&["was recorded in [rad/s], and is said to be in [deg/s]"]);
    // One of the two files is lost.
    let files = std::fs::read_dir(lab.path("made/drive")).expect("a folder");
    let lost = files.map(|it| it.expect("a file").path()).find(|it| it.to_string_lossy().contains("half_1"));
    std::fs::remove_file(lost.expect("two files")).expect("it can be removed");
    let inspected = lab.trackside(&["inspect", "made/drive"]).expect(0);
    assert!(inspected.stdout.contains("which metadata.yaml lists, is missing"), "{}", inspected.stdout);
}

fn bags_that_cannot_be_read_are_refused_with_the_cure() {
    let lab = Lab::new();
    lab.write("old.bag", "#ROSBAG V2.0\nxxx");
    lab.write("torn.db3", [&b"SQLite format 3\0"[..], &[7; 200]].concat());
    std::fs::create_dir_all(lab.path("empty")).expect("a folder");
    for (file, says) in [
        ("old.bag", "it is a bag of ROS 1, which is not read: `pip install rosbags`, then `rosbags-convert"),
        ("torn.db3", ".recover | sqlite3 NEW.db3` saves what can be read of it"),
        (
            "empty",
            "expected the folder of a bag with metadata.yaml, or a file, found a folder without files of bags",
        ),
    ] {
        lab.trackside(&["inspect", file]).expect(2).says(&[file, says]);
        lab.write("case.toml", drive(file, ""));
        lab.trackside(&["run", "case.toml"]).expect(2).says(&[says, "case.toml:6:"]);
    }
}
