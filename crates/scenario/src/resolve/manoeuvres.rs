//! Resolves `[[manoeuvre]]` to driver nodes, their connections to the car, and the analyses of characteristic values.

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use assessment::ResultName;
use cosim::effect::stream_seed;
use cosim::system::{DriverPlan, NodeBody, NodePlan};
use diagnostics::{Error, ErrorCollector, Spanned, suggest};
use manoeuvre::{CommonParameters, DriverOutputInfo, Manoeuvre, ParameterError};
use recording::{AllVariables, Columns, NumberIndex};
use units::Unit;

use super::RunSettings;
use super::lookup::{PortSide, find_port};
use super::node_draft::{NodeDraft, PortNames};
use super::ports::Port;
use crate::document::{self, Connect, Scenario};
use crate::plan::{Analyser, AnalysisPlan, SignalOrigin, WiredSignal};

/// The drivers of all manoeuvres.
pub(super) fn resolve_drivers(
    scenario: &Scenario,
    run: RunSettings,
    mistakes: &mut ErrorCollector,
) -> Vec<NodeDraft> {
    let words = scenario.document.manoeuvre.iter().enumerate();
    let drivers = words.filter_map(|(index, word)| {
        mistakes.ok_or_record(check_unique_name(scenario, index, word));
        mistakes.ok_or_record_named(word.driver_node_name(), build_driver_node(scenario, word, run))
    });
    drivers.collect()
}

/// Checks refer to the values by the names of manoeuvres.
fn check_unique_name(scenario: &Scenario, index: usize, word: &document::Manoeuvre) -> Result<(), Error> {
    let (name, document) = (word.name.get_ref(), &scenario.document);
    let before = document.manoeuvre[..index].iter().map(|other| other.name.get_ref().as_str());
    let drivers = document.manoeuvre.iter().map(document::Manoeuvre::driver_node_name);
    let fmus = document.fmu.iter().map(|fmu| fmu.name.get_ref().as_str());
    let analyses = document.analysis.iter().map(|other| other.name.get_ref().as_str());
    if before.chain(drivers).chain(fmus).chain(analyses).any(|other| other == name) {
        let message = format!("something else is called `{name}` already");
        let help = "a manoeuvre and its driver have a name each: the values are of the manoeuvre";
        return Err(scenario.error_at(&word.name, message).with_help(help));
    }
    Ok(())
}

/// The driver of a manoeuvre, whose inputs are not connected yet.
fn build_driver_node(
    scenario: &Scenario,
    word: &document::Manoeuvre,
    run: RunSettings,
) -> Result<NodeDraft, Error> {
    let kinds = word.kinds();
    let [(key, kind)] = kinds.as_slice() else {
        let known = document::Manoeuvre::KINDS.join("`, `");
        let message = match kinds.as_slice() {
            [_, (second, _), ..] => {
                format!("expected one kind of manoeuvre, found `{}` and `{second}`", kinds[0].0)
            }
            _ => "no kind of manoeuvre: there is nothing to drive".to_owned(),
        };
        let at = kinds.get(1).map_or(word.name.span(), |(_, kind)| kind.span());
        let help = format!("give it one of `{known}`, such as step_steer = {{ amplitude = 0.02 }}");
        return Err(scenario.source.error_at(at, message, "").with_help(help));
    };
    let clock = run.clock.ok_or_else(Error::already_reported)?;
    let number = |word: &Option<Spanned<f64>>, usual| word.as_ref().map_or(usual, |it| *it.get_ref());
    let common = CommonParameters {
        entry_speed: *word.entry_speed.get_ref(),
        speed_tolerance: number(&word.speed_tolerance, 0.3),
        settle: number(&word.settle, 1.0),
        direction: word.direction,
        wheelbase: word.wheelbase.as_ref().map(|it| *it.get_ref()),
        speed_controller: word.speed_controller.as_ref().map(|it| *it.get_ref()).unwrap_or_default(),
        path_follower: word.path_follower.as_ref().map(|it| *it.get_ref()).unwrap_or_default(),
        step: clock.step,
        seed: stream_seed(run.seed, word.name.get_ref()),
    };
    let manoeuvre = Arc::new(Manoeuvre { common, kind: Arc::clone(kind.get_ref()) });
    let wrong = |wrong: ParameterError| {
        let span = parameter_error_span(scenario, word, kind, &wrong);
        scenario.source.error_at(span, format!("`{key}`: {}", wrong.message), "")
    };
    let steering_ratio = steering_ratio(scenario, word);
    let ((), steering_ratio) =
        ErrorCollector::collect_both(manoeuvre.check_parameters().map_err(wrong), steering_ratio)?;
    let inputs = manoeuvre.kind.required_channels().into_iter();
    let inputs = inputs.map(|it| driver_port(it.variable_name(), it.unit_name(), it.description())).collect();
    let outputs = DriverPlan::output_descriptions()
        .map(|DriverOutputInfo { name, unit, about }| driver_port(name, unit, about));
    Ok(NodeDraft {
        name: word.driver_node_name().to_owned(),
        body: NodeBody::Driver(DriverPlan { manoeuvre, steering_ratio }),
        outputs: outputs.collect(),
        inputs,
        started_inputs: Vec::new(),
        span: word.driver_or_name().span(),
        port_names: PortNames::default(),
    })
}

fn steering_ratio(scenario: &Scenario, word: &document::Manoeuvre) -> Result<f64, Error> {
    let Some(word) = &word.steering_ratio else { return Ok(1.0) };
    let ratio = *word.get_ref();
    if ratio.is_finite() && ratio != 0.0 {
        return Ok(ratio);
    }
    let message = format!("expected a steering ratio other than 0, found {ratio}");
    Err(scenario.error_at(word, message))
}

/// The place of a wrong number: its own, or that of the table which it is in.
fn parameter_error_span(
    scenario: &Scenario,
    word: &document::Manoeuvre,
    kind: &Spanned<Arc<dyn manoeuvre::kind::ManoeuvreKind>>,
    wrong: &ParameterError,
) -> Range<usize> {
    let numbers = [
        ("entry_speed", Some(&word.entry_speed)),
        ("speed_tolerance", word.speed_tolerance.as_ref()),
        ("settle", word.settle.as_ref()),
        ("wheelbase", word.wheelbase.as_ref()),
    ];
    let own = numbers.into_iter().find(|(key, _)| *key == wrong.key && !wrong.of_kind);
    let gains = match wrong.key {
        "speed_controller" => word.speed_controller.as_ref().map(Spanned::span),
        "path_follower" => word.path_follower.as_ref().map(Spanned::span),
        _ => None,
    };
    let table = kind.span();
    let own = own.and_then(|(_, word)| Some(word?.span())).or(gains.filter(|_| !wrong.of_kind));
    own.unwrap_or_else(|| {
        span_in_table(scenario.source.text_at(table.clone()), wrong.key, table.start).unwrap_or(table)
    })
}

/// The place of the value of a key in the letters of a table, which begin at `start`.
fn span_in_table(letters: &str, key: &str, start: usize) -> Option<Range<usize>> {
    let (before, after) = letters.split_once(key)?;
    let value = after.trim_start().strip_prefix('=')?.trim_start();
    let begin = letters.len() - value.len();
    let length = value.find([',', '}', '\n']).unwrap_or(value.len());
    let alone = !before.ends_with(|letter: char| letter.is_alphanumeric() || letter == '_');
    alone.then(|| start + begin..start + begin + value[..length].trim_end().len())
}

fn driver_port(name: &str, unit: &str, about: &str) -> Port {
    let description = Some(about.to_owned());
    let dimension = Unit::parse(unit).ok();
    Port { description, ..Port::real_port(name, Some(unit.to_owned()), dimension) }
}

/// Connections from the cars to their drivers, but for inputs that have connections of their own.
pub(super) fn measurement_connections(
    scenario: &Scenario,
    nodes: &[NodeDraft],
    connects: &[Connect],
    mistakes: &mut ErrorCollector,
) -> Vec<Connect> {
    let mut all = Vec::new();
    for word in &scenario.document.manoeuvre {
        let Some(car) = &word.car else { continue };
        let driver = nodes.iter().find(|node| node.name == word.driver_node_name());
        for input in driver.into_iter().flat_map(|node| &node.inputs) {
            let to = format!("{}.{}", word.driver_node_name(), input.name);
            if connects.iter().any(|connect| *connect.to.get_ref() == to) {
                continue;
            }
            let at = |name: String| Spanned::new(car.span(), name);
            let from = at(format!("{}.{}", car.get_ref(), input.name));
            match find_port(scenario, nodes, &from, PortSide::Output) {
                Ok(_) => all.push(Connect::plain(from, at(to))),
                Err(error) => {
                    let (about, unit) = (input.description.as_deref(), input.unit.as_deref());
                    let [about, unit] = [about, unit].map(Option::unwrap_or_default);
                    let help = format!(
                        "the driver measures the {about} [{unit}]: connect another output to it: [[connect]] to = \"{to}\""
                    );
                    let known = nodes.iter().any(|node| node.name == *car.get_ref());
                    mistakes.push(if known { error.with_help(help) } else { error });
                    if !known {
                        break;
                    }
                }
            }
        }
    }
    all
}

/// Whether a node is a driver who has a car to measure.
pub(super) fn is_driver_with_car(scenario: &Scenario, node: &str) -> bool {
    let mut words = scenario.document.manoeuvre.iter();
    words.any(|word| word.car.is_some() && word.driver_node_name() == node)
}

/// The analyses of what the drivers did.
pub(super) fn manoeuvre_analyses(
    scenario: &Scenario,
    nodes: &[NodePlan],
    columns: &Columns<AllVariables>,
) -> Vec<AnalysisPlan> {
    let words = scenario.document.manoeuvre.iter();
    let plans = words.filter_map(|word| {
        let node = nodes.iter().find(|node| node.name == word.driver_node_name())?;
        let NodeBody::Driver(DriverPlan { manoeuvre, .. }) = &node.body else { return None };
        let named = |name: &str| node.outputs.indices().find(|index| columns[*index].variable == name);
        let commands: Option<Vec<_>> = ["steer", "drive", "phase"].into_iter().map(named).collect();
        let signals = commands?.into_iter().chain(node.inputs.indices());
        let wired = |index: NumberIndex<AllVariables>| WiredSignal {
            name: columns[index].variable.clone(),
            unit: columns[index].unit.clone().unwrap_or_default(),
            origin: SignalOrigin::Run(index),
            factor: 1.0,
            offset: 0.0,
        };
        Some(AnalysisPlan {
            name: word.name.get_ref().clone(),
            analyser: Analyser::Manoeuvre(Arc::clone(manoeuvre)),
            library: PathBuf::new(),
            sandbox: None,
            config: String::new(),
            wired: signals.map(wired).collect(),
            log: None,
            expect: None,
        })
    });
    plans.collect()
}

/// Refuses the name of a value that a manoeuvre does not give. What is wrong with the manoeuvre itself is told elsewhere.
///
/// # Errors
/// At the word that has the name.
pub(super) fn check_result_names(
    scenario: &Scenario,
    results: &[ResultName],
    at: &Spanned<String>,
) -> Result<(), Error> {
    for ResultName { of, path, .. } in results {
        let words = &scenario.document.manoeuvre;
        let Some(word) = words.iter().find(|word| word.name.get_ref() == of) else { continue };
        let [(_, kind)] = &word.kinds()[..] else { return Err(Error::already_reported()) };
        let first = path.split(['.', '[']).next().unwrap_or(path);
        let known = kind.get_ref().value_descriptions().iter().map(|it| it.name);
        if !known.clone().any(|name| name == first) {
            let unknown = suggest::unknown_name(&format!("value of `{of}`"), first, known);
            return Err(unknown.into_error_at(&scenario.source, at.span()));
        }
    }
    Ok(())
}
