//! Finds the samples that a curve needs to look as it does with all of them.

/// A dropped sample is at most this share of the range of all samples beside the drawn line: a pixel of a plot of 800 pixels.
const TOLERANCE: f64 = 1.25e-3;
/// Time between kept samples at most [s]. It keeps lines straight over distance, where time has no constant speed.
const GAP: f64 = 0.4;

/// How a curve goes from one sample to the next.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Course {
    Straight,
    Stepped,
}

/// The range of a curve so far.
#[derive(Clone, Copy)]
pub(super) struct Span {
    pub low: f64,
    pub high: f64,
}

impl Default for Span {
    fn default() -> Self {
        Self { low: f64::INFINITY, high: f64::NEG_INFINITY }
    }
}

impl Span {
    /// The range with these values. What is no number does not count.
    pub fn with(self, values: impl IntoIterator<Item = f64>) -> Self {
        let finite = values.into_iter().filter(|value| value.is_finite());
        finite.fold(self, |it, value| Self { low: it.low.min(value), high: it.high.max(value) })
    }

    /// Its ends, unless there was no number.
    pub fn ends(self) -> Option<[f64; 2]> {
        (self.low <= self.high).then_some([self.low, self.high])
    }
}

/// The indices of the samples to keep, of samples at rising times [s]; the first and the last are among them.
pub(super) fn kept(times: &[f64], samples: &[f64], course: Course, span: Span) -> Vec<usize> {
    let Some(end) = samples.len().checked_sub(1) else { return Vec::new() };
    let tolerance = span.ends().map_or(0.0, |[low, high]| TOLERANCE * (high - low));
    let mut kept = vec![0];
    let mut open = Opening::default();
    for at in 1..=end {
        let before = at - 1;
        let last = kept[kept.len() - 1];
        let fits = times[at] - times[last] < GAP
            && match course {
                Course::Straight => {
                    open.admits(times[at] - times[last], samples[at] - samples[last], tolerance)
                }
                Course::Stepped => samples[at] == samples[last],
            };
        if !fits {
            if before > last {
                kept.push(before);
            }
            // A line from the sample before, which may leave its neighbourhood at once.
            open = Opening::default();
            let leaves = match course {
                Course::Straight => !open.admits(
                    times[at] - times[before],
                    samples[at] - samples[before],
                    tolerance,
                ),
                Course::Stepped => true,
            };
            if leaves {
                kept.push(at);
                open = Opening::default();
            }
        }
    }
    if kept[kept.len() - 1] != end {
        kept.push(end);
    }
    kept
}

/// The slopes of lines from the last kept sample that pass all samples since within the tolerance.
struct Opening {
    low: f64,
    high: f64,
}

impl Default for Opening {
    fn default() -> Self {
        Self { low: f64::NEG_INFINITY, high: f64::INFINITY }
    }
}

impl Opening {
    /// Whether a line to this sample, given by its distance from the kept one, is among them; then it narrows them.
    fn admits(&mut self, time: f64, rise: f64, tolerance: f64) -> bool {
        // False for what is no number: it is kept, and so is the gap that it leaves.
        let inside = (self.low..=self.high).contains(&(rise / time));
        self.low = self.low.max((rise - tolerance) / time);
        self.high = self.high.min((rise + tolerance) / time);
        inside
    }
}

#[cfg(test)]
mod tests {
    use super::{Course, GAP, Span, TOLERANCE, kept};

    fn thinned(samples: &[f64], course: Course) -> Vec<usize> {
        let times: Vec<_> = (0..samples.len()).map(|it| 0.01 * it as f64).collect();
        kept(&times, samples, course, Span::default().with(samples.iter().copied()))
    }

    #[test]
    fn a_line_through_the_kept_samples_passes_all_others() {
        let samples: Vec<_> =
            (0..2_000).map(|it| (0.01 * f64::from(it)).sin() + f64::from(it % 700 / 600)).collect();
        let kept = thinned(&samples, Course::Straight);
        assert!(kept.len() < samples.len() / 10, "{} kept", kept.len());
        assert_eq!((kept[0], kept[kept.len() - 1]), (0, 1_999));
        for pair in kept.windows(2) {
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
        assert_eq!(thinned(&[0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0], Course::Stepped), [0, 2, 3, 4, 6]);
        let nan = f64::NAN;
        assert_eq!(
            thinned(&[0.0, 0.0, 0.0, nan, nan, 0.0, 0.0], Course::Straight),
            [0, 2, 3, 4, 5, 6]
        );
        assert_eq!(thinned(&[], Course::Straight), [0; 0]);
        assert_eq!(thinned(&[1.0], Course::Stepped), [0]);
        // Constant: one sample in each gap.
        assert_eq!(thinned(&[1.0; 81], Course::Straight).len(), 4);
    }
}
