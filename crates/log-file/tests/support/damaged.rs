//! What tries damaged logs.

use std::path::Path;

use damage::FuzzTarget;
use log_file::LogFile;

use super::{ld, mat, writers};

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "logs",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../log-file/tests/corpus/log_files"),
    sound,
    words: &["[data]", "[header]", "time", "PAR1", "ARROW1", "\x07\0\x04\0", "\x40\0\0\0"],
    own: None,
    attempt,
};

fn sound() -> Vec<Vec<u8>> {
    let lz4 = Some(arrow_ipc::CompressionType::LZ4_FRAME);
    vec![
        ld::ld(&ld::ld_channels()),
        writers::VBO.as_bytes().to_vec(),
        writers::parquet(),
        writers::arrow(false, None),
        writers::by_footer(&writers::arrow(false, None)),
        writers::arrow(true, lz4),
        mat::file(&[("t", mat::column(&[0.0, 1.0])), ("v", mat::column(&[2.0, 3.0]))], true),
    ]
}

fn attempt(bytes: &[u8], folder: &Path) -> bool {
    let path = folder.join("log");
    std::fs::write(&path, bytes).expect("the folder is writable");
    let Ok(Some(mut log)) = LogFile::open(&path) else { return false };
    let mut sound = true;
    for clock in 0..log.clocks().len() {
        let of_clock = |it: &usize| log.channels()[*it].clock == clock;
        let wanted: Vec<usize> = (0..log.channels().len()).filter(of_clock).collect();
        sound &= log
            .read_chunks(clock, &wanted, &mut |stretch| {
                assert_eq!(stretch.len(), wanted.len());
                assert!(stretch.windows(2).all(|pair| pair[0].len() == pair[1].len()));
                true
            })
            .is_ok();
    }
    sound
}
