//! Reads files of parameters, which several FMUs and analyses share.

use std::collections::HashSet;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cosim::system::NodeBody;
use diagnostics::{Error, ErrorCollector, SourceFiles, TextFile, suggest};
use fmu_import::description::Variable;
use serde::Deserialize as _;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use super::ResolveDiagnostics;
use super::node_draft::NodeDraft;
use crate::document::{self, Scenario, UnusedParameters};
use crate::text_of::{self, TextCache};

/// The largest file of parameters [B].
const LARGEST: u64 = 64 << 20;

/// So many values that no FMU has are told by name.
const MOST_NAMES: usize = 12;

/// A value of a file.
pub(super) struct FileParameter {
    /// The keys that lead to it, with dots in between.
    pub name: String,
    /// The span of its last key.
    pub key: Range<usize>,
    pub value: toml::Value,
    /// The span of the value.
    pub span: Range<usize>,
}

/// A file.
pub(super) struct ParameterFile {
    path: PathBuf,
    pub source: Arc<SourceFiles>,
    pub values: Vec<FileParameter>,
}

/// The files that a scenario names, and the texts of those that values name.
#[derive(Default)]
pub(super) struct ParameterFiles {
    files: Vec<ParameterFile>,
    pub texts: TextCache,
}

impl ParameterFiles {
    /// Reads all files that FMUs and analyses of a scenario name, each once.
    pub fn read(scenario: &Scenario, mistakes: &mut ErrorCollector) -> Self {
        let mut read = Self::default();
        let mut known = HashSet::new();
        for word in scenario.parameter_files() {
            let path = scenario.source.resolve_path(word);
            if !known.insert(path.clone()) {
                continue;
            }
            let text = diagnostics::read_text_bounded(&path, LARGEST).map_err(|error| {
                let path = path.display();
                scenario.error_at(word, format!("the parameters {path} cannot be read: {error}"))
            });
            let Some(text) = mistakes.ok_or_record(text) else { continue };
            let file = parse_file(path, text, &read.texts, mistakes);
            read.files.extend(mistakes.ok_or_record(file));
        }
        read
    }

    /// The files that these words name, as far as they could be read.
    pub fn files_named_by<'a>(
        &'a self,
        scenario: &'a Scenario,
        words: &'a [diagnostics::Spanned<String>],
    ) -> impl DoubleEndedIterator<Item = &'a ParameterFile> {
        words.iter().filter_map(|word| {
            let path = scenario.source.resolve_path(word);
            self.files.iter().find(|file| file.path == path)
        })
    }

    /// Tells values that no FMU with their file has. Of an FMU that cannot be used nobody knows what it has.
    pub fn report_unused(
        &self,
        scenario: &Scenario,
        nodes: &[NodeDraft],
        ResolveDiagnostics { mistakes, warnings }: &mut ResolveDiagnostics,
    ) {
        for file in &self.files {
            let names = |fmu: &&document::Fmu| {
                fmu.parameters.iter().any(|word| scenario.source.resolve_path(word) == file.path)
            };
            let fmus: Vec<_> = scenario.document.fmu.iter().filter(names).collect();
            let variables: Vec<_> = fmus.iter().map_while(|fmu| fmu_variables(fmu, nodes)).collect();
            if fmus.is_empty() || variables.len() < fmus.len() {
                continue;
            }
            let variables = || variables.iter().copied().flatten();
            let known: HashSet<&str> =
                variables().flat_map(|it| [it.name.as_str(), it.array_name()]).collect();
            let unused = file.values.iter().filter(|it| !known.contains(it.name.as_str()));
            if fmus.iter().any(|fmu| fmu.unused == Some(UnusedParameters::Tell)) {
                warnings.extend(unused_note(file, &unused.collect::<Vec<_>>()));
                continue;
            }
            for parameter in unused {
                mistakes.push(unused_error(file, parameter, &fmus, variables().map(Variable::array_name)));
            }
        }
    }
}

/// The variables of an FMU among the nodes.
fn fmu_variables<'n>(fmu: &document::Fmu, nodes: &'n [NodeDraft]) -> Option<&'n [Variable]> {
    let node = nodes.iter().find(|node| node.name == *fmu.name.get_ref())?;
    match &node.body {
        NodeBody::Fmu { fmu, .. } => Some(&fmu.description.variables),
        _ => None,
    }
}

/// The error of a value that no FMU has.
fn unused_error<'v>(
    file: &ParameterFile,
    FileParameter { name, key, .. }: &FileParameter,
    fmus: &[&document::Fmu],
    known: impl Iterator<Item = &'v str>,
) -> Error {
    let nodes: Vec<_> = fmus.iter().map(|fmu| format!("`{}`", fmu.name.get_ref())).collect();
    let have = if nodes.len() == 1 { "has" } else { "have" };
    let message = format!("{} {have} no variable `{name}`", nodes.join(" and "));
    let close = suggest::closest_name(name, known).map(|close| format!("did you mean `{close}`?"));
    let error = file.source.error_at(key.clone(), message, "");
    error.with_help(close.unwrap_or_else(|| {
        "remove it, or say unused = \"tell\" in the [[fmu]] when the file is for other FMUs, too".to_owned()
    }))
}

/// The note about values that are left out.
fn unused_note(file: &ParameterFile, unused: &[&FileParameter]) -> Option<String> {
    let names: Vec<_> = unused.iter().map(|it| it.name.as_str()).take(MOST_NAMES).collect();
    let more = match unused.len() - names.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let path = file.path.display();
    (!names.is_empty())
        .then(|| format!("{path}: no FMU with this file takes {}{more}: left out", names.join(", ")))
}

/// The values of a text, each with the places of its key and of itself.
fn parse_file(
    path: PathBuf,
    text: String,
    texts: &TextCache,
    mistakes: &mut ErrorCollector,
) -> Result<ParameterFile, Error> {
    // A byte order mark is as long as three blanks.
    let text = text.replacen('\u{feff}', "   ", 1);
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let source = SourceFiles::from_generated(TextFile::new(path.clone(), text.clone()));
    let (table, errors) = DeTable::parse_recoverable(&text);
    let end = text.len();
    if let Some(error) = errors.first() {
        return Err(source.error_at(error.span().unwrap_or(end..end), error.message(), "here"));
    }
    let mut values = Vec::new();
    visit_dotted_entries(table.get_ref(), "", &mut |name, key, value| {
        let span = value.span();
        let read = toml::Value::deserialize(ValueDeserializer::from(value.clone()));
        let read = read.map_err(|error| error.message().to_owned()).and_then(|value| {
            text_of::text_file_path(&value).map_or(Ok(value.clone()), |file| {
                texts.read_text(&folder.join(file)).map(toml::Value::String)
            })
        });
        let read = read.map_err(|message| source.error_at(span.clone(), message, ""));
        let value = mistakes.ok_or_record(read);
        values.extend(value.map(|value| FileParameter { name, key, value, span }));
    });
    Ok(ParameterFile { path, source: Arc::new(source), values })
}

/// Takes the name of a value, the span of its key, and the value.
type ParameterVisitor<'v, 'a> = &'v mut dyn FnMut(String, Range<usize>, &toml::Spanned<DeValue<'a>>);

/// Calls `take` for each value with its name and the span of its key.
fn visit_dotted_entries<'a>(table: &DeTable<'a>, prefix: &str, take: ParameterVisitor<'_, 'a>) {
    for (key, value) in table {
        let name = format!("{prefix}{}", key.get_ref());
        match value.get_ref() {
            DeValue::Table(inner) if !text_of::is_text_file_reference(inner) => {
                visit_dotted_entries(inner, &format!("{name}."), take);
            }
            _ => take(name, key.span(), value),
        }
    }
}
