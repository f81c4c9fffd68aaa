//! Finds where each channel of a sample comes from: a column of the file, a constant of the user, or a value that is told.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use numerics::statistics::quantile;

use crate::axes::TydexAxes;
use crate::channels::{BenchReadOptions, ScaledColumn, find_channel_column};
use crate::sample::BenchError;
use crate::table::BenchTable;

/// A wheel of which F_x stays below this share of F_z rolls freely: 0.07 in 99 of 100 rows of a cornering run, above 1 of a run that brakes.
const FREE: f64 = 0.2;

/// The belt stands below this speed [m/s], and below this share of the highest speed: some benches are slow.
const STANDSTILL: f64 = 1.0;
const STANDSTILL_SHARE: f64 = 0.1;

/// Where a channel comes from.
pub(crate) enum ChannelSource<'t> {
    Column(ScaledColumn<'t>),
    Constant(f64),
}

impl ChannelSource<'_> {
    pub fn value_at(&self, row: usize) -> f64 {
        match self {
            Self::Column(source) => source.si_value_at(row),
            Self::Constant(value) => *value,
        }
    }

    /// Whether nobody measured it.
    pub fn is_unmeasured(&self) -> bool {
        matches!(self, Self::Constant(value) if value.is_nan())
    }
}

/// The axes that all forces of a table have, and the letter behind their names.
pub(crate) fn force_axes<'l>(
    table: &BenchTable,
    reading: &BenchReadOptions,
) -> Result<(TydexAxes, &'l str), BenchError> {
    let mut first = None;
    for (axes, letter) in [(TydexAxes::W, ""), (TydexAxes::W, "W"), (TydexAxes::H, "H"), (TydexAxes::C, "C")]
    {
        let there = |channel| Ok(find_channel_column(table, reading, channel, letter)?.is_some());
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
pub(crate) type TreadTemperature<'t> = (ChannelSource<'t>, Option<[ScaledColumn<'t>; 2]>);

pub(crate) fn temperature_at((centre, sides): &TreadTemperature, row: usize) -> f64 {
    match sides {
        Some([inner, outer]) => {
            (centre.value_at(row) + inner.si_value_at(row) + outer.si_value_at(row)) / 3.0
        }
        None => centre.value_at(row),
    }
}

/// Looks for channels in a table and in what the user says.
pub(crate) struct ChannelFinder<'t, 'r> {
    pub table: &'t BenchTable,
    pub reading: &'r BenchReadOptions<'r>,
    pub letter: &'r str,
}

impl<'t> ChannelFinder<'t, '_> {
    /// A column or constant of the file, else a constant of the user.
    pub fn find_channel(&self, channel: &str) -> Result<Option<ChannelSource<'t>>, BenchError> {
        // A column without a single number is none.
        let column = find_channel_column(self.table, self.reading, channel, self.letter)?
            .filter(|it| it.column.values.iter().any(|value| !value.is_nan()));
        let constant = || self.reading.channel_constant(&self.table.file, channel);
        Ok(column.map(ChannelSource::Column).or_else(|| constant().map(ChannelSource::Constant)))
    }

    pub fn require_channel(&self, channel: &str) -> Result<ChannelSource<'t>, BenchError> {
        let found = self.find_channel(channel)?;
        if found.is_none()
            && let Some(empty) = find_channel_column(self.table, self.reading, channel, self.letter)?
        {
            let text = format!("{}: expected numbers, found none in the whole column", empty.column.name);
            return Err(self.table.error_at_line(self.table.head, text));
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
                self.table.column_names()
            );
            self.table.error_at_line(self.table.head, text)
        })
    }

    /// Slip ratio and slip angle, of which one may be missing: it is 0 then. `rows` are those in which the belt runs.
    pub fn slip_channels(
        &self,
        rows: &[usize],
        notes: &mut Vec<String>,
    ) -> Result<[ChannelSource<'t>; 2], BenchError> {
        let mut kappa = self.find_channel("slip_ratio")?;
        if kappa.is_none()
            && let Some(loaded) = self.find_channel("slip_ratio_loaded")?
        {
            let (note, slip) = match self.rolls_freely(rows)? {
                true => (
                    "the wheel rolls freely, so the slip ratio is 0; SR is not used: it is by the loaded radius",
                    ChannelSource::Constant(0.0),
                ),
                false => ("the slip ratio is SR, as there is no SL", loaded),
            };
            notes.push(note.to_owned());
            kappa = Some(slip);
        }
        let alpha = self.find_channel("slip_angle_rad")?;
        if kappa.is_none() && alpha.is_none() {
            self.require_channel("slip_angle_rad")?;
        }
        let mut or_zero = |slip: Option<ChannelSource<'t>>, name: &str| {
            slip.unwrap_or_else(|| {
                notes.push(format!("no {name}: taken as 0"));
                ChannelSource::Constant(0.0)
            })
        };
        Ok([or_zero(kappa, "slip ratio"), or_zero(alpha, "slip angle")])
    }

    /// Whether nothing drives or brakes the wheel: F_x stays small against F_z, or nobody measured it.
    fn rolls_freely(&self, rows: &[usize]) -> Result<bool, BenchError> {
        let (Some(F_x), Some(F_z)) = (self.find_channel("fx_n")?, self.find_channel("fz_n")?) else {
            return Ok(true);
        };
        let ratios = rows.iter().map(|row| (F_x.value_at(*row) / F_z.value_at(*row)).abs());
        let mut ratios: Vec<f64> = ratios.filter(|it| it.is_finite()).collect();
        ratios.sort_by(f64::total_cmp);
        Ok(ratios.is_empty() || quantile(&ratios, 0.95) < FREE)
    }

    /// The rows in which the belt runs: a bench stands still before and between its sweeps.
    pub fn running_rows(&self, v_x: &ChannelSource, notes: &mut Vec<String>) -> Vec<usize> {
        let rows = 0..self.table.row_count();
        let fastest = rows.clone().map(|row| v_x.value_at(row).abs()).fold(0.0, f64::max);
        let least = STANDSTILL.min(STANDSTILL_SHARE * fastest);
        let stands = |row: &usize| v_x.value_at(*row).abs() < least;
        let running: Vec<_> = rows.filter(|row| !stands(row)).collect();
        let left = self.table.row_count() - running.len();
        if left > 0 {
            notes.push(format!("{left} rows below {least} m/s were left out: the belt stands"));
        }
        running
    }

    /// F_x, which a run without slip ratio does not need.
    pub fn longitudinal_force_channel(
        &self,
        kappa: &ChannelSource,
        notes: &mut Vec<String>,
    ) -> Result<ChannelSource<'t>, BenchError> {
        match (self.find_channel("fx_n")?, kappa) {
            (Some(found), _) => Ok(found),
            (None, ChannelSource::Constant(_)) => {
                notes.push("no F_x: a run without slip ratio does not tell it".to_owned());
                Ok(ChannelSource::Constant(0.0))
            }
            (None, ChannelSource::Column(_)) => self.require_channel("fx_n"),
        }
    }

    /// M_z; NaN of a bench that does not measure it.
    pub fn aligning_moment_channel(&self, notes: &mut Vec<String>) -> Result<ChannelSource<'t>, BenchError> {
        Ok(self.find_channel("mz_nm")?.unwrap_or_else(|| {
            notes.push("no M_z: the aligning moment is not fitted".to_owned());
            ChannelSource::Constant(f64::NAN)
        }))
    }

    /// The temperature of the tread; NaN of a bench that does not measure it.
    pub fn tread_temperature(&self, notes: &mut Vec<String>) -> Result<TreadTemperature<'t>, BenchError> {
        let side = |channel| find_channel_column(self.table, self.reading, channel, "");
        let Some(centre) = self.find_channel("temp_centre_k")? else {
            notes.push("no temperature of the tread: its terms stay at 0".to_owned());
            return Ok((ChannelSource::Constant(f64::NAN), None));
        };
        let chosen = self.reading.columns.iter().any(|it| it.0 == "temp_centre_k");
        let sides = match (side("temp_inner_k")?, side("temp_outer_k")?) {
            (Some(inner), Some(outer)) if !chosen => Some([inner, outer]),
            _ => None,
        };
        Ok((centre, sides))
    }

    /// Loaded radius and M_y, for moments about the centre of the wheel; `None` where they change nothing.
    pub fn wheel_centre_channels(
        &self,
        axes: TydexAxes,
        gamma: &ChannelSource,
        notes: &mut Vec<String>,
    ) -> Result<Option<(ChannelSource<'t>, ChannelSource<'t>)>, BenchError> {
        let leans = (0..self.table.row_count()).any(|row| gamma.value_at(row).abs() > 1e-3);
        if axes == TydexAxes::W || !leans {
            return Ok(None);
        }
        let radius = match self.find_channel("loaded_radius_m")? {
            Some(found) => found,
            None => {
                notes.push(format!(
                    "no loaded radius: moments were turned from the centre of the wheel with {} m",
                    self.reading.radius
                ));
                ChannelSource::Constant(self.reading.radius)
            }
        };
        let M_y = match axes {
            // In leaning axes M_y has a part of the moment about the vertical.
            TydexAxes::C => self.require_channel("my_nm")?,
            _ => ChannelSource::Constant(0.0),
        };
        Ok(Some((radius, M_y)))
    }
}
