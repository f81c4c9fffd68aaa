//! Checks the description of a signal and makes what it describes.

use std::ops::Range;

use toml::Spanned;

use super::shape::{Rules, Shape};
use super::window::Window;
use super::words::Part;
use super::{Checked, EDGE, Signal, SignalError, error};
use crate::effects::stream_seed;

impl Part {
    /// Checks the description and prepares it for a run that ends at `stop` [s]; `seed` and the
    /// signal's name fix the phases that are random.
    ///
    /// # Errors
    /// When there is not exactly one shape, or a number that the shape cannot have.
    pub fn build(&self, seed: u64, stop: f64) -> Result<Signal, SignalError> {
        let seed = self.name.as_ref().map_or(seed, |name| stream_seed(seed, name.get_ref()));
        if self.part.is_empty() {
            let span = self.name.as_ref().map(Spanned::span);
            let piece = self.piece(span, seed, stop)?;
            return Ok(Signal { parts: vec![piece] });
        }
        if let Some((key, span)) = self.own_keys().into_iter().next() {
            return error(
                Some(span),
                format!("a signal with parts has no `{key}` of its own: move it into the parts"),
            );
        }
        let parts = self.part.iter().enumerate().map(|(index, part)| {
            let (span, part) = (part.span(), part.get_ref());
            if let Some(name) = part.name.as_ref().or(part.unit.as_ref()) {
                let message = "a part has neither name nor unit: give them to the signal";
                return error(Some(name.span()), message);
            }
            if let Some(inner) = part.part.first() {
                let message = "a part has no parts: list them all in the signal";
                return error(Some(inner.span()), message);
            }
            // Multisines of the same signal must not share their phases.
            part.piece(Some(span), seed.wrapping_add(index as u64), stop)
        });
        Ok(Signal { parts: parts.collect::<Result<_, _>>()? })
    }

    /// The window and the shapes that are given.
    fn own_keys(&self) -> Vec<(&'static str, Range<usize>)> {
        let numbers = [
            ("from", &self.from),
            ("until", &self.until),
            ("fade_in", &self.fade_in),
            ("fade_out", &self.fade_out),
        ];
        let given = numbers
            .into_iter()
            .filter_map(|(key, number)| number.as_ref().map(|number| (key, number.span())));
        given.chain(self.shapes()).collect()
    }

    fn shapes(&self) -> Vec<(&'static str, Range<usize>)> {
        let span = |key, span: Option<Range<usize>>| span.map(|span| (key, span));
        let all = [
            span("constant", self.constant.as_ref().map(Spanned::span)),
            span("step", self.step.as_ref().map(Spanned::span)),
            span("ramp", self.ramp.as_ref().map(Spanned::span)),
            span("sine", self.sine.as_ref().map(Spanned::span)),
            span("multisine", self.multisine.as_ref().map(Spanned::span)),
            span("chirp", self.chirp.as_ref().map(Spanned::span)),
            span("square", self.square.as_ref().map(Spanned::span)),
            span("table", self.table.as_ref().map(Spanned::span)),
        ];
        all.into_iter().flatten().collect()
    }

    fn piece(&self, place: Option<Range<usize>>, seed: u64, stop: f64) -> Checked<(Window, Shape)> {
        let shapes = self.shapes();
        let span = match shapes.as_slice() {
            [(_, span)] => span,
            [] => {
                return error(
                    place,
                    "no shape: expected one of constant, step, ramp, sine, multisine, chirp, \
                     square, table, or a list of parts",
                );
            }
            [(first, _), (second, span), ..] => {
                return error(
                    Some(span.clone()),
                    format!(
                        "expected one shape, found `{first}` and `{second}`: \
                         to add them up, give each a part of its own"
                    ),
                );
            }
        };
        let window = self.window(stop)?;
        let shape = self.shape(&window, seed, span)?;
        Ok((window, shape))
    }

    fn window(&self, stop: f64) -> Checked<Window> {
        let number = |key: &str, given: &Option<Spanned<f64>>, absent: f64| match given {
            None => Ok(absent),
            Some(number) if number.get_ref().is_finite() => Ok(*number.get_ref()),
            Some(number) => error(
                Some(number.span()),
                format!("expected a finite time [s] for `{key}`, found {}", number.get_ref()),
            ),
        };
        let window = Window {
            from: number("from", &self.from, 0.0)?,
            until: number("until", &self.until, f64::INFINITY)?,
            fade_in: number("fade_in", &self.fade_in, 0.0)?,
            fade_out: number("fade_out", &self.fade_out, 0.0)?,
            end: number("until", &self.until, stop)?,
        };
        let until = self.until.as_ref().map(Spanned::span);
        if window.until <= window.from {
            let (from, until_value) = (window.from, window.until);
            let message =
                format!("expected `until` after `from` at {from} s, found {until_value} s");
            return error(until, message);
        }
        self.check_fades(&window)?;
        Ok(window)
    }

    fn check_fades(&self, window: &Window) -> Checked<()> {
        let length = window.end - window.from;
        let both = window.fade_in + window.fade_out;
        for (key, given) in [("fade_in", &self.fade_in), ("fade_out", &self.fade_out)] {
            let Some(fade) = given else { continue };
            let (span, fade) = (Some(fade.span()), fade.get_ref());
            if *fade < 0.0 {
                let message =
                    format!("expected a time [s] of at least 0 for `{key}`, found {fade}");
                return error(span, message);
            }
            if both > length + EDGE {
                let message =
                    format!("expected fades within the window of {length} s, found {both} s");
                return error(span, message);
            }
        }
        Ok(())
    }

    fn shape(&self, window: &Window, seed: u64, span: &Range<usize>) -> Checked<Shape> {
        let rules = |shape| Rules { shape, span };
        if let Some(constant) = &self.constant {
            let value = *constant.get_ref();
            rules("constant").finite(&[("constant", value)])?;
            return Ok(Shape::Constant(value));
        }
        if let Some(step) = &self.step {
            return step.get_ref().checked(&rules("step"));
        }
        if let Some(ramp) = &self.ramp {
            return ramp.get_ref().checked(&rules("ramp"));
        }
        if let Some(sine) = &self.sine {
            return sine.get_ref().checked(&rules("sine"));
        }
        if let Some(multisine) = &self.multisine {
            let rules = rules("multisine");
            return multisine.get_ref().checked(&rules, window, seed);
        }
        if let Some(chirp) = &self.chirp {
            return chirp.get_ref().checked(&rules("chirp"));
        }
        if let Some(square) = &self.square {
            return square.get_ref().checked(&rules("square"));
        }
        match &self.table {
            Some(table) => table.get_ref().checked(&rules("table")),
            None => error(Some(span.clone()), "no shape"),
        }
    }
}
