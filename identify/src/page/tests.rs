//! Checks that the page is well formed, needs nothing else, and shows the numbers of its structs.

use numerics::convergence::ConvergenceReport;
use numerics::text::decimals_for_std;
use tire_inference::compressed::CompressedSamples;
use tire_inference::estimate::{assemble_estimate, identify_tire};
use tire_inference::fit::FitSolution;
use tire_inference::model::{FitTest, ModelFit, ModelVerdict, SystematicErrorEstimate};
use tire_inference::posterior::{SamplingOptions, draw_posterior};
use tire_inference::settings::{FitMethod as Asked, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};
use tire_inference::verdict::{Identifiability, MeasurementEvidence, judge_quantities};

use super::*;
use crate::studies::excitation::{ExcitationLevel, ExcitationStudy, VariationalMoments};

struct Found {
    samples: CurveSamples,
    prior: Prior,
    posterior: PosteriorSamples,
    estimate: TireEstimate,
    study: ExcitationStudy,
}

fn rendered(page: &PageContent) -> String {
    render_page(page, &page.sections.iter().map(TireFigures::for_section).collect::<Vec<_>>())
}

fn found() -> Found {
    let excitation = SyntheticExcitation { samples: 400, ..SyntheticExcitation::default() };
    let samples = synthetic_samples(&excitation, 0.08);
    let data = CompressedSamples::new(&samples);
    let prior = Prior::longitudinal();
    let posterior = draw_posterior(&data, &prior, &[], &SamplingOptions { draws: 512, seed: 0 }).posterior;
    let slip_range = samples.slip_range().expect("points");
    let evidence = MeasurementEvidence {
        data: &data,
        slip_range,
        noise_std: 0.05,
        direction: ForceDirection::Longitudinal,
    };
    let judgements = judge_quantities(&evidence, &prior, &posterior, &excitation.truth);
    let convergence = ConvergenceReport {
        status: OptimisationStatus::Converged,
        iterations: 12,
        evaluations: 40,
        kkt_residual: Some(1e-10),
        starts: 8,
        optima: 1,
        cost: 1.0,
        trace: vec![3.0, 1.5, 1.0],
    };
    let solution = FitSolution {
        theta: excitation.truth,
        cost: 1.0,
        noise_std: 0.0512,
        free: vec![],
        covariance: nalgebra::DMatrix::zeros(0, 0),
        at_bound: vec![],
        convergence,
        optima: vec![],
    };
    let estimate = assemble_estimate(&solution, &[], &judgements, &posterior, slip_range, samples.len());
    let level = |level| ExcitationLevel {
        level,
        least_squares: excitation.truth,
        nelder_mead: [f64::NAN; 6],
        svi: VariationalMoments::default(),
        judgements: judgements.clone(),
    };
    let study = ExcitationStudy { levels: vec![level(0.01), level(0.08), level(1.0)], excitation };
    Found { samples, prior, posterior, estimate, study }
}

fn page(found: &Found, title: &str) -> String {
    let (estimate, posterior) = (&found.estimate, &found.posterior);
    let method = MethodSection { name: "least <squares>", estimate, posterior, gaussian: None };
    let section = TireSection {
        name: "front axle & more",
        direction: ForceDirection::Longitudinal,
        samples: &found.samples,
        prior: &found.prior,
        methods: vec![method],
    };
    let tire = tire_inference::parameters::magic_formula_from_theta(&found.study.excitation.truth);
    let sensitivity = sensitivity::run_sensitivity_study(&tire, 0.1, 1.0, 50);
    rendered(&PageContent {
        title,
        facts: &[("seed".to_owned(), "42 & <b>".to_owned())],
        sections: vec![section],
        drives: None,
        log: None,
        overall: None,
        car: &[("mass".to_owned(), "982 ± 20 kg".to_owned())],
        excitation: Some(&found.study),
        sensitivity: Some(&sensitivity),
        drift: &[],
        loads: &[],
    })
}

fn text_of(document: &roxmltree::Document) -> String {
    document.descendants().filter_map(|node| node.text()).collect::<Vec<_>>().join(" ")
}

fn parse(html: &str) -> roxmltree::Document<'_> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    roxmltree::Document::parse_with_options(html, options).expect("well-formed")
}

#[test]
fn the_page_is_well_formed_and_needs_nothing_else() {
    let html = page(&found(), "Tires </title><script>alert(1)</script>");
    let document = parse(&html);
    assert!(document.descendants().all(|node| !node.has_tag_name("script")), "text must be escaped");
    let foreign = ["src", "href", "data"];
    assert!(document.descendants().all(|node| foreign.iter().all(|name| !node.has_attribute(*name))));
    assert!(!html.contains("url(") && !html.contains("@import"));
    assert!(!html.contains("NaN") && !html.contains("inf\""), "what is no number is not shown");
}

#[test]
fn the_numbers_shown_are_those_of_the_estimate() {
    let found = found();
    let html = page(&found, "Tires");
    let text = text_of(&parse(&html));
    for (name, value) in &found.estimate.mean {
        let shown = with_std(*value, found.estimate.std[name]);
        assert!(text.contains(&shown), "{name} = {shown}");
        let places = decimals_for_std(*value, found.estimate.std[name]);
        let end = found.estimate.interval[name][0];
        assert!(text.contains(&format!("{end:.places$} … ")), "{name}");
        assert!(text.contains(found.estimate.reason[name].as_str()), "{name}");
    }
    let rows = |class: Identifiability| {
        found.estimate.identified.values().filter(|&&verdict| verdict == class).count()
    };
    let document = parse(&html);
    for verdict in [Identifiability::Identified, Identifiability::Weak, Identifiability::NotIdentifiable] {
        let wanted = format!("verdict {}", verdict.key());
        let shown = document.descendants().filter(|node| node.attribute("class") == Some(&wanted)).count();
        assert_eq!(shown, rows(verdict), "{verdict:?}");
    }
    assert!(text.contains("0.0512") && text.contains("converged") && text.contains("42 & <b>"));
}

#[test]
fn the_verdict_comes_first_and_all_errors_are_shown() {
    let cause = SystematicErrorEstimate {
        name: "steering_offset".to_owned(),
        title: "offset of <delta>".to_owned(),
        unit: "rad".to_owned(),
        value: 0.0052,
        std: 0.0002,
        interval: [0.0048, 0.0056],
        verdict: Identifiability::Identified,
        gain: Some(81.0),
        sentence: "It reads too much.".to_owned(),
        correction: "offset = -0.0052".to_owned(),
    };
    let test = |name: &str, statistic| FitTest {
        name: name.to_owned(),
        statistic,
        limit: 2.0,
        sentence: format!("{name} correlates."),
    };
    let model = ModelVerdict {
        verdict: ModelFit::DoesNotFit,
        sentence: "The yaw rate is late.".to_owned(),
        tests: vec![test("whiteness of a_y", 1.0), test("whiteness of r", 9.0)],
    };
    let causes = [cause];
    let overall = IdentificationSummary { model, causes: &causes, ..IdentificationSummary::default() };
    let html = rendered(&PageContent { overall: Some(&overall), ..PageContent::default() });
    let text = text_of(&parse(&html));
    let places = [
        "Doubtful",
        "The yaw rate is late.",
        "It reads too much.",
        "offset of <delta>",
        "0.00520 ± 0.00020 rad",
        "0.00480 … 0.00560",
        "81.0 nat",
        "offset = -0.0052",
        "1 of 2 tests passed",
        "whiteness of r",
        "whiteness of a_y",
    ]
    .map(|said| text.find(said).unwrap_or_else(|| panic!("no {said} in {text}")));
    assert!(places.is_sorted(), "{places:?}");
}

#[test]
fn each_plot_has_labels_with_units() {
    let html = page(&found(), "Tires");
    let document = parse(&html);
    let plots =
        document.descendants().filter(|node| node.has_tag_name(("http://www.w3.org/1999/xhtml", "figure")));
    let mut count = 0;
    for plot in plots {
        let labels = plot.descendants().filter(|node| node.attribute("class") == Some("label"));
        assert_eq!(labels.filter(|label| label.text().is_some_and(|text| !text.is_empty())).count(), 2);
        count += 1;
    }
    // Curve, misfit, densities and trace of the tire; the excitation's two and five, and the sensitivities.
    assert_eq!(count, 1 + 1 + 7 + 1 + 2 + 5 + 1);
}

#[test]
fn a_page_without_data_is_a_page() {
    let found = Found { samples: CurveSamples::default(), posterior: PosteriorSamples::default(), ..found() };
    let html = page(&found, "");
    parse(&html);
    assert!(html.contains("No samples."));
    parse(&rendered(&PageContent::default()));
}

#[test]
fn what_a_normal_distribution_said_is_shown_beside_the_posterior() {
    let excitation = SyntheticExcitation { samples: 400, slip_std: 0.0, ..SyntheticExcitation::default() };
    let samples = synthetic_samples(&excitation, 0.08);
    let settings = IdentificationSettings::new(ForceDirection::Longitudinal);
    let answer = identify_tire(&samples, &settings, &[Asked::Svi]).expect("fits");
    let (_, estimate) = &answer.estimates[0];
    let gaussian = answer.variational.as_ref().map(|variational| &variational.gaussian);
    let method = MethodSection { name: "SVI", estimate, posterior: &answer.posterior, gaussian };
    let section = TireSection {
        name: "",
        direction: ForceDirection::Longitudinal,
        samples: &samples,
        prior: &settings.prior,
        methods: vec![method],
    };
    let html = rendered(&PageContent { sections: vec![section], ..PageContent::default() });
    let text = text_of(&parse(&html));
    let said = estimate.svi.as_ref().expect("a report");
    assert!(text.contains(said.warning.as_deref().expect("a ridge is no normal distribution")));
    assert!(text.contains(&with_std(said.mean[&Quantity::C], said.std[&Quantity::C])));
    assert!(text.contains(&with_std(estimate.mean[&Quantity::C], estimate.std[&Quantity::C])));
    assert!(text.contains("posterior (grid)") && text.contains("k-hat"));
}
