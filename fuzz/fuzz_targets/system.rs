//! Opens any text as the description of a system of SSP.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let folder = tempfile::tempdir_in("/dev/shm").expect("room in memory");
    let path = folder.path().join("SystemStructure.ssd");
    std::fs::write(&path, bytes).expect("room in memory");
    let _ = ssp::open_system(&path, None);
    let _ = ssp::list_variants(&path);
});
