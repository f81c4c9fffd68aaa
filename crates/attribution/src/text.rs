//! Writes an explanation for the terminal: what differs, what it did, why.

use std::fmt::Write as _;

use crate::difference::{Difference, DifferenceScope, unit_suffix};
use crate::experiment::LocalDeviation;
use crate::explanation::{Explanation, local_name};
use crate::trajectory::SignalDeviation;

/// Lines of one list that are printed; the rest is counted.
const MOST: usize = 20;

impl Explanation {
    /// As text.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.summary);
        let (acting, others): (Vec<_>, Vec<_>) =
            self.differences.iter().partition(|it| it.scope != DifferenceScope::None);
        let sentences = |list: &[&Difference]| list.iter().map(|it| it.sentence()).collect::<Vec<_>>();
        write_list(&mut text, "What is different", &sentences(&acting));
        write_list(&mut text, "Different, and acting on no value", &sentences(&others));
        let checks = self.checks.iter().map(|[name, a, b]| format!("{name}: {a} -> {b}"));
        write_list(&mut text, "Checks", &checks.collect::<Vec<_>>());
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

    /// The causes, a sentence each, and what none explains.
    pub(crate) fn cause_sentences(&self) -> Vec<String> {
        self.causes.iter().map(|it| it.text.clone()).chain(self.unexplained.clone()).collect()
    }
}

/// `3.21 s: estimator.v_y 0.1 -> 0.2 m/s, at most 0.3 apart`.
pub(crate) fn deviation_sentence(deviation: &SignalDeviation) -> String {
    let SignalDeviation { signal, time, a, b, largest, .. } = deviation;
    let unit = unit_suffix(signal.unit.as_ref());
    let side = if signal.input { " (input)" } else { "" };
    let name = signal.qualified_name();
    match a.is_nan() && b.is_nan() {
        true => format!("{time} s: {name}{side}, a text"),
        false => {
            let [a, b, largest] = [*a, *b, *largest].map(six_digits);
            format!("{time} s: {name}{side} {a} -> {b}{unit}, at most {largest}{unit} apart")
        }
    }
}

/// `` `plant` differs from 0.01 s on while it gets the values of A: a_x 0.1 -> 0.2 ``.
pub(crate) fn local_sentence(local: &LocalDeviation) -> String {
    let [a, b] = [local.a, local.b].map(six_digits);
    let variable = if local.input { String::new() } else { format!("{} ", local.variable) };
    format!(
        "{} differs from {} s on while it gets the values of A: {variable}{a} -> {b}",
        local_name(local),
        local.time
    )
}

/// A number with six digits, without zeros behind them.
fn six_digits(value: f64) -> String {
    format!("{value:.5e}").parse::<f64>().map_or_else(|_| value.to_string(), |rounded| rounded.to_string())
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
