//! Messages of ROS: their times, texts, units, transforms, and what is left out.

use std::collections::BTreeMap;

use super::super::super::{ColumnType, ReadRequest, TimeSeriesTable};
use super::{File, MS, Scrap, put, recording};
use crate::survey::SurveyExtent;
use crate::table::{read_titles, survey_file};

const TRANSFORMS: &str = "geometry_msgs/TransformStamped[] transforms\n\
    ========================================\nMSG: geometry_msgs/TransformStamped\n\
    std_msgs/Header header\nstring child_frame_id\nfloat64 x\n";

fn channel(file: &mut File, topic: &str, kind: &str, definition: &str) -> u16 {
    let schema = file.add_schema(kind, "ros2msg", definition.as_bytes()).expect("a schema");
    file.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("a channel")
}

/// A message in CDR of parts, each with its alignment.
fn cdr(parts: &[(usize, Vec<u8>)]) -> Vec<u8> {
    let mut data = vec![0, 1, 0, 0];
    for (align, bytes) in parts {
        data.resize(4 + (data.len() - 4).next_multiple_of(*align), 0);
        data.extend(bytes);
    }
    data
}

fn count(count: u32) -> (usize, Vec<u8>) {
    (4, count.to_le_bytes().to_vec())
}

fn double(value: f64) -> (usize, Vec<u8>) {
    (8, value.to_le_bytes().to_vec())
}

fn text(text: &str) -> [(usize, Vec<u8>); 2] {
    [count(text.len() as u32 + 1), (1, format!("{text}\0").into_bytes())]
}

/// A stamp at this time after second 1000 [ms], in a frame.
fn header(ms: u64) -> Vec<(usize, Vec<u8>)> {
    let [a, b] = text("base");
    vec![count(1000 + (ms / 1000) as u32), count((ms % 1000 * MS) as u32), a, b]
}

const SECOND: u64 = 1000 * MS;
const SPEED: &str =
    "std_msgs/Header header\nfloat32 longitudinal_velocity\nfloat32 lateral_velocity\nfloat32 heading_rate\n";

/// Speeds that were measured every 10 ms and recorded up to 40 ms later, three at a time; others whose clock is another one; a counter.
fn drive(name: &str) -> Scrap {
    recording(name, None, |file| {
        let speed = channel(file, "/speed", "autoware_vehicle_msgs/msg/VelocityReport", SPEED);
        let far = channel(file, "/far", "autoware_vehicle_msgs/msg/VelocityReport", SPEED);
        let number = channel(file, "/count", "demo/msg/Count", "uint64 data\nstring state\nfloat64[] list\n");
        for k in 0..12u64 {
            let single = |value: f32| (4, value.to_le_bytes().to_vec());
            let body = |ms| cdr(&[header(ms), vec![single(k as f32), single(0.5), single(-0.25)]].concat());
            let log = 1000 * SECOND + (k / 3 * 30 + 30) * MS;
            put(file, speed, [log + 1000 * k, log], &body(10 * k));
            put(file, far, [log + 1000 * k, log], &body(3_600_000 + 10 * k));
            let [a, b] = text(if k < 6 { "dry" } else { "wet" });
            let list = (0..k % 3).map(|_| double(1.0));
            let counted = [(8, (u64::MAX - k).to_le_bytes().to_vec()), a, b, count((k % 3) as u32)];
            let counted: Vec<_> = counted.into_iter().chain(list).collect();
            put(file, number, [log + 1000 * k, log], &cdr(&counted));
        }
    })
}

#[test]
fn messages_have_the_times_at_which_they_were_measured() {
    let scrap = drive("measured");
    let speed = "/speed.longitudinal_velocity";
    let table = scrap.read(None, &[speed]).expect("it is sound");
    let rounded = |table: &TimeSeriesTable| -> Vec<i64> {
        table.clock_times()[0].iter().map(|time| (time * 1e3).round() as i64).collect()
    };
    assert_eq!(rounded(&table), (0..12).map(|k| 10 * k).collect::<Vec<_>>());
    assert_eq!((table.column_unit(0), table.warnings()), (Some("m/s"), &[][..]));
    let recorded = scrap.read(Some("log_time"), &[speed]).expect("it is sound");
    assert_eq!(rounded(&recorded)[..4], [0, 0, 0, 30]);
    let twice = scrap.read(Some("publish_time"), &[speed]).expect_err("some are the same");
    assert!(twice.to_string().contains("messages 1 and 2 of `/speed`"), "{twice}");
    // A clock that is an hour away is not that of the others.
    let far = scrap.read(None, &[speed, "/far.heading_rate"]).expect("it is sound");
    let told = far.warnings().join("\n");
    assert!(told.contains("the times of `/far` are log_time, not header.stamp: they are up to"), "{told}");
    let all = scrap.read(Some("header.stamp"), &["/far.heading_rate"]).expect("it is asked for");
    assert_eq!(rounded(&all), (0..12).map(|k| 10 * k).collect::<Vec<_>>());
    let none = scrap.read(Some("header.stamp"), &["/count.data"]).expect_err("it has none");
    assert!(none.to_string().contains("not every message of `/count`"), "{none}");
}

#[test]
fn texts_and_integers_are_read_as_they_are() {
    let scrap = drive("texts");
    let mut request =
        ReadRequest { time: None, ..ReadRequest::from_names("", &["/count.data", "/count.state"]) };
    request.columns[0].column_type = ColumnType::Integer;
    request.columns[1].column_type = ColumnType::Text;
    let mut table = TimeSeriesTable::read(&scrap.0, &request).expect("it is sound");
    let last = table.clock_times()[0][11];
    assert_eq!(table.integer_at(0, 0.0), Some(u64::MAX.into()));
    assert_eq!(table.integer_at(0, last), Some(i128::from(u64::MAX) - 11));
    assert_eq!(
        (table.text_at(1, 0.0).map(str::to_owned), table.text_at(1, last)),
        (Some("dry".into()), Some("wet"))
    );
    assert!(scrap.error("/count.state").contains("`/count.state` of "));
    assert!(scrap.error("/count.state").contains("is a string: expected a number"));
    assert!(scrap.error("/count.list.1").contains("no column `/count.list.1`"));
    assert!(scrap.error("/speed.lateral_velocty").contains("did you mean `/speed.lateral_velocity`?"));
}

#[test]
fn a_survey_has_the_lists_that_do_not_change() {
    let scrap = drive("survey");
    let survey = survey_file(&scrap.0, SurveyExtent::Whole).expect("it is sound");
    let names: Vec<&str> = survey.channels.iter().map(|it| it.name.as_str()).collect();
    assert!(names.contains(&"/count.state") && names.contains(&"/speed.heading_rate"), "{names:?}");
    assert!(!names.iter().any(|name| name.starts_with("/count.list")), "{names:?}");
    let left_out = survey.left_out.join("\n");
    for says in [
        "`list` of `/count`: a list whose length changes, such as from 0 to 1",
        "the times header.stamp of `/far`: they are up to",
    ] {
        assert!(left_out.contains(says), "{says}: {left_out}");
    }
    let rate = survey.channels.iter().find(|it| it.name == "/speed.heading_rate").expect("it is there");
    assert_eq!((rate.unit.as_deref(), rate.tally.median_step()), (Some("rad/s"), Some(0.01)));
    assert!(survey.time.starts_with("`header.stamp` where a message has one (0.0"), "{}", survey.time);
    let titles = read_titles(&scrap.0).expect("it is sound");
    assert!(
        titles.columns.iter().any(|it| it.name == "/far.heading_rate" && it.unit.as_deref() == Some("rad/s"))
    );
}

#[test]
fn transforms_are_told_apart_by_their_frames() {
    let scrap = recording("transforms", None, |file| {
        let topic = channel(file, "/tf", "tf2_msgs/msg/TFMessage", TRANSFORMS);
        for k in 0..6u64 {
            // The order changes, and one of them comes in every other message.
            let frames: &[&str] = if k % 2 == 0 { &["odom", "base.link"] } else { &["base.link"] };
            let mut parts = vec![count(frames.len() as u32)];
            for frame in frames {
                parts.extend(header(10 * k));
                parts.extend(text(frame));
                parts.push(double(k as f64 + if *frame == "odom" { 100.0 } else { 0.0 }));
            }
            put(file, topic, [1000 * SECOND + 10 * k * MS; 2], &cdr(&parts));
        }
    });
    let table = scrap.read(None, &["/tf.transforms.odom.x", "/tf.transforms.base.link.x"]);
    let table = table.expect("both are there");
    assert_eq!(table.column_values(0), [100.0, 102.0, 104.0]);
    assert_eq!(table.column_values(1), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    let gone = scrap.error("/tf.transforms.map.x");
    assert!(gone.contains("it has /tf.transforms.odom.header.stamp.sec"), "{gone}");
    let survey = survey_file(&scrap.0, SurveyExtent::Whole).expect("it is sound");
    let count = |name: &str| survey.channels.iter().find(|it| it.name == name).map(|it| it.tally.values);
    assert_eq!((count("/tf.transforms.odom.x"), count("/tf.transforms.base.link.x")), (Some(3), Some(6)));
}
