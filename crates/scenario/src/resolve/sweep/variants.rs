//! Resolves the entries of `[[sweep.variant]]` to one axis: a level for each variant, with its name.

use std::collections::BTreeMap;

use diagnostics::{Error, ErrorCollector};

use super::super::dotted_keys::flatten_dotted_keys;
use super::axes::level_text;
use crate::document::{Design, Scenario, Sweep, SweepVariant};
use crate::plan::{AxisValues, SweepAxis};

/// The variants that stand in the scenario. What one of them leaves out is an empty text: it stays as in the scenario.
pub(super) fn resolve_variants(scenario: &Scenario, sweep: &Sweep) -> Result<SweepAxis, Error> {
    let mut mistakes = ErrorCollector::default();
    let word = &sweep.variant[0].name;
    if !matches!(sweep.design, Design::Grid | Design::List) || sweep.list.is_some() {
        mistakes.push(
            scenario.error_at(word, "[[sweep.variant]] is a design by itself: leave `design` and `list` out"),
        );
    }
    if let Some(vary) = sweep.vary.first() {
        let message = "variants by hand say all their values: put this one into `set` of each, or leave [[sweep.variant]] out";
        mistakes.push(scenario.error_at(&vary.name, message));
    }
    if sweep.search.is_some() {
        mistakes.push(
            scenario.error_at(word, "a search chooses its variants itself: leave [[sweep.variant]] out"),
        );
    }
    for (place, variant) in sweep.variant.iter().enumerate() {
        let name = variant.name.get_ref();
        if name.trim().is_empty() {
            mistakes.push(scenario.error_at(&variant.name, "a variant needs a name"));
        } else if sweep.variant[..place].iter().any(|other| other.name.get_ref() == name) {
            mistakes.push(scenario.error_at(&variant.name, format!("two variants are called `{name}`")));
        }
    }
    let set: Vec<_> =
        sweep.variant.iter().map(|variant| mistakes.ok_or_record(values_of(scenario, variant))).collect();
    mistakes.into_result()?;
    let set: Vec<BTreeMap<String, String>> = set.into_iter().flatten().collect();
    let mut names: Vec<String> = Vec::new();
    for name in set.iter().flat_map(BTreeMap::keys) {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    if names.is_empty() {
        return Err(scenario.error_at(
            word,
            "no variant sets anything: give them `set`, such as set = { \"plant.body.m\" = 800.0 }",
        ));
    }
    let level = |values: &BTreeMap<String, String>| {
        names.iter().map(|name| values.get(name).cloned().unwrap_or_default()).collect()
    };
    Ok(SweepAxis {
        values: AxisValues::Levels(set.iter().map(level).collect()),
        units: vec![None; names.len()],
        is_joint: true,
        names,
        variant_names: Some(sweep.variant.iter().map(|it| it.name.get_ref().clone()).collect()),
    })
}

/// What a variant sets, by names with dots.
fn values_of(scenario: &Scenario, variant: &SweepVariant) -> Result<BTreeMap<String, String>, Error> {
    let mut values = BTreeMap::new();
    for (name, value) in &variant.set {
        let mut take = |name: &str, inner: &toml::Value| {
            if name != "seed" && !name.contains('.') {
                return Err(scenario.error_at(value, format!("`{name}`: expected node.variable, or `seed`")));
            }
            let text = level_text(scenario, &diagnostics::Spanned::new(value.span(), inner.clone()))?;
            if text.is_empty() {
                return Err(
                    scenario.error_at(value, format!("`{name}`: expected a value, found an empty text"))
                );
            }
            values.insert(name.to_owned(), text);
            Ok(())
        };
        flatten_dotted_keys(name.get_ref(), value.get_ref(), &mut take)?;
    }
    Ok(values)
}
