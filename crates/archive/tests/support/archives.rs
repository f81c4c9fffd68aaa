//! What tries damaged archives.

use std::io::{Cursor, Write as _};
use std::path::Path;

use damage::{FuzzTarget, Pcg64};
use rand::RngExt as _;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "archives",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../archive/tests/corpus/archives"),
    sound,
    words: &["../", "/tmp/", "resources/", "PK\x01\x02", "PK\x03\x04", "PK\x05\x06", "PK\x06\x06"],
    own: Some(|random, bytes| own(random, bytes)),
    attempt,
};

fn sound() -> Vec<Vec<u8>> {
    let made = |method: CompressionMethod, entries: &[(&str, Vec<u8>)]| {
        let options = SimpleFileOptions::default().compression_method(method);
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in entries {
            archive.start_file(*name, options).expect("an entry");
            archive.write_all(bytes).expect("an entry");
        }
        archive.finish().expect("an archive").into_inner()
    };
    let text = |length: usize| "a description ".repeat(length).into_bytes();
    let entries = [
        ("modelDescription.xml", text(30)),
        ("binaries/linux64/m.so", b"\x7fELF".repeat(50)),
        ("resources/a/b.csv", text(3)),
        ("empty", Vec::new()),
    ];
    let many: Vec<_> = ["a", "b", "c", "d", "e/f", "e/g"].map(|name| (name, text(1))).to_vec();
    vec![
        made(CompressionMethod::Deflated, &entries),
        made(CompressionMethod::Stored, &entries),
        made(CompressionMethod::Deflated, &many),
        made(CompressionMethod::Stored, &[("bomb", vec![0; 200_000])]),
        made(CompressionMethod::Deflated, &[("bomb", vec![0; 200_000])]),
    ]
}

/// Puts a number into a field of a header, as if there were more, or less.
fn own(random: &mut Pcg64, bytes: &mut [u8]) {
    let headers = bytes.windows(2).enumerate().filter(|(_, it)| *it == b"PK").map(|(at, _)| at);
    let headers: Vec<_> = headers.collect();
    if headers.is_empty() {
        return;
    }
    let header = headers[random.random_range(0..headers.len())];
    let place = header + 2 * random.random_range(2..24);
    let number: u32 = match random.random_range(0..4) {
        0 => u32::MAX,
        1 => random.random_range(0..100),
        2 => bytes.len() as u32,
        _ => random.random(),
    };
    let width = if random.random() { 2 } else { 4 };
    if let Some(field) = bytes.get_mut(place..place + width) {
        field.copy_from_slice(&number.to_le_bytes()[..width]);
    }
}

/// Unpacks at most 1 MB. Whatever the archive says, nothing is written beside the folder.
fn attempt(bytes: &[u8], folder: &Path) -> bool {
    let into = folder.join("inside/of/this");
    let _ = std::fs::remove_dir_all(folder.join("inside"));
    std::fs::create_dir_all(&into).expect("a folder");
    let taken = archive::unpack_archive(Path::new("x.fmu"), ".fmu", bytes, &into, &mut (1 << 20)).is_ok();
    for (outside, only) in
        [(folder, "inside"), (&folder.join("inside"), "of"), (&folder.join("inside/of"), "this")]
    {
        let found = std::fs::read_dir(outside).expect("a folder");
        for entry in found {
            let name = entry.expect("an entry").file_name();
            assert_eq!(name, only, "it is outside of the folder");
        }
    }
    taken
}
