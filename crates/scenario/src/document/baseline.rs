//! The keys of `[[baseline]]`, a recording that the run is compared with.

use diagnostics::Spanned;
use schemars::JsonSchema;
use serde::Deserialize;

/// A recording that the run must repeat within a tube. It counts as one check. `--bless` writes it.
///
/// Around each recorded value lies a rectangle: as far up and down as `absolute` and `relative` say together, and as far to
/// both sides as `time` says. The rectangles along the recorded curve make the tube. Integers, truth values, enumerations and
/// texts must be equal within the time tolerance.
///
/// ```toml
/// [[baseline]]
/// name = "as before"
/// recording = "golden/step_steer.mcap"
/// signals = ["plant.*"]
/// relative = 0.002
/// time = 0.01
/// tubes = [{ signals = ["plant.a_*"], absolute = 0.05 }]
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Baseline {
    /// Name of the check in reports.
    #[schemars(example = &"as before")]
    pub name: Spanned<String>,
    /// Recording of a run, `run.mcap` or `run.csv` under any name, relative to the scenario file. A CSV file has the time in
    /// its first column.
    #[schemars(example = &"golden/step_steer.mcap")]
    pub recording: Spanned<String>,
    /// Compared signals, `*` stands for any letters; all recorded ones without it.
    #[schemars(example = ["plant.*"])]
    pub signals: Option<Vec<Spanned<String>>>,
    /// Half height of the tube, in the unit of each signal.
    #[serde(default)]
    #[schemars(example = 0.01)]
    pub absolute: f64,
    /// Half height of the tube as a share of the range of the signal in the recording.
    #[serde(default = "Baseline::default_relative")]
    #[schemars(example = 0.01)]
    pub relative: f64,
    /// Half width of the tube [s].
    #[serde(default)]
    #[schemars(example = 0.01)]
    pub time: f64,
    /// Sizes for some of the signals; of several that name a signal the last one counts.
    #[serde(default)]
    pub tubes: Vec<BaselineTube>,
    /// Beginning and end of the comparison [s]; the whole run without it.
    #[schemars(example = [2.0, 8.0])]
    pub during: Option<Spanned<[f64; 2]>>,
}

impl Baseline {
    fn default_relative() -> f64 {
        0.002
    }
}

/// Sizes of the tube for some signals: `{ signals = ["plant.a_*"], absolute = 0.05 }`. What it leaves out is as for the others.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BaselineTube {
    /// Signals; `*` stands for any letters.
    #[schemars(example = ["plant.a_*"])]
    pub signals: Vec<Spanned<String>>,
    /// Half height, in the unit of each signal.
    #[schemars(example = 0.05)]
    pub absolute: Option<f64>,
    /// Half height as a share of the range of the signal in the recording.
    #[schemars(example = 0.01)]
    pub relative: Option<f64>,
    /// Half width [s].
    #[schemars(example = 0.02)]
    pub time: Option<f64>,
}
