//! Assigns values to the variants of a sweep, by its design of experiments.

use std::ops::Range;

use ::sweep::design::{self, AxisCorrelation, DesignMethod, DesignPoints};
use ::sweep::distribution::Distribution;
use ::sweep::table::{SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable};
use diagnostics::Error;
use scenario::document::Design;
use scenario::plan::{AxisValues, SweepAxis, SweepPlan};
use scenario::resolve::{Override, SEED};

/// What the sample of Saltelli is called.
const SALTELLI: &str = "saltelli";

/// The values of all variants.
pub(super) struct VariantAssignment {
    axes: Vec<SweepAxis>,
    /// One number for each axis: of levels the index, else the value.
    points: Option<DesignPoints>,
    design: &'static str,
    fixed: Vec<String>,
}

impl VariantAssignment {
    /// Those that a scenario asks for; what `--set` sets does not vary.
    ///
    /// # Errors
    /// When the design has too many variants, or its correlations do not fit together.
    pub fn new(words: &SweepPlan, set: &[Override]) -> Result<Self, Error> {
        let is_set = |name: &&String| set.iter().any(|given| given.name == **name);
        let names = words.axes.iter().flat_map(|axis| &axis.names);
        let fixed: Vec<String> = names.filter(is_set).cloned().collect();
        // Of joint values the other names still vary.
        let varies = |place: &usize| !words.axes[*place].names.iter().all(|it| fixed.contains(it));
        let places: Vec<usize> = (0..words.axes.len()).filter(varies).collect();
        let (method, design) = design_method_and_name(words.design);
        let axes: Vec<SweepAxis> = places.iter().map(|place| words.axes[*place].clone()).collect();
        let new_place = |place: usize| places.iter().position(|it| *it == place);
        let correlations = words.correlations.iter();
        let correlations = correlations.filter_map(|(first, second, coefficient)| {
            let (first, second) = (new_place(*first)?, new_place(*second)?);
            Some(AxisCorrelation { first, second, coefficient: *coefficient })
        });
        // Its blocks have two points, and one for each axis.
        let block = if method == DesignMethod::Saltelli { axes.len() as u64 + 2 } else { 1 };
        let design_of = design::ExperimentDesign {
            method,
            axes: axes.iter().map(design_axis).collect(),
            variants: words.variants * block,
            seed: words.seed,
            correlations: correlations.collect(),
        };
        // A search asks for its points as it goes on.
        let points = match words.search {
            None => Some(design_of.design_points()?),
            Some(_) => None,
        };
        let design = if words.search.is_some() { "search" } else { design };
        Ok(VariantAssignment { axes, points, design, fixed })
    }

    /// How many there are.
    pub fn variant_count(&self) -> u64 {
        self.points.as_ref().map_or(0, DesignPoints::point_count)
    }

    /// What the design is called.
    pub fn design_name(&self) -> &'static str {
        self.design
    }

    /// The names that do not vary because all variants have one value.
    pub fn constant_names(&self) -> impl Iterator<Item = &str> {
        self.fixed.iter().map(String::as_str)
    }

    /// Whether the variants are independent draws: those of a sample, and combinations of seeds and of draws that a file has.
    pub fn is_sample(&self) -> bool {
        let is_drawn = |axis: &SweepAxis| axis.is_joint || axis.names.iter().all(|name| name == SEED);
        match self.design {
            "latin_hypercube" | "sobol" | "monte_carlo" | SALTELLI => true,
            "grid" => self.axes.iter().all(is_drawn),
            _ => false,
        }
    }

    /// The names that vary.
    pub fn varied_names(&self) -> impl Iterator<Item = &str> {
        let names = self.axes.iter().flat_map(|axis| &axis.names);
        names.filter(|name| !self.fixed.contains(name)).map(String::as_str)
    }

    /// The names that get the value of another one.
    pub fn names_coupled_to_others(&self) -> impl Iterator<Item = &str> {
        let axes = self.axes.iter().filter(|axis| !axis.is_joint);
        axes.flat_map(|axis| axis.names.iter().skip(1)).map(String::as_str)
    }

    /// The axes of the blocks of a sample of Saltelli.
    pub fn saltelli_axis_names(&self) -> Option<Vec<String>> {
        let name = |axis: &SweepAxis| match axis.is_joint {
            true => axis.names.join(", "),
            false => axis.names[0].clone(),
        };
        (self.design == SALTELLI).then(|| self.axes.iter().map(name).collect())
    }

    /// The values of the first variant or the last one; of a search, those at the ends of its ranges.
    pub fn first_or_last_values(&self, last: bool) -> SweepTable {
        match self.variant_count() {
            0 => {
                let ends = self.axes.iter().map(|axis| match axis.values {
                    AxisValues::Uniform(ends) => ends[usize::from(last)],
                    _ => 0.0,
                });
                self.table_of_points(0, &[ends.collect()])
            }
            count => {
                let row = if last { count - 1 } else { 0 };
                self.variant_values(row..row + 1)
            }
        }
    }

    /// The values of some variants.
    pub fn variant_values(&self, range: Range<u64>) -> SweepTable {
        let point = |variant| self.points.as_ref().map(|points| points.point(variant));
        self.table_of_points(range.start, &range.filter_map(point).collect::<Vec<_>>())
    }

    /// The values at some points, as variants from this number on.
    pub fn table_of_points(&self, first: u64, points: &[Vec<f64>]) -> SweepTable {
        let numbers = (first..).take(points.len()).map(u64::cast_signed).collect();
        let mut columns =
            vec![SweepColumn::new("variant", SweepColumnRole::Variant, SweepColumnValues::Integers(numbers))];
        columns.extend(self.name_column(points));
        for (place, axis) in self.axes.iter().enumerate() {
            for (inner, (name, unit)) in axis.names.iter().zip(&axis.units).enumerate() {
                if self.fixed.contains(name) {
                    continue;
                }
                let values = match &axis.values {
                    AxisValues::Levels(levels) => {
                        let all = levels.iter().map(|row| row[inner].as_str());
                        let chosen = points.iter().map(|row| levels[row[place] as usize][inner].as_str());
                        parse_column_values(all, chosen, name == SEED)
                    }
                    _ => SweepColumnValues::Numbers(points.iter().map(|row| row[place]).collect()),
                };
                let role = if name == SEED { SweepColumnRole::Seed } else { SweepColumnRole::Parameter };
                columns.push(SweepColumn::new(name, role, values).with_unit(unit.as_deref()));
            }
        }
        SweepTable { columns }
    }
}

impl VariantAssignment {
    /// The names of the variants at some points, of a list that has names.
    fn name_column(&self, points: &[Vec<f64>]) -> Option<SweepColumn> {
        let (place, names) = self
            .axes
            .iter()
            .enumerate()
            .find_map(|(place, axis)| Some((place, axis.variant_names.as_ref()?)))?;
        let name = |point: &Vec<f64>| names.get(point[place] as usize).cloned();
        let names = SweepColumnValues::Texts(points.iter().map(name).collect());
        Some(SweepColumn::new("name", SweepColumnRole::Name, names))
    }
}

/// Texts as what all of them are: integers, numbers, true and false, or texts. An empty one is missing.
fn parse_column_values<'a>(
    all: impl Iterator<Item = &'a str> + Clone,
    chosen: impl Iterator<Item = &'a str>,
    is_seed: bool,
) -> SweepColumnValues {
    let chosen: Vec<&str> = chosen.collect();
    let is_partial = all.clone().any(str::is_empty);
    let each = |fits: fn(&str) -> bool| all.clone().filter(|text| !text.is_empty()).all(fits);
    // Integers have none that is missing: they stay texts.
    let are_integers = each(|text| text.parse::<i64>().is_ok());
    if is_seed || (are_integers && !is_partial) {
        return SweepColumnValues::Integers(chosen.iter().map(|text| text.parse().unwrap_or(0)).collect());
    }
    if !are_integers && each(|text| text.parse::<f64>().is_ok_and(f64::is_finite)) {
        return SweepColumnValues::Numbers(
            chosen.iter().map(|text| text.parse().unwrap_or(f64::NAN)).collect(),
        );
    }
    if each(|text| text.parse::<bool>().is_ok()) {
        return SweepColumnValues::Booleans(chosen.iter().map(|text| text.parse().ok()).collect());
    }
    let text = |text: &&str| (!text.is_empty()).then(|| (*text).to_owned());
    SweepColumnValues::Texts(chosen.iter().map(text).collect())
}

fn design_axis(axis: &SweepAxis) -> design::DesignAxis {
    let distribution = match axis.values {
        AxisValues::Levels(ref levels) => Distribution::Values(levels.len()),
        AxisValues::Uniform([low, high]) => Distribution::Uniform { low, high },
        AxisValues::Normal([mean, std]) => Distribution::Normal { mean, std },
        AxisValues::Lognormal([median, std_log]) => Distribution::LogNormal { median, std_log },
        AxisValues::Truncated([mean, std, low, high]) => Distribution::Truncated { mean, std, low, high },
    };
    design::DesignAxis { name: axis.names.join(", "), distribution }
}

fn design_method_and_name(design: Design) -> (DesignMethod, &'static str) {
    match design {
        Design::Grid => (DesignMethod::Grid, "grid"),
        // The lines of a file are one axis.
        Design::List => (DesignMethod::Grid, "list"),
        Design::Corners => (DesignMethod::Corners, "corners"),
        Design::LatinHypercube => (DesignMethod::LatinHypercube, "latin_hypercube"),
        Design::Sobol => (DesignMethod::Sobol, "sobol"),
        Design::MonteCarlo => (DesignMethod::MonteCarlo, "monte_carlo"),
        Design::Saltelli => (DesignMethod::Saltelli, SALTELLI),
    }
}
