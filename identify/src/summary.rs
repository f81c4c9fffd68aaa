//! Tells people what an identification found: the verdict first, then errors that were estimated, then each quantity in a table.

use drive_doctor::LogExamination;
use numerics::text::{decimals_for_std, with_std};
use plugin::{ResultSummary, ResultTable, ResultTableRow};
use preparation::direction::ForceDirection;
use serde::Serialize;
use serde_json::{Map, Value, json};
use tire_inference::estimate::TireEstimate;
use tire_inference::model::{ModelFit, ModelVerdict, SystematicErrorEstimate};
use tire_inference::parameters::{Parameter, magic_formula_from_theta};
use tire_inference::prior::Prior;
use tire_inference::quantity::{HIGHEST_PEAK_SLIP, Quantity};
use tire_inference::verdict::Identifiability;

use crate::conclusion::{Conclusion, EngineeringValue, Reservation, slip_text};
use crate::design::d_optimal;
use crate::names::{describe_bounds, describe_uncertainty_source, quantity_unit};

/// One curve that was identified.
#[derive(Clone, Copy, Debug)]
pub struct CurveSummary<'a> {
    /// As "front".
    pub name: &'a str,
    /// Which force.
    pub direction: ForceDirection,
    /// What is published of it.
    pub estimate: &'a TireEstimate,
    /// What was known before.
    pub prior: &'a Prior,
    /// Load of the axle at rest [N], where the car is known.
    pub load: Option<f64>,
}

impl CurveSummary<'_> {
    /// Name in a sentence.
    pub fn title(&self) -> String {
        match self.direction {
            ForceDirection::Lateral => self.name.to_owned(),
            ForceDirection::Longitudinal => format!("{}, longitudinal", self.name),
        }
    }

    /// What comes before the name of a value; of the only curve nothing.
    fn axle(&self) -> String {
        match (self.name, self.direction) {
            ("curve", _) => String::new(),
            (name, ForceDirection::Lateral) => format!("{name} "),
            (name, ForceDirection::Longitudinal) => format!("{name} longitudinal "),
        }
    }

    fn value(&self, quantity: Quantity) -> Option<EngineeringValue> {
        Some(EngineeringValue {
            title: String::new(),
            unit: "",
            value: *self.estimate.mean.get(&quantity)?,
            interval: *self.estimate.interval.get(&quantity)?,
            verdict: *self.estimate.identified.get(&quantity)?,
        })
    }

    /// Stiffness, peak friction and the slip at the peak.
    fn engineering_values(&self) -> Vec<EngineeringValue> {
        let axle = self.axle();
        let stiffness = self.value(Quantity::K).map(|it| match (self.direction, self.load) {
            (ForceDirection::Lateral, load) => EngineeringValue::cornering_stiffness(&axle, &it, load),
            (_, Some(load)) => EngineeringValue {
                title: format!("{axle}slip stiffness"),
                unit: "kN",
                ..it.scaled(load / 1e3)
            },
            (_, None) => EngineeringValue { title: format!("{axle}slip stiffness over load"), ..it },
        });
        let peak = self.value(Quantity::Peak);
        let peak = peak.map(|it| EngineeringValue { title: format!("{axle}peak friction"), ..it });
        let (factor, unit) = match self.direction {
            ForceDirection::Lateral => (1_f64.to_degrees(), "deg"),
            ForceDirection::Longitudinal => (100.0, "%"),
        };
        let title = format!("{axle}slip at the peak");
        let slip = self.value(Quantity::PeakSlip);
        let slip = slip.map(|it| EngineeringValue { title, unit, ..it.scaled(factor) });
        stiffness.into_iter().chain(peak).chain(slip).collect()
    }

    /// The largest slip of the data.
    fn largest_slip(&self) -> f64 {
        self.estimate.slip_range.iter().fold(0.0, |largest: f64, slip| largest.max(slip.abs()))
    }

    /// The slips that would tell most, where a value is not identified.
    fn next_slips(&self) -> Option<String> {
        let is_open = |it: &EngineeringValue| it.verdict != Identifiability::Identified;
        if !self.engineering_values().iter().any(is_open) {
            return None;
        }
        let value =
            |parameter: Parameter| self.estimate.mean.get(&Quantity::from(parameter)).copied().unwrap_or(0.0);
        let tire = magic_formula_from_theta(&Parameter::ALL.map(value));
        let slip = |slip: &f64| slip_text(self.direction, *slip);
        let axle = self.axle();
        Some(match d_optimal(&tire, FARTHEST * self.largest_slip()) {
            Some(design) => {
                let slips: Vec<_> = design.slips.iter().map(slip).collect();
                format!("{axle}slips near {}", slips.join(", "))
            }
            None => format!("{axle}slips beyond {}", slip(&self.largest_slip())),
        })
    }
}

/// The largest slip that is proposed, over that of the data.
const FARTHEST: f64 = 1.5;

/// What is likely wrong with a log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogDoubt {
    /// What was found.
    pub finding: String,
    /// What to write or to do about it.
    pub correction: String,
}

/// What was found as a whole.
#[derive(Clone, Debug, Default)]
pub struct IdentificationSummary<'a> {
    /// Whether the model fits.
    pub model: ModelVerdict,
    /// Errors of sensors and car that were estimated with the tires.
    pub causes: &'a [SystematicErrorEstimate],
    /// Sentences about the log, the worst first.
    pub log: Vec<String>,
    /// The worst that is certain or likely of the log.
    pub doubt: Option<LogDoubt>,
    /// The curves.
    pub curves: Vec<CurveSummary<'a>>,
    /// What makes intervals and bands wider than their source says, in a sentence; empty if nothing does.
    pub widened: &'static str,
    /// Sentences that come last.
    pub remarks: Vec<String>,
}

impl IdentificationSummary<'_> {
    /// The verdict in a sentence.
    pub fn verdict(&self) -> String {
        let known = match (self.model.sentence.as_str(), self.model.verdict) {
            ("", ModelFit::Fits) if !self.is_tested() => "Whether the model fits was not tested.",
            ("", ModelFit::Fits) => "The model fits the data.",
            ("", ModelFit::DoesNotFit) => "The model does not fit the data.",
            (sentence, _) => sentence,
        };
        known.to_owned()
    }

    /// What to do with the result.
    pub fn conclusion(&self) -> Conclusion {
        let reservation = match (self.is_sound(), self.doubt.clone()) {
            (false, Some(LogDoubt { correction, .. })) => Reservation::wrong_log(self.verdict(), &correction),
            (false, None) => Reservation::Refusal { cause: self.verdict(), remedy: None },
            (true, Some(LogDoubt { finding, correction })) => Reservation::Log { finding, correction },
            (true, None) => Reservation::None,
        };
        let beyond = |told: &CurveSummary| {
            format!("the {}curve beyond {}", told.axle(), slip_text(told.direction, told.largest_slip()))
        };
        let stiffness = |name| {
            let lateral = |it: &&CurveSummary| it.name == name && it.direction == ForceDirection::Lateral;
            self.curves.iter().find(lateral)?.value(Quantity::K)
        };
        let balance = stiffness("front").zip(stiffness("rear"));
        let balance = balance.map(|(front, rear)| EngineeringValue::understeer_gradient([&front, &rear]));
        Conclusion {
            values: self.curves.iter().flat_map(CurveSummary::engineering_values).chain(balance).collect(),
            reservation,
            extrapolations: self.curves.iter().map(beyond).collect(),
            drives: self.curves.iter().filter_map(CurveSummary::next_slips).collect(),
        }
    }

    /// Sentences, of which the first has the verdict, and the next three say what to do with the result.
    fn summary(&self, conclusion: &Conclusion) -> Vec<String> {
        let verdict = std::iter::once(self.verdict());
        verdict.chain(conclusion.sentences()).chain(self.details()).collect()
    }

    /// The rest in sentences.
    pub fn details(&self) -> Vec<String> {
        let mut sentences = vec![self.describe_identified_count()];
        sentences.extend(self.causes.iter().map(|cause| cause.sentence.clone()));
        sentences.extend(self.log.iter().cloned());
        let bounded = self.list_quantities(|told, quantity| {
            quantity.parameter().is_some_and(|it| told.estimate.at_bound.contains(&it))
        });
        if !bounded.is_empty() {
            sentences.push(format!("On a bound of the box: {bounded}."));
        }
        let mut boxes: Vec<_> = self.curves.iter().map(|told| describe_bounds(told.prior)).collect();
        boxes.dedup();
        sentences.extend(boxes);
        sentences.extend(self.uncertainty_sources());
        sentences.extend(self.remarks.iter().cloned());
        sentences
    }

    /// Where intervals and bands come from.
    fn uncertainty_sources(&self) -> Vec<String> {
        let source = |told: &CurveSummary| describe_uncertainty_source(told.estimate.source, self.widened);
        let mut origins: Vec<_> = self.curves.iter().map(source).collect();
        origins.dedup();
        origins
    }

    /// The number of quantities that are identified, and the names of the others.
    fn describe_identified_count(&self) -> String {
        let verdicts = || self.curves.iter().flat_map(|told| told.estimate.identified.values());
        let identified = verdicts().filter(|it| **it == Identifiability::Identified).count();
        let of = |verdict: Identifiability| {
            let list = self
                .list_quantities(|told, quantity| told.estimate.identified.get(&quantity) == Some(&verdict));
            (!list.is_empty()).then(|| format!("; {}: {list}", verdict.to_display_text()))
        };
        let rest: String =
            [Identifiability::Weak, Identifiability::NotIdentifiable].into_iter().filter_map(of).collect();
        format!("{identified} of {} quantities are identified{rest}.", verdicts().count())
    }

    /// Quantities by curve: "front B, C; rear C".
    fn list_quantities(&self, is: impl Fn(&CurveSummary, Quantity) -> bool) -> String {
        let of = |told: &CurveSummary| {
            let all = Quantity::ALL.into_iter();
            let names: Vec<_> = all.filter(|quantity| is(told, *quantity)).map(Quantity::name).collect();
            (!names.is_empty()).then(|| format!("{} {}", told.title(), names.join(", ")))
        };
        self.curves.iter().filter_map(of).collect::<Vec<_>>().join("; ")
    }

    /// Whether anything was tested of the model.
    pub fn is_tested(&self) -> bool {
        let ModelVerdict { sentence, tests, .. } = &self.model;
        !sentence.is_empty() || !tests.is_empty()
    }

    /// Whether nothing speaks against the model.
    pub fn is_sound(&self) -> bool {
        self.model.verdict == ModelFit::Fits
    }

    /// What is for people.
    fn result_summary(&self) -> ResultSummary {
        let conclusion = self.conclusion();
        let mut tables: Vec<_> = conclusion.table().into_iter().collect();
        for direction in [ForceDirection::Lateral, ForceDirection::Longitudinal] {
            let curves: Vec<_> = self.curves.iter().filter(|told| told.direction == direction).collect();
            tables.extend((!curves.is_empty()).then(|| quantity_table(&curves)));
        }
        if !self.causes.is_empty() {
            let row = |it: &SystematicErrorEstimate| {
                let value = format!("{} {}", with_std(it.value, it.std), it.unit);
                [it.title.clone(), value.trim_end().to_owned(), it.verdict.to_display_text().to_owned()]
            };
            tables.push(ResultTable::new(["error", "value", ""], self.causes.iter().map(row)));
        }
        ResultSummary { summary: self.summary(&conclusion), sound: self.is_sound(), tables }
    }

    /// The result: what is found as a whole, before the numbers of each task.
    pub fn result_json(&self, doctor: Option<&LogExamination>, numbers: Map<String, Value>) -> Value {
        let (model, causes) = (&self.model, self.causes);
        json!(IdentificationResult { words: self.result_summary(), model, causes, doctor, numbers })
    }
}

/// The keys that results of all tasks share, and the numbers of each.
#[derive(Serialize)]
struct IdentificationResult<'a> {
    #[serde(flatten)]
    words: ResultSummary,
    /// Whether the model fits, with its tests.
    model: &'a ModelVerdict,
    /// Errors of sensors and car that were estimated with the tires.
    causes: &'a [SystematicErrorEstimate],
    /// What is wrong with the log.
    #[serde(skip_serializing_if = "Option::is_none")]
    doctor: Option<&'a LogExamination>,
    #[serde(flatten)]
    numbers: Map<String, Value>,
}

/// A row for each quantity, two columns for each curve.
fn quantity_table(curves: &[&CurveSummary]) -> ResultTable {
    let head = curves.iter().flat_map(|told| [told.name, ""]);
    let head = std::iter::once("").chain(head).map(str::to_owned).collect();
    let there = |quantity: &Quantity| curves.iter().any(|told| told.estimate.mean.contains_key(quantity));
    let row = |quantity: Quantity| {
        let cells = curves.iter().flat_map(|told| value_and_verdict_cells(told.estimate, quantity));
        let title = match quantity_unit(quantity, first_direction(curves)) {
            "–" => quantity.name().to_owned(),
            unit => format!("{quantity} [{unit}]"),
        };
        ResultTableRow(std::iter::once(title).chain(cells).collect())
    };
    ResultTable { head, rows: Quantity::ALL.into_iter().filter(there).map(row).collect() }
}

fn first_direction(curves: &[&CurveSummary]) -> ForceDirection {
    curves.first().map_or(ForceDirection::Lateral, |told| told.direction)
}

/// Value with interval, and verdict.
fn value_and_verdict_cells(estimate: &TireEstimate, quantity: Quantity) -> [String; 2] {
    let Some(&value) = estimate.mean.get(&quantity) else {
        return ["–".to_owned(), String::new()];
    };
    let std = estimate.std.get(&quantity).copied().unwrap_or(f64::NAN);
    let places = decimals_for_std(value, std);
    let interval = match estimate.interval.get(&quantity) {
        _ if estimate.is_held(quantity) => " (held)".to_owned(),
        Some([low, high]) => format!(" [{low:.places$}, {high:.places$}]"),
        None => String::new(),
    };
    let verdict = estimate.identified.get(&quantity).copied().map_or("", Identifiability::to_display_text);
    [format!("{value:.places$}{interval}"), verdict.to_owned()]
}

/// Removes the slip at the peak from an estimate whose curve, or whose posterior, has no peak.
pub fn remove_absent_peak(estimate: &mut TireEstimate) {
    let value = |parameter: Parameter| estimate.mean.get(&Quantity::from(parameter)).copied().unwrap_or(0.0);
    let peak = magic_formula_from_theta(&Parameter::ALL.map(value)).peak_slip();
    let slip = &Quantity::PeakSlip;
    let drawn = estimate.interval.get(slip).is_none_or(|[low, _]| *low < HIGHEST_PEAK_SLIP);
    if drawn && peak.is_some_and(|slip| slip.abs() < HIGHEST_PEAK_SLIP) {
        return;
    }
    for numbers in [&mut estimate.mean, &mut estimate.std] {
        numbers.remove(slip);
    }
    estimate.interval.remove(slip);
    estimate.identified.remove(slip);
    estimate.reason.remove(slip);
}

#[cfg(test)]
mod tests;
