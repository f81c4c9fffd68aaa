//! Surveys of small logs of several formats.

use super::survey_file as survey_of;
use crate::survey::LogSurvey;

fn survey(name: &str, bytes: &[u8]) -> LogSurvey {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("it can be written");
    survey_of(&path).unwrap_or_else(|error| panic!("{error}"))
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
