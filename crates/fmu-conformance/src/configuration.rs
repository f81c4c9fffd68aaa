//! Checks that structural parameters resize arrays in configuration mode (FMI 3.0, sections 2.3.4 and 4.2.1).

use std::collections::BTreeMap;

use fmu_import::{CallError, Instance, StorageType, Value};
use roxmltree::{Document, Node};

use super::RuleSeverity::BreaksStandard;
use super::test_driver::{STEPS, TestDriver};
use super::{ConformanceRule, RuleCheck, RuleError, RuleResult, THREE, not_applicable};

pub(super) const RULES: &[ConformanceRule] = &[ConformanceRule {
    name: "configuration",
    rank: BreaksStandard,
    sentence: "structural parameters give arrays their size",
    versions: THREE,
    check: RuleCheck::Runs(check_configuration_mode),
}];

/// A structural parameter that can be changed by one.
struct StructuralParameter {
    name: String,
    reference: u32,
    tunable: bool,
    before: u64,
    after: u64,
}

/// An array by the sizes that it has: numbers, or the references of structural parameters.
struct ResizableArray {
    name: String,
    reference: u32,
    storage: StorageType,
    dimensions: Vec<Result<u64, u32>>,
}

impl ResizableArray {
    /// The number of its elements under these values of structural parameters.
    fn element_count(&self, sizes: &BTreeMap<u32, u64>) -> u64 {
        let size = |dimension: &Result<u64, u32>| match dimension {
            Ok(size) => *size,
            Err(reference) => sizes.get(reference).copied().unwrap_or(0),
        };
        self.dimensions.iter().map(size).fold(1, u64::saturating_mul)
    }
}

fn check_configuration_mode(driver: &TestDriver) -> RuleResult {
    let Ok(document) = Document::parse(&driver.xml) else {
        return not_applicable("the description is no XML");
    };
    let (parameters, arrays) = declared_sizes_and_arrays(driver, &document);
    let starts: BTreeMap<_, _> = parameters.iter().map(|it| (it.reference, it.before)).collect();
    let mut done = Vec::new();
    for parameter in &parameters {
        let mut sizes = starts.clone();
        sizes.insert(parameter.reference, parameter.after);
        let resized: Vec<_> =
            arrays.iter().filter(|it| it.element_count(&starts) != it.element_count(&sizes)).collect();
        if resized.is_empty() {
            continue;
        }
        check_resize(driver, parameter, &resized, &starts, &sizes)?;
        done.push(format!("`{}` from {} to {}", parameter.name, parameter.before, parameter.after));
    }
    match done.is_empty() {
        true => not_applicable("no array has the size of a structural parameter that can change"),
        false => Ok(done.join(", ")),
    }
}

type SizesByReference = BTreeMap<u32, u64>;

/// Sets the parameter before the initialization, and if it is tunable between two steps, and insists on the new sizes.
fn check_resize(
    driver: &TestDriver,
    parameter: &StructuralParameter,
    arrays: &[&ResizableArray],
    before: &SizesByReference,
    after: &SizesByReference,
) -> Result<(), RuleError> {
    let set = |instance: &mut Instance, value: u64| {
        driver.note_progress(&format!("configuration mode with `{}` = {value}", parameter.name));
        instance.set_in_configuration_mode(|instance| {
            instance.write_variable(StorageType::UInt64, parameter.reference, &[Value::Integer(value.into())])
        })
    };
    let mut instance = driver.new_instance()?;
    set(&mut instance, parameter.after)?;
    driver.enter_initialization(&mut instance)?;
    require_array_sizes(driver, &mut instance, arrays, after, before, "in initialization mode")?;
    instance.exit_initialization()?;
    let steps = |instance: &mut Instance, ticks: std::ops::Range<u32>| {
        let mut all =
            ticks.map(|tick| driver.do_step(instance, driver.tick_time(tick.into()), driver.step_size()));
        all.try_for_each(|step| match step {
            // The FMU may end the simulation.
            Err(CallError { terminated: Some(_), .. }) => Ok(()),
            step => step,
        })
    };
    steps(&mut instance, 0..STEPS / 4)?;
    require_array_sizes(driver, &mut instance, arrays, after, before, "after some steps")?;
    if parameter.tunable {
        set(&mut instance, parameter.before)?;
        require_array_sizes(driver, &mut instance, arrays, before, after, "after a reconfiguration")?;
        steps(&mut instance, STEPS / 4..STEPS / 2)?;
    }
    Ok(())
}

/// Insists that arrays have these sizes, and not those.
fn require_array_sizes(
    driver: &TestDriver,
    instance: &mut Instance,
    arrays: &[&ResizableArray],
    sizes: &SizesByReference,
    others: &SizesByReference,
    when: &str,
) -> Result<(), RuleError> {
    for array in arrays {
        let (right, wrong) = (array.element_count(sizes), array.element_count(others));
        driver.note_progress(&format!("reading {right} values of `{}` {when}", array.name));
        let count = usize::try_from(right).unwrap_or(usize::MAX);
        let found = instance.read_variable(array.storage, array.reference, count);
        found.map_err(|CallError { call, what, .. }| {
            let name = &array.name;
            RuleError::Violated(format!(
                "expected `{name}` to have {right} values in place of {wrong} {when}, found {call} {what}"
            ))
        })?;
    }
    if instance.has_failed_fatally() { driver.fatal_status_violation() } else { Ok(()) }
}

fn declared_sizes_and_arrays(
    driver: &TestDriver,
    document: &Document,
) -> (Vec<StructuralParameter>, Vec<ResizableArray>) {
    let root = document.root_element();
    let list = root.children().find(|node| node.has_tag_name("ModelVariables"));
    let nodes: Vec<Node> =
        list.into_iter().flat_map(|list| list.children()).filter(Node::is_element).collect();
    let parameter = |node: &Node| {
        let number = |name: &str| node.attribute(name)?.trim().parse::<u64>().ok();
        let structural = node.attribute("causality") == Some("structuralParameter");
        let (start, reference) = (number("start")?, number("valueReference")?);
        let most = number("max").unwrap_or(u64::MAX);
        let least = number("min").unwrap_or(1).max(1);
        let after = if start < most { start + 1 } else { start.checked_sub(1)? };
        (structural && node.has_tag_name("UInt64") && after >= least && after <= most).then(|| {
            StructuralParameter {
                name: node.attribute("name").unwrap_or_default().to_owned(),
                reference: reference as u32,
                tunable: node.attribute("variability") == Some("tunable"),
                before: start,
                after,
            }
        })
    };
    let array = |node: &Node| {
        let dimensions = node.children().filter(|child| child.has_tag_name("Dimension"));
        let size = |dimension: Node| match dimension.attribute("valueReference") {
            Some(reference) => Err(reference.trim().parse().unwrap_or(u32::MAX)),
            None => Ok(dimension.attribute("start").and_then(|it| it.parse().ok()).unwrap_or(0)),
        };
        let dimensions: Vec<_> = dimensions.map(size).collect();
        let reference = node.attribute("valueReference")?.trim().parse().ok()?;
        let variables = &driver.description().variables;
        let variable = variables.iter().find(|it| it.reference == reference)?;
        (!dimensions.is_empty()).then(|| ResizableArray {
            name: node.attribute("name").unwrap_or_default().to_owned(),
            reference,
            storage: variable.storage,
            dimensions,
        })
    };
    (nodes.iter().filter_map(parameter).collect(), nodes.iter().filter_map(array).collect())
}
