//! Reads a scenario with its base files and its validation scenarios.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use diagnostics::{Error, Mistakes, Source, TextFile};
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::extend::Wrong;
use super::{
    Document, Imported, Scenario, Validation, extend, sizes, standalone, subsystems, system,
};
use crate::schema::{self, Finding};

/// Keys and values of earlier versions, with their names of today.
const RENAMED: [(&str, &str); 2] = [("sequential", "gauss_seidel"), ("plane", "xy_plot")];

/// So many mistakes in the form of a file are told at once: a broken one may have tens of thousands.
const TOLD: usize = 100;

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
        if system::is_system(path) {
            let (file, imported) = system::imported(path, variant)?;
            return read(Source::generated(file), &[], vec![Arc::new(imported)]);
        }
        if let Some(variant) = variant {
            let message = format!(
                "expected a system of SSP for the variant `{variant}`, found {}, which has none",
                path.display()
            );
            return Err(Error::input(message)
                .help("a scenario chooses one with `variant` beside `extends`"));
        }
        if standalone::is_fmu(path) {
            let (file, imported) = standalone::imported(path)?;
            return read(Source::generated(file), &[], vec![Arc::new(imported)]);
        }
        read(Source::read(path).map_err(Error::input)?, &[], Vec::new())
    }

    /// The scenario whose text was gathered, with its files in `folder`. Messages name `path`, and its stem names the run.
    ///
    /// # Errors
    /// As for a file.
    pub fn bundled(path: &Path, text: String, folder: &Path) -> Result<Self, Error> {
        let file = TextFile { folder: Some(folder.to_owned()), ..TextFile::new(path, text) };
        read(Source::generated(file), &[], Vec::new())
    }

    /// The scenario that was kept with a recording, without those that it is validated by.
    ///
    /// # Errors
    /// When it does not have the form of a scenario, such as one of another version.
    pub fn recorded(name: &str, source: Source) -> Result<Self, Error> {
        let document = document(&source)?;
        let (validations, systems) = (Vec::new(), Vec::new());
        Ok(Scenario { name: name.to_owned(), source, document, validations, systems })
    }

    /// The merged values of its files as they are written, by their keys with dots in between. Entries of lists go by
    /// their names.
    ///
    /// # Errors
    /// As when it was read.
    pub fn values(&self) -> Result<BTreeMap<String, String>, Error> {
        let texts = self.source.padded_texts();
        let mut values = BTreeMap::new();
        collect_values(
            &self.source,
            &DeValue::Table(merged(&self.source, &texts)?),
            "",
            &mut values,
        );
        Ok(values)
    }
}

fn collect_values(
    source: &Source,
    value: &DeValue,
    name: &str,
    values: &mut BTreeMap<String, String>,
) {
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
        DeValue::Array(list) => list.iter().enumerate().for_each(|(place, value)| {
            let key = extend::name_of(value).map(|(name, _)| name.to_owned());
            add(&key.unwrap_or_else(|| place.to_string()), value);
        }),
        _ => {}
    }
}

/// The scenario whose file is the source; `above` are those that it validates.
fn read(
    mut source: Source,
    above: &[PathBuf],
    mut systems: Vec<Arc<Imported>>,
) -> Result<Scenario, Error> {
    let path = source.path().to_owned();
    follow(&mut source, &mut systems)?;
    add_parts(&mut source, &mut systems)?;
    let document = document(&source)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let above = [above, &[path]].concat();
    let validations = document.validation.iter().map(|it| validating(&source, it, &above));
    let validations = Mistakes::all(validations)?;
    Ok(Scenario { name, source, document, validations, systems })
}

/// The scenario of a validation; `above` are those that it validates.
fn validating(
    source: &Source,
    Validation { scenario: word, .. }: &Validation,
    above: &[PathBuf],
) -> Result<Scenario, Error> {
    let path = source.resolve(word);
    if let Some(trail) = trail(above, &path) {
        let message = format!("the scenario is validated by itself: {trail}");
        return Err(source.error(word.span(), message, ""));
    }
    let other = Source::read(&path).map_err(|what| source.error(word.span(), what, ""))?;
    read(other, above, Vec::new())
}

/// Adds the file that the source extends, the one that this extends, and so on.
fn follow(source: &mut Source, systems: &mut Vec<Arc<Imported>>) -> Result<(), Error> {
    let mut paths = vec![source.path().to_owned()];
    loop {
        let text = source.padded_texts().pop().unwrap_or_default();
        let table = parsed(source, &text)?;
        let variant = table.get_ref().get("variant");
        let Some(extends) = table.get_ref().get("extends") else {
            let message = "there is no system to choose a variant of: the scenario extends none";
            return match variant {
                Some(variant) => Err(source.error(variant.span(), message, "here")),
                None => Ok(()),
            };
        };
        let place = extends.span();
        let Some(name) = extends.get_ref().as_str() else {
            // What the other file would have brought is not missing.
            let message =
                format!("expected a text, found {}", schema::found_name(extends.get_ref()));
            return Err(source.error(place, message, "here"));
        };
        let path = source.folder(place.clone()).join(name);
        if let Some(trail) = trail(&paths, &path) {
            let message = format!("the scenario extends itself: {trail}");
            return Err(source.error(place, message, ""));
        }
        if system::is_system(&path) {
            let (file, imported) = extended_system(source, &path, place, variant)?;
            source.add_generated(file);
            systems.push(Arc::new(imported));
        } else {
            if let Some(variant) = variant {
                let message =
                    "a variant is one of a system of SSP, and the extended file is a scenario";
                return Err(source.error(variant.span(), message, "here"));
            }
            source.add(&path, place)?;
        }
        paths.push(path);
    }
}

/// The system that a scenario extends, as a text.
fn extended_system(
    source: &Source,
    path: &Path,
    place: Range<usize>,
    variant: Option<&Spanned<DeValue>>,
) -> Result<(TextFile, Imported), Error> {
    let name = variant.and_then(|variant| variant.get_ref().as_str());
    system::imported(path, name).map_err(|found| {
        let word = variant.filter(|_| found.variant);
        let message = format!("the system cannot be used: {}", found.error);
        source.error(word.map_or(place, Spanned::span), message, "").hint(found.hint)
    })
}

/// Adds the systems of `[[system]]` behind the files.
fn add_parts(source: &mut Source, systems: &mut Vec<Arc<Imported>>) -> Result<(), Error> {
    let texts = source.padded_texts();
    // What names a part of a system fits nothing yet; what is wrong in the end is told when the document is read.
    let table = merge(source, &texts, &mut Mistakes::default())?;
    // The first system is the deepest one, so that its nodes come first.
    for (file, imported) in subsystems::texts(source, &table)?.into_iter().rev() {
        source.add_generated(file);
        systems.push(Arc::new(imported));
    }
    Ok(())
}

/// The circle from one of `paths` to `path`, if there is one.
fn trail(paths: &[PathBuf], path: &Path) -> Option<String> {
    let real = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let begin = paths.iter().position(|other| real(other) == real(path))?;
    let way = paths[begin..].iter().map(|path| path.display().to_string());
    Some(way.chain([path.display().to_string()]).collect::<Vec<_>>().join(" -> "))
}

/// The tables of all files, merged; `texts` are the shifted ones.
pub(crate) fn merged<'t>(source: &Source, texts: &'t [String]) -> Result<DeTable<'t>, Error> {
    let mut mistakes = Mistakes::default();
    let merged = merge(source, texts, &mut mistakes)?;
    mistakes.finish().map(|()| merged)
}

/// The same with all that could be merged; the errors are those of the syntax.
fn merge<'t>(
    source: &Source,
    texts: &'t [String],
    mistakes: &mut Mistakes,
) -> Result<DeTable<'t>, Error> {
    let parsed = texts.iter().map(|text| parsed(source, text));
    let files = Mistakes::all(parsed)?.into_iter().rev();
    let mut misfits = Vec::new();
    let merged = files.reduce(|base, changes| extend::extend(base, changes, &mut misfits));
    for Wrong { place, message, help } in misfits {
        mistakes.push(source.error(place, message, "").hint(help));
    }
    Ok(merged.map(Spanned::into_inner).unwrap_or_default())
}

/// The table of a file.
fn parsed<'t>(source: &Source, text: &'t str) -> Result<Spanned<DeTable<'t>>, Error> {
    let (table, errors) = DeTable::parse_recoverable(text);
    let told = errors.iter().take(TOLD).map(|error| wrong(source, error));
    told.collect::<Mistakes>().finish().map(|()| table)
}

/// The merged document of all files.
fn document(source: &Source) -> Result<Document, Error> {
    let (texts, mut mistakes) = (source.padded_texts(), Mistakes::default());
    let merged = merge(source, &texts, &mut mistakes)?;
    for (place, message) in sizes::absurd(&merged).into_iter().take(TOLD) {
        mistakes.push(source.error(place, message, "here"));
    }
    let document = Document::deserialize(Deserializer::from(Spanned::new(0..0, merged.clone())));
    let document = document.map_err(|error| misshapen(source, &merged, &error));
    let document = document.and_then(|document| without_base(source, &document).map(|()| document));
    let document = mistakes.take(document);
    mistakes.finish()?;
    document.ok_or_else(Error::follow_up)
}

/// Refuses to leave out entries where none are inherited.
fn without_base(source: &Source, document: &Document) -> Result<(), Error> {
    let message = "there is nothing to leave out: the scenario extends no other";
    let is_base = document.extends.is_some() || !document.system.is_empty();
    let names = document.without.values().flatten().filter(|_| !is_base);
    let errors = names.map(|name| source.error(name.span(), message, ""));
    errors.collect::<Mistakes>().finish()
}

/// The error of a parser, at its place.
fn wrong(source: &Source, error: &toml::de::Error) -> Error {
    let end = source.files().next().map_or(0, |file| file.text.len());
    source.error(error.span().unwrap_or(end..end), error.message(), "here")
}

/// The errors of a document that has not the form of a scenario. The schema knows the names that are expected at each place.
fn misshapen(source: &Source, merged: &DeTable, error: &toml::de::Error) -> Error {
    let found = schema::findings(super::schema(), 0..0, merged);
    let found = found.into_iter().take(TOLD);
    let found: Mistakes = found.map(|finding| told(source, finding)).collect();
    // Of what the schema does not tell, the parser tells the first.
    found.finish().err().unwrap_or_else(|| wrong(source, error))
}

/// A word that breaks the schema, with its cure.
fn told(source: &Source, Finding { span, unknown, message, help }: Finding) -> Error {
    let renamed = unknown.and_then(|(name, known)| {
        let (old, new) =
            RENAMED.iter().find(|(old, new)| name == *old && known.iter().any(|it| it == new))?;
        Some(format!("`{old}` is called `{new}` now"))
    });
    source.error(span, message, "here").hint(renamed.or(help))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_found_by_the_keys_that_lead_to_it() {
        let text = "title = 't'\n[[analysis]]\nname = 'a'\n[analysis.config]\nsmooth.rate = 1\n";
        let file = TextFile::new("case.toml", text);
        let source = Source::from_recording(file, Vec::new(), Vec::new());
        let scenario = Scenario::recorded("case", source).expect("a scenario");
        for (path, word) in [
            (&["analysis", "0", "config", "smooth", "rate"][..], "rate"),
            (&["analysis", "0", "name"], "name"),
            (&["analysis", "0", "config", "smooth", "unknown"], "smooth"),
        ] {
            assert_eq!(scenario.place(path).map(|(_, span)| &text[span]), Some(word), "{path:?}");
        }
        assert_eq!(scenario.place(&["unknown"]), None);
        let schema = serde_json::json!({"type": "object", "additionalProperties": false,
            "properties": {"smoothing": {"type": "object"}}});
        let found = scenario.findings(&["analysis", "0", "config"], &schema);
        assert_eq!(found.first().map(|it| &text[it.span.clone()]), Some("smooth"));
    }
}
