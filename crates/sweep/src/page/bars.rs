//! Places the effects on a result as bars with their intervals, for `bars.html`.

use html_page::PlotAxis;

use super::shortened_name;
use crate::statistics::Estimate;
use crate::summary::{ParameterEffect, ResultEffects, SensitivityMethod};

/// Values that are drawn; the rest is weaker.
const MOST: usize = 12;
/// Sizes [px]: of the figure, of the names beside the bars, where the numbers behind them begin, of a row, of the axis below.
pub const WIDTH: f64 = 520.0;
pub const NAMES: f64 = 190.0;
pub const NUMBERS: f64 = 432.0;
const ROW: f64 = 24.0;
const AXIS: f64 = 26.0;
/// Letters of a name that have room, of 7 px each.
const LETTERS: usize = 26;

/// The figure of a result.
pub struct EffectBarChart<'a> {
    pub output: &'a ResultEffects,
    axis: PlotAxis,
}

/// What one value does.
pub struct EffectRow<'a> {
    pub effect: &'a ParameterEffect,
    /// Height of its middle [px].
    pub middle: f64,
    pub bars: Vec<EffectBar>,
}

/// From 0 to a value, and a line over its interval [px].
pub struct EffectBar {
    pub class: &'static str,
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
    pub line: f64,
    pub interval: [f64; 2],
}

impl<'a> EffectBarChart<'a> {
    pub fn new(output: &'a ResultEffects) -> Self {
        let low = if output.method == SensitivityMethod::Indices { 0.0 } else { -1.0 };
        Self { output, axis: PlotAxis::linear("", low, 1.0) }
    }

    pub fn shown_effects(&self) -> &'a [ParameterEffect] {
        &self.output.effects[..self.output.effects.len().min(MOST)]
    }

    /// Where the bars end below [px].
    pub fn bars_bottom(&self) -> f64 {
        ROW * self.shown_effects().len() as f64
    }

    pub fn chart_height(&self) -> f64 {
        self.bars_bottom() + AXIS
    }

    pub fn x_of_value(&self, value: &f64) -> f64 {
        NAMES + self.axis.relative_position(*value).clamp(0.0, 1.0) * (NUMBERS - NAMES)
    }

    pub fn ticks(&self) -> Vec<(f64, String)> {
        self.axis.ticks(NUMBERS - NAMES, 50.0, |text| 7.0 * text.len() as f64)
    }

    pub fn effect_rows(&self) -> impl Iterator<Item = EffectRow<'a>> {
        self.shown_effects().iter().enumerate().map(|(row, effect)| {
            let top = ROW * row as f64;
            let total = effect.total.map(|it| self.effect_bar("total", it, top, 3.0));
            let first = self.effect_bar("first", effect.estimate, top, 6.0);
            let bars = total.into_iter().chain([first]).collect();
            EffectRow { effect, middle: top + 0.5 * ROW, bars }
        })
    }

    /// A bar in the row that begins at `top`, `space` from its edges [px].
    fn effect_bar(&self, class: &'static str, estimate: Estimate, top: f64, space: f64) -> EffectBar {
        let [from, to] = [self.x_of_value(&0.0), self.x_of_value(&estimate.value)];
        EffectBar {
            class,
            left: from.min(to),
            top: top + space,
            width: (to - from).abs(),
            height: ROW - 2.0 * space,
            line: if class == "total" { top + space + 1.0 } else { top + 0.5 * ROW },
            interval: estimate.interval.map(|end| self.x_of_value(&end)),
        }
    }

    /// What the effects rest on, where something is left out.
    pub fn left_out_note(&self) -> String {
        let ResultEffects { method, used, left_out, .. } = self.output;
        let kind = if *method == SensitivityMethod::Indices { "blocks" } else { "variants" };
        match left_out {
            0 => String::new(),
            _ => format!(" {left_out} of {} {kind} left out: no result", used + left_out),
        }
    }
}

impl EffectRow<'_> {
    pub fn parameter_label(&self) -> String {
        shortened_name(&self.effect.parameter, LETTERS)
    }

    /// The effect, of indices first and total.
    pub fn effect_text(&self) -> String {
        let number = |estimate: Estimate| {
            let text = format!("{:.2}", estimate.value);
            if text == "-0.00" { "0.00".to_owned() } else { text.replace('-', "−") }
        };
        let all = std::iter::once(self.effect.estimate).chain(self.effect.total);
        all.map(number).collect::<Vec<_>>().join(" / ")
    }
}
