//! Lists what differs between the inputs of two runs, each difference with what puts it from B into A.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cosim::system::{Algorithm, NodeBody, StartValue};
use fmu_import::{Fmu, Value as FmuValue};
use scenario::OverrideValue;
use scenario::plan::RunPlan;
use scenario::resolve::Override;
use serde::Serialize;
use toml::Value;

use crate::archive_comparison::{StartDifference, compare_archives};
use crate::file_comparison::{describe_content_change, describe_text_change};
use crate::run_inputs::{FILES, FMUS, RecordedOverrides, RunInputs};
use crate::toml_difference::{
    KeyPath, KeyStep, ValueDifference, display_value, set_value, table_differences,
};

/// Letters of a number that is shown as it is written.
const LONGEST_NUMBER: usize = 9;

/// What kind of input differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DifferenceKind {
    /// A start value of an FMU, a parameter among them.
    StartValue,
    /// The archive of an FMU.
    Archive,
    /// A node that only one of them has, or another key of a node.
    Node,
    /// A connection, or what happens to a value on its way.
    Connection,
    /// A generated signal.
    Signal,
    /// A file that a run reads: a table, a log.
    File,
    /// Communication step, duration, tolerance.
    Time,
    /// The coupling algorithm, or its settings.
    Coupling,
    /// The seed of the random streams.
    Seed,
    /// A fault.
    Fault,
    /// The order of the nodes in the scenario.
    Order,
    /// A check, a baseline, an analysis: what judges a run, and changes none of its values.
    Judgement,
    /// A title, the layout of the replay.
    Presentation,
    /// The version of the program, of a plugin, or the machine.
    Software,
}

/// The part of the system on which a difference acts first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DifferenceScope {
    /// A node.
    Node(String),
    /// The connection to an input, `node.variable`.
    Connection(String),
    /// All of it.
    System,
    /// Nothing that is simulated.
    None,
}

/// What differs between the inputs of two runs.
#[derive(Debug, Clone, Serialize)]
pub struct Difference {
    /// Its number.
    pub id: usize,
    /// What kind of input it is.
    pub kind: DifferenceKind,
    /// What it is: `plant.body.m`, `fmu.plant`, `time.step`.
    pub place: String,
    /// The value of A.
    pub a: String,
    /// That of B.
    pub b: String,
    /// The unit of both.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// What differs inside, of an archive or a file.
    pub details: Vec<String>,
    /// Where it acts first.
    #[serde(skip)]
    pub scope: DifferenceScope,
    /// What puts it into A; none of what changes no value.
    #[serde(skip)]
    pub(crate) swap: Option<InputSwap>,
}

impl Difference {
    /// Two values of an input; without a unit, and with nothing inside that differs.
    fn new(
        kind: DifferenceKind,
        place: impl Into<String>,
        [a, b]: [String; 2],
        scope: DifferenceScope,
        swap: Option<InputSwap>,
    ) -> Self {
        Difference { id: 0, kind, place: place.into(), a, b, unit: None, details: Vec::new(), scope, swap }
    }

    /// Another version of the program, of a plugin, or another machine.
    pub(crate) fn of_software(place: &str, values: [String; 2]) -> Self {
        Difference::new(DifferenceKind::Software, place, values, DifferenceScope::None, None)
    }

    /// The values of A and B with their unit; of an archive or a file, what differs inside as that of B.
    #[must_use]
    pub fn values_of_both(&self) -> [String; 2] {
        let unit = unit_suffix(self.unit.as_ref());
        match self.a.is_empty() && self.b.is_empty() {
            true => [String::new(), self.details.join("; ")],
            false => self.value_texts().map(|value| value + &unit),
        }
    }

    /// `plant.body.m: 780 kg -> 820 kg`.
    #[must_use]
    pub fn sentence(&self) -> String {
        let unit = unit_suffix(self.unit.as_ref());
        let Difference { place, a, b, .. } = self;
        let [value_a, value_b] = self.value_texts();
        match (self.details.as_slice(), a.is_empty() && b.is_empty()) {
            ([], _) => format!("{place}: {value_a}{unit} -> {value_b}{unit}"),
            (details, true) => format!("{place}: {}", details.join("; ")),
            (details, false) => {
                format!("{place}: {value_a}{unit} -> {value_b}{unit} ({})", details.join("; "))
            }
        }
    }

    /// The values as people read them: numbers of many digits in as many as tell them apart.
    fn value_texts(&self) -> [String; 2] {
        let is_long = |text: &String| text.len() > LONGEST_NUMBER;
        match (self.a.parse::<f64>(), self.b.parse::<f64>()) {
            (Ok(a), Ok(b)) if is_long(&self.a) || is_long(&self.b) => {
                units::display::distinct_number_texts(a, b)
            }
            _ => [self.a.clone(), self.b.clone()],
        }
    }
}

/// A unit behind a number; nothing for a number without one.
pub(crate) fn unit_suffix(unit: Option<&String>) -> String {
    units::display::unit_suffix(unit.map(String::as_str))
}

/// What puts a difference from B into A.
#[derive(Debug, Clone)]
pub(crate) enum InputSwap {
    /// A value of the scenario, with paths of B.
    Value(KeyPath, Option<Value>),
    /// A value from outside: it goes before those of the scenario; none takes away that of A.
    Override(String, Option<OverrideValue>),
    /// The archive of a node. Its own start values that A does not set stay those of A, unless they are put in by themselves.
    Archive { node: String, path: String, starts_of_a: Vec<(String, OverrideValue)> },
    /// The seed.
    Seed(u64),
    /// The tolerance from outside of the scenario.
    Tolerance(Option<f64>),
    /// The coupling algorithm from outside of the scenario.
    Coupling(Option<Algorithm>),
    /// The order of the entries of a list, by their names.
    Order(String, Vec<String>),
}

/// The inputs of one of two runs, with its plan.
#[derive(Clone, Copy)]
pub(crate) struct PlannedInputs<'a> {
    pub inputs: &'a RunInputs,
    pub plan: &'a RunPlan,
}

/// Lists what differs. Paths of files in values of B begin with `b/`, in those of A with `a/`.
pub(crate) fn list_differences(a: PlannedInputs, b: PlannedInputs) -> Vec<Difference> {
    let mut list = DifferenceList { differences: Vec::new(), a, b };
    list.add_nodes();
    list.add_overrides();
    list.add_settings();
    list.add_values();
    list.add_order();
    list.differences
}

/// What differs between the scenarios of two runs of which one was not kept with its files: values alone.
pub(crate) fn list_value_differences(a: &toml::Table, b: &toml::Table) -> Vec<Difference> {
    let found = table_differences(a, b);
    found.iter().map(|found| value_difference(found, None, Vec::new())).collect()
}

struct DifferenceList<'a> {
    differences: Vec<Difference>,
    a: PlannedInputs<'a>,
    b: PlannedInputs<'a>,
}

impl DifferenceList<'_> {
    fn push(&mut self, difference: Difference) {
        self.differences.push(Difference { id: self.differences.len(), ..difference });
    }

    /// The archives and start values of the FMUs that both have.
    fn add_nodes(&mut self) {
        for node in &self.a.plan.system.nodes {
            let other = self.b.plan.system.nodes.iter().find(|it| it.name == node.name);
            let (NodeBody::Fmu { fmu, starts, .. }, Some(NodeBody::Fmu { fmu: fmu_b, starts: starts_b, .. })) =
                (&node.body, other.map(|it| &it.body))
            else {
                continue;
            };
            let archives = compare_archives(fmu, fmu_b);
            let own = |variable: &String| archives.starts.iter().any(|it| it.variable == *variable);
            if fmu.sha256 != fmu_b.sha256 && (!archives.details.is_empty() || archives.starts.is_empty()) {
                let pinned = archives.starts.iter().filter_map(|it| pinned_start(fmu, it));
                let starts_of_a =
                    pinned.filter(|(name, _)| starts.iter().all(|it| it.name != *name)).collect();
                let path = fmu_b.path.to_string_lossy().into_owned();
                let swap = InputSwap::Archive { node: node.name.clone(), path, starts_of_a };
                let scope = DifferenceScope::Node(node.name.clone());
                let place = format!("fmu.{}", node.name);
                let archive =
                    Difference::new(DifferenceKind::Archive, place, Default::default(), scope, Some(swap));
                self.push(Difference { details: archives.details.clone(), ..archive });
            }
            let mut names: BTreeSet<String> =
                starts.iter().chain(starts_b).map(|it| it.name.clone()).collect();
            names.extend(archives.starts.iter().map(|it| it.variable.clone()));
            for name in names {
                let (value_a, value_b) =
                    (effective_start(fmu, starts, &name), effective_start(fmu_b, starts_b, &name));
                let (Some(value_a), Some(value_b)) = (value_a, value_b) else { continue };
                if value_a != value_b {
                    self.add_start(&node.name, fmu, &name, &value_a, &value_b, own(&name));
                }
            }
        }
    }

    fn add_start(&mut self, node: &str, fmu: &Fmu, name: &str, a: &FmuValue, b: &FmuValue, own: bool) {
        let unit = fmu
            .description
            .find_variable(name)
            .and_then(|index| fmu.description.variables[index].unit.clone());
        let (values, mut details) = match (a, b) {
            (FmuValue::String(a), FmuValue::String(b)) if a.contains('\n') || b.contains('\n') => {
                (Default::default(), describe_text_change(a, b))
            }
            (a, b) => ([a, b].map(display_fmu_value), Vec::new()),
        };
        if own {
            details.push("a start value of the FMU itself".to_owned());
        }
        let place = format!("{node}.{name}");
        let swap = InputSwap::Override(place.clone(), override_value(b));
        let scope = DifferenceScope::Node(node.to_owned());
        let start = Difference::new(DifferenceKind::StartValue, place, values, scope, Some(swap));
        self.push(Difference { unit, details, ..start });
    }

    /// Words about signals, effects and faults from outside of the scenario.
    fn add_overrides(&mut self) {
        let edits = |inputs: PlannedInputs| -> BTreeMap<String, OverrideValue> {
            let starts = inputs.inputs.overrides.starts.iter();
            let edits = starts.filter(|it| !is_start_of_fmu(inputs.plan, it) && it.variable_name() != "path");
            edits.map(|it| (it.name.clone(), it.value.clone())).collect()
        };
        let (of_a, of_b) = (edits(self.a), edits(self.b));
        let names: BTreeSet<_> = of_a.keys().chain(of_b.keys()).cloned().collect();
        for name in names.into_iter().filter(|name| of_a.get(name) != of_b.get(name)) {
            let text = |value: Option<&OverrideValue>| {
                value.map_or("as in the scenario".to_owned(), ToString::to_string)
            };
            let node = name.split('.').next().unwrap_or_default().to_owned();
            let values = [text(of_a.get(&name)), text(of_b.get(&name))];
            let swap = InputSwap::Override(name.clone(), of_b.get(&name).cloned());
            let scope = DifferenceScope::Node(node);
            self.push(Difference::new(DifferenceKind::Signal, name, values, scope, Some(swap)));
        }
    }

    /// The seed, the tolerance and the coupling algorithm.
    fn add_settings(&mut self) {
        let [a, b] = [self.a, self.b].map(|it| it.plan.header.seed);
        if a != b {
            let values = [a, b].map(|seed| seed.to_string());
            self.push_setting(DifferenceKind::Seed, "seed", values, InputSwap::Seed(b));
        }
        let [a, b] = [self.a, self.b].map(|it| &it.inputs.overrides);
        let as_in_scenario = || "as in the scenario".to_owned();
        if a.tolerance != b.tolerance {
            let values = [a, b].map(|it| it.tolerance.map_or_else(as_in_scenario, |value| value.to_string()));
            let swap = InputSwap::Tolerance(b.tolerance);
            self.push_setting(DifferenceKind::Time, "time.tolerance", values, swap);
        }
        if a.coupling != b.coupling {
            let values = [a, b].map(|it| it.coupling.map_or_else(as_in_scenario, |word| format!("{word:?}")));
            let swap = InputSwap::Coupling(b.coupling);
            self.push_setting(DifferenceKind::Coupling, "coupling.algorithm", values, swap);
        }
    }

    fn push_setting(&mut self, kind: DifferenceKind, place: &str, values: [String; 2], swap: InputSwap) {
        self.push(Difference::new(kind, place, values, DifferenceScope::System, Some(swap)));
    }

    /// What stands differently in the scenarios, but for what the plans tell better: archives and start values.
    fn add_values(&mut self) {
        let (a, b) = (&self.a.inputs.table, &self.b.inputs.table);
        for found in table_differences(a, b) {
            let key = found.path.entry_and_key().map(|(_, key)| key.to_owned());
            let of_fmu = found.path.root() == "fmu";
            if found.path.root() == "seed"
                || (of_fmu && key.is_some_and(|it| ["start", "parameters", "path"].contains(&it.as_str())))
            {
                continue;
            }
            let root_a = self.a.inputs.folder.folder_path();
            let root_b = self.b.inputs.folder.folder_path();
            let content = |root: &Path, value: &Option<Value>| {
                let file = value.as_ref().and_then(Value::as_str).filter(|it| it.starts_with(FILES))?;
                std::fs::read(root.join(file)).ok()
            };
            let details = match (content(root_a, &found.a), content(root_b, &found.b)) {
                (Some(a), Some(b)) if a == b => continue,
                (Some(a), Some(b)) => describe_content_change(&a, &b),
                _ => Vec::new(),
            };
            let mut value = found.b.clone();
            value.iter_mut().for_each(|value| prefix_paths(value, "b/"));
            let difference = value_difference(&found, value, details);
            self.push(difference);
        }
        self.add_files_of_one_name();
    }

    /// Files that the scenarios name in the same way, and whose contents differ.
    fn add_files_of_one_name(&mut self) {
        let mut paths = Vec::new();
        list_files(&Value::Table(self.a.inputs.table.clone()), &KeyPath(Vec::new()), &mut paths);
        let [root_a, root_b] = [self.a, self.b].map(|it| it.inputs.folder.folder_path().to_owned());
        for (path, file) in paths {
            let key = path.entry_and_key().map(|(_, key)| key.to_owned()).unwrap_or_default();
            if path.root() == "fmu" && ["start", "parameters", "path"].contains(&key.as_str()) {
                continue;
            }
            let (Ok(a), Ok(b)) = (std::fs::read(root_a.join(&file)), std::fs::read(root_b.join(&file)))
            else {
                continue;
            };
            let same_name =
                lookup(&self.b.inputs.table, &path).and_then(Value::as_str) == Some(file.as_str());
            if a == b || !same_name {
                continue;
            }
            let value = Value::String(file.clone());
            let found = ValueDifference { path, a: Some(value.clone()), b: Some(value) };
            let mut of_b = found.b.clone();
            of_b.iter_mut().for_each(|value| prefix_paths(value, "b/"));
            let difference = value_difference(&found, of_b, describe_content_change(&a, &b));
            self.push(Difference { a: String::new(), b: String::new(), ..difference });
        }
    }

    /// Another order of the FMUs, which may let them step in another order.
    fn add_order(&mut self) {
        let names = |inputs: PlannedInputs| -> Vec<String> {
            let list = inputs.inputs.table.get("fmu").and_then(Value::as_array);
            let names = list.into_iter().flatten().filter_map(|it| it.get("name")?.as_str());
            names.map(str::to_owned).collect()
        };
        let (of_a, of_b) = (names(self.a), names(self.b));
        let common = |names: &[String], other: &[String]| -> Vec<String> {
            names.iter().filter(|name| other.contains(name)).cloned().collect()
        };
        if common(&of_a, &of_b) != common(&of_b, &of_a) {
            let values = [of_a.join(", "), of_b.join(", ")];
            let swap = InputSwap::Order("fmu".to_owned(), of_b);
            self.push_setting(DifferenceKind::Order, "the order of [[fmu]]", values, swap);
        }
    }
}

/// A difference of a value of the scenario; `value` is that of B with the paths of its files.
fn value_difference(found: &ValueDifference, value: Option<Value>, details: Vec<String>) -> Difference {
    let root = found.path.root();
    let entry = found.path.entry_and_key().map(|(entry, _)| entry.to_owned()).unwrap_or_default();
    let node = entry.split('.').next().unwrap_or_default().to_owned();
    let is_file = [&found.a, &found.b]
        .into_iter()
        .flatten()
        .any(|it| it.as_str().is_some_and(|it| it.starts_with(FILES)));
    let (kind, scope) = match root {
        "title" | "view" | "extends" | "without" | "record" => {
            (DifferenceKind::Presentation, DifferenceScope::None)
        }
        "check" | "baseline" | "analysis" | "validation" | "sweep" => {
            (DifferenceKind::Judgement, DifferenceScope::None)
        }
        "time" if found.path.to_string() == "time.limit" => {
            (DifferenceKind::Presentation, DifferenceScope::None)
        }
        "time" => (DifferenceKind::Time, DifferenceScope::System),
        "coupling" => (DifferenceKind::Coupling, DifferenceScope::System),
        "connect" => (DifferenceKind::Connection, DifferenceScope::Connection(entry)),
        "fault" => (DifferenceKind::Fault, DifferenceScope::Connection(entry)),
        "signal" => (DifferenceKind::Signal, DifferenceScope::Node(node)),
        "table" | "manoeuvre" if is_file => (DifferenceKind::File, DifferenceScope::Node(node)),
        "fmu" | "table" | "manoeuvre" | "system" | "connector" => {
            (DifferenceKind::Node, DifferenceScope::Node(node))
        }
        _ => (DifferenceKind::Node, DifferenceScope::System),
    };
    let text = |value: &Option<Value>| value.as_ref().map_or("none".to_owned(), display_value);
    let swap = (scope != DifferenceScope::None).then(|| InputSwap::Value(found.path.clone(), value));
    let values = [text(&found.a), text(&found.b)];
    Difference { details, ..Difference::new(kind, found.path.to_string(), values, scope, swap) }
}

/// Whether a value from outside is a start value of an FMU.
fn is_start_of_fmu(plan: &RunPlan, value: &Override) -> bool {
    plan.system.nodes.iter().any(|node| match &node.body {
        NodeBody::Fmu { starts, .. } => {
            let array = |name: &str| name.rsplit_once('[').map_or(name, |(array, _)| array).to_owned();
            node.name == value.node_name()
                && starts
                    .iter()
                    .any(|it| it.name == value.variable_name() || array(&it.name) == value.variable_name())
        }
        _ => false,
    })
}

/// The start value that counts: that of the run, or else that of the FMU.
fn effective_start(fmu: &Fmu, starts: &[StartValue], name: &str) -> Option<FmuValue> {
    let given = starts.iter().rfind(|it| it.name == name).map(|it| it.value.clone());
    given.or_else(|| fmu.description.variables[fmu.description.find_variable(name)?].start_value())
}

fn pinned_start(fmu: &Fmu, start: &StartDifference) -> Option<(String, OverrideValue)> {
    let value = override_value(&effective_start(fmu, &[], &start.variable)?)?;
    Some((start.variable.clone(), value))
}

fn override_value(value: &FmuValue) -> Option<OverrideValue> {
    Some(match value {
        FmuValue::Real(value) => OverrideValue::Number { value: *value, unit: None },
        FmuValue::Integer(value) => OverrideValue::Integer(i64::try_from(*value).ok()?),
        FmuValue::Boolean(value) => OverrideValue::Boolean(*value),
        FmuValue::String(text) => OverrideValue::Toml(Value::String(text.clone())),
        value @ FmuValue::Binary(_) => {
            OverrideValue::Toml(Value::String(value.to_string().trim_matches('"').to_owned()))
        }
    })
}

fn display_fmu_value(value: &FmuValue) -> String {
    match value {
        FmuValue::Real(value) => value.to_string(),
        FmuValue::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// Lets the paths of kept files in a value begin with the folder of their run.
pub(crate) fn prefix_paths(value: &mut Value, prefix: &str) {
    match value {
        Value::String(text) => {
            let (mark, path) = text.strip_prefix('@').map_or(("", text.as_str()), |path| ("@", path));
            if path.starts_with(FMUS) || path.starts_with(FILES) {
                *text = format!("{mark}{prefix}{path}");
            }
        }
        Value::Array(list) => list.iter_mut().for_each(|value| prefix_paths(value, prefix)),
        Value::Table(table) => table.iter_mut().for_each(|(_, value)| prefix_paths(value, prefix)),
        _ => {}
    }
}

/// The kept files that a value names, with the keys that lead to them.
fn list_files(value: &Value, path: &KeyPath, files: &mut Vec<(KeyPath, String)>) {
    let joined = |step: KeyStep| KeyPath(path.0.iter().cloned().chain([step]).collect());
    match value {
        Value::String(text) if text.starts_with(FILES) => files.push((path.clone(), text.clone())),
        Value::Table(table) => {
            table.iter().for_each(|(key, value)| list_files(value, &joined(KeyStep::Key(key.clone())), files))
        }
        Value::Array(list) if list.iter().all(Value::is_table) => {
            for (step, entry) in crate::toml_difference::named_entries(list) {
                list_files(entry, &joined(step), files);
            }
        }
        _ => {}
    }
}

fn lookup<'t>(table: &'t toml::Table, path: &KeyPath) -> Option<&'t Value> {
    let (KeyStep::Key(first), rest) = path.0.split_first()? else { return None };
    rest.iter().try_fold(table.get(first)?, |value, step| match step {
        KeyStep::Key(key) => value.get(key),
        entry => {
            let entries = crate::toml_difference::named_entries(value.as_array()?);
            entries.into_iter().find(|(it, _)| it == entry).map(|(_, value)| value)
        }
    })
}

/// A run that is made of A and some differences of B.
pub(crate) struct MixedInputs {
    pub table: toml::Table,
    pub overrides: RecordedOverrides,
}

impl MixedInputs {
    /// One run as it was; `folder` is that of its kept files.
    pub fn of_run(run: &RunInputs, folder: &str) -> Self {
        let mut table = run.table.clone();
        for key in ["check", "baseline", "analysis", "validation", "sweep", "view", "record"] {
            table.remove(key);
        }
        table.iter_mut().for_each(|(_, value)| prefix_paths(value, &format!("{folder}/")));
        let mut overrides = run.overrides.clone();
        for start in overrides.starts.iter_mut().filter(|it| it.variable_name() == "path") {
            if let OverrideValue::Typed(path) = &start.value {
                let path = run.folder.folder_path().join(path);
                start.value = OverrideValue::Typed(path.to_string_lossy().into_owned());
            }
        }
        MixedInputs { table, overrides }
    }

    /// With these differences of B in it. An archive comes first: what is put in by itself goes before its start values.
    pub fn with_swaps(mut self, swaps: &[&InputSwap]) -> Self {
        let is_archive = |swap: &InputSwap| matches!(swap, InputSwap::Archive { .. });
        swaps.iter().filter(|it| is_archive(it)).for_each(|swap| self.put_in(swap));
        swaps.iter().filter(|it| !is_archive(it)).for_each(|swap| self.put_in(swap));
        self
    }

    fn put_in(&mut self, swap: &InputSwap) {
        let MixedInputs { table, overrides } = self;
        match swap {
            InputSwap::Value(path, value) => set_value(table, path, value.clone()),
            InputSwap::Tolerance(tolerance) => overrides.tolerance = *tolerance,
            InputSwap::Coupling(algorithm) => overrides.coupling = *algorithm,
            InputSwap::Override(name, value) => {
                overrides.starts.retain(|it| it.name != *name);
                overrides.starts.extend(value.clone().map(|value| Override::new(name.clone(), value)));
            }
            InputSwap::Archive { node, path, starts_of_a } => {
                let name = format!("{node}.path");
                overrides.starts.retain(|it| it.name != name);
                overrides.starts.push(Override::new(name, OverrideValue::Typed(path.clone())));
                let pinned = starts_of_a.iter();
                let pinned =
                    pinned.map(|(name, value)| Override::new(format!("{node}.{name}"), value.clone()));
                overrides.starts.extend(pinned);
            }
            InputSwap::Seed(seed) => overrides.seed = Some(*seed),
            InputSwap::Order(list, names) => reorder(table, list, names),
        }
    }
}

/// Brings the entries of a list into this order; others come behind them.
fn reorder(table: &mut toml::Table, list: &str, names: &[String]) {
    let Some(Value::Array(entries)) = table.get_mut(list) else { return };
    let rank = |entry: &Value| {
        let name = entry.get("name").and_then(Value::as_str);
        names.iter().position(|it| Some(it.as_str()) == name).unwrap_or(usize::MAX)
    };
    entries.sort_by_key(rank);
}
