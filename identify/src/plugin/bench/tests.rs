//! Runs the task with files of a bench as the program hands them over.

use std::io::Write as _;

use plugin::{Analysis as _, AnalysisRequest, AnalysisServices, ConfigFile, Diagram, Signal};
use serde_json::Value;

use crate::plugin::Identify;

const FILE: &str = include_str!("../../../../scenarios/bench/sports_tire.csv");

const TIRE: &str = "unloaded_radius = 0.317\nnominal_load = 4000.0\nnominal_pressure = 23e4\n";

/// Keeps the files.
#[derive(Default)]
struct Files(Vec<(String, String)>);

impl AnalysisServices for Files {
    fn report_progress(&mut self, _: f64, _: &str) -> bool {
        true
    }
    fn record_signals(&mut self, _: &str, _: &[Signal]) {}
    fn add_diagram(&mut self, _: &str, _: &Diagram) {}
    fn write_file(&mut self, name: &str, text: &str) {
        self.0.push((name.to_owned(), text.to_owned()));
    }
}

/// The configuration with files as the program adds them.
fn config(more: &str, files: &[(&str, &[u8])]) -> String {
    let files =
        files.iter().map(|(name, bytes)| ((*name).to_owned(), ConfigFile::config_value(bytes.to_vec())));
    let table = toml::Table::from_iter([("files".to_owned(), toml::Table::from_iter(files).into())]);
    format!("task = \"bench\"\n{TIRE}{more}\n{table}")
}

fn run(config: &str) -> Result<(Value, Files), String> {
    let (request, mut files) = (AnalysisRequest { config, signals: Vec::new() }, Files::default());
    Identify::check_request(&request).map_err(|error| error.to_string())?;
    let result = Identify::run(&request, &mut files).map_err(|error| error.to_string())?;
    Ok((serde_json::from_str(&result).expect("JSON"), files))
}

#[test]
fn a_packed_file_becomes_a_tire_a_page_and_verdicts() {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packed.write_all(FILE.as_bytes()).expect("memory");
    let packed = packed.finish().expect("memory");
    let (found, Files(files)) = run(&config("axes = \"sae\"", &[("a", &packed)])).expect("a tire");
    let names: Vec<_> = files.iter().map(|it| it.0.as_str()).collect();
    assert_eq!(names, ["bench.tir", "tires.html"]);
    assert!(files[0].1.contains("identified: the data narrow it"), "{}", &files[0].1[..600]);
    let page = roxmltree::Document::parse_with_options(
        &files[1].1,
        roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() },
    );
    let page = page.expect("well-formed");
    let count = |tag: &str| {
        page.descendants().filter(|it| it.has_tag_name(("http://www.w3.org/1999/xhtml", tag))).count()
    };
    assert!(!files[1].1.contains("-0.0 deg"));
    // 12 sweeps each of F_x, F_y and M_z.
    assert_eq!((count("figure"), count("h2")), (36, 4));
    let coefficients = &found["coefficients"];
    assert_eq!(coefficients["PDY1"]["verdict"], "identified");
    // One run says nothing of later ones.
    assert_eq!(coefficients["TDY3"]["verdict"], "not_identifiable", "{}", coefficients["TDY3"]);
    let summary = found["summary"].to_string();
    assert!(
        summary.contains("a: 24 sweeps were found by their conditions") && summary.contains("are identified"),
        "{summary}"
    );
}

#[test]
fn files_and_settings_that_do_not_fit_are_refused_with_what_to_do() {
    let sae = "axes = \"sae\"";
    let bare = FILE.replace(" [N]", "");
    for (more, bytes, expected) in [
        ("", FILE.as_bytes(), "a: expected F_z above 0"),
        (sae, &FILE.as_bytes()[..60], "a: expected a line with names"),
        (sae, &[0xff, 0, 1, 2], "a: expected a table as text, a MAT file or TYDEX"),
        (sae, bare.as_bytes(), "or units = \"ttc_metric\" for all"),
        (
            "columns = { load = { column = \"FZ\" } }",
            FILE.as_bytes(),
            "columns: no channel `load`; known: block, time_s",
        ),
        ("constants = { load = 1.0 }", FILE.as_bytes(), "constants: no channel `load`"),
        (
            "constants = { pressure_pa = inf }",
            FILE.as_bytes(),
            "constants.pressure_pa: expected a number, found inf",
        ),
        (
            "constants = { b = { pressure_pa = 8e4 } }",
            FILE.as_bytes(),
            "constants: no file `b` in [analysis.files]; known: a",
        ),
        (
            "constants = { a = { load = 1.0 } }",
            FILE.as_bytes(),
            "constants.a: no channel `load`; known: block",
        ),
        ("units = \"mks\"", FILE.as_bytes(), "units: unknown variant `mks`"),
        (
            "columns = { fz_n = { column = \"load\" } }",
            FILE.as_bytes(),
            "a:2: expected a column load for fz_n",
        ),
    ] {
        let error = run(&config(more, &[("a", bytes)])).map(|it| it.0).expect_err(expected);
        assert!(error.contains(expected), "{error}, expected {expected}");
    }
    let error = run(&config(sae, &[])).map(|it| it.0).expect_err("no file");
    assert!(error.contains("expected files of a bench in [analysis.files]"), "{error}");
}
