//! Reads manifests of both forms, and compares written numbers.

use super::manifest::{parse_experiments, parse_parameter_set};
use super::*;

const FOLDER: &str = "extra/org.fmi-standard.fmi-ls-ref/";

/// What is found in an archive with these files in the folder of references.
fn found(files: &[(&str, &str)]) -> Result<Vec<ReferenceExperiment>, String> {
    parse_experiments(&|name| {
        let inside = name.strip_prefix(FOLDER)?;
        let file = files.iter().find(|file| file.0 == inside)?;
        Some(file.1.as_bytes().to_vec())
    })
}

#[test]
fn experiments_are_found_in_both_forms_of_a_manifest() {
    assert_eq!(found(&[]), Ok(Vec::new()));
    let all = found(&[
        (
            "fmi-ls-manifest.xml",
            "<fmiReferences><Experiment name='a' startTime='1' stepSize='0.5' tolerance='1e-3'>\
             <Stimuli source='in.csv'/><References source='sub/a%20b.csv'/></Experiment>\
             <Related source='r.csv' type='text/csv' role='result'/><Related source='m.mo' role='model'/>\
             <Related source='sub/e.xml' role='experiment/smoke-test'/>\
             <Related source='https://x/y.csv' role='result'/></fmiReferences>",
        ),
        (
            "sub/e.xml",
            "<Experiments><Experiment name='b'><Parameters source='../p.ssv'/></Experiment></Experiments>",
        ),
    ])
    .expect("a manifest");
    assert_eq!(all.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["a", "r.csv", "b"]);
    let path = |source: &Option<ExperimentFile>| source.as_ref().map(|it| it.path.replace(FOLDER, ""));
    assert_eq!((all[0].start, all[0].step, all[0].tolerance), (Some(1.0), Some(0.5), Some(1e-3)));
    assert_eq!(path(&all[0].results).as_deref(), Some("sub/a b.csv"));
    assert_eq!(path(&all[1].results).as_deref(), Some("r.csv"));
    assert_eq!(path(&all[2].parameters).as_deref(), Some("p.ssv"));
}

#[test]
fn what_is_wrong_with_a_manifest_is_told() {
    for (manifest, what) in [
        ("<fmiReferences>", "fmi-ls-manifest.xml: "),
        ("<a><Related role='result'/></a>", "<Related> has no source"),
        ("<a><Related role='result' source='../../../../x.csv'/></a>", "leads out of the archive"),
        ("<a><Related role='experiment' source='x.xml'/></a>", "which is not in the archive"),
        ("<a><Experiment stepSize='short'/></a>", "stepSize=\"short\""),
    ] {
        let error = found(&[("fmi-ls-manifest.xml", manifest)]).expect_err(manifest);
        assert!(error.contains(what), "{error}");
    }
    let set = b"<s:ParameterSet xmlns:s='s'><s:Parameters><s:Parameter name='k'><s:Real value='2'/></s:Parameter></s:Parameters></s:ParameterSet>";
    assert_eq!(parse_parameter_set(set), Ok(vec![("k".to_owned(), "2".to_owned())]));
    assert!(parse_parameter_set(b"<x/>").is_err_and(|error| error.contains("<ParameterSet>")));
}

#[test]
fn tables_need_a_time_that_goes_on() {
    for (text, what) in [
        ("y,time\n1,2\n", "the title \"time\""),
        ("time,y\n", "found titles only"),
        ("time,y\n0,1\nlater,2\n", "line 3: expected a time, found \"later\""),
        ("time,y\n1,1\n0,2\n", "line 3: the time goes back to 0 s"),
        ("time,y\n0,1,2\n", "line: 2"),
    ] {
        let error = CsvTable::parse(text.as_bytes()).expect_err(text);
        assert!(error.contains(what), "{error}");
    }
    let table = CsvTable::parse(b"time, y\n0, 1 2\n1,3 4\n").expect("a table");
    assert_eq!(table.cell_words(1, 1, FmiType::Real), ["3", "4"]);
    assert_eq!([table.row_at(-1.0), table.row_at(0.5), table.row_at(7.0)], [0, 0, 1]);
}

#[test]
fn written_numbers_leave_half_a_digit_open() {
    let of = |word: &str, found: f64| {
        let expected = parse_value(word, FmiType::Real).expect("a number");
        relative_difference(word, &expected, &Value::Real(found), 1.0)
    };
    assert_eq!(of("0.33", 1.0 / 3.0), 0.0);
    assert_eq!(of("2.5e3", 2540.0), 0.0);
    assert!(of("0.33", 0.34) > 0.004);
    assert!(of("2", 2.1) > 0.04);
    assert_eq!((of("1", f64::NAN), of("NaN", f64::NAN)), (f64::INFINITY, 0.0));
    let text = Value::String("a".to_owned());
    assert_eq!(relative_difference("b", &Value::String("b".to_owned()), &text, 1.0), f64::INFINITY);
}
