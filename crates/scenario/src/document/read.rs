//! Reads a scenario from its files: those that it extends, the systems of SSP in it, and the scenarios that it is validated by.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use diagnostics::{Error, ErrorCollector, SourceFiles, TextFile, utf8_path};
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::extend::MergeError;
use super::quantities::ConvertedNumbers;
use super::{
    Document, Scenario, SystemImport, Validation, extend, magnitudes, standalone, subsystem_import,
    syntax_errors, system,
};
use crate::schema::{self, SchemaViolation};

/// Keys and values of earlier versions, with their names of today.
const RENAMED: [(&str, &str); 2] = [("sequential", "gauss_seidel"), ("plane", "xy_plot")];

/// So many mistakes in the form of a file are told at once: a broken one may have tens of thousands.
const MOST_ERRORS: usize = 100;

/// A longer chain of files, each of which extends the next, is a mistake.
const MOST_FILES: usize = 100;

impl Scenario {
    /// Reads the file at `path`, a scenario, a system of SSP or an FMU that runs by itself, those that it extends, and the scenarios that it is validated by.
    ///
    /// # Errors
    /// When one of them cannot be read or does not have the form of a scenario.
    pub fn read(path: &Path) -> Result<Self, Error> {
        Self::read_variant(path, None)
    }

    /// The same; of a system of SSP with several descriptions, `variant` chooses one by its file or its name.
    ///
    /// # Errors
    /// As for [`Scenario::read`], and when there is no such variant.
    pub fn read_variant(path: &Path, variant: Option<&str>) -> Result<Self, Error> {
        utf8_path(path)?;
        if system::is_system(path) {
            let (file, import) = system::import_system(path, variant)?;
            return read_from_source(SourceFiles::from_generated(file), &[], vec![Arc::new(import)]);
        }
        if let Some(variant) = variant {
            let message = format!(
                "expected a system of SSP for the variant `{variant}`, found {}, which has none",
                path.display()
            );
            return Err(Error::invalid_input(message)
                .with_help("a scenario chooses one with `variant` beside `extends`"));
        }
        if standalone::is_fmu(path) {
            let (file, import) = standalone::import_fmu(path)?;
            return read_from_source(SourceFiles::from_generated(file), &[], vec![Arc::new(import)]);
        }
        read_from_source(SourceFiles::read_main_file(path).map_err(Error::invalid_input)?, &[], Vec::new())
    }

    /// The scenario whose text was gathered, with its files in `folder`. Messages name `path`, and its stem names the run.
    ///
    /// # Errors
    /// As for a file.
    pub fn from_bundle(path: &Path, text: String, folder: &Path) -> Result<Self, Error> {
        let file = TextFile { folder: Some(folder.to_owned()), ..TextFile::new(path, text) };
        read_from_source(SourceFiles::from_generated(file), &[], Vec::new())
    }

    /// The scenario that was kept with a recording, without those that it is validated by.
    ///
    /// # Errors
    /// When it does not have the form of a scenario, such as one of another version.
    pub fn from_recording(name: &str, source: SourceFiles) -> Result<Self, Error> {
        let document = read_document(&source)?;
        let (validations, systems) = (Vec::new(), Vec::new());
        Ok(Scenario { name: name.to_owned(), source, document, validations, systems })
    }

    /// The merged values of its files as they are written, by their keys with dots in between. Entries of lists go by
    /// their names.
    ///
    /// # Errors
    /// As when it was read.
    pub fn flattened_values(&self) -> Result<BTreeMap<String, String>, Error> {
        let texts = self.source.padded_texts();
        let mut values = BTreeMap::new();
        collect_values(&self.source, &DeValue::Table(merge_files(&self.source, &texts)?), "", &mut values);
        Ok(values)
    }
}

fn collect_values(source: &SourceFiles, value: &DeValue, name: &str, values: &mut BTreeMap<String, String>) {
    let under = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
    let mut add = |key: &str, value: &Spanned<DeValue>| match value.get_ref() {
        DeValue::Table(_) | DeValue::Array(_) => {
            collect_values(source, value.get_ref(), &under(key), values);
        }
        _ => {
            values.insert(under(key), source.text_at(value.span()).to_owned());
        }
    };
    match value {
        DeValue::Table(table) => table.iter().for_each(|(key, value)| add(key.get_ref(), value)),
        DeValue::Array(list) => list.iter().enumerate().for_each(|(index, value)| {
            let key = extend::entry_name(value).map(|(name, _)| name.to_owned());
            add(&key.unwrap_or_else(|| index.to_string()), value);
        }),
        _ => {}
    }
}

/// The scenario whose file is the source; `above` are those that it validates.
fn read_from_source(
    mut source: SourceFiles,
    above: &[PathBuf],
    mut systems: Vec<Arc<SystemImport>>,
) -> Result<Scenario, Error> {
    let path = source.main_path().to_owned();
    read_extended_files(&mut source, &mut systems)?;
    add_subsystems(&mut source, &mut systems)?;
    let document = read_document(&source)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let above = [above, &[path]].concat();
    let validations = document.validation.iter().map(|it| read_validation(&source, it, &above));
    let validations = ErrorCollector::collect_all(validations)?;
    Ok(Scenario { name, source, document, validations, systems })
}

/// The scenario of a validation; `above` are those that it validates.
fn read_validation(
    source: &SourceFiles,
    Validation { scenario: word, .. }: &Validation,
    above: &[PathBuf],
) -> Result<Scenario, Error> {
    let path = source.resolve_path(word);
    if let Some(cycle) = describe_path_cycle(above, &path) {
        let message = format!("the scenario is validated by itself: {cycle}");
        return Err(source.error_at(word.span(), message, ""));
    }
    let other = SourceFiles::read_main_file(&path).map_err(|what| source.error_at(word.span(), what, ""))?;
    read_from_source(other, above, Vec::new())
}

/// Adds the file that the source extends, the one that this extends, and so on.
fn read_extended_files(source: &mut SourceFiles, systems: &mut Vec<Arc<SystemImport>>) -> Result<(), Error> {
    let mut paths = vec![source.main_path().to_owned()];
    loop {
        let text = source.padded_texts().pop().unwrap_or_default();
        let table = parse_file_table(source, &text)?;
        let variant = table.get_ref().get("variant");
        let Some(extends) = table.get_ref().get("extends") else {
            let message = "there is no system to choose a variant of: the scenario extends none";
            return match variant {
                Some(variant) => Err(source.error_at(variant.span(), message, "here")),
                None => Ok(()),
            };
        };
        let span = extends.span();
        let Some(name) = extends.get_ref().as_str() else {
            // What the other file would have brought is not missing.
            let message = format!("expected a text, found {}", schema::toml_type_label(extends.get_ref()));
            return Err(source.error_at(span, message, "here"));
        };
        if paths.len() == MOST_FILES {
            let message =
                format!("expected a chain of at most {MOST_FILES} scenarios, each of which extends the next");
            return Err(source.error_at(span, message, "one more"));
        }
        let path = source.base_folder(span.clone()).join(name);
        if let Some(cycle) = describe_path_cycle(&paths, &path) {
            let message = format!("the scenario extends itself: {cycle}");
            return Err(source.error_at(span, message, ""));
        }
        if system::is_system(&path) {
            let (file, import) = extended_system(source, &path, span, variant)?;
            source.add_generated(file);
            systems.push(Arc::new(import));
        } else {
            if let Some(variant) = variant {
                let message = "a variant is one of a system of SSP, and the extended file is a scenario";
                return Err(source.error_at(variant.span(), message, "here"));
            }
            source.add_file(&path, span)?;
        }
        paths.push(path);
    }
}

/// The system that a scenario extends, as a text.
fn extended_system(
    source: &SourceFiles,
    path: &Path,
    span: Range<usize>,
    variant: Option<&Spanned<DeValue>>,
) -> Result<(TextFile, SystemImport), Error> {
    let name = variant.and_then(|variant| variant.get_ref().as_str());
    system::import_system(path, name).map_err(|found| {
        let word = variant.filter(|_| found.variant);
        let message = format!("the system cannot be used: {}", found.error);
        source.error_at(word.map_or(span, Spanned::span), message, "").with_optional_help(found.hint)
    })
}

/// Adds the systems of `[[system]]` behind the files.
fn add_subsystems(source: &mut SourceFiles, systems: &mut Vec<Arc<SystemImport>>) -> Result<(), Error> {
    let texts = source.padded_texts();
    // What names a part of a system fits nothing yet; what is wrong in the end is told when the document is read.
    let table = merge_valid_files(source, &texts, &mut ErrorCollector::default())?;
    // The first system is the deepest one, so that its nodes come first.
    for (file, import) in subsystem_import::import_subsystems(source, &table)?.into_iter().rev() {
        source.add_generated(file);
        systems.push(Arc::new(import));
    }
    Ok(())
}

/// The circle from one of `paths` to `path`, if there is one.
fn describe_path_cycle(paths: &[PathBuf], path: &Path) -> Option<String> {
    let real = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let begin = paths.iter().position(|other| real(other) == real(path))?;
    let way = paths[begin..].iter().map(|path| path.display().to_string());
    Some(way.chain([path.display().to_string()]).collect::<Vec<_>>().join(" -> "))
}

/// The tables of all files, merged; `texts` are the shifted ones.
pub(crate) fn merge_files<'t>(source: &SourceFiles, texts: &'t [String]) -> Result<DeTable<'t>, Error> {
    let mut mistakes = ErrorCollector::default();
    let merged = merge_valid_files(source, texts, &mut mistakes)?;
    mistakes.into_result().map(|()| merged)
}

/// The same with all that could be merged; the errors are those of the syntax.
fn merge_valid_files<'t>(
    source: &SourceFiles,
    texts: &'t [String],
    mistakes: &mut ErrorCollector,
) -> Result<DeTable<'t>, Error> {
    let parsed = texts.iter().map(|text| parse_file_table(source, text));
    let files = ErrorCollector::collect_all(parsed)?.into_iter().rev();
    let mut misfits = Vec::new();
    let merged = files.reduce(|base, changes| extend::merge_into_base(base, changes, &mut misfits));
    for MergeError { span, message, help } in misfits {
        mistakes.push(source.error_at(span, message, "").with_optional_help(help));
    }
    Ok(merged.map(Spanned::into_inner).unwrap_or_default())
}

/// The table of a file.
fn parse_file_table<'t>(source: &SourceFiles, text: &'t str) -> Result<Spanned<DeTable<'t>>, Error> {
    let (table, errors) = DeTable::parse_recoverable(text);
    let errors = &errors[..errors.len().min(MOST_ERRORS)];
    syntax_errors::syntax_errors(source, text, errors).into_result().map(|()| table)
}

/// The merged document of all files.
fn read_document(source: &SourceFiles) -> Result<Document, Error> {
    let (texts, mut mistakes) = (source.padded_texts(), ErrorCollector::default());
    let merged = merge_valid_files(source, &texts, &mut mistakes)?;
    let converted = ConvertedNumbers::of_table(super::scenario_schema_value(), &merged);
    for violation in converted.violations.iter().take(MOST_ERRORS) {
        mistakes.push(schema_error(source, violation.clone()));
    }
    let mut numbers = merged;
    converted.replace_texts(&mut numbers);
    for (span, message) in magnitudes::out_of_range(&numbers).into_iter().take(MOST_ERRORS) {
        mistakes.push(source.error_at(span, message, "here"));
    }
    let document = Document::deserialize(Deserializer::from(Spanned::new(0..0, numbers.clone())));
    let document = document.map_err(|error| schema_errors(source, &numbers, &error));
    let document = document.and_then(|document| without_base(source, &document).map(|()| document));
    let document = mistakes.ok_or_record(document);
    mistakes.into_result()?;
    document.ok_or_else(Error::already_reported)
}

/// Refuses to leave out entries where none are inherited.
fn without_base(source: &SourceFiles, document: &Document) -> Result<(), Error> {
    let message = "there is nothing to leave out: the scenario extends no other";
    let is_base = document.extends.is_some() || !document.system.is_empty();
    let names = document.without.values().flatten().filter(|_| !is_base);
    let errors = names.map(|name| source.error_at(name.span(), message, ""));
    errors.collect::<ErrorCollector>().into_result()
}

/// The error of a parser, at its place.
fn parse_error(source: &SourceFiles, error: &toml::de::Error) -> Error {
    let end = source.files().next().map_or(0, |file| file.text.len());
    source.error_at(error.span().unwrap_or(end..end), error.message(), "here")
}

/// The errors of a document that has not the form of a scenario. The schema knows the names that are expected at each place.
fn schema_errors(source: &SourceFiles, merged: &DeTable, error: &toml::de::Error) -> Error {
    let found = schema::validate_table(super::scenario_schema_value(), 0..0, merged);
    let found = found.into_iter().take(MOST_ERRORS);
    let found: ErrorCollector = found.map(|finding| schema_error(source, finding)).collect();
    // Of what the schema does not tell, the parser tells the first.
    found.into_result().err().unwrap_or_else(|| parse_error(source, error))
}

/// A word that breaks the schema, with its cure.
fn schema_error(
    source: &SourceFiles,
    SchemaViolation { span, unknown, message, help }: SchemaViolation,
) -> Error {
    let renamed = unknown.and_then(|(name, known)| {
        let (old, new) =
            RENAMED.iter().find(|(old, new)| name == *old && known.iter().any(|it| it == new))?;
        Some(format!("`{old}` is called `{new}` now"))
    });
    source.error_at(span, message, "here").with_optional_help(renamed.or(help))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_found_by_the_keys_that_lead_to_it() {
        let text = "title = 't'\n[[analysis]]\nname = 'a'\n[analysis.config]\nsmooth.rate = 1\n";
        let file = TextFile::new("case.toml", text);
        let source = SourceFiles::from_recording(file, Vec::new(), Vec::new());
        let scenario = Scenario::from_recording("case", source).expect("a scenario");
        for (path, word) in [
            (&["analysis", "0", "config", "smooth", "rate"][..], "rate"),
            (&["analysis", "0", "name"], "name"),
            (&["analysis", "0", "config", "smooth", "unknown"], "smooth"),
        ] {
            assert_eq!(scenario.deepest_key_span(path).map(|(_, span)| &text[span]), Some(word), "{path:?}");
        }
        assert_eq!(scenario.deepest_key_span(&["unknown"]), None);
        let schema = serde_json::json!({"type": "object", "additionalProperties": false,
            "properties": {"smoothing": {"type": "object"}}});
        let found = scenario.schema_violations(&["analysis", "0", "config"], &schema);
        assert_eq!(found.first().map(|it| &text[it.span.clone()]), Some("smooth"));
    }
}
