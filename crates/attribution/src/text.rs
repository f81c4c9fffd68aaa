//! Writes an explanation for the terminal: what differs, what it did, why.

use std::fmt::Write as _;

use diagnostics::rounded_time;
use units::display::{align_columns, number_text, shorten_end, unit_text};

use crate::check_comparison::{CheckComparison, pair_text};
use crate::difference::{Difference, DifferenceKind, DifferenceScope, unit_suffix};
use crate::experiment::LocalDeviation;
use crate::explanation::{Explanation, local_name};
use crate::key_figure::KeyFigure;
use crate::number_pair::{NumberPair, quantity_change};
use crate::trajectory::SignalDeviation;

/// Lines of one list that are printed; the rest is counted.
const MOST: usize = 20;
/// Letters of the name of a check at most.
const WIDEST: usize = 44;

impl Explanation {
    /// As text.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.summary);
        let flips: Vec<_> = self.checks.iter().filter_map(|it| it.text.clone()).collect();
        write_list(&mut text, "Checks with another verdict", &flips);
        write_list(&mut text, "Key figures", &self.key_figures.iter().map(figure_line).collect::<Vec<_>>());
        let of_kind = |wanted: &dyn Fn(&Difference) -> bool| -> Vec<String> {
            self.differences.iter().filter(|it| wanted(it)).map(Difference::sentence).collect()
        };
        let judges = |it: &Difference| it.kind == DifferenceKind::Judgement;
        let acts = |it: &Difference| it.scope != DifferenceScope::None;
        write_list(&mut text, "What is different", &of_kind(&acts));
        write_list(&mut text, "Different in what judges the run", &of_kind(&judges));
        write_list(&mut text, "Different, and acting on no value", &of_kind(&|it| !acts(it) && !judges(it)));
        write_list(&mut text, &self.check_head(), &check_lines(&self.checks));
        if !self.spread.is_empty() {
            let [common, differing] = self.signals;
            let head = format!("What it did: {differing} of {common} signals differ");
            write_list(&mut text, &head, &self.spread.iter().map(deviation_sentence).collect::<Vec<_>>());
        }
        write_list(&mut text, "By itself", &self.local.iter().map(local_sentence).collect::<Vec<_>>());
        write_list(&mut text, "Why", &self.cause_sentences());
        let idle = self.without_effect.iter().map(|id| self.differences[*id].sentence());
        write_list(&mut text, "Without effect", &idle.collect::<Vec<_>>());
        write_list(&mut text, "Notes", &self.notes);
        if self.runs > 0 {
            let _ = writeln!(text, "{} runs, {:.1} s", self.runs, self.seconds);
        }
        text
    }

    fn check_head(&self) -> String {
        let flipped = self.checks.iter().filter(|it| it.flipped_by.is_some()).count();
        let same = self.checks.iter().filter(|it| it.is_unchanged()).count();
        let rest = if same > 0 { format!("; {same} are the same in all") } else { String::new() };
        format!("Checks: {flipped} of {} changed their verdicts{rest}", self.checks.len())
    }

    /// The causes, a sentence each, and what none explains.
    pub(crate) fn cause_sentences(&self) -> Vec<String> {
        self.causes.iter().map(|it| it.text.clone()).chain(self.unexplained.clone()).collect()
    }
}

/// `3.21 s: estimator.v_y 0.1 -> 0.2 m/s, at most 0.3 apart`.
pub(crate) fn deviation_sentence(deviation: &SignalDeviation) -> String {
    let SignalDeviation { signal, time, a, b, largest, .. } = deviation;
    let time = rounded_time(*time);
    let unit = unit_suffix(signal.unit.as_ref());
    let side = if signal.input { " (input)" } else { "" };
    let name = signal.qualified_name();
    match a.is_nan() && b.is_nan() {
        true => format!("{time} s: {name}{side}, a text"),
        false => {
            let change = quantity_change(*a, *b, signal.unit.as_deref());
            format!("{time} s: {name}{side} {change}, at most {}{unit} apart", number_text(*largest))
        }
    }
}

/// `` `plant` differs from 0.01 s on while it gets the values of A: a_x 0.1 -> 0.2 ``.
pub(crate) fn local_sentence(local: &LocalDeviation) -> String {
    let variable = if local.input { String::new() } else { format!("{} ", local.variable) };
    format!(
        "{} differs from {} s on while it gets the values of A: {variable}{}",
        local_name(local),
        rounded_time(local.time),
        quantity_change(local.a, local.b, None)
    )
}

/// `lap 1: 38.42 -> 37.95 s (-0.47)`.
fn figure_line(figure: &KeyFigure) -> String {
    let pair = NumberPair::new(figure.a, figure.b);
    let unit = unit_suffix(figure.unit.as_ref());
    match &pair.difference {
        Some(difference) if pair.a != pair.b => {
            format!("{}: {} -> {}{unit} ({difference})", figure.name, pair.a, pair.b)
        }
        _ => format!("{}: {}{unit}", figure.name, pair.change_text("->")),
    }
}

/// The checks that differ in anything, as a table.
fn check_lines(checks: &[CheckComparison]) -> Vec<String> {
    let row = |check: &CheckComparison| {
        let [a, b] = check.verdicts();
        vec![
            shorten_end(&check.name, WIDEST),
            if a == b { a.to_owned() } else { format!("{a} -> {b}") },
            pair_text(check.values(), "->"),
            pair_text(check.limits(), "->"),
            pair_text(check.margins(), "->"),
            check.unit().map(unit_text).unwrap_or_default(),
            check.cause_words(),
        ]
    };
    let differing: Vec<_> = checks.iter().filter(|it| !it.is_unchanged()).map(row).collect();
    if differing.is_empty() {
        return Vec::new();
    }
    let head = ["", "verdict", "value", "limit", "margin", "unit", "what moved"].map(str::to_owned).to_vec();
    let rows: Vec<_> = std::iter::once(head).chain(differing).collect();
    align_columns(&rows)
}

fn write_list(text: &mut String, head: &str, lines: &[String]) {
    if lines.is_empty() {
        return;
    }
    // Writing into a string cannot fail.
    let _ = writeln!(text, "\n{head}");
    for line in lines.iter().take(MOST) {
        let _ = writeln!(text, "  {line}");
    }
    if lines.len() > MOST {
        let _ = writeln!(text, "  and {} more", lines.len() - MOST);
    }
}
