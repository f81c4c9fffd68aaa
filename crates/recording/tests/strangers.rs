//! Reads the text logs of others in `data/corpus` of a folder `shared` beside the repository, or of `TRACKSIDE_DATA`.

use std::path::{Path, PathBuf};

use recording::table;

type TestError = Box<dyn std::error::Error>;

#[test]
#[ignore = "needs data/corpus"]
fn logs_of_strangers_are_read() {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let data = std::env::var_os("TRACKSIDE_DATA").map_or_else(beside, PathBuf::from);
    for file in FILES {
        let read = read(&data.join("corpus").join(file.path), file);
        read.unwrap_or_else(|error| panic!("{}: {error}", file.path));
    }
}

/// What a file has: its format, and of some channels unit, rows, least and greatest value.
struct Expected {
    path: &'static str,
    format: &'static str,
    channels: &'static [(&'static str, &'static str, u64, [f64; 2])],
}

/// Values as a search by `awk` in the files finds them.
const FILES: &[Expected] = &[
    Expected {
        path: "csv/accessport.csv",
        format: "Accessport CSV: titles in line 1",
        channels: &[
            ("Coolant Temp", "degC", 18_033, [84.0, 95.0]),
            ("Vehicle Speed", "km/h", 18_033, [0.0, 138.0]),
            ("Req Torque", "N.m", 18_033, [0.0, 350.0]),
        ],
    },
    Expected {
        path: "vbo/vbox_hd2.vbo",
        format: "VBOX",
        channels: &[
            ("velocity", "km/h", 2913, [10.764, 252.407]),
            ("ComboAcc", "g0", 2913, [0.002_607_59, 2.003_68]),
            ("Engine_Speed", "rpm", 2913, [872.0, 8036.0]),
            ("Brake_Pressure_Front", "bar", 2913, [0.0, 36.95]),
            ("Throttle_Pedal", "%", 2913, [2.9, 97.6]),
            ("Vehicle_Speed", "km/h", 2913, [11.2, 253.6]),
        ],
    },
];

fn read(path: &Path, expected: &Expected) -> Result<(), TestError> {
    let survey = table::survey_file(path, recording::survey::SurveyExtent::Whole)?;
    assert_eq!(survey.format, expected.format);
    for (name, unit, rows, range) in expected.channels {
        let channel = survey.channels.iter().find(|it| it.name == *name);
        let channel = channel.ok_or_else(|| format!("no channel {name}"))?;
        assert_eq!((channel.unit.as_deref(), channel.tally.values), (Some(*unit), *rows), "{name}");
        let (least, most) = channel.tally.range.ok_or_else(|| format!("{name} has no value"))?;
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-5 * b.abs();
        assert!(near(least, range[0]) && near(most, range[1]), "{name}: {least} to {most}");
    }
    Ok(())
}
