//! The words of `[[signal]]`: their check, and the signal that they describe.

#[cfg(test)]
mod tests;

use std::ops::Range;

use cosim::effect::stream_seed;
use cosim::for_each_shape;
use cosim::signal::shape::ShapeParameters;
use cosim::signal::{EDGE, Signal, SignalPart, SignalWindow};
use diagnostics::Spanned;
use schemars::JsonSchema;
use serde::Deserialize;

/// A mistake in the description of a signal.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct SignalError {
    /// The expected and the found value, and a remedy.
    pub message: String,
    /// Bytes of the scenario with the wrong value; none when a key is missing.
    pub span: Option<Range<usize>>,
}

fn signal_error<T>(span: Option<Range<usize>>, message: impl Into<String>) -> Result<T, SignalError> {
    let message = message.into();
    Err(SignalError { message, span })
}

macro_rules! part {
    ($($key:ident: $words:ty,)*) => {
        /// A generated signal, or one of the parts that add up to it: one shape in a window of time. Outside `[from, until)`
        /// it is 0; inside, its time counts from `from`.
        ///
        /// ```toml
        /// [[signal]]
        /// name = "driver.steer"
        /// unit = "rad"
        /// from = 1.0
        /// until = 9.0
        /// fade_in = 0.5
        /// sine = { amplitude = 0.05, frequency = 0.5 }
        ///
        /// [[signal]]
        /// name = "driver.torque"
        /// part = [
        ///     { constant = 20.0 },
        ///     { from = 3.0, step = { at = 0.5, after = 100.0 } },
        /// ]
        /// ```
        #[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        #[schemars(rename = "Signal")]
        pub struct Part {
            /// Name of the signal, `node.variable`. Signals with the same node are recorded together. A part has no name.
            #[schemars(example = &"driver.steer")]
            pub name: Option<Spanned<String>>,
            /// Unit of the signal. A part has no unit.
            #[schemars(example = &"rad")]
            pub unit: Option<Spanned<String>>,
            /// Beginning of the window [s]; 0 without it.
            #[schemars(example = 1.0)]
            pub from: Option<Spanned<f64>>,
            /// End of the window [s]; the end of the run without it.
            #[schemars(example = 9.0)]
            pub until: Option<Spanned<f64>>,
            /// Duration of the linear rise from zero at `from` [s].
            #[schemars(example = 0.5)]
            pub fade_in: Option<Spanned<f64>>,
            /// Duration of the linear fall to zero at `until` or at the end of the run [s].
            #[schemars(example = 0.5)]
            pub fade_out: Option<Spanned<f64>>,
            $(
                #[allow(missing_docs, reason = "the words of the shape are documented with their type")]
                pub $key: Option<Spanned<$words>>,
            )*
            /// Parts that add up to the signal, instead of a shape. A part has the keys of a signal but `name`, `unit` and
            /// `part`.
            #[serde(default)]
            pub part: Vec<Spanned<Part>>,
        }

        impl Part {
            /// The keys of all shapes.
            const SHAPES: &[&str] = &[$(stringify!($key)),*];

            /// The given shapes: key, place, words.
            fn shapes(&self) -> Vec<(&'static str, Range<usize>, &dyn ShapeParameters)> {
                let mut shapes: Vec<(_, _, &dyn ShapeParameters)> = Vec::new();
                $(shapes.extend(
                    self.$key.as_ref().map(|it| (stringify!($key), it.span(), it.get_ref() as _)),
                );)*
                shapes
            }
        }
    };
}
for_each_shape!(part);

impl Part {
    /// Checks the description for a run that ends at `stop` [s]. `seed` and the signal's name fix random phases.
    ///
    /// # Errors
    /// When there is no shape or several, or a number is out of its range.
    pub fn build(&self, seed: u64, stop: f64) -> Result<Signal, SignalError> {
        let seed = self.name.as_ref().map_or(seed, |name| stream_seed(seed, name.get_ref()));
        if self.part.is_empty() {
            let span = self.name.as_ref().map(Spanned::span);
            let piece = self.build_piece(span, seed, stop)?;
            return Ok(Signal::new(vec![piece]));
        }
        if let Some((key, span)) = self.given_keys().into_iter().next() {
            return signal_error(
                Some(span),
                format!("a signal with parts has no `{key}` of its own: move it into the parts"),
            );
        }
        let parts = self.part.iter().enumerate().map(|(index, part)| {
            let (span, part) = (part.span(), part.get_ref());
            if let Some(name) = part.name.as_ref().or(part.unit.as_ref()) {
                let message = "a part has neither name nor unit: give them to the signal";
                return signal_error(Some(name.span()), message);
            }
            if let Some(inner) = part.part.first() {
                let message = "a part has no parts: list them all in the signal";
                return signal_error(Some(inner.span()), message);
            }
            // Multisines of the same signal must not share their phases.
            part.build_piece(Some(span), seed.wrapping_add(index as u64), stop)
        });
        Ok(Signal::new(parts.collect::<Result<_, _>>()?))
    }

    /// The given keys of the window and of shapes.
    fn given_keys(&self) -> Vec<(&'static str, Range<usize>)> {
        let numbers = [
            ("from", &self.from),
            ("until", &self.until),
            ("fade_in", &self.fade_in),
            ("fade_out", &self.fade_out),
        ];
        let given = numbers
            .into_iter()
            .filter_map(|(key, number)| number.as_ref().map(|number| (key, number.span())));
        given.chain(self.shapes().into_iter().map(|(key, span, _)| (key, span))).collect()
    }

    fn build_piece(
        &self,
        place: Option<Range<usize>>,
        seed: u64,
        stop: f64,
    ) -> Result<SignalPart, SignalError> {
        let shapes = self.shapes();
        let (shape, span, words) = match shapes.as_slice() {
            [one] => one,
            [] => {
                let shapes = Self::SHAPES.join(", ");
                let message = format!("no shape: expected one of {shapes}, or a list of parts");
                return signal_error(place, message);
            }
            [(first, ..), (second, span, _), ..] => {
                return signal_error(
                    Some(span.clone()),
                    format!(
                        "expected one shape, found `{first}` and `{second}`: \
                         to add them up, give each a part of its own"
                    ),
                );
            }
        };
        let window = self.parse_window(stop)?;
        SignalPart::new(*words, window, seed)
            .or_else(|message| signal_error(Some(span.clone()), format!("{shape}: {message}")))
    }

    fn parse_window(&self, stop: f64) -> Result<SignalWindow, SignalError> {
        let number = |key: &str, given: &Option<Spanned<f64>>, absent: f64| match given {
            None => Ok(absent),
            Some(number) if number.get_ref().is_finite() => Ok(*number.get_ref()),
            Some(number) => signal_error(
                Some(number.span()),
                format!("expected a finite time [s] for `{key}`, found {}", number.get_ref()),
            ),
        };
        let window = SignalWindow {
            from: number("from", &self.from, 0.0)?,
            until: number("until", &self.until, f64::INFINITY)?,
            fade_in: number("fade_in", &self.fade_in, 0.0)?,
            fade_out: number("fade_out", &self.fade_out, 0.0)?,
            end: number("until", &self.until, stop)?,
        };
        let until = self.until.as_ref().map(Spanned::span);
        if window.until <= window.from {
            let (from, until_value) = (window.from, window.until);
            let message = format!("expected `until` after `from` at {from} s, found {until_value} s");
            return signal_error(until, message);
        }
        self.check_fades(&window)?;
        Ok(window)
    }

    fn check_fades(&self, window: &SignalWindow) -> Result<(), SignalError> {
        let length = window.end - window.from;
        let both = window.fade_in + window.fade_out;
        for (key, given) in [("fade_in", &self.fade_in), ("fade_out", &self.fade_out)] {
            let Some(fade) = given else { continue };
            let (span, fade) = (Some(fade.span()), fade.get_ref());
            if *fade < 0.0 {
                let message = format!("expected a time [s] of at least 0 for `{key}`, found {fade}");
                return signal_error(span, message);
            }
            if both > length + EDGE {
                let message = format!("expected fades within the window of {length} s, found {both} s");
                return signal_error(span, message);
            }
        }
        Ok(())
    }
}
