//! Reports findings: as an exit code, as lines for a terminal, and in one sentence.

use std::collections::BTreeMap;

use fmu_import::FmiVersion;

use super::{RuleFinding, RuleOutcome, RuleSeverity, conformance_rules};

/// The exit code that tells the findings: 0, 1 when the FMU breaks runs or the standard, 3 when a rule could not be judged.
#[must_use]
pub fn exit_code(findings: &[RuleFinding]) -> u8 {
    let unknown = findings.iter().any(|finding| finding.outcome == RuleOutcome::NotJudged);
    let broken = |rank| !failed_rule_names(findings, rank).is_empty();
    match unknown {
        true => 3,
        false => u8::from(broken(RuleSeverity::BreaksRuns) || broken(RuleSeverity::BreaksStandard)),
    }
}

/// The names of the failed rules of a rank.
fn failed_rule_names(findings: &[RuleFinding], rank: RuleSeverity) -> Vec<&str> {
    let failed = findings.iter().filter(|it| it.outcome == RuleOutcome::Fail && it.rank == rank);
    let mut names: Vec<_> = failed.map(|finding| finding.rule.as_str()).collect();
    // A rule that is asked of several references is one rule.
    names.dedup();
    names
}

/// So many failed rules with one detail have one cause.
const ONE_CAUSE: usize = 3;

/// What several rules fail for alike, if anything: it stands in the conclusion, so that nobody reads it a dozen times.
fn common_cause(findings: &[RuleFinding]) -> String {
    let mut rules = BTreeMap::<&str, usize>::new();
    for finding in findings.iter().filter(|it| it.outcome == RuleOutcome::Fail) {
        *rules.entry(&finding.detail).or_default() += 1;
    }
    let most = rules.into_iter().max_by_key(|(_, count)| *count);
    most.filter(|(_, count)| *count >= ONE_CAUSE)
        .map(|(detail, count)| format!(" {count} rules have one cause: {detail}."))
        .unwrap_or_default()
}

/// What the findings come to, in one sentence.
fn describe_conclusion(findings: &[RuleFinding], version: FmiVersion) -> String {
    let runs = |finding: &&RuleFinding| {
        conformance_rules().any(|it| it.name == finding.rule && it.steps_instances())
    };
    let passed = |finding: &&RuleFinding| finding.outcome == RuleOutcome::Pass;
    if !findings.iter().filter(passed).any(|it| runs(&it)) {
        let ranks = [RuleSeverity::BreaksRuns, RuleSeverity::BreaksStandard]
            .map(|rank| failed_rule_names(findings, rank));
        let cause = common_cause(findings);
        return format!("Nothing of the FMU ran ({}).{cause}", ranks.concat().join(", "));
    }

    let [runs, standard, robust] =
        [RuleSeverity::BreaksRuns, RuleSeverity::BreaksStandard, RuleSeverity::NotRobust]
            .map(|rank| failed_rule_names(findings, rank).join(", "));
    let weak = match robust.as_str() {
        "" => String::new(),
        rules => format!("; it does not defend itself against wrong callers ({rules})"),
    };
    let cause = common_cause(findings);
    let told = match (runs.as_str(), standard.as_str()) {
        ("", "") if version == FmiVersion::One => format!("The FMU loads and runs{weak}."),
        ("", "") => format!("The FMU keeps FMI {version} for callers that do{weak}."),
        ("", rules) => format!("The FMU runs, but breaks FMI {version} ({rules}){weak}."),
        (rules, "") => format!("The FMU breaks runs ({rules}){weak}."),
        (runs, rules) => format!("The FMU breaks runs ({runs}) and FMI {version} ({rules}){weak}."),
    };
    told + &cause
}

/// What is not judged about an FMU of a version, as the end of its report.
fn describe_unknown_rules(version: FmiVersion) -> &'static str {
    match version {
        FmiVersion::One => {
            " The rules are those of FMI 2.0 and 3.0: of FMI 1.0 loading and running are judged, and nothing else.\n"
        }
        FmiVersion::Two | FmiVersion::Three => "\n",
    }
}

/// The findings as lines for a terminal, with a summary at the end.
#[must_use]
pub fn report_lines(findings: &[RuleFinding], version: FmiVersion) -> String {
    let mut text = String::new();
    for finding in findings {
        let rule = conformance_rules().find(|rule| rule.name == finding.rule);
        let sentence = rule.map(|rule| rule.sentence).unwrap_or_default();
        let (word, what) = match (finding.outcome, finding.detail.as_str()) {
            (RuleOutcome::Pass, "") => ("pass", sentence.to_owned()),
            (RuleOutcome::Pass, detail) => ("pass", format!("{sentence}: {detail}")),
            (RuleOutcome::Fail, detail) if finding.rank == RuleSeverity::NotRobust => {
                ("weak", detail.to_owned())
            }
            (RuleOutcome::Fail, detail) => ("FAIL", detail.to_owned()),
            (RuleOutcome::NotApplicable, detail) => ("n/a", detail.to_owned()),
            (RuleOutcome::NotJudged, why) => ("ERR", format!("could not be judged: {why}")),
        };
        text += &format!("{word:<4}  {:<22}  {what}\n", finding.rule);
    }
    let count = |wanted| findings.iter().filter(|finding| finding.outcome == wanted).count();
    text += &format!(
        "{} passed, {} failed, {} not applicable",
        count(RuleOutcome::Pass),
        count(RuleOutcome::Fail),
        count(RuleOutcome::NotApplicable),
    );
    match count(RuleOutcome::NotJudged) {
        0 => text + "\n" + &describe_conclusion(findings, version) + describe_unknown_rules(version),
        unknown => text + &format!(", {unknown} could not be judged, which says nothing about the FMU\n"),
    }
}
