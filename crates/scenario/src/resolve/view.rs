//! Turns `[view]` into a layout by columns.

use diagnostics::{Error, Spanned};
use recording::table::{TableError, columns};
use recording::view::{
    Arrow, Distance, Function, Plot, Point, Pose, Quantity, Role, Series, Track, View, XyPlot,
    edges,
};
use recording::{Column, Direction, NumberIndex, Recorded, RunHeader};
use units::Unit;

use super::quantity::Names;
use super::signal_units::SignalUnits;
use super::unit;
use crate::words::{self, Scenario};

/// More curves than this in one plot cannot be distinguished.
const CURVES: usize = 8;
/// Default positions of the axles ahead of the position, in lengths of the body.
const AXLES: [f64; 2] = [0.30, -0.29];

/// The layout that the scenario of a recording asks for.
///
/// # Errors
/// When the recording lacks what the scenario wants to show.
pub fn layout(scenario: &Scenario, header: &RunHeader) -> Result<View, Error> {
    view(scenario, header, &SignalUnits::of_recording(&header.columns))
}

/// The layout that the scenario asks for; without plots there is one for each unit of each node.
pub(super) fn view(
    scenario: &Scenario,
    header: &RunHeader,
    units: &SignalUnits,
) -> Result<View, Error> {
    let written = &scenario.document.view;
    let names = Names::new(scenario, &header.columns, units);
    let pose = written.pose.as_ref().map(|it| pose(&names, it)).transpose()?;
    let plots = written.plot.iter().map(|it| plot(scenario, &names, it));
    let plots = plots.collect::<Result<Vec<_>, _>>()?;
    Ok(View {
        distance: distance(&names, written, pose.as_ref())?,
        pose,
        track: written.track.as_ref().map(|it| track(scenario, &names, it)).transpose()?,
        arrows: written.arrow.iter().map(|it| arrow(&names, it)).collect::<Result<_, _>>()?,
        xy_plots: written.xy_plot.iter().map(|it| xy_plot(&names, it)).collect::<Result<_, _>>()?,
        plots: if plots.is_empty() { by_unit(header.columns.numbers()) } else { plots },
    })
}

fn pose(names: &Names, written: &words::Pose) -> Result<Pose, Error> {
    let find = |word: &Spanned<String>| names.column(word);
    Ok(Pose {
        x: find(&written.x)?,
        y: find(&written.y)?,
        heading: find(&written.heading)?,
        steer: written.steer.as_ref().map(find).transpose()?,
        speed: written.speed.as_ref().map(find).transpose()?,
        length: written.length,
        width: written.width,
        axles: written.axles.unwrap_or(AXLES.map(|share| share * written.length)),
    })
}

fn distance(
    names: &Names,
    written: &words::View,
    pose: Option<&Pose>,
) -> Result<Option<Distance>, Error> {
    Ok(match (&written.distance, pose, &written.speed) {
        (Some(word), ..) => Some(Distance::Given(names.quantity(word)?)),
        (None, Some(pose), _) => Some(Distance::Along([pose.x, pose.y])),
        (None, None, Some(word)) => Some(Distance::Driven(names.quantity(word)?)),
        (None, None, None) => None,
    })
}

fn track(
    scenario: &Scenario,
    names: &Names,
    written: &Spanned<words::Track>,
) -> Result<Track, Error> {
    let words::Track { path, left, right, center, half_width, widths, closed } = written.get_ref();
    let wrong = |message: &str| {
        let help = "write `left` and `right`, or `center` with `half_width`; or with `widths`, which are columns of the \
                    file that `path` names";
        scenario.error(written, message).help(help)
    };
    let sides = match (left, right, center) {
        (Some(left), Some(right), None) => Some([left, right]),
        (None, None, Some(_)) => None,
        _ => return Err(wrong("expected the two edges of the track, or its center")),
    };
    let quantities = |words: &[Spanned<String>; 2]| {
        Ok::<_, Error>([names.quantity(&words[0])?, names.quantity(&words[1])?])
    };
    match (path, sides, center, half_width, widths) {
        (None, Some([left, right]), _, None, None) => {
            Ok(Track::Sides([quantities(left)?, quantities(right)?]))
        }
        (None, None, Some(center), Some(half), None) => {
            Ok(Track::Center(quantities(center)?, [*half; 2]))
        }
        (Some(path), Some([left, right]), _, None, None) => {
            let [x_l, y_l, x_r, y_r] =
                read(scenario, path, [&left[0], &left[1], &right[0], &right[1]])?;
            Ok(Track::Edges([(x_l, y_l), (x_r, y_r)].map(|(x, y)| {
                let mut edge: Vec<_> = x.into_iter().zip(y).map(|(x, y)| [x, y]).collect();
                edge.extend(edge.first().copied().filter(|_| *closed));
                edge
            })))
        }
        (Some(path), None, Some([x, y]), half, widths) if half.is_some() != widths.is_some() => {
            let [x, y, left, right] = match widths {
                Some([left, right]) => read(scenario, path, [x, y, left, right])?,
                None => {
                    let [x, y] = read(scenario, path, [x, y])?;
                    let half = vec![half.unwrap_or_default(); x.len()];
                    [x, y, half.clone(), half]
                }
            };
            let mut center: Vec<_> = x.into_iter().zip(y).map(|(x, y)| [x, y]).collect();
            let mut widths: Vec<_> = left.into_iter().zip(right).map(|(l, r)| [l, r]).collect();
            center.extend(center.first().copied().filter(|_| *closed));
            widths.extend(widths.first().copied().filter(|_| *closed));
            Ok(Track::Edges(edges(&center, &widths)))
        }
        _ => Err(wrong("the track has more or less than it needs")),
    }
}

/// Columns of a file of points; what it lacks is pointed at.
fn read<const N: usize>(
    scenario: &Scenario,
    path: &Spanned<String>,
    wanted: [&Spanned<String>; N],
) -> Result<[Vec<f64>; N], Error> {
    let names = wanted.map(|word| word.get_ref().as_str());
    let file = scenario.source.resolve(path);
    let kept = scenario.source.kept(&file);
    let read = columns(&file, kept, &names).map_err(|error: TableError| {
        let at = wanted.into_iter().find(|word| Some(word.get_ref().as_str()) == error.word());
        scenario.error(at.unwrap_or(path), error.to_string())
    })?;
    let mut read = read.into_iter();
    Ok(std::array::from_fn(|_| read.next().unwrap_or_default()))
}

fn arrow(names: &Names, written: &words::Arrow) -> Result<Arrow, Error> {
    let quantity =
        |word: &Option<Spanned<String>>| word.as_ref().map(|word| names.quantity(word)).transpose();
    let scale = *written.scale.get_ref();
    if !(scale.is_finite() && scale != 0.0) {
        return Err(names.error(&written.scale, format!("expected a length in m, found {scale}")));
    }
    Ok(Arrow {
        label: written.label.clone(),
        role: written.role,
        at: written.at,
        vector: [quantity(&written.x)?, quantity(&written.y)?],
        turn: quantity(&written.turn)?,
        scale,
    })
}

fn xy_plot(names: &Names, written: &words::XyPlot) -> Result<XyPlot, Error> {
    let axes = [&written.x, &written.y];
    for axis in axes {
        let [from, to] = *axis.range.get_ref();
        if !(from.is_finite() && to.is_finite() && from != to) {
            let message = format!("expected two different ends of an axis, found {from} and {to}");
            return Err(names.error(&axis.range, message));
        }
    }
    let point = |it: &words::Point| {
        let coordinates = [names.quantity(&it.x)?, names.quantity(&it.y)?];
        Ok(Point { label: it.label.clone(), role: it.role, coordinates })
    };
    let function = |it: &words::Function| {
        let (y, moves) = names.function(&it.y)?;
        Ok(Function { label: it.label.clone(), role: it.role, y, moves })
    };
    Ok(XyPlot {
        title: written.title.clone(),
        labels: axes.map(|axis| axis.label.clone()),
        ranges: axes.map(|axis| *axis.range.get_ref()),
        circle: written.circle,
        trail: written.trail,
        points: written.points.iter().map(point).collect::<Result<_, Error>>()?,
        curves: written.curves.iter().map(function).collect::<Result<_, Error>>()?,
    })
}

fn plot(scenario: &Scenario, names: &Names, written: &words::Plot) -> Result<Plot, Error> {
    let wanted = written.unit.as_ref().map(|word| unit::unit(scenario, word)).transpose()?;
    let wanted = wanted.zip(written.unit.as_ref());
    let mut axis = wanted.map(|(unit, word)| (Some(unit), word.get_ref().clone()));
    let mut series = Vec::new();
    for curve in &written.signals {
        let quantity = names.quantity(&curve.signal)?;
        let own = curve_unit(scenario, names, curve, &quantity)?;
        let (factor, offset) = match (conversion(&quantity, own.as_ref(), axis.as_ref()), &own) {
            (Some(conversion), _) => conversion,
            (None, Some((_, own))) if wanted.is_some() => {
                let signal = curve.signal.get_ref();
                let axis = axis.as_ref().map_or("1", |(_, name)| name);
                let message = format!("`{signal}` [{own}] cannot be shown in {axis}");
                return Err(scenario.error(&curve.signal, message));
            }
            _ => (1.0, 0.0),
        };
        axis = axis.or(own);
        let label = curve.label.clone().unwrap_or_else(|| curve.signal.get_ref().clone());
        let line = |quantity, bound| {
            let (label, role) = (label.clone(), curve.role);
            Series { quantity, factor, offset, label, role, bound }
        };
        if let Some(std) = &curve.std {
            for sigmas in [2.0, -2.0] {
                series.push(line(names.shifted(&curve.signal, sigmas, std)?, true));
            }
        }
        series.push(line(quantity, false));
    }
    let title = match axis {
        Some((_, unit)) => format!("{} [{unit}]", written.title),
        None => written.title.clone(),
    };
    Ok(Plot { title, group: None, range: written.range, series })
}

/// A unit with its name; one whose name is known only cannot be converted.
type NamedUnit = (Option<Unit>, String);

/// The unit of a curve: the one that is written, which must not contradict that of its signals.
fn curve_unit(
    scenario: &Scenario,
    names: &Names,
    curve: &words::Curve,
    quantity: &Quantity,
) -> Result<Option<NamedUnit>, Error> {
    let own = names.unit(quantity);
    let Some(word) = &curve.unit else { return Ok(own) };
    let unit = unit::unit(scenario, word)?;
    let said = word.get_ref();
    match own {
        Some((Some(known), own)) if conversion_of(quantity, &known, &unit) != Some((1.0, 0.0)) => {
            let signal = curve.signal.get_ref();
            let message = format!("`{signal}` is in [{own}], and is said to be in [{said}]");
            Err(scenario.error(word, message).help("leave `unit` out: the diagram converts"))
        }
        _ => Ok(Some((Some(unit), said.clone()))),
    }
}

/// Factor and offset from one unit to the other; in formulas an angle counts as a plain number.
fn conversion_of(quantity: &Quantity, from: &Unit, to: &Unit) -> Option<(f64, f64)> {
    match quantity {
        Quantity::Column(_) => Unit::conversion(from, to),
        Quantity::Formula(_) => Unit::conversion(&from.without_angle(), &to.without_angle()),
    }
}

/// Factor and offset from the unit of a curve to that of its axis, or to its own in SI units when it is the first one.
fn conversion(
    quantity: &Quantity,
    own: Option<&NamedUnit>,
    axis: Option<&NamedUnit>,
) -> Option<(f64, f64)> {
    let (Some((Some(from), name)), axis) = (own, axis) else { return Some((1.0, 0.0)) };
    let to = match axis {
        Some((unit, _)) => *unit,
        None => Unit::parse(name).ok(),
    };
    to.map_or(Some((1.0, 0.0)), |to| conversion_of(quantity, from, &to))
}

/// Plots of all outputs among these columns, one for each unit of each node.
pub fn by_unit<'a>(
    columns: impl Iterator<Item = (NumberIndex<Recorded>, &'a Column)> + Clone,
) -> Vec<Plot> {
    let mut plots: Vec<Plot> = Vec::new();
    let outputs = columns.clone().filter(|(_, column)| column.direction == Direction::Output);
    for (index, column) in outputs {
        let title = format!("{} [{}]", column.node, column.unit.as_deref().unwrap_or("1"));
        let series = Series {
            quantity: Quantity::Column(index),
            factor: 1.0,
            offset: 0.0,
            label: column.variable.clone(),
            role: Role::Other,
            bound: false,
        };
        let open = |plot: &&mut Plot| plot.title == title && plot.series.len() < CURVES;
        match plots.iter_mut().find(open) {
            Some(plot) => plot.series.push(series),
            None => {
                let group = Some(column.node.clone());
                plots.push(Plot { title, group, range: None, series: vec![series] });
            }
        }
    }
    let curves = |group: &Option<String>| {
        columns.clone().filter(|(_, column)| Some(&column.node) == group.as_ref()).count()
    };
    // First the node that has most to show.
    let sizes: Vec<_> = plots.iter().map(|plot| curves(&plot.group)).collect();
    let mut sorted: Vec<_> = sizes.into_iter().zip(plots).collect();
    sorted.sort_by_key(|(size, _)| std::cmp::Reverse(*size));
    sorted.into_iter().map(|(_, plot)| plot).collect()
}
