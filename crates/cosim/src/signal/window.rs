//! The window of time of a part of a signal, with its fades.

use std::fmt;

use super::EDGE;

/// A window of time, at whose ends a part of a signal rises from zero and falls to zero.
#[derive(Clone, PartialEq)]
pub struct SignalWindow {
    /// Its beginning [s].
    pub from: f64,
    /// Its end [s].
    pub until: f64,
    /// Duration of the linear rise from zero [s].
    pub fade_in: f64,
    /// Duration of the linear fall to zero [s].
    pub fade_out: f64,
    /// End of the fall [s]: `until`, or the end of the run.
    pub end: f64,
}

/// All that its weight depends on: without a fade-out the end of the run is no part of it.
impl fmt::Debug for SignalWindow {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let SignalWindow { from, until, fade_in, fade_out, end } = self;
        let fades = (*fade_out > 0.0).then_some((fade_out, end));
        write!(out, "{from:?} to {until:?}, {fade_in:?}, {fades:?}")
    }
}

impl SignalWindow {
    /// 0 outside, 1 inside, and between them while it fades.
    pub(super) fn window_weight(&self, time: f64) -> f64 {
        if time + EDGE < self.from || time + EDGE >= self.until {
            return 0.0;
        }
        self.fade_weight(time)
    }

    pub(super) fn fade_weight(&self, time: f64) -> f64 {
        let mut weight = 1.0_f64;
        if self.fade_in > 0.0 {
            weight = weight.min((time - self.from) / self.fade_in);
        }
        if self.fade_out > 0.0 {
            weight = weight.min((self.end - time) / self.fade_out);
        }
        weight.max(0.0)
    }
}
