//! What tries damaged MAT files.

use std::path::Path;

use damage::FuzzTarget;
use hdf5_pure::FileBuilder;
use hdf5_pure::mat::{MatBuilder, Options};

use super::writer::{Made, column, file};

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "mat_files",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../mat-file/tests/corpus/mat_files"),
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
        "MATLAB_class",
        "MATLAB_empty",
        "\u{89}HDF",
        "SNOD",
        "TREE",
        "OHDR",
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
    vec![file(&made(), true), file(&made(), false), old, of_matlab(), of_others()]
}

/// Version 7.3.
fn of_matlab() -> Vec<u8> {
    let mut file = MatBuilder::new(Options::default());
    let ramp: Vec<f64> = (0..600).map(f64::from).collect();
    file.write_f64("FX", &[600, 1], &ramp).expect("an array");
    file.write_char("tireid", "Größe").expect("a text");
    let channel = |fields: &mut hdf5_pure::mat::StructWriter| {
        fields.builder().write_i16("P", &[2, 2], &[1, 2, 3, 4])?;
        Ok(())
    };
    file.struct_("channel", channel).expect("a struct");
    file.cell("names", &[2, 1], |cell| {
        cell.push_char("FX")?;
        cell.push_scalar_f64(1.0)?;
        Ok(())
    })
    .expect("a cell");
    file.finish().expect("a file")
}

/// HDF5 with arrays in chunks and texts.
fn of_others() -> Vec<u8> {
    let mut file = FileBuilder::new();
    let ramp: Vec<f32> = (0..100u8).map(f32::from).collect();
    file.create_dataset("v_x").with_f32_data(&ramp).with_chunks(&[30]).with_deflate(6);
    file.finish().expect("a file")
}

fn attempt(bytes: &[u8], _folder: &Path) -> bool {
    mat_file::read_mat_file(bytes).is_ok()
}
