//! The words about recorded files, whether they are played back or analysed, and about their columns.

use std::collections::BTreeMap;

use diagnostics::Spanned;
use recording::table::{Dialect, Gaps};
use schemars::JsonSchema;
use serde::Deserialize;

/// The words of a recorded file, whoever reads it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RecordedFile<'a> {
    pub path: &'a Spanned<String>,
    pub time: Option<&'a Spanned<String>>,
    pub time_unit: Option<&'a Spanned<String>>,
    pub origin: Option<&'a Spanned<f64>>,
    pub gaps: Gaps,
    pub dialect: Dialect,
    pub columns: &'a BTreeMap<Spanned<String>, Spanned<Column>>,
}

/// Defines a table of words with those of a recorded file among them. Serde cannot both share words and refuse unknown ones.
macro_rules! recorded_file {
    ($(#[$about:meta])* pub struct $name:ident { $($own:tt)* }) => {
        $(#[$about])*
        #[derive(Debug, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($own)*
            /// CSV file or MCAP recording, relative to the scenario file.
            #[schemars(example = &"drive.csv")]
            pub path: diagnostics::Spanned<String>,
            /// Column of the time. MCAP has `log_time`, which needs no mention, and `publish_time`.
            #[schemars(example = &"t_s")]
            pub time: Option<diagnostics::Spanned<String>>,
            /// Unit of the time; that of the file without it, or else s.
            #[schemars(example = &"ms")]
            pub time_unit: Option<diagnostics::Spanned<String>>,
            /// Time of the file at time 0 of the scenario or the analysis [s]; that of its first row without it.
            #[schemars(example = 1000.0)]
            pub origin: Option<diagnostics::Spanned<f64>>,
            /// Rows where a column has no value: an empty cell, `NaN`, `NA` or `-`. A column can have a rule of its own.
            #[serde(default)]
            #[schemars(example = &"hold")]
            pub gaps: recording::table::Gaps,
            /// Letter between the cells of a CSV file; detected without it.
            #[schemars(example = &";")]
            pub separator: Option<recording::table::Separator>,
            /// Decimal mark of a CSV file; detected without it.
            #[schemars(example = &",")]
            pub decimal: Option<recording::table::Decimal>,
            /// Whether a line of units follows the titles of a CSV file; detected without it.
            #[schemars(example = true)]
            pub unit_row: Option<bool>,
            /// Columns by the names of the node's outputs, or of the signals of the plugin.
            pub columns: std::collections::BTreeMap<diagnostics::Spanned<String>, diagnostics::Spanned<$crate::words::Column>>,
        }

        impl $name {
            pub(crate) fn file(&self) -> $crate::words::RecordedFile<'_> {
                let $name { path, time, time_unit, origin, gaps, columns, .. } = self;
                let $name { separator, decimal, unit_row, .. } = *self;
                $crate::words::RecordedFile {
                    path,
                    time: time.as_ref(),
                    time_unit: time_unit.as_ref(),
                    origin: origin.as_ref(),
                    gaps: *gaps,
                    dialect: recording::table::Dialect { separator, decimal, unit_row },
                    columns,
                }
            }
        }
    };
}
pub(super) use recorded_file;

/// A column of a recorded file: `v_x = { column = "vx_mps", unit = "m/s" }`.
///
/// Its value is `sign * gain * recorded value + offset`, at the recorded time less `delay`.
///
/// ```toml
/// [table.columns.delta]
/// column = "steer_deg"
/// unit = "deg"
/// gain = 0.0625 # one over the steering ratio
/// offset = 0.3  # [deg]
/// sign = -1     # the logger counts to the right
/// delay = 0.02  # [s]
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
    /// Time by which the column is late [s]: a value is that of this much before its time stamp; negative if it is early.
    #[schemars(example = 0.02)]
    pub delay: Option<Spanned<f64>>,
    /// Rows without a value; the rule of the table without it.
    #[schemars(example = &"interpolate")]
    pub gaps: Option<Gaps>,
}
