//! The verdict comes first, an absent peak is not named, and tables hold any number of curves.

use std::sync::LazyLock;

use tire_inference::estimate::identify_tire;
use tire_inference::model::FitTest;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};

use super::*;
use crate::names::{CAR_ADDED, SCATTER_ADDED};

fn estimate() -> TireEstimate {
    let excitation = SyntheticExcitation { samples: 400, ..SyntheticExcitation::default() };
    let settings = IdentificationSettings::new(ForceDirection::Longitudinal);
    let answer = identify_tire(&synthetic_samples(&excitation, 0.3), &settings, &[FitMethod::LeastSquares]);
    answer.expect("a fit").estimates.swap_remove(0).1
}

static PRIOR: LazyLock<Prior> = LazyLock::new(Prior::lateral);

fn lateral<'a>(name: &'a str, estimate: &'a TireEstimate) -> CurveSummary<'a> {
    CurveSummary { name, direction: ForceDirection::Lateral, estimate, prior: &PRIOR, load: Some(5000.0) }
}

#[test]
fn the_verdict_on_the_model_comes_first_and_then_what_is_not_known() {
    let front = estimate();
    let mut rear = front.clone();
    for (name, verdict) in
        [(Quantity::E, Identifiability::NotIdentifiable), (Quantity::C, Identifiability::Weak)]
    {
        rear.identified.insert(name, verdict);
    }
    rear.at_bound = vec![Parameter::E];
    let cause = SystematicErrorEstimate {
        name: "steering_offset".to_owned(),
        title: "offset of the steering angle".to_owned(),
        unit: "rad".to_owned(),
        value: 0.0052,
        std: 0.0002,
        interval: [0.0048, 0.0056],
        verdict: Identifiability::Identified,
        gain: Some(80.0),
        sentence: "The steering angle reads 0.30° too much; corrected in the fit.".to_owned(),
        correction: "offset = -0.0052".to_owned(),
    };
    let sentence = "The model does not fit: the yaw rate is late.".to_owned();
    let model = ModelVerdict { verdict: ModelFit::DoesNotFit, sentence, tests: Vec::new() };
    let overall = IdentificationSummary {
        model,
        causes: std::slice::from_ref(&cause),
        log: vec!["`r` is late.".to_owned()],
        doubt: None,
        curves: vec![lateral("front", &front), lateral("rear", &rear)],
        widened: CAR_ADDED,
        remarks: vec!["It is cold.".to_owned()],
    };
    assert_eq!(overall.verdict(), "The model does not fit: the yaw rate is late.");
    let conclusion = overall.conclusion();
    let titles: Vec<_> = conclusion.values.iter().map(|it| it.title.as_str()).collect();
    assert_eq!(titles[..3], ["front cornering stiffness", "front peak friction", "front slip at the peak"]);
    assert_eq!(titles.last(), Some(&"balance: understeer gradient"));
    let three: Vec<_> = conclusion.sentences().collect();
    assert_eq!(
        three[..2],
        [
            "You can use: nothing of this result.",
            "You cannot use: any value. The model does not fit: the yaw rate is late."
        ]
    );
    let summary: Vec<_> = std::iter::once(overall.verdict()).chain(overall.details()).collect();
    assert!(summary[1].ends_with("rear C; not identifiable: rear E."), "{summary:?}");
    assert_eq!(summary[2..4], [cause.sentence.clone(), "`r` is late.".to_owned()]);
    assert_eq!(summary[4], "On a bound of the box: rear E.");
    assert!(summary[5].starts_with("Box wide: B 1 … 80, C 0.5 … 3, "), "{summary:?}");
    assert_eq!(
        summary[6..],
        [describe_uncertainty_source(UncertaintySource::Grid, CAR_ADDED), "It is cold.".to_owned()]
    );
    let result = overall.result_json(None, Map::new());
    assert_eq!(result["sound"], false);
    assert_eq!(result["causes"][0]["correction"], "offset = -0.0052");
    let [curves, causes] = [1, 2].map(|table| &result["tables"][table]);
    assert_eq!(curves["head"], json!(["", "front", "", "rear", ""]));
    assert_eq!(curves["rows"][0][0], "B [1/rad]");
    assert!(
        curves["rows"].as_array().expect("rows").iter().all(|row| row.as_array().map(Vec::len) == Some(5))
    );
    let row = json!(["offset of the steering angle", "0.00520 ± 0.00020 rad", "identified"]);
    assert_eq!(causes["rows"][0], row);
    let fits =
        IdentificationSummary { curves: vec![lateral("curve", &front)], ..IdentificationSummary::default() };
    assert_eq!(fits.verdict(), "Whether the model fits was not tested.");
    assert!(fits.is_sound() && fits.details()[0].contains(" of 7 quantities are identified"));
    let test = FitTest { name: "whiteness".to_owned(), statistic: 0.5, limit: 1.0, sentence: String::new() };
    let tested = ModelVerdict { tests: vec![test], ..ModelVerdict::default() };
    let fits =
        IdentificationSummary { model: tested, curves: Vec::new(), ..IdentificationSummary::default() };
    assert_eq!(fits.verdict(), "The model fits the data.");
}

#[test]
fn a_curve_without_a_peak_has_no_slip_at_it() {
    let peaked = estimate();
    assert!(peaked.mean.contains_key(&Quantity::PeakSlip));
    let mut same = peaked.clone();
    remove_absent_peak(&mut same);
    assert_eq!(same, peaked);
    for shape in [[1.0, 0.0], [0.9, -2.0], [1.05, 1.0]] {
        let mut flat = peaked.clone();
        flat.mean.extend([Quantity::C, Quantity::E].into_iter().zip(shape));
        remove_absent_peak(&mut flat);
        assert!(
            !flat.mean.contains_key(&Quantity::PeakSlip)
                && !flat.identified.contains_key(&Quantity::PeakSlip)
        );
        assert!(flat.mean.contains_key(&Quantity::Peak));
        assert_eq!(value_and_verdict_cells(&flat, Quantity::PeakSlip)[0], "–");
    }
}

#[test]
fn the_manual_says_where_bands_come_from_in_the_words_of_page_and_report() {
    const MANUAL: &str = include_str!("../../../docs/identification.md");
    let manual = MANUAL.split_whitespace().collect::<Vec<_>>().join(" ");
    for (source, widened) in [
        (UncertaintySource::Grid, CAR_ADDED),
        (UncertaintySource::Tempered, ""),
        (UncertaintySource::Importance, ""),
        (UncertaintySource::Likelihood, SCATTER_ADDED),
    ] {
        let said = describe_uncertainty_source(source, widened);
        let (shown, rest) = said.split_once("; ").expect("two halves");
        let (intervals, _) = rest.split_once('.').expect("a sentence");
        let shown = shown.replace("Bands and densities show ", "");
        for words in [shown.as_str(), intervals, widened] {
            assert!(manual.contains(words), "{words}");
        }
    }
}
