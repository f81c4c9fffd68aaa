//! Tests of bundles: scenarios are gathered, written and read back.

use std::path::Path;

use super::*;
use crate::build_request::BuildRequest;

const LAYOUT: BundleLayout = BundleLayout { fmus: "resources", others: "extra/files", plugins: None };

fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        std::fs::write(path, text).expect("a file");
    }
    folder
}

fn gathered(path: &Path, built: &BuildArtifacts) -> Result<ScenarioBundle, Error> {
    ScenarioBundle::gather(&Scenario::read(path).expect("a scenario"), built, LAYOUT)
}

#[test]
fn a_bundle_has_all_files_of_what_it_extends_and_of_its_validations() {
    let base = "seed = 7\n[time]\nstep = 0.1\nstop = 1.0\n[[fmu]]\nname = \"plant\"\npath = \"Plant ü.fmu\"\nstart = { a.b = 0.1, \"a.c\" = 3 }\n[[table]]\nname = \"log\"\npath = \"drive.csv\"\ncolumns = { v = { column = \"v\" } }\n[[check]]\nname = \"gone\"\nthat = \"1 < 2\"\n";
    let child = "extends = \"base/base.toml\"\n[[fmu]]\nname = \"twin\"\npath = \"base/Plant ü.fmu\"\n";
    let main = "extends = \"base/base.toml\"\nwithout = { check = [\"gone\"] }\n[[fmu]]\nname = \"made\"\ncrate = \"made-fmu\"\n[[table]]\nname = \"other\"\npath = \"DRIVE.csv\"\ncolumns = { v = { column = \"v\" } }\n[[validation]]\nname = \"v\"\nscenario = \"child.toml\"\nset = [\"@tires.toml\", \"@kept.toml\", \"plant.a=1\"]\n[[analysis]]\nname = \"a\"\ncrate = \"identify\"\nfiles = { prior = \"kept.toml\" }\n[[baseline]]\nname = \"b\"\nrecording = \"golden.csv\"\n[view.track]\npath = \"track.csv\"\ncenter = [\"x\", \"y\"]\nhalf_width = 3.0\n";
    let folder = folder(&[
        ("base/base.toml", base),
        ("base/Plant ü.fmu", "fmu"),
        ("base/drive.csv", "t,v\n0,1\n"),
        ("DRIVE.csv", "t,v\n0,2\n"),
        ("made.fmu", "made"),
        ("child.toml", child),
        ("kept.toml", "a = 1\n"),
        ("golden.csv", "t\n0\n"),
        ("track.csv", "x,y\n0,0\n"),
        ("main.toml", main),
    ]);
    let mut built = BuildArtifacts::default();
    let request = BuildRequest { package: "made-fmu".to_owned(), example: None };
    built.archives.insert(request, folder.path().join("made.fmu"));
    let bundle = gathered(&folder.path().join("main.toml"), &built).expect("a bundle");
    let names: Vec<_> = bundle.files.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "extra/files/DRIVE_2.csv",
            "extra/files/child.toml",
            "extra/files/drive.csv",
            "extra/files/golden.csv",
            "extra/files/kept.toml",
            "extra/files/track.csv",
            "kept.toml",
            "resources/Plant__.fmu",
            "resources/made.fmu",
        ]
    );
    assert_eq!(bundle.fmus["plant"], "resources/Plant__.fmu");
    assert_eq!(bundle.notes.len(), 1, "{:?}", bundle.notes);
    let Some(BundledFile::Text(child)) = bundle.files.get("extra/files/child.toml") else {
        panic!("the child is a text")
    };
    assert!(child.contains("path = \"../../resources/Plant__.fmu\""), "{child}");

    let elsewhere = tempfile::tempdir().expect("a folder");
    bundle.write(elsewhere.path()).expect("written");
    drop(folder);
    let again = Scenario::read(&elsewhere.path().join(SCENARIO)).expect("the file");
    assert_eq!(again.document.seed, 7);
    assert_eq!(again.validations.len(), 1);
    let second = ScenarioBundle::gather(&again, &BuildArtifacts::default(), LAYOUT).expect("gathered again");
    assert_eq!((second.text, second.files.len()), (bundle.text, bundle.files.len()));
}

#[test]
fn each_file_that_is_missing_is_told_at_its_word() {
    let main = "[time]\nstep = 0.1\nstop = 1.0\n[[fmu]]\nname = \"a\"\npath = \"none.fmu\"\n[[fmu]]\nname = \"b\"\ncrate = \"b\"\n[[table]]\nname = \"t\"\npath = \".\"\ncolumns = {}\n";
    let folder = folder(&[("main.toml", main)]);
    let error = gathered(&folder.path().join("main.toml"), &BuildArtifacts::default()).expect_err("missing");
    let messages: Vec<_> = error.into_single_errors().iter().map(ToString::to_string).collect();
    assert_eq!(messages.len(), 3, "{messages:?}");
    assert!(messages[0].contains("none.fmu"), "{messages:?}");
    assert!(messages[1].contains("expected a built package"), "{messages:?}");
    assert!(messages[2].contains("expected a file, found a folder"), "{messages:?}");
}
