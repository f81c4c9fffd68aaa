//! Resolves `[sweep]`: its axes, design, correlations and search.

mod axes;
mod variants;

use std::collections::BTreeSet;

use diagnostics::{Error, ErrorCollector, Spanned};

use super::samples;
use crate::document::{Design, Scenario, Search, Sweep};
use crate::plan::{AxisValues, SearchGoal, SearchPlan, SweepAxis, SweepPlan};
use axes::resolve_axis;
use variants::resolve_variants;

/// The most variants of a sweep.
const MOST: u64 = 100_000_000;
/// The share of the range at which a search ends without a word.
const TOLERANCE: f64 = 1e-3;

/// The variants that a scenario asks for; none without `[sweep]`.
///
/// # Errors
/// All that is wrong with its words, at its places, and files that cannot be read.
pub fn resolve_sweep(scenario: &Scenario) -> Result<Option<SweepPlan>, Error> {
    let Some(sweep) = &scenario.document.sweep else { return Ok(None) };
    let mut mistakes = ErrorCollector::default();
    let axes = mistakes.ok_or_record(resolve_axes(scenario, sweep));
    let variants = mistakes.ok_or_record(variant_count(scenario, sweep));
    let correlations = axes.as_deref().map(|axes| resolve_correlations(scenario, sweep, axes));
    let correlations = correlations.and_then(|it| mistakes.ok_or_record(it));
    let pass_share = mistakes.ok_or_record(pass_share(scenario, sweep));
    let search = sweep.search.as_ref().map(|it| resolve_search(scenario, sweep, it));
    let search = mistakes.ok_or_record(search.transpose());
    mistakes.into_result()?;
    let parts = (axes, variants, correlations, pass_share, search);
    let (Some(axes), Some(variants), Some(correlations), Some(pass_share), Some(search)) = parts else {
        return Err(Error::already_reported());
    };
    let (seed, recorded) = (sweep.seed, sweep.record);
    let design = if sweep.variant.is_empty() { sweep.design } else { Design::List };
    let plan = SweepPlan { design, variants, seed, axes, correlations, pass_share, recorded, search };
    Ok(Some(plan))
}

fn resolve_axes(scenario: &Scenario, sweep: &Sweep) -> Result<Vec<SweepAxis>, Error> {
    if !sweep.variant.is_empty() {
        return resolve_variants(scenario, sweep).map(|axis| vec![axis]);
    }
    if sweep.design == Design::List {
        let Some(file) = &sweep.list else {
            let message =
                "the design `list` needs variants: [[sweep.variant]], or a file: list = \"variants.csv\"";
            return Err(sweep_error(scenario, sweep, message));
        };
        let varied = sweep
            .vary
            .first()
            .map(|it| scenario.error_at(&it.name, "the design `list` has its values from its file alone"));
        return varied.map_or_else(|| samples::variant_list(scenario, file).map(|axis| vec![axis]), Err);
    }
    let mut mistakes = ErrorCollector::default();
    if let Some(file) = &sweep.list {
        let message = "a file of variants goes with design = \"list\"";
        mistakes.push(scenario.error_at(file, message));
    }
    let axes: Vec<_> =
        sweep.vary.iter().filter_map(|it| mistakes.ok_or_record(resolve_axis(scenario, sweep, it))).collect();
    let mut names = BTreeSet::new();
    for (axis, word) in axes.iter().zip(&sweep.vary) {
        if let Some(twice) = axis.names.iter().find(|name| !names.insert(name.as_str())) {
            let message = format!("`{twice}` is varied twice");
            mistakes.push(scenario.source.error_at(word.name.span(), message, "here again"));
        }
    }
    if sweep.vary.is_empty() {
        let message = "nothing is varied";
        mistakes.push(sweep_error(scenario, sweep, message).with_help(
            "add [[sweep.vary]] with a name and its values, such as name = \"plant.body.m\" and values = [700.0, 800.0], or [[sweep.variant]] for each set-up",
        ));
    }
    mistakes.into_result().map(|()| axes)
}

/// An error about the table as a whole, at the first word that is there.
fn sweep_error(scenario: &Scenario, sweep: &Sweep, message: &str) -> Error {
    let index = sweep.variants.as_ref().map(Spanned::span);
    match index {
        Some(index) => scenario.source.error_at(index, format!("[sweep]: {message}"), ""),
        None => {
            let path = scenario.source.main_path().display();
            Error::invalid_input(format!("{path}: [sweep]: {message}"))
        }
    }
}

fn variant_count(scenario: &Scenario, sweep: &Sweep) -> Result<u64, Error> {
    let counts = matches!(sweep.design, Design::Grid | Design::Corners | Design::List);
    match (&sweep.variants, counts) {
        (None, true) => Ok(0),
        (Some(word), true) if sweep.search.is_none() => Err(scenario.error_at(
            word,
            "this design has as many variants as its values make: leave `variants` out, or choose another design",
        )),
        (None, false) => Err(sweep_error(scenario, sweep, "a sample needs a number: variants = 1000")),
        (Some(word), _) if !(1..=MOST).contains(word.get_ref()) => {
            Err(scenario.error_at(word, format!("expected 1 to {MOST} variants")))
        }
        (Some(word), _) => Ok(*word.get_ref()),
    }
}

fn resolve_correlations(
    scenario: &Scenario,
    sweep: &Sweep,
    axes: &[SweepAxis],
) -> Result<Vec<(usize, usize, f64)>, Error> {
    let all = sweep.correlate.iter().map(|correlate| {
        let index = |word: &Spanned<String>| {
            let continuous = |axis: &&SweepAxis| !matches!(axis.values, AxisValues::Levels(_));
            let name = word.get_ref();
            let found = axes.iter().position(|axis| axis.names.first() == Some(name));
            let found = found.filter(|index| continuous(&&axes[*index]));
            found.ok_or_else(|| {
                let message = format!("`{name}` is no distribution that is varied");
                scenario.error_at(word, message)
            })
        };
        let [one, other] = &correlate.between;
        let (one, second) = ErrorCollector::collect_both(index(one), index(other))?;
        let coefficient = *correlate.coefficient.get_ref();
        if one == second || !(-1.0..=1.0).contains(&coefficient) || coefficient.abs() == 1.0 {
            let message = "expected two names, and a coefficient between -1 and 1";
            return Err(scenario.error_at(&correlate.coefficient, message));
        }
        if matches!(sweep.design, Design::Grid | Design::Corners | Design::Saltelli) {
            let message = "a grid, corners and the sample of Saltelli vary each name by itself";
            return Err(scenario.error_at(other, message));
        }
        Ok((one, second, coefficient))
    });
    ErrorCollector::collect_all(all)
}

fn pass_share(scenario: &Scenario, sweep: &Sweep) -> Result<f64, Error> {
    match &sweep.pass_share {
        None => Ok(1.0),
        Some(word) if (0.0..=1.0).contains(word.get_ref()) => Ok(*word.get_ref()),
        Some(word) => Err(scenario.error_at(word, "expected a share from 0 to 1")),
    }
}

fn resolve_search(scenario: &Scenario, sweep: &Sweep, search: &Search) -> Result<SearchPlan, Error> {
    let goal = match (&search.minimise, &search.limit) {
        (Some(word), None) => {
            let (name, largest) = match word.get_ref().strip_prefix('-') {
                Some(name) => (name, true),
                None => (word.get_ref().as_str(), false),
            };
            if !sweep.collect.keys().any(|known| known.get_ref() == name) {
                let message = format!("[sweep.collect] has no value called `{name}`");
                return Err(scenario.error_at(word, message));
            }
            SearchGoal::Extreme { collected: name.to_owned(), largest }
        }
        (None, Some(word)) => {
            if sweep.vary.len() != 1 {
                let message = "a limit is that of one name: vary one";
                return Err(scenario.error_at(word, message));
            }
            let check = search.check.as_ref().map(|check| {
                let known = scenario.document.check.iter();
                match known.clone().any(|it| it.name.get_ref() == check.get_ref()) {
                    true => Ok(check.get_ref().clone()),
                    false => {
                        let message = format!("there is no check called `{}`", check.get_ref());
                        Err(scenario.error_at(check, message))
                    }
                }
            });
            SearchGoal::Limit { side: *word.get_ref(), check: check.transpose()? }
        }
        _ => {
            return Err(sweep_error(scenario, sweep, "a search needs either `minimise` or `limit`"));
        }
    };
    let tolerance = match &search.tolerance {
        None => TOLERANCE,
        Some(word) if *word.get_ref() > 0.0 && *word.get_ref() < 1.0 => *word.get_ref(),
        Some(word) => return Err(scenario.error_at(word, "expected a share between 0 and 1")),
    };
    Ok(SearchPlan { goal, tolerance })
}
