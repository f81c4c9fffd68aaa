//! Compiles the FMU of `probe.c`. Also included by the example on the first page of the documentation.

/// A folder with `probe.fmu`, which does what `behaviour` says.
pub fn pack(behaviour: &str) -> tempfile::TempDir {
    pack_with(&[&format!("-DBEHAVIOUR=\"{behaviour}\"")])
}

/// The same with these arguments for the C compiler.
pub fn pack_with(arguments: &[&str]) -> tempfile::TempDir {
    use std::io::Write as _;
    let folder = tempfile::tempdir().expect("a folder");
    let library = compile("probe", arguments, &folder);
    let xml = std::fs::read(SOURCES.to_owned() + "/probe.xml").expect("the description");
    let library = std::fs::read(library).expect("the library");
    let file = std::fs::File::create(folder.path().join("probe.fmu")).expect("a file");
    let mut archive = zip::ZipWriter::new(file);
    for (name, bytes) in [("modelDescription.xml", xml), ("binaries/linux64/probe.so", library)] {
        archive.start_file(name, zip::write::SimpleFileOptions::default()).expect("an entry");
        archive.write_all(&bytes).expect("an entry");
    }
    archive.finish().expect("an archive");
    folder
}

const SOURCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/support");

/// The library of one of the C files here.
pub fn compile(name: &str, arguments: &[&str], into: &tempfile::TempDir) -> std::path::PathBuf {
    let library = into.path().join(format!("{name}.so"));
    let mut cc = std::process::Command::new("cc");
    cc.args(["-shared", "-fPIC", "-g", "-Wall", "-Werror"]).args(arguments);
    cc.arg(format!("{SOURCES}/{name}.c")).arg("-lm").arg("-lpthread").arg("-o").arg(&library);
    let output = cc.output().expect("a C compiler");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    library
}
