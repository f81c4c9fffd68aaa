//! Which files are compiled, and how.

use std::collections::BTreeSet;

use super::*;
use crate::fmi3::StructuralSizes;
use crate::parse_description;

fn description(version: &str, list: &str) -> (FmuDescription, String) {
    let xml = format!(
        "<fmiModelDescription fmiVersion=\"{version}\" modelName=\"m\" guid=\"g\" instantiationToken=\"g\">\
         <ModelExchange modelIdentifier=\"m\"/><CoSimulation modelIdentifier=\"m\">{list}</CoSimulation>\
         <ModelVariables/><ModelStructure/></fmiModelDescription>"
    );
    (parse_description(&xml, &StructuralSizes::new(), None).expect("a description"), xml)
}

/// An archive with these files below `sources`, which are empty.
fn folder(files: &[&str]) -> tempfile::TempDir {
    let root = tempfile::tempdir().expect("a folder");
    for file in files {
        let path = root.path().join(SOURCES).join(file);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, "").expect("a file");
    }
    root
}

fn choose(
    version: &str,
    list: &str,
    build: Option<&str>,
    files: &[&str],
) -> Result<BuildConfiguration, String> {
    let (about, xml) = description(version, list);
    let root = folder(files);
    BuildConfiguration::choose(&about, "x86_64-linux", &xml, build, &SourceFolder::read(root.path()))
}

#[test]
fn the_list_counts_or_else_all_in_one_or_else_all() {
    let files = ["all.c", "m.c", "m.h", "more/n.cpp"];
    let list = "<SourceFiles><File name=\"more\\n.cpp\"/><File name=\"m.h\"/></SourceFiles>";
    let chosen =
        |list, files: &[&str]| choose("2.0", list, None, files).expect("sources").sets[0].files.clone();
    assert_eq!(chosen(list, &files), ["more/n.cpp"]);
    assert_eq!(chosen("", &files), ["all.c"]);
    assert_eq!(chosen("", &files[1..]), ["m.c", "more/n.cpp"]);
    let absent = choose("2.0", list, None, &files[..3]).expect_err("a file is missing");
    assert_eq!(absent, "modelDescription.xml lists sources/more/n.cpp, which the archive does not have");
    let outside = "<SourceFiles><File name=\"../m.c\"/></SourceFiles>";
    assert!(choose("2.0", outside, None, &files).is_err_and(|what| what.contains("below sources")));
}

#[test]
fn a_build_description_gives_sets_definitions_folders_and_libraries() {
    let of = |more: &str, set: &str| {
        format!(
            "<fmiBuildDescription fmiVersion=\"3.0\"><BuildConfiguration modelIdentifier=\"m\" {more}>\
             <SourceFileSet language=\"C99\" {set}><SourceFile name=\"m.c\"/>\
             <PreprocessorDefinition name=\"A\" value=\"3\"/><PreprocessorDefinition name=\"B\"/>\
             <PreprocessorDefinition name=\"C\" optional=\"true\"/>\
             <PreprocessorDefinition name=\"D\"><Option value=\"x\"/><Option value=\"y\"/></PreprocessorDefinition>\
             <IncludeDirectory name=\"more\"/></SourceFileSet><Library name=\"blas\" external=\"true\"/>\
             </BuildConfiguration></fmiBuildDescription>"
        )
    };
    let text = of("", "compilerOptions=\"-fno-math-errno -o x\"");
    let found = choose("3.0", "", Some(&text), &["m.c", "other.c"]).expect("a configuration");
    assert_eq!(found.sets[0].files, ["m.c"]);
    assert_eq!(found.sets[0].options, ["-DA=3", "-DB", "-DD=x", "-fno-math-errno"]);
    assert_eq!(found.sets[0].include_folders, ["sources/more", "sources"]);
    assert_eq!(found.libraries, ["blas"]);
    let left: BTreeSet<_> = found.notes.iter().map(String::as_str).collect();
    assert!(left.contains("its compiler option `-o` is left out"), "{left:?}");
    let other = choose("3.0", "", Some(&of("platform=\"riscv-none\"", "")), &["m.c"]);
    assert!(other.is_err_and(|what| what.ends_with("for all platforms, found riscv-none")));
    let strange = choose("3.0", "", Some(&of("", "").replace("\"m\"", "\"n\"")), &["m.c"]);
    let told = "sources/buildDescription.xml is for the modelIdentifier n: taken, the only one there";
    assert!(strange.expect("it is tried").notes.contains(&told.to_owned()));
    let windows = choose("3.0", "", Some(&of("", "compiler=\"VisualC\" compilerOptions=\"/Od\"")), &["m.c"]);
    assert_eq!(
        windows.expect("it is tried").notes,
        ["its compiler options \"/Od\" are for VisualC, and left out"]
    );
    let absent = choose("3.0", "", Some(&text), &["other.c"]).expect_err("a file is missing");
    assert_eq!(absent, "sources/buildDescription.xml: it lists m.c, and the archive has no sources/m.c");
}
