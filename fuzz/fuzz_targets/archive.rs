//! Unpacks any bytes as an archive.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir_in("/dev/shm").expect("room in memory");
    let mut left = 1 << 24;
    let _ = archive::unpack_archive(Path::new("a.fmu"), "an .fmu", bytes, folder.path(), &mut left);
});
