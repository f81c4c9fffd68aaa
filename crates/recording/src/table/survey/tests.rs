//! Surveys of small logs of several formats.

use super::survey_file as survey_of;
use mdf_file::{MdfCell, MdfColumn, MdfColumnType, MdfDescription, MdfWriter};

use crate::survey::{BEGINNING_SIZE, LogSurvey, SurveyExtent};

fn survey(name: &str, bytes: &[u8]) -> LogSurvey {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("it can be written");
    survey_of(&path, SurveyExtent::Whole).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn columns_of_a_csv_file_are_told_with_rate_range_and_gaps() {
    let mut text = "note;t [ms];v_x [km/h];gear\n".to_owned();
    for k in 0..100 {
        let gear = if k % 10 == 0 { "3" } else { "" };
        let pause = if k > 50 { 5000 } else { 0 };
        text += &format!("{};{};{},5;{gear}\n", if k > 2 { "dry" } else { "wet" }, k * 20 + pause, k);
    }
    text += "dry;9000";
    let survey = survey("log.csv", text.as_bytes());
    let lines = survey.terminal_report();
    for part in [
        "format             CSV",
        "time               `t`, unless another column is named",
        "4 channels",
        "\"wet\", \"dry\"",
        "  v_x  [km/h]          100 50 Hz      0 to 6.98 s",
        "0.5 to 99.5",
        "1 gap, the longest of 5.02 s at 1 s",
        "5 Hz",
        "90 rows without a value",
        "damage: line 102 of",
    ] {
        assert!(lines.contains(part), "{part}: {lines}");
    }
    let json = survey.to_json();
    let v_x = &json["channels"][2];
    assert_eq!((v_x["step"].as_f64(), v_x["values"].as_u64()), (Some(0.02), Some(100)));
    assert_eq!((v_x["min"].as_f64(), v_x["gaps"].as_u64()), (Some(0.5), Some(1)));
    assert_eq!(v_x["longest_gap_at"].as_f64(), Some(1.0));
}

#[test]
fn a_log_of_a_data_logger_is_told_with_its_own_clock() {
    let vbo = "[header]\ntime\nvelocity kmh\n[column names]\ntime velocity\n[data]\n000001.00 36\n00\n000001.10 37\n000001.20 38\n";
    let survey = survey("log", vbo.as_bytes());
    let lines = survey.terminal_report();
    for part in
        ["VBOX", "`time`", "velocity [km/h]", "10 Hz", "1 to 1.2 s", "36 to 38", "damage: 1 line left out"]
    {
        assert!(lines.contains(part), "{part}: {lines}");
    }
}

/// Rows of 64 channels that make more than the beginning of a file.
const MANY_ROWS: u64 = BEGINNING_SIZE / (64 * 8) + 60_000;

#[test]
fn of_a_large_file_with_an_index_the_beginning_is_read_and_rows_are_those_of_the_index() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("long.mf4");
    let column = |k: usize| MdfColumn {
        name: format!("channel_{k}"),
        unit: Some("m/s".to_owned()),
        comment: None,
        kind: MdfColumnType::Real,
    };
    let columns: Vec<MdfColumn> = (0..64).map(column).collect();
    let mut writer = MdfWriter::create(&path, &MdfDescription::default(), &columns).expect("a file");
    for row in 0..MANY_ROWS {
        // Digits that no compression shortens.
        let cells: [MdfCell; 64] =
            std::array::from_fn(|k| MdfCell::Real((row as f64 * (k + 1) as f64).sin()));
        writer.write_row(0.001 * row as f64, &cells).expect("a row");
    }
    writer.finish().expect("an end");
    let part = survey_of(&path, SurveyExtent::Beginning).expect("a log");
    assert!(part.part_of.is_some_and(|size| size > BEGINNING_SIZE));
    let channel = &part.channels[7];
    assert_eq!(channel.indexed_rows, Some(MANY_ROWS));
    assert!(channel.tally.rows < MANY_ROWS && channel.tally.rows > 100_000, "{}", channel.tally.rows);
    let lines = part.terminal_report();
    for words in ["the first 64 of ", "`--all`", &MANY_ROWS.to_string()] {
        assert!(lines.contains(words), "{words}: {lines}");
    }
    assert_eq!(part.to_json()["complete"], false);
    let whole = survey_of(&path, SurveyExtent::Whole).expect("a log");
    assert_eq!((whole.channels[7].tally.rows, whole.part_of), (MANY_ROWS, None));
}

#[test]
fn a_large_recording_of_messages_tells_their_number_and_times_from_its_summary() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("long.mcap");
    let file = std::fs::File::create(&path).expect("a file");
    let options = mcap::WriteOptions::new().compression(None);
    let mut writer = options.create(std::io::BufWriter::new(file)).expect("a writer");
    let schema = writer.add_schema("Sample", "jsonschema", b"{\"type\": \"object\"}").expect("a schema");
    let [often, late] = ["/often", "/late"]
        .map(|topic| writer.add_channel(schema, topic, "json", &Default::default()).expect("a channel"));
    let filling = " ".repeat(1 << 20);
    for k in 0..80_u64 {
        let channel_id = if k < 75 { often } else { late };
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: 0,
            log_time: k * 1_000_000_000,
            publish_time: 0,
        };
        writer
            .write_to_known_channel(&header, format!("{{\"v\": {k}{filling}}}").as_bytes())
            .expect("a message");
    }
    writer.finish().expect("an end");
    let part = survey_of(&path, SurveyExtent::Beginning).expect("a recording");
    assert_eq!(part.channels.len(), 1);
    assert_eq!((part.channels[0].indexed_rows, part.channels[0].tally.rows), (Some(75), 64));
    assert!(part.time.contains("goes from 0 to 79 s"), "{}", part.time);
    assert!(part.left_out[0].contains("`/late`: its 5 messages"), "{:?}", part.left_out);
    let whole = survey_of(&path, SurveyExtent::Whole).expect("a recording");
    assert_eq!((whole.channels.len(), whole.part_of), (2, None));
}
