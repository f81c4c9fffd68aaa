//! The words of a scenario that the user typed, each with its place in the file.

mod extend;
mod read;

mod view;

use std::collections::BTreeMap;
use std::ops::Range;

use diagnostics::{Error, Source};
use recording::table::Interpolation;
use serde::Deserialize;
use toml::Spanned;

use crate::effects::{Effects, Noise};
use crate::product::Product;
use crate::signal::Part;
pub use view::{Arrow, Axis, Curve, Function, Plane, Plot, Point, Pose, Track, View};

/// A scenario as it was written.
#[derive(Debug)]
pub struct Scenario {
    /// The file's stem, which names the run.
    pub name: String,
    /// The file and those that it extends, for messages that point into them.
    pub source: Source,
    /// What they say together.
    pub document: Document,
    /// The scenarios of `[[validation]]`.
    pub validations: Vec<Scenario>,
}

/// The top level of a scenario file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    /// The scenario that this one changes or adds to, relative to the scenario file. When a document is read, that has been done.
    pub extends: Option<Spanned<String>>,
    /// What is not taken over from it: names of entries, in which `*` stands for any letters, by list.
    #[serde(default)]
    pub without: BTreeMap<String, Vec<Spanned<String>>>,
    /// What the run is about.
    pub title: Option<String>,
    /// Seed of every random stream; 1 unless it is given.
    #[serde(default = "one")]
    pub seed: u64,
    /// When the run ends, in which steps; a scenario of analyses alone needs none.
    pub time: Option<Time>,
    /// How the nodes hand over values.
    #[serde(default)]
    pub coupling: Coupling,
    /// FMUs.
    #[serde(default)]
    pub fmu: Vec<Fmu>,
    /// Generated signals.
    #[serde(default)]
    pub signal: Vec<Spanned<Part>>,
    /// Recorded signals.
    #[serde(default)]
    pub table: Vec<Table>,
    /// What is connected to what.
    #[serde(default)]
    pub connect: Vec<Connect>,
    /// What breaks when.
    #[serde(default)]
    pub fault: Vec<Fault>,
    /// What is made of what was recorded.
    #[serde(default)]
    pub analysis: Vec<Analysis>,
    /// What is run with what the analyses found.
    #[serde(default)]
    pub validation: Vec<Validation>,
    /// What must hold.
    #[serde(default)]
    pub check: Vec<Check>,
    /// What is recorded.
    #[serde(default)]
    pub record: Record,
    /// How the replay looks.
    #[serde(default)]
    pub view: View,
}

fn one() -> u64 {
    1
}

/// `[time]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// Communication step [s].
    pub step: Spanned<f64>,
    /// Last communication point [s].
    pub stop: Spanned<f64>,
}

/// `[coupling]`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Coupling {
    /// Who sees whose values when.
    #[serde(default)]
    pub algorithm: Algorithm,
}

/// Who sees whose values when.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Algorithm {
    /// The nodes step one after the other, and each sees what those before it have just computed
    /// (Gauss-Seidel).
    #[default]
    Sequential,
    /// All nodes step with the values from the start of the step, so their order does not matter.
    Jacobi,
}

/// `[[fmu]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fmu {
    /// Name of the node.
    pub name: Spanned<String>,
    /// The archive, relative to the scenario file.
    pub path: Option<Spanned<String>>,
    /// The package that the archive is built from, in the workspace around the scenario file.
    #[serde(rename = "crate")]
    pub package: Option<Spanned<String>>,
    /// The example of the package that the archive is built from, instead of the package itself.
    pub example: Option<Spanned<String>>,
    /// Start values by variable.
    #[serde(default)]
    pub start: BTreeMap<Spanned<String>, Spanned<toml::Value>>,
    /// Whether the FMU logs all it has to say.
    #[serde(default)]
    pub log: bool,
}

impl Fmu {
    /// What the archive is built from, when it has no path.
    #[must_use]
    pub fn product(&self) -> Option<Product> {
        product(self.path.as_ref(), self.package.as_ref(), self.example.as_ref())
    }
}

fn product(
    path: Option<&Spanned<String>>,
    package: Option<&Spanned<String>>,
    example: Option<&Spanned<String>>,
) -> Option<Product> {
    let package = package.filter(|_| path.is_none())?.get_ref().clone();
    Some(Product { package, example: example.map(|word| word.get_ref().clone()) })
}

/// `[[table]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Name of the node.
    pub name: Spanned<String>,
    /// The CSV file or MCAP recording, relative to the scenario file.
    pub path: Spanned<String>,
    /// The column of the time [s]; of MCAP `log_time`, which it is unless it is given, or `publish_time`.
    pub time: Option<Spanned<String>>,
    /// What the file's clock shows at the scenario's time 0 [s]; its first row unless it is given.
    pub origin: Option<f64>,
    /// How values between two rows are made.
    #[serde(default)]
    pub interpolation: Interpolation,
    /// The outputs of the node by name.
    pub columns: BTreeMap<Spanned<String>, Spanned<Column>>,
}

/// An entry of `columns`: `v_x = { column = "vx_mps", unit = "m/s" }`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Column {
    /// The column's title in the file; of MCAP `/topic.field`, or `node.variable` of a recorded run.
    pub column: Spanned<String>,
    /// Its unit; the one that the file tells unless it is given.
    pub unit: Option<Spanned<String>>,
}

/// `[[analysis]]`: a plugin, what it gets, and what it is to do.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Analysis {
    /// Its name, under which checks and reports know its result.
    pub name: Spanned<String>,
    /// The dynamic library, relative to the scenario file.
    pub path: Option<Spanned<String>>,
    /// The package that the library is built from, in the workspace around the scenario file.
    #[serde(rename = "crate")]
    pub package: Option<Spanned<String>>,
    /// The example of the package that the library is built from, instead of the package itself.
    pub example: Option<Spanned<String>>,
    /// Signals of the run, by the name that the plugin knows each by.
    #[serde(default)]
    pub signals: BTreeMap<Spanned<String>, Spanned<String>>,
    /// Signals of a file, as they were recorded.
    pub table: Option<Log>,
    /// Text files, relative to the scenario file, whose contents the plugin gets: in its configuration, under `files`.
    #[serde(default)]
    pub files: BTreeMap<Spanned<String>, Spanned<String>>,
    /// What the plugin is to do, in its own words.
    pub config: Option<Spanned<toml::Table>>,
    /// Where its keys and values stand.
    #[serde(skip)]
    pub places: Vec<Range<usize>>,
}

impl Analysis {
    /// What the library is built from, when it has no path.
    #[must_use]
    pub fn product(&self) -> Option<Product> {
        product(self.path.as_ref(), self.package.as_ref(), self.example.as_ref())
    }
}

/// `[analysis.table]`: as `[[table]]`, but handed over row by row and not played back.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Log {
    /// The file, relative to the scenario file.
    pub path: Spanned<String>,
    /// The time, as in `[[table]]`.
    pub time: Option<Spanned<String>>,
    /// What the file's clock shows at the analysis' time 0 [s]; its first row unless it is given.
    pub origin: Option<f64>,
    /// Its signals, by the name that the plugin knows each by.
    pub columns: BTreeMap<Spanned<String>, Spanned<Column>>,
}

/// `[[validation]]`: another scenario, which runs after the analyses.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Validation {
    /// Its name, under which checks and reports know how it went; so is the folder of its files.
    pub name: Spanned<String>,
    /// The scenario, relative to the scenario file.
    pub scenario: Spanned<String>,
    /// FMUs of it that start as an FMU of this run does, but for what the scenario itself says.
    #[serde(default)]
    pub like: BTreeMap<Spanned<String>, Spanned<String>>,
    /// Start values as on the command line: `node.variable=value`, or `@FILE` that an analysis leaves or that is beside the
    /// scenario file.
    #[serde(default)]
    pub set: Vec<Spanned<String>>,
}

/// At which end of the receiver's step a value is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum At {
    /// The value at the communication point where the step starts.
    Start,
    /// The value at the communication point where the step ends.
    End,
}

/// `[[connect]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Connect {
    /// The output, `node.variable`.
    pub from: Spanned<String>,
    /// The input, `node.variable`.
    pub to: Spanned<String>,
    /// Which end of the step the value is taken at: for FMUs the end unless it is given, for signals
    /// and tables the start.
    pub at: Option<Spanned<At>>,
    /// The change of type that is wanted; none takes place unless it is given.
    pub convert: Option<Spanned<Convert>>,
    /// Sensor effect: Gaussian noise.
    pub noise: Option<Spanned<Noise>>,
    /// Sensor effect: added.
    pub bias: Option<Spanned<f64>>,
    /// Sensor effect: multiplied.
    pub gain: Option<Spanned<f64>>,
    /// Sensor effect: late by this time [s].
    pub delay: Option<Spanned<f64>>,
    /// Sensor effect: rounded to multiples of this.
    pub quantise: Option<Spanned<f64>>,
    /// Sensor effect: sampled with this period [s].
    pub hold: Option<Spanned<f64>>,
    /// Sensor effect: share of the samples that are lost.
    pub dropout: Option<Spanned<f64>>,
}

impl Connect {
    /// The sensor effects of the connection.
    #[must_use]
    pub fn effects(&self) -> Effects {
        let number = |word: &Option<Spanned<f64>>| word.as_ref().map(|word| *word.get_ref());
        Effects {
            noise: self.noise.as_ref().map(|word| *word.get_ref()),
            bias: number(&self.bias),
            gain: number(&self.gain),
            delay: number(&self.delay),
            quantise: number(&self.quantise),
            hold: number(&self.hold),
            dropout: number(&self.dropout),
        }
    }

    /// The key of the first sensor effect, and where its value stands.
    #[must_use]
    pub fn first_effect(&self) -> Option<(&'static str, Range<usize>)> {
        let number = |word: &Option<Spanned<f64>>| word.as_ref().map(Spanned::span);
        let effects = [
            ("noise", self.noise.as_ref().map(Spanned::span)),
            ("bias", number(&self.bias)),
            ("gain", number(&self.gain)),
            ("delay", number(&self.delay)),
            ("quantise", number(&self.quantise)),
            ("hold", number(&self.hold)),
            ("dropout", number(&self.dropout)),
        ];
        effects.into_iter().find_map(|(key, place)| Some((key, place?)))
    }
}

/// A change of type on a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Convert {
    /// False is 0, true is 1.
    BooleanToInteger,
    /// 0 is false, 1 is true, any other value ends the run.
    IntegerToBoolean,
    /// The value of the item.
    EnumerationToInteger,
    /// The item with this value; a value that no item has ends the run.
    IntegerToEnumeration,
    /// The same number, which a Real holds exactly.
    IntegerToReal,
}

/// `[[fault]]`: what an input gets instead of what is connected to it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// The input, `node.variable`.
    pub input: Spanned<String>,
    /// When it begins [s].
    pub from: f64,
    /// When it ends [s]; never unless it is given.
    pub until: Option<f64>,
    /// The value at the beginning stays.
    #[serde(default)]
    pub freeze: bool,
    /// This value, which may be `nan`.
    pub value: Option<f64>,
    /// Added.
    pub bias: Option<f64>,
    /// Multiplied.
    pub gain: Option<f64>,
}

/// `[[check]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Check {
    /// What the check is called in reports.
    pub name: String,
    /// What must hold.
    pub that: Spanned<String>,
    /// First and last moment at which it must hold [s].
    pub during: Option<Spanned<[f64; 2]>>,
    /// By how much a comparison may be off.
    #[serde(default)]
    pub tolerance: f64,
}

/// `[record]`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Names of variables that are not recorded; `*` stands for any letters.
    #[serde(default)]
    pub except: Vec<Spanned<String>>,
}

impl Scenario {
    /// An error at a word of the scenario.
    pub fn error<T>(&self, at: &Spanned<T>, message: impl Into<String>) -> Error {
        self.source.error(at.span(), message, "")
    }
}
