//! What tries damaged measurement files.

use std::io::Cursor;
use std::path::Path;

use damage::FuzzTarget;

use super::files;

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "measurement_files",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../mdf-file/tests/corpus/measurement_files"),
    sound: || files::all().into_iter().map(|it| it.1).collect(),
    words: &[
        "##HD",
        "##DG",
        "##CG",
        "##CN",
        "##CC",
        "##CA",
        "##TX",
        "##MD",
        "##DT",
        "##DZ",
        "##DL",
        "##HL",
        "##LD",
        "##DV",
        "##DI",
        "##SD",
        "UnFinMF ",
        "HD",
        "DG",
        "CG",
        "CN",
        "CC",
        "CD",
        "TX",
        "MDF     ",
        "\0\0\0\0\0\0\0\0",
        "\x40\0\0\0\0\0\0\0",
        "\x18\0\0\0\0\0\0\0",
        "\x01\0\0\0\0\0\0\0",
        "(X-1)/",
    ],
    own: None,
    attempt,
};

/// Opens a file and reads each channel by itself, then all.
fn attempt(bytes: &[u8], _folder: &Path) -> bool {
    let Ok(mut file) = mdf_file::MdfFile::new(Cursor::new(bytes.to_vec())) else { return false };
    let channels = file.channels().len();
    let mut sound = true;
    // Few, since a damaged array has many.
    for channel in 0..channels.min(40) {
        sound &= file.read_columns(&[channel]).is_ok();
    }
    sound && file.read_columns(&(0..channels.min(100)).collect::<Vec<_>>()).is_ok()
}
