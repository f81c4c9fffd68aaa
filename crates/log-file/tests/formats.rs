//! Reads logs of all formats to known answers.

use crate::mat;

use crate::ld::{Ld, ld, ld_channels};
use crate::writers::{VBO, arrow, by_footer, parquet};
use arrow_ipc::CompressionType;
use log_file::{ChannelKind, ChannelValues, ClockTime, LogChannel, LogFile};
use mat::{Made, column};

/// The log of these bytes, under a name that tells nothing.
fn open(bytes: &[u8]) -> Result<Option<LogFile>, log_file::Error> {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    std::fs::write(file.path(), bytes).expect("it can be written");
    LogFile::open(file.path())
}

fn log(bytes: &[u8]) -> LogFile {
    open(bytes).expect("it can be read").expect("it is a log")
}

fn place(log: &LogFile, name: &str) -> usize {
    log.channels().iter().position(|it| it.name == name).expect(name)
}

fn numbers(log: &mut LogFile, name: &str) -> Vec<f64> {
    let place = place(log, name);
    let values = log.read_all_rows(&[place]).expect("it can be read").remove(0);
    (0..values.len()).map(|row| values.number_at(row).expect("a number")).collect()
}

/// As texts, in which NaN is equal to itself.
fn shown(values: &[f64]) -> Vec<String> {
    values.iter().map(f64::to_string).collect()
}

#[test]
fn motec_numbers_have_their_scale_rate_and_unit() {
    let mut log = log(&ld(&ld_channels()));
    assert_eq!(log.format, "MoTeC ld");
    let about = |it: &LogChannel| (it.name.clone(), it.unit.clone().unwrap_or_default(), it.clock);
    let about: Vec<_> = log.channels().iter().map(about).collect();
    let expected =
        [("Ground Speed", "km/h", 0), ("G Force Lat", "g0", 1), ("Steer", "deg", 0), ("Temp", "degC", 2)];
    assert_eq!(about, expected.map(|(name, unit, clock)| (name.into(), unit.into(), clock)));
    let clocks: Vec<_> = log.clocks().iter().map(|it| (it.time, it.rows)).collect();
    let rate = |rate, rows| (ClockTime::Rate(rate), Some(rows));
    assert_eq!(clocks, [rate(10.0, 3), rate(20.0, 4), rate(1.0, 1)]);
    assert_eq!(numbers(&mut log, "Ground Speed"), [100.0, 100.5, -2.0]);
    assert_eq!(numbers(&mut log, "G Force Lat"), [-1.5, 0.0, 0.25, 1.0]);
    assert_eq!(numbers(&mut log, "Steer"), [1.5, -2.0, 0.0]);
    // (100 / (4 * 10^-1) - 40) * 2
    assert_eq!(numbers(&mut log, "Temp"), [420.0]);
    assert!(log.warnings().is_empty(), "{:?}", log.warnings());
}

#[test]
fn motec_doubles_are_read_and_a_factor_of_0_is_1() {
    let doubles: Vec<u8> = [43.8f64, -79.1].iter().flat_map(|it| it.to_le_bytes()).collect();
    let floats: Vec<u8> = [72f32, 82.8].iter().flat_map(|it| it.to_le_bytes()).collect();
    let integers = [1024i32, -3].iter().flat_map(|it| it.to_le_bytes()).collect();
    let channel = |name, class, size, scale, bytes| Ld {
        name,
        unit: "",
        kind: [class, size, 10],
        scale,
        rows: 2,
        bytes,
    };
    let channels = [
        channel("GPS Latitude", 8, 8, [0, 0, 0, 0], doubles.clone()),
        channel("Ground Speed", 7, 4, [0, 0, 0, 0], floats),
        channel("GPS Longitude", 7, 8, [0, 1, 1, 0], doubles),
        channel("CAN ID", 6, 4, [0, 1, 0, 1], integers),
    ];
    let mut one = log(&ld(&channels[..1]));
    let warning = |log: &LogFile| log.warnings().join("; ");
    assert_eq!(warning(&one), "`GPS Latitude` has a factor or divisor of 0, which is read as 1");
    assert_eq!(numbers(&mut one, "GPS Latitude"), [43.8, -79.1]);
    let mut log = log(&ld(&channels));
    assert_eq!(warning(&log), "`GPS Latitude` and 2 more have a factor or divisor of 0, which is read as 1");
    assert_eq!(numbers(&mut log, "Ground Speed"), [72.0, f64::from(82.8f32)]);
    assert_eq!(numbers(&mut log, "GPS Longitude"), [43.8, -79.1]);
    assert_eq!(numbers(&mut log, "CAN ID"), [102.4, -3.0 / 10.0]);
    assert!(log.skipped_contents().is_empty(), "{:?}", log.skipped_contents());
}

#[test]
fn motec_channels_that_cannot_be_read_are_named() {
    let mut channels = ld_channels();
    channels[0].kind = [9, 8, 10];
    channels[1].kind[2] = 0;
    channels[2].rows = 3_000_000_000;
    let mut bytes = ld(&channels);
    bytes.truncate(bytes.len() - 4);
    let mut log = log(&bytes);
    let notes = [log.skipped_contents(), log.warnings()].concat().join("\n");
    for part in [
        "`Ground Speed` is left out: it has numbers of class 9 and 8 bytes",
        "`G Force Lat` is left out: its rate is 0",
        "`Steer` has 3 of 3000000000 values",
        "`Temp` has 0 of 1 values",
    ] {
        assert!(notes.contains(part), "{part}: {notes}");
    }
    assert_eq!(numbers(&mut log, "Steer"), [1.5, -2.0, 0.0]);
    // A list that goes in a circle ends.
    let mut bytes = ld(&ld_channels());
    let second = bytes[8..12].to_vec();
    let at = 0x3448 + 124 + 4;
    bytes[at..at + 4].copy_from_slice(&second);
    let found = open(&bytes).expect("it is read").expect("a log");
    assert_eq!(found.channels().len(), 2);
    assert!(found.warnings()[0].contains("goes in a circle"), "{:?}", found.warnings());
    let none = open(&ld(&[])).err().expect("no channels").to_string();
    assert!(none.starts_with("expected channels in the MoTeC file, found none"), "{none}");
}

#[test]
fn long_channels_come_in_stretches() {
    let rows = 3 * log_file::CHUNK_ROWS as u32 + 7;
    let bytes = (0..rows).flat_map(|it| (it as i32).to_le_bytes()).collect();
    let (kind, scale) = ([5, 4, 1000], [0, 1, 1, 0]);
    let mut log = log(&ld(&[Ld { name: "n", unit: "", kind, scale, rows, bytes }]));
    let (mut stretches, mut next) = (0, 0.0);
    log.read_chunks(0, &[0], &mut |stretch| {
        stretches += 1;
        for row in 0..stretch[0].len() {
            assert_eq!(stretch[0].number_at(row), Some(next));
            next += 1.0;
        }
        true
    })
    .expect("it can be read");
    assert_eq!((stretches, next), (4, f64::from(rows)));
    let mut stretches = 0;
    let enough = &mut |_: &[ChannelValues]| {
        stretches += 1;
        false
    };
    log.read_chunks(0, &[0], enough).expect("it can be read");
    assert_eq!(stretches, 1);
}

#[test]
fn vbox_times_pass_midnight_and_positions_become_degrees() {
    for text in [VBO.to_owned(), VBO.replace("\r\n", "\n"), format!("\u{feff}{VBO}")] {
        let mut log = log(text.as_bytes());
        assert_eq!(log.format, "VBOX");
        let about = |it: &LogChannel| format!("{} {}", it.name, it.unit.clone().unwrap_or_default());
        let about: Vec<_> = log.channels().iter().map(about).collect();
        let units =
            "sats ,time s,lat deg,long deg,velocity km/h,heading deg,height m,Yaw_Rate deg/s,Lat_Acc g0";
        assert_eq!(about.join(","), units);
        assert_eq!(log.clocks()[0].time, ClockTime::Channel(1));
        assert_eq!(numbers(&mut log, "time"), [86_399.9, 86_400.0, 86_400.2]);
        let [lat, long] = ["lat", "long"].map(|name| numbers(&mut log, name));
        // North of Greenwich and to the west of it, then to the east.
        assert!((lat[0] - 51.984_995_5).abs() < 1e-9, "{lat:?}");
        assert!((long[0] + 0.981_03).abs() < 1e-9 && long[2] == 1.0, "{long:?}");
        assert_eq!(shown(&numbers(&mut log, "velocity")), ["36", "37", "NaN"]);
        assert_eq!(shown(&numbers(&mut log, "Yaw_Rate")), ["1.5", "NaN", "1"]);
        let notes = log.warnings();
        assert!(notes[0].starts_with("1 line left out: expected 9 numbers"), "{notes:?}");
        assert!(notes[1].starts_with("1 line with cells that are no numbers"), "{notes:?}");
        assert!(notes[0].ends_with("line 28") && notes[1].ends_with("line 29"), "{notes:?}");
    }
    // Video HD2 writes some rows twice.
    let row = "000001.00 5\n";
    let mut twice = log(format!("[header]\ntime\nv\n[data]\n{row}{row}000002.00 6\n").as_bytes());
    assert_eq!(numbers(&mut twice, "v"), [5.0, 6.0]);
    assert_eq!(
        twice.warnings(),
        ["1 line left out: each is like the one before it; the first one is line 6"]
    );
    let error = open(b"[header]\ntime\n").err().expect("it has no rows").to_string();
    assert!(error.contains("expected a section [data]"), "{error}");
    // Titles alone name the columns.
    let mut log = log(b"[header]\ntime\nvelocity mph\n[data]\n000001 5\n");
    assert_eq!(log.channels()[1].unit.as_deref(), Some("mph"));
    assert_eq!(numbers(&mut log, "velocity mph"), [5.0]);
}

/// Racelogic: a unit for each column that is none of VBOX's own, empty lines among them. Video HD2 lists `avisynctime`, too.
#[test]
fn vbox_units_belong_to_the_columns_that_they_stand_for() {
    let own = ["satellites", "time", "velocity kmh", "vertical velocity m/s", "solution type"];
    let video = ["avifileindex", "avisynctime"];
    let first = |more: &[&str]| [&own[..], &video, more].concat().join("\n");
    let steering = |units: &str, titles: &str| {
        let names = titles.lines().map(|it| it.replace(' ', "_")).collect::<Vec<_>>().join(" ");
        let head = format!("[header]\n{titles}\n\n[channel units]\n{units}\n\n[comments]\nx\n");
        let mut log = log(format!("{head}[column names]\n{names}\n[data]\n").as_bytes());
        let unit = |name: &str| log.channels()[place(&log, name)].unit.clone();
        let units = ["Steering", "RPM", "Note"].map(unit);
        log.read_chunks(0, &[0], &mut |_| true).expect("no rows");
        (units, log.warnings())
    };
    let titles = first(&["Steering", "RPM", "Note"]);
    let last = [&own[..], &["Steering", "RPM", "Note"], &video].concat().join("\n");
    let own_unit = [&own[..], &["yaw rate deg/s", "Steering", "RPM", "Note"]].concat().join("\n");
    for (name, units, titles) in [
        ("each of the others", "deg\nrpm\n(null)", &titles),
        ("an empty line at the end", "deg\nrpm\n", &titles),
        ("avisynctime as well", "s\ndeg\nrpm\n(null)", &titles),
        ("all columns", "(null)\ns\nkmh\nm/s\n(null)\n(null)\ns\ndeg\nrpm\n(null)", &titles),
        ("others before the video", "deg\nrpm\n(null)", &last),
        ("a unit in a title", "deg\nrpm\n(null)\n\n", &own_unit),
    ] {
        let (units, warnings) = steering(units, titles);
        let units = units.map(Option::unwrap_or_default);
        assert_eq!(units, ["deg", "rpm", ""], "{name}");
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
    }
    let (units, warnings) = steering("rpm\n(null)", &titles);
    assert_eq!(units.map(Option::unwrap_or_default), ["", "rpm", ""], "the last ones");
    assert!(warnings[0].contains("has 2 entries for 10 columns, of which 3 need one"), "{warnings:?}");
    let knots = log(b"[header]\ntime\nvelocity knots\n[column names]\ntime velocity\n[data]\n000001 5\n");
    assert_eq!(knots.channels()[1].unit.as_deref(), Some("kn"));
}

#[test]
fn parquet_and_arrow_have_all_types_of_numbers_and_texts() {
    let lz4 = Some(CompressionType::LZ4_FRAME);
    let zstd = Some(CompressionType::ZSTD);
    let files = [
        ("Parquet", parquet()),
        ("Arrow", arrow(false, None)),
        ("Arrow", arrow(false, lz4)),
        ("Arrow", by_footer(&arrow(false, zstd))),
        ("Arrow", arrow(true, zstd)),
        ("Arrow", arrow(true, None)),
    ];
    for (format, bytes) in files {
        let mut log = log(&bytes);
        assert_eq!(log.format, format);
        assert_eq!(log.channels()[0].unit.as_deref(), Some("m/s"));
        assert_eq!(log.skipped_contents(), ["`list` is left out: it has values of type List(Int32)"]);
        let twice = |it: [f64; 3]| shown(&[it, it].concat());
        let nan = f64::NAN;
        for (name, expected) in [
            ("v_x", [1.25, nan, -3.5]),
            ("f", [0.5, 1.0, 2.0]),
            ("h", [1.5, -2.0, 0.0]),
            ("gear", [1.0, 2.0, 255.0]),
            ("wet", [1.0, 0.0, nan]),
            ("price", [123.45, nan, -0.05]),
        ] {
            assert_eq!(shown(&numbers(&mut log, name)), twice(expected), "{format} {name}");
        }
        // In any order, and one twice.
        let wanted = ["stamp", "count", "weather", "id", "count"].map(|name| place(&log, name));
        let found = log.read_all_rows(&wanted).expect("they can be read");
        let most = i128::from(i64::MAX);
        let ChannelValues::Integers(count) = &found[1] else { panic!("expected integers") };
        assert_eq!(count[..3], [Some(most), None, Some(-1)]);
        assert_eq!(found[1], found[4]);
        let ChannelValues::Integers(id) = &found[3] else { panic!("expected integers") };
        assert_eq!(id[0], Some(u64::MAX.into()));
        let ChannelValues::Texts(weather) = &found[2] else { panic!("expected texts") };
        assert_eq!(weather[..3], [Some("dry".to_owned()), None, Some("rain".to_owned())]);
        let ChannelValues::Integers(stamps) = &found[0] else { panic!("expected integers") };
        assert_eq!(stamps[1], Some(1_700_000_000_010));
        assert_eq!(log.channels()[wanted[0]].kind, ChannelKind::Stamp(1000));
        assert_eq!(log.clocks()[0].time, ClockTime::Channel(wanted[0]));
    }
    let old = open(b"FEA1 and more").err().expect("it is old").to_string();
    assert!(old.contains("expected version 2 of Feather"), "{old}");
}

#[test]
fn a_file_of_arrow_whose_footer_counts_is_refused_without_it() {
    let bytes = by_footer(&arrow(false, None));
    let error = open(&bytes[..bytes.len() - 5]).err().expect("its footer is cut").to_string();
    assert!(error.contains("was the file copied in full?"), "{error}");
}

#[test]
fn a_file_of_arrow_that_was_cut_off_is_read_up_to_there() {
    let bytes = arrow(true, None);
    let mut log = log(&bytes[..bytes.len() * 3 / 4]);
    assert_eq!(numbers(&mut log, "f"), [0.5, 1.0, 2.0]);
    assert!(log.warnings().last().is_some_and(|it| it.contains("was cut off")), "{:?}", log.warnings());
}

#[test]
fn arrays_of_matlab_share_the_time_of_their_struct() {
    let text = |it: &str| Made::Text(it.to_owned());
    let signal = |label: &str, values: &[f64]| vec![column(values), text(label)];
    let fields = vec!["values", "label"];
    let made = vec![
        ("t", column(&[0.0, 0.5, 1.0])),
        ("v", column(&[1.0, 2.0, 3.0])),
        ("v_unit", text("km/h")),
        ("gain", column(&[7.0])),
        ("M", Made::Doubles(vec![3, 2], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
        ("other", column(&[8.0, 9.0])),
        ("speed", Made::Struct(vec![("Time", column(&[0.0, 0.1])), ("Data", column(&[5.0, 6.0]))])),
        (
            "scope",
            Made::Struct(vec![
                ("time", column(&[0.0, 0.2])),
                (
                    "signals",
                    Made::Structs(fields, vec![signal("delta", &[0.25, 0.5]), signal("", &[-1.0, -2.0])]),
                ),
            ]),
        ),
    ];
    let mut log = log(&mat::file(&made, true));
    assert_eq!(log.format, "MAT");
    let about = |it: &LogChannel| {
        let time = match log.clocks()[it.clock].time {
            ClockTime::Channel(time) => {
                format!("{}.{}", log.channels()[time].group, log.channels()[time].name)
            }
            _ => "-".to_owned(),
        };
        format!("{}.{} over {time} {}", it.group, it.name, it.unit.clone().unwrap_or_default())
    };
    let about: Vec<_> = log.channels().iter().map(about).collect();
    for expected in [
        ".t over .t ",
        ".v over .t km/h",
        ".M[1] over .t ",
        ".M[2] over .t ",
        ".other over - ",
        ".speed over speed.Time ",
        "scope.delta over scope.time ",
        "scope.signals(2) over scope.time ",
    ] {
        assert!(about.iter().any(|it| it == expected), "{expected}: {about:?}");
    }
    assert_eq!(about.len(), 10, "{about:?}");
    assert_eq!(numbers(&mut log, "M[2]"), [4.0, 5.0, 6.0]);
    assert_eq!(numbers(&mut log, "speed"), [5.0, 6.0]);
    assert_eq!(numbers(&mut log, "delta"), [0.25, 0.5]);
    let hdf5 = open(b"\x89HDF\r\n\x1a\n and more").err().expect("it is refused").to_string();
    assert!(hdf5.contains("the HDF5 file cannot be read"), "{hdf5}");
}

#[test]
fn other_files_are_none_of_these_logs() {
    for bytes in [&b"t,v\n0,1\n"[..], b"", b"@", b"\x89MCAP0\r\n", b"PK\x03\x04", &[0xff; 9]] {
        assert!(open(bytes).expect("it can be read").is_none(), "{bytes:?}");
    }
    let missing = LogFile::open(std::path::Path::new("no/such/file")).err().expect("it is not there");
    assert!(missing.to_string().starts_with("cannot be read"), "{missing}");
}
