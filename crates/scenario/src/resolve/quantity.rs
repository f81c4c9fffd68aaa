//! Resolves the quantities of `[view]`: recorded signals and formulas of them.

use diagnostics::{Error, Spanned, suggest};
use expression::{Expression, ResolvedSignal, SignalOperand, SignalUnit};
use recording::view::{RecordedVariablesAndX, RowQuantity};
use recording::{Column, ColumnIndex, Columns, NumberIndex, RecordedVariables};
use units::Unit;

use super::checks::span_within;
use super::signal_units::{SignalUnits, unit_help};
use crate::document::Scenario;

/// Name of the axis x in the formula of a curve.
const ABSCISSA: &str = "x";

/// The signals that a layout can show.
pub(super) struct SignalScope<'a> {
    scenario: &'a Scenario,
    columns: &'a Columns<RecordedVariables>,
    units: &'a SignalUnits,
    /// The names of the numbers, then those of the texts.
    names: Vec<String>,
}

impl<'a> SignalScope<'a> {
    pub(super) fn new(
        scenario: &'a Scenario,
        columns: &'a Columns<RecordedVariables>,
        units: &'a SignalUnits,
    ) -> Self {
        let names = columns.iter().map(Column::qualified_name).collect();
        SignalScope { scenario, columns, units, names }
    }

    /// An error at a word of the file.
    pub(super) fn error_at<T>(&self, at: &Spanned<T>, message: impl Into<String>) -> Error {
        self.scenario.error_at(at, message)
    }

    /// The unit of a quantity with its name, if there is one. What products make is named in SI units.
    pub(super) fn quantity_unit(&self, quantity: &RowQuantity) -> Option<(Option<Unit>, String)> {
        match quantity {
            RowQuantity::Column(column) => {
                let column = &self.columns[*column];
                let unit = match self.units.unit_of_signal(&column.qualified_name()) {
                    SignalUnit::Known(unit, _) => Some(unit),
                    _ => None,
                };
                Some((unit, column.unit.clone()?))
            }
            RowQuantity::Formula(formula) => {
                let (unit, name) = formula.unit()?;
                Some((Some(unit), name.unwrap_or_else(|| unit.dimension_text())))
            }
        }
    }

    /// A signal that is a number.
    pub(super) fn find_number_column(
        &self,
        word: &Spanned<String>,
    ) -> Result<NumberIndex<RecordedVariables>, Error> {
        let name = word.get_ref();
        match self.columns.find(name) {
            Some(ColumnIndex::Number(column)) => Ok(column),
            Some(ColumnIndex::Text(_)) => {
                let error = self.error_at(word, format!("`{name}` is a text, which no plot can show"));
                Err(error.with_help("texts are among the events and states of the replay"))
            }
            None => {
                let known = self.names.iter().map(String::as_str);
                let unknown = suggest::unknown_name("recorded signal", name, known);
                Err(unknown.into_error_at(&self.scenario.source, word.span()))
            }
        }
    }

    /// A signal, or what is computed from signals.
    pub(super) fn parse_quantity(&self, word: &Spanned<String>) -> Result<RowQuantity, Error> {
        let text = word.get_ref();
        if self.columns.find(text).is_some() || is_name(text) {
            return self.find_number_column(word).map(RowQuantity::Column);
        }
        self.parse_expression(word, text, &mut |name| self.find_signal(name)).map(RowQuantity::Formula)
    }

    /// A signal of a formula.
    fn find_signal(&self, name: &str) -> Option<ResolvedSignal<RecordedVariables>> {
        let operand = self.columns.find(name)?.into();
        Some(ResolvedSignal { operand, unit: self.units.unit_of_signal(name) })
    }

    /// A curve over [`ABSCISSA`]; and whether it depends on more than that.
    pub(super) fn parse_function(
        &self,
        word: &Spanned<String>,
    ) -> Result<(Expression<RecordedVariablesAndX>, bool), Error> {
        let text = word.get_ref();
        let mut moves = text.contains("time");
        let function = self.parse_expression(word, text, &mut |name| {
            if name == ABSCISSA {
                return Some(SignalOperand::Number(RecordedVariablesAndX::X).into());
            }
            moves = true;
            let operand = RecordedVariablesAndX::from_recorded_index(self.columns.find(name)?).into();
            Some(ResolvedSignal { operand, unit: self.units.unit_of_signal(name) })
        })?;
        Ok((function, moves))
    }

    /// The quantity `word` plus so many times its standard deviation.
    pub(super) fn quantity_plus_sigmas(
        &self,
        word: &Spanned<String>,
        sigmas: f64,
        std: &Spanned<String>,
    ) -> Result<RowQuantity, Error> {
        self.parse_quantity(std)?;
        let quoted = |word: &Spanned<String>| match self.columns.find(word.get_ref()) {
            Some(_) => format!("`{}`", word.get_ref()),
            None => format!("({})", word.get_ref()),
        };
        let sum = format!("{} + {sigmas} * {}", quoted(word), quoted(std));
        self.parse_expression(std, &sum, &mut |name| self.find_signal(name)).map(RowQuantity::Formula)
    }

    /// Parses what stands at `word`, or was made of it.
    fn parse_expression<S>(
        &self,
        word: &Spanned<String>,
        text: &str,
        resolve: &mut dyn FnMut(&str) -> Option<ResolvedSignal<S>>,
    ) -> Result<Expression<S>, Error> {
        let parsed = Expression::parse(text, resolve).map_err(|error| {
            let span = match text == word.get_ref() {
                true => span_within(self.scenario, word, error.span.clone()),
                false => word.span(),
            };
            let pointed = self.scenario.source.error_at(span, error.message, "here");
            let cure = error.unitless.map(|it| unit_help(self.scenario, &it.signal, &it.other));
            let hint = error.unknown.as_deref().and_then(|name| self.suggest_signal(name));
            pointed.with_optional_help(hint.or(cure).or(error.help)).with_unknown_name(error.unknown)
        })?;
        if parsed.is_reduction() {
            let message = "expected a value at each moment, found one of the run as a whole";
            return Err(self.error_at(word, message));
        }
        Ok(parsed)
    }

    /// A suggestion for an unknown name.
    fn suggest_signal(&self, name: &str) -> Option<String> {
        suggest::suggest_name(name, self.names.iter().map(String::as_str))
    }
}

/// Whether a text that names no signal was probably meant to.
fn is_name(text: &str) -> bool {
    text.chars().all(|c| c.is_alphanumeric() || "._[],".contains(c)) && text.parse::<f64>().is_err()
}
