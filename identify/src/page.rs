//! Writes `tires.html`: the identified tires on one page that needs nothing but a browser.

pub mod bench;
pub mod car;
mod curves;
pub mod doctor;
mod drift;
mod drives;
mod filters;
mod loads;
mod misfit;
pub mod prediction;
mod replay;
pub mod sideslip;
mod studies;

use askama::Template;
use curves::TireFigures;
use drive_doctor::LogExamination;
pub use drives::DrivesSection;
use html_page::Plot;
use numerics::convergence::OptimisationStatus;
use numerics::text::with_std;
use plugin::AnalysisServices;
use preparation::direction::ForceDirection;
use preparation::samples::CurveSamples;
use tire_inference::estimate::TireEstimate;
use tire_inference::model::FitTest;
use tire_inference::posterior::PosteriorSamples;
use tire_inference::posterior::predictive::PosteriorPredictiveCheck;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::prior::Prior;
use tire_inference::quantity::{PerQuantity, Quantity};
use tire_inference::verdict::Identifiability;

use crate::conclusion::first_sentence;
use crate::loads::AxleLoadEffects;
use crate::names::{describe_bounds, describe_uncertainty_source, quantity_description};
use crate::stretches::QuantityDrift;
use crate::studies::{excitation, sensitivity};
use crate::summary::IdentificationSummary;

/// All that the page shows. What is absent has no section.
#[derive(Clone, Debug, Default)]
pub struct PageContent<'a> {
    /// Title.
    pub title: &'a str,
    /// What was found as a whole.
    pub overall: Option<&'a IdentificationSummary<'a>>,
    /// The car: name and value.
    pub car: &'a [(String, String)],
    /// The log, and what was done to it: name and value.
    pub facts: &'a [(String, String)],
    /// One section for each axle and direction.
    pub sections: Vec<TireSection<'a>>,
    /// Drives under closed-loop control.
    pub drives: Option<DrivesSection<'a>>,
    /// What is wrong with the log.
    pub log: Option<&'a LogExamination>,
    /// How stiffness and friction change over the log.
    pub drift: &'a [QuantityDrift],
    /// What loads, longitudinal forces and slips tell.
    pub loads: &'a [AxleLoadEffects],
    /// Estimates over excitation.
    pub excitation: Option<&'a excitation::ExcitationStudy>,
    /// Sensitivities over slip.
    pub sensitivity: Option<&'a sensitivity::SensitivityStudy>,
}

/// One tire in one direction.
#[derive(Clone, Debug)]
pub struct TireSection<'a> {
    /// As "front axle, lateral".
    pub name: &'a str,
    /// Which force.
    pub direction: ForceDirection,
    /// The samples.
    pub samples: &'a CurveSamples,
    /// What was known before.
    pub prior: &'a Prior,
    /// What was found. The first method's verdicts and band are shown.
    pub methods: Vec<MethodSection<'a>>,
}

/// What one method found.
#[derive(Clone, Copy, Debug)]
pub struct MethodSection<'a> {
    /// As "least squares".
    pub name: &'a str,
    /// The result.
    pub estimate: &'a TireEstimate,
    /// Draws, for band and densities.
    pub posterior: &'a PosteriorSamples,
    /// Draws from the normal distribution of variational inference, to be compared.
    pub gaussian: Option<&'a PosteriorSamples>,
}

/// Leaves the page as a file, and for the replay what it shows of each tire.
pub fn write_page(page: &PageContent, host: &mut dyn AnalysisServices) {
    let figures: Vec<TireFigures> = page.sections.iter().map(TireFigures::for_section).collect();
    host.write_file("tires.html", &render_page(page, &figures));
    for (section, figures) in page.sections.iter().zip(&figures) {
        figures.show_in_replay(section, host);
    }
}

/// The page, with the figures of its sections.
fn render_page(page: &PageContent, figures: &[TireFigures]) -> String {
    html_page::render_page(&TiresPage { title: page.title, page, figures })
}

#[derive(Template)]
#[template(path = "tires.html")]
struct TiresPage<'a> {
    title: &'a str,
    page: &'a PageContent<'a>,
    figures: &'a [TireFigures],
}

impl TiresPage<'_> {
    fn sections(&self) -> impl Iterator<Item = (&TireSection<'_>, &TireFigures)> {
        self.page.sections.iter().zip(self.figures)
    }

    /// Densities of B, C, D and E of the lateral curves, front and rear in one plot each; nothing of a single curve.
    fn axle_densities(&self) -> Vec<(&'static str, Plot)> {
        let lateral = self.page.sections.iter().filter(|it| it.direction == ForceDirection::Lateral);
        let lateral: Vec<_> = lateral.collect();
        if lateral.len() < 2 { Vec::new() } else { curves::axle_densities(&lateral) }
    }

    /// How many samples there are, where, and what is shown of them.
    fn facts_of(&self, section: &TireSection) -> Option<String> {
        let estimate = section.methods.first()?.estimate;
        let [low, high] = estimate.slip_range.map(|slip| section.direction.format_slip(slip));
        let widened = self.page.overall.map_or("", |overall| overall.widened);
        Some(format!(
            "{} samples with slip from {low} to {high}. Outside of it the curve is an extrapolation. {} {}",
            estimate.samples,
            describe_uncertainty_source(estimate.source, widened),
            describe_bounds(section.prior)
        ))
    }
}

impl IdentificationSummary<'_> {
    /// Tests of the model that passed, or that failed.
    fn tests(&self, passed: bool) -> impl Iterator<Item = &FitTest> {
        self.model.tests.iter().filter(move |test| test.has_passed() == passed)
    }
}

/// What the data tell of one quantity.
struct QuantityRow<'a> {
    name: &'static str,
    description: String,
    mean: f64,
    std: f64,
    interval: [f64; 2],
    /// Whether it is held at the prior.
    is_fixed: bool,
    verdict: Option<Identifiability>,
    reason: &'a str,
}

impl TireSection<'_> {
    /// What the first method says of each quantity.
    fn quantities(&self) -> Vec<QuantityRow<'_>> {
        let Some(MethodSection { estimate, .. }) = self.methods.first() else { return Vec::new() };
        let row = |quantity: Quantity| {
            Some(QuantityRow {
                name: quantity.name(),
                description: quantity_description(quantity, self.direction),
                mean: *estimate.mean.get(&quantity)?,
                std: estimate.std.get(&quantity).copied().unwrap_or(f64::NAN),
                interval: estimate.interval.get(&quantity).copied().unwrap_or([f64::NAN; 2]),
                is_fixed: estimate.is_held(quantity),
                verdict: estimate.identified.get(&quantity).copied(),
                reason: estimate.reason.get(&quantity).map_or("", String::as_str),
            })
        };
        Quantity::ALL.into_iter().filter_map(row).collect()
    }

    /// Whether predictions of the first method fit.
    fn predictive(&self) -> Option<&PosteriorPredictiveCheck> {
        self.methods.first()?.estimate.posterior.as_ref()?.predictive.as_ref()
    }
}

/// Quantities of the table that compares methods.
const FACTORS: [Quantity; 5] = [Quantity::B, Quantity::C, Quantity::D, Quantity::E, Quantity::K];

fn factors(mean: &PerQuantity, std: &PerQuantity) -> [String; 5] {
    let number = |map: &PerQuantity, quantity| map.get(&quantity).copied().unwrap_or(f64::NAN);
    FACTORS.map(|quantity| with_std(number(mean, quantity), number(std, quantity)))
}

fn uncertainty_source(source: &UncertaintySource) -> &'static str {
    match source {
        UncertaintySource::Likelihood => "likelihood",
        UncertaintySource::Svi => "posterior (weighted draws)",
        UncertaintySource::Grid => "posterior (grid)",
        UncertaintySource::Tempered => "posterior (tempered)",
        UncertaintySource::Importance => "posterior (importance)",
    }
}

fn end(status: &OptimisationStatus) -> &'static str {
    match status {
        OptimisationStatus::Converged => "converged",
        OptimisationStatus::Stalled => "stalled",
        OptimisationStatus::IterationLimit => "limit of iterations",
    }
}

#[cfg(test)]
mod tests;
