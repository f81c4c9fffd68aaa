//! Runs the experiments that an archive brings along by the layered standard FMI-LS-REF, and compares with their results.

mod manifest;
mod table;
#[cfg(test)]
mod tests;

use fmu_import::description::{FmiType, Variable};
use fmu_import::{CallError, Causality, Fmu, Instance, Value, Variability};

use super::RuleSeverity::BreaksStandard;
use super::test_driver::{TestDriver, read_variable};
use super::{BOTH, ConformanceRule, RuleCheck, RuleError, RuleResult, not_applicable, violated_rule};
use manifest::{ExperimentFile, ReferenceExperiment};
use table::{CsvTable, parse_value, relative_difference};

pub(super) const RULES: &[ConformanceRule] = &[ConformanceRule {
    name: "reference-results",
    rank: BreaksStandard,
    sentence: "the results in the archive are reproduced",
    versions: BOTH,
    check: RuleCheck::References(check_reference_experiment),
}];

/// By how much of the largest value of its column a real number may differ when the experiment has no tolerance: the layered
/// standard gives none.
const TOLERANCE: f64 = 1e-6;
/// How far a row may be from a communication point, as a share of the step.
const ON_GRID: f64 = 1e-6;

/// How many experiments there are; a manifest that cannot be read counts as one.
pub(super) fn experiment_count(fmu: &Fmu) -> usize {
    manifest::parse_experiments(&|name| fmu.read_archive_entry(name)).map_or(1, |all| all.len())
}

fn check_reference_experiment(driver: &TestDriver, which: usize) -> RuleResult {
    let fmu = driver.library.fmu();
    let all =
        manifest::parse_experiments(&|name| fmu.read_archive_entry(name)).map_err(RuleError::Violated)?;
    let Some(experiment) = all.get(which) else {
        return not_applicable("there are no references (FMI-LS-REF) in the archive");
    };
    let of = |what: String| format!("{}: {what}", experiment.name);
    match run_experiment(driver, experiment) {
        Ok(detail) => Ok(of(detail)),
        Err(RuleError::Violated(what)) => Err(RuleError::Violated(of(what))),
        Err(RuleError::NotApplicable(why)) => Err(RuleError::NotApplicable(of(why))),
    }
}

/// A table, and the variables of its columns.
struct TableSignals<'a> {
    table: CsvTable,
    columns: Vec<TableColumn<'a>>,
}

/// A column with the elements of the variable that it is about: all, or one.
struct TableColumn<'a> {
    place: usize,
    elements: Vec<&'a Variable>,
    /// The largest number of the column.
    scale: f64,
}

fn run_experiment(driver: &TestDriver, experiment: &ReferenceExperiment) -> RuleResult {
    let Some(results) = load_signals(driver, experiment.results.as_ref())? else {
        return not_applicable("the experiment has no results to compare with");
    };
    let stimuli = load_signals(driver, experiment.stimuli.as_ref())?;
    let about = driver.description();
    let tolerance = experiment.tolerance.or(about.default_tolerance);
    let times = &results.table.times;
    let (first, last) = (times[0], times[times.len() - 1]);
    let mut instance = driver.new_instance()?;
    if let Some(source) = &experiment.parameters {
        let values = manifest::parse_parameter_set(&experiment_file_bytes(driver, source)?);
        let values = values.map_err(|what| RuleError::Violated(format!("{}: {what}", source.name)))?;
        set_parameters(driver, &mut instance, &values)?;
    }
    let mut walk = ResultComparison {
        driver,
        results: &results,
        stimuli: stimuli.as_ref(),
        step: experiment.step.or(driver.asked_step),
        now: experiment.start.unwrap_or(first),
        tick: 0,
        tolerance: tolerance.unwrap_or(TOLERANCE),
        largest: 0.0,
    };
    let stop = experiment.stop.unwrap_or(last).max(last);
    instance.setup_experiment(walk.now, stop, tolerance)?;
    instance.enter_initialization()?;
    walk.set_stimuli(&mut instance)?;
    instance.exit_initialization()?;
    let compared = walk.compare_all_rows(&mut instance)?;
    match compared {
        0 => violated_rule("no row of the results is at a communication point"),
        rows => {
            Ok(format!("{rows} of {} rows, largest relative difference {:.1e}", times.len(), walk.largest))
        }
    }
}

/// The layered standard asks importers to be prepared for files that are not there.
fn experiment_file_bytes(driver: &TestDriver, source: &ExperimentFile) -> Result<Vec<u8>, RuleError> {
    let absent = || format!("the manifest names {:?}, which is not in the archive", source.name);
    driver.library.fmu().read_archive_entry(&source.path).ok_or_else(|| RuleError::NotApplicable(absent()))
}

fn load_signals<'a>(
    driver: &'a TestDriver,
    source: Option<&ExperimentFile>,
) -> Result<Option<TableSignals<'a>>, RuleError> {
    let Some(source) = source else { return Ok(None) };
    if source.kind != "text/csv" {
        let ExperimentFile { name, kind, .. } = source;
        return not_applicable(format!("{name} is of the type {kind}: expected text/csv"));
    }
    let wrong = |what: String| RuleError::Violated(format!("{}: {what}", source.name));
    let table = CsvTable::parse(&experiment_file_bytes(driver, source)?).map_err(wrong)?;
    let mut columns = Vec::new();
    for (place, title) in table.titles.iter().enumerate().skip(1) {
        let elements = variable_elements(driver, title);
        if elements.is_empty() {
            return violated_rule(format!("{}: no variable is called {title:?}", source.name));
        }
        let mut scale = 0.0;
        for row in 0..table.times.len() {
            let words = table.cell_words(row, place, elements[0].kind);
            if words.len() != elements.len() {
                let (line, expected, found) = (row + 2, elements.len(), words.len());
                return violated_rule(format!(
                    "{}:{line}: expected {expected} values of `{title}`, found {found}",
                    source.name
                ));
            }
            for word in words {
                match parse_value(word, elements[0].kind) {
                    Some(Value::Real(number)) => scale = f64::max(scale, number.abs()),
                    Some(_) => {}
                    None => {
                        let kind = elements[0].kind;
                        let line = row + 2;
                        return violated_rule(format!(
                            "{}:{line}: expected a {kind:?} for `{title}`, found {word:?}",
                            source.name
                        ));
                    }
                }
            }
        }
        columns.push(TableColumn { place, elements, scale });
    }
    Ok(Some(TableSignals { table, columns }))
}

/// The elements of the variable with this name: of an array, all.
fn variable_elements<'a>(driver: &'a TestDriver, title: &str) -> Vec<&'a Variable> {
    let variables = &driver.description().variables;
    let base = |variable: &Variable| variable.name.rfind('[').map(|end| variable.name[..end].to_owned());
    let array = |it: &&Variable| it.element.1 > 1 && base(it).as_deref() == Some(title);
    match variables.iter().find(|it| it.name == title) {
        Some(variable) => vec![variable],
        None => variables.iter().filter(array).collect(),
    }
}

fn set_parameters(
    driver: &TestDriver,
    instance: &mut Instance,
    values: &[(String, String)],
) -> Result<(), RuleError> {
    for (name, text) in values {
        let elements = variable_elements(driver, name);
        let Some(first) = elements.first() else {
            return violated_rule(format!("no variable is called {name:?}, a parameter of the experiment"));
        };
        let words: Vec<_> = match first.kind {
            FmiType::String => vec![text.as_str()],
            _ => text.split_whitespace().collect(),
        };
        let found: Option<Vec<_>> = words.iter().map(|word| parse_value(word, first.kind)).collect();
        let found = found.filter(|found| found.len() == first.element.1);
        let Some(found) = found else {
            let count = first.element.1;
            let kind = first.kind;
            return violated_rule(format!(
                "expected {count} values of type {kind:?} for {name:?}, found {text:?}"
            ));
        };
        driver.note_progress(&format!("setting the parameter `{name}`"));
        if first.causality == Causality::StructuralParameter {
            instance
                .set_in_configuration_mode(|it| it.write_variable(first.storage, first.reference, &found))?;
        } else {
            instance.write_variable(first.storage, first.reference, &found)?;
        }
    }
    Ok(())
}

/// The way through the rows of the results.
struct ResultComparison<'a> {
    driver: &'a TestDriver<'a>,
    results: &'a TableSignals<'a>,
    stimuli: Option<&'a TableSignals<'a>>,
    /// The communication step; without one, steps go from row to row [s].
    step: Option<f64>,
    /// Where the FMU is [s].
    now: f64,
    tick: u32,
    tolerance: f64,
    largest: f64,
}

impl ResultComparison<'_> {
    /// Goes to the last row, and counts those that were compared.
    fn compare_all_rows(&mut self, instance: &mut Instance) -> Result<usize, RuleError> {
        let (start, rows) = (self.now, self.results.table.times.len());
        let mut compared = 0;
        for row in 0..rows {
            let time = self.results.table.times[row];
            let near = self.step.unwrap_or(time - self.now).abs() * ON_GRID;
            let mut ended = false;
            while !ended && time - self.now > near {
                self.tick += 1;
                let next = self.step.map_or(time, |step| start + f64::from(self.tick) * step);
                self.set_stimuli(instance)?;
                match self.driver.do_step(instance, self.now, next - self.now) {
                    Err(CallError { terminated: Some(reached), .. }) => (self.now, ended) = (reached, true),
                    step => (self.now, ended) = step.map(|()| (next, false))?,
                }
            }
            if (time - self.now).abs() <= near {
                self.compare_row(instance, row)?;
                compared += 1;
            }
            if ended && row + 1 < rows {
                let last = self.results.table.times[rows - 1];
                return violated_rule(format!("the FMU ends at t = {} s, the results at {last} s", self.now));
            }
        }
        Ok(compared)
    }

    /// Sets the inputs to the stimuli of now: continuous ones lie on lines between two rows, the others keep what came last.
    fn set_stimuli(&self, instance: &mut Instance) -> Result<(), CallError> {
        let Some(TableSignals { table, columns }) = self.stimuli else { return Ok(()) };
        let row = table.row_at(self.now);
        let next = (row + 1).min(table.times.len() - 1);
        let [from, to] = [row, next].map(|row| table.times[row]);
        let share = if to > from { ((self.now - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
        for TableColumn { place, elements, .. } in columns {
            let first = elements[0];
            let values = |row| {
                table
                    .cell_words(row, *place, first.kind)
                    .into_iter()
                    .filter_map(|word| parse_value(word, first.kind))
            };
            let linear = first.kind == FmiType::Real && first.variability == Variability::Continuous;
            let between = |(a, b): (Value, Value)| match (a, b) {
                (Value::Real(a), Value::Real(b)) if linear => Value::Real(a + share * (b - a)),
                (a, _) => a,
            };
            let fed: Vec<_> = values(row).zip(values(next)).map(between).collect();
            let fed = match elements.len() == first.element.1 {
                true => fed,
                // One element of an array: the others stay.
                false => {
                    let mut whole = read_variable(instance, first)?;
                    for (element, value) in elements.iter().zip(fed) {
                        if let Some(place) = whole.get_mut(element.element.0) {
                            *place = value;
                        }
                    }
                    whole
                }
            };
            instance.write_variable(first.storage, first.reference, &fed)?;
        }
        Ok(())
    }

    fn compare_row(&mut self, instance: &mut Instance, row: usize) -> Result<(), RuleError> {
        let (table, time) = (&self.results.table, self.now);
        for TableColumn { place, elements, scale } in &self.results.columns {
            let first = elements[0];
            let found = read_variable(instance, first)?;
            for (element, word) in elements.iter().zip(table.cell_words(row, *place, first.kind)) {
                let expected = parse_value(word, first.kind);
                let Some((expected, found)) = expected.zip(found.get(element.element.0)) else {
                    continue;
                };
                let difference = relative_difference(word, &expected, found, *scale);
                if difference > self.tolerance {
                    return violated_rule(format!(
                        "expected `{}` = {expected} at t = {time} s, found {found}",
                        element.name
                    ));
                }
                self.largest = self.largest.max(difference);
            }
        }
        Ok(())
    }
}
