//! Reads files of parameters, which several FMUs and analyses share.

use std::collections::HashSet;

use cosim::system::NodeBody;
use diagnostics::{Error, ErrorCollector, suggest};
use fmu_import::description::Variable;

use super::ResolveDiagnostics;
use super::node_draft::NodeDraft;
use crate::document::{self, Scenario, UnusedParameters};
use crate::parameter_file::{FileParameter, ParameterFile, read_parameter_text};
use crate::text_of::TextCache;

/// So many values that no FMU has are told by name.
const MOST_NAMES: usize = 12;

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
            let text = read_parameter_text(&path).map_err(|message| scenario.error_at(word, message));
            let Some(text) = mistakes.ok_or_record(text) else { continue };
            let file = ParameterFile::parse(path, text, &read.texts, mistakes);
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
