//! Reads hand-made files with known values, and files that are no MDF.

use crate::files;
use crate::old;

use mdf_file::{ChannelValueKind, ChannelValues, ClockColumns, Error, MasterAxis, MdfFile};

/// A file of these bytes, open.
fn open(bytes: &[u8]) -> Result<MdfFile, Error> {
    MdfFile::new(std::io::Cursor::new(bytes.to_vec()))
}

fn read(file: &mut MdfFile, name: &str) -> ClockColumns {
    let at = file.channels().iter().position(|it| it.name == name);
    let at = at.unwrap_or_else(|| panic!("no {name} in {:?}, {:?}", file.channels(), file.warnings()));
    file.read_columns(&[at]).expect("values").remove(0)
}

fn numbers(file: &mut MdfFile, name: &str) -> Vec<f64> {
    match read(file, name).values.remove(0) {
        ChannelValues::Numbers(all) => all,
        other => panic!("{name}: {other:?}"),
    }
}

fn texts(file: &mut MdfFile, name: &str) -> Vec<String> {
    match read(file, name).values.remove(0) {
        ChannelValues::Texts(all) => all.into_iter().map(Option::unwrap_or_default).collect(),
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn values_of_any_bits_and_order_are_exact() {
    let mut file = open(&files::bits()).expect("a file");
    assert_eq!(numbers(&mut file, "be16")[..3], [1.0, 1001.0, 2001.0]);
    assert_eq!(numbers(&mut file, "be32")[..2], [-70_000.0, -140_000.0]);
    assert_eq!(numbers(&mut file, "bef64")[..2], [-1.0, -0.9]);
    assert_eq!(numbers(&mut file, "f16")[..2], [1.0, 1.0 + 2f64.powi(-10)]);
    assert_eq!(numbers(&mut file, "u24")[1], f64::from(0x0012_3457));
    // The first three bytes of the first row are 0x91, 0x3c, 0x5a.
    let first = ["u3", "i5", "u1", "u12"].map(|it| numbers(&mut file, it)[0]);
    assert_eq!(first, [4.0, 4.0, 1.0, f64::from((0x5a3c >> 3) & 0xfff)]);
    let ChannelValues::Integers(high) = &read(&mut file, "u64").values[0] else { panic!("integers") };
    assert_eq!(high[1], Some(i128::from(u64::MAX) - 1));
    let ChannelValues::Integers(low) = &read(&mut file, "i64").values[0] else { panic!("integers") };
    assert_eq!(low[3], Some(i128::from(i64::MIN) + 3));
    let ChannelValues::Integers(big) = &read(&mut file, "be64").values[0] else { panic!("integers") };
    assert_eq!(big[3], Some((1 << 60) + 3));
    let valid = numbers(&mut file, "f32");
    assert!(valid[1].is_nan() && valid[5].is_nan() && valid[2] == f64::from(2f32 / 3.0));
    assert!(numbers(&mut file, "never").iter().all(|it| it.is_nan()));
}

#[test]
fn mixed_groups_are_told_apart() {
    let mut file = open(&files::mixed()).expect("a file");
    let fast = read(&mut file, "count");
    assert_eq!((fast.times.len(), fast.times[49]), (50, 49.0 * 0.01));
    assert_eq!(fast.values[0].number_at(49), Some(147.0));
    let slow = read(&mut file, "word");
    assert_eq!(slow.times, [4.0, 14.0, 24.0, 34.0, 44.0].map(|it| it * 0.01));
    assert_eq!(texts(&mut file, "word")[1], format!("row 14 {}", "é".repeat(14)));
    assert_ne!(fast.clock, slow.clock);
    let channels: Vec<_> = (0..file.channels().len()).collect();
    assert_eq!(file.read_columns(&channels).expect("both").len(), 2);
}

#[test]
fn a_master_may_be_the_number_of_the_row_or_missing() {
    let mut file = open(&files::virtual_master()).expect("a file");
    assert_eq!(read(&mut file, "v").times, [5.0, 5.01, 5.02, 5.03]);
    let alone = read(&mut file, "alone");
    assert_eq!(
        (&alone.times[..], &alone.values[0]),
        (&[0.0, 1.0, 2.0][..], &ChannelValues::Numbers(vec![1.0, 2.0, -1.0]))
    );
    assert_eq!(
        (file.clocks()[alone.clock].master, file.clocks()[alone.clock].axis),
        (None, MasterAxis::Index)
    );
}

#[test]
fn times_are_seconds_whatever_their_unit_is() {
    let mut file = open(&files::ticks()).expect("a file");
    let times = [1.7e9, 1.701e9, 1.702e9].map(|it| it * 1e-9);
    assert_eq!(read(&mut file, "fast").times, times);
    let slow = read(&mut file, "slow");
    assert_eq!(slow.times, [0.0, 0.5]);
    assert_eq!(file.master_factor(slow.clock), 1e-3);
    assert!(file.warnings().iter().any(|it| it.contains("is in ms")), "{:?}", file.warnings());
    let start = file.start_time().expect("a start");
    assert_eq!((start.nanoseconds, start.is_local), (1_600_000_000_123_456_789, false));
}

#[test]
fn rows_and_texts_cross_the_blocks_of_lists() {
    let mut file = open(&files::lists()).expect("a file");
    let squares: Vec<_> = (0..30).map(|it| f64::from(it * it)).collect();
    let ChannelValues::Integers(found) = &read(&mut file, "square").values[0] else { panic!("integers") };
    assert!(found.iter().zip(&squares).all(|it| it.0.map(|it| it as f64) == Some(*it.1)));
    let expected: Vec<_> = (0..30).map(|row| "x".repeat(row % 7)).collect();
    assert_eq!(texts(&mut file, "word"), expected);
}

#[test]
fn every_conversion_has_its_values() {
    let mut file = open(&files::conversions()).expect("a file");
    let at = |file: &mut MdfFile, name: &str| numbers(file, name);
    assert_eq!(at(&mut file, "linear")[2], 2.0 * 0.3 + 0.1);
    assert_eq!(at(&mut file, "rational")[4], (0.5 * 16.0 + 8.0 + 3.0) / (1.0 + 7.0));
    assert_eq!(at(&mut file, "formula")[5], 10.0 + 1.5);
    assert_eq!(at(&mut file, "lines")[..2], [0.1, 0.1]);
    assert_eq!(at(&mut file, "steps")[6..8], [0.7, -3.0]);
    assert_eq!(at(&mut file, "ranges")[3..8], [0.25, -1.0, 0.5, 0.5, 0.5]);
    assert_eq!(texts(&mut file, "keys")[..6], ["low", "other", "other", "other", "other", "high"]);
    assert_eq!(texts(&mut file, "spans")[2..5], ["low", "low", "high"]);
    let mixed = at(&mut file, "mixed");
    assert_eq!(mixed[10], -35.0);
    assert!(mixed[11].is_nan());
    assert_eq!(texts(&mut file, "bits")[1..4], ["gear=neutral", "gear=high", "gear=high"]);
    assert_eq!(at(&mut file, "from text")[..3], [-1.5, 2.5, 99.0]);
    assert_eq!(texts(&mut file, "translated")[..3], ["neutral", "other", "other"]);
}

#[test]
fn arrays_and_structures_are_channels_each() {
    let mut file = open(&files::array()).expect("a file");
    assert_eq!(numbers(&mut file, "map[1,2]"), [5.0, 105.0, 205.0, 305.0]);
    assert_eq!(file.channels()[1].unit.as_deref(), Some("kPa"));
    let mut file = open(&files::structure()).expect("a file");
    assert_eq!(numbers(&mut file, "Frame.id"), [513.0, 1284.0]);
    assert_eq!(numbers(&mut file, "Frame.length"), [3.0, 6.0]);
    assert_eq!((file.channels().len(), file.warnings()), (3, &[][..]));
}

#[test]
fn texts_of_all_codings_and_lengths_are_read() {
    let mut file = open(&files::strings()).expect("a file");
    assert_eq!(texts(&mut file, "bounded"), ["", "a", "ab", "abc"]);
    assert_eq!(texts(&mut file, "latin")[2], "b°2");
    assert_eq!(texts(&mut file, "wide")[1], "a1°");
    assert_eq!(texts(&mut file, "wide big")[3], "a3°");
    assert_eq!(texts(&mut file, "any"), ["", "ä", "a longer text", "z"]);
    let any = file.channels().iter().find(|it| it.name == "any").expect("it");
    assert_eq!((any.comment.as_deref(), any.kind), (Some("a < b"), ChannelValueKind::Text));
}

#[test]
fn columns_of_their_own_share_the_clock_of_their_master() {
    let mut file = open(&files::columns()).expect("a file");
    let read = read(&mut file, "v");
    assert_eq!(read.times, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]);
    let ChannelValues::Numbers(found) = &read.values[0] else { panic!("numbers") };
    assert!(found[1].is_nan() && found[3].is_nan());
    assert_eq!([found[0], found[2], found[4], found[5]], [0.0, -14.0, -28.0, -35.0]);
    assert_eq!(file.clocks().len(), 1);
}

#[test]
fn a_measurement_that_was_cut_off_is_read_up_to_its_last_row() {
    let mut file = open(&files::unfinalised()).expect("a file");
    assert_eq!(numbers(&mut file, "v"), [10.0, 11.0, 12.0, 13.0, 14.0]);
    assert_eq!(file.clocks()[0].rows, Some(5));
    assert!(file.warnings()[0].contains("not finalised"), "{:?}", file.warnings());
}

#[test]
fn a_reader_that_has_enough_ends_early() {
    let mut file = open(&files::bits()).expect("a file");
    let mut seen = 0;
    let visited = file.visit_rows(0, &[0], &mut |rows| {
        seen += rows[0].len();
        false
    });
    assert_eq!((visited, seen), (Ok(()), 20));
    assert!(file.visit_rows(7, &[0], &mut |_| true).is_err() && file.read_columns(&[99]).is_err());
}

#[test]
fn files_of_mdf_3_have_their_values_in_either_order_of_bytes() {
    for big in [false, true] {
        let mut file = open(&old::old(big)).expect("a file");
        assert_eq!((file.version(), file.file_comment()), (3, Some("a file\nof MDF 3")));
        // 2020-02-29 12:30:15, as `date` knows it.
        let start = file.start_time().expect("a start");
        assert_eq!((start.nanoseconds, start.is_local), (1_582_979_415_000_000_000, true));
        let fast = read(&mut file, "be u16");
        assert_eq!(fast.times, [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]);
        assert_eq!(fast.values[0].number_at(5), Some(5000.0));
        let channel = &file.channels()[fast.channels[0]];
        assert_eq!((&*channel.group, channel.comment.as_deref()), ("fast", Some("what it is")));
        let long = "u5 with a name of more than 32 letters";
        // The orders of bits of these two are those of their bytes.
        assert_eq!(numbers(&mut file, long), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(numbers(&mut file, "i11")[..2], [-1.0, -2.0]);
        assert_eq!(numbers(&mut file, "be i32")[2], -140_000.0);
        assert_eq!(numbers(&mut file, "float")[2], f64::from(2f32 / 3.0));
        assert_eq!(numbers(&mut file, "be double")[..2], [-1.0, -0.9]);
        assert_eq!(texts(&mut file, "word"), ["w0°", "w2°", "w4°"]);
        assert_eq!(read(&mut file, "linear").times, [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]);
        let notes = file.warnings().join("; ");
        for what in ["`bytes` is left out", "`array` is left out", "`beyond` is left out"] {
            assert!(notes.contains(what), "{what}: {notes}");
        }
    }
}

#[test]
fn every_conversion_of_mdf_3_has_its_values() {
    let mut file = open(&old::old(false)).expect("a file");
    let at = |file: &mut MdfFile, name: &str| numbers(file, name);
    assert_eq!(at(&mut file, "linear")[..3], [-1.5, -1.25, -1.0]);
    assert_eq!(at(&mut file, "lines"), [10.0, 15.0, 20.0, 10.0, 0.0, 0.0]);
    assert_eq!(at(&mut file, "steps"), [10.0, 10.0, 20.0, 20.0, 0.0, 0.0]);
    assert_eq!(at(&mut file, "rational")[4], (0.5 * 16.0 + 8.0 + 3.0) / (4.0 + 7.0));
    assert_eq!(at(&mut file, "formula")[2], 5.0 - 1.0);
    let near = |found: f64, expected: f64| {
        assert!((found - expected).abs() < 1e-12 * expected.abs(), "{found}, expected {expected}");
    };
    // (P2 - P4 (X - P5 - P6)) / (P3 (X - P5 - P6) - P1)
    near(at(&mut file, "polynomial")[3], (2.0 - 3.0 * 2.25) / (0.5 * 2.25 + 7.0));
    // exp(((X - P7) P6 - P3) / P1) / P2, and ln((P3 / (X - P7) - P6) / P4) / P5
    near(at(&mut file, "exponential")[2], (3.5f64 / 4.0).exp() / 2.0);
    near(at(&mut file, "logarithmic")[1], (25.5f64 / 2.0).ln() / 0.5);
    assert_eq!(texts(&mut file, "keys")[..4], ["", "one", "", "drei°"]);
    assert_eq!(texts(&mut file, "spans"), ["other", "low", "low", "other", "high", "other"]);
    let scaled = at(&mut file, "scaled");
    assert!(scaled[..5] == [1.0, 1.5, 2.0, 2.5, 3.0] && scaled[5].is_nan(), "{scaled:?}");
    let unit = file.channels().iter().find(|it| it.name == "none").expect("it").unit.clone();
    assert_eq!((unit.as_deref(), at(&mut file, "none")[5]), (Some("°C"), 5.0));
}

#[test]
fn what_is_no_sound_mdf_is_refused_with_what_to_do() {
    let error = |bytes: &[u8]| open(bytes).err().expect("an error").to_string();
    let mut new = files::bits();
    new[8..16].copy_from_slice(b"5.00    ");
    new[28..30].copy_from_slice(&500u16.to_le_bytes());
    assert!(error(&new).contains("expected MDF 2, 3 or 4, found version 5.00"), "{}", error(&new));
    assert!(error(b"time,v\n1,2\n").contains("expected a file of MDF"));
    assert!(error(b"").contains("expected a file of MDF"));
    let old = old::old(false);
    let mut cut = open(&old[..old.len() - 20]);
    let told = match &mut cut {
        Ok(file) => file.read_columns(&[0]).expect_err("it has less").to_string(),
        Err(error) => error.to_string(),
    };
    assert!(told.contains("was it copied in full?"), "{told}");
    // Zstandard, of MDF 4.3.
    let mut packed = files::lists();
    for at in 0..packed.len() - 4 {
        if packed[at..].starts_with(b"##DZ") {
            packed[at + 26] = 2;
        }
    }
    let mut file = open(&packed).expect("its description is there");
    let told = file.read_columns(&[2]).expect_err("another packing").to_string();
    assert!(told.contains("save it with deflate"), "{told}");
    // The data is the last block of this file: now it has a length and a count of rows, but not all of its bytes.
    let mut cut = files::unfinalised();
    cut[..8].copy_from_slice(b"MDF     ");
    let at = |id: &[u8]| cut.windows(4).position(|it| it == id).expect("a block");
    let (data, group) = (at(b"##DT"), at(b"##CG"));
    cut[data + 8..data + 16].copy_from_slice(&(24u64 + 45).to_le_bytes());
    cut[group + 80..group + 88].copy_from_slice(&5u64.to_le_bytes());
    let mut file = open(&cut[..data + 50]).expect("its description is there");
    let error = file.read_columns(&[1]).expect_err("rows are missing");
    assert!(error.to_string().contains("was it copied in full?"), "{error}");
    assert!(error.at.is_some());
}
