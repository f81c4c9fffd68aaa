//! Runs FMUs in archives that are packed in unusual ways, and in temporary folders that are unfit: each runs, or the cause is named.

use std::io::Write as _;
use std::process::Command;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::fixture::Scenario;
use super::full_disks::on_disk;
use super::harness::{Ended, Lab, trackside};
use super::libraries::{description, library};
use super::requirement::cases;

tests! {
    archives_that_others_pack_run: Compiler,
    a_description_in_a_folder_or_of_other_letters_is_read_and_told: Compiler,
    links_inside_the_archive_are_made_and_others_refused: Compiler,
    a_program_of_the_archive_can_be_executed: Compiler,
    a_temporary_folder_that_is_missing_or_no_folder_is_told: Compiler,
    a_temporary_folder_that_is_full_or_forbids_programs_is_told: Compiler + SmallDisk,
    the_cases_of_others_run_or_name_the_cause: Cases,
}

/// An archive in the making.
struct Packer(ZipWriter<std::io::Cursor<Vec<u8>>>);

impl Packer {
    fn new() -> Self {
        Packer(ZipWriter::new(std::io::Cursor::new(Vec::new())))
    }

    fn file(mut self, name: &str, bytes: &[u8], options: SimpleFileOptions) -> Self {
        self.0.start_file(name, options).expect("an entry");
        self.0.write_all(bytes).expect("an entry");
        self
    }

    fn link(mut self, name: &str, target: &str) -> Self {
        self.0.add_symlink(name, target, SimpleFileOptions::default()).expect("a link");
        self
    }

    fn end(self) -> Vec<u8> {
        self.0.finish().expect("an archive").into_inner()
    }
}

/// The FMU `case`, whose `y` is 3, with the names that this function gives.
fn packed(lab: &Lab, method: CompressionMethod, name: impl Fn(&str) -> String) -> Packer {
    let plain = library(lab, "case", &[]);
    let options = SimpleFileOptions::default().compression_method(method);
    let packer = Packer::new().file(&name("modelDescription.xml"), description("case").as_bytes(), options);
    packer.file(&name("binaries/linux64/case.so"), &plain, options)
}

/// A lab with this archive and a scenario of it.
fn lab_with(lab: Lab, archive: Vec<u8>) -> Lab {
    lab.write("case.fmu", archive);
    let one = Scenario::new().time(0.1, 0.5).fmu("a", "case.fmu", "");
    lab.write("case.toml", one.check("y", "last(a.y) == 3").text());
    lab
}

/// Runs it in all ways; a plain run tells this, or nothing, and `conform` finds what it tells.
fn runs(lab: &Lab, told: &str) {
    let run = ["run", "case.toml", "--out", "out", "--rerun", "off"];
    lab.trackside(&run).expect(0);
    let warnings = lab.report("out")["warnings"].to_string();
    assert!(if told.is_empty() { warnings == "[]" } else { warnings.contains(told) }, "{warnings}");
    lab.trackside(&["test", "case.toml"]).expect(0);
    let inspected = lab.trackside(&["inspect", "case.fmu"]).expect(0);
    assert!(inspected.stdout.contains(told), "{}", inspected.stdout);
    let judged = lab.trackside(&["conform", "case.fmu"]);
    assert!(judged.stdout.contains(told), "{}", judged.stdout);
    assert!(!judged.stdout.contains("cannot be read"), "{}", judged.stdout);
}

/// Everything that opens the archive refuses it with these words.
fn refused(lab: &Lab, words: &[&str]) {
    for arguments in
        [["run", "case.toml"], ["test", "case.toml"], ["inspect", "case.fmu"], ["conform", "case.fmu"]]
    {
        let ended = lab.trackside(&arguments);
        assert!(matches!(ended.code(), Some(1..=3)), "{arguments:?}: {}", ended.stderr);
        tells(&ended, words);
    }
}

/// Insists on these words, wherever lines break.
#[track_caller]
fn tells(ended: &Ended, words: &[&str]) {
    let joined = |text: &str| text.split_whitespace().collect::<String>();
    let all = joined(&format!("{} {}", ended.message(), ended.stdout));
    for word in words {
        assert!(all.contains(&joined(word)), "expected {word:?} in:\n{}\n{}", ended.stderr, ended.stdout);
    }
}

fn archives_that_others_pack_run() {
    for method in [
        CompressionMethod::Stored,
        CompressionMethod::Deflated,
        CompressionMethod::Bzip2,
        CompressionMethod::Zstd,
    ] {
        let lab = Lab::new();
        let archive = packed(&lab, method, str::to_owned).end();
        runs(&lab_with(lab, archive), "");
    }
    let lab = Lab::new();
    let archive = packed(&lab, CompressionMethod::Deflated, |name| format!("./{name}")).end();
    runs(&lab_with(lab, [b"data in front".to_vec(), archive].concat()), "");
    let lab = Lab::new();
    let archive = packed(&lab, CompressionMethod::Deflated, |name| name.replace('/', "\\")).end();
    runs(&lab_with(lab, archive), "have `\\");
}

fn a_description_in_a_folder_or_of_other_letters_is_read_and_told() {
    let deflated = CompressionMethod::Deflated;
    for (from, to, told) in [
        ("", "model/", "its description is `model/modelDescription.xml`"),
        ("modelDescription", "ModelDescription", "its description is `ModelDescription.xml`"),
    ] {
        let lab = Lab::new();
        let archive = packed(&lab, deflated, |name| name.replacen(from, to, 1)).end();
        runs(&lab_with(lab, archive), told);
    }
    let lab = Lab::new();
    let two = packed(&lab, deflated, |name| format!("one/{name}"));
    let text = description("case");
    let two = two.file("two/modelDescription.xml", text.as_bytes(), SimpleFileOptions::default());
    refused(
        &lab_with(lab, two.end()),
        &["one/modelDescription.xml and two/modelDescription.xml", "pack each FMU for itself"],
    );
    let lab = Lab::new();
    let none = packed(&lab, deflated, |name| name.replace("modelD", "d")).end();
    refused(
        &lab_with(lab, none),
        &["modelDescription.xml", "at the top of the archive, found binaries, description.xml"],
    );
}

fn links_inside_the_archive_are_made_and_others_refused() {
    let with = |add: &dyn Fn(Packer) -> Packer| {
        let lab = Lab::new();
        let packer =
            packed(&lab, CompressionMethod::Deflated, |name| name.replace("linux64/case.so", "real/case.so"));
        let packer = packer.link("binaries/linux64", "./real");
        let archive = add(packer).end();
        lab_with(lab, archive)
    };
    runs(&with(&|packer| packer), "");
    runs(&with(&|packer| packer.link("resources/a", "../b/./c").link("b", "binaries")), "");
    for (links, words) in [
        (&[("resources/out", "../../etc")][..], "`resources/out` leads to `../../etc`"),
        (&[("out", "/etc/passwd")], "`out` leads to `/etc/passwd`"),
        (&[("out", "C:\\Windows")], "`out` leads to `C:\\Windows`"),
        (&[("out", "..\\..\\etc")], "outside of the archive"),
        (&[("a/b", "."), ("out", "a/b/../../../x")], "outside of the archive"),
        (
            &[("up", "binaries/.."), ("out", "up/../x")],
            "`out` leads to `up/../x`, which is outside of the archive",
        ),
        (&[("out", "round"), ("round", "out")], "a circle of links"),
        (&[("binaries/REAL", "..")], "another entry has the same name"),
    ] {
        let all = |packer: Packer| links.iter().fold(packer, |packer, (name, to)| packer.link(name, to));
        refused(&with(&all), &["case.fmu", words]);
    }
}

fn a_program_of_the_archive_can_be_executed() {
    let lab = Lab::new();
    let main = library(&lab, "case", &["-DTOOL"]);
    let options = SimpleFileOptions::default();
    let packer = Packer::new()
        .file("modelDescription.xml", description("case").as_bytes(), options)
        .file("binaries/linux64/case.so", &main, options)
        // Nobody gets other rights by it.
        .file("resources/tool.sh", b"#!/bin/sh\nexit 3\n", options.unix_permissions(0o4755));
    runs(&lab_with(lab, packer.end()), "");
}

/// The end of a run with this temporary folder.
fn with_folder(lab: &Lab, folder: &str, command: &str) -> Ended {
    let mut run = trackside(&lab.path(""));
    Ended::of(run.args([command, "case.toml"]).env("TMPDIR", folder).output().expect("it starts"))
}

fn plain_case() -> Lab {
    let lab = Lab::new();
    let archive = packed(&lab, CompressionMethod::Deflated, str::to_owned).end();
    lab_with(lab, archive)
}

fn a_temporary_folder_that_is_missing_or_no_folder_is_told() {
    let lab = plain_case();
    for command in ["run", "test"] {
        for (folder, cure) in
            [("/nowhere/at/all", "name a folder that exists"), ("case.toml", "name a folder")]
        {
            let folder = if folder == "case.toml" {
                lab.path(folder).display().to_string()
            } else {
                folder.to_owned()
            };
            let ended = with_folder(&lab, &folder, command);
            assert!(ended.code() != Some(0), "{folder}");
            tells(&ended, &["temporary folder", &folder, "TMPDIR", cure]);
        }
    }
}

fn a_temporary_folder_that_is_full_or_forbids_programs_is_told() {
    let lab = plain_case();
    let (disk, own) = (lab.path("disk"), trackside(&lab.path("")));
    std::fs::create_dir_all(&disk).expect("a folder");
    let program = own.get_program().to_str().expect("a path of letters");
    let folder = disk.display();
    for (size, words) in [
        ("16k", ["No space left on device", "make room there"]),
        ("4m,noexec", ["failed to map segment", "`noexec`"]),
    ] {
        let command = format!("TMPDIR='{folder}' {program} run case.toml --rerun off");
        let mut shell: Command = on_disk(size, &folder.to_string(), &command);
        let ended = Ended::of(shell.current_dir(lab.path("")).output().expect("it starts"));
        assert!(matches!(ended.code(), Some(2 | 3)), "{size}: {}", ended.stderr);
        tells(&ended, &words);
        tells(&ended, &["temporary folder", &folder.to_string(), "TMPDIR"]);
    }
}

fn the_cases_of_others_run_or_name_the_cause() {
    for folder in
        ["same_dependency", "unique_symbols", "openmp", "lib_dependency", "exec_bit", "zip_oddities"]
    {
        let lab = Lab::new();
        let mut scenarios = Vec::new();
        for entry in std::fs::read_dir(cases().join(folder)).expect("a folder") {
            let path = entry.expect("an entry").path();
            lab.add(&path);
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            if name.ends_with(".toml") && name != "sweep.toml" {
                scenarios.push(name);
            }
        }
        assert!(!scenarios.is_empty(), "{folder}");
        for name in &scenarios {
            for more in ["--isolate=none", "--isolate=all"] {
                let ended = lab.trackside(&["run", name, "--rerun", "off", more]).expect(0);
                assert!(!ended.stderr.contains("SIG"), "{folder}/{name}: {}", ended.stderr);
            }
            lab.trackside(&["test", name]).expect(0);
        }
        if lab.has("sweep.toml") {
            lab.trackside(&["sweep", "sweep.toml", "--jobs", "2"]).expect(0);
        }
    }
}
