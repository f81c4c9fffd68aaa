//! Finds the plugins and the signals of `[[analysis]]`, and asks each plugin what it thinks of its part of the scenario.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use diagnostics::{Error, Spanned, suggest};
use expression::SignalUnit;
use plugin::{ConfigError, Plugin, Request, Signal, Wanted};
use recording::{Columns as RunColumns, Full};
use units::Unit;

use super::logs::{self, Wanted as Columns};
use super::signal_units::{SignalUnits, cure};
use crate::build_request::BuildRequest;
use crate::plan::{AnalysisPlan, Origin, Wired};
use crate::schema::{self, Finding};
use crate::words::{Analysis, AnalysisTable, Scenario};

/// The columns of the run and their units.
type Signals<'a> = (&'a RunColumns<Full>, &'a SignalUnits);

pub(super) fn resolve(
    scenario: &Scenario,
    plugins: &BTreeMap<BuildRequest, PathBuf>,
    signals: Signals,
    warnings: &mut Vec<String>,
) -> Result<Vec<AnalysisPlan>, Error> {
    let (analyses, columns) = (&scenario.document.analysis, signals.0);
    for (i, analysis) in analyses.iter().enumerate() {
        let name = analysis.name.get_ref();
        let twice = analyses[..i].iter().any(|other| other.name.get_ref() == name);
        if twice || columns.iter().any(|column| column.node == *name) {
            let message = format!("something else is called `{name}` already");
            return Err(scenario.error(&analysis.name, message));
        }
    }
    analyses.iter().map(|analysis| plan(scenario, analysis, plugins, signals, warnings)).collect()
}

fn plan(
    scenario: &Scenario,
    analysis: &Analysis,
    plugins: &BTreeMap<BuildRequest, PathBuf>,
    signals: Signals,
    warnings: &mut Vec<String>,
) -> Result<AnalysisPlan, Error> {
    let plugin = load(scenario, analysis, plugins)?;
    let read = |AnalysisTable { path, time, origin, columns }: &AnalysisTable| {
        let wanted = Columns { path, time: time.as_ref(), origin: *origin, columns };
        logs::read(scenario, &wanted, warnings)
    };
    let (log, units) = match analysis.table.as_ref().map(read).transpose()? {
        Some(log) => (Some(log.table), log.units),
        None => (None, Vec::new()),
    };
    let (run, run_units) = signals;
    let mut wired = Vec::new();
    for (name, signal) in &analysis.signals {
        let wanted = wanted(scenario, &plugin, name)?;
        let full = signal.get_ref();
        let Some((index, _)) = run.numbers().find(|(_, it)| it.name() == *full) else {
            let names: Vec<_> = run.numbers().map(|(_, it)| it.name()).collect();
            let unknown = suggest::unknown("signal", full, names.iter().map(String::as_str));
            return Err(unknown.at(&scenario.source, signal.span()));
        };
        let unit = run_units.of(full);
        let written = (signal.span(), full.as_str());
        let cure = |unit: &str| cure(scenario, full, unit);
        wired.push(wire(scenario, wanted, (Origin::Run(index), unit), written, &cure)?);
    }
    for (column, (name, entry)) in
        analysis.table.iter().flat_map(|table| &table.columns).enumerate()
    {
        let wanted = wanted(scenario, &plugin, name)?;
        if wired.iter().any(|other| other.name == wanted.name) {
            let message = format!("`{}` comes from the run already", wanted.name);
            return Err(scenario.error(name, message));
        }
        let entry = entry.get_ref();
        let place = entry.unit.as_ref().unwrap_or(&entry.column).span();
        let written = (place, entry.column.get_ref().as_str());
        let cure = |unit: &str| {
            format!("say which unit it has: unit = \"{unit}\" in the column `{}`", wanted.name)
        };
        let unit = match &units[column] {
            None => SignalUnit::Missing,
            Some(name) => {
                let unit = read_unit(scenario, &written, name);
                SignalUnit::Known(unit.map_err(|error| error.help(cure("m/s")))?, name.clone())
            }
        };
        wired.push(wire(scenario, wanted, (Origin::Log(column), unit), written, &cure)?);
    }
    complete(scenario, analysis, &plugin, &wired)?;
    Ok(AnalysisPlan {
        name: analysis.name.get_ref().clone(),
        config: config(scenario, analysis, &plugin, &wired)?,
        plugin,
        wired,
        log,
    })
}

fn load(
    scenario: &Scenario,
    analysis: &Analysis,
    plugins: &BTreeMap<BuildRequest, PathBuf>,
) -> Result<Plugin, Error> {
    let (word, path) = match (&analysis.path, &analysis.package, analysis.build_request()) {
        (Some(path), None, _) if analysis.example.is_none() => {
            (path, scenario.source.resolve(path))
        }
        (None, Some(package), Some(product)) => match plugins.get(&product) {
            Some(path) => (package, path.clone()),
            None => {
                let message = format!("`{}` was not built", package.get_ref());
                return Err(scenario.error(package, message));
            }
        },
        _ => {
            let message = format!(
                "the analysis `{}` needs either `path` or `crate`, and `example` goes with `crate`",
                analysis.name.get_ref()
            );
            return Err(scenario.error(&analysis.name, message));
        }
    };
    // A path without a folder would be looked up among the libraries of the system.
    let path = std::path::absolute(&path).unwrap_or(path);
    Plugin::load(&path).map_err(|error| scenario.error(word, error.to_string()))
}

/// The signal that the plugin expects under this name.
fn wanted<'a>(
    scenario: &Scenario,
    plugin: &'a Plugin,
    name: &Spanned<String>,
) -> Result<&'a Wanted, Error> {
    let known = plugin.needs();
    if let Some(wanted) = known.iter().find(|wanted| wanted.name == *name.get_ref()) {
        return Ok(wanted);
    }
    let names = known.iter().map(|wanted| wanted.name.as_str());
    let unknown = suggest::unknown("signal of the plugin", name.get_ref(), names);
    Err(unknown.at(&scenario.source, name.span()))
}

/// Converts to the unit that the plugin wants. `cure` says where a missing unit is declared.
fn wire(
    scenario: &Scenario,
    wanted: &Wanted,
    (origin, unit): (Origin, SignalUnit),
    written: (Range<usize>, &str),
    cure: &dyn Fn(&str) -> String,
) -> Result<Wired, Error> {
    let wired = |unit: &str, (factor, offset)| Wired {
        name: wanted.name.clone(),
        unit: unit.to_owned(),
        origin,
        factor,
        offset,
    };
    let Wanted { name, unit: to, .. } = wanted;
    if to.is_empty() {
        let own = if let SignalUnit::Known(_, own) = &unit { own } else { "" };
        return Ok(wired(own, (1.0, 0.0)));
    }
    let known = read_unit(scenario, &written, to)?;
    let (place, signal) = written;
    match unit {
        SignalUnit::Known(from, own) => {
            let conversion = Unit::conversion(&from, &known).ok_or_else(|| {
                let message = format!("`{name}` is wanted in [{to}], and `{signal}` is in [{own}]");
                let help = format!("{} is not {}", from.dimension(), known.dimension());
                scenario.source.error(place, message, "").help(help)
            })?;
            Ok(wired(to, conversion))
        }
        SignalUnit::Missing if known != Unit::ONE => {
            let message = format!("`{name}` is wanted in [{to}], and `{signal}` has no unit");
            Err(scenario.source.error(place, message, "").help(cure(to)))
        }
        SignalUnit::Missing | SignalUnit::Plain => Ok(wired(to, (1.0, 0.0))),
    }
}

/// A unit that a signal or a plugin has.
fn read_unit(
    scenario: &Scenario,
    (place, signal): &(Range<usize>, &str),
    unit: &str,
) -> Result<Unit, Error> {
    Unit::parse(unit)
        .map_err(|error| scenario.source.error(place.clone(), format!("`{signal}`: {error}"), ""))
}

/// Whether the plugin gets all that it cannot do without.
fn complete(
    scenario: &Scenario,
    analysis: &Analysis,
    plugin: &Plugin,
    wired: &[Wired],
) -> Result<(), Error> {
    let given = |wanted: &&Wanted| wired.iter().any(|wired| wired.name == wanted.name);
    let mut missing = plugin.needs().iter().filter(|wanted| wanted.required && !given(wanted));
    let Some(Wanted { name, description, unit, .. }) = missing.next() else { return Ok(()) };
    let message = format!("`{}` needs a signal `{name}`: {description}", analysis.name.get_ref());
    let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
    let help = format!(
        "add it{unit} to [analysis.signals], such as {name} = \"node.variable\", or to the columns of [analysis.table]"
    );
    Err(scenario.error(&analysis.name, message).help(help))
}

/// The configuration as text, if the plugin agrees to it.
fn config(
    scenario: &Scenario,
    analysis: &Analysis,
    plugin: &Plugin,
    wired: &[Wired],
) -> Result<String, Error> {
    let mut table =
        analysis.config.as_ref().map(|config| config.get_ref().clone()).unwrap_or_default();
    if !analysis.files.is_empty() {
        let texts = files(scenario, analysis)?;
        if table.insert("files".to_owned(), texts.into()).is_some() {
            let message = "`files` in the configuration is where the texts of [analysis.files] go";
            return Err(scenario.error(&analysis.name, message));
        }
    }
    let text = toml::to_string(&table).map_err(|error| {
        scenario.error(&analysis.name, format!("the configuration cannot be handed over: {error}"))
    })?;
    let signals =
        wired.iter().map(|Wired { name, unit, .. }| Signal { name, unit, time: &[], values: &[] });
    let checked = plugin.check(&Request { config: &text, signals: signals.collect() });
    checked.map_err(|error| refused(scenario, analysis, plugin, &error))?;
    Ok(text)
}

/// The error of a plugin that refuses its configuration, at the key that it blames. The schema knows what a misspelt key was
/// meant to be.
fn refused(
    scenario: &Scenario,
    analysis: &Analysis,
    plugin: &Plugin,
    error: &ConfigError,
) -> Error {
    let name = analysis.name.get_ref();
    let analyses = &scenario.document.analysis;
    let index = analyses.iter().take_while(|it| !std::ptr::eq(*it, analysis)).count().to_string();
    let schema = plugin.config_schema().and_then(|text| serde_json::from_str(text).ok());
    let schema = schema.map(|schema| schema::plain(&schema));
    let findings = schema.map(|schema| scenario.findings(&["analysis", &index, "config"], &schema));
    if let Some(Finding { span, message, help, .. }) = findings.into_iter().flatten().next() {
        return scenario.source.error(span, format!("`{name}`: {message}"), "").hint(help);
    }
    let keys: Vec<_> = error.path.iter().map(String::as_str).collect();
    let under = |tables: &[&str]| {
        let path = [&["analysis", &index], tables, &keys].concat();
        scenario.place(&path).filter(|(depth, _)| *depth > 2 + tables.len())
    };
    // The key may be that of the configuration, of a text file, or of a signal.
    let tables: [&[&str]; 4] = [&["config"], &[], &["signals"], &["table", "columns"]];
    let place = tables.into_iter().find_map(under);
    let span = place.map_or(analysis.name.span(), |(_, span)| span);
    scenario.source.error(span, format!("`{name}`: {}", error.message.trim()), "")
}

/// The contents of the text files.
fn files(scenario: &Scenario, analysis: &Analysis) -> Result<toml::Table, Error> {
    let read = |(name, path): (&Spanned<String>, &Spanned<String>)| {
        let file = scenario.source.resolve(path);
        let text = std::fs::read_to_string(&file).map_err(|error| {
            scenario.error(path, format!("{} cannot be read: {error}", file.display()))
        })?;
        Ok((name.get_ref().clone(), text.into()))
    };
    analysis.files.iter().map(read).collect()
}
