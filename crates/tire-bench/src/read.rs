//! Reads files of a bench, CSV, MAT or TYDEX, to samples in ISO-W axes and SI units.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::collections::BTreeMap;
use std::path::Path;

use tire::Axes;

use crate::axes::{TydexAxes, Wrench};
use crate::channels::{Reading, Source, source};
use crate::condition::REFERENCE;
use crate::sample::{Bad, Sample, check};
use crate::table::Table;
use crate::{csv, mat, sweeps, text, tydex};

/// What a file holds, and what was assumed of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Read {
    /// The samples.
    pub samples: Vec<Sample>,
    /// What was assumed, for people: one sentence each.
    pub notes: Vec<String>,
}

/// Time between rows without a time [s]: each is steady, so neither rates nor a lag of the carcass connect them.
const STEADY: f64 = 3600.0;

/// Where a channel comes from.
enum Input<'t> {
    Column(Source<'t>),
    Constant(f64),
}

impl Input<'_> {
    fn at(&self, row: usize) -> f64 {
        match self {
            Self::Column(source) => source.at(row),
            Self::Constant(value) => *value,
        }
    }
}

/// Reads files, each with its name. Tables are runs in their order; the files of TYDEX, which hold one sweep each, are sweeps of run 0.
///
/// # Errors
/// As [`read`].
pub fn read_all(files: &[(&str, &[u8])], reading: &Reading) -> Result<Read, Bad> {
    let (mut all, mut run, mut sweep) = (Read::default(), 0, 0);
    let mut told: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for (name, bytes) in files {
        for (mut found, one_sweep) in parts(bytes, name, reading)? {
            for it in &mut found.samples {
                (it.run, it.block) = if one_sweep { (0, sweep) } else { (run, it.block) };
            }
            // Sweeps of tables have numbers of their own below.
            sweep = match one_sweep {
                true => sweep + 1,
                false if run == 0 => {
                    found.samples.last().map_or(sweep, |it| sweep.max(it.block + 1))
                }
                false => sweep,
            };
            run += usize::from(!one_sweep);
            all.samples.extend(found.samples);
            for note in found.notes {
                told.entry(note).or_default().push(*name);
            }
        }
    }
    all.notes = told.into_iter().map(|(note, names)| format!("{}: {note}", list(&names))).collect();
    Ok(all)
}

/// Names of files, the first ones when there are many.
fn list(names: &[&str]) -> String {
    const MOST: usize = 3;
    match names.len() {
        0..=MOST => names.join(", "),
        count => format!("{} and {} more", names[..MOST].join(", "), count - MOST),
    }
}

/// Reads one file as one run.
///
/// # Errors
/// When its format is unknown or broken; a channel is missing, has no unit or one of another kind, or no numbers; or its signs are those
/// of no tire: with the place and what to do.
pub fn read(bytes: &[u8], file: &str, run: usize, reading: &Reading) -> Result<Read, Bad> {
    let mut all = Read::default();
    for (found, _) in parts(bytes, file, reading)? {
        let begin = all.samples.last().map_or(0, |it: &Sample| it.block + 1);
        let numbered = found.samples.into_iter();
        all.samples.extend(numbered.map(|it| Sample { run, block: begin + it.block, ..it }));
        all.notes.extend(found.notes);
    }
    Ok(all)
}

/// Reads a file of this path as one run, see [`read`]. `columns`: channel, column, unit.
///
/// # Errors
/// When it cannot be read, and as [`read`].
pub fn read_csv_file(
    path: &Path,
    run: usize,
    columns: &[(&str, &str, &str)],
    axes: Axes,
) -> Result<Vec<Sample>, Bad> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|error| Bad {
        file: file.clone(),
        line: None,
        text: format!("cannot be read: {error}"),
    })?;
    let columns: Vec<_> = columns.iter().map(|it| (it.0, it.1, Some(it.2))).collect();
    let reading = Reading { axes, columns: &columns, ..Reading::default() };
    Ok(read(&bytes, &file, run, &reading)?.samples)
}

/// The tables of a file, each with whether its format has one sweep in a file.
fn parts(bytes: &[u8], file: &str, reading: &Reading) -> Result<Vec<(Read, bool)>, Bad> {
    let bad = |text: String| Bad { file: file.to_owned(), line: None, text };
    let bytes = text::unpacked(bytes).map_err(bad)?;
    let named: Vec<_> = reading.columns.iter().map(|it| it.1).collect();
    let tables = if mat_file::is_mat(&bytes) {
        mat::read(&bytes, file, &named)?
    } else {
        let text = text::decoded(&bytes);
        if text.contains('\0') {
            return Err(bad(
                "expected a table as text, a MAT file or TYDEX, found other bytes".to_owned()
            ));
        }
        match tydex::is(&text) {
            true => vec![tydex::read(&text, file)?],
            false => vec![csv::read(&text, file, &named)?],
        }
    };
    tables.iter().map(|table| Ok((samples(table, reading)?, table.one_sweep))).collect()
}

fn samples(table: &Table, reading: &Reading) -> Result<Read, Bad> {
    let mut notes = table.notes.clone();
    let (axes, letter) = axes(table, reading)?;
    let inputs = Inputs { table, reading, letter };
    let force = |channel| inputs.wanted(channel);
    let (F_y, F_z, M_z) = (force("fy_n")?, force("fz_n")?, force("mz_nm")?);
    let condition = |channel| inputs.wanted(channel);
    let (gamma, pressure) = (condition("camber_rad")?, condition("pressure_pa")?);
    let v_x = condition("speed_mps")?;
    let [kappa, alpha] = inputs.slips(&mut notes)?;
    let F_x = inputs.along(&kappa, &mut notes)?;
    let temperature = inputs.temperature(&mut notes)?;
    let time = inputs.found("time_s")?;
    if time.is_none() {
        notes.push("no time: each row counts as a steady state of its own".to_owned());
    }
    let block = inputs.found("block")?;
    let centre = inputs.centre(axes, &gamma, &mut notes)?;
    let mut samples = Vec::new();
    for row in 0..table.rows() {
        let wrench = Wrench {
            F: [F_x.at(row), F_y.at(row), F_z.at(row)],
            M_y: centre.as_ref().map_or(0.0, |it| it.1.at(row)),
            M_z: M_z.at(row),
        };
        let gamma = gamma.at(row);
        let radius = centre.as_ref().map_or(0.0, |it| it.0.at(row));
        let wrench = wrench.at_contact(axes, gamma, radius);
        let number = block.as_ref().map_or(0.0, |it| it.at(row));
        let sample = Sample {
            run: 0,
            block: number.max(0.0) as usize,
            time: time.as_ref().map_or(STEADY * row as f64, |it| it.at(row)),
            kappa: kappa.at(row),
            alpha: alpha.at(row),
            gamma,
            F_z: wrench.F[2],
            pressure: pressure.at(row),
            v_x: v_x.at(row),
            temperature: temperature_at(&temperature, row),
            F_x: wrench.F[0],
            F_y: wrench.F[1],
            M_z: wrench.M_z,
        };
        if is_whole(&sample) && !number.is_nan() {
            samples.push(sample.turned_from(reading.axes));
        }
    }
    finish(table, samples, block.is_some(), notes)
}

/// Judges the samples of a table and finds their sweeps.
fn finish(
    table: &Table,
    mut samples: Vec<Sample>,
    numbered: bool,
    mut notes: Vec<String>,
) -> Result<Read, Bad> {
    let (rows, dropped) = (table.rows(), table.rows() - samples.len());
    if 2 * dropped > rows {
        let text = format!(
            "expected numbers in all channels, found such in {} of {rows} rows only",
            samples.len()
        );
        return Err(table.bad(None, text));
    }
    if dropped > 0 {
        notes.push(format!(
            "{dropped} of {rows} rows were left out, which have no number in some channel"
        ));
    }
    check(&samples, &table.file)?;
    slip_ratio_is_sound(table, &samples)?;
    if !numbered && !table.one_sweep {
        let (sweeps, left) = sweeps::find(&mut samples);
        if sweeps == 0 {
            return Err(table.bad(
                None,
                "expected sweeps of slip angle or slip ratio by more than 0.05 at steady conditions, found none: check the units of both, or give a column block that numbers the sweeps",
            ));
        }
        notes.push(format!("{sweeps} sweeps were found by their conditions; {left} samples between them were left out"));
    }
    Ok(Read { samples, notes })
}

fn is_whole(it: &Sample) -> bool {
    let all = [
        it.time,
        it.kappa,
        it.alpha,
        it.gamma,
        it.F_z,
        it.pressure,
        it.v_x,
        it.temperature,
        it.F_x,
        it.F_y,
        it.M_z,
    ];
    all.iter().all(|value| value.is_finite())
}

/// The axes that all forces of a table have, and the letter behind their names.
fn axes<'l>(table: &Table, reading: &Reading) -> Result<(TydexAxes, &'l str), Bad> {
    let mut first = None;
    for (axes, letter) in
        [(TydexAxes::W, ""), (TydexAxes::W, "W"), (TydexAxes::H, "H"), (TydexAxes::C, "C")]
    {
        let there = |channel| Ok(source(table, reading, channel, letter)?.is_some());
        if there("fz_n")? {
            if there("fy_n")? && there("mz_nm")? {
                return Ok((axes, letter));
            }
            first = first.or(Some((axes, letter)));
        }
    }
    Ok(first.unwrap_or((TydexAxes::W, "")))
}

/// The tread's surface: its centre, or the mean of inner side, centre and outer side.
type Temperature<'t> = (Input<'t>, Option<[Source<'t>; 2]>);

fn temperature_at((centre, sides): &Temperature, row: usize) -> f64 {
    match sides {
        Some([inner, outer]) => (centre.at(row) + inner.at(row) + outer.at(row)) / 3.0,
        None => centre.at(row),
    }
}

/// Looks for channels in a table and in what the user says.
struct Inputs<'t, 'r> {
    table: &'t Table,
    reading: &'r Reading<'r>,
    letter: &'r str,
}

impl<'t> Inputs<'t, '_> {
    /// A column or constant of the file, else a constant of the user.
    fn found(&self, channel: &str) -> Result<Option<Input<'t>>, Bad> {
        // A column without a single number is none.
        let column = source(self.table, self.reading, channel, self.letter)?
            .filter(|it| it.column.values.iter().any(|value| !value.is_nan()));
        let constant = || self.reading.constants.iter().find(|it| it.0 == channel);
        Ok(column.map(Input::Column).or_else(|| constant().map(|it| Input::Constant(it.1))))
    }

    fn wanted(&self, channel: &str) -> Result<Input<'t>, Bad> {
        let found = self.found(channel)?;
        if found.is_none()
            && let Some(empty) = source(self.table, self.reading, channel, self.letter)?
        {
            let text =
                format!("{}: expected numbers, found none in the whole column", empty.column.name);
            return Err(self.table.bad(self.table.head, text));
        }
        found.ok_or_else(|| {
            let constant = match channel {
                "camber_rad" | "pressure_pa" | "speed_mps" => {
                    format!(", or its value, constants.{channel} = ...")
                }
                _ => String::new(),
            };
            let text = format!(
                "expected a column {channel}, found {}: name the column that has it, columns.{channel} = {{ column = ..., unit = ... }}{constant}",
                self.table.names()
            );
            self.table.bad(self.table.head, text)
        })
    }

    /// Slip ratio and slip angle, of which one may be missing: it is 0 then.
    fn slips(&self, notes: &mut Vec<String>) -> Result<[Input<'t>; 2], Bad> {
        let mut kappa = self.found("slip_ratio")?;
        if kappa.is_none()
            && let Some(loaded) = self.found("slip_ratio_loaded")?
        {
            notes.push("the slip ratio is SR, as there is no SL".to_owned());
            kappa = Some(loaded);
        }
        let alpha = self.found("slip_angle_rad")?;
        if kappa.is_none() && alpha.is_none() {
            self.wanted("slip_angle_rad")?;
        }
        let mut or_zero = |slip: Option<Input<'t>>, name: &str| {
            slip.unwrap_or_else(|| {
                notes.push(format!("no {name}: taken as 0"));
                Input::Constant(0.0)
            })
        };
        Ok([or_zero(kappa, "slip ratio"), or_zero(alpha, "slip angle")])
    }

    /// F_x, which a run without slip ratio does not need.
    fn along(&self, kappa: &Input, notes: &mut Vec<String>) -> Result<Input<'t>, Bad> {
        match (self.found("fx_n")?, kappa) {
            (Some(found), _) => Ok(found),
            (None, Input::Constant(_)) => {
                notes.push("no F_x: a run without slip ratio does not tell it".to_owned());
                Ok(Input::Constant(0.0))
            }
            (None, Input::Column(_)) => self.wanted("fx_n"),
        }
    }

    fn temperature(&self, notes: &mut Vec<String>) -> Result<Temperature<'t>, Bad> {
        let side = |channel| source(self.table, self.reading, channel, "");
        let Some(centre) = self.found("temp_centre_k")? else {
            notes.push(format!(
                "no temperature of the tread: taken as {REFERENCE} K, where the terms of temperature are 0"
            ));
            return Ok((Input::Constant(REFERENCE), None));
        };
        let chosen = self.reading.columns.iter().any(|it| it.0 == "temp_centre_k");
        let sides = match (side("temp_inner_k")?, side("temp_outer_k")?) {
            (Some(inner), Some(outer)) if !chosen => Some([inner, outer]),
            _ => None,
        };
        Ok((centre, sides))
    }

    /// Loaded radius and M_y, for moments about the centre of the wheel; `None` where they change nothing.
    fn centre(
        &self,
        axes: TydexAxes,
        gamma: &Input,
        notes: &mut Vec<String>,
    ) -> Result<Option<(Input<'t>, Input<'t>)>, Bad> {
        let leans = (0..self.table.rows()).any(|row| gamma.at(row).abs() > 1e-3);
        if axes == TydexAxes::W || !leans {
            return Ok(None);
        }
        let radius = match self.found("loaded_radius_m")? {
            Some(found) => found,
            None => {
                notes.push(format!(
                    "no loaded radius: moments were turned from the centre of the wheel with {} m",
                    self.reading.radius
                ));
                Input::Constant(self.reading.radius)
            }
        };
        let M_y = match axes {
            // In leaning axes M_y has a part of the moment about the vertical.
            TydexAxes::C => self.wanted("my_nm")?,
            _ => Input::Constant(0.0),
        };
        Ok(Some((radius, M_y)))
    }
}

/// Refuses slip ratios that are percent, or that are no 0 where the tire rolls freely.
fn slip_ratio_is_sound(table: &Table, samples: &[Sample]) -> Result<(), Bad> {
    let [low, high] =
        samples.iter().fold([0.0f64; 2], |[low, high], it| [low.min(it.kappa), high.max(it.kappa)]);
    if low < -1.5 || high > 5.0 {
        let text = format!(
            "expected slip ratios from -1, a locked wheel, found {low:.3} to {high:.3}: check the unit, it may be %"
        );
        return Err(table.bad(None, text));
    }
    let most = samples.iter().map(|it| it.F_x.abs()).fold(0.0, f64::max);
    let free: Vec<_> = samples
        .iter()
        .filter(|it| it.alpha.abs() < 0.02 && it.F_x.abs() < 0.05 * most)
        .map(|it| it.kappa)
        .collect();
    let zero = free.iter().sum::<f64>() / free.len().max(1) as f64;
    if high - low > 0.1 && free.len() >= 5 && zero.abs() > 0.05 {
        let text = format!(
            "expected F_x about 0 at a slip ratio of 0, found that at {zero:.3}: this is a slip ratio by the loaded radius (SR of TTC); choose the one by the effective radius (SL), or ω R_e / V - 1"
        );
        return Err(table.bad(None, text));
    }
    Ok(())
}
