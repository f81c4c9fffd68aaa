//! Tests that tables come back from Parquet as they went there, and that nobody sees half a file.

use std::path::Path;

use sweep::table::{
    RowGroups, SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable, SweepTableReader,
    SweepTableWriter, read_table, write_table,
};

/// Rows from `first` on, with everything missing in every third.
fn table(first: i64, rows: i64) -> SweepTable {
    let all = || first..first + rows;
    let some = |k: i64| k % 3 != 2;
    let mass = all().map(|k| if some(k) { 0.1 * k as f64 } else { f64::NAN }).collect();
    let passed = all().map(|k| some(k).then_some(k % 2 == 0)).collect();
    let text = all().map(|k| some(k).then(|| format!("größer <{k}>"))).collect();
    let columns = vec![
        SweepColumn::new("variant", SweepColumnRole::Variant, SweepColumnValues::Integers(all().collect())),
        SweepColumn::new("plant.body.m", SweepColumnRole::Parameter, SweepColumnValues::Numbers(mass))
            .with_unit(Some("kg")),
        SweepColumn::new("check.lane", SweepColumnRole::Check, SweepColumnValues::Booleans(passed)),
        SweepColumn::new("error", SweepColumnRole::Error, SweepColumnValues::Texts(text)),
    ];
    SweepTable { columns }
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a folder")
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let names = entries.map(|it| it.expect("an entry").file_name());
    names.map(|name| name.to_string_lossy().into_owned()).collect()
}

#[test]
fn a_table_comes_back_and_the_same_one_gives_the_same_bytes() {
    let folder = folder();
    for rows in [0, 1, 1000] {
        let path = folder.path().join("t.parquet");
        write_table(&path, &table(0, rows)).expect("it is written");
        assert_eq!(read_table(&path).expect("it is read"), table(0, rows), "{rows} rows");
        let first = std::fs::read(&path).expect("bytes");
        // Metadata passes through maps without an order.
        for _ in 0..8 {
            write_table(&path, &table(0, rows)).expect("it is written");
            assert_eq!(std::fs::read(&path).expect("bytes"), first);
        }
    }
    assert_eq!(names(folder.path()), ["t.parquet"]);
}

#[test]
fn files_are_as_readable_as_others() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = folder();
    let [other, own] = ["other", "t.parquet"].map(|name| folder.path().join(name));
    std::fs::write(&other, "").expect("it is written");
    write_table(&own, &table(0, 1)).expect("it is written");
    let [other, own] = [other, own].map(|path| std::fs::metadata(path).expect("a file").permissions().mode());
    assert_eq!(own, other);
}

#[test]
fn row_groups_are_read_one_by_one() {
    let folder = folder();
    let path = folder.path().join("plan.parquet");
    let mut writer = SweepTableWriter::create(&path, &table(0, 0), RowGroups::Tables).expect("a file");
    for chunk in 0..5 {
        assert!(!path.exists());
        writer.append(&table(100 * chunk, 100)).expect("it is appended");
    }
    writer.finish().expect("it is finished");
    let reader = SweepTableReader::open(&path).expect("a table");
    assert_eq!((reader.row_group_count(), reader.row_count()), (5, 500));
    assert_eq!(reader.columns(), &table(0, 0));
    assert_eq!(reader.read_row_group(3).expect("a group"), table(300, 100));
    assert_eq!(reader.read_all_rows().expect("all"), table(0, 500));
    let error = reader.read_row_group(5).expect_err("there are five").to_string();
    assert!(error.contains("plan.parquet") && error.contains("found 5"), "{error}");
}

#[test]
fn even_files_do_not_show_how_their_rows_came() {
    let folder = folder();
    let written = |size: i64| {
        let path = folder.path().join(format!("{size}.parquet"));
        let mut writer = SweepTableWriter::create(&path, &table(0, 0), RowGroups::Even).expect("a file");
        let chunks = (0..150_000).step_by(size as usize);
        for first in chunks {
            writer.append(&table(first, size.min(150_000 - first))).expect("it is appended");
        }
        writer.finish().expect("it is finished");
        (
            SweepTableReader::open(&path).expect("a table").row_group_count(),
            std::fs::read(&path).expect("bytes"),
        )
    };
    let (groups, bytes) = written(150_000);
    assert_eq!(groups, 3);
    assert!(written(777) == (groups, bytes));
}

#[test]
fn a_writer_that_is_dropped_leaves_nothing() {
    let folder = folder();
    let path = folder.path().join("t.parquet");
    let mut writer = SweepTableWriter::create(&path, &table(0, 0), RowGroups::Tables).expect("a file");
    writer.append(&table(0, 10)).expect("it is appended");
    drop(writer);
    assert!(names(folder.path()).is_empty());
}

#[test]
fn columns_that_do_not_fit_are_named() {
    let folder = folder();
    let path = folder.path().join("t.parquet");
    let mut writer = SweepTableWriter::create(&path, &table(0, 0), RowGroups::Even).expect("a file");
    let mut append = |table: &SweepTable| writer.append(table).expect_err("it does not fit").to_string();
    let mut other = table(0, 1);
    other.columns[1].unit = Some("t".to_owned());
    let error = append(&other);
    assert!(error.contains("expected column `plant.body.m` [kg]"), "{error}");
    let mut short = table(0, 2);
    short.columns[2].values = SweepColumnValues::Booleans(vec![None]);
    let error = append(&short);
    assert!(error.contains("expected 2 rows in column `check.lane`, found 1"), "{error}");
    let mut twice = table(0, 1);
    twice.columns[3].name = "check.lane".to_owned();
    assert!(append(&twice).contains("two columns have the name `check.lane`"));
}

#[test]
fn damaged_and_foreign_files_are_refused_by_name() {
    let folder = folder();
    let path = folder.path().join("t.parquet");
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).expect("it is written");
        read_table(&path).err().map(|error| error.to_string())
    };
    for bytes in [&b""[..], b"PAR1", b"variant,m\n0,1\n", b"PAR1PAR1PAR1PAR1"] {
        let error = refused(bytes).expect("no table");
        assert!(error.contains("t.parquet: expected a table of a sweep"), "{error}");
    }
    write_table(&path, &table(0, 50)).expect("it is written");
    let whole = std::fs::read(&path).expect("bytes");
    for length in (0..whole.len()).step_by(7) {
        assert!(refused(&whole[..length]).is_some(), "cut to {length} bytes");
    }
    // Whatever is in it, the program goes on.
    for place in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[place] ^= 0x55;
        let _ = refused(&bytes);
    }
}

#[test]
fn rows_that_were_changed_have_another_checksum() {
    let folder = folder();
    let path = folder.path().join("t.parquet");
    write_table(&path, &table(0, 100)).expect("it is written");
    let reader = SweepTableReader::open(&path).expect("it is open");
    let rows = reader.read_all_rows().expect("it is read");
    reader.check_rows(&rows).expect("they are the same");
    let mut changed = rows.clone();
    if let SweepColumnValues::Numbers(masses) = &mut changed.columns[1].values {
        masses[7] = f64::from_bits(masses[7].to_bits() ^ 1);
    }
    let error = reader.check_rows(&changed).expect_err("one bit is another");
    assert!(error.to_string().contains("t.parquet") && error.to_string().contains("checksum"), "{error}");
}
