//! Gives each variant its values, by the design of the sweep.

use std::ops::Range;

use ::sweep::design::{self, Correlation, Method, Points};
use ::sweep::distribution::Distribution;
use ::sweep::table::{Column, Role, Table, Values};
use diagnostics::Error;
use scenario::plan::{Axis, AxisValues, SweepPlan};
use scenario::words::Design;

use super::plan::is_seed;
use super::settings::Setting;

/// The values of all variants.
pub(super) struct Assignment {
    axes: Vec<Axis>,
    /// One number for each axis: of levels the index, else the value.
    points: Points,
    design: &'static str,
    fixed: Vec<String>,
}

impl Assignment {
    /// Those that a scenario asks for; what `--set` sets does not vary.
    ///
    /// # Errors
    /// When the design has too many variants, or its correlations do not fit together.
    pub fn new(words: &SweepPlan, set: &[Setting]) -> Result<Self, Error> {
        let is_set = |name: &&String| set.iter().any(|given| given.name == **name);
        let names = words.axes.iter().flat_map(|axis| &axis.names);
        let fixed: Vec<String> = names.filter(is_set).cloned().collect();
        // Of joint values the other names still vary.
        let varies = |place: &usize| !words.axes[*place].names.iter().all(|it| fixed.contains(it));
        let places: Vec<usize> = (0..words.axes.len()).filter(varies).collect();
        let (method, design) = method(words.design);
        let axes: Vec<Axis> = places.iter().map(|place| words.axes[*place].clone()).collect();
        let moved = |place: usize| places.iter().position(|kept| *kept == place);
        let correlations = words.correlations.iter();
        let correlations = correlations.filter_map(|(first, second, coefficient)| {
            let (first, second) = (moved(*first)?, moved(*second)?);
            Some(Correlation { first, second, coefficient: *coefficient })
        });
        // Its blocks have two points, and one for each axis.
        let block = if method == Method::Saltelli { axes.len() as u64 + 2 } else { 1 };
        let design_of = design::Design {
            method,
            axes: axes.iter().map(axis).collect(),
            variants: words.variants * block,
            seed: words.seed,
            correlations: correlations.collect(),
        };
        let points = design_of.points()?;
        Ok(Assignment { axes, points, design, fixed })
    }

    /// How many there are.
    pub fn count(&self) -> u64 {
        self.points.count()
    }

    /// What the design is called.
    pub fn design(&self) -> &'static str {
        self.design
    }

    /// The names that do not vary because all variants have one value.
    pub fn fixed(&self) -> impl Iterator<Item = &str> {
        self.fixed.iter().map(String::as_str)
    }

    /// The values of some variants.
    pub fn rows(&self, range: Range<u64>) -> Table {
        let points: Vec<_> = range.clone().map(|variant| self.points.point(variant)).collect();
        let numbers = range.map(|variant| variant as i64).collect();
        let mut columns = vec![Column::new("variant", Role::Variant, Values::Integers(numbers))];
        for (place, axis) in self.axes.iter().enumerate() {
            for (inner, (name, unit)) in axis.names.iter().zip(&axis.units).enumerate() {
                if self.fixed.contains(name) {
                    continue;
                }
                let values = match &axis.values {
                    AxisValues::Levels(levels) => {
                        let all = levels.iter().map(|row| row[inner].as_str());
                        let taken =
                            points.iter().map(|row| levels[row[place] as usize][inner].as_str());
                        typed(all, taken, is_seed(name))
                    }
                    _ => Values::Numbers(points.iter().map(|row| row[place]).collect()),
                };
                let role = if is_seed(name) { Role::Seed } else { Role::Parameter };
                columns.push(Column::new(name, role, values).with_unit(unit.as_deref()));
            }
        }
        Table { columns }
    }
}

/// Texts as what all of them are: integers, numbers, true and false, or texts.
fn typed<'a>(
    all: impl Iterator<Item = &'a str> + Clone,
    taken: impl Iterator<Item = &'a str>,
    is_seed: bool,
) -> Values {
    let taken: Vec<&str> = taken.collect();
    let each = |fits: fn(&str) -> bool| all.clone().all(fits);
    if is_seed || each(|text| text.parse::<i64>().is_ok()) {
        return Values::Integers(taken.iter().map(|text| text.parse().unwrap_or(0)).collect());
    }
    if each(|text| text.parse::<f64>().is_ok_and(f64::is_finite)) {
        return Values::Numbers(
            taken.iter().map(|text| text.parse().unwrap_or(f64::NAN)).collect(),
        );
    }
    if each(|text| text.parse::<bool>().is_ok()) {
        return Values::Booleans(taken.iter().map(|text| text.parse().ok()).collect());
    }
    Values::Texts(taken.iter().map(|text| Some((*text).to_owned())).collect())
}

fn axis(axis: &Axis) -> design::Axis {
    let distribution = match axis.values {
        AxisValues::Levels(ref levels) => Distribution::Values(levels.len()),
        AxisValues::Uniform([low, high]) => Distribution::Uniform { low, high },
        AxisValues::Normal([mean, std]) => Distribution::Normal { mean, std },
        AxisValues::Lognormal([median, std_log]) => Distribution::LogNormal { median, std_log },
        AxisValues::Truncated([mean, std, low, high]) => {
            Distribution::Truncated { mean, std, low, high }
        }
    };
    design::Axis { name: axis.names.join(", "), distribution }
}

fn method(design: Design) -> (Method, &'static str) {
    match design {
        Design::Grid => (Method::Grid, "grid"),
        // The lines of a file are one axis.
        Design::List => (Method::Grid, "list"),
        Design::Corners => (Method::Corners, "corners"),
        Design::LatinHypercube => (Method::LatinHypercube, "latin_hypercube"),
        Design::Sobol => (Method::Sobol, "sobol"),
        Design::MonteCarlo => (Method::MonteCarlo, "monte_carlo"),
        Design::Saltelli => (Method::Saltelli, "saltelli"),
    }
}
