//! Makes the FMUs of the tests: ours packed, one that misbehaves compiled, archives with mistakes.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

use super::harness::{Ended, Lab, ROOT, trackside};

/// The folder with `plant.fmu`, `controller.fmu` and `estimator.fmu`, packed once by the program, and with the same for FMI 3.0, such as
/// `plant_fmi3.fmu`.
pub fn ours() -> &'static Path {
    static PACKED: OnceLock<PathBuf> = OnceLock::new();
    PACKED.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fmu");
        for version in ["2", "3"] {
            let mut pack = trackside(Path::new(ROOT));
            pack.args(["pack", "--fmi", version, "--out"]).arg(&folder);
            Ended::of(pack.output().expect("it starts")).expect(0);
        }
        folder
    })
}

/// `spring_damper.fmu`, the example of `crates/fmu-export`, packed once by the program.
pub fn example() -> &'static Path {
    static PACKED: OnceLock<PathBuf> = OnceLock::new();
    PACKED.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("example");
        let mut pack = trackside(Path::new(ROOT));
        pack.args(["pack", "--example", "spring_damper", "--out"]).arg(&folder);
        Ended::of(pack.output().expect("it starts")).expect(0);
        folder.join("spring_damper.fmu")
    })
}

/// `sprung_mass.fmu`, the example that is half of a system, packed once by the program.
pub fn sprung_mass() -> &'static Path {
    static PACKED: OnceLock<PathBuf> = OnceLock::new();
    PACKED.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("sprung_mass");
        let mut pack = trackside(Path::new(ROOT));
        pack.args(["pack", "--example", "sprung_mass", "--out"]).arg(&folder);
        Ended::of(pack.output().expect("it starts")).expect(0);
        folder.join("sprung_mass.fmu")
    })
}

/// The folder with `mass_chain.fmu` and `mass_chain_fmi3.fmu`, the example with arrays, packed once by the program.
pub fn chain() -> &'static Path {
    static PACKED: OnceLock<PathBuf> = OnceLock::new();
    PACKED.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("chain");
        for version in ["2", "3"] {
            let mut pack = trackside(Path::new(ROOT));
            pack.args(["pack", "--example", "mass_chain", "--fmi", version, "--out"]).arg(&folder);
            Ended::of(pack.output().expect("it starts")).expect(0);
        }
        folder
    })
}

/// The FMU of `fmu/misbehave.c`, compiled once.
pub fn misbehave() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| compile(&[]))
}

/// The FMU of `fmu/misbehave.c`, compiled with these arguments.
pub fn compile(arguments: &[&str]) -> Vec<u8> {
    build("misbehave", arguments)
}

/// The FMU of `fmu/deviate.c`, compiled with these arguments: `-DBREAKS="..."` names the broken rule.
pub fn deviate(arguments: &[&str]) -> Vec<u8> {
    build("deviate", arguments)
}

/// The FMU of `fmu/deviate3.c`, compiled with these arguments: the same for FMI 3.0.
pub fn deviate3(arguments: &[&str]) -> Vec<u8> {
    build("deviate3", arguments)
}

/// The FMU of `fmu/deviate3.c`, compiled once, with a call of `fault` of `fmu/fault.h` at the begin of each function.
pub fn faulty3() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| {
        let sources = Path::new(ROOT).join("tests/acceptance/fmu");
        let source = std::fs::read_to_string(sources.join("deviate3.c")).expect("the source");
        let mut faulty = String::from("#include \"fault.h\"\n");
        for part in source.split_inclusive(" {\n") {
            faulty += part;
            let head = part.rsplit(['}', ';']).next().unwrap_or_default();
            if let Some((kind, rest)) = head.split_once("fmi3") {
                let name = &rest[..rest.find('(').expect("a function")];
                let result = if kind.ends_with('*') { "NULL" } else { "fails" };
                faulty += &format!("int fails = fault(\"fmi3{name}\");\nif (fails >= 0) return {result};\n");
            }
        }
        let lab = Lab::new();
        let source = lab.write("faulty.c", faulty);
        let mut cc = Command::new("cc");
        cc.args(["-fPIC", "-I"]).arg(sources);
        build_source(cc, &source, "deviate3", ["linux64", "x86_64-linux"], "so")
    })
}

/// The FMU of `fmu/relay.c`, compiled once: its outputs repeat its inputs, of every type.
pub fn relay() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| build("relay", &[]))
}

/// The FMU of `fmu/stubborn.c`, compiled once: it does what foreign FMUs do.
pub fn stubborn() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| build("stubborn", &[]))
}

/// The FMU of `fmu/resizable.c`, compiled once: one of FMI 3.0, whose arrays have any size.
pub fn resizable() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| build("resizable", &[]))
}

/// The same, whose steps write a boolean of four bytes where there is one byte.
pub fn resizable_with_wide_booleans() -> Vec<u8> {
    build("resizable", &["-DWIDE"])
}

/// The FMU of `fmu/clocked.c`, compiled once: one of FMI 3.0 with event mode, clocks and intermediate updates.
pub fn clocked() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| build("clocked", &[]))
}

/// The FMU of `fmu/forgetful.c`, compiled with these arguments: it adds up its input and counts its steps, and
/// `-DFORGETS` says that the count is no part of its state.
pub fn forgetful(arguments: &[&str]) -> Vec<u8> {
    build("forgetful", arguments)
}

/// The FMU of `fmu/talkative.c`, compiled once: it logs whatever it is told to.
pub fn talkative() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| build("talkative", &[]))
}

/// The FMU of `fmu/trespass.c`, compiled once: it does what a process may not.
pub fn trespass() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| build("trespass", &[]))
}

/// The FMU of `fmu/clock.c`, compiled once: it notes its steps where they outlive it.
pub fn clock() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| build("clock", &[]))
}

/// The FMU of `fmu/equations.c`, compiled once: one for model exchange only.
pub fn equations() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| build("equations", &[]))
}

/// The FMU of `fmu/slave1.c`, one of FMI 1.0 for co-simulation, compiled with these arguments.
pub fn slave1(arguments: &[&str]) -> Vec<u8> {
    build("slave1", arguments)
}

/// The FMU of `fmu/ball1.c`, one of FMI 1.0 for model exchange.
pub fn ball1() -> Vec<u8> {
    build("ball1", &[])
}

/// The FMU of `fmu/hazard.c` for Windows, compiled once: it does what ends a process.
pub fn hazard_for_windows() -> &'static [u8] {
    static BUILT: OnceLock<Vec<u8>> = OnceLock::new();
    BUILT.get_or_init(|| for_windows("hazard"))
}

/// Another version of the relay: each step adds this to the number that it shows.
pub fn drifting_relay(drift: f64) -> Vec<u8> {
    build("relay", &[&format!("-DDRIFT={drift:?}")])
}

fn build(name: &str, arguments: &[&str]) -> Vec<u8> {
    let mut cc = Command::new("cc");
    cc.arg("-fPIC").args(arguments);
    build_for(cc, name, ["linux64", "x86_64-linux"], "so")
}

/// The FMU of a source that is plain C, for Windows alone.
pub fn for_windows(name: &str) -> Vec<u8> {
    let mut cc = Command::new("x86_64-w64-mingw32-gcc");
    cc.arg("-Wl,--allow-multiple-definition");
    build_for(cc, name, ["win64", "x86_64-windows"], "dll")
}

/// `folders` are those of libraries of FMI 2.0 and 3.0.
fn build_for(cc: Command, name: &str, folders: [&str; 2], extension: &str) -> Vec<u8> {
    let source = Path::new(ROOT).join("tests/acceptance/fmu").join(format!("{name}.c"));
    build_source(cc, &source, name, folders, extension)
}

/// The FMU of a source, with the description `name`.
fn build_source(mut cc: Command, source: &Path, name: &str, folders: [&str; 2], extension: &str) -> Vec<u8> {
    let descriptions = Path::new(ROOT).join("tests/acceptance/fmu");
    let shared = Path::new(ROOT).join("crates/fmu-import/tests/support");
    let lab = Lab::new();
    // MinGW-w64 adds an extension to a name without one.
    let library = lab.path(&format!("library.{extension}"));
    cc.args(["-shared", "-O0", "-Wall", "-Werror"]).arg(source);
    let xml = std::fs::read_to_string(descriptions.join(format!("{name}.xml"))).expect("the description");
    let is_newer = xml.contains("fmiVersion=\"3.0\"");
    if xml.contains("fmiVersion=\"2.0\"") {
        cc.arg("-I").arg(&shared).arg(shared.join("refusals.c"));
    }
    cc.arg("-o").arg(&library).arg("-lm");
    let output = cc.output();
    Ended::of(output.expect("a C compiler")).expect(0);
    let library = std::fs::read(library).expect("the library");
    let path = format!("binaries/{}/{name}.{extension}", folders[usize::from(is_newer)]);
    archive(&[("modelDescription.xml", xml.as_bytes()), (&path, &library)])
}

/// An archive with these entries.
pub fn archive(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        zip.start_file(*name, SimpleFileOptions::default()).expect("an entry");
        zip.write_all(bytes).expect("an entry");
    }
    zip.finish().expect("an archive").into_inner()
}

/// The archive with its entries changed; an entry of which nothing is left is left out.
pub fn changed(fmu: &Path, change: impl Fn(&str, Vec<u8>) -> Option<(String, Vec<u8>)>) -> Vec<u8> {
    let entries: Vec<_> = entries(fmu).into_iter().filter_map(|(name, bytes)| change(&name, bytes)).collect();
    archived(&entries)
}

/// The archive with a text file that is new or takes the place of its own.
pub fn with(fmu: &Path, file: &str, text: &str) -> Vec<u8> {
    let mut entries = entries(fmu);
    entries.retain(|(name, _)| name != file);
    entries.push((file.to_owned(), text.as_bytes().to_vec()));
    archived(&entries)
}

/// The files of an archive, by their paths.
pub fn entries(fmu: &Path) -> Vec<(String, Vec<u8>)> {
    let mut zip = ZipArchive::new(File::open(fmu).expect("an FMU")).expect("an archive");
    let places = 0..zip.len();
    let entry = |index| {
        let mut entry = zip.by_index(index).expect("an entry");
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).expect("an entry");
        (entry.name().expect("a readable name").into_owned(), bytes)
    };
    places.map(entry).collect()
}

fn archived(entries: &[(String, Vec<u8>)]) -> Vec<u8> {
    let entries: Vec<_> = entries.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice())).collect();
    archive(&entries)
}
