//! Cuts a recording where its time has gaps: nothing is integrated over them.

use numerics::statistics::quantile;
use preparation::{Drive, DriveError, SHORTEST, longest_step};
use serde::Serialize;

/// How a recording was sampled, and what was made of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SamplingReport {
    /// Median step [s].
    pub step: f64,
    /// Smallest and largest step but for gaps [s].
    pub steps: [f64; 2],
    /// Longest step that is no gap [s].
    pub gap: f64,
    /// Times of the rows before and after each gap [s].
    pub gaps: Vec<[f64; 2]>,
    /// Rows that were dropped as they have the time of the row before.
    pub repeated: usize,
    /// Rows of the windows that are not used, as they lie in stretches of less than [`SHORTEST`] rows.
    pub short: usize,
}

/// A recording that is cut at its gaps.
#[derive(Clone, Debug)]
pub struct SegmentedDrive {
    drive: Drive,
    /// What was found.
    pub sampling: SamplingReport,
}

impl SegmentedDrive {
    /// Looks at the times of a recording. Steps longer than `gap` [s] are gaps; without it, those of more than 3.5 usual steps.
    ///
    /// # Errors
    ///
    /// As [`Drive::check_columns`], but for repeated times.
    pub fn new(drive: &Drive, gap: Option<f64>) -> Result<Self, DriveError> {
        drive.check_numbers()?;
        let rows: Vec<usize> = (0..drive.len()).filter(|&k| k == 0 || drive.t[k] != drive.t[k - 1]).collect();
        let repeated = drive.len() - rows.len();
        let drive = if repeated > 0 { drive.select_rows(&rows) } else { drive.clone() };
        drive.check_columns()?;
        let mut steps: Vec<f64> = drive.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let gap = gap.unwrap_or_else(|| longest_step(&drive.t));
        let pairs = drive.t.windows(2).filter(|pair| pair[1] - pair[0] > gap);
        let gaps = pairs.map(|pair| [pair[0], pair[1]]).collect();
        let within = steps.partition_point(|step| *step <= gap);
        let ends = steps[..within].first().zip(steps[..within].last());
        let sampling = SamplingReport {
            step: quantile(&steps, 0.5),
            steps: ends.map_or([f64::NAN; 2], |(first, last)| [*first, *last]),
            gap,
            gaps,
            repeated,
            short: 0,
        };
        Ok(Self { drive, sampling })
    }

    /// The recording without repeated rows.
    pub fn drive_without_duplicate_times(&self) -> &Drive {
        &self.drive
    }

    /// The stretches of marked rows without a gap that are long enough to be used, and the number of marked rows in shorter ones.
    pub fn marked_stretches(&self, marked: &[bool]) -> (Vec<Drive>, usize) {
        let t = &self.drive.t;
        let together = |a: &usize, b: &usize| marked[*a] == marked[*b] && t[*b] - t[*a] <= self.sampling.gap;
        let rows: Vec<usize> = (0..t.len()).collect();
        let stretches = rows.chunk_by(together).filter(|stretch| marked[stretch[0]]);
        let (long, short): (Vec<_>, Vec<_>) = stretches.partition(|stretch| stretch.len() >= SHORTEST);
        let cut = |stretch: &[usize]| self.drive.slice(stretch[0]..stretch[stretch.len() - 1] + 1);
        (long.into_iter().map(cut).collect(), short.iter().map(|stretch| stretch.len()).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drive(times: impl Iterator<Item = f64>) -> Drive {
        let t: Vec<f64> = times.collect();
        let column = vec![1.0; t.len()];
        let [v_x, v_y, r, a_y, F_x, delta] = std::array::from_fn(|_| column.clone());
        Drive { t, v_x, v_y, r, a_y, F_x, delta, ..Drive::default() }
    }

    fn stretches(drive: &Drive, gap: Option<f64>) -> (Vec<[f64; 2]>, SamplingReport) {
        let sampled = SegmentedDrive::new(drive, gap).expect("numbers");
        let (found, short) =
            sampled.marked_stretches(&vec![true; sampled.drive_without_duplicate_times().len()]);
        let ends = |drive: &Drive| [drive.t[0], drive.t[drive.len() - 1]];
        (found.iter().map(ends).collect(), SamplingReport { short, ..sampled.sampling })
    }

    #[test]
    fn a_gap_ends_a_recording() {
        let times = (0..500).map(|k| 0.01 * f64::from(k)).filter(|t| !(1.995..3.0).contains(t));
        let (found, sampling) = stretches(&drive(times), None);
        assert_eq!(found.len(), 2);
        assert!((found[0][1] - 1.99).abs() < 1e-9 && (found[1][0] - 3.0).abs() < 1e-9, "{found:?}");
        assert_eq!(sampling.gaps, [[found[0][1], found[1][0]]]);
        assert!((sampling.gap - 0.035).abs() < 1e-9 && (sampling.step - 0.01).abs() < 1e-9);
    }

    #[test]
    fn jitter_and_lost_rows_are_no_gaps() {
        // ± 40 % of the step, and every 20th row lost.
        let jitter = |k: i32| 0.01 * (f64::from(k) + 0.4 * (f64::from(k) * 2.4).sin());
        let times = (0..2000).filter(|k| k % 20 != 7).map(jitter);
        let (found, sampling) = stretches(&drive(times), None);
        assert_eq!((found.len(), sampling.gaps.len()), (1, 0), "{sampling:?}");
        assert!(sampling.steps[0] < 0.006 && sampling.steps[1] > 0.02, "{sampling:?}");
    }

    #[test]
    fn what_lies_between_many_gaps_is_too_short_and_counted() {
        // 20 rows at 100 Hz, then a second of nothing, again and again; then 3 s at once.
        let bursts = (0..5).flat_map(|burst| (0..20).map(move |k| f64::from(burst) + 0.01 * f64::from(k)));
        let times = bursts.chain((0..300).map(|k| 6.0 + 0.01 * f64::from(k)));
        let (found, sampling) = stretches(&drive(times), None);
        assert_eq!((found.len(), sampling.gaps.len(), sampling.short), (1, 5, 100));
        let (all, sampling) = stretches(&drive((0..100).map(f64::from)), Some(2.0));
        assert_eq!((all.len(), sampling.gap), (1, 2.0));
        let (none, sampling) = stretches(&drive((0..100).map(f64::from)), Some(0.5));
        assert_eq!((none.len(), sampling.gaps.len()), (0, 99));
    }

    #[test]
    fn repeated_times_are_dropped_and_time_that_runs_back_is_refused() {
        let times = (0..200).flat_map(|k| [0.01 * f64::from(k); 2]);
        let (found, sampling) = stretches(&drive(times), None);
        assert_eq!((found.len(), sampling.repeated), (1, 200));
        let back = (0..100).chain(0..100).map(|k| 0.01 * f64::from(k));
        assert!(matches!(SegmentedDrive::new(&drive(back), None), Err(DriveError::Time { row: 100, .. })));
    }
}
