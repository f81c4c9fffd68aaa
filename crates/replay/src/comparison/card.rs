//! Writes the card of two runs: verdicts side by side, and different values of their scenarios.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use diagnostics::Error;
use scenario::Scenario;

use super::{RecordedRun, RunComparison};

/// Listed differences of the scenarios at most; the rest is counted.
const LISTED: usize = 40;

impl RunComparison {
    /// The run card as Markdown; `found` are further lines of its first table.
    #[must_use]
    pub fn run_card_markdown(&self, found: &[(String, [String; 2])]) -> String {
        let [a, b] = &self.runs;
        let mut text = match a.header.title == b.header.title {
            true => format!("### {}\n\n", a.header.title),
            false => format!("### {} / {}\n\n", a.header.title, b.header.title),
        };
        let each = |what: fn(&RecordedRun) -> String| [what(a), what(b)];
        let time = |it: &RecordedRun| format!("{} s in steps of {} ms", it.header.stop, it.header.step * 1e3);
        let facts = [
            ("Seed", each(|it| it.header.seed.to_string())),
            ("Time", each(time)),
            ("Scenario", each(|it| it.header.scenario.clone())),
        ];
        let facts = facts.into_iter().map(|(name, values)| (name.to_owned(), values));
        let verdict = ("Verdict".to_owned(), each(|it| headline_and_check_verdicts(it).0));
        let lines: Vec<_> = std::iter::once(verdict).chain(found.iter().cloned()).chain(facts).collect();
        write_markdown_table(&mut text, "", &self.runs, &lines);
        let checks = self.check_verdicts();
        if !checks.is_empty() {
            text += "\n";
            write_markdown_table(&mut text, "Check", &self.runs, &checks);
        }
        text += "\n### Differences\n\n";
        if let Some(time) = self.differences.first_time {
            // Writing into a string cannot fail.
            let _ = writeln!(text, "The values differ from {time} s on.\n");
        }
        let inputs = self.differences.inputs.clone();
        match inputs.map_or_else(|| self.scenario_differences(), Ok) {
            Ok(differences) if differences.is_empty() => text += "The inputs are the same.\n",
            Ok(differences) => {
                let listed = &differences[..differences.len().min(LISTED)];
                write_markdown_table(&mut text, "Value", &self.runs, listed);
                if differences.len() > LISTED {
                    // Writing into a string cannot fail.
                    let _ = writeln!(text, "\nand {} more", differences.len() - LISTED);
                }
            }
            Err(error) => {
                let _ = writeln!(text, "They cannot be read: {error}");
            }
        }
        if !self.notes.is_empty() {
            text += "\n### Notes\n\n";
            self.notes.iter().for_each(|note| {
                let _ = writeln!(text, "- {note}");
            });
        }
        text
    }

    /// The checks of both runs, in the order of A, and their verdicts.
    fn check_verdicts(&self) -> Vec<(String, [String; 2])> {
        let of: Vec<BTreeMap<_, _>> =
            self.runs.iter().map(|it| headline_and_check_verdicts(it).1.into_iter().collect()).collect();
        let mut names: Vec<String> = Vec::new();
        for (name, _) in self.runs.iter().flat_map(|it| headline_and_check_verdicts(it).1) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let verdict_of = |run: usize, name: &str| of[run].get(name).cloned().unwrap_or_default();
        names.into_iter().map(|name| (name.clone(), [verdict_of(0, &name), verdict_of(1, &name)])).collect()
    }

    /// The values that differ between the scenarios; titles and views are left out.
    fn scenario_differences(&self) -> Result<Vec<(String, [String; 2])>, Error> {
        let values = |run: &RecordedRun| -> Result<BTreeMap<String, String>, Error> {
            let mut values =
                super::recorded_scenario(&run.recording).and_then(|it| Scenario::flattened_values(&it))?;
            values.retain(|name, _| !["title", "extends", "without"].contains(&name.as_str()));
            values.retain(|name, _| !name.starts_with("view."));
            for given in &run.header.given {
                if let Some(((node, variable), value)) =
                    given.split_once('=').and_then(|(name, value)| Some((name.split_once('.')?, value)))
                {
                    values.insert(format!("fmu.{node}.start.{variable}"), value.to_owned());
                }
            }
            Ok(values)
        };
        let [a, b] = [values(&self.runs[0])?, values(&self.runs[1])?];
        let names: BTreeSet<_> = a.keys().chain(b.keys()).collect();
        let differing = names.into_iter().filter(|name| a.get(*name) != b.get(*name));
        let cell = |value: Option<&String>| value.cloned().unwrap_or_else(|| "–".to_owned());
        Ok(differing.map(|name| (name.clone(), [cell(a.get(name)), cell(b.get(name))])).collect())
    }
}

fn write_markdown_table(
    text: &mut String,
    head: &str,
    runs: &[RecordedRun; 2],
    lines: &[(String, [String; 2])],
) {
    // Writing into a string cannot fail.
    let _ = writeln!(text, "| {head} | {} | {} |\n|:--|:--|:--|", runs[0].name, runs[1].name);
    for (name, [a, b]) in lines {
        let cell = |text: &str| text.replace('|', "\\|").replace('\n', " ");
        let _ = writeln!(text, "| {} | {} | {} |", cell(name), cell(a), cell(b));
    }
}

/// The headline of a run's summary, and the verdict on each check.
fn headline_and_check_verdicts(run: &RecordedRun) -> (String, Vec<(String, String)>) {
    let Some(summary) = &run.recording.summary else {
        return ("the recording was cut off".to_owned(), Vec::new());
    };
    let headline = summary.lines().next().unwrap_or_default().trim_matches('*').to_owned();
    let rows = summary.lines().filter_map(|line| line.strip_prefix("| ")).skip(1);
    let checks = rows.filter_map(|row| {
        let mut cells = row.split('|').map(str::trim);
        let (name, sign, worst, limit) = (cells.next()?, cells.next()?, cells.next()?, cells.next()?);
        let numbers = match (worst, limit) {
            ("", _) => String::new(),
            (worst, "") => format!(": {worst}"),
            (worst, limit) => format!(": {worst} (limit {limit})"),
        };
        Some((name.to_owned(), format!("{sign}{numbers}")))
    });
    (headline, checks.collect())
}
