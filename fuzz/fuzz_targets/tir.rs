//! Reads any text as a tire property file.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let text = tire_file::decode_text(bytes);
    let _ = tire_file::read_tir(&text, "fuzzed.tir");
});
