//! Values between, before and after recorded ones, and what a CSV file may have wrong.

use super::{Interpolation, ReadRequest, TableError, TimeSeriesTable};

fn read(name: &str, text: &str, columns: &[&str]) -> Result<TimeSeriesTable, TableError> {
    let file = format!("table-{name}-{}.csv", std::process::id());
    let path = std::env::temp_dir().join(file);
    std::fs::write(&path, text).expect("the temporary folder is writable");
    let table = TimeSeriesTable::read(&path, &ReadRequest::from_names("t", columns));
    std::fs::remove_file(&path).expect("it has just been written");
    table
}

const RECORDING: &str = "# t , v, note,a\n10, 1,first,-1\n10.5,2,second,-2\n12,5e0,third,-3\n";

#[test]
fn values_are_interpolated_held_and_clamped() {
    let mut linear = read("linear", RECORDING, &["a", "v"]).expect("it is well-formed");
    assert_eq!(linear.column_names().collect::<Vec<_>>(), ["a", "v"]);
    assert_eq!(linear.clock_times(), [[0.0, 0.5, 2.0]]);
    assert_eq!(linear.value_at(0, 0.5), -2.0);
    linear.set_origin(Some(0.0));
    let mut hold = linear.clone();
    hold.set_interpolation(Interpolation::Hold);
    for (stamp, between, last) in [
        (0.0, 1.0, 1.0),
        (10.0, 1.0, 1.0),
        (10.25, 1.5, 1.0),
        (10.5, 2.0, 2.0),
        (11.0, 3.0, 2.0),
        (12.0, 5.0, 5.0),
        (99.0, 5.0, 5.0),
        (10.25, 1.5, 1.0),
        (-1.0, 1.0, 1.0),
    ] {
        assert_eq!(linear.value_at(1, stamp), between, "{stamp}");
        assert_eq!(hold.value_at(1, stamp), last, "{stamp}");
    }
    let mut shifted = linear.clone();
    for (origin, expected) in [(Some(9.5), 2.0), (Some(10.0), 3.0), (None, 3.0)] {
        shifted.set_origin(origin);
        assert_eq!(shifted.value_at(1, 1.0), expected, "{origin:?}");
    }
}

#[test]
fn a_late_column_has_times_of_its_own() {
    let file = format!("table-late-{}.csv", std::process::id());
    let path = std::env::temp_dir().join(file);
    std::fs::write(&path, RECORDING).expect("the temporary folder is writable");
    let mut request = ReadRequest::from_names("t", &["a", "v", "v"]);
    request.columns[1].delay = 0.25;
    let mut table = TimeSeriesTable::read(&path, &request).expect("it is well-formed");
    std::fs::remove_file(&path).expect("it has just been written");
    // The time of the scenario begins with the stamps of the file.
    assert_eq!(table.clock_times(), [[0.0, 0.5, 2.0], [-0.25, 0.25, 1.75]]);
    assert_eq!([0, 1, 2].map(|column| table.column_clock(column)), [0, 1, 0]);
    assert_eq!([1, 2].map(|column| table.value_at(column, 0.25)), [2.0, 1.5]);
}

#[test]
fn rows_outside_of_all_stretches_are_left_out() {
    let text = "t,x\n10,0\n11,1\n12,2\n13,3\n14,4\n";
    let mut table = read("during", text, &["x"]).expect("it is well-formed");
    table.keep_time_ranges(&[[0.0, 1.0], [3.5, 9.0]]).expect("rows");
    assert_eq!(
        (table.clock_times(), table.column_values(0)),
        (vec![vec![0.0, 1.0, 4.0]], &[0.0, 1.0, 4.0][..])
    );
    assert_eq!(table.keep_time_ranges(&[[1.5, 3.0]]), Err(("x".to_owned(), [0.0, 4.0])));
    assert_eq!(table.column_values(0).len(), 3);
}

#[test]
fn any_order_of_times_gives_the_same_values() {
    let rows = (0..50).map(|i| format!("{},{}\n", f64::from(i) * 0.1, i * i % 17));
    let text = format!("t,x\n{}", rows.collect::<String>());
    let mut table = read("order", &text, &["x"]).expect("it is well-formed");
    let fresh = table.clone();
    for i in 0..200 {
        let time = f64::from(i * 37 % 200) * 0.025;
        let expected = fresh.clone().value_at(0, time);
        assert_eq!(table.value_at(0, time), expected, "{time}");
    }
}

#[test]
fn held_values_change_at_times_that_rounding_puts_before_their_stamp() {
    let text = "t,x\n0,0\n0.1,1\n0.2,2\n0.3,3\n0.6,6\n0.7,7\n1.1,11\n";
    let mut table = read("edge", text, &["x"]).expect("it is well-formed");
    table.set_interpolation(Interpolation::Hold);
    for stamp in [0.1, 0.2, 0.3, 0.6, 0.7, 1.1_f64] {
        assert_eq!(table.value_at(0, stamp - 1e-12), (stamp * 10.0).round(), "{stamp}");
    }
}

#[test]
fn errors_name_the_line_and_the_column() {
    #[rustfmt::skip]
    let cases = [
        ("empty", "", "found nothing"),
        ("header", "t,v\n", "found only a header"),
        ("column", "t,vel\n0,1\n", "no column `v` in "),
        ("list", "t,V,w\n0,1,2\n", "it has t, V, w; did you mean `V`?"),
        ("time", "x,v\n0,1\n", "no column `t`"),
        ("cell", "t,v\n0,1\n1,abc\n", "line 3 of"),
        ("text", "t,v\n0,1\n1,abc\n", "in column `v`, found \"abc\""),
        ("gap", "t,v\n0,\n", "`v` has no value in any row"),
        ("nan", "t,v\n0,1\n1,2\n2,NaN\n", "the first one in line 4: say `gaps = \"hold\"`"),
        ("infinite", "t,v\n0,inf\n", "a finite number in column `v`, found \"inf\""),
        ("repeated", "t,v\n0,1\n\n1,2\n1,3\n", "line 5 of"),
        ("falling", "t,v\n0,1\n2,2\n1.5,3\n", "a time after 2 of the row before, found 1.5"),
        ("ragged", "t,v\n0,1\n1\n", "line 3 of"),
        ("cells", "t,v\n0,1,7\n", "has 3 cells, expected 2"),
    ];
    for (name, text, part) in cases {
        let error = read(name, text, &["v"]).expect_err(name).to_string();
        assert!(error.contains(part), "{name}: {error}");
    }
    let missing = TimeSeriesTable::read("no/such/file.csv", &ReadRequest::from_names("t", &[]))
        .expect_err("it does not exist");
    assert!(missing.to_string().starts_with("cannot open"), "{missing}");
}
