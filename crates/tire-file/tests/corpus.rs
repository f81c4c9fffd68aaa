//! Judges tires of files by a Magic Formula of its own in Python: own files, and those of strangers.
//!
//! The latter are in `data/corpus/tir` and `cases/logs` of a folder `shared` beside the repository, or of `TRACKSIDE_DATA` and beside it.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value as Json;
use tire::{Coefficients, MagicFormulaVersion, MfTire, TireCharacteristics};
use tire_file::{TireFileMessage, TireMessageLevel, read_bytes, write_tir_text};

type TestError = Box<dyn std::error::Error>;

#[test]
#[ignore = "needs data/corpus/tir"]
fn files_of_strangers() -> Result<(), TestError> {
    let files = std::fs::read_dir(data().join("corpus/tir"))?;
    let mut files = files.map(|entry| entry.map(|it| it.path())).collect::<Result<Vec<_>, _>>()?;
    files.retain(|path| path.extension().is_some_and(|it| it == "tir"));
    assert!(files.len() >= 19, "{} files", files.len());
    judge(&files)
}

#[test]
#[ignore = "needs cases/logs"]
fn cases() -> Result<(), TestError> {
    let folder = data().join("../cases/logs");
    CASES.iter().try_for_each(|case| case.judge(&folder))
}

fn data() -> PathBuf {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    std::env::var_os("TRACKSIDE_DATA").map_or_else(beside, PathBuf::from)
}

/// What our reader and our formula make of a file at its nominal load.
fn ours(path: &Path) -> Result<(TireCharacteristics, Vec<TireFileMessage>), TestError> {
    let name = path.display().to_string();
    let (coefficients, messages) =
        read_bytes(&std::fs::read(path)?, &name).map_err(|errors| errors.to_string())?;
    let tire = MfTire::new(coefficients).map_err(|bad| bad.to_string())?;
    Ok((tire.characteristics_at_load(coefficients.FNOMIN * coefficients.LFZO), messages))
}

/// Compares what both say about files.
fn judge(files: &[PathBuf]) -> Result<(), TestError> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/magic_formula.py");
    let output = Command::new("python3").arg(script).args(files).output()?;
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout)?;
    assert_eq!(text.lines().count(), files.len());
    for line in text.lines() {
        let theirs: Json = serde_json::from_str(line)?;
        let name = theirs["file"].as_str().ok_or("no name")?;
        let (at, _) = ours(Path::new(name))?;
        for (what, found, tolerance) in [
            ("lateral friction", at.lateral.friction, 1e-6),
            ("driving friction", at.driving.friction, 1e-6),
            ("braking friction", at.braking.friction, 1e-6),
            ("cornering stiffness", at.C_alpha, 1e-5 * at.F_z),
            ("camber stiffness", at.C_gamma, 1e-3 * at.F_z),
        ] {
            let expected = theirs["figures"][what].as_f64().ok_or("no figure")?;
            let miss = (found - expected).abs();
            if miss.is_nan() || miss > tolerance {
                return Err(format!("{name}: {what} is {found}, expected {expected}").into());
            }
        }
    }
    Ok(())
}

/// Tires of all versions with shifts, camber, pressure and scale factors, on either side.
#[test]
fn own_files() -> Result<(), TestError> {
    let folder = std::env::temp_dir().join(format!("tire-file-corpus-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let rich = Coefficients {
        PHY1: 0.003,
        PVY1: 0.02,
        PEY3: 0.1,
        PHX1: 0.001,
        PEX4: 0.05,
        PVX1: 0.003,
        PHY3: 0.04,
        PKY3: 0.2,
        LMUY: 0.9,
        LKY: 1.1,
        LFZO: 1.2,
        INFLPRES: 200_000.0,
        PTY2: 2.0,
        ..Coefficients::sports_tire()
    };
    let mut files = Vec::new();
    for version in [
        MagicFormulaVersion::Mf52,
        MagicFormulaVersion::Pac2002,
        MagicFormulaVersion::Mf61,
        MagicFormulaVersion::Mf62,
    ] {
        // A scale of camber, which is 1 in newer files.
        let LGAY = if version.is_before_61() { 0.7 } else { 1.0 };
        let left = write_tir_text(&Coefficients { version, LGAY, ..rich }, &[]);
        for side in ["LEFT", "RIGHT"] {
            let path = folder.join(format!("{version}-{side}.tir"));
            std::fs::write(&path, left.replace("'LEFT'", &format!("'{side}'")))?;
            files.push(path);
        }
    }
    let judged = judge(&files);
    std::fs::remove_dir_all(&folder)?;
    judged
}

/// A file that was read wrongly or not at all, with what is right.
struct Case {
    file: &'static str,
    /// Friction and cornering stiffness [kN/rad]; nothing where it has none to be compared.
    lateral: Option<[f64; 2]>,
    /// Words of a warning.
    warning: Option<&'static str>,
}

const fn case(file: &'static str, lateral: Option<[f64; 2]>, warning: Option<&'static str>) -> Case {
    Case { file, lateral, warning }
}

const NOMINAL: Option<[f64; 2]> = Some([1.080, 67.92]);

const CASES: &[Case] = &[
    case("tir_radians/tire.tir", NOMINAL, None),
    case("tir_pressure_unit/tire.tir", NOMINAL, None),
    case("tir_pressure_unit/bar.tir", NOMINAL, Some("say PRESSURE = 'bar' in [UNITS]")),
    case("tir_pressure_unit/psi.tir", NOMINAL, Some("say PRESSURE = 'psi' in [UNITS]")),
    case("tir_pac2002_pressure/with_pressure.tir", NOMINAL, None),
    case("tir_pac2002_pressure/without_pressure.tir", NOMINAL, None),
    case("tir_unused_zero/latstiff_0.tir", NOMINAL, None),
    case("tir_unused_zero/nompres_0.tir", NOMINAL, None),
    case("tir_unused_zero/presmin_0.tir", NOMINAL, None),
    case("tir_unused_zero/pty2_0.tir", NOMINAL, None),
    case("tir_unused_zero/vstiff_0.tir", NOMINAL, None),
    case("tir_fittyp_60/f60.tir", NOMINAL, None),
    case("tir_fittyp_60/mf61.tir", NOMINAL, None),
    case("tir_fittyp_60/cr.tir", NOMINAL, None),
    case("tir_fittyp_60/utf16.tir", NOMINAL, None),
    case("tir_no_cornering/no_pky1.tir", None, Some("without PKY1 (missing or 0)")),
    case("run_silent_tires/sae.tir", None, Some("speak for adapted SAE axes")),
];

impl Case {
    fn judge(&self, folder: &Path) -> Result<(), TestError> {
        let Self { file, lateral, warning } = self;
        let (at, messages) = ours(&folder.join(file))?;
        if let Some([friction, stiffness]) = lateral {
            let found = [at.lateral.friction, at.C_alpha / 1e3];
            let near = (found[0] - friction).abs() < 5e-4 && (found[1] - stiffness).abs() < 5e-3;
            assert!(near, "{file}: {found:?}, expected {lateral:?}");
        }
        if file.starts_with("tir_pac2002") {
            assert!((at.C_gamma / 1e3 - 3.42).abs() < 5e-3, "{file}: {}", at.C_gamma);
        }
        let warns = |it: &&TireFileMessage| it.level == TireMessageLevel::Warning;
        let warnings: Vec<_> = messages.iter().filter(warns).map(|it| it.text.as_str()).collect();
        match warning {
            Some(words) => assert!(warnings.iter().any(|it| it.contains(words)), "{warnings:?}"),
            None => assert!(warnings.is_empty(), "{file}: {warnings:?}"),
        }
        Ok(())
    }
}
