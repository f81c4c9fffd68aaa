//! Resolves `[[view.plot]]` to curves over time on axes with units.

use std::collections::{HashMap, HashSet};

use diagnostics::{Error, ErrorCollector};
use recording::view::{CurveRole, PlotSeries, RowQuantity, TimePlot};
use recording::{Column, NumberIndex, RecordedVariables, VariableDirection};
use units::Unit;
use units::display::name_with_unit;

use super::quantity::SignalScope;
use super::unit;
use crate::document::{self, Scenario};

/// More curves than this in one plot cannot be distinguished.
const CURVES: usize = 8;

/// Signals of a run that a replay has without being asked for more, at most: as many as an eye can look through.
pub(super) const MOST_SIGNALS: usize = 400;

/// More nodes than this share plots of one variable each, if they have variables in common: nobody looks through so many tabs.
const NODES: usize = 50;

/// A unit with its name; one of which only the name is known cannot be converted.
pub(super) type UnitWithName = (Option<Unit>, String);

pub(super) fn resolve_plot(
    scenario: &Scenario,
    scope: &SignalScope,
    written: &document::Plot,
) -> Result<TimePlot, Error> {
    let wanted = written.unit.as_ref().map(|word| {
        let unit = unit::parse_unit(scenario, word)?;
        Ok((Some(unit), word.get_ref().clone()))
    });
    let wanted = wanted.transpose();
    let shown = match &wanted {
        Ok(Some(axis)) => Some(axis.clone()),
        Ok(None) => written.signals.iter().find_map(|it| curve_axis_unit(scenario, scope, it)),
        // Without the unit of the axis there are still names to judge.
        Err(_) => None,
    };
    let curves = written.signals.iter().map(|it| resolve_curve(scenario, scope, it, shown.as_ref()));
    let (_, curves) = ErrorCollector::collect_both(wanted, ErrorCollector::collect_all(curves))?;
    let title = match shown {
        Some((_, unit)) => name_with_unit(&written.title, Some(&unit)),
        None => written.title.clone(),
    };
    let series = curves.into_iter().flatten().collect();
    Ok(TimePlot { title, group: None, range: written.range, series })
}

/// The axis of a curve that is alone: what a formula makes without a name is shown in SI units.
fn curve_axis_unit(
    scenario: &Scenario,
    scope: &SignalScope,
    written: &document::Curve,
) -> Option<UnitWithName> {
    let quantity = scope.parse_quantity(&written.signal).ok()?;
    let (unit, name) = curve_unit(scenario, scope, written, &quantity).ok()??;
    Some((Unit::parse(&name).ok().or(unit), name))
}

/// The lines of a curve on an axis.
fn resolve_curve(
    scenario: &Scenario,
    scope: &SignalScope,
    written: &document::Curve,
    axis: Option<&UnitWithName>,
) -> Result<Vec<PlotSeries>, Error> {
    let quantity = scope.parse_quantity(&written.signal)?;
    let own = curve_unit(scenario, scope, written, &quantity)?;
    let (factor, offset) = match (axis, own) {
        (Some((Some(to), axis)), Some((Some(from), own))) => curve_unit_conversion(&quantity, &from, to)
            .ok_or_else(|| {
                let signal = written.signal.get_ref();
                let message = format!("`{signal}` [{own}] cannot be shown in {axis}");
                let help = format!("{} is not {}", from.dimension_text(), to.dimension_text());
                scenario.error_at(&written.signal, message).with_help(help)
            })?,
        _ => (1.0, 0.0),
    };
    let label = written.label.clone().unwrap_or_else(|| written.signal.get_ref().clone());
    let line = |quantity, bound| {
        let (label, role) = (label.clone(), written.role);
        PlotSeries { quantity, factor, offset, label, role, bound }
    };
    let bound = |(std, sigmas)| scope.quantity_plus_sigmas(&written.signal, sigmas, std);
    let bounds = written.std.iter().flat_map(|std| [(std, 2.0), (std, -2.0)]).map(bound);
    let mut series: Vec<_> =
        ErrorCollector::collect_all(bounds)?.into_iter().map(|quantity| line(quantity, true)).collect();
    series.push(line(quantity, false));
    Ok(series)
}

/// The unit of a curve: the one that is written, which must not contradict that of its signals.
fn curve_unit(
    scenario: &Scenario,
    scope: &SignalScope,
    written: &document::Curve,
    quantity: &RowQuantity,
) -> Result<Option<UnitWithName>, Error> {
    let own = scope.quantity_unit(quantity);
    let Some(word) = &written.unit else { return Ok(own) };
    let (unit, said) = (unit::parse_unit(scenario, word)?, word.get_ref());
    match own {
        Some((Some(known), own)) if curve_unit_conversion(quantity, &known, &unit) != Some((1.0, 0.0)) => {
            let signal = written.signal.get_ref();
            let message = format!("`{signal}` is in [{own}], and is said to be in [{said}]");
            Err(scenario.error_at(word, message).with_help("leave `unit` out: the diagram converts"))
        }
        _ => Ok(Some((Some(unit), said.clone()))),
    }
}

/// Factor and offset from one unit to the other; in formulas an angle counts as a plain number.
fn curve_unit_conversion(quantity: &RowQuantity, from: &Unit, to: &Unit) -> Option<(f64, f64)> {
    match quantity {
        RowQuantity::Column(_) => Unit::conversion(from, to),
        RowQuantity::Formula(_) => Unit::conversion(&from.without_angle(), &to.without_angle()),
    }
}

/// Plots of the outputs among these columns, one for each unit of each node, or for each variable of many alike nodes. Of more outputs than a
/// replay has without being asked, each node shows its first ones, as many as any other.
pub fn plots_by_unit<'a>(
    columns: impl Iterator<Item = (NumberIndex<RecordedVariables>, &'a Column)> + Clone,
) -> Vec<TimePlot> {
    let mut plots: Vec<TimePlot> = Vec::new();
    // The last plot of each title, and the columns of each node: there may be a hundred thousand.
    let (mut last, mut sizes) = (HashMap::<String, usize>::new(), HashMap::<&str, usize>::new());
    for (_, column) in columns.clone() {
        *sizes.entry(&column.node).or_default() += 1;
    }
    let outputs = || columns.clone().filter(|(_, column)| column.direction == VariableDirection::Output);
    let share = match outputs().count() {
        ..=MOST_SIGNALS => MOST_SIGNALS,
        _ => (MOST_SIGNALS / sizes.len()).max(1),
    };
    let variables: HashSet<&str> = outputs().map(|(_, column)| column.variable.as_str()).collect();
    let is_shared = sizes.len() > NODES && variables.len() < sizes.len();
    let (mut shown, mut total) = (HashMap::<&str, usize>::new(), 0);
    for (index, column) in outputs() {
        let count = shown.entry(&column.node).or_default();
        if *count == share || total == MOST_SIGNALS {
            continue;
        }
        *count += 1;
        total += 1;
        let (name, label) = match is_shared {
            true => (&column.variable, &column.node),
            false => (&column.node, &column.variable),
        };
        let title = name_with_unit(name, column.unit.as_deref());
        let series = PlotSeries {
            quantity: RowQuantity::Column(index),
            factor: 1.0,
            offset: 0.0,
            label: label.clone(),
            role: CurveRole::Other,
            bound: false,
        };
        let known = last.get(&title).and_then(|index| plots.get_mut(*index));
        match known.filter(|plot| plot.series.len() < CURVES) {
            Some(plot) => plot.series.push(series),
            None => {
                last.insert(title.clone(), plots.len());
                let group = Some(name.clone());
                plots.push(TimePlot { title, group, range: None, series: vec![series] });
            }
        }
    }
    if is_shared {
        for plot in &mut plots {
            if let [first, .., last] = &plot.series[..] {
                plot.title += &format!(": {} to {}", first.label, last.label);
            }
        }
        plots.sort_by(|a, b| a.group.cmp(&b.group));
        return plots;
    }
    // First the node that has most to show.
    let size = |plot: &TimePlot| plot.group.as_ref().and_then(|group| sizes.get(group.as_str()));
    plots.sort_by_key(|plot| std::cmp::Reverse(size(plot).copied()));
    plots
}

#[cfg(test)]
mod tests {
    use recording::{Columns, ValueKind};

    use super::*;

    /// Plots of nodes that have `outputs` outputs each, with these names by node and output.
    fn plots_of_nodes(nodes: usize, outputs: usize, name: fn(usize, usize) -> String) -> Vec<TimePlot> {
        let column = |node: usize, output: usize| Column {
            node: format!("n{node}"),
            variable: name(node, output),
            direction: VariableDirection::Output,
            kind: ValueKind::Real,
            unit: Some("m".to_owned()),
            description: None,
        };
        let all = (0..nodes).flat_map(|node| (0..outputs).map(move |output| column(node, output)));
        plots_by_unit(Columns::from_iter(all).number_columns())
    }

    #[test]
    fn few_nodes_have_plots_of_their_own_and_many_share_them() {
        for (nodes, outputs, plots, curves) in
            [(3, 9, 6, 27), (50, 8, 50, 400), (51, 8, 49, 357), (455, 1, 50, 400)]
        {
            let found = plots_of_nodes(nodes, outputs, |_, output| format!("y{output}"));
            let series = || found.iter().flat_map(|plot| &plot.series);
            assert_eq!((found.len(), series().count()), (plots, curves), "{nodes} nodes");
            assert!(found.iter().all(|plot| plot.series.len() <= CURVES));
            let mut groups: Vec<_> = found.iter().map(|plot| plot.group.as_deref()).collect();
            groups.dedup();
            assert_eq!(groups.len(), if nodes > NODES { outputs.min(400 / nodes).max(1) } else { nodes });
            let first = &found[0];
            let expected = match nodes > NODES {
                true => ("y0 [m]: n0 to n7", "y0", "n0"),
                false => ("n0 [m]", "n0", "y0"),
            };
            let group = first.group.as_deref().unwrap_or_default();
            assert_eq!((first.title.as_str(), group, first.series[0].label.as_str()), expected);
        }
    }
    #[test]
    fn many_nodes_with_nothing_in_common_have_plots_of_their_own() {
        let found = plots_of_nodes(60, 5, |node, output| format!("y{node}_{output}"));
        assert_eq!((found.len(), found[0].title.as_str(), found[0].series.len()), (60, "n0 [m]", 5));
    }
}
