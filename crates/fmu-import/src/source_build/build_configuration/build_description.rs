//! Parses `sources/buildDescription.xml` of FMI 3.0.

use roxmltree::{Document, Node};

use super::compiler_options::{filter_options, is_known_compiler};
use super::{BUILD_DESCRIPTION, BuildConfiguration, SourceFileSet, source_path};
use crate::FmuDescription;
use crate::source_build::source_folder::{SOURCES, SourceFolder};

/// Reads the text for the interface of `about`.
///
/// # Errors
/// When it is broken, has nothing for this FMU and this machine, or names a file that is not there.
pub(super) fn parse(
    text: &str,
    about: &FmuDescription,
    platform: &str,
    folder: &SourceFolder,
) -> Result<BuildConfiguration, String> {
    if archive::find_element_over_limit(text).is_some() {
        return Err(format!("expected at most {} attributes of an element, found more", archive::ATTRIBUTES));
    }
    let document = Document::parse(text).map_err(|error| format!("line {}: {error}", error.pos().row))?;
    let mut found = BuildConfiguration::default();
    let element = choose_element(&document, about, platform, &mut found.notes)?;
    for set in children(element, "SourceFileSet") {
        let set = parse_set(set, &mut found.notes)?;
        if let Some(absent) = set.files.iter().find(|name| !folder.files.contains(*name)) {
            return Err(format!("it lists {absent}, and the archive has no {SOURCES}/{absent}"));
        }
        found.sets.push(set);
    }
    for library in children(element, "Library") {
        let name = library.attribute("name").unwrap_or_default().trim();
        let is_name = !name.is_empty() && name.chars().all(|it| it.is_alphanumeric() || "_-+.".contains(it));
        if !is_name {
            return Err(format!("expected the name of a library, found {name:?}"));
        }
        found.libraries.push(name.to_owned());
    }
    Ok(found)
}

/// The `BuildConfiguration` of this FMU: that for this machine, or else one for all machines. An only one is taken whatever its identifier, which
/// some tools copy from another FMU; that is told.
fn choose_element<'a>(
    document: &'a Document,
    about: &FmuDescription,
    platform: &str,
    notes: &mut Vec<String>,
) -> Result<Node<'a, 'a>, String> {
    let all: Vec<_> = children(document.root_element(), "BuildConfiguration").collect();
    let fits = |node: &&Node| node.attribute("modelIdentifier") == Some(&about.identifier);
    let mut own: Vec<_> = all.iter().filter(fits).copied().collect();
    if let ([], [only]) = (own.as_slice(), all.as_slice()) {
        let found = only.attribute("modelIdentifier").unwrap_or("none");
        notes.push(format!(
            "{BUILD_DESCRIPTION} is for the modelIdentifier {found}: taken, the only one there"
        ));
        own.push(*only);
    }
    let of_platform = |wanted: Option<&str>| own.iter().find(|node| node.attribute("platform") == wanted);
    of_platform(Some(platform)).or_else(|| of_platform(None)).copied().ok_or_else(|| {
        let names =
            |attribute| -> Vec<_> { all.iter().filter_map(|node| node.attribute(attribute)).collect() };
        match own.is_empty() {
            true => format!(
                "expected a BuildConfiguration with modelIdentifier=\"{}\", found {}",
                about.identifier,
                found_words(&names("modelIdentifier"))
            ),
            false => format!(
                "expected a BuildConfiguration for {platform} or for all platforms, found {}",
                found_words(&names("platform"))
            ),
        }
    })
}

fn found_words(names: &[&str]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn parse_set(element: Node, notes: &mut Vec<String>) -> Result<SourceFileSet, String> {
    let name = |node: Node| node.attribute("name").map(str::trim).unwrap_or_default().to_owned();
    let files = children(element, "SourceFile").map(|file| source_path(&name(file)));
    let mut include_folders = Vec::new();
    for folder in children(element, "IncludeDirectory").map(name) {
        let inside = if folder == "." { String::new() } else { format!("/{}", source_path(&folder)?) };
        include_folders.push(format!("{SOURCES}{inside}"));
    }
    include_folders.push(SOURCES.to_owned());
    let definitions = children(element, "PreprocessorDefinition").map(definition_option);
    let mut options: Vec<_> = definitions.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
    let compiler = element.attribute("compiler").unwrap_or_default();
    let asked = element.attribute("compilerOptions").unwrap_or_default();
    if is_known_compiler(compiler) {
        options.extend(filter_options(asked, notes));
    } else if !asked.trim().is_empty() {
        notes.push(format!("its compiler options {asked:?} are for {compiler}, and left out"));
    }
    Ok(SourceFileSet {
        files: files.collect::<Result<_, _>>()?,
        language: element.attribute("language").map(|it| it.trim().to_owned()),
        options,
        include_folders,
    })
}

/// The option for a definition; none for an optional one without a value.
fn definition_option(element: Node) -> Result<Option<String>, String> {
    let name = element.attribute("name").map(str::trim).unwrap_or_default();
    if name.is_empty() || !name.chars().all(|it| it.is_alphanumeric() || it == '_') {
        return Err(format!("expected the name of a definition, found {name:?}"));
    }
    let first_choice = || children(element, "Option").next().and_then(|it| it.attribute("value"));
    let is_optional = matches!(element.attribute("optional"), Some("true" | "1"));
    let value = element.attribute("value");
    Ok(match (value, is_optional) {
        (Some(value), _) => Some(format!("-D{name}={value}")),
        (None, true) => None,
        (None, false) => {
            Some(first_choice().map_or(format!("-D{name}"), |value| format!("-D{name}={value}")))
        }
    })
}

fn children<'a, 'b>(element: Node<'a, 'b>, name: &'static str) -> impl Iterator<Item = Node<'a, 'b>> {
    element.children().filter(move |node| node.has_tag_name(name))
}
