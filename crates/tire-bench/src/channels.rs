//! Finds the channels of a table by the names that benches use, and what their units are.

use units::Unit;

use crate::sample::BenchError;
use crate::table::{BenchColumn, BenchTable};

/// Each channel of [`crate::BenchSample`] with its name and its SI unit.
pub const CHANNELS: [(&str, &str); 12] = [
    ("block", "1"),
    ("time_s", "s"),
    ("slip_ratio", "1"),
    ("slip_angle_rad", "rad"),
    ("camber_rad", "rad"),
    ("fz_n", "N"),
    ("pressure_pa", "Pa"),
    ("speed_mps", "m/s"),
    ("temp_centre_k", "K"),
    ("fx_n", "N"),
    ("fy_n", "N"),
    ("mz_nm", "N.m"),
];

/// Further channels that are used where they are there.
const SIDES: [(&str, &str); 5] = [
    ("temp_inner_k", "K"),
    ("temp_outer_k", "K"),
    ("loaded_radius_m", "m"),
    ("my_nm", "N.m"),
    ("slip_ratio_loaded", "1"),
];

/// Names of channels in files of FSAE TTC (Calspan), TYDEX and of people, in the order in which they are taken. Forces of TYDEX have
/// their axes behind them (`FYW`), see `axes.rs`.
const ALIASES: &[(&str, &[&str])] = &[
    ("block", &["sweep"]),
    ("time_s", &["ET", "RUNTIME", "MEASTIME", "time", "t"]),
    ("slip_ratio", &["SL", "LONGSLIP", "kappa", "slipratio"]),
    ("slip_ratio_loaded", &["SR"]),
    ("slip_angle_rad", &["SA", "SLIPANGL", "alpha", "slip_angle", "slipangle"]),
    ("camber_rad", &["IA", "INCLANGL", "gamma", "camber", "inclination_angle"]),
    ("fz_n", &["FZ"]),
    ("pressure_pa", &["P", "INFLPRES", "pressure"]),
    ("speed_mps", &["V", "TRAJVELW", "TRAJVELH", "LONGVEL", "speed", "velocity"]),
    ("temp_centre_k", &["TSTC", "TREADTEMP", "tread_temperature"]),
    ("temp_inner_k", &["TSTI"]),
    ("temp_outer_k", &["TSTO"]),
    ("fx_n", &["FX"]),
    ("fy_n", &["FY"]),
    ("mz_nm", &["MZ"]),
    ("my_nm", &["MY"]),
    ("loaded_radius_m", &["RL", "DISTGRWC"]),
];

/// Units of a whole file that states none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileUnits {
    /// Of FSAE TTC: s, deg, kPa, N, N m, km/h, degC, cm.
    TtcMetric,
    /// Of FSAE TTC: s, deg, psi, lbf, lbf ft, mph, degF, in.
    TtcEnglish,
}

impl FileUnits {
    /// The unit of a quantity with this SI unit.
    fn unit_for_si(self, si: &'static str) -> &'static str {
        let english = self == Self::TtcEnglish;
        let pair = match si {
            "rad" => ["deg", "deg"],
            "Pa" => ["kPa", "psi"],
            "N" => ["N", "lbf"],
            "N.m" => ["N.m", "lbf.ft"],
            "m/s" => ["km/h", "mph"],
            "K" => ["degC", "degF"],
            "m" => ["cm", "in"],
            other => [other, other],
        };
        pair[usize::from(english)]
    }
}

/// What the user says of files.
#[derive(Clone, Copy, Debug, Default)]
pub struct BenchReadOptions<'a> {
    /// Axes of the files.
    pub axes: tire::TireAxes,
    /// Channels whose columns have other names or units: channel, column, unit.
    pub columns: &'a [(&'a str, &'a str, Option<&'a str>)],
    /// Channels with one value, for files that have them not.
    pub constants: &'a [ConstantChannel<'a>],
    /// Units of files that state none.
    pub units: Option<FileUnits>,
    /// Radius without load [m], for moments about the centre of the wheel in files without a loaded radius.
    pub radius: f64,
}

impl BenchReadOptions<'_> {
    /// The constant of a channel [SI]: that of the file goes before that of all files.
    pub(crate) fn channel_constant(&self, file: &str, channel: &str) -> Option<f64> {
        let of =
            |file: Option<&str>| self.constants.iter().find(|it| it.channel == channel && it.file == file);
        of(Some(file)).or_else(|| of(None)).map(|it| it.value)
    }
}

/// A channel with one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantChannel<'a> {
    /// The file that it is of; without one, of all files.
    pub file: Option<&'a str>,
    /// One of [`CHANNELS`].
    pub channel: &'a str,
    /// Its value in the SI unit of the channel.
    pub value: f64,
}

/// A column, and what makes SI units of it.
#[derive(Clone, Copy)]
pub(crate) struct ScaledColumn<'t> {
    pub column: &'t BenchColumn,
    scale: f64,
    offset: f64,
}

impl ScaledColumn<'_> {
    pub fn si_value_at(&self, row: usize) -> f64 {
        self.scale * self.column.value_at(row) + self.offset
    }
}

/// Whether some bench has a channel of this name.
pub(crate) fn is_known(name: &str) -> bool {
    let own = CHANNELS.iter().chain(&SIDES).any(|it| it.0 == name);
    own || ALIASES.iter().flat_map(|it| it.1).any(|alias| {
        let axes = name.get(..alias.len()).is_some_and(|it| it.eq_ignore_ascii_case(alias))
            && name.len() == alias.len() + 1
            && is_force(alias)
            && name.ends_with(['W', 'H', 'C', 'w', 'h', 'c']);
        axes || alias.eq_ignore_ascii_case(name)
    })
}

fn is_force(alias: &str) -> bool {
    matches!(alias, "FX" | "FY" | "FZ" | "MY" | "MZ")
}

/// The SI unit of a channel.
fn si_unit_of_channel(channel: &str) -> &'static str {
    CHANNELS.iter().chain(&SIDES).find(|it| it.0 == channel).map_or("1", |it| it.1)
}

/// The column of a channel; `axes` are behind the names of forces. `None` where the table has none.
///
/// # Errors
/// When the user's column is missing, its unit is unknown or of another kind, or a field is no number.
pub(crate) fn find_channel_column<'t>(
    table: &'t BenchTable,
    reading: &BenchReadOptions,
    channel: &str,
    axes: &str,
) -> Result<Option<ScaledColumn<'t>>, BenchError> {
    let chosen = reading.columns.iter().find(|it| it.0 == channel);
    let column = match chosen {
        Some((_, name, _)) => Some(table.find_column(name).ok_or_else(|| {
            let text = format!("expected a column {name} for {channel}, found {}", table.column_names());
            table.error_at_line(table.head, text)
        })?),
        None => column_by_channel_name(table, channel, axes),
    };
    let Some(column) = column else { return Ok(None) };
    let si = si_unit_of_channel(channel);
    let unit = chosen.and_then(|it| it.2).or(column.unit.as_deref());
    // Names of our own have their unit in them.
    let own = column.name == channel;
    let unit = match (unit, reading.units) {
        (Some(unit), _) => unit,
        (None, _) if own || channel == "block" => si,
        (None, Some(units)) => units.unit_for_si(si),
        (None, None) => {
            let text = format!(
                "{}: expected a unit for {channel}, found none in the file: give it, columns.{channel} = {{ column = \"{}\", unit = \"{}\" }}, or units = \"ttc_metric\" for all",
                column.name,
                column.name,
                FileUnits::TtcMetric.unit_for_si(si)
            );
            return Err(table.error_at_line(table.head, text));
        }
    };
    let (scale, offset) = unit_conversion(unit, si).ok_or_else(|| {
        let text = format!("{}: expected a unit like {si}, found {unit}", column.name);
        table.error_at_line(table.head, text)
    })?;
    if let Some((line, field)) = &column.wrong {
        return Err(
            table.error_at_line(*line, format!("{}: expected a number, found `{field}`", column.name))
        );
    }
    Ok(Some(ScaledColumn { column, scale, offset }))
}

/// The column that has the name of a channel, or the first of its other names.
fn column_by_channel_name<'t>(table: &'t BenchTable, channel: &str, axes: &str) -> Option<&'t BenchColumn> {
    if axes.is_empty()
        && let Some(own) = table.columns.iter().find(|it| it.name == channel)
    {
        return Some(own);
    }
    let aliases = ALIASES.iter().find(|it| it.0 == channel)?.1;
    let named = |alias: &&str| {
        let behind = if is_force(alias) { axes } else { "" };
        table.find_column(&format!("{alias}{behind}"))
    };
    aliases.iter().find_map(named)
}

/// Factor and offset from a unit, as benches spell it, to one in SI.
fn unit_conversion(unit: &str, si: &str) -> Option<(f64, f64)> {
    const SPELLINGS: [(&str, &str); 18] = [
        // Text files of FSAE TTC say by which standard the slip ratio is, where its unit would stand.
        ("sae", "1"),
        ("n-m", "N.m"),
        ("nm", "N.m"),
        ("n m", "N.m"),
        ("n*m", "N.m"),
        ("kn-m", "kN.m"),
        ("lb-ft", "lbf.ft"),
        ("lbf-ft", "lbf.ft"),
        ("ft-lbf", "lbf.ft"),
        ("ft.lb", "lbf.ft"),
        ("lb", "lbf"),
        ("lbs", "lbf"),
        ("deg c", "degC"),
        ("c", "degC"),
        ("deg f", "degF"),
        ("f", "degF"),
        ("grad", "deg"),
        ("newton-meter", "N.m"),
    ];
    let to = Unit::parse(si).ok()?;
    let lower = unit.trim().to_lowercase();
    let own = SPELLINGS.iter().find(|it| it.0 == lower).map(|it| it.1);
    let other_case = units::known_unit_names().find(|it| it.eq_ignore_ascii_case(unit));
    let meant = [Some(unit), units::unit_for_spelling(unit), own, other_case];
    let units = meant.into_iter().flatten().filter_map(|it| Unit::parse(it).ok());
    units.filter_map(|from| Unit::conversion(&from, &to)).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_understood_as_benches_spell_them() {
        for (unit, si, value, expected) in [
            ("deg", "rad", 180.0, std::f64::consts::PI),
            ("N-m", "N.m", 2.0, 2.0),
            ("NM", "N.m", 2.0, 2.0),
            ("LB", "N", 1.0, 4.448_221_615_260_5),
            ("ft-lb", "N.m", 1.0, 1.355_817_948_331_4),
            ("kpa", "Pa", 80.0, 80e3),
            ("psi", "Pa", 12.0, 82_737.087_518),
            ("deg C", "K", 60.0, 333.15),
            ("°C", "K", 60.0, 333.15),
            ("C", "K", 60.0, 333.15),
            ("kph", "m/s", 36.0, 10.0),
            ("%", "1", 5.0, 0.05),
            ("-", "1", 0.05, 0.05),
            ("none", "1", 0.05, 0.05),
            ("SAE", "1", 0.05, 0.05),
        ] {
            let (scale, offset) = unit_conversion(unit, si).expect(unit);
            assert!((scale * value + offset - expected).abs() < 1e-6, "{unit}");
        }
        assert!(unit_conversion("N", "rad").is_none() && unit_conversion("-", "rad").is_none());
    }

    #[test]
    fn forces_have_axes_behind_their_names() {
        assert!(is_known("FYW") && is_known("mzh") && is_known("SA") && !is_known("SAW") && !is_known("FYX"));
    }
}
