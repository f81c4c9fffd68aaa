//! The keys that `[[table]]` and `[analysis.table]` share: a recorded file, its format and its columns.

use std::collections::BTreeMap;

use diagnostics::Spanned;
use recording::table::{CsvDialect, GapRule};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer};

use super::text_or_table::TextOrTable;

/// The words of a recorded file, whoever reads it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TableFile<'a> {
    /// At least one.
    pub paths: &'a [Spanned<String>],
    pub aliases: Option<&'a Spanned<String>>,
    pub time: Option<&'a Spanned<String>>,
    pub time_unit: Option<&'a Spanned<String>>,
    pub origin: Option<&'a Spanned<f64>>,
    pub gaps: GapRule,
    pub dialect: CsvDialect,
    pub columns: &'a BTreeMap<Spanned<String>, Spanned<Column>>,
}

/// Defines a table of words with those of a recorded file among them. Serde cannot both share words and refuse unknown ones.
macro_rules! table_file {
    ($(#[$about:meta])* pub struct $name:ident { $($own:tt)* }) => {
        $(#[$about])*
        #[derive(Debug, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($own)*
            /// Log of a data logger, CSV file or MCAP recording, relative to the scenario file. An analysis can have a list: the logs
            /// follow one another, each 10 s behind the end of the one before.
            #[serde(deserialize_with = "crate::document::one_or_more")]
            #[schemars(with = "crate::document::OneOrMore", example = &"drive.csv")]
            pub path: Vec<diagnostics::Spanned<String>>,
            /// File of aliases, relative to the scenario file: other names of columns, so that one scenario serves logs of several
            /// loggers. `v_x = ["Ground Speed", { column = "VehSpd", unit = "km/h" }]`: the first column that the log has is taken.
            #[schemars(example = &"aliases.toml")]
            pub aliases: Option<diagnostics::Spanned<String>>,
            /// Column of the time. A log of a data logger that has one of its own needs no mention of it, nor does a text file of a known
            /// one; MCAP has `log_time`, which needs none either, and `publish_time`. Of a time in two columns, seconds and nanoseconds,
            /// it is what their names have in common: `header.stamp`.
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
            pub gaps: recording::table::GapRule,
            /// Letter between the cells of a CSV file; detected without it.
            #[schemars(example = &";")]
            pub separator: Option<recording::table::Separator>,
            /// Decimal mark of a CSV file; detected without it.
            #[schemars(example = &",")]
            pub decimal: Option<recording::table::DecimalMark>,
            /// Number of the line with the titles of a CSV file, from 1 on; without it the line above the first rows of numbers.
            #[schemars(example = 10)]
            pub title_row: Option<usize>,
            /// Whether the line below the titles of a CSV file has units, or the number of the line that has them; detected without it.
            #[schemars(example = true)]
            pub unit_row: Option<recording::table::UnitRow>,
            /// Columns by the names of the node's outputs, or of the signals of the plugin: a name of the file or of an alias, or a table.
            /// They may be left out where there are `aliases`: what the plugin takes and the log has is taken, and of a node all of them.
            #[serde(default, deserialize_with = "crate::document::table_file::columns")]
            #[schemars(with = "std::collections::BTreeMap<String, crate::document::table_file::ColumnEntry>")]
            pub columns: std::collections::BTreeMap<diagnostics::Spanned<String>, diagnostics::Spanned<$crate::document::Column>>,
        }

        impl $name {
            pub(crate) fn file(&self) -> $crate::document::TableFile<'_> {
                let $name { path, aliases, time, time_unit, origin, gaps, columns, .. } = self;
                let $name { separator, decimal, title_row, unit_row, .. } = *self;
                $crate::document::TableFile {
                    paths: path,
                    aliases: aliases.as_ref(),
                    time: time.as_ref(),
                    time_unit: time_unit.as_ref(),
                    origin: origin.as_ref(),
                    gaps: *gaps,
                    dialect: recording::table::CsvDialect { separator, decimal, title_row, unit_row },
                    columns,
                }
            }
        }
    };
}
pub(super) use table_file;

/// A column of a recorded file: `v_x = { column = "vx_mps", unit = "m/s" }`, or `v_x = "vx_mps"`.
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
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// Title of the column in the file, with or without its unit; of several columns of one title `speed [gps]` by their source, or
    /// `speed #2`. In MCAP it is `/topic.field`, or `node.variable` of a recorded run.
    #[schemars(example = &"vx_mps")]
    pub column: Spanned<String>,
    /// Unit of the column, with its gain; that of the file without it.
    #[schemars(example = &"m/s")]
    pub unit: Option<Spanned<String>>,
    /// Factor, such as one over the steering ratio.
    #[schemars(example = 0.0625)]
    pub gain: Option<Spanned<f64>>,
    /// Sum after the gain, in the unit of the column.
    #[schemars(example = 0.3, extend("x-unit" = "of the table"))]
    pub offset: Option<Spanned<f64>>,
    /// 1, or -1 for the opposite sign convention, such as that of SAE axes with z down.
    #[schemars(example = -1)]
    pub sign: Option<Spanned<f64>>,
    /// Time by which the column is late [s]: a value is that of this much before its time stamp; negative if it is early.
    #[schemars(example = 0.02)]
    pub delay: Option<Spanned<f64>>,
    /// Rows without a value; the rule of the table without it.
    #[schemars(example = &"interpolate")]
    pub gaps: Option<GapRule>,
}

/// A column by its name, or a table.
#[derive(Debug, JsonSchema)]
#[schemars(untagged)]
pub enum ColumnEntry {
    /// Its name.
    Name(String),
    /// Its name, with unit, gain and more.
    Whole(Box<Column>),
}

impl<'de> Deserialize<'de> for ColumnEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(TextOrTable {
            expected: "the name of a column, or a table with `column`",
            from_text: ColumnEntry::Name,
            from_table: |column| ColumnEntry::Whole(Box::new(column)),
        })
    }
}

impl Column {
    /// The column of a word.
    pub(crate) fn from_entry(word: Spanned<ColumnEntry>) -> Spanned<Self> {
        let span = word.span();
        let column = match word.into_inner() {
            ColumnEntry::Whole(column) => *column,
            ColumnEntry::Name(name) => Column {
                column: Spanned::new(span.clone(), name),
                unit: None,
                gain: None,
                offset: None,
                sign: None,
                delay: None,
                gaps: None,
            },
        };
        Spanned::new(span, column)
    }

    /// Whether it says anything but a name and a rule for gaps.
    pub(crate) fn has_conversion(&self) -> bool {
        let numbers = [&self.gain, &self.offset, &self.sign, &self.delay];
        self.unit.is_some() || numbers.iter().any(|it| it.is_some())
    }

    /// The column of an alias, with what this one says itself; all words are then at the span of this one's name.
    pub(crate) fn with_alias(&self, alias: &Column) -> Column {
        fn own_or_alias<T: Clone>(
            own: &Option<Spanned<T>>,
            alias: &Option<Spanned<T>>,
            at: &Spanned<String>,
        ) -> Option<Spanned<T>> {
            let moved = |it: &Spanned<T>| Spanned::new(at.span(), it.get_ref().clone());
            own.clone().or_else(|| alias.as_ref().map(moved))
        }
        let at = &self.column;
        Column {
            column: Spanned::new(at.span(), alias.column.get_ref().clone()),
            unit: own_or_alias(&self.unit, &alias.unit, at),
            gain: own_or_alias(&self.gain, &alias.gain, at),
            offset: own_or_alias(&self.offset, &alias.offset, at),
            sign: own_or_alias(&self.sign, &alias.sign, at),
            delay: own_or_alias(&self.delay, &alias.delay, at),
            gaps: self.gaps.or(alias.gaps),
        }
    }
}

/// Columns by their names.
type Columns = BTreeMap<Spanned<String>, Spanned<Column>>;

/// Reads columns, each as its name or a table.
pub(super) fn columns<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Columns, D::Error> {
    let words = BTreeMap::<Spanned<String>, Spanned<ColumnEntry>>::deserialize(deserializer)?;
    Ok(words.into_iter().map(|(name, word)| (name, Column::from_entry(word))).collect())
}
