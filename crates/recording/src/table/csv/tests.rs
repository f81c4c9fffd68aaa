//! Files as loggers write them, right ones and wrong ones.

use std::path::Path;

use proptest::prelude::*;

use super::parse_csv_columns;
use super::text::CsvText;
use crate::table::read_request::{
    ColumnScaling, CsvDialect, DecimalMark, GapRule, ReadRequest, Separator, UnitRow,
};
use crate::table::{TableError, TimeSeriesTable, gaps};

fn read(bytes: impl AsRef<[u8]>, request: &ReadRequest) -> Result<TimeSeriesTable, TableError> {
    let text = CsvText::Memory(bytes.as_ref().to_owned());
    let mut recorded = parse_csv_columns(Path::new("log.csv"), &text, request)?;
    gaps::fill_gaps(Path::new("log.csv"), &mut recorded, &request.columns)?;
    TimeSeriesTable::new(recorded, request)
}

/// The time stamps, the values and the unit of the column `v`.
fn v(text: impl AsRef<[u8]>) -> (Vec<f64>, Vec<f64>, Option<String>) {
    let mut table = read(text, &ReadRequest::from_names("t", &["v"])).unwrap_or_else(|it| panic!("{it}"));
    table.set_origin(Some(0.0));
    (table.clock_times().remove(0), table.column_values(0).to_vec(), table.column_unit(0).map(str::to_owned))
}

fn error(text: impl AsRef<[u8]>, request: &ReadRequest) -> String {
    match read(text, request) {
        Err(error) => error.to_string(),
        Ok(table) => panic!("it was read: {table:?}"),
    }
}

/// Neither ends of lines that are lost nor a quotation mark that is not closed take more memory than a row may.
#[test]
fn a_row_that_is_too_long_is_told_with_its_line() {
    let rows = "0,1\n".repeat(1 << 10);
    let digits = "9".repeat(17 << 20);
    let lines = "9,9\n".repeat(5 << 20);
    for (text, line) in [
        (digits.clone(), 1),
        (format!("t,v\n0,{digits}\n"), 2),
        (format!("t,v\n{rows}0,{digits}"), (1 << 10) + 2),
        (format!("t,v\n{rows}0,\"{lines}"), (1 << 10) + 2),
    ] {
        let told = error(text, &ReadRequest::from_names("t", &["v"]));
        assert!(told.starts_with(&format!("line {line} of log.csv: expected rows of at most")), "{told}");
    }
}

/// A survey asks for no column, so titles, separator and decimal mark are all to be seen.
#[test]
fn a_survey_finds_titles_and_columns_in_every_dialect() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.csv");
    #[rustfmt::skip]
    let cases = [
        ("plain", "t,v,w\n0,1.5,2\n1,2.5,3\n2,3.5,4\n"),
        ("decimal commas", "t;v;w\n0,0;1,5;2,0\n1,0;2,5;3,0\n2,0;3,5;4,0\n"),
        ("decimal commas below units", "t;v;w\ns;m/s;-\n0,0;1,5;2,0\n1,0;2,5;3,0\n2,0;3,5;4,0\n"),
        ("decimal commas below notes", "Car, with, notes\nt;v;w\n0,0;1,5;2,0\n1,0;2,5;3,0\n2,0;3,5;4,0\n"),
        ("tabs, decimal commas", "t\tv\tw\n0,0\t1,5\t2,0\n1,0\t2,5\t3,0\n2,0\t3,5\t4,0\n"),
        ("commas, semicolons in texts", "t,v,w,note\n0,1.5,2,a;b;c\n1,2.5,3,d;e;f\n2,3.5,4,g;h;i\n"),
        ("milliseconds", "t_ms,v,w\n0,1.5,2\n1000,2.5,3\n2000,3.5,4\n"),
    ];
    for (name, text) in cases {
        std::fs::write(&path, text).expect("a file");
        let found = super::survey_csv(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
        let names: Vec<_> = found.channels.iter().take(3).map(|it| it.name.as_str()).collect();
        assert!(names == ["t", "v", "w"] || names == ["t_ms", "v", "w"], "{name}: {names:?}");
        let tally = &found.channels[1].tally;
        assert_eq!(tally.range, Some((1.5, 3.5)), "{name}");
        assert_eq!(tally.times, Some((0.0, 2.0)), "{name}");
    }
}

#[test]
fn one_recording_is_the_same_in_every_dialect() {
    let plain = (vec![0.5, 1.0], vec![12.5, -1000.25], None);
    let with_unit = (vec![0.5, 1.0], vec![12.5, -1000.25], Some("km/h".to_owned()));
    #[rustfmt::skip]
    let cases = [
        ("plain", "t,v\n0.5,12.5\n1,-1000.25\n", &plain),
        ("semicolons", "t;v\n0.5;12.5\n1;-1000.25\n", &plain),
        ("decimal commas", "t;v\n0,5;12,5\n1;-1000,25\n", &plain),
        ("tabs, decimal commas, CRLF", "t\tv\r\n0,5\t12,5\r\n1\t-1000,25\r\n", &plain),
        ("old Macintosh", "t,v\r0.5,12.5\r1,-1000.25\r", &plain),
        ("no last line end", "t,v\n0.5,12.5\n1,-1000.25", &plain),
        ("mark of UTF-8", "\u{feff}t,v\n0.5,12.5\n1,-1000.25\n", &plain),
        ("quotes", "\"t\",\"v\"\n\"0.5\",\"12.5\"\n\"1\",\"-1000.25\"\n", &plain),
        ("quoted decimal commas", "t;v\n\"0,5\";\"12,5\"\n1;\"-1000,25\"\n", &plain),
        ("exponents", "t,v\n5e-1,+1.25E1\n1.,-1.00025e+3\n", &plain),
        ("comments", "# car \"A\n# 2024\nt,v\n0.5,12.5\n# pit stop\n1,-1000.25\n", &plain),
        ("numpy", "# t,v\n0.5,12.5\n1,-1000.25\n", &plain),
        ("blank lines", "\n\nt,v\n\n0.5,12.5\n\n1,-1000.25\n\n\n", &plain),
        ("blank rows of Excel", "sep=;\nt;v\n0,5;12,5\n1;-1000,25\n;\n;\n", &plain),
        ("separators at the end", "t,v,\n0.5,12.5,\n1,-1000.25,\n", &plain),
        ("separators at the end of rows", "t,v\n0.5,12.5,\n1,-1000.25,\n", &plain),
        ("unit in brackets", "t [s],v [km/h]\n0.5,12.5\n1,-1000.25\n", &with_unit),
        ("unit in round brackets", "t(s),v(km/h)\n0.5,12.5\n1,-1000.25\n", &with_unit),
        ("milliseconds", "t [ms];v [km/h]\n500;12,5\n1000;-1000,25\n", &with_unit),
        ("line of units", "t,v,n\ns,km/h,\n0.5,12.5,x\n1,-1000.25,x\n", &with_unit),
        ("line of units in brackets", "t,v\n[ms],[km/h]\n500,12.5\n1000,-1000.25\n", &with_unit),
        ("line of units without one of time", "t,v\n-,km/h\n0.5,12.5\n1,-1000.25\n", &with_unit),
        (
            "MoTeC",
            "\"Format\",\"MoTeC CSV File\",,,\"Workbook\",\"\"\n\"Venue\",\"Track, North\"\n\"Duration\",\"1.0\",\"s\"\n\n\
             \"t\",\"v\",\"Gear\",\"Lap\",\"P\",\"Q\",\"R\"\n\"s\",\"km/h\",\"\",\"\",\"bar\",\"%\",\"rpm\"\n\n\
             \"0.5\",\"12.5\",\"1\",\"1\",\"0\",\"0\",\"0\"\n\"1\",\"-1000.25\",\"1\",\"1\",\"0\",\"0\",\"0\"\n",
            &with_unit,
        ),
    ];
    for (name, text, expected) in cases {
        let (times, values, unit) = v(text);
        assert_eq!((times, values, unit), *expected, "{name}");
    }
    let text = "\"t\"\t\"v\"\tä\n0,5\t12,5\t\u{1f697}\n1\t-1000,25\t\n";
    let wide = |mark: u16, bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
        [mark].into_iter().chain(text.encode_utf16()).flat_map(bytes).collect()
    };
    assert_eq!(v(wide(0xfeff, u16::to_le_bytes)), plain, "UTF-16, as Excel writes it");
    assert_eq!(v(wide(0xfeff, u16::to_be_bytes)), plain, "UTF-16, highest byte first");
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut packed, text.as_bytes()).expect("memory");
    let packed = packed.finish().expect("memory");
    assert_eq!(v(&packed), plain, "gzip");
    let cut = error(&packed[..packed.len() - 12], &ReadRequest::from_names("t", &["v"]));
    assert!(cut.contains("cannot read the recording log.csv"), "{cut}");
    let latin = b"t;v;T [\xb0C]\n0,5;12,5;3\n1;-1000,25;4\n";
    assert_eq!(v(latin), plain, "Western Windows");
    let table = read(latin, &ReadRequest::from_names("t", &["T"])).expect("it is well-formed");
    assert_eq!(table.column_unit(0), Some("degC"));
}

#[test]
fn clocks_and_dates_are_times() {
    let (times, ..) = v("t,v\n12:00:00.5,1\n12:00:01.0,2\n");
    assert_eq!(times, [43_200.5, 43_201.0]);
    let (times, ..) = v("t;v\n2024-02-29 12:00:00,5;1\n2024-02-29 12:00:01;2\n");
    assert_eq!(times, [1_709_208_000.5, 1_709_208_001.0]);
    let (times, ..) = v("t,v\n1692117187.46380758,1\n1692117187.50,2\n");
    assert_eq!(times[0], 1_692_117_187.463_807_6);
    let text = error("t,v\n23:59:59.5,1\n00:00:00.5,2\n", &ReadRequest::from_names("t", &["v"]));
    assert!(text.contains("add dates to a clock that passes midnight"), "{text}");
}

#[test]
fn keys_decide_where_a_file_is_ambiguous() {
    let request = |dialect| ReadRequest { dialect, ..ReadRequest::from_names("t", &["v"]) };
    let comma = CsvDialect { decimal: Some(DecimalMark::Comma), ..CsvDialect::default() };
    let text = "t;v\n1;1,500\n2;2,750\n";
    assert_eq!(read(text, &request(comma)).expect("said").column_values(0), [1.5, 2.75]);
    let question = error(text, &ReadRequest::from_names("t", &["v"]));
    assert!(question.contains("line 2 of log.csv: is \"1,500\" in column `v`"), "{question}");
    // One other number in the file answers the question.
    assert_eq!(v("t;v\n0,1;1,500\n2;2,750\n").1, [1.5, 2.75]);
    let row = CsvDialect { unit_row: Some(UnitRow::Below(true)), ..CsvDialect::default() };
    let units = "t,v\ns,furlong\n0,1\n";
    assert_eq!(read(units, &request(row)).expect("said").column_unit(0), Some("furlong"));
    // What is no row of numbers below the titles is none without the key either.
    assert_eq!(
        read(units, &ReadRequest::from_names("t", &["v"])).expect("seen").column_unit(0),
        Some("furlong")
    );
    let other = CsvDialect { title_row: Some(2), unit_row: Some(UnitRow::Line(4)), ..CsvDialect::default() };
    let notes = "a,b\nt,v\nfirst,second\ns,km/h\n0,1\n1,2\n";
    let table = read(notes, &request(other)).expect("said");
    assert_eq!((table.column_unit(0), table.column_values(0)), (Some("km/h"), &[1.0, 2.0][..]));
    assert!(table.warnings()[0].contains("line 3 of log.csv"), "{:?}", table.warnings());
    let tab = CsvDialect { separator: Some(Separator::Tab), ..CsvDialect::default() };
    assert!(error("t,v\n0,1\n", &request(tab)).contains("no column `v`"));
    let quoted = CsvDialect { decimal: Some(DecimalMark::Comma), ..CsvDialect::default() };
    let table = read("t,v\n\"0,5\",\"1,5\"\n", &request(quoted)).expect("quoted");
    assert_eq!(table.column_values(0), [1.5]);
}

#[test]
fn a_wrong_file_is_refused_with_line_and_cure() {
    let plain = ReadRequest::from_names("t", &["v"]);
    #[rustfmt::skip]
    let cases: &[(&str, &[&str])] = &[
        ("\u{feff}", &["log.csv, found nothing"]),
        ("\n\n# notes\n", &["no column `v`"]),
        ("t,v\n", &["found only a header"]),
        ("t,v\nm,m\n", &["found only a header"]),
        ("0,1\n1,2\n", &["line 1 of log.csv has numbers only", "such as `t,x1`"]),
        ("0 1\n1 2\n", &["line 1 of log.csv has numbers only"]),
        ("# made by hand\n0,1\n1,2\n", &["line 2 of log.csv has numbers only"]),
        ("time,v_x [km/h]\n0,1\n", &["no column `v` in log.csv: it has time, v_x"]),
        ("t,v,v\n0,1,2\n", &["`v` can be any of the columns `v #1`, `v #2` of log.csv: name one of them so"]),
        ("t,v [m/s],v [km/h]\n0,1,2\n", &["`v [m/s]`, `v [km/h]` of log.csv", "name one of them so"]),
        ("t,v\n0,1\n1\n2,3\n", &["line 3 of log.csv has 1 cells, expected 2"]),
        ("t,v\n0,0,1,5\n", &["has 4 cells, expected 2", "export with semicolons"]),
        ("t,v\n0,\"1\n1,2\n", &["opening quotation mark"]),
        ("t,v\n0,\"1,5\"\n", &["found \"1,5\"", "`decimal = \",\"`"]),
        ("t;v\n0;1.5\n1;1,25\n", &["line 2 of log.csv", "if it has a decimal point, say `decimal = \".\"`"]),
        ("t;v\n0;1.234,5\n", &["separators of thousands"]),
        ("t;v\n0;1,234,567\n", &["separators of thousands"]),
        ("t;v\n0;1 234\n", &["separators of thousands"]),
        ("t,v\n0,60.0 km/h\n", &["a unit in the cell is not read"]),
        ("t,v\n0,29/03/2026 12:00:00\n", &["dates and clocks are read as 2026-03-29 12:00:00.5"]),
        ("t,v\n1771750800050,1\n", &["begins with 1771750800050", "say `time_unit = \"ms\"`"]),
        ("t,v\n0,0x1F\n", &["hexadecimal"]),
        ("t,v\n0,1e400\n", &["line 2 of log.csv: expected a finite number in column `v`, found \"1e400\""]),
        ("t,v\n0,left\n", &["expected a number in column `v`, found \"left\""]),
        ("t,v\n0,1\n,2\n", &["line 3 of log.csv: expected a number in column `t`, found \"\"", "fill the gap"]),
        ("t,v\n0,1\n\n\n0,2\n", &["line 5 of log.csv: expected a time after 0", "found 0"]),
        ("t [furlong],v\n0,1\n", &["the time `t [furlong]` of log.csv is in [furlong]", "say `time_unit"]),
        ("t,v\n0,1\n1,\n2,\n3,2\n", &["`v` has no value in 2 rows of log.csv, the first one in line 3", "gaps = \"hold\""]),
        ("t,v\n12:00:00,1\n12:0x:01,2\n", &["line 3 of log.csv: expected a clock or a date", "found \"12:0x:01\""]),
        ("t,v [m/s]\ns,km/h\n0,1\n", &["`v [m/s]` of log.csv is in [m/s] by its title and in [km/h] by line 2"]),
        ("<h", &["is an AiM log", "export it as CSV in Race Studio"]),
        ("#ROSBAG V2.0\n", &["is a bag of ROS 1", "rosbags-convert"]),
        ("%DataLog%\nChannel : RPM\n0,1\n", &["is a Haltech log", "export it as MoTeC CSV"]),
        ("t\0,\0v\0", &["text in UTF-16", "UTF-8"]),
    ];
    for (text, says) in cases {
        let message = error(text, &plain);
        for part in *says {
            assert!(message.contains(part), "{text:?}: {message}");
        }
    }
}

#[test]
fn gaps_follow_the_rule_of_their_column() {
    let text = "t,v,w\n0,,1\n1,1,\n2,,\n3,3,4\n4,,5\n";
    let with = |rules: [GapRule; 2]| {
        let mut request = ReadRequest::from_names("t", &["v", "w"]);
        request.columns.iter_mut().zip(rules).for_each(|(column, gaps)| column.gaps = gaps);
        read(text, &request)
    };
    let table = with([GapRule::Hold, GapRule::Interpolate]).expect("each has a rule");
    assert_eq!(table.clock_times(), [[0.0, 1.0, 2.0, 3.0]]);
    assert_eq!(table.column_values(0), [1.0, 1.0, 3.0, 3.0]);
    assert_eq!(table.column_values(1), [2.0, 3.0, 4.0, 5.0]);
    let warning = "log.csv is read from 1 s to 4 s: outside of it `v` has no value, 1 rows at the beginning and 0 at the end";
    assert!(table.warnings()[0].starts_with(warning), "{:?}", table.warnings());
    let table = with([GapRule::Interpolate, GapRule::Hold]).expect("each has a rule");
    assert_eq!(
        (table.column_values(0), table.column_values(1)),
        (&[1.0, 2.0, 3.0][..], &[1.0, 1.0, 4.0][..])
    );
    let refused = with([GapRule::Hold, GapRule::Refuse]).expect_err("gaps").to_string();
    assert!(refused.contains("`w` has no value in 2 rows"), "{refused}");
    let mut apart = ReadRequest::from_names("t", &["v", "w"]);
    apart.columns.iter_mut().for_each(|column| column.gaps = GapRule::Interpolate);
    let message = error("t,v,w\n0,1,\n1,2,\n2,,3\n3,,4\n", &apart);
    assert!(message.contains("`v`, `w` of log.csv have no row in common"), "{message}");
}

#[test]
fn gain_offset_and_sign_follow_the_formula() {
    let mut request = ReadRequest::from_names("t", &["v"]);
    request.columns[0].scaling = ColumnScaling { gain: 0.0625, offset: 0.5, sign: -1.0 };
    assert_eq!(read("t,v\n0,16\n1,-0\n", &request).expect("a table").column_values(0), [-0.5, 0.5]);
    assert!(ColumnScaling::default().apply(-0.0).is_sign_negative());
}

#[test]
fn a_file_that_was_cut_off_is_read_without_its_last_line() {
    let table = read("t,v,w\n0,1,2\n1,2,3\n2,3", &ReadRequest::from_names("t", &["v"])).expect("a table");
    assert_eq!(table.column_values(0), [1.0, 2.0]);
    assert!(table.warnings()[0].contains("line 4 of log.csv is left out"), "{:?}", table.warnings());
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(
        head in prop::sample::select(vec!["", "t,v\n", "t;v [m]\n", "\u{feff}t\tv\ns\tm\n"]),
        body in prop::collection::vec(any::<u8>(), 0..300),
    ) {
        let bytes = [head.as_bytes(), &body].concat();
        let _ = read(&bytes, &ReadRequest::from_names("t", &["v"]));
    }

    #[test]
    fn no_text_of_the_letters_of_logs_makes_the_reader_panic(text in "[tv0-9,;\t\n\r\"'#.: eN\\[\\]()°-]{0,200}") {
        let mut request = ReadRequest::from_names("t", &["v"]);
        request.columns[0].gaps = GapRule::Interpolate;
        let _ = read(&text, &request);
        let _ = super::read_untimed_columns(Path::new("log.csv"), Some(&text), &["v"]);
    }

    #[test]
    fn numbers_come_back_to_the_bit(values in prop::collection::vec(-1e300..1e300_f64, 1..20), comma: bool) {
        let row = |(row, value): (usize, &f64)| format!("{row};{value}\n");
        let text: String = values.iter().enumerate().map(row).collect();
        let text = if comma { text.replace('.', ",") } else { text };
        let decimal = Some(if comma { DecimalMark::Comma } else { DecimalMark::Point });
        let dialect = CsvDialect { decimal, ..CsvDialect::default() };
        let request = ReadRequest { dialect, ..ReadRequest::from_names("t", &["v"]) };
        let table = read(format!("t;v\n{text}"), &request).expect("numbers");
        prop_assert_eq!(table.column_values(0), &values);
    }
}

#[test]
fn all_wrong_columns_are_told_at_once() {
    let request = ReadRequest::from_names("t", &["v", "w", "x", "u"]);
    let error = error("t,u,v,x\n0,1,2,\n1,1,two,3\n", &request);
    let lines: Vec<&str> = error.lines().collect();
    assert_eq!(lines.len(), 3, "{error}");
    assert!(lines[0].contains("found \"two\"") && lines[1].contains("no column `w`"), "{error}");
    assert!(lines[2].contains("`x` has no value in 1 row"), "{error}");
}

#[test]
fn a_column_whose_rows_are_dropped_has_its_own_times() {
    let mut request = ReadRequest::from_names("t", &["v", "w"]);
    request.columns[1].gaps = GapRule::Drop;
    let table = read("t,v,w\n0,1,\n1,2,5\n2,3,\n3,4,6\n", &request).expect("a table");
    assert_eq!(
        (table.column_values(0), table.column_values(1)),
        (&[1.0, 2.0, 3.0, 4.0][..], &[5.0, 6.0][..])
    );
    assert_eq!(table.clock_times()[table.column_clock(1)], [1.0, 3.0]);
}
