//! Bundles a scenario: one text that extends nothing, with all files that it names under portable paths in one folder.

mod files;
mod paths;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use diagnostics::{Error, ErrorCollector};
use serde::Deserialize as _;
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue, Deserializer};

use crate::build_request::BuildArtifacts;
use crate::document::{self, Scenario};
use crate::resolve;
use crate::text_of;
use files::BundleFiles;
use paths::FileRole;

/// The name of the text of a bundle that is written to a folder.
pub const SCENARIO: &str = "scenario.toml";

/// Where the files of a bundle lie: folders with `/` in between, relative to that of the bundle.
#[derive(Debug, Clone, Copy)]
pub struct BundleLayout<'a> {
    /// The folder of FMUs.
    pub fmus: &'a str,
    /// The folder of all other files.
    pub others: &'a str,
    /// The folder of plugins, when those of packages are gathered, too: as libraries for this platform.
    pub plugins: Option<&'a str>,
}

/// A file of a bundle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BundledFile {
    /// A copy of this file.
    File(PathBuf),
    /// A text, such as that of a scenario that validates.
    Text(String),
}

/// A scenario that needs nothing but its own files, and the packages of its plugins.
#[derive(Debug)]
pub struct ScenarioBundle {
    /// The name of the run.
    pub name: String,
    /// The text of the scenario. Its paths are relative to the folder of the bundle.
    pub text: String,
    /// Files by their paths in the folder, with `/`. Letters, digits, `.`, `_` and `-` are in them; no two differ by case alone.
    pub files: BTreeMap<String, BundledFile>,
    /// The path in the folder of each FMU, by the name of its node; without those of validations.
    pub fmus: BTreeMap<String, String>,
    /// What the bundle needs besides, such as packages of plugins.
    pub notes: Vec<String>,
}

impl ScenarioBundle {
    /// Gathers a scenario with what it extends and with the scenarios that it is validated by. FMUs of packages are those that were
    /// `built`. Plugins of packages stay packages, unless there is a folder for them.
    ///
    /// # Errors
    /// At each word that names a file that is not there, or a package that was not built.
    pub fn gather(scenario: &Scenario, built: &BuildArtifacts, layout: BundleLayout) -> Result<Self, Error> {
        Self::gather_lists(scenario, built, layout, &[])
    }

    /// The same for the simulation alone: files of baselines, analyses, validations and sweeps stay where they are.
    ///
    /// # Errors
    /// As of [`gather`](Self::gather), but for these files.
    pub fn gather_simulation(
        scenario: &Scenario,
        built: &BuildArtifacts,
        layout: BundleLayout,
    ) -> Result<Self, Error> {
        Self::gather_lists(scenario, built, layout, &["baseline", "analysis", "validation", "sweep", "view"])
    }

    fn gather_lists(
        scenario: &Scenario,
        built: &BuildArtifacts,
        layout: BundleLayout,
        ungathered: &'static [&'static str],
    ) -> Result<Self, Error> {
        let mut gatherer =
            BundleGatherer { built, layout, ungathered, files: BundleFiles::new(), notes: Vec::new() };
        gatherer.files.reserve_path(SCENARIO);
        let (text, fmus) = gatherer.gather_scenario_text(scenario, TextLocation::ROOT)?;
        let (files, notes) = (gatherer.files.all, gatherer.notes);
        Ok(ScenarioBundle { name: scenario.name.clone(), text, files, fmus, notes })
    }

    /// Writes the text as [`SCENARIO`] and all files into a folder that is there.
    ///
    /// # Errors
    /// When a file cannot be read or written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let written =
            |path: &Path, done: std::io::Result<()>| done.map_err(|error| Error::output_failure(path, error));
        let text = folder.join(SCENARIO);
        written(&text, std::fs::write(&text, &self.text))?;
        for (name, content) in &self.files {
            let path = folder.join(name);
            if let Some(parent) = path.parent() {
                written(parent, std::fs::create_dir_all(parent))?;
            }
            written(
                &path,
                match content {
                    BundledFile::File(from) => std::fs::copy(from, &path).map(drop),
                    BundledFile::Text(text) => std::fs::write(&path, text),
                },
            )?;
        }
        Ok(())
    }
}

/// The files that a scenario is made of and reads: its own text and those that it extends, data, parameters with the texts that they
/// name, and the same of the scenarios that it is validated by. Whether data are there is not looked at.
///
/// # Errors
/// When the scenario cannot be merged, or a file of parameters is no TOML.
pub fn input_files(scenario: &Scenario) -> Result<BTreeSet<PathBuf>, Error> {
    let texts = scenario.source.padded_texts();
    let mut table = document::merge_files(&scenario.source, &texts)?;
    let (mut found, mut mistakes) = (BTreeSet::new(), ErrorCollector::default());
    found.extend(scenario.source.files().map(|file| file.path.clone()));
    let archives = scenario.document.fmu.iter().filter_map(|fmu| fmu.path.as_ref());
    found.extend(archives.map(|path| scenario.source.resolve_path(path)));
    paths::for_each_file(&mut table, &mut |role, word| {
        let Some(text) = word.get_ref().as_str() else { return };
        let path = scenario.source.base_folder(word.span()).join(text.trim_start_matches('@'));
        match role {
            FileRole::Validation(index) => {
                let child = scenario.validations.get(index).map_or(Ok(BTreeSet::new()), input_files);
                found.extend(mistakes.ok_or_record(child).unwrap_or_default());
            }
            FileRole::Archive if !text.ends_with(".fmu") => {}
            FileRole::Values if !text.starts_with('@') || !path.is_file() => {}
            FileRole::Parameters | FileRole::Values => {
                let named = files_named_in_parameters(&path);
                let named = named.map_err(|what| scenario.source.error_at(word.span(), what, ""));
                found.extend(mistakes.ok_or_record(named).unwrap_or_default());
                found.insert(path);
            }
            _ => drop(found.insert(path)),
        }
    });
    mistakes.into_result().map(|()| found)
}

/// The files whose texts are values in a file of parameters.
fn files_named_in_parameters(path: &Path) -> Result<Vec<PathBuf>, String> {
    let wrong = |what: &dyn std::fmt::Display| format!("{}: {what}", path.display());
    let text = std::fs::read_to_string(path).map_err(|error| wrong(&error))?;
    let mut table = DeTable::parse(&text).map_err(|error| wrong(&error.message()))?.into_inner();
    let (folder, mut found) = (path.parent().unwrap_or(Path::new("")), Vec::new());
    paths::for_each_text(&mut table, &mut |_, word| {
        found.extend(word.get_ref().as_str().map(|name| folder.join(name)));
    });
    Ok(found)
}

/// Where a text lies in the bundle.
#[derive(Clone, Copy)]
struct TextLocation<'a> {
    /// The folder of the text, empty or with `/` at its end.
    folder: &'a str,
    /// The path from there to the folder of the bundle, with `/` at its end.
    root: &'a str,
}

impl TextLocation<'_> {
    const ROOT: Self = TextLocation { folder: "", root: "" };
}

struct BundleGatherer<'a> {
    built: &'a BuildArtifacts,
    layout: BundleLayout<'a>,
    /// The keys of the scenario whose files are not gathered.
    ungathered: &'static [&'static str],
    files: BundleFiles,
    notes: Vec<String>,
}

impl BundleGatherer<'_> {
    /// The text of a scenario and the paths of its FMUs by node; their files join the others.
    fn gather_scenario_text(
        &mut self,
        scenario: &Scenario,
        location: TextLocation,
    ) -> Result<(String, BTreeMap<String, String>), Error> {
        let texts = scenario.source.padded_texts();
        let mut table = document::merge_files(&scenario.source, &texts)?;
        ["extends", "variant", "without", "system"].iter().for_each(|key| drop(table.remove(*key)));
        let mut mistakes = ErrorCollector::default();
        let fmus = self.gather_fmus(scenario, &mut table, location, &mut mistakes);
        self.gather_plugins(scenario, &mut table, location, &mut mistakes);
        let ungathered: Vec<_> = self.ungathered.iter().filter_map(|key| table.remove_entry(*key)).collect();
        paths::for_each_file(&mut table, &mut |role, word| {
            mistakes.ok_or_record(self.gather_file(scenario, role, word, location));
        });
        table.extend(ungathered);
        mistakes.into_result()?;
        let table = toml::Table::deserialize(Deserializer::from(Spanned::new(0..0, table)));
        let wrong = |what: &dyn std::fmt::Display| {
            Error::invalid_input(format!("{}: {what}", scenario.source.main_path().display()))
        };
        let table = table.map_err(|error| wrong(&error.message()))?;
        let text = toml::to_string(&table).map_err(|error| wrong(&error))?;
        Ok((text, fmus))
    }

    /// Replaces packages of FMUs by archives, and gathers the archives.
    fn gather_fmus(
        &mut self,
        scenario: &Scenario,
        table: &mut DeTable,
        location: TextLocation,
        mistakes: &mut ErrorCollector,
    ) -> BTreeMap<String, String> {
        let mut paths = BTreeMap::new();
        let words = scenario.document.fmu.iter();
        for (fmu, entry) in words.zip(paths::list_entries(table, "fmu")) {
            let archive = fmu.build_request().and_then(|it| self.built.archives.get(&it).cloned());
            let (word, path) = match (&fmu.path, archive) {
                (Some(path), _) => (path, scenario.source.resolve_path(path)),
                (None, Some(archive)) => (&fmu.name, archive),
                (None, None) => {
                    let message = "expected a built package or `path`, found neither";
                    mistakes.push(scenario.error_at(&fmu.name, message));
                    continue;
                }
            };
            let added = self.files.add_file(&path, self.layout.fmus);
            let added = added.map_err(|what| scenario.error_at(word, what));
            let Some(inside) = mistakes.ok_or_record(added) else { continue };
            replace_package(entry, format!("{}{inside}", location.root));
            self.leave_out_readable_files(fmu.name.get_ref(), entry);
            paths.insert(fmu.name.get_ref().clone(), inside);
        }
        paths
    }

    /// What a node or a script may read in its sandbox are files of this machine.
    fn leave_out_readable_files(&mut self, name: &str, entry: &mut DeTable) {
        if entry.remove("may_read").is_some() {
            self.notes.push(format!("`may_read` of `{name}` names files of this machine: it is left out"));
        }
    }

    /// Replaces packages of plugins by libraries where there is a folder for them, and says what is not gathered.
    fn gather_plugins(
        &mut self,
        scenario: &Scenario,
        table: &mut DeTable,
        location: TextLocation,
        mistakes: &mut ErrorCollector,
    ) {
        let words = scenario.document.analysis.iter();
        for (analysis, entry) in words.zip(paths::list_entries(table, "analysis")) {
            self.leave_out_readable_files(analysis.name.get_ref(), entry);
            let Some(request) = analysis.build_request() else { continue };
            let library = self.built.plugins.get(&request);
            if let Some((folder, library)) = self.layout.plugins.zip(library) {
                let added = self.files.add_file(library, folder);
                let added = added.map_err(|what| scenario.error_at(&analysis.name, what));
                if let Some(inside) = mistakes.ok_or_record(added) {
                    replace_package(entry, format!("{}{inside}", location.root));
                }
                continue;
            }
            let name = analysis.name.get_ref();
            self.notes.push(format!(
                "the analysis `{name}` needs the package `{}` of a workspace, which is not gathered",
                request.package
            ));
        }
    }

    /// Gathers the file that a word names, and writes its path in the bundle in place of the word.
    fn gather_file(
        &mut self,
        scenario: &Scenario,
        role: FileRole,
        word: &mut Spanned<DeValue>,
        location: TextLocation,
    ) -> Result<(), Error> {
        let Some(text) = word.get_ref().as_str() else { return Ok(()) };
        let path = scenario.source.base_folder(word.span()).join(text.trim_start_matches('@'));
        let wrong = |what: String| scenario.source.error_at(word.span(), what, "");
        let others = self.layout.others;
        let inside = match role {
            FileRole::Parameters => self.gather_parameter_file(&path).map_err(wrong)?,
            FileRole::File => self.files.add_file(&path, others).map_err(wrong)?,
            FileRole::Draws(index) => {
                let vary = scenario.document.sweep.iter().flat_map(|sweep| &sweep.vary).nth(index);
                let name = vary.map_or("", |vary| vary.name.get_ref().as_str());
                let path = resolve::sample_file(&path, name).map_err(wrong)?;
                self.files.add_file(&path, others).map_err(wrong)?
            }
            FileRole::Archive if !text.ends_with(".fmu") => return Ok(()),
            FileRole::Archive => self.files.add_file(&path, self.layout.fmus).map_err(wrong)?,
            FileRole::Validation(index) => {
                let Some(child) = scenario.validations.get(index) else { return Ok(()) };
                let folder = format!("{}/", others.trim_end_matches('/'));
                let root = "../".repeat(folder.split('/').filter(|part| !part.is_empty()).count());
                let (text, _) =
                    self.gather_scenario_text(child, TextLocation { folder: &folder, root: &root })?;
                self.files.add_text(&format!("{}.toml", child.name), others, text)
            }
            FileRole::Values if !text.starts_with('@') || !path.is_file() => return Ok(()),
            // An analysis may leave a file of this name, which goes before the one that is there.
            FileRole::Values if !text.contains(['/', '\\']) && !has_text_references(&path) => {
                let name = text.trim_start_matches('@');
                return self.files.add_as(&path, &format!("{}{name}", location.folder)).map_err(wrong);
            }
            FileRole::Values => {
                let inside = self.gather_parameter_file(&path).map_err(wrong)?;
                *word.get_mut() = DeValue::String(format!("@{}{inside}", location.root).into());
                return Ok(());
            }
        };
        *word.get_mut() = DeValue::String(format!("{}{inside}", location.root).into());
        Ok(())
    }

    /// Gathers a file of values, and those whose texts are among them, under other paths in it.
    fn gather_parameter_file(&mut self, path: &Path) -> Result<String, String> {
        let others = self.layout.others;
        if !has_text_references(path) {
            return self.files.add_file(path, others);
        }
        let wrong = |what: &dyn std::fmt::Display| format!("{}: {what}", path.display());
        let text = std::fs::read_to_string(path).map_err(|error| wrong(&error))?;
        let table = DeTable::parse(&text).map_err(|error| wrong(&error.message()))?;
        let (mut table, mut missing) = (table.into_inner(), None);
        let folder = path.parent().unwrap_or(Path::new(""));
        paths::for_each_text(&mut table, &mut |_, word| {
            let Some(name) = word.get_ref().as_str() else { return };
            match self.files.add_file(&folder.join(name), others) {
                // All of them are in one folder.
                Ok(inside) => {
                    let name = inside.rsplit('/').next().unwrap_or_default().to_owned();
                    *word.get_mut() = DeValue::String(name.into());
                }
                Err(what) => missing = Some(what),
            }
        });
        if let Some(what) = missing {
            return Err(wrong(&what));
        }
        let table = toml::Table::deserialize(Deserializer::from(Spanned::new(0..0, table)));
        let table = table.map_err(|error| wrong(&error.message()))?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let text = toml::to_string(&table).map_err(|error| wrong(&error))?;
        Ok(self.files.add_text(&name, others, text))
    }
}

/// Whether values of a file are the texts of others.
fn has_text_references(path: &Path) -> bool {
    std::fs::read_to_string(path).is_ok_and(|text| text.contains(text_of::KEY))
}

/// Puts a path in the place of a package.
fn replace_package(entry: &mut DeTable, path: String) {
    ["crate", "example"].iter().for_each(|key| drop(entry.remove(*key)));
    let key = Spanned::new(0..0, DeString::from("path"));
    entry.insert(key, Spanned::new(0..0, DeValue::String(path.into())));
}
