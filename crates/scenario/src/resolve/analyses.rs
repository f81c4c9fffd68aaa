//! Resolves `[[analysis]]`: loads plugins and scripts, connects their signals to columns of the run or of a log, and lets them check
//! their configuration.

mod load;
mod log_signals;

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use diagnostics::{Error, ErrorCollector, SourceFiles, Spanned, suggest};
use expression::SignalUnit;
use fmu_import::call_plugin;
use plugin::{AnalysisRequest, ConfigError, OwnedInputSignal, Plugin, Signal};
use recording::table::ColumnScaling;
use recording::{AllVariables, Columns as RunColumns, NumberIndex};
use units::Unit;

use self::load::LoadedAnalyser;
use super::ResolveDiagnostics;
use super::isolation::IsolationPolicy;
use super::logs;
use super::parameters::ParameterFiles;
use super::signal_units::{RunSignals, unit_help};
use crate::build_request::BuildRequest;
use crate::document::{Analysis, AnalysisSignal, ScaledSignal, Scenario};
use crate::plan::{AnalysisPlan, SignalOrigin, WiredSignal};
use crate::schema::{self, SchemaViolation};

pub(super) fn resolve_analyses(
    scenario: &Scenario,
    plugins: &BTreeMap<BuildRequest, PathBuf>,
    parameters: &ParameterFiles,
    signals: RunSignals,
    policy: IsolationPolicy,
    ResolveDiagnostics { mistakes, warnings }: &mut ResolveDiagnostics,
) -> Vec<AnalysisPlan> {
    let analyses = &scenario.document.analysis;
    let plans = analyses.iter().enumerate().filter_map(|(index, analysis)| {
        mistakes.ok_or_record(check_unique_name(scenario, &analyses[..index], analysis, signals.columns));
        mistakes
            .ok_or_record(plan_analysis(scenario, analysis, plugins, parameters, signals, policy, warnings))
    });
    plans.collect()
}

/// Checks refer to results by the names of analyses.
fn check_unique_name(
    scenario: &Scenario,
    before: &[Analysis],
    analysis: &Analysis,
    columns: &RunColumns<AllVariables>,
) -> Result<(), Error> {
    let name = analysis.name.get_ref();
    let twice = before.iter().any(|other| other.name.get_ref() == name);
    if twice || columns.iter().any(|column| column.node == *name) {
        let message = format!("something else is called `{name}` already");
        return Err(scenario.error_at(&analysis.name, message));
    }
    Ok(())
}

fn plan_analysis(
    scenario: &Scenario,
    analysis: &Analysis,
    plugins: &BTreeMap<BuildRequest, PathBuf>,
    parameters: &ParameterFiles,
    signals: RunSignals,
    policy: IsolationPolicy,
    warnings: &mut Vec<String>,
) -> Result<AnalysisPlan, Error> {
    let mut mistakes = ErrorCollector::default();
    let aliases = match &analysis.table {
        Some(table) => mistakes.ok_or_record(logs::read_aliases(scenario, table.file())),
        None => Some(None),
    };
    let known_aliases = aliases.as_ref().and_then(Option::as_ref);
    let sandbox = mistakes.ok_or_record(load::analysis_sandbox(scenario, analysis, policy)).flatten();
    let analyser = load::load_analyser(scenario, analysis, plugins, known_aliases, sandbox.as_ref());
    let analyser = mistakes.ok_or_record(analyser);
    let needs = analyser.as_ref().map_or(&[][..], |analyser| &analyser.needs);
    let log = match (&analysis.table, &aliases) {
        (Some(table), Some(aliases)) => {
            let is_open = |need: &&OwnedInputSignal| !is_run_signal(analysis, &need.name);
            let open: Vec<OwnedInputSignal> = needs.iter().filter(is_open).cloned().collect();
            let log = log_signals::read_log(scenario, table, aliases.as_ref(), &open, warnings);
            mistakes.ok_or_record(log)
        }
        _ => None,
    };
    let Some(analyser) = analyser else {
        return Err(mistakes.into_result().err().unwrap_or_else(Error::already_reported));
    };
    let mut wired = Vec::new();
    for (name, signal) in &analysis.signals {
        let wire = wire_run_signal(scenario, &analyser, signals, name, signal);
        wired.extend(mistakes.ok_or_record(wire));
    }
    for name in analysis.table.iter().flat_map(|table| table.columns.keys()) {
        let wanted = find_expected_signal(scenario, &analyser, name);
        mistakes.ok_or_record(wanted.and_then(|wanted| refuse_run_signal(scenario, analysis, name, wanted)));
    }
    if let Some(log) = &log {
        wired.extend(log_signals::wire_columns(log, &analyser.needs, &mut mistakes));
    }
    if analysis.table.is_none() || log.is_some() {
        mistakes.ok_or_record(check_required(scenario, analysis, &analyser, &wired));
    }
    let signals = mistakes.into_result();
    let config = added_config_tables(scenario, analysis, parameters).and_then(|extra| {
        analysis_config_text(scenario, analysis, analyser.as_plugin(), extra, &wired, signals.is_ok())
    });
    let ((), config) = ErrorCollector::collect_both(signals, config)?;
    Ok(AnalysisPlan {
        name: analysis.name.get_ref().clone(),
        config,
        analyser: analyser.analyser,
        library: analyser.path,
        sandbox,
        wired,
        log: log.map(|log| log.table),
        expect: analysis.expect,
    })
}

/// A signal of the run, in the unit that the analysis wants.
fn wire_run_signal(
    scenario: &Scenario,
    analyser: &LoadedAnalyser,
    signals: RunSignals,
    name: &Spanned<String>,
    signal: &Spanned<AnalysisSignal>,
) -> Result<WiredSignal, Error> {
    let wanted = find_expected_signal(scenario, analyser, name);
    let source = source_signal(scenario, signal).and_then(|(source, scaling)| {
        Ok((find_number_column(scenario, signals.columns, &source)?, source, scaling))
    });
    let (wanted, (index, source, scaling)) = ErrorCollector::collect_both(wanted, source)?;
    let full = source.name;
    let help = |unit: &str| unit_help(scenario, full, unit);
    let wired =
        wire_signal(wanted, SignalOrigin::Run(index), signals.units.unit_of_signal(full), source, &help)?;
    Ok(apply_scaling(wired, scaling))
}

/// Whether the analysis takes a signal of this name from the run.
fn is_run_signal(analysis: &Analysis, name: &str) -> bool {
    analysis.signals.keys().any(|it| it.get_ref() == name)
}

/// The number that a word names.
fn find_number_column(
    scenario: &Scenario,
    columns: &RunColumns<AllVariables>,
    source: &SourceSignal,
) -> Result<NumberIndex<AllVariables>, Error> {
    if let Some((index, _)) = columns.number_columns().find(|(_, it)| it.qualified_name() == source.name) {
        return Ok(index);
    }
    let names: Vec<_> = columns.number_columns().map(|(_, it)| it.qualified_name()).collect();
    let unknown = suggest::unknown_name("signal", source.name, names.iter().map(String::as_str));
    Err(unknown.into_error_at(&scenario.source, source.span.clone()))
}

/// Refuses a column of a file under the name of a signal of the run.
fn refuse_run_signal<'a>(
    scenario: &Scenario,
    analysis: &Analysis,
    name: &Spanned<String>,
    wanted: &'a OwnedInputSignal,
) -> Result<&'a OwnedInputSignal, Error> {
    if analysis.signals.contains_key(name) {
        let message = format!("`{}` comes from the run already", wanted.name);
        return Err(scenario.error_at(name, message));
    }
    Ok(wanted)
}

/// The signal that the plugin expects under this name.
fn find_expected_signal<'a>(
    scenario: &Scenario,
    analyser: &'a LoadedAnalyser,
    name: &Spanned<String>,
) -> Result<&'a OwnedInputSignal, Error> {
    let known = &analyser.needs;
    if let Some(wanted) = known.iter().find(|wanted| wanted.name == *name.get_ref()) {
        return Ok(wanted);
    }
    let names = known.iter().map(|wanted| wanted.name.as_str());
    let what = match analyser.as_plugin() {
        Some(_) => "signal of the plugin",
        None => "signal of the script",
    };
    let unknown = suggest::unknown_name(what, name.get_ref(), names);
    Err(unknown.into_error_at(&scenario.source, name.span()))
}

/// A signal of the run, and its gain, offset and sign.
fn source_signal<'a>(
    scenario: &'a Scenario,
    signal: &'a Spanned<AnalysisSignal>,
) -> Result<(SourceSignal<'a>, ColumnScaling), Error> {
    let file = &scenario.source;
    match signal.get_ref() {
        AnalysisSignal::Name(name) => {
            Ok((SourceSignal { file, span: signal.span(), name }, ColumnScaling::default()))
        }
        AnalysisSignal::Scaled(ScaledSignal { from, gain, offset, sign }) => {
            let scaling = logs::parse_scaling(file, gain, offset, sign)?;
            Ok((SourceSignal { file, span: from.span(), name: from.get_ref() }, scaling))
        }
    }
}

/// The unit conversion follows gain, offset and sign.
fn apply_scaling(wired: WiredSignal, scaling: ColumnScaling) -> WiredSignal {
    let ColumnScaling { gain, offset, sign } = scaling;
    match scaling == ColumnScaling::default() {
        true => wired,
        false => WiredSignal {
            factor: sign * gain * wired.factor,
            offset: offset * wired.factor + wired.offset,
            ..wired
        },
    }
}

/// A signal that an analysis takes, and where its name stands.
struct SourceSignal<'a> {
    file: &'a SourceFiles,
    span: Range<usize>,
    name: &'a str,
}

impl SourceSignal<'_> {
    fn error_at_name(&self, message: impl Into<String>) -> Error {
        self.file.error_at(self.span.clone(), message, "")
    }

    /// A unit that the signal has or shall have.
    fn parse_unit(&self, unit: &str) -> Result<Unit, Error> {
        Unit::parse(unit).map_err(|error| self.error_at_name(format!("`{}`: {error}", self.name)))
    }
}

/// Converts to the unit that the plugin wants. `help` says where a missing unit is declared.
fn wire_signal(
    wanted: &OwnedInputSignal,
    origin: SignalOrigin,
    unit: SignalUnit,
    source: SourceSignal,
    help: &dyn Fn(&str) -> String,
) -> Result<WiredSignal, Error> {
    let wired = |unit: &str, factor, offset| WiredSignal {
        name: wanted.name.clone(),
        unit: unit.to_owned(),
        origin,
        factor,
        offset,
    };
    let OwnedInputSignal { name, unit: to, .. } = wanted;
    if to.is_empty() {
        let own = if let SignalUnit::Known(_, own) = &unit { own } else { "" };
        return Ok(wired(own, 1.0, 0.0));
    }
    let wanted_unit = source.parse_unit(to)?;
    let signal = source.name;
    match unit {
        SignalUnit::Known(from, own) | SignalUnit::Difference(from, own) => {
            let (factor, offset) = Unit::conversion(&from, &wanted_unit).ok_or_else(|| {
                let message = format!("`{name}` is wanted in [{to}], and `{signal}` is in [{own}]");
                let help = format!("{} is not {}", from.dimension_text(), wanted_unit.dimension_text());
                source.error_at_name(message).with_help(help)
            })?;
            Ok(wired(to, factor, offset))
        }
        SignalUnit::Missing if wanted_unit != Unit::ONE => {
            let message = format!("`{name}` is wanted in [{to}], and `{signal}` has no unit");
            Err(source.error_at_name(message).with_help(help(to)))
        }
        SignalUnit::Missing | SignalUnit::Plain => Ok(wired(to, 1.0, 0.0)),
    }
}

/// Whether the plugin gets all that it cannot do without.
fn check_required(
    scenario: &Scenario,
    analysis: &Analysis,
    analyser: &LoadedAnalyser,
    wired: &[WiredSignal],
) -> Result<(), Error> {
    let from_log = analysis.table.iter().flat_map(|table| table.columns.keys());
    let given: Vec<_> = analysis.signals.keys().chain(from_log).map(Spanned::get_ref).collect();
    let is_wired = |name: &String| wired.iter().any(|it| it.name == *name);
    let missing = analyser.needs.iter();
    let missing = missing.filter(|it| it.required && !given.contains(&&it.name) && !is_wired(&it.name));
    let errors = missing.map(|OwnedInputSignal { name, description, unit, .. }| {
        let message = format!("`{}` needs a signal `{name}`: {description}", analysis.name.get_ref());
        let unit = if unit.is_empty() { String::new() } else { format!(" [{unit}]") };
        scenario.error_at(&analysis.name, message).with_help(format!(
            "add it{unit} to [analysis.signals], such as {name} = \"node.variable\", to the columns of [analysis.table], or to its aliases"
        ))
    });
    errors.collect::<ErrorCollector>().into_result()
}

/// A table that the program adds to the configuration.
struct AddedConfigTable {
    key: &'static str,
    /// What goes there, for messages.
    content: &'static str,
    values: toml::Table,
    /// Whether the scenario asks for it.
    is_given: bool,
}

/// What the configuration gets of other files: contents, and the values of parameters.
fn added_config_tables(
    scenario: &Scenario,
    analysis: &Analysis,
    parameters: &ParameterFiles,
) -> Result<[AddedConfigTable; 2], Error> {
    let contents = read_files(scenario, analysis)?;
    let mut values = toml::Table::new();
    for file in parameters.files_named_by(scenario, &analysis.parameters) {
        values.extend(file.values.iter().map(|it| (it.name.clone(), it.value.clone())));
    }
    Ok([
        AddedConfigTable {
            key: "files",
            content: "the contents of [analysis.files]",
            values: contents,
            is_given: !analysis.files.is_empty(),
        },
        AddedConfigTable {
            key: "parameters",
            content: "the values of the parameters",
            values,
            is_given: !analysis.parameters.is_empty(),
        },
    ])
}

/// The configuration as text, if the plugin agrees to it. Of signals that are not `sound` it hears nothing.
fn analysis_config_text(
    scenario: &Scenario,
    analysis: &Analysis,
    plugin: Option<&Plugin>,
    extra: [AddedConfigTable; 2],
    wired: &[WiredSignal],
    sound: bool,
) -> Result<String, Error> {
    let mut table = analysis.config.as_ref().map(|config| config.get_ref().clone()).unwrap_or_default();
    for AddedConfigTable { key, content, values, is_given } in extra {
        if is_given && table.insert(key.to_owned(), values.into()).is_some() {
            let message = format!("`{key}` in the configuration is where {content} go");
            return Err(scenario.error_at(&analysis.name, message));
        }
    }
    let text = toml::to_string(&table).map_err(|error| {
        scenario.error_at(&analysis.name, format!("the configuration cannot be handed over: {error}"))
    })?;
    let Some(plugin) = plugin else { return Ok(text) };
    let signals =
        wired.iter().map(|WiredSignal { name, unit, .. }| Signal { name, unit, time: &[], values: &[] });
    let request = AnalysisRequest { config: &text, signals: signals.collect() };
    let who = format!("analysis `{}`", analysis.name.get_ref());
    let checked = call_plugin(&who, c"the check of its configuration", || plugin.check_request(&request));
    let Err(error) = checked else { return Ok(text) };
    config_errors(scenario, analysis, plugin)?;
    // The plugin may miss a signal whose mistake is told already.
    Err(if sound { config_error(scenario, analysis, &error) } else { Error::already_reported() })
}

/// The place of an analysis in the list of them.
fn analysis_index(scenario: &Scenario, analysis: &Analysis) -> String {
    let analyses = &scenario.document.analysis;
    analyses.iter().take_while(|it| !std::ptr::eq(*it, analysis)).count().to_string()
}

/// The words of the configuration that break the plugin's schema, which knows what a misspelt key was meant to be.
fn config_errors(scenario: &Scenario, analysis: &Analysis, plugin: &Plugin) -> Result<(), Error> {
    let schema = plugin.config_schema().and_then(|text| serde_json::from_str(text).ok());
    let Some(schema) = schema.map(|schema| schema::normalize_schema(&schema)) else {
        return Ok(());
    };
    let (name, index) = (analysis.name.get_ref(), analysis_index(scenario, analysis));
    let found = scenario.schema_violations(&["analysis", &index, "config"], &schema).into_iter();
    let errors = found.map(|SchemaViolation { span, message, help, .. }| {
        scenario.source.error_at(span, format!("`{name}`: {message}"), "").with_optional_help(help)
    });
    errors.collect::<ErrorCollector>().into_result()
}

/// The error of a plugin that refuses its configuration, at the key that it blames.
fn config_error(scenario: &Scenario, analysis: &Analysis, error: &ConfigError) -> Error {
    let (name, index) = (analysis.name.get_ref(), analysis_index(scenario, analysis));
    let keys: Vec<_> = error.path.iter().map(String::as_str).collect();
    let under = |tables: &[&str]| {
        let path = [&["analysis", &index], tables, &keys].concat();
        scenario.deepest_key_span(&path).filter(|(depth, _)| *depth > 2 + tables.len())
    };
    // The key may be that of the configuration, of a file, or of a signal.
    let tables: [&[&str]; 4] = [&["config"], &[], &["signals"], &["table", "columns"]];
    let found = tables.into_iter().find_map(under);
    let span = found.map_or(analysis.name.span(), |(_, span)| span);
    scenario.source.error_at(span, format!("`{name}`: {}", error.message.trim()), "")
}

/// The largest file of an analysis [B].
const LARGEST_FILE: u64 = 256 << 20;

/// The contents of the files: texts, and what is none as [`plugin::ConfigFile::config_value`] has it.
fn read_files(scenario: &Scenario, analysis: &Analysis) -> Result<toml::Table, Error> {
    let read = |(name, path): (&Spanned<String>, &Spanned<String>)| {
        let file = scenario.source.resolve_path(path);
        let bytes = diagnostics::read_bounded(&file, LARGEST_FILE).map_err(|error| {
            scenario.error_at(path, format!("{} cannot be read: {error}", file.display()))
        })?;
        Ok((name.get_ref().clone(), plugin::ConfigFile::config_value(bytes)))
    };
    Ok(ErrorCollector::collect_all(analysis.files.iter().map(read))?.into_iter().collect())
}
