//! Text files laid out as those of loggers and programs, with their units, sources and times.

use std::path::Path;

use super::parse_csv_columns;
use super::text::CsvText;
use crate::table::read_request::ReadRequest;
use crate::table::{TableError, TimeSeriesTable, gaps};

fn read(text: &str, request: &ReadRequest) -> Result<TimeSeriesTable, TableError> {
    let path = Path::new("log.csv");
    let mut recorded = parse_csv_columns(path, &CsvText::Memory(text.as_bytes().to_owned()), request)?;
    gaps::fill_gaps(path, &mut recorded, &request.columns)?;
    TimeSeriesTable::new(recorded, request)
}

/// What a file must give: as what it is read, then of some columns name, unit and first value, and the times.
struct Case {
    text: &'static str,
    description: &'static str,
    columns: &'static [(&'static str, Option<&'static str>, f64)],
    times: [f64; 2],
}

const RACECHRONO: &str = "\
This file is created using RaceChrono Pro v9.1.3 ( http://racechrono.com/ ).
Format,3
Session title,\"Test, track\"
Created,09/02/2026,19:19
Note,

timestamp,lap_number,speed,lateral_acc,speed,rate_of_rotation_z,oil,satellites
unix time,,m/s,G,m/s,deg/s,.C,sats
,,100: gps,calc,200: canbus,101: gyro,200: canbus,100: gps
1770664802.000,1,20.5,0.25,21.5,1.5,90,7
1770664802.500,1,20.6,0.26,21.6,1.6,91,8
";

const CASES: &[Case] = &[
    Case {
        text: RACECHRONO,
        description: "RaceChrono CSV v3: titles in line 7, units in line 8, sources in line 9",
        columns: &[
            ("speed [gps]", Some("m/s"), 20.5),
            ("speed [canbus]", Some("m/s"), 21.5),
            ("speed #2", Some("m/s"), 21.5),
            ("lateral_acc", Some("g0"), 0.25),
            ("rate_of_rotation_z", Some("deg/s"), 1.5),
            ("oil", Some("degC"), 90.0),
            ("satellites", Some("1"), 7.0),
        ],
        times: [1_770_664_802.0, 1_770_664_802.5],
    },
    Case {
        text: "This file is created using RaceChrono v4.20\nFormat,2\n\n\
               Time (s),Lap #,Speed (m/s) *gps,Speed (kph) *canbus,RPM (rpm) *canbus\n0.1,1,20,72,3000\n0.2,1,21,73,3100\n",
        description: "RaceChrono CSV v2: titles in line 4",
        columns: &[
            ("Speed [gps]", Some("m/s"), 20.0),
            ("Speed [canbus]", Some("km/h"), 72.0),
            ("RPM", Some("rpm"), 3000.0),
        ],
        times: [0.1, 0.2],
    },
    Case {
        text: "\"Format\",\"MoTeC CSV File\",,,\"Workbook\",\"\"\r\n\"Device\",\"ADL\"\r\n\
               \"Sample Rate\",\"100.000\",\"Hz\",,\"End Time\",\"30.000\",\"s\"\r\n\"Beacon Markers\",\"14.2 29.8\"\r\n\r\n\r\n\
               \"Time\",\"Ground Speed\",\"Time\",\"G Force Lat\",\"Gear\"\r\n\"s\",\"km/h\",\"min\",\"G\",\"\"\r\n\r\n\r\n\
               \"0.000\",\"72.0\",\"1\",\"0.37\",\"3\"\r\n\"0.010\",\"72.1\",\"1\",\"0.36\",\"3\"\r\n",
        description: "MoTeC i2 CSV: titles in line 7, units in line 8",
        columns: &[
            ("Ground Speed", Some("km/h"), 72.0),
            ("G Force Lat", Some("g0"), 0.37),
            ("Gear", None, 3.0),
            ("Time #2", Some("min"), 1.0),
        ],
        times: [0.0, 0.01],
    },
    Case {
        text: "Format,AiM CSV File,,\nDate,\"Sunday, June 19, 2022\",,\nTime,3:42 PM,,\nSample Rate,20,,\n\
               Beacon Markers,77.2,149.1,951\nSegment Times,1:17.200,1:11.928,\n,,,\n\
               Time,GPS Speed,GPS LatAcc,Yaw Rate\ns,km/h,g,deg/s\n\n0,72,0.5,3\n0.05,73,0.6,4\n",
        description: "AiM Race Studio CSV: titles in line 8, units in line 9",
        columns: &[
            ("GPS Speed", Some("km/h"), 72.0),
            ("GPS LatAcc", Some("g0"), 0.5),
            ("Yaw Rate", Some("deg/s"), 3.0),
        ],
        times: [0.0, 0.05],
    },
    Case {
        text: "\"Format\";\"AiM CSV File\"\n\"Duration\";\"1,5\"\n\n\"Time\";\"GPS Speed\"\n\"s\";\"mph\"\n\n\"0,0\";\"72,5\"\n\"0,1\";\"73,5\"\n",
        description: "AiM Race Studio CSV: titles in line 4, units in line 5",
        columns: &[("GPS Speed", Some("mph"), 72.5)],
        times: [0.0, 0.1],
    },
    Case {
        text: "Harry's GPS LapTimer\nINDEX,DATE,TIME,TIME_LAP,SPEED_KPH,LATERALG,GPSFIX[NOFIX/2D/3D/UNKNOWN]\n\
               1,14-AUG-16,16:57:02.65,0.0,102.6,0.15,3\n2,14-AUG-16,16:57:02.75,0.1,102.7,0.16,3\n",
        description: "Harry's LapTimer CSV: titles in line 2",
        columns: &[("SPEED_KPH", None, 102.6), ("LATERALG", None, 0.15)],
        times: [61_022.65, 61_022.75],
    },
    Case {
        text: "ETASAsciiItemFile\trecord\tCrLf\tTab\r\nsampleCount\t2\r\ntime\tvx\\CCP:1\tTamb\t\r\nf8\tf8\tf8\t\r\n\
               \"s\"\t\"km/h\"\t\"°C\"\t\r\n0.01\t72\t20.5\t\r\n0.02\t73\t20.6\t\r\n",
        description: "INCA ASCII: titles in line 3, units in line 5",
        columns: &[("vx\\CCP:1", Some("km/h"), 72.0), ("Tamb", Some("degC"), 20.5)],
        times: [0.01, 0.02],
    },
    Case {
        text: "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.twist.linear.x\n\
               1692117187000000000,5,1692117186990000000,base,20.5\n1692117187500000000,6,1692117187490000000,base,21.5\n",
        description: "rostopic CSV: titles in line 1",
        columns: &[("field.twist.linear.x", None, 20.5)],
        times: [1_692_117_187.0, 1_692_117_187.5],
    },
    Case {
        text: "# RaceRender Data: TrackAddict 4.8.2 on Android 14\n# Vehicle: x, y\n\
               \"Time\",\"Lap\",\"Speed (Km/h)\",\"Accel X\",\"Engine Speed (RPM) *OBD\"\n0.000,0,72,0.1,3000\n0.065,0,73,0.2,3100\n# Lap 0: 00:02:03.202\n",
        description: "TrackAddict CSV: titles in line 3",
        columns: &[("Speed", Some("km/h"), 72.0), ("Engine Speed", Some("rpm"), 3000.0)],
        times: [0.0, 0.065],
    },
    Case {
        text: "GPS Time, Device Time, Longitude,GPS Speed (Meters/second),Acceleration Sensor(Total)(g),Engine RPM(rpm)\n\
               Sun Oct 05 14:22:01 PDT 2026,05-Oct-2026 14:22:01.100,-118.1,10,0.1,2100\n\
               GPS Time, Device Time, Longitude,GPS Speed (Meters/second),Acceleration Sensor(Total)(g),Engine RPM(rpm)\n\
               Sun Oct 05 14:22:01 PDT 2026,05-Oct-2026 14:22:01.600,-118.1,11,0.2,2200\n",
        description: "Torque CSV: titles in line 1",
        columns: &[
            ("GPS Speed", Some("m/s"), 10.0),
            ("Acceleration Sensor(Total)", Some("g0"), 0.1),
            ("Engine RPM", Some("rpm"), 2100.0),
        ],
        times: [1_791_210_121.1, 1_791_210_121.6],
    },
    Case {
        text: "Time (sec),Coolant Temp (C),Gear Position (Gear),Vehicle Speed (kph),AP Info:[AP3-SUB-004 v1.7]\n\
               0.000,87,0,72,0\n0.014,87,0,73,0\n",
        description: "Accessport CSV: titles in line 1",
        columns: &[("Coolant Temp", Some("degC"), 87.0), ("Vehicle Speed", Some("km/h"), 72.0)],
        times: [0.0, 0.014],
    },
];

#[test]
fn the_text_files_of_loggers_are_recognised_with_units_sources_and_times() {
    for Case { text, description, columns, times } in CASES {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("log.csv");
        std::fs::write(&path, text).expect("a file");
        let found = super::csv_titles(&path).unwrap_or_else(|it| panic!("{description}: {it}"));
        assert_eq!((found.format.as_str(), found.has_time), (*description, true));
        let names: Vec<&str> = columns.iter().map(|(name, ..)| *name).collect();
        let request = ReadRequest { time: None, ..ReadRequest::from_names("", &names) };
        let mut table = read(text, &request).unwrap_or_else(|it| panic!("{description}: {it}"));
        table.set_origin(Some(0.0));
        assert_eq!(table.clock_times()[0], times, "{description}");
        for (place, (name, unit, first)) in columns.iter().enumerate() {
            assert_eq!(
                (table.column_unit(place), table.column_values(place)[0]),
                (*unit, *first),
                "{description}: {name}"
            );
        }
    }
}

#[test]
fn a_title_that_occurs_twice_is_asked_back_with_names_that_are_read() {
    let error =
        read(RACECHRONO, &ReadRequest::from_names("timestamp", &["speed"])).expect_err("there are two");
    let named = "can be any of the columns `speed [gps]`, `speed [canbus]` of log.csv: name one of them so";
    assert!(error.to_string().contains(named), "{error}");
}

/// Columns between blanks, as IPG CarMaker and many programs write them, with the titles as comments or not.
#[test]
fn blanks_separate_where_nothing_else_does() {
    for (name, head) in [
        ("plain", "Time Car.v Car.Yaw\n"),
        ("notes", "the log of a car on a track\nTime [s] Car.v [m/s] Car.Yaw [rad]\n"),
        ("units in titles", "Time [s]   Car.v [m/s]\tCar.Yaw [rad]\n"),
        ("comments", "# made by a program\n#  Time   Car.v   Car.Yaw\n#  s  m/s  rad\n"),
        ("units below", "Time\tCar.v Car.Yaw\n[s] [m/s]  [rad]\n"),
    ] {
        let rows = "   0.0    20.5  0.1\n  0.01\t20.6   0.2\n";
        let table = read(&format!("{head}{rows}"), &ReadRequest::from_names("Time", &["Car.v", "Car.Yaw"]));
        let table = table.unwrap_or_else(|it| panic!("{name}: {it}"));
        assert_eq!(
            (table.column_values(0), table.column_values(1)),
            (&[20.5, 20.6][..], &[0.1, 0.2][..]),
            "{name}"
        );
        let unit = (name != "plain").then_some("m/s");
        assert_eq!(table.column_unit(0), unit, "{name}");
    }
}

/// RaceChrono writes some rows twice.
#[test]
fn a_row_like_the_one_before_it_is_left_out() {
    let table = read("t,v\n0,1\n1,2\n1,2\n2,3\n", &ReadRequest::from_names("t", &["v"])).expect("a table");
    assert_eq!(table.column_values(0), [1.0, 2.0, 3.0]);
    let warning = "1 row of log.csv like the row before, cell by cell, left out, the first one in line 4";
    assert_eq!(table.warnings(), [warning]);
    let error = read("t,v\n0,1\n1,2\n1,3\n", &ReadRequest::from_names("t", &["v"])).expect_err("they differ");
    assert!(error.to_string().contains("expected a time after 1"), "{error}");
}

#[test]
fn a_time_in_two_columns_is_their_sum() {
    for (seconds, nanoseconds) in [("sec", "nanosec"), ("secs", "nsecs")] {
        let title = |end: &str| format!("header.stamp.{end}");
        let text =
            format!("{},{},v\n5,250000000,1\n5,750000000,2\n6,0,3\n", title(seconds), title(nanoseconds));
        for time in ["header.stamp", &title(seconds)] {
            let table = read(&text, &ReadRequest::from_names(time, &["v"])).expect("a table");
            assert_eq!(table.clock_times()[0], [0.0, 0.5, 0.75], "{time}");
        }
    }
}

#[test]
fn titles_are_above_the_first_rows_whatever_notes_are_there() {
    for (name, text) in [
        ("a date", "Log\nDate,7/06/2026,Origin Time,0.0,s\nt,v\n0,1\n1,2\n"),
        ("pairs of notes", "Vehicle,Car\nDate,2024-05-01\nt,v\n0,1\n1,2\n"),
        ("text cells", "t,v,state\n0,1,idle\n1,2,drive\n"),
        ("gaps", "t,v,w\n0,1,\n1,2,\n2,,3\n"),
        ("rows apart", "t,v\n\n0,1\n\n1,2\n"),
        ("three lines", "t,v\ns,m/s\nf8,f8\n0,1\n1,2\n"),
        ("a footer", "t,v\n0,1\n1,2\n# end of log\n"),
        ("pandas", ",t,v\n0,0,1\n1,1,2\n"),
        ("no value in words", "t,v\n0,1\n1,2\n2,NaN\n"),
    ] {
        let mut request = ReadRequest::from_names("t", &["v"]);
        request.columns[0].gaps = crate::table::read_request::GapRule::Drop;
        let table = read(text, &request).unwrap_or_else(|it| panic!("{name}: {it}"));
        assert_eq!(table.column_values(0), [1.0, 2.0], "{name}");
    }
}
