//! What tries damaged CSV tables.

use std::path::Path;

use damage::FuzzTarget;
use recording::GoldenRecording;
use recording::table::{self, ColumnType, CsvDialect, GapRule, ReadRequest, TimeSeriesTable};

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "tables",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../recording/tests/corpus/tables"),
    sound,
    words: &[
        "time",
        "t",
        "v_x",
        "v_x [km/h]",
        "[m/s]",
        "(s)",
        "nan",
        "-",
        "inf",
        "true",
        ",",
        ";",
        "\t",
        "\r",
        "\r\n",
        "\n",
        "\"",
        "\"\"",
        "#",
        "# ",
        "1,5",
        "1.234,5",
        "0x1f",
        "12:34:56.5",
        "2024-02-29T12:00:00Z",
        "state",
        "gear",
        "\u{feff}",
        "\u{b0}",
        "1e400",
        " ",
        "9007199254740993",
    ],
    own: None,
    attempt,
};

fn sound() -> Vec<Vec<u8>> {
    let texts = [
        "time,v_x,gear,state\n0,1.5,1,off\n0.1,2.5,2,on\n0.2,nan,3,\"a \"\"b\"\"\"\n0.3,4,-4,x\n",
        "# a drive\n\ntime;v_x [km/h];gear;state\ns;km/h;;\n0,0;1,5;1;a\n0,1;2,5;2;b\n0,2;3,25;3;c\n",
        "time\tv_x (m/s)\tgear\tstate\r\n12:00:00.0\t1\t9007199254740993\ta\r\n12:00:00.5\t\t2\tb\r\n12:00:01\t3\t3\tc\r\n",
        "\u{feff}#time,v_x,gear,state\n0,-1,0,\n1,-2,1,\n2,-3,-9223372036854775808,\n",
    ];
    texts.map(|text| text.as_bytes().to_vec()).to_vec()
}

/// Reads the table in all ways that there are, and plays it back.
fn attempt(bytes: &[u8], folder: &Path) -> bool {
    let path = folder.join("x.csv");
    std::fs::write(&path, bytes).expect("it can be written");
    let mut taken = false;
    for gaps in [GapRule::Interpolate, GapRule::Drop] {
        let mut wanted = ReadRequest::from_names("time", &["v_x", "gear", "state"]);
        wanted.columns[0].gaps = gaps;
        wanted.columns[0].delay = if gaps == GapRule::Drop { 0.05 } else { 0.0 };
        wanted.columns[1].column_type = ColumnType::Integer;
        wanted.columns[1].gaps = gaps;
        wanted.columns[2].column_type = ColumnType::Text;
        wanted.dialect = CsvDialect::default();
        wanted.jumps = gaps == GapRule::Drop;
        let Ok(mut table) = TimeSeriesTable::read(&path, &wanted) else { continue };
        taken = true;
        for clock in table.clock_times() {
            assert!(!clock.is_empty() && clock.iter().all(|time| time.is_finite()), "{clock:?}");
            assert!(clock.is_sorted(), "{clock:?}");
        }
        assert!(table.column_values(0).iter().all(|value| value.is_finite()));
        for time in [-1.0, 0.0, 0.1, 0.15, 5.0, 1e300, f64::NAN, 0.0] {
            for column in 0..3 {
                table.value_at(column, time);
            }
        }
    }
    if let Ok(titles) = table::read_titles(&path) {
        assert!(titles.columns.iter().all(|title| !title.name.is_empty()));
    }
    let _ = table::read_untimed_columns(&path, None, &["v_x"]);
    if let Ok(whole) = GoldenRecording::read(&path, &["state"]) {
        assert!(!whole.times.is_empty());
    }
    taken
}
