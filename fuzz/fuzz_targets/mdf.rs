//! Reads any bytes as an MDF log, all channels of all clocks.
#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use mdf_file::MdfFile;

fuzz_target!(|bytes: &[u8]| {
    let Ok(mut file) = MdfFile::new(Cursor::new(bytes.to_vec())) else { return };
    for clock in 0..file.clocks().len() {
        let wanted: Vec<usize> =
            (0..file.channels().len()).filter(|it| file.channels()[*it].clock == clock).collect();
        let mut rows = 0;
        let _ = file.visit_rows(clock, &wanted, &mut |stretch| {
            rows += stretch.first().map_or(0, |_| 1);
            rows < 4
        });
    }
});
