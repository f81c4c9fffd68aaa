//! Decimates the samples of a curve by the swinging-door algorithm (Bristol 1990): what is left looks the same on a screen.

/// A dropped sample is at most this share of the range of all samples beside the drawn line: a pixel of a plot of 800 pixels.
const TOLERANCE: f64 = 1.25e-3;
/// Time between kept samples at most [s]. It keeps lines straight over distance, where time has no constant speed.
const GAP: f64 = 0.4;

/// Interpolation of a curve between its samples.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Interpolation {
    Linear,
    Hold,
}

/// The lowest and the highest value of a curve so far.
#[derive(Clone, Copy)]
pub(super) struct ValueRange {
    pub low: f64,
    pub high: f64,
}

impl Default for ValueRange {
    fn default() -> Self {
        Self { low: f64::INFINITY, high: f64::NEG_INFINITY }
    }
}

impl ValueRange {
    /// The range with these values. What is no number does not count.
    pub fn extended_by(self, values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        finite.fold(self, |it, value| Self { low: it.low.min(value), high: it.high.max(value) })
    }

    /// Its ends, unless there was no number.
    pub fn low_and_high(self) -> Option<[f64; 2]> {
        (self.low <= self.high).then_some([self.low, self.high])
    }
}

/// The indices of the samples to keep, of samples at rising times [s]; the first and the last are among them.
pub(super) fn swinging_door_indices(
    times: &[f64],
    samples: &[f64],
    interpolation: Interpolation,
    span: ValueRange,
) -> Vec<usize> {
    let Some(end) = samples.len().checked_sub(1) else { return Vec::new() };
    let tolerance = span.low_and_high().map_or(0.0, |[low, high]| TOLERANCE * (high - low));
    let mut indices = vec![0];
    let mut open = SlopeWindow::default();
    for at in 1..=end {
        let before = at - 1;
        let last = indices[indices.len() - 1];
        let fits = times[at] - times[last] < GAP
            && match interpolation {
                Interpolation::Linear => {
                    open.narrow_if_admitted(times[at] - times[last], samples[at] - samples[last], tolerance)
                }
                Interpolation::Hold => samples[at] == samples[last],
            };
        if !fits {
            if before > last {
                indices.push(before);
            }
            // A line from the sample before, which may leave its neighbourhood at once.
            open = SlopeWindow::default();
            let leaves = match interpolation {
                Interpolation::Linear => !open.narrow_if_admitted(
                    times[at] - times[before],
                    samples[at] - samples[before],
                    tolerance,
                ),
                Interpolation::Hold => true,
            };
            if leaves {
                indices.push(at);
                open = SlopeWindow::default();
            }
        }
    }
    if indices[indices.len() - 1] != end {
        indices.push(end);
    }
    indices
}

/// The slopes of lines from the last kept sample that pass all samples since within the tolerance.
struct SlopeWindow {
    low: f64,
    high: f64,
}

impl Default for SlopeWindow {
    fn default() -> Self {
        Self { low: f64::NEG_INFINITY, high: f64::INFINITY }
    }
}

impl SlopeWindow {
    /// Whether a line to this sample, given by its distance from the kept one, is among them; then it narrows them.
    fn narrow_if_admitted(&mut self, time: f64, rise: f64, tolerance: f64) -> bool {
        // False for what is no number: it is kept, and so is the gap that it leaves.
        let inside = (self.low..=self.high).contains(&(rise / time));
        self.low = self.low.max((rise - tolerance) / time);
        self.high = self.high.min((rise + tolerance) / time);
        inside
    }
}

#[cfg(test)]
mod tests {
    use super::{GAP, Interpolation, TOLERANCE, ValueRange, swinging_door_indices};

    fn retained(samples: &[f64], interpolation: Interpolation) -> Vec<usize> {
        let times: Vec<_> = (0..samples.len()).map(|it| 0.01 * it as f64).collect();
        swinging_door_indices(
            &times,
            samples,
            interpolation,
            ValueRange::default().extended_by(samples.iter().copied()),
        )
    }

    #[test]
    fn a_line_through_the_kept_samples_passes_all_others() {
        let samples: Vec<_> =
            (0..2_000).map(|it| (0.01 * f64::from(it)).sin() + f64::from(it % 700 / 600)).collect();
        let indices = retained(&samples, Interpolation::Linear);
        assert!(indices.len() < samples.len() / 10, "{} kept", indices.len());
        assert_eq!((indices[0], indices[indices.len() - 1]), (0, 1_999));
        for pair in indices.windows(2) {
            let [from, to] = [pair[0], pair[1]];
            assert!((to - from) as f64 * 0.01 <= GAP + 1e-9);
            for at in from..to {
                let share = (at - from) as f64 / (to - from) as f64;
                let drawn = samples[from] + share * (samples[to] - samples[from]);
                // The range is 3 at most.
                assert!((samples[at] - drawn).abs() <= 3.0 * TOLERANCE, "at {at}");
            }
        }
    }

    #[test]
    fn every_step_and_every_gap_is_kept() {
        assert_eq!(retained(&[0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0], Interpolation::Hold), [0, 2, 3, 4, 6]);
        let nan = f64::NAN;
        assert_eq!(retained(&[0.0, 0.0, 0.0, nan, nan, 0.0, 0.0], Interpolation::Linear), [0, 2, 3, 4, 5, 6]);
        assert_eq!(retained(&[], Interpolation::Linear), [0; 0]);
        assert_eq!(retained(&[1.0], Interpolation::Hold), [0]);
        // Constant: one sample in each gap.
        assert_eq!(retained(&[1.0; 81], Interpolation::Linear).len(), 4);
    }
}
