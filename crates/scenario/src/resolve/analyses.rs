//! Finds the plugins and the signals of `[[analysis]]`, and asks each plugin what it thinks of its part of the scenario.

mod from_log;
mod loaded;

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use diagnostics::{Error, Mistakes, Source, Spanned, suggest};
use expression::SignalUnit;
use fmu_import::call_plugin;
use plugin::{ConfigError, OwnedInputSignal, Plugin, Request, Signal};
use recording::table::Scaling;
use recording::{Columns as RunColumns, Full, NumberIndex};
use units::Unit;

use self::loaded::Loaded;
use super::Notes;
use super::logs;
use super::parameters::Parameters;
use super::signal_units::{SignalUnits, cure};
use crate::build_request::BuildRequest;
use crate::plan::{AnalysisPlan, Origin, Wired};
use crate::schema::{self, Finding};
use crate::words::{Analysis, AnalysisSignal, AnalysisTable, ScaledSignal, Scenario};

/// The columns of the run and their units.
type Signals<'a> = (&'a RunColumns<Full>, &'a SignalUnits);

/// The plugins that were built, and files of parameters.
type Given<'g> = (&'g BTreeMap<BuildRequest, PathBuf>, &'g Parameters);

pub(super) fn resolve(
    scenario: &Scenario,
    given: Given,
    signals: Signals,
    (mistakes, warnings): Notes,
) -> Vec<AnalysisPlan> {
    let analyses = &scenario.document.analysis;
    let plans = analyses.iter().enumerate().filter_map(|(index, analysis)| {
        mistakes.take(unique(scenario, &analyses[..index], analysis, signals.0));
        mistakes.take(plan(scenario, analysis, given, signals, warnings))
    });
    plans.collect()
}

/// Checks refer to results by the names of analyses.
fn unique(
    scenario: &Scenario,
    before: &[Analysis],
    analysis: &Analysis,
    columns: &RunColumns<Full>,
) -> Result<(), Error> {
    let name = analysis.name.get_ref();
    let twice = before.iter().any(|other| other.name.get_ref() == name);
    if twice || columns.iter().any(|column| column.node == *name) {
        let message = format!("something else is called `{name}` already");
        return Err(scenario.error(&analysis.name, message));
    }
    Ok(())
}

fn plan(
    scenario: &Scenario,
    analysis: &Analysis,
    (plugins, parameters): Given,
    signals: Signals,
    warnings: &mut Vec<String>,
) -> Result<AnalysisPlan, Error> {
    let mut mistakes = Mistakes::default();
    let aliases = analysis.table.as_ref().map(|table| logs::aliases(scenario, table.file()));
    let aliases = mistakes.take(aliases.transpose());
    let sound_aliases = aliases.is_some();
    let aliases = aliases.flatten().flatten();
    let loaded = mistakes.take(loaded::load(scenario, analysis, plugins, aliases.as_ref()));
    let needs = loaded.as_ref().map_or(&[][..], |loaded| &loaded.needs);
    let asked = needs.iter().filter(|need| !given(&analysis.signals, &need.name));
    let asked: Vec<OwnedInputSignal> = asked.cloned().collect();
    let read = |table: &AnalysisTable| {
        from_log::read(scenario, (table, aliases.as_ref()), &asked, warnings)
    };
    let log = analysis.table.as_ref().filter(|_| sound_aliases).map(read);
    let log = mistakes.take(log.transpose()).flatten();
    let Some(loaded) = loaded else {
        return Err(mistakes.finish().err().unwrap_or_else(Error::follow_up));
    };
    let mut wired = Vec::new();
    for (name, signal) in &analysis.signals {
        let wanted = wanted(scenario, &loaded, name);
        let taken = taken(scenario, signal).and_then(|(full, place, scaling)| {
            let index = column(scenario, signals.0, (full, place.clone()))?;
            Ok((index, (&scenario.source, place, full), scaling))
        });
        let made = Mistakes::both(wanted, taken).and_then(|(wanted, (index, written, scaling))| {
            let full = written.2;
            let found = (Origin::Run(index), signals.1.of(full));
            let cure = |unit: &str| cure(scenario, full, unit);
            Ok(scaled(wire(wanted, found, written, &cure)?, scaling))
        });
        wired.extend(mistakes.take(made));
    }
    for name in analysis.table.iter().flat_map(|table| table.columns.keys()) {
        let named = wanted(scenario, &loaded, name);
        mistakes.take(named.and_then(|wanted| not_of_run(scenario, analysis, name, wanted)));
    }
    if let Some(log) = &log {
        wired.extend(from_log::wired(log, &loaded.needs, &mut mistakes));
    }
    if analysis.table.is_none() || log.is_some() {
        mistakes.take(complete(scenario, analysis, &loaded, &wired));
    }
    let sound = mistakes.finish();
    let texts = texts(scenario, analysis, parameters);
    let config = texts.and_then(|texts| {
        config((scenario, analysis), loaded.plugin(), texts, &wired, sound.is_ok())
    });
    let ((), config) = Mistakes::both(sound, config)?;
    Ok(AnalysisPlan {
        name: analysis.name.get_ref().clone(),
        config,
        analyser: loaded.analyser,
        library: loaded.path,
        wired,
        log: log.map(|log| log.table),
    })
}

/// Whether a signal of the run is named.
fn given(signals: &BTreeMap<Spanned<String>, Spanned<AnalysisSignal>>, name: &str) -> bool {
    signals.keys().any(|it| it.get_ref() == name)
}

/// The number that a word names.
fn column(
    scenario: &Scenario,
    columns: &RunColumns<Full>,
    (full, place): (&str, Range<usize>),
) -> Result<NumberIndex<Full>, Error> {
    if let Some((index, _)) = columns.numbers().find(|(_, it)| it.name() == full) {
        return Ok(index);
    }
    let names: Vec<_> = columns.numbers().map(|(_, it)| it.name()).collect();
    let unknown = suggest::unknown("signal", full, names.iter().map(String::as_str));
    Err(unknown.at(&scenario.source, place))
}

/// Refuses a column of a file under the name of a signal of the run.
fn not_of_run<'a>(
    scenario: &Scenario,
    analysis: &Analysis,
    name: &Spanned<String>,
    wanted: &'a OwnedInputSignal,
) -> Result<&'a OwnedInputSignal, Error> {
    if analysis.signals.contains_key(name) {
        let message = format!("`{}` comes from the run already", wanted.name);
        return Err(scenario.error(name, message));
    }
    Ok(wanted)
}

/// The signal that the plugin expects under this name.
fn wanted<'a>(
    scenario: &Scenario,
    loaded: &'a Loaded,
    name: &Spanned<String>,
) -> Result<&'a OwnedInputSignal, Error> {
    let known = &loaded.needs;
    if let Some(wanted) = known.iter().find(|wanted| wanted.name == *name.get_ref()) {
        return Ok(wanted);
    }
    let names = known.iter().map(|wanted| wanted.name.as_str());
    let what = match loaded.plugin() {
        Some(_) => "signal of the plugin",
        None => "signal of the script",
    };
    let unknown = suggest::unknown(what, name.get_ref(), names);
    Err(unknown.at(&scenario.source, name.span()))
}

/// The name of a signal of the run, its place, and its gain, offset and sign.
fn taken<'a>(
    scenario: &Scenario,
    signal: &'a Spanned<AnalysisSignal>,
) -> Result<(&'a str, Range<usize>, Scaling), Error> {
    match signal.get_ref() {
        AnalysisSignal::Name(name) => Ok((name, signal.span(), Scaling::default())),
        AnalysisSignal::Scaled(ScaledSignal { from, gain, offset, sign }) => {
            let scaling = logs::scaling(&scenario.source, [gain, offset, sign])?;
            Ok((from.get_ref(), from.span(), scaling))
        }
    }
}

/// The unit conversion follows gain, offset and sign.
fn scaled(wired: Wired, scaling: Scaling) -> Wired {
    let Scaling { gain, offset, sign } = scaling;
    match scaling == Scaling::default() {
        true => wired,
        false => Wired {
            factor: sign * gain * wired.factor,
            offset: offset * wired.factor + wired.offset,
            ..wired
        },
    }
}

/// A name, and the file and the place where it is written.
type Written<'a> = (&'a Source, Range<usize>, &'a str);

/// Converts to the unit that the plugin wants. `cure` says where a missing unit is declared.
fn wire(
    wanted: &OwnedInputSignal,
    (origin, unit): (Origin, SignalUnit),
    written: Written,
    cure: &dyn Fn(&str) -> String,
) -> Result<Wired, Error> {
    let wired = |unit: &str, (factor, offset)| Wired {
        name: wanted.name.clone(),
        unit: unit.to_owned(),
        origin,
        factor,
        offset,
    };
    let OwnedInputSignal { name, unit: to, .. } = wanted;
    if to.is_empty() {
        let own = if let SignalUnit::Known(_, own) = &unit { own } else { "" };
        return Ok(wired(own, (1.0, 0.0)));
    }
    let known = read_unit(&written, to)?;
    let (source, place, signal) = written;
    match unit {
        SignalUnit::Known(from, own) | SignalUnit::Difference(from, own) => {
            let conversion = Unit::conversion(&from, &known).ok_or_else(|| {
                let message = format!("`{name}` is wanted in [{to}], and `{signal}` is in [{own}]");
                let help = format!("{} is not {}", from.dimension(), known.dimension());
                source.error(place, message, "").help(help)
            })?;
            Ok(wired(to, conversion))
        }
        SignalUnit::Missing if known != Unit::ONE => {
            let message = format!("`{name}` is wanted in [{to}], and `{signal}` has no unit");
            Err(source.error(place, message, "").help(cure(to)))
        }
        SignalUnit::Missing | SignalUnit::Plain => Ok(wired(to, (1.0, 0.0))),
    }
}

/// A unit that a signal or a plugin has.
fn read_unit((source, place, signal): &Written, unit: &str) -> Result<Unit, Error> {
    Unit::parse(unit)
        .map_err(|error| source.error(place.clone(), format!("`{signal}`: {error}"), ""))
}

/// Whether the plugin gets all that it cannot do without.
fn complete(
    scenario: &Scenario,
    analysis: &Analysis,
    loaded: &Loaded,
    wired: &[Wired],
) -> Result<(), Error> {
    let from_log = analysis.table.iter().flat_map(|table| table.columns.keys());
    let given: Vec<_> = analysis.signals.keys().chain(from_log).map(Spanned::get_ref).collect();
    let is_wired = |name: &String| wired.iter().any(|it| it.name == *name);
    let missing = loaded.needs.iter();
    let missing =
        missing.filter(|it| it.required && !given.contains(&&it.name) && !is_wired(&it.name));
    let errors = missing.map(|OwnedInputSignal { name, description, unit, .. }| {
        let message = format!("`{}` needs a signal `{name}`: {description}", analysis.name.get_ref());
        let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
        scenario.error(&analysis.name, message).help(format!(
            "add it{unit} to [analysis.signals], such as {name} = \"node.variable\", to the columns of [analysis.table], or to its aliases"
        ))
    });
    errors.collect::<Mistakes>().finish()
}

/// What the configuration gets of other files: contents, and the values of parameters.
fn texts(
    scenario: &Scenario,
    analysis: &Analysis,
    parameters: &Parameters,
) -> Result<[Added; 2], Error> {
    let texts = files(scenario, analysis)?;
    let mut values = toml::Table::new();
    for file in parameters.of(scenario, &analysis.parameters) {
        values.extend(file.values.iter().map(|it| (it.name.clone(), it.value.clone())));
    }
    let given = !analysis.parameters.is_empty();
    Ok([
        ("files", "the contents of [analysis.files]", texts, !analysis.files.is_empty()),
        ("parameters", "the values of the parameters", values, given),
    ])
}

/// A key of the configuration that the program fills: what goes there, the values, and whether there are any.
type Added = (&'static str, &'static str, toml::Table, bool);

/// The configuration as text, if the plugin agrees to it. Of signals that are not `sound` it hears nothing.
fn config(
    (scenario, analysis): (&Scenario, &Analysis),
    plugin: Option<&Plugin>,
    added: [Added; 2],
    wired: &[Wired],
    sound: bool,
) -> Result<String, Error> {
    let mut table =
        analysis.config.as_ref().map(|config| config.get_ref().clone()).unwrap_or_default();
    for (key, what, values, given) in added {
        if given && table.insert(key.to_owned(), values.into()).is_some() {
            let message = format!("`{key}` in the configuration is where {what} go");
            return Err(scenario.error(&analysis.name, message));
        }
    }
    let text = toml::to_string(&table).map_err(|error| {
        scenario.error(&analysis.name, format!("the configuration cannot be handed over: {error}"))
    })?;
    let Some(plugin) = plugin else { return Ok(text) };
    let signals =
        wired.iter().map(|Wired { name, unit, .. }| Signal { name, unit, time: &[], values: &[] });
    let request = Request { config: &text, signals: signals.collect() };
    let who = format!("analysis `{}`", analysis.name.get_ref());
    let checked = call_plugin(&who, c"the check of its configuration", || plugin.check(&request));
    let Err(error) = checked else { return Ok(text) };
    findings(scenario, analysis, plugin)?;
    // The plugin may miss a signal whose mistake is told already.
    Err(if sound { refused(scenario, analysis, &error) } else { Error::follow_up() })
}

/// The place of an analysis in the list of them.
fn place_in_list(scenario: &Scenario, analysis: &Analysis) -> String {
    let analyses = &scenario.document.analysis;
    analyses.iter().take_while(|it| !std::ptr::eq(*it, analysis)).count().to_string()
}

/// The words of the configuration that break the plugin's schema, which knows what a misspelt key was meant to be.
fn findings(scenario: &Scenario, analysis: &Analysis, plugin: &Plugin) -> Result<(), Error> {
    let schema = plugin.config_schema().and_then(|text| serde_json::from_str(text).ok());
    let Some(schema) = schema.map(|schema| schema::plain(&schema)) else { return Ok(()) };
    let (name, index) = (analysis.name.get_ref(), place_in_list(scenario, analysis));
    let found = scenario.findings(&["analysis", &index, "config"], &schema).into_iter();
    let errors = found.map(|Finding { span, message, help, .. }| {
        scenario.source.error(span, format!("`{name}`: {message}"), "").hint(help)
    });
    errors.collect::<Mistakes>().finish()
}

/// The error of a plugin that refuses its configuration, at the key that it blames.
fn refused(scenario: &Scenario, analysis: &Analysis, error: &ConfigError) -> Error {
    let (name, index) = (analysis.name.get_ref(), place_in_list(scenario, analysis));
    let keys: Vec<_> = error.path.iter().map(String::as_str).collect();
    let under = |tables: &[&str]| {
        let path = [&["analysis", &index], tables, &keys].concat();
        scenario.place(&path).filter(|(depth, _)| *depth > 2 + tables.len())
    };
    // The key may be that of the configuration, of a file, or of a signal.
    let tables: [&[&str]; 4] = [&["config"], &[], &["signals"], &["table", "columns"]];
    let place = tables.into_iter().find_map(under);
    let span = place.map_or(analysis.name.span(), |(_, span)| span);
    scenario.source.error(span, format!("`{name}`: {}", error.message.trim()), "")
}

/// The largest file of an analysis [B].
const LARGEST_FILE: u64 = 256 << 20;

/// The contents of the files: texts, and what is none as [`plugin::File::value`] has it.
fn files(scenario: &Scenario, analysis: &Analysis) -> Result<toml::Table, Error> {
    let read = |(name, path): (&Spanned<String>, &Spanned<String>)| {
        let file = scenario.source.resolve(path);
        let bytes = diagnostics::read_bounded(&file, LARGEST_FILE).map_err(|error| {
            scenario.error(path, format!("{} cannot be read: {error}", file.display()))
        })?;
        Ok((name.get_ref().clone(), plugin::File::value(bytes)))
    };
    Ok(Mistakes::all(analysis.files.iter().map(read))?.into_iter().collect())
}
