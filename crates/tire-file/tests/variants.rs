//! Reads variants of the syntax: own ones, and those of `data/oracles/tir_syntax` beside the repository.

use std::path::{Path, PathBuf};

use serde_json::Value as Json;
use tire::{CoefficientKey, Coefficients, MagicFormulaVersion};
use tire_file::{TirFile, TirValue, decode_text, read_tir};

type TestError = Box<dyn std::error::Error>;

fn folder() -> PathBuf {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let data = std::env::var_os("TRACKSIDE_DATA").map_or_else(beside, PathBuf::from);
    data.join("oracles/tir_syntax")
}

const SMALL: &str = "[UNITS]\nLENGTH = 'mm'\nANGLE = 'deg'\n[MODEL]\nLONGVL = 16500 $ mm/s\nNEW = 3\n\
[DIMENSION]\nUNLOADED_RADIUS = 310\n[VERTICAL]\nFNOMIN = 4D3 ! N\nFNOMIN = 4200\nVERTICAL_STIFFNESS =\n\
[SLIP_ANGLE_RANGE]\nALPMAX = 12\n[LATERAL_COEFFICIENTS]\nPKY1 = -20\nPZZ9 = 1\n";

#[test]
fn a_small_file_is_told_about() {
    let (tire, messages) = read_tir(SMALL, "small.tir").expect("a tire");
    assert_eq!(tire.version, MagicFormulaVersion::Mf52);
    assert_eq!((tire.UNLOADED_RADIUS, tire.LONGVL, tire.FNOMIN), (0.31, 16.5, 4200.0));
    assert!((tire.ALPMAX - 12.0_f64.to_radians()).abs() < 1e-15);
    let told = messages.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
    for expected in [
        "line 11: FNOMIN once more",
        "line 12: VERTICAL_STIFFNESS has no value",
        "no part of the formula, and kept: PZZ9",
        "no FITTYP in [MODEL]: read as MF 5.2",
        "keys are missing, taken as PCX1 = 1, PDX1 = 0",
        "without PDY1 (missing or 0) the tire has no lateral force",
        "no keys of combined slip",
    ] {
        assert!(told.contains(expected), "{expected} in {told}");
    }
}

#[test]
fn mistakes_name_file_line_and_key() {
    let wrong = |from: &str, to: &str| {
        read_tir(&SMALL.replace(from, to), "small.tir").expect_err("a mistake").to_string()
    };
    assert_eq!(wrong("-20", "soft"), "small.tir:16: PKY1: expected a number, found `soft`");
    assert_eq!(
        wrong("FNOMIN = 4200", "FNOMIN = -1"),
        "small.tir:11: FNOMIN is -1, expected a number above 0"
    );
    assert!(wrong("'mm'", "'furlong'").starts_with("small.tir:2: LENGTH: expected one of meter,"));
    assert!(
        wrong("UNLOADED_RADIUS", "RADIUS")
            .contains("expected UNLOADED_RADIUS, without which there is no tire, found none")
    );
    assert!(
        wrong("NEW = 3", "FITTYP = 99")
            .contains("small.tir:6: FITTYP: expected 5, 6, 21, 50, 51, 52, 60, 61 or 62, found 99")
    );
}

#[test]
fn a_tire_of_the_right_side_is_mirrored() {
    let left = tire_file::write_tir_text(&Coefficients { PHY1: 0.01, ..Coefficients::sports_tire() }, &[]);
    let right = left.replace("'LEFT'", "'Right'");
    let (tire, messages) = read_tir(&right, "right.tir").expect("a tire");
    assert_eq!(tire.PHY1, -0.01);
    assert!(messages.iter().any(|it| it.text.contains("mirror image")), "{messages:?}");
}

/// Cuts and changes of a sound file.
#[test]
fn any_text_is_read_without_panic() {
    let sound = tire_file::write_tir_text(&Coefficients::sports_tire(), &["Ünïcode".to_owned()]);
    let letters: Vec<char> = sound.chars().collect();
    let odd = ['=', '[', ']', '\'', '"', '$', '\n', '\r', '\u{0}', '{', '(', 'é', '9'];
    let mut seed = 7_usize;
    for round in 0..3000 {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let at = (seed >> 20) % letters.len();
        let mut changed = letters.clone();
        changed[at] = odd[round % odd.len()];
        if round % 3 == 0 {
            changed.truncate(at);
        }
        let text: String = changed.into_iter().collect();
        let _ = read_tir(&text, "odd.tir");
        let file = TirFile::parse(&text);
        let again = TirFile::parse(&file.to_text());
        assert_eq!(again.entries.len(), file.entries.len());
    }
    assert!(read_tir("", "empty.tir").is_err());
    assert_eq!(decode_text(b"M\xfcller"), "M\u{fc}ller");
}

#[test]
#[ignore = "needs data/oracles/tir_syntax"]
fn variants_of_the_syntax() -> Result<(), TestError> {
    let folder = folder();
    let expected: Json = serde_json::from_str(&std::fs::read_to_string(folder.join("expected.json"))?)?;
    let files = expected.as_object().ok_or("no object")?;
    assert!(files.len() >= 16, "{} files", files.len());
    for (name, expected) in files {
        let text = decode_text(&std::fs::read(folder.join(name))?);
        let file = TirFile::parse(&text);
        let entry = |path: &str| {
            let (section, key) = path.split_once('.').expect("SECTION.KEY");
            file.find_entry(section, key)
        };
        for (path, value) in expected["values"].as_object().into_iter().flatten() {
            let found = entry(path).map(|entry| &entry.value);
            let same = match (found, value) {
                (Some(TirValue::Number(found)), value) => Some(*found) == value.as_f64(),
                (Some(TirValue::Text(found)), Json::String(value)) => found == value,
                _ => false,
            };
            assert!(same, "{name}: {path} is {found:?}, expected {value}");
        }
        for path in expected["absent"].as_array().into_iter().flatten() {
            let found = entry(path.as_str().expect("a name")).map(|entry| &entry.value);
            assert!(matches!(found, None | Some(TirValue::Empty)), "{name}: {path} is {found:?}");
        }
        for (section, table) in expected["tables"].as_object().into_iter().flatten() {
            let found = file.tables.iter().find(|it| it.section == *section).expect("a table");
            let columns: Option<Vec<String>> = serde_json::from_value(table["columns"].clone())?;
            let rows: Vec<Vec<f64>> = serde_json::from_value(table["rows"].clone())?;
            assert_eq!((&found.columns, &found.rows), (&columns, &rows), "{name}: {section}");
        }
        if let Some(si) = expected["si"].as_object() {
            let (tire, _) = file.to_coefficients(name).map_err(|it| it.to_string())?;
            for (path, value) in si {
                let key =
                    CoefficientKey::from_name(path.split_once('.').expect("SECTION.KEY").1).expect("a key");
                let (found, value) = (key.get(&tire), value.as_f64().expect("a number"));
                assert!(
                    (found - value).abs() <= 1e-15 * value.abs(),
                    "{name}: {path} is {found}, expected {value}"
                );
            }
        }
    }
    Ok(())
}
