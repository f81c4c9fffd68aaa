//! The words about nodes: `[[fmu]]` and `[[table]]`.

use std::collections::BTreeMap;

use diagnostics::Spanned;
use recording::table::{Decimal, Gaps, Interpolation, Separator};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::build_request::BuildRequest;

/// An FMU. It comes from an archive (`path`) or from a package of the workspace (`crate`).
///
/// ```toml
/// [[fmu]]
/// name = "plant"
/// crate = "plant-fmu"
/// start = { start.v_x = 27.8, F_x = 0.0 }
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fmu {
    /// Name of the node.
    #[schemars(example = &"plant")]
    pub name: Spanned<String>,
    /// Archive, relative to the scenario file.
    #[schemars(example = &"somebody.fmu")]
    pub path: Option<Spanned<String>>,
    /// Package that the archive is built from, in the workspace around the scenario file.
    #[serde(rename = "crate")]
    #[schemars(example = &"plant-fmu")]
    pub package: Option<Spanned<String>>,
    /// Example of the package that the archive is built from, instead of the package itself.
    #[schemars(example = &"relay")]
    pub example: Option<Spanned<String>>,
    /// Start values by variable: number, text, true or false, or the name of an item of an enumeration.
    #[serde(default)]
    #[schemars(
        with = "BTreeMap<String, serde_json::Value>",
        example = serde_json::json!({"start.v_x": 27.8, "F_x": 0.0})
    )]
    pub start: BTreeMap<Spanned<String>, Spanned<toml::Value>>,
    /// Units of Real variables without one in the description of the FMU. `*` in a name stands for any letters, and a full name
    /// wins. A declaration must not contradict the description.
    #[serde(default)]
    #[schemars(
        with = "BTreeMap<String, serde_json::Value>",
        example = serde_json::json!({"v_x": "km/h", "tire*": "N"})
    )]
    pub unit: BTreeMap<Spanned<String>, Spanned<toml::Value>>,
    /// Whether the FMU logs everything.
    #[serde(default)]
    #[schemars(example = true)]
    pub log: bool,
}

impl Fmu {
    /// The package or example that the archive is built from, when it has no path.
    #[must_use]
    pub fn build_request(&self) -> Option<BuildRequest> {
        build_request(self.path.as_ref(), self.package.as_ref(), self.example.as_ref())
    }
}

/// The package or example that a file is built from, when it has no path.
pub(super) fn build_request(
    path: Option<&Spanned<String>>,
    package: Option<&Spanned<String>>,
    example: Option<&Spanned<String>>,
) -> Option<BuildRequest> {
    let package = package.filter(|_| path.is_none())?.get_ref().clone();
    Some(BuildRequest { package, example: example.map(|word| word.get_ref().clone()) })
}

/// A CSV file or an MCAP recording that is played back.
///
/// ```toml
/// [[table]]
/// name = "log"
/// path = "drive.csv"
/// time = "t_s"
/// columns = { v_x = { column = "vx_mps", unit = "m/s" } }
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Name of the node.
    #[schemars(example = &"log")]
    pub name: Spanned<String>,
    /// CSV file or MCAP recording, relative to the scenario file.
    #[schemars(example = &"drive.csv")]
    pub path: Spanned<String>,
    /// Column of the time. MCAP has `log_time`, which needs no mention, and `publish_time`.
    #[schemars(example = &"t_s")]
    pub time: Option<Spanned<String>>,
    /// Unit of the time; that of the file without it, or else s.
    #[schemars(example = &"ms")]
    pub time_unit: Option<Spanned<String>>,
    /// Time of the file at the scenario's time 0 [s]; that of its first row without it.
    #[schemars(example = 1000.0)]
    pub origin: Option<f64>,
    /// Rows where a column has no value: an empty cell, `NaN`, `NA` or `-`. A column can have a rule of its own.
    #[serde(default)]
    #[schemars(example = &"hold")]
    pub gaps: Gaps,
    /// Letter between the cells of a CSV file; detected without it.
    #[schemars(example = &";")]
    pub separator: Option<Separator>,
    /// Decimal mark of a CSV file; detected without it.
    #[schemars(example = &",")]
    pub decimal: Option<Decimal>,
    /// Whether a line of units follows the titles of a CSV file; detected without it.
    #[schemars(example = true)]
    pub unit_row: Option<bool>,
    /// Values between two rows.
    #[serde(default)]
    #[schemars(example = &"hold")]
    pub interpolation: Interpolation,
    /// Outputs of the node by name.
    pub columns: BTreeMap<Spanned<String>, Spanned<Column>>,
}

/// A column of a recorded file: `v_x = { column = "vx_mps", unit = "m/s" }`.
///
/// Its value is `sign * gain * recorded value + offset`.
///
/// ```toml
/// [table.columns.delta]
/// column = "steer_deg"
/// unit = "deg"
/// gain = 0.0625 # one over the steering ratio
/// offset = 0.3  # [deg]
/// sign = -1     # the logger counts to the right
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// Title of the column in the file, with or without its unit; in MCAP `/topic.field`, or `node.variable` of a recorded run.
    #[schemars(example = &"vx_mps")]
    pub column: Spanned<String>,
    /// Unit of the column, with its gain; that of the file without it.
    #[schemars(example = &"m/s")]
    pub unit: Option<Spanned<String>>,
    /// Factor, such as one over the steering ratio.
    #[schemars(example = 0.0625)]
    pub gain: Option<Spanned<f64>>,
    /// Sum after the gain, in the unit of the column.
    #[schemars(example = 0.3)]
    pub offset: Option<Spanned<f64>>,
    /// 1, or -1 for the opposite sign convention, such as that of SAE axes with z down.
    #[schemars(example = -1)]
    pub sign: Option<Spanned<f64>>,
    /// Rows without a value; the rule of the table without it.
    #[schemars(example = &"interpolate")]
    pub gaps: Option<Gaps>,
}
