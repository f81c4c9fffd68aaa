//! Reads files as MATLAB writes them, and refuses those that are none.

use crate::writer::{Made, column, file};
use mat_file::{MatValue, is_mat, read_mat_file};

fn made() -> Vec<(&'static str, Made)> {
    let text = |it: &str| Made::Text(it.to_owned());
    vec![
        ("FX", column(&[1.5, -2.5, f64::NAN])),
        ("P", Made::Bytes(6, vec![1, 3], vec![80, 81, 82])),
        ("tireid", text("Größe 10\"")),
        ("nothing", text("")),
        (
            "channel",
            Made::Struct(vec![
                ("name", Made::Cell(vec![text("FX"), text("P")])),
                ("units", Made::Cell(vec![text("N"), Made::Doubles(vec![0, 0], vec![])])),
            ]),
        ),
        ("run", Made::Structs(vec!["FY"], vec![vec![column(&[7.0])], vec![column(&[8.0])]])),
        ("mixed", Made::Cell(vec![text("a"), column(&[3.0, 4.0])])),
        ("spectrum", Made::Complex(vec![1.0])),
        ("log", Made::Object),
    ]
}

#[test]
fn numbers_texts_structs_and_cells_are_found_by_their_names() {
    for packed in [false, true] {
        let bytes = file(&made(), packed);
        assert!(is_mat(&bytes));
        let found = read_mat_file(&bytes).expect("a file");
        let fx = found.numeric_array("FX").expect("numbers");
        assert_eq!(
            (&fx.shape[..], &fx.values[..2], fx.values[2].is_nan()),
            (&[3, 1][..], &[1.5, -2.5][..], true)
        );
        assert!(fx.is_vector());
        assert_eq!(found.numeric_array("P").expect("numbers").values, [80.0, 81.0, 82.0]);
        assert_eq!(found.text_rows("tireid"), Some(&["Größe 10\"".to_owned()][..]));
        assert_eq!(found.text_rows("nothing"), Some(&[String::new()][..]));
        assert_eq!(found.text_rows("channel.name"), Some(&["FX".to_owned(), "P".to_owned()][..]));
        assert_eq!(found.text_rows("channel.units"), Some(&["N".to_owned(), String::new()][..]));
        assert_eq!(found.numeric_array("run(2).FY").expect("numbers").values, [8.0]);
        assert_eq!(found.get("mixed{1}"), Some(&MatValue::Texts(vec!["a".to_owned()])));
        assert_eq!(found.numeric_array("mixed{2}").expect("numbers").values, [3.0, 4.0]);
        let skipped: Vec<_> = found.skipped.iter().map(|it| it.0.as_str()).collect();
        assert_eq!(skipped, ["spectrum", "log"]);
        assert!(found.skipped[1].1.starts_with("an object, such as a string, table"));
    }
}

/// Version 4 with a number of each storage; the orders of bytes are those of a PC and of a SPARC.
#[test]
fn version_4_is_read_in_either_order() {
    for big in [false, true] {
        let word = |it: u32| if big { it.to_be_bytes() } else { it.to_le_bytes() };
        let machine = if big { 1000 } else { 0 };
        let mut bytes = Vec::new();
        let mut matrix = |kind: u32, shape: [u32; 2], name: &str, data: &[u8]| {
            let name = format!("{name}\0");
            for it in [machine + kind, shape[0], shape[1], 0, name.len() as u32] {
                bytes.extend(word(it));
            }
            bytes.extend(name.as_bytes());
            bytes.extend(data);
        };
        let half = if big { 0.5f64.to_be_bytes() } else { 0.5f64.to_le_bytes() };
        let short = if big { (-3i16).to_be_bytes() } else { (-3i16).to_le_bytes() };
        matrix(0, [1, 1], "SA", &half);
        matrix(30, [1, 2], "n", &[short, short].concat());
        matrix(51, [2, 3], "words", b"adbecf");
        let found = read_mat_file(&bytes).expect("a file");
        assert_eq!(found.numeric_array("SA").expect("numbers").values, [0.5]);
        assert_eq!(found.numeric_array("n").expect("numbers").values, [-3.0, -3.0]);
        assert_eq!(found.text_rows("words"), Some(&["abc".to_owned(), "def".to_owned()][..]));
        let error = read_mat_file(&bytes[..bytes.len() - 1]).expect_err("cut").to_string();
        assert!(error.contains("was it copied whole?"), "{error}");
    }
}

#[test]
fn other_files_are_refused_with_what_to_do() {
    let refused = |bytes: &[u8]| read_mat_file(bytes).expect_err("no file").to_string();
    let hdf5 = [&b"MATLAB 7.3 MAT-file"[..], &[b' '; 493], b"\x89HDF\r\n\x1a\n"].concat();
    assert!(is_mat(&hdf5) && refused(&hdf5).contains("the HDF5 file cannot be read"));
    assert!(is_mat(&hdf5[..400]) && refused(&hdf5[..400]).contains("was the file copied whole?"));
    assert!(refused(b"ET,FX\n0,1\n").contains("expected a MAT file"));
    assert!(!is_mat(b"ET,FX\n0,1\n1,2\n3,4\n5,6,7\n") && refused(b"").contains("expected a MAT file"));
    let whole = file(&[("FX", column(&[1.0; 40]))], false);
    for end in 129..whole.len() {
        assert!(refused(&whole[..end]).contains("copied whole?"), "{end}");
    }
    let packed = file(&[("FX", column(&[1.0; 40]))], true);
    let end = packed.len() - 3;
    assert!(refused(&packed[..end]).contains("copied whole?"));
    // More elements than there are numbers, and more than can be counted.
    let mut wrong = whole.clone();
    wrong[160] = 200;
    assert!(refused(&wrong).contains("`FX`: expected 200 numbers, found 40"), "{}", refused(&wrong));
    let many = file(&[("FX", Made::Doubles(vec![i32::MAX; 4], vec![1.0]))], false);
    assert!(refused(&many).contains("more elements than can be counted"), "{}", refused(&many));
}

/// Structs within structs, deeper than anybody writes them.
#[test]
fn depth_has_a_limit() {
    let mut deep = column(&[1.0]);
    for _ in 0..40 {
        deep = Made::Struct(vec![("a", deep)]);
    }
    let error = read_mat_file(&file(&[("deep", deep)], true)).expect_err("too deep").to_string();
    assert!(error.contains("expected at most 32 structs within each other"), "{error}");
}
