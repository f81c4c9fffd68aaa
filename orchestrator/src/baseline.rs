//! Reads the baselines of a scenario, plots the deviations of a run from them, and writes new ones when the user asks for it.

pub mod bless;

use std::path::{Path, PathBuf};

use assessment::BaselinePlan;
use assessment::baseline::{
    BaselineChecker, BaselineComparison, BaselineOutcome, SignalOutcome, TubeDeviation,
};
use diagnostics::Error;
use html_page::{Plot, PlotAxis};
use recording::{ColumnIndex, GoldenRecording};
use scenario::Scenario;
use scenario::plan::RunPlan;

use crate::baseline_change::BaselineChange;
use crate::nofollow;
use crate::report::RunReport;

/// Signals in a picture; the others are in the report.
const DRAWN: usize = 4;
/// Points of a curve in a picture.
const POINTS: usize = 2000;

/// Reads the recordings that the run is compared with.
///
/// # Errors
/// At the word that names one, when it is not there or cannot be read.
pub(crate) fn read_baselines(scenario: &Scenario, plan: &RunPlan) -> Result<BaselineChecker, Error> {
    let golden = |plan: &BaselinePlan| -> Result<(BaselinePlan, GoldenRecording), Error> {
        let wrong = |message: String| scenario.source.error_at(plan.place.clone(), message, "");
        if !plan.path.exists() {
            let (path, file) = (plan.path.display(), scenario.source.main_path().display());
            let help = format!("`trackside run {file} --bless` writes it from a run that is right");
            return Err(wrong(format!("there is no baseline {path}")).with_help(help));
        }
        let golden = read_recording(plan).map_err(|error| wrong(error.to_string()))?;
        Ok((plan.clone(), golden))
    };
    let read = diagnostics::ErrorCollector::collect_all(plan.baselines.iter().map(golden))?;
    Ok(BaselineChecker::new(read, &plan.system.columns, plan.system.clock.step))
}

fn read_recording(plan: &BaselinePlan) -> Result<GoldenRecording, Error> {
    let texts = plan.signals.iter().filter(|it| matches!(it.column, ColumnIndex::Text(_)));
    let texts: Vec<_> = texts.map(|signal| signal.name.as_str()).collect();
    GoldenRecording::read(&plan.path, &texts)
}

/// Reads the recordings that the run will replace, as far as they are there, to say what changes; the others come as changes without a
/// comparison.
pub(crate) fn read_replaced_baselines(plan: &RunPlan) -> (BaselineChecker, Vec<BaselineChange>) {
    let (mut read, mut others) = (Vec::new(), Vec::new());
    for baseline in &plan.baselines {
        match baseline.path.exists().then(|| read_recording(baseline)) {
            Some(Ok(golden)) => read.push((baseline.clone(), golden)),
            Some(Err(error)) => {
                others.push(BaselineChange::without_comparison(baseline, Some(error.to_string())))
            }
            None => others.push(BaselineChange::without_comparison(baseline, None)),
        }
    }
    (BaselineChecker::new(read, &plan.system.columns, plan.system.clock.step), others)
}

/// What to do about a recording that a baseline would replace, see [`foreign_recording`].
pub(crate) const FORCE: &str = "name another file in `recording`, or replace this one with `--force`";

/// Says that a recording at the place of a new baseline is not as a run of this program left it: it may be a measured log.
pub(crate) fn foreign_recording(path: &Path) -> Option<String> {
    let message =
        || format!("{} was not written by --bless, or changed since: it is not replaced", path.display());
    (path.exists() && !attribution::is_blessed_recording(path)).then(message)
}

/// Refuses to replace recordings that no run of this program left.
///
/// # Errors
/// At the words that name them.
pub(crate) fn check_replaceable(scenario: &Scenario, plan: &RunPlan) -> Result<(), Error> {
    let check = |plan: &BaselinePlan| match foreign_recording(&plan.path) {
        Some(message) => Err(scenario.source.error_at(plan.place.clone(), message, "").with_help(FORCE)),
        None => Ok(()),
    };
    diagnostics::ErrorCollector::collect_all(plan.baselines.iter().map(check)).map(drop)
}

/// Whether a baseline is a table, for which the run has to write one.
pub(crate) fn is_csv_recording_needed(plan: &RunPlan) -> bool {
    plan.baselines.iter().any(|plan| recording_file_name(plan) == "run.csv")
}

/// The recording of a run that has the form of the baseline.
fn recording_file_name(plan: &BaselinePlan) -> &'static str {
    if plan.path.extension().is_some_and(|it| it == "csv") { "run.csv" } else { "run.mcap" }
}

/// Copies the recordings of the run to the places of its baselines, and notes them in the report. A run that fails is no
/// baseline.
///
/// # Errors
/// When one cannot be written.
pub(crate) fn replace_baselines_by_run(plan: &RunPlan, report: &mut RunReport) -> Result<(), Error> {
    if plan.baselines.is_empty() {
        report.warnings.push("the scenario has no [[baseline]] to write".to_owned());
    }
    if !report.verdict.is_success() {
        let names = plan.baselines.iter().map(|plan| {
            format!("the baseline {} was not written: the run did not pass", plan.path.display())
        });
        report.warnings.extend(names);
        return Ok(());
    }
    for plan in &plan.baselines {
        replace_baseline(&report.folder.join(recording_file_name(plan)), &plan.path)?;
        report.blessed.push(plan.path.clone());
    }
    Ok(())
}

/// Copies a recording to the place of a baseline, which is there as a whole or not at all, and the inputs of its run beside it.
fn replace_baseline(recording: &Path, path: &Path) -> Result<(), Error> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let partial: PathBuf = path.with_extension("partial");
    std::fs::create_dir_all(folder).map_err(|error| Error::output_failure(folder, error))?;
    std::fs::copy(recording, &partial)
        .and_then(|_| std::fs::rename(&partial, path))
        .map_err(|error| Error::output_failure(path, error))?;
    attribution::save_baseline_inputs(recording.parent().unwrap_or(Path::new("")), path)
}

/// Draws each baseline that the run left, and notes the pictures in the report.
///
/// # Errors
/// When a picture cannot be written.
pub(crate) fn draw_baseline_plots(baselines: &BaselineChecker, report: &mut RunReport) -> Result<(), Error> {
    for outcome in &mut report.baselines {
        let plots: Vec<_> = first_deviating_signals(outcome)
            .filter_map(|(signal, first)| {
                let comparison = baselines.signal_comparison(&outcome.name, &signal.signal)?;
                let plot = baseline_deviation_plot(&comparison, signal, first);
                Some((
                    format!("{}: the run (orange) and the tube of “{}” (blue)", signal.signal, outcome.name),
                    plot,
                ))
            })
            .collect();
        if plots.is_empty() {
            continue;
        }
        let name = file_name(&outcome.name, &report.files);
        let path = report.folder.join(&name);
        nofollow::write_without_following_links(&path, html_page::plots_to_svg_file(&plots))
            .map_err(|error| Error::output_failure(&path, error))?;
        report.files.push(name.clone());
        outcome.picture = Some(name);
    }
    Ok(())
}

/// The name of a picture, other than those of the files that are there.
fn file_name(baseline: &str, files: &[String]) -> String {
    let plain = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
    let mut stem = format!("baseline_{}", baseline.chars().map(plain).collect::<String>());
    while files.iter().any(|file| *file == format!("{stem}.svg")) {
        stem.push('_');
    }
    stem + ".svg"
}

/// The signals that left their tube first.
fn first_deviating_signals(
    outcome: &BaselineOutcome,
) -> impl Iterator<Item = (&SignalOutcome, TubeDeviation)> {
    let failed = outcome.signals.iter().filter_map(|signal| Some((signal, signal.first?)));
    let mut failed: Vec<_> = failed.collect();
    failed.sort_by(|(_, a), (_, b)| a.time.total_cmp(&b.time));
    failed.into_iter().take(DRAWN)
}

/// A signal and its tube around the first and the worst deviation.
fn baseline_deviation_plot(
    comparison: &BaselineComparison,
    signal: &SignalOutcome,
    first: TubeDeviation,
) -> Plot {
    let worst = signal.worst.unwrap_or(first);
    let BaselineComparison { times, values, bounds, .. } = comparison;
    let [begin, end] = [times[0], times[times.len() - 1]];
    let around = (0.1 * (end - begin)).max((worst.time - first.time).abs() * 0.2);
    let from = (first.time.min(worst.time) - around).max(begin);
    let to = (first.time.max(worst.time) + around).min(end);
    let rows: Vec<_> = (0..times.len()).filter(|row| (from..=to).contains(&times[*row])).collect();
    let rows: Vec<_> = rows.iter().copied().step_by(rows.len() / POINTS + 1).collect();
    let unit = signal.unit.as_ref().map(|unit| format!(" [{unit}]")).unwrap_or_default();
    let band: Vec<_> = rows.iter().filter_map(|row| Some((times[*row], bounds[*row]?))).collect();
    let line: Vec<_> = rows.iter().map(|row| (times[*row], values[*row])).collect();
    let marks = [(first.time, first.value), (worst.time, worst.value)];
    let heights = band.iter().flat_map(|(_, ends)| *ends);
    let heights = heights.chain(line.iter().chain(&marks).map(|(_, value)| *value));
    let y = PlotAxis::around_values(&format!("{}{unit}", signal.signal), heights);
    let mut plot = Plot::new([720.0, 240.0], PlotAxis::linear("time [s]", from, to), y);
    plot.add_band(&band, "c0", "tube");
    // A narrow tube is seen by its edges.
    for end in [0, 1] {
        let edge: Vec<_> = band.iter().map(|(time, ends)| (*time, ends[end])).collect();
        plot.add_line(&edge, "c0", "");
    }
    plot.add_line(&line, "c1", "run");
    plot.add_dots(&marks, 4.0, "c1", "");
    plot
}
