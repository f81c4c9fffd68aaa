//! Checks event mode: it runs where it is claimed, and is refused elsewhere (FMI 3.0, section 4.2.1).

use std::sync::Arc;

use fmu_import::{CallError, FmiType, FmuLibrary, Instance};
use roxmltree::Document;

use super::RuleSeverity::{BreaksStandard, NotRobust};
use super::behaviour::require_finite_values;
use super::test_driver::{FAR, STEPS, TestDriver};
use super::{ConformanceRule, RuleCheck, RuleError, RuleResult, THREE, not_applicable, violated_rule};

/// The rule that runs an FMU with event mode.
pub(super) const RULE: &str = "event-mode";

pub(super) const RULES: &[ConformanceRule] = &[
    ConformanceRule {
        name: RULE,
        rank: BreaksStandard,
        sentence: "a simulation with event mode comes to its end",
        versions: THREE,
        check: RuleCheck::RunsOne(event_mode),
    },
    ConformanceRule {
        name: "event-mode-refused",
        rank: NotRobust,
        sentence: "event mode is refused by an FMU that has none",
        versions: THREE,
        check: RuleCheck::RunsOne(check_event_mode_refused),
    },
];

/// How often discrete states may ask for one more update at one time.
const UPDATES: usize = 1000;

fn has_event_mode(xml: &str) -> bool {
    let Ok(document) = Document::parse(xml) else { return false };
    let root = document.root_element();
    let interface = root.children().find(|node| node.has_tag_name("CoSimulation"));
    let flag = interface.and_then(|node| node.attribute("hasEventMode"));
    matches!(flag.map(str::trim), Some("true" | "1"))
}

/// Whether an FMU has clocks, and makes no instance without event mode: FMI 3.0 says how clocks tick in event mode only.
pub(super) fn is_needed(library: &Arc<FmuLibrary>) -> bool {
    let about = library.description();
    about.variables.iter().any(|it| it.kind == FmiType::Clock)
        && !about.only_once
        && Instance::new(Arc::clone(library), "conform", false).is_err()
        && Instance::with_event_mode(Arc::clone(library), "conform").is_ok()
}

fn event_mode(driver: &TestDriver) -> RuleResult {
    if !has_event_mode(&driver.xml) {
        return not_applicable("hasEventMode is not set");
    }
    driver.note_progress("fmi3InstantiateCoSimulation with eventModeUsed");
    let mut instance = Instance::with_event_mode(Arc::clone(&driver.library), "conform")?;
    driver.set_up(&mut instance, FAR)?;
    instance.enter_initialization()?;
    driver.note_progress("fmi3ExitInitializationMode with eventModeUsed");
    instance.exit_initialization()?;
    let (mut events, mut ended) = (1, run_event_iteration(driver, &mut instance, 0.0)?);
    let mut rows = Vec::new();
    for tick in 0..STEPS {
        if ended {
            break;
        }
        driver.set_inputs(&mut instance, 0, 0)?;
        driver.note_progress(&format!("fmi3DoStep at t = {} s", driver.tick_time(tick.into())));
        let advance = match instance.advance(driver.tick_time(tick.into()), driver.step_size()) {
            Err(CallError { terminated: Some(_), .. }) => break,
            advance => advance?,
        };
        rows.push(driver.read_outputs(&mut instance, driver.tick_time((tick + 1).into()))?);
        if advance.event {
            driver.note_progress("fmi3EnterEventMode");
            instance.enter_event_mode()?;
            ended = run_event_iteration(driver, &mut instance, f64::from(tick) + 1.0)?;
            events += 1;
        }
    }
    require_finite_values(driver, &rows)?;
    driver.note_progress("fmi3Terminate");
    instance.terminate()?;
    Ok(format!("{} steps, {events} times in event mode", rows.len()))
}

/// Updates discrete states until they rest, leaves event mode, and says whether the FMU asks for the end.
fn run_event_iteration(driver: &TestDriver, instance: &mut Instance, tick: f64) -> Result<bool, RuleError> {
    let time = driver.tick_time(tick);
    for _ in 0..UPDATES {
        driver.note_progress("fmi3UpdateDiscreteStates");
        let update = match instance.update_discrete_states(time) {
            Err(CallError { terminated: Some(_), .. }) => return Ok(true),
            update => update?,
        };
        if !update.discrete_states_need_update {
            driver.note_progress("fmi3EnterStepMode");
            instance.enter_step_mode()?;
            return Ok(false);
        }
    }
    violated_rule(format!("fmi3UpdateDiscreteStates asks for more than {UPDATES} updates at t = {time} s"))
}

fn check_event_mode_refused(driver: &TestDriver) -> RuleResult {
    if has_event_mode(&driver.xml) {
        return not_applicable("hasEventMode is set");
    }
    driver.note_progress("fmi3InstantiateCoSimulation with eventModeUsed");
    match Instance::with_event_mode(Arc::clone(&driver.library), "conform") {
        Ok(_) => violated_rule(
            "expected no instance with eventModeUsed, found one, although hasEventMode is not set",
        ),
        Err(_) => Ok(String::new()),
    }
}
