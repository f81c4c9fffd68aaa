//! Opens an FMU with any description.
#![no_main]

use std::io::{Cursor, Write as _};

use fmu_import::Fmu;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir_in("/dev/shm").expect("room in memory");
    let path = folder.path().join("fuzzed.fmu");
    std::fs::write(&path, archive_of(bytes)).expect("room in memory");
    let _ = Fmu::open(&path);
});

/// An archive with this description, and a library that is never loaded.
fn archive_of(description: &[u8]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, contents) in [("modelDescription.xml", description), ("binaries/linux64/m.so", b"none")] {
        archive.start_file(name, stored).expect("memory");
        archive.write_all(contents).expect("memory");
    }
    archive.finish().expect("memory").into_inner()
}
