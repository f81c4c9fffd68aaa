//! Writes MoTeC files, and reads them and one of a MoTeC device by our reader and by `motec-i2`, which others made. MoTeC's own i2 is not at
//! hand.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use log_file::{ClockTime, LdChannel, LdSession, LdWriter, LogFile, ld_names};
use motec_i2::{LDReader, Sample};

/// Rows that do not fill their last batch, and room for more.
const ROWS: u32 = 2500;

fn channel(name: &str, unit: &str, is_integer: bool) -> LdChannel {
    LdChannel { name: name.to_owned(), unit: unit.to_owned(), is_integer }
}

fn row(row: u32) -> [f64; 3] {
    let speed = if row == 7 { f64::NAN } else { f64::from(row) / 3.0 };
    [speed, -f64::from(row), f64::from(row % 2)]
}

/// A file at 100 Hz.
fn written() -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.ld");
    let session = LdSession {
        driver: "A. Driver".to_owned(),
        venue: "a venue of a name that is far longer than its field of sixty-four letters".to_owned(),
        event: "step_steer".to_owned(),
        comment: "A step".to_owned(),
        ..LdSession::default()
    };
    let channels =
        [channel("car.a_x", "m/s2", false), channel("car.gear", "", true), channel("car.on", "1", true)];
    let mut writer = LdWriter::create(&path, &session, &channels, 100, ROWS + 999).expect("a file");
    (0..ROWS).for_each(|it| writer.write_row(row(it)).expect("it takes a row"));
    writer.finish().expect("it ends");
    std::fs::read(&path).expect("the file")
}

#[test]
fn our_reader_has_the_numbers_to_their_32_bits() {
    let file = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(file.path(), written()).expect("it is written");
    let mut log = LogFile::open(file.path()).expect("it is read").expect("a log");
    let about: Vec<_> = log.channels().iter().map(|it| (it.name.as_str(), it.unit.as_deref())).collect();
    assert_eq!(about, [("car.a_x", Some("m/s/s")), ("car.gear", None), ("car.on", None)]);
    assert_eq!((log.clocks()[0].time, log.clocks()[0].rows), (ClockTime::Rate(100.0), Some(ROWS.into())));
    assert!(log.warnings().is_empty() && log.skipped_contents().is_empty(), "{:?}", log.warnings());
    let read = log.read_all_rows(&[0, 1, 2]).expect("the numbers");
    for at in 0..ROWS {
        let [speed, gear, on] = row(at);
        let found = [0, 1, 2].map(|it: usize| read[it].number_at(at as usize).expect("a number"));
        let same = found[0] == f64::from(speed as f32) || (found[0].is_nan() && speed.is_nan());
        assert!(same && found[1..] == [gear, on], "row {at}: {found:?}");
    }
}

#[test]
fn motec_i2_reads_the_same() {
    let bytes = written();
    let mut cursor = Cursor::new(&bytes);
    let mut reader = LDReader::new(&mut cursor);
    let header = reader.read_header().expect("a header");
    assert_eq!((header.num_channels, &*header.date_string), (3, "01/01/1970"));
    assert_eq!((header.venue.len(), &*header.short_comment), (63, "A step"));
    let event = reader.read_event().expect("it is read").expect("an event");
    assert_eq!((&*event.name, &*event.comment), ("step_steer", "A step"));
    let venue = reader.read_venue().expect("it is read").expect("a venue");
    assert_eq!(venue.name, header.venue);
    assert!(reader.read_vehicle().expect("it is read").is_some());
    let channels = reader.read_channels().expect("channels");
    let names: Vec<_> = channels.iter().map(|it| (&*it.name, &*it.short_name, &*it.unit)).collect();
    let expected = [("car.a_x", "car.a_x", "m/s/s"), ("car.gear", "car.gea", ""), ("car.on", "car.on", "")];
    assert_eq!(names, expected);
    for (place, channel) in channels.iter().enumerate() {
        assert_eq!((channel.sample_rate, channel.data_count), (100, ROWS));
        let samples = reader.channel_data(channel).expect("numbers");
        assert_eq!(samples.len(), ROWS as usize);
        for (at, sample) in samples.iter().enumerate() {
            let expected = row(at as u32)[place];
            let (found, expected) = match sample {
                Sample::F32(_) => (sample.decode_f64(channel), f64::from(expected as f32)),
                _ => (sample.decode_f64(channel), expected),
            };
            assert!(found == expected || found.is_nan() && expected.is_nan(), "{place}, {at}: {found}");
        }
    }
}

/// A log of a device ADL, beside the repository or in the folder `TRACKSIDE_DATA`.
#[test]
#[ignore = "needs data/corpus/ld"]
fn we_and_motec_i2_read_a_log_of_others_alike() {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("TRACKSIDE_DATA").map_or_else(beside, PathBuf::from);
    let path = folder.join("corpus/ld/Sample1.ld");
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut log = LogFile::open(&path).expect("it is read").expect("a log");
    let mut cursor = Cursor::new(&bytes);
    let mut reader = LDReader::new(&mut cursor);
    let channels = reader.read_channels().expect("channels");
    assert_eq!((channels.len(), log.channels().len()), (78, 78));
    for (place, channel) in channels.iter().enumerate() {
        assert_eq!(log.channels()[place].name, channel.name.trim());
        let ours = log.read_all_rows(&[place]).expect("numbers").remove(0);
        let theirs = reader.channel_data(channel).expect("numbers");
        assert_eq!(ours.len(), theirs.len(), "{}", channel.name);
        for (row, sample) in theirs.iter().enumerate() {
            let (found, expected) = (ours.number_at(row).expect("one"), sample.decode_f64(channel));
            let near = (found - expected).abs() <= 1e-12 * expected.abs();
            assert!(near, "{}, row {row}: {found}, {expected}", channel.name);
        }
    }
}

#[test]
fn long_names_are_shortened_without_clashes() {
    let names = [
        "vehicle.suspension.front_left.damper_force",
        "vehicle.suspension.Front_left.damper_force",
        "ension.front_left.damper_force",
        "car.v_x",
    ];
    let short = ld_names(&names.map(str::to_owned));
    assert_eq!(short[0], "pension.front_left.damper_force");
    assert_eq!(short[1], "nsion.Front_left.damper_force~2");
    assert_eq!(&short[2..], &names[2..]);
    assert!(short.iter().all(|it| it.len() <= LdWriter::NAME));
}

#[test]
fn a_file_that_its_addresses_do_not_reach_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.ld");
    let channels = vec![channel("x", "", false); 100];
    let create = |rows| LdWriter::create(&path, &LdSession::default(), &channels, 1000, rows);
    let error = create(11_000_000).err().expect("it is too long").to_string();
    assert!(error.contains("at most 4 GiB") && !path.exists(), "{error}");
    let mut writer = create(1).expect("a file");
    writer.write_row([0.0; 100]).expect("the row");
    assert!(writer.write_row([0.0; 100]).is_err());
}
