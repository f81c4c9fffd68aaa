//! Reads the HDF5 that h5py writes as MATLAB and as other programs do, and holds it against what was written.
//!
//! `TRACKSIDE_H5PY` names a Python that has h5py; else an environment is made for it, once.

use std::path::{Path, PathBuf};
use std::process::Command;

use mat_file::{MatFile, MatValue, read_mat_file};

/// The version whose files we know.
const PACKAGE: &str = "h5py==3.16.0";

fn run(command: &mut Command) -> Result<(), String> {
    let output = command.output().map_err(|error| error.to_string())?;
    match output.status.success() {
        true => Ok(()),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    }
}

/// A Python that has h5py, or why there is none.
fn python() -> Result<PathBuf, String> {
    if let Some(given) = std::env::var_os("TRACKSIDE_H5PY") {
        return Ok(given.into());
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(PACKAGE);
    let python = folder.join("bin/python");
    let has = |python: &Path| run(Command::new(python).args(["-c", "import h5py"]));
    if has(&python).is_err() {
        run(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
        run(Command::new(&python).args(["-m", "pip", "install", "--quiet", PACKAGE]))?;
        has(&python)?;
    }
    Ok(python)
}

#[test]
#[ignore = "needs Python with h5py, or venv and a network"]
fn what_h5py_writes_is_read() {
    let python = python().expect("h5py");
    let folder = tempfile::tempdir().expect("a folder");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/write.py");
    run(Command::new(&python).arg("-B").arg(&script).arg(folder.path())).expect("files");
    let bytes = |name: &str| std::fs::read(folder.path().join(name)).expect("a file");
    of_matlab(&read_mat_file(&bytes("matlab.mat")).expect("version 7.3"));
    for name in ["old.h5", "new.h5"] {
        of_others(&read_mat_file(&bytes(name)).expect(name));
    }
    let error = read_mat_file(&bytes("circle.h5")).expect_err("a circle").to_string();
    assert!(error.contains("expected at most 32 structs within each other"), "{error}");
    // Soft links of old groups are beyond hdf5-pure 0.47.
    let error = read_mat_file(&bytes("linked.h5")).expect_err("a soft link").to_string();
    assert!(error.contains("a group with soft links cannot be read"), "{error}");
    // A file that ends early never gives other numbers.
    let whole = bytes("matlab.mat");
    let speed = read_mat_file(&whole).expect("a file").numeric_array("speed").cloned();
    for end in (512..whole.len()).step_by(97) {
        let found = read_mat_file(&whole[..end]).ok().and_then(|it| it.numeric_array("speed").cloned());
        assert!(found.is_none() || found == speed, "{end}");
    }
}

fn numbers(found: &MatFile, name: &str) -> (Vec<usize>, Vec<f64>) {
    let array = found.numeric_array(name).unwrap_or_else(|| panic!("no numbers `{name}`"));
    (array.shape.clone(), array.values.clone())
}

fn of_matlab(found: &MatFile) {
    let ramp: Vec<f64> = (0..1000).map(f64::from).collect();
    assert_eq!(numbers(found, "speed"), (vec![1000, 1], ramp));
    assert_eq!(numbers(found, "matrix"), (vec![2, 3], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    assert_eq!(numbers(found, "single"), (vec![1, 1], vec![0.5]));
    assert_eq!(numbers(found, "on"), (vec![2, 1], vec![1.0, 0.0]));
    assert_eq!(numbers(found, "big"), (vec![2, 1], vec![1.5, -2.5]));
    assert_eq!(numbers(found, "nothing"), (vec![0, 3], vec![]));
    assert_eq!(found.text_rows("name"), Some(&["Größe 10\"".to_owned()][..]));
    assert_eq!(found.text_rows("names"), Some(&["FX".to_owned(), "P".to_owned()][..]));
    assert_eq!(found.get("mixed{1}"), Some(&MatValue::Texts(vec!["FX".to_owned()])));
    assert_eq!(numbers(found, "mixed{2}").1, [3.0, 4.0]);
    assert_eq!(numbers(found, "channel.value").1, [7.0, 8.0]);
    assert_eq!((numbers(found, "run(1).FY").1, numbers(found, "run(2).FY").1), (vec![1.5], vec![2.5]));
    let skipped: Vec<_> = found.skipped.iter().map(|it| it.0.as_str()).collect();
    assert_eq!(skipped, ["table", "thin", "waves"], "{:?}", found.skipped);
    assert_eq!(found.variables.len(), 13);
}

fn of_others(found: &MatFile) {
    assert_eq!(numbers(found, "log.time").1, [0.0, 0.01, 0.02, 0.03, 0.04]);
    assert_eq!(numbers(found, "log.v_x").1, [0.0, 1.0, 2.0, 3.0, 4.0]);
    assert_eq!(found.text_rows("log.v_x_units"), Some(&["km/h".to_owned()][..]));
    let (shape, wheels) = numbers(found, "log.wheels");
    assert_eq!((shape, wheels[4]), (vec![4, 5], 4.0));
    assert_eq!(numbers(found, "log.brake").1, [1.0, 0.0, 1.0, 1.0, 0.0]);
    assert_eq!(found.text_rows("log.note"), Some(&["dry".to_owned()][..]));
}
