//! Tells findings: as an exit code, as lines for a terminal, and in one sentence.

use fmu_import::Version;

use super::{Finding, Outcome, Rank, rules};

/// The exit code that tells the findings: 0, 1 when the FMU breaks runs or the standard, 3 when a rule could not be judged.
#[must_use]
pub fn exit_code(findings: &[Finding]) -> u8 {
    let unknown = findings.iter().any(|finding| finding.outcome == Outcome::NotJudged);
    let broken = |rank| !failed(findings, rank).is_empty();
    match unknown {
        true => 3,
        false => u8::from(broken(Rank::BreaksRuns) || broken(Rank::BreaksStandard)),
    }
}

/// The names of the failed rules of a rank.
fn failed(findings: &[Finding], rank: Rank) -> Vec<&str> {
    let failed = findings.iter().filter(|it| it.outcome == Outcome::Fail && it.rank == rank);
    let mut names: Vec<_> = failed.map(|finding| finding.rule.as_str()).collect();
    // A rule that is asked of several references is one rule.
    names.dedup();
    names
}

/// What the findings come to, in one sentence.
fn conclusion(findings: &[Finding], version: Version) -> String {
    let [runs, standard, robust] = [Rank::BreaksRuns, Rank::BreaksStandard, Rank::NotRobust]
        .map(|rank| failed(findings, rank).join(", "));
    let weak = match robust.as_str() {
        "" => String::new(),
        rules => format!("; it does not defend itself against wrong callers ({rules})"),
    };
    match (runs.as_str(), standard.as_str()) {
        ("", "") => format!("The FMU keeps FMI {version} for callers that do{weak}."),
        ("", rules) => format!("The FMU runs, but breaks FMI {version} ({rules}){weak}."),
        (rules, "") => format!("The FMU breaks runs ({rules}){weak}."),
        (runs, rules) => format!("The FMU breaks runs ({runs}) and FMI {version} ({rules}){weak}."),
    }
}

/// The findings as lines for a terminal, with a summary at the end.
#[must_use]
pub fn lines(findings: &[Finding], version: Version) -> String {
    let mut text = String::new();
    for finding in findings {
        let rule = rules().find(|rule| rule.name == finding.rule);
        let sentence = rule.map(|rule| rule.sentence).unwrap_or_default();
        let (word, what) = match (finding.outcome, finding.detail.as_str()) {
            (Outcome::Pass, "") => ("pass", sentence.to_owned()),
            (Outcome::Pass, detail) => ("pass", format!("{sentence}: {detail}")),
            (Outcome::Fail, detail) if finding.rank == Rank::NotRobust => {
                ("weak", detail.to_owned())
            }
            (Outcome::Fail, detail) => ("FAIL", detail.to_owned()),
            (Outcome::NotApplicable, detail) => ("n/a", detail.to_owned()),
            (Outcome::NotJudged, why) => ("ERR", format!("could not be judged: {why}")),
        };
        text += &format!("{word:<4}  {:<22}  {what}\n", finding.rule);
    }
    let count = |wanted| findings.iter().filter(|finding| finding.outcome == wanted).count();
    text += &format!(
        "{} passed, {} failed, {} not applicable",
        count(Outcome::Pass),
        count(Outcome::Fail),
        count(Outcome::NotApplicable),
    );
    match count(Outcome::NotJudged) {
        0 => text + "\n" + &conclusion(findings, version) + "\n",
        unknown => {
            text + &format!(", {unknown} could not be judged, which says nothing about the FMU\n")
        }
    }
}
