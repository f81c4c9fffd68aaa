//! Reads the titles of any bytes as a log. The first byte chooses the extension.
#![no_main]

use libfuzzer_sys::fuzz_target;

const EXTENSIONS: [&str; 8] = ["csv", "txt", "mat", "ld", "arrow", "parquet", "bag", "csv.gz"];

fuzz_target!(|bytes: &[u8]| {
    let Some((first, rest)) = bytes.split_first() else { return };
    let folder = tempfile::tempdir_in("/dev/shm").expect("room in memory");
    let path = folder.path().join(format!("log.{}", EXTENSIONS[usize::from(*first) % EXTENSIONS.len()]));
    std::fs::write(&path, rest).expect("room in memory");
    let _ = recording::table::read_titles(&path);
});
