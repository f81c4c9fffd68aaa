//! Resolves the quantities of a layout: recorded signals and formulas of them.

use diagnostics::{Error, Spanned, suggest};
use expression::{Expression, Operand};
use recording::view::{AtX, Quantity};
use recording::{Column, ColumnIndex, Columns, NumberIndex, Recorded};

use super::checks::inside;
use crate::words::Scenario;

/// Name of the axis x in the formula of a curve.
const ABSCISSA: &str = "x";

/// The signals that a layout can show.
pub(super) struct Names<'a> {
    scenario: &'a Scenario,
    columns: &'a Columns<Recorded>,
    /// The names of the numbers, then those of the texts.
    names: Vec<String>,
}

impl<'a> Names<'a> {
    pub(super) fn new(scenario: &'a Scenario, columns: &'a Columns<Recorded>) -> Self {
        let names = columns.iter().map(Column::name).collect();
        Names { scenario, columns, names }
    }

    /// An error at a word of the file.
    pub(super) fn error<T>(&self, at: &Spanned<T>, message: impl Into<String>) -> Error {
        self.scenario.error(at, message)
    }

    /// The unit of a column.
    pub(super) fn unit(&self, column: NumberIndex<Recorded>) -> Option<&'a str> {
        self.columns[column].unit.as_deref()
    }

    /// A signal that is a number.
    pub(super) fn column(&self, word: &Spanned<String>) -> Result<NumberIndex<Recorded>, Error> {
        let name = word.get_ref();
        match self.columns.find(name) {
            Some(ColumnIndex::Number(column)) => Ok(column),
            Some(ColumnIndex::Text(_)) => {
                let error = self.error(word, format!("`{name}` is a text, which no plot can show"));
                Err(error.help("texts are among the events and states of the replay"))
            }
            None => {
                let known = self.names.iter().map(String::as_str);
                let unknown = suggest::unknown("recorded signal", name, known);
                Err(unknown.at(&self.scenario.source, word.span()))
            }
        }
    }

    /// A signal, or what is computed from signals.
    pub(super) fn quantity(&self, word: &Spanned<String>) -> Result<Quantity, Error> {
        let text = word.get_ref();
        if self.columns.find(text).is_some() || is_name(text) {
            return self.column(word).map(Quantity::Column);
        }
        self.parse(word, text, &mut |name| self.columns.find(name).map(Operand::from))
            .map(Quantity::Formula)
    }

    /// A curve over [`ABSCISSA`]; and whether it depends on more than that.
    pub(super) fn function(
        &self,
        word: &Spanned<String>,
    ) -> Result<(Expression<AtX>, bool), Error> {
        let text = word.get_ref();
        let mut moves = text.contains("time");
        let function = self.parse(word, text, &mut |name| {
            if name == ABSCISSA {
                return Some(Operand::Number(AtX::X));
            }
            moves = true;
            self.columns.find(name).map(AtX::column).map(Operand::from)
        })?;
        Ok((function, moves))
    }

    /// The quantity `word` plus so many times its standard deviation.
    pub(super) fn shifted(
        &self,
        word: &Spanned<String>,
        sigmas: f64,
        std: &Spanned<String>,
    ) -> Result<Quantity, Error> {
        self.quantity(std)?;
        let quoted = |word: &Spanned<String>| match self.columns.find(word.get_ref()) {
            Some(_) => format!("`{}`", word.get_ref()),
            None => format!("({})", word.get_ref()),
        };
        let sum = format!("{} + {sigmas} * {}", quoted(word), quoted(std));
        self.parse(std, &sum, &mut |name| self.columns.find(name).map(Operand::from))
            .map(Quantity::Formula)
    }

    /// Parses what stands at `word`, or was made of it.
    fn parse<S>(
        &self,
        word: &Spanned<String>,
        text: &str,
        resolve: &mut dyn FnMut(&str) -> Option<Operand<S>>,
    ) -> Result<Expression<S>, Error> {
        let parsed = Expression::parse(text, resolve).map_err(|error| {
            let span = inside(self.scenario, word, error.span.clone());
            let pointed = self.scenario.source.error(span, error.message, "here");
            match error.unknown.and_then(|name| self.hint(&name)).or(error.help) {
                Some(help) => pointed.help(help),
                None => pointed,
            }
        })?;
        if parsed.is_reduction() {
            let message = "expected a value at each moment, found one of the run as a whole";
            return Err(self.error(word, message));
        }
        Ok(parsed)
    }

    /// A suggestion for an unknown name.
    fn hint(&self, name: &str) -> Option<String> {
        suggest::hint(name, self.names.iter().map(String::as_str))
    }
}

/// Whether a text that names no signal was probably meant to.
fn is_name(text: &str) -> bool {
    text.chars().all(|c| c.is_alphanumeric() || "._[],".contains(c)) && text.parse::<f64>().is_err()
}
