//! Recordings of other writers, and damaged ones.

mod protobuf;
mod ros;

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::path::PathBuf;

use ::mcap::records::MessageHeader;
use ::mcap::{Compression, WriteOptions, Writer};

use super::super::{CsvDialect, GapRule, ReadRequest, TableError, TimeSeriesTable, UnitRow};

/// A file that is removed again.
struct Scrap(PathBuf);

impl Drop for Scrap {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

impl Scrap {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let file = format!("recording-{name}-{}.dat", std::process::id());
        let path = std::env::temp_dir().join(file);
        std::fs::write(&path, bytes).expect("the temporary folder is writable");
        Scrap(path)
    }

    fn read(&self, time: Option<&str>, columns: &[&str]) -> Result<TimeSeriesTable, TableError> {
        let request = ReadRequest { time: time.map(str::to_owned), ..ReadRequest::from_names("", columns) };
        TimeSeriesTable::read(&self.0, &request)
    }

    fn error(&self, column: &str) -> String {
        self.read(None, &[column]).expect_err(column).to_string()
    }
}

type File = Writer<BufWriter<std::fs::File>>;

fn recording(name: &str, compression: Option<Compression>, write: impl FnOnce(&mut File)) -> Scrap {
    let scrap = Scrap::new(name, &[]);
    let file = std::fs::File::create(&scrap.0).expect("it can be written");
    let options = WriteOptions::new().compression(compression).chunk_size(Some(512));
    let mut writer = options.create(BufWriter::new(file)).expect("it can be written");
    write(&mut writer);
    writer.finish().expect("it can be written");
    scrap
}

fn channel(writer: &mut File, topic: &str, encoding: &str) -> u16 {
    writer.add_channel(0, topic, encoding, &BTreeMap::new()).expect("a channel")
}

fn put(writer: &mut File, channel_id: u16, [log_time, publish_time]: [u64; 2], data: &[u8]) {
    let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time };
    writer.write_to_known_channel(&header, data).expect("it can be written");
}

/// A time of day in 2023 [ns], of which `f64` seconds would lose the last digits.
const EPOCH: u64 = 1_700_000_000_123_456_789;
const MS: u64 = 1_000_000;

#[test]
fn words_about_csv_are_refused() {
    let scrap = recording("dialect", None, |file| {
        let topic = channel(file, "/x", "json");
        put(file, topic, [1; 2], br#"{"x":1}"#);
    });
    let dialect = CsvDialect { unit_row: Some(UnitRow::Below(true)), ..CsvDialect::default() };
    let request = ReadRequest { time: None, dialect, ..ReadRequest::from_names("", &["/x.x"]) };
    let error = TimeSeriesTable::read(&scrap.0, &request).expect_err("it is MCAP").to_string();
    assert!(error.contains("is MCAP: `unit_row` is about CSV files"), "{error}");
}

#[test]
fn a_message_without_a_value_is_a_gap_of_its_channel() {
    let scrap = recording("gaps", None, |file| {
        let (x, y) = (channel(file, "/x", "json"), channel(file, "/y", "json"));
        for (k, value) in ["null", "1", "null", "3", "null"].into_iter().enumerate() {
            let stamp = [k as u64 * 1000 * MS; 2];
            put(file, x, stamp, format!("{{\"x\":{value}}}").as_bytes());
            put(file, y, stamp, format!("{{\"y\":{k}}}").as_bytes());
        }
    });
    let refused = scrap.error("/x.x");
    assert!(refused.contains("`/x.x` has no value in 3 rows of "), "{refused}");
    assert!(refused.contains("the first one in message 1 of `/x`: say `gaps"), "{refused}");
    let mut request = ReadRequest { time: None, ..ReadRequest::from_names("", &["/x.x", "/y.y"]) };
    request.columns[0].gaps = GapRule::Interpolate;
    let table = TimeSeriesTable::read(&scrap.0, &request).expect("it has a rule");
    assert_eq!(table.clock_times(), [vec![1.0, 2.0, 3.0], vec![0.0, 1.0, 2.0, 3.0, 4.0]]);
    assert_eq!(table.column_values(0), [1.0, 2.0, 3.0]);
    assert!(table.warnings()[0].contains("from 1 s to 3 s: outside of it `/x.x` has no value"));
}

#[test]
fn channels_keep_their_own_rates_and_times_of_day_keep_their_digits() {
    for compression in [None, Some(Compression::Lz4), Some(Compression::Zstd)] {
        let name = format!("rates-{compression:?}");
        let scrap = recording(&name, compression, |file| {
            let (fast, slow) = (channel(file, "/fast", "json"), channel(file, "/slow", "json"));
            for k in 0..100 {
                let stamp = [EPOCH + k * MS; 2];
                put(file, fast, stamp, format!(r#"{{"a":{{"b.c":[{k},{}]}}}}"#, k * k).as_bytes());
                if k % 20 == 5 {
                    put(file, slow, stamp, format!(r#"{{"v":{k}.5,"on":true}}"#).as_bytes());
                }
            }
        });
        let columns = ["/fast.a.b.c.1", "/slow.v", "/slow.on", "/fast.a.b.c.0"];
        let mut table = scrap.read(None, &columns).expect("it is well-formed");
        assert!(table.warnings().is_empty());
        assert_eq!([0, 1, 2, 3].map(|column| table.column_clock(column)), [0, 1, 1, 0]);
        let expected: Vec<_> = (0..5).map(|k| f64::from(5 + 20 * k) / 1e3).collect();
        assert_eq!(table.clock_times()[1], expected);
        assert_eq!(table.column_values(1), [5.5, 25.5, 45.5, 65.5, 85.5]);
        for k in 0..100_u32 {
            let time = f64::from(k) * 1e-3;
            assert_eq!(table.value_at(0, time), f64::from(k * k), "{k}");
            assert_eq!(table.value_at(3, time), f64::from(k), "{k}");
            let slow = f64::from(k.clamp(5, 85)) + 0.5;
            assert!((table.value_at(1, time) - slow).abs() < 1e-9, "{k}");
            assert_eq!(table.value_at(2, time), 1.0);
        }
        table.set_origin(Some(1_700_000_000.0));
        assert!((table.clock_times()[0][0] - 0.123_456_789).abs() < 1e-6);
    }
}

#[test]
fn messages_are_ordered_by_the_time_that_is_wanted() {
    let scrap = recording("order", None, |file| {
        let topic = channel(file, "/x", "json");
        for (log, publish, x) in [(3, 10, 1), (1, 30, 2), (2, 20, 3), (2, 40, 4)] {
            put(file, topic, [log * MS, publish * MS], format!("{{\"x\":{x}}}").as_bytes());
        }
    });
    let table = scrap.read(Some("publish_time"), &["/x.x"]).expect("the times differ");
    assert_eq!(table.column_values(0), [1.0, 3.0, 2.0, 4.0]);
    assert_eq!(table.clock_times()[0], [0.0, 0.01, 0.02, 0.03]);
    let error = scrap.error("/x.x");
    assert!(error.contains("messages 3 and 4 of `/x`"), "{error}");
    assert!(error.contains("the same log_time 0.002 s") && error.contains("publish_time"), "{error}");
}

#[test]
fn what_is_no_column_is_told() {
    let scrap = recording("wrong", None, |file| {
        let topics = [("/gps", "json"), ("/lidar", "msgpack"), ("/two", "json"), ("/late", "json")];
        let ids = topics.map(|(topic, encoding)| channel(file, topic, encoding));
        let other = BTreeMap::from([("another".to_owned(), "channel".to_owned())]);
        file.add_channel(0, "/two", "json", &other).expect("a channel");
        channel(file, "/silent", "json");
        put(file, ids[0], [0; 2], br#"{"speed":1,"name":"car","at":{"x":1,"ok":true},"gap":null}"#);
        put(file, ids[1], [0; 2], b"....");
        let late = [r#"{"a":1,"b":1,"c":1,"d":1}"#, r#"{"a":1e999,"b":"x","d":1}"#, "{\"d\":NaN}"];
        for (k, text) in (0..).zip(&late[..2]) {
            put(file, ids[3], [k; 2], text.as_bytes());
        }
        put(file, ids[2], [0; 2], late[2].as_bytes());
    });
    for (column, part) in [
        ("/gps.sped", "did you mean `/gps.speed`?"),
        ("/gps.at", "`/gps.at` of"),
        ("/gps.at", "is an object: expected a number"),
        ("/gps.at.z", "it has /gps.at.ok, /gps.at.x, /gps.speed; did you mean `/gps.at.x`?"),
        ("/gps.name", "is a string"),
        ("/gps.gap", "`/gps.gap` has no value in any row"),
        ("/gp.speed", "did you mean `/gps.speed`?"),
        ("speed", "/lidar (encoding msgpack)"),
        ("/lidar.x", "the encoding `msgpack`"),
        ("/lidar.x", "convert the topic `/lidar`"),
        ("/two.d", "either of two channels"),
        ("/silent.x", "there is no message of `/silent`"),
        ("/late.a", "message 2 of `/late`"),
        ("/late.b", "message 2 of `/late`"),
    ] {
        let error = scrap.error(column);
        assert!(error.contains(part), "{column}: {error}");
    }
    let error = scrap.read(Some("t"), &["/gps.speed"]).expect_err("no such time").to_string();
    assert!(error.contains("`log_time` or `publish_time`, found `t`"), "{error}");
    let gone = recording("gone", None, |file| {
        let topic = channel(file, "/x", "json");
        put(file, topic, [0; 2], br#"{"x":1}"#);
        put(file, topic, [1; 2], br#"{"y":1}"#);
        put(file, topic, [2; 2], br#"{"x":NaN}"#);
    });
    assert!(gone.error("/x.x").contains("message 2 of `/x`"));
    assert!(gone.error("/x.x").contains("it has no `/x.x`"));
    let nan = recording("nan", None, |file| {
        let topic = channel(file, "/x", "json");
        put(file, topic, [2; 2], br#"{"x":NaN}"#);
    });
    assert!(nan.error("/x.x").contains("message 1 of `/x`"));
    assert!(nan.error("/x.x").contains("no JSON"));
}

/// A recording whose chunks hold some ten messages each.
fn ramp(name: &str) -> Scrap {
    recording(name, Some(Compression::Lz4), |file| {
        let topic = channel(file, "/x", "json");
        for k in 0..100 {
            put(file, topic, [k * MS; 2], format!("{{\"x\":{k}}}").as_bytes());
        }
    })
}

#[test]
fn a_recording_that_was_cut_is_read_up_to_its_last_whole_chunk() {
    let whole = std::fs::read(&ramp("whole").0).expect("it has been written");
    let all = Scrap::new("all", &whole).read(None, &["/x.x"]).expect("it is whole");
    assert_eq!((all.column_values(0).len(), all.warnings().len()), (100, 0));
    let mut lengths = Vec::new();
    for length in (8..whole.len()).step_by(7) {
        let cut = Scrap::new("cut", &whole[..length]);
        match cut.read(None, &["/x.x"]) {
            Ok(table) => {
                assert!(
                    table.column_values(0) == &all.column_values(0)[..table.column_values(0).len()],
                    "{length}"
                );
                assert!(table.warnings()[0].contains("not finished"));
                lengths.push(table.column_values(0).len());
            }
            Err(TableError::MissingColumn { .. }) => assert!(lengths.is_empty(), "{length}"),
            Err(error) => panic!("{length}: {error}"),
        }
    }
    assert!(lengths.is_sorted() && lengths.contains(&100), "{lengths:?}");
    lengths.dedup();
    assert!(lengths.len() > 4, "{lengths:?}");
}

#[test]
fn a_damaged_recording_is_refused_or_read_as_it_was() {
    let whole = std::fs::read(&ramp("sound").0).expect("it has been written");
    let expected: Vec<_> = (0..100).map(f64::from).collect();
    let mut refused = 0;
    for index in (8..whole.len()).step_by(5) {
        let mut bytes = whole.clone();
        bytes[index] ^= 0x55;
        match Scrap::new("damaged", &bytes).read(None, &["/x.x"]) {
            Ok(table) => assert_eq!(table.column_values(0), expected, "{index}"),
            Err(error) => {
                refused += 1;
                assert!(!error.to_string().is_empty());
            }
        }
    }
    assert!(refused > whole.len() / 20, "{refused} of {}", whole.len() / 5);
}
