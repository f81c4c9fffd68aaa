//! Finds where each channel of a sample comes from: a column of the file, a constant of the user, or a value that is told.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use crate::axes::TydexAxes;
use crate::channels::{Reading, Source, source};
use crate::condition::REFERENCE;
use crate::sample::Bad;
use crate::table::Table;

/// Where a channel comes from.
pub(crate) enum Input<'t> {
    Column(Source<'t>),
    Constant(f64),
}

impl Input<'_> {
    pub fn at(&self, row: usize) -> f64 {
        match self {
            Self::Column(source) => source.at(row),
            Self::Constant(value) => *value,
        }
    }
}

/// The axes that all forces of a table have, and the letter behind their names.
pub(crate) fn axes<'l>(table: &Table, reading: &Reading) -> Result<(TydexAxes, &'l str), Bad> {
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
pub(crate) type Temperature<'t> = (Input<'t>, Option<[Source<'t>; 2]>);

pub(crate) fn temperature_at((centre, sides): &Temperature, row: usize) -> f64 {
    match sides {
        Some([inner, outer]) => (centre.at(row) + inner.at(row) + outer.at(row)) / 3.0,
        None => centre.at(row),
    }
}

/// Looks for channels in a table and in what the user says.
pub(crate) struct Inputs<'t, 'r> {
    pub table: &'t Table,
    pub reading: &'r Reading<'r>,
    pub letter: &'r str,
}

impl<'t> Inputs<'t, '_> {
    /// A column or constant of the file, else a constant of the user.
    pub fn found(&self, channel: &str) -> Result<Option<Input<'t>>, Bad> {
        // A column without a single number is none.
        let column = source(self.table, self.reading, channel, self.letter)?
            .filter(|it| it.column.values.iter().any(|value| !value.is_nan()));
        let constant = || self.reading.constants.iter().find(|it| it.0 == channel);
        Ok(column.map(Input::Column).or_else(|| constant().map(|it| Input::Constant(it.1))))
    }

    pub fn wanted(&self, channel: &str) -> Result<Input<'t>, Bad> {
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
    pub fn slips(&self, notes: &mut Vec<String>) -> Result<[Input<'t>; 2], Bad> {
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
    pub fn along(&self, kappa: &Input, notes: &mut Vec<String>) -> Result<Input<'t>, Bad> {
        match (self.found("fx_n")?, kappa) {
            (Some(found), _) => Ok(found),
            (None, Input::Constant(_)) => {
                notes.push("no F_x: a run without slip ratio does not tell it".to_owned());
                Ok(Input::Constant(0.0))
            }
            (None, Input::Column(_)) => self.wanted("fx_n"),
        }
    }

    pub fn temperature(&self, notes: &mut Vec<String>) -> Result<Temperature<'t>, Bad> {
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
    pub fn centre(
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
