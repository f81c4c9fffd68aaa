//! Resolves `[sweep]`: its axes, design, correlations and search.

mod axes;

use std::collections::BTreeSet;

use diagnostics::{Error, Mistakes, Spanned};

use super::samples;
use crate::document::{Design, Scenario, Search, Sweep};
use crate::plan::{Axis, AxisValues, Goal, SearchPlan, SweepPlan};
use axes::axis;

/// The most variants of a sweep.
const MOST: u64 = 100_000_000;
/// The share of the range at which a search ends without a word.
const TOLERANCE: f64 = 1e-3;

/// The variants that a scenario asks for; none without `[sweep]`.
///
/// # Errors
/// All that is wrong with its words, at its places, and files that cannot be read.
pub fn sweep(scenario: &Scenario) -> Result<Option<SweepPlan>, Error> {
    let Some(sweep) = &scenario.document.sweep else { return Ok(None) };
    let mut mistakes = Mistakes::default();
    let axes = mistakes.take(axes(scenario, sweep));
    let variants = mistakes.take(variants(scenario, sweep));
    let correlations = axes.as_deref().map(|axes| correlations(scenario, sweep, axes));
    let correlations = correlations.and_then(|it| mistakes.take(it));
    let pass_share = mistakes.take(pass_share(scenario, sweep));
    let search = sweep.search.as_ref().map(|it| search(scenario, sweep, it));
    let search = mistakes.take(search.transpose());
    mistakes.finish()?;
    let parts = (axes, variants, correlations, pass_share, search);
    let (Some(axes), Some(variants), Some(correlations), Some(pass_share), Some(search)) = parts
    else {
        return Err(Error::follow_up());
    };
    let (design, seed, recorded) = (sweep.design, sweep.seed, sweep.record);
    let plan =
        SweepPlan { design, variants, seed, axes, correlations, pass_share, recorded, search };
    Ok(Some(plan))
}

fn axes(scenario: &Scenario, sweep: &Sweep) -> Result<Vec<Axis>, Error> {
    if sweep.design == Design::List {
        let Some(file) = &sweep.list else {
            let message = "the design `list` needs a file: list = \"variants.csv\"";
            return Err(at_sweep(scenario, sweep, message));
        };
        let varied = sweep.vary.first().map(|it| {
            scenario.error(&it.name, "the design `list` has its values from its file alone")
        });
        return varied
            .map_or_else(|| samples::variant_list(scenario, file).map(|axis| vec![axis]), Err);
    }
    let mut mistakes = Mistakes::default();
    if let Some(file) = &sweep.list {
        let message = "a file of variants goes with design = \"list\"";
        mistakes.push(scenario.error(file, message));
    }
    let axes: Vec<_> =
        sweep.vary.iter().filter_map(|it| mistakes.take(axis(scenario, sweep, it))).collect();
    let mut names = BTreeSet::new();
    for (axis, word) in axes.iter().zip(&sweep.vary) {
        if let Some(twice) = axis.names.iter().find(|name| !names.insert(name.as_str())) {
            let message = format!("`{twice}` is varied twice");
            mistakes.push(scenario.source.error(word.name.span(), message, "here again"));
        }
    }
    if sweep.vary.is_empty() {
        let message = "nothing is varied";
        mistakes.push(at_sweep(scenario, sweep, message).help(
            "add [[sweep.vary]] with a name and its values, such as name = \"plant.body.m\" and values = [700.0, 800.0]",
        ));
    }
    mistakes.finish().map(|()| axes)
}

/// An error about the table as a whole, at the first word that is there.
fn at_sweep(scenario: &Scenario, sweep: &Sweep, message: &str) -> Error {
    let index = sweep.variants.as_ref().map(Spanned::span);
    match index {
        Some(index) => scenario.source.error(index, format!("[sweep]: {message}"), ""),
        None => {
            let path = scenario.source.path().display();
            Error::input(format!("{path}: [sweep]: {message}"))
        }
    }
}

fn variants(scenario: &Scenario, sweep: &Sweep) -> Result<u64, Error> {
    let counts = matches!(sweep.design, Design::Grid | Design::Corners | Design::List);
    match (&sweep.variants, counts) {
        (None, true) => Ok(0),
        (Some(word), true) if sweep.search.is_none() => Err(scenario.error(
            word,
            "this design has as many variants as its values make: leave `variants` out, or choose another design",
        )),
        (None, false) => {
            Err(at_sweep(scenario, sweep, "a sample needs a number: variants = 1000"))
        }
        (Some(word), _) if !(1..=MOST).contains(word.get_ref()) => {
            Err(scenario.error(word, format!("expected 1 to {MOST} variants")))
        }
        (Some(word), _) => Ok(*word.get_ref()),
    }
}

fn correlations(
    scenario: &Scenario,
    sweep: &Sweep,
    axes: &[Axis],
) -> Result<Vec<(usize, usize, f64)>, Error> {
    let all = sweep.correlate.iter().map(|correlate| {
        let index = |word: &Spanned<String>| {
            let continuous = |axis: &&Axis| !matches!(axis.values, AxisValues::Levels(_));
            let name = word.get_ref();
            let found = axes.iter().position(|axis| axis.names.first() == Some(name));
            let found = found.filter(|index| continuous(&&axes[*index]));
            found.ok_or_else(|| {
                let message = format!("`{name}` is no distribution that is varied");
                scenario.error(word, message)
            })
        };
        let [one, other] = &correlate.between;
        let (one, second) = Mistakes::both(index(one), index(other))?;
        let coefficient = *correlate.coefficient.get_ref();
        if one == second || !(-1.0..=1.0).contains(&coefficient) || coefficient.abs() == 1.0 {
            let message = "expected two names, and a coefficient between -1 and 1";
            return Err(scenario.error(&correlate.coefficient, message));
        }
        if matches!(sweep.design, Design::Grid | Design::Corners | Design::Saltelli) {
            let message = "a grid, corners and the sample of Saltelli vary each name by itself";
            return Err(scenario.error(other, message));
        }
        Ok((one, second, coefficient))
    });
    Mistakes::all(all)
}

fn pass_share(scenario: &Scenario, sweep: &Sweep) -> Result<f64, Error> {
    match &sweep.pass_share {
        None => Ok(1.0),
        Some(word) if (0.0..=1.0).contains(word.get_ref()) => Ok(*word.get_ref()),
        Some(word) => Err(scenario.error(word, "expected a share from 0 to 1")),
    }
}

fn search(scenario: &Scenario, sweep: &Sweep, search: &Search) -> Result<SearchPlan, Error> {
    let goal = match (&search.minimise, &search.limit) {
        (Some(word), None) => {
            let (name, largest) = match word.get_ref().strip_prefix('-') {
                Some(name) => (name, true),
                None => (word.get_ref().as_str(), false),
            };
            if !sweep.collect.keys().any(|known| known.get_ref() == name) {
                let message = format!("[sweep.collect] has no value called `{name}`");
                return Err(scenario.error(word, message));
            }
            Goal::Extreme { collected: name.to_owned(), largest }
        }
        (None, Some(word)) => {
            if sweep.vary.len() != 1 {
                let message = "a limit is that of one name: vary one";
                return Err(scenario.error(word, message));
            }
            let check = search.check.as_ref().map(|check| {
                let known = scenario.document.check.iter();
                match known.clone().any(|it| it.name.get_ref() == check.get_ref()) {
                    true => Ok(check.get_ref().clone()),
                    false => {
                        let message = format!("there is no check called `{}`", check.get_ref());
                        Err(scenario.error(check, message))
                    }
                }
            });
            Goal::Limit { side: *word.get_ref(), check: check.transpose()? }
        }
        _ => return Err(at_sweep(scenario, sweep, "a search needs either `minimise` or `limit`")),
    };
    let tolerance = match &search.tolerance {
        None => TOLERANCE,
        Some(word) if *word.get_ref() > 0.0 && *word.get_ref() < 1.0 => *word.get_ref(),
        Some(word) => return Err(scenario.error(word, "expected a share between 0 and 1")),
    };
    Ok(SearchPlan { goal, tolerance })
}
