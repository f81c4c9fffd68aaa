//! Decides what is recorded and how the replay is laid out.

use fmu_export::unit::Unit;
use toml::Spanned;

use crate::error::Error;
use crate::scenario::{self, Scenario};
use crate::sink::{Column, Direction, Header};
use crate::suggest::closest;
use crate::view::{Plot, Pose, Role, Series, View};

/// More curves than this in one plot cannot be told apart.
const CURVES: usize = 8;

/// The places of the numbers and of the texts that `[record]` does not except.
pub(super) fn recorded(
    scenario: &Scenario,
    columns: &[Column],
    texts: &[Column],
) -> Result<(Vec<usize>, Vec<usize>), Error> {
    let except = &scenario.document.record.except;
    for pattern in except {
        if !columns.iter().chain(texts).any(|column| matches(pattern.get_ref(), &column.name())) {
            let message = format!("nothing that is recorded is called `{}`", pattern.get_ref());
            return Err(scenario.error(pattern, message));
        }
    }
    let kept =
        |column: &Column| !except.iter().any(|pattern| matches(pattern.get_ref(), &column.name()));
    let places = |columns: &[Column]| -> Vec<usize> {
        (0..columns.len()).filter(|&place| kept(&columns[place])).collect()
    };
    Ok((places(columns), places(texts)))
}

/// Whether `name` fits `pattern`, in which `*` stands for any letters.
pub(crate) fn matches(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let Some(mut rest) = name.strip_prefix(parts.next().unwrap_or_default()) else { return false };
    let parts: Vec<_> = parts.collect();
    let Some((last, middle)) = parts.split_last() else { return rest.is_empty() };
    for part in middle {
        match rest.find(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}

/// The layout that the scenario asks for, or else plots of everything by unit.
pub(super) fn view(scenario: &Scenario, header: &Header) -> Result<View, Error> {
    let written = &scenario.document.view;
    let find = |word: &Spanned<String>| find(scenario, header, word);
    let pose = match &written.pose {
        None => None,
        Some(pose) => Some(Pose {
            x: find(&pose.x)?,
            y: find(&pose.y)?,
            heading: find(&pose.heading)?,
            steer: pose.steer.as_ref().map(find).transpose()?,
            speed: pose.speed.as_ref().map(find).transpose()?,
            length: pose.length,
            width: pose.width,
        }),
    };
    let plots = written.plot.iter().map(|written| plot(scenario, header, written));
    let plots = plots.collect::<Result<Vec<_>, _>>()?;
    let plots = if plots.is_empty() { by_unit(&header.columns) } else { plots };
    Ok(View { pose, plots })
}

fn find(scenario: &Scenario, header: &Header, word: &Spanned<String>) -> Result<usize, Error> {
    if header.texts.iter().any(|column| column.name() == *word.get_ref()) {
        let message = format!("`{}` is a text, which no plot can show", word.get_ref());
        return Err(scenario.error(word, message).help("texts are among the events of the replay"));
    }
    let names: Vec<_> = header.columns.iter().map(Column::name).collect();
    names.iter().position(|name| name == word.get_ref()).ok_or_else(|| {
        let error = scenario.error(word, format!("no signal `{}` is recorded", word.get_ref()));
        match closest(word.get_ref(), names.iter().map(String::as_str)) {
            Some(hint) => error.help(format!("did you mean `{hint}`?")),
            None => error,
        }
    })
}

fn plot(scenario: &Scenario, header: &Header, written: &scenario::Plot) -> Result<Plot, Error> {
    let columns = &header.columns;
    let wanted = match &written.unit {
        Some(unit) => Some(
            Unit::parse(unit.get_ref()).map_err(|error| scenario.error(unit, error.to_string()))?,
        ),
        None => None,
    };
    let mut series = Vec::new();
    let mut axis = written.unit.as_ref().map(|unit| unit.get_ref().clone());
    for curve in &written.signals {
        let column = find(scenario, header, &curve.signal)?;
        let own = columns[column].unit.as_deref();
        let (factor, offset) = match (wanted, own.and_then(|unit| Unit::parse(unit).ok())) {
            (Some(wanted), Some(own)) => Unit::conversion(&own, &wanted).ok_or_else(|| {
                let message = format!(
                    "`{}` [{}] cannot be shown in {}",
                    curve.signal.get_ref(),
                    columns[column].unit.as_deref().unwrap_or("1"),
                    axis.as_deref().unwrap_or("1"),
                );
                scenario.error(&curve.signal, message)
            })?,
            _ => (1.0, 0.0),
        };
        axis = axis.or_else(|| own.map(str::to_owned));
        let label = curve.label.clone().unwrap_or_else(|| curve.signal.get_ref().clone());
        series.push(Series { column, factor, offset, label, role: curve.role });
    }
    let title = match axis {
        Some(unit) => format!("{} [{unit}]", written.title),
        None => written.title.clone(),
    };
    Ok(Plot { title, series })
}

fn by_unit(columns: &[Column]) -> Vec<Plot> {
    let outputs =
        columns.iter().enumerate().filter(|(_, column)| column.direction == Direction::Output);
    let mut plots: Vec<(Option<&str>, Plot)> = Vec::new();
    for (place, column) in outputs {
        let unit = column.unit.as_deref();
        let series = Series {
            column: place,
            factor: 1.0,
            offset: 0.0,
            label: column.name(),
            role: Role::Other,
        };
        let open = plots.iter_mut().find(|(of, plot)| *of == unit && plot.series.len() < CURVES);
        match open {
            Some((_, plot)) => plot.series.push(series),
            None => {
                let title = format!("[{}]", unit.unwrap_or("1"));
                plots.push((unit, Plot { title, series: vec![series] }));
            }
        }
    }
    plots.into_iter().map(|(_, plot)| plot).collect()
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn a_star_stands_for_any_letters() {
        for (pattern, name, expected) in [
            ("plant.v_x", "plant.v_x", true),
            ("plant.v_x", "plant.v_xy", false),
            ("plant.*", "plant.v_x", true),
            ("*.v_x", "plant.v_x", true),
            ("plant*x", "plant.v_x", true),
            ("*", "anything", true),
            ("a*b*c", "a1b2c", true),
            ("a*b*c", "a1c2b", false),
            ("aa*aa", "aaa", false),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern} {name}");
        }
    }
}
