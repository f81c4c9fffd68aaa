//! What tries damaged MAT files.

use std::path::Path;

use damage::Target;

use super::writer::{Made, column, file};

pub const TARGET: Target = Target {
    name: "MAT files",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/tests/corpus/mat_files"),
    sound,
    words: &[
        "MATLAB 5.0",
        "IM",
        "MI",
        "\x0e\0\0\0",
        "\x0f\0\0\0",
        "\x01\0\x04\0",
        "\x10\0\0\0",
        "\x12\0\0\0",
    ],
    own: None,
    attempt,
};

fn sound() -> Vec<Vec<u8>> {
    let made = || {
        let cells = ["FX", "N"].map(|it| Made::Text(it.to_owned()));
        vec![
            ("FX", column(&[1.0, 2.0, 3.0])),
            ("P", Made::Bytes(2 + 7, vec![2, 2], vec![1, 2, 3, 4])),
            ("channel", Made::Struct(vec![("units", Made::Cell(cells.into()))])),
            ("run", Made::Structs(vec!["a", "b"], vec![vec![column(&[1.0]), Made::Cell(vec![])]])),
            ("log", Made::Object),
        ]
    };
    let mut old = Vec::new();
    for (kind, data) in [(0u32, [0u8; 8]), (51, *b"abcdefgh")] {
        let columns = if kind == 0 { 1 } else { 8 };
        old.extend([kind, 1, columns, 0, 2].iter().flat_map(|it| it.to_le_bytes()));
        old.extend(b"v\0");
        old.extend(data);
    }
    vec![file(&made(), true), file(&made(), false), old]
}

fn attempt(bytes: &[u8], _folder: &Path) -> bool {
    mat_file::read(bytes).is_ok()
}
