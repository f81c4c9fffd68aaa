//! Writes MAT files of version 5 as MATLAB does, for tests.
#![allow(dead_code, reason = "each test uses a part of it")]

use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;

/// What a file holds.
pub enum Made {
    /// Doubles of some shape.
    Doubles(Vec<i32>, Vec<f64>),
    /// Numbers of a class that are stored as bytes, as MATLAB stores small whole ones.
    Bytes(u32, Vec<i32>, Vec<u8>),
    /// One row of characters.
    Text(String),
    Cell(Vec<Made>),
    Struct(Vec<(&'static str, Made)>),
    /// An array of structs, field by field of each element.
    Structs(Vec<&'static str>, Vec<Vec<Made>>),
    Complex(Vec<f64>),
    /// An object of a class, such as a table.
    Object,
}

/// A column of doubles.
pub fn column(values: &[f64]) -> Made {
    Made::Doubles(vec![values.len() as i32, 1], values.to_vec())
}

fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut made = Vec::new();
    if (1..=4).contains(&data.len()) {
        made.extend((kind | ((data.len() as u32) << 16)).to_le_bytes());
        made.extend(data);
        made.resize(8, 0);
    } else {
        made.extend(kind.to_le_bytes());
        made.extend((data.len() as u32).to_le_bytes());
        made.extend(data);
        made.resize(made.len().next_multiple_of(8), 0);
    }
    made
}

fn doubles(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|it| it.to_le_bytes()).collect()
}

fn array(name: &str, made: &Made) -> Vec<u8> {
    let start = |class: u32, shape: &[i32]| {
        let flags: Vec<u8> = [class, 0].iter().flat_map(|it| it.to_le_bytes()).collect();
        let shape: Vec<u8> = shape.iter().flat_map(|it| it.to_le_bytes()).collect();
        [element(6, &flags), element(5, &shape), element(1, name.as_bytes())].concat()
    };
    let names = |fields: &[&str]| {
        let padded: Vec<u8> = fields
            .iter()
            .flat_map(|it| {
                let mut field = it.as_bytes().to_vec();
                field.resize(32, 0);
                field
            })
            .collect();
        [element(5, &32u32.to_le_bytes()), element(1, &padded)].concat()
    };
    let data = match made {
        Made::Doubles(shape, values) => [start(6, shape), element(9, &doubles(values))].concat(),
        Made::Bytes(class, shape, values) => [start(*class, shape), element(2, values)].concat(),
        Made::Text(text) => {
            let units: Vec<u16> = text.encode_utf16().collect();
            let bytes: Vec<u8> = units.iter().flat_map(|it| it.to_le_bytes()).collect();
            [start(4, &[i32::from(!units.is_empty()), units.len() as i32]), element(4, &bytes)].concat()
        }
        Made::Cell(cells) => {
            let cells: Vec<_> = cells.iter().map(|it| array("", it)).collect();
            [start(1, &[1, cells.len() as i32]), cells.concat()].concat()
        }
        Made::Struct(fields) => {
            let known: Vec<_> = fields.iter().map(|it| it.0).collect();
            let values: Vec<_> = fields.iter().map(|it| array("", &it.1)).collect();
            [start(2, &[1, 1]), names(&known), values.concat()].concat()
        }
        Made::Structs(known, all) => {
            let values: Vec<_> = all.iter().flatten().map(|it| array("", it)).collect();
            [start(2, &[1, all.len() as i32]), names(known), values.concat()].concat()
        }
        Made::Complex(values) => {
            let shape = [values.len() as i32, 1];
            let parts = element(9, &doubles(values));
            [start(6 | 0x0800, &shape), parts.clone(), parts].concat()
        }
        Made::Object => {
            let flags: Vec<u8> = [17u32, 0].iter().flat_map(|it| it.to_le_bytes()).collect();
            let of =
                [element(6, &flags), element(1, name.as_bytes()), element(1, b"MCOS"), element(1, b"table")];
            of.concat()
        }
    };
    element(14, &data)
}

/// A file with some variables, each packed on its own as by `save -v7`, or plain as by `save -v6`.
pub fn file(variables: &[(&str, Made)], packed: bool) -> Vec<u8> {
    let mut made = b"MATLAB 5.0 MAT-file, Platform: PCWIN64".to_vec();
    made.resize(124, b' ');
    made.extend([0, 1, b'I', b'M']);
    for (name, variable) in variables {
        let variable = array(name, variable);
        if packed {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
            encoder.write_all(&variable).expect("memory");
            let data = encoder.finish().expect("memory");
            made.extend(15u32.to_le_bytes());
            made.extend((data.len() as u32).to_le_bytes());
            made.extend(data);
        } else {
            made.extend(variable);
        }
    }
    made
}
