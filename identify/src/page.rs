//! Writes `tires.html`: the identified tires on one page that needs nothing but a browser.

pub mod bench;
pub mod car;
mod curves;
pub mod doctor;
mod drift;
mod drives;
mod head;
mod loads;
mod misfit;
pub mod prediction;
mod replay;
pub mod sideslip;
mod studies;

use std::fmt::Write;

use crate::names::{class, describe, origin, the_box, unit, words};
use curves::Figures;
use drive_doctor::Examination;
pub use drives::Drives;
use html_page::escape;
use numerics::convergence::Status;
use numerics::text::{decimals, significant, with_std};
use plugin::Host;
use preparation::direction::Direction;
use preparation::samples::Samples;
use tire_inference::estimate::Estimate;
use tire_inference::posterior::PosteriorSamples;
use tire_inference::posterior::predictive::Predictive;
use tire_inference::posterior::report::UncertaintySource;
use tire_inference::prior::Prior;
use tire_inference::quantity::{PerQuantity, Quantity};

use crate::loads::AxleLoadEffects;
use crate::stretches::QuantityDrift;
use crate::studies::{excitation, sensitivity};
use crate::summary::IdentificationSummary;

/// All that the page shows. What is absent has no section.
#[derive(Clone, Debug, Default)]
pub struct Page<'a> {
    /// Title.
    pub title: &'a str,
    /// What was found as a whole.
    pub overall: Option<&'a IdentificationSummary<'a>>,
    /// The car: name and value.
    pub car: &'a [(String, String)],
    /// The log, and what was done to it: name and value.
    pub facts: &'a [(String, String)],
    /// One section for each axle and direction.
    pub sections: Vec<Section<'a>>,
    /// Drives under closed-loop control.
    pub drives: Option<Drives<'a>>,
    /// What is wrong with the log.
    pub log: Option<&'a Examination>,
    /// How stiffness and friction change over the log.
    pub drift: &'a [QuantityDrift],
    /// What loads, longitudinal forces and slips tell.
    pub loads: &'a [AxleLoadEffects],
    /// Estimates over excitation.
    pub excitation: Option<&'a excitation::Study>,
    /// Sensitivities over slip.
    pub sensitivity: Option<&'a sensitivity::Study>,
}

/// One tire in one direction.
#[derive(Clone, Debug)]
pub struct Section<'a> {
    /// As "front axle, lateral".
    pub name: &'a str,
    /// Which force.
    pub direction: Direction,
    /// The samples.
    pub samples: &'a Samples,
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
    pub estimate: &'a Estimate,
    /// Draws, for band and densities.
    pub posterior: &'a PosteriorSamples,
    /// Draws from the normal distribution of variational inference, to be compared.
    pub gaussian: Option<&'a PosteriorSamples>,
}

/// The banner of the verdict.
const STYLE: &str = ".banner { padding: 10px 14px; border-left: 6px solid; max-width: none; font-size: 17px; }\n\
                     .banner b { margin-right: 10px; } li { max-width: 76ch; } table th:first-child { min-width: 9em; }\n";

/// Leaves the page as a file, and for the replay what it shows of each tire.
pub fn leave(page: &Page, host: &mut dyn Host) {
    let figures: Vec<Figures> = page.sections.iter().map(Figures::of).collect();
    host.file("tires.html", &render(page, &figures));
    for (section, figures) in page.sections.iter().zip(&figures) {
        figures.show(section, host);
    }
}

/// The page, with the figures of its sections.
fn render(page: &Page, figures: &[Figures]) -> String {
    let mut html = String::new();
    head::head(&mut html, page);
    if page.drives.is_some() {
        html.push_str(
            "<p class=\"faint\">Dots are forces of smoothed states over loads: to be seen, the deciding method does not use \
             them.</p>\n",
        );
    }
    let widened = page.overall.map_or("", |overall| overall.widened);
    for (section, figures) in page.sections.iter().zip(figures) {
        // Smoothed forces are not what the deciding method of drives is to explain.
        let misfit = if page.drives.is_none() { figures.misfit() } else { String::new() };
        write_section(&mut html, section, figures, (&misfit, widened));
    }
    if let Some(drives) = &page.drives {
        html.push_str(&drives::drives(drives));
    }
    let loads = loads::section(page.loads);
    if !loads.is_empty() {
        let _ = writeln!(html, "<h2>Load and longitudinal force</h2>\n{loads}");
    }
    let drift = drift::section(page.drift);
    if !drift.is_empty() {
        let _ = writeln!(html, "<h2>Do the tires change?</h2>\n{drift}");
    }
    let log = page.log.map(doctor::section).filter(|log| !log.is_empty());
    if let Some(log) = log {
        let _ = writeln!(html, "<h2>What is wrong with the log</h2>\n{log}");
    }
    if let Some(study) = page.excitation {
        html.push_str("<h2>What excitation tells</h2>\n");
        let excitation = &study.excitation;
        let _ = writeln!(
            html,
            "<p class=\"faint\">Synthetic data of a known tire: {} points from slip 0 to the level, noise of {} in slip \
             and {} in the friction coefficient, seed {}.</p>",
            excitation.samples,
            significant(excitation.slip_std, 2),
            significant(excitation.force_std, 2),
            excitation.seed
        );
        html.push_str(&studies::excitation(study));
    }
    if let Some(study) = page.sensitivity {
        html.push_str("<h2>Which parameter matters at which slip</h2>\n");
        let spread = significant(100.0 * study.spread, 2);
        let _ = writeln!(
            html,
            "<p class=\"faint\">B, C, D and E vary by ±{spread} %, independently.</p>"
        );
        html.push_str(&studies::sensitivity(study));
    }
    html_page::page(page.title, STYLE, &html)
}

fn write_section(
    html: &mut String,
    section: &Section,
    figures: &Figures,
    (misfit, widened): (&str, &str),
) {
    let _ = writeln!(html, "<h2>{}</h2>", escape(section.name));
    if let Some(first) = section.methods.first() {
        let estimate = first.estimate;
        let [low, high] = estimate.slip_range.map(|slip| section.direction.slip(slip));
        let _ = writeln!(
            html,
            "<p class=\"faint\">{} samples with slip from {low} to {high}. Outside of it the curve is an extrapolation. {} {}</p>",
            estimate.samples,
            origin(estimate.source, widened),
            escape(&the_box(section.prior))
        );
    }
    html.push_str(&figures.curve());
    html.push_str(misfit);
    html.push_str("<h3>What the data can tell</h3>\n");
    if let Some(first) = section.methods.first() {
        write_verdicts(html, first.estimate, section.direction);
    }
    let check = |first: &MethodSection| first.estimate.posterior.as_ref()?.predictive.clone();
    if let Some(check) = section.methods.first().and_then(check) {
        html.push_str("<h3>Does the model fit?</h3>\n");
        write_check(html, &check);
    }
    html.push_str("<h3>How certain the parameters are</h3>\n");
    html.push_str(&figures.densities());
    html.push_str("<h3>Methods</h3>\n");
    write_methods(html, section);
    html.push_str(&figures.trace());
}

fn write_check(html: &mut String, check: &Predictive) {
    let Predictive { inside, p_value, gross, autocorrelation, .. } = *check;
    let share = |share: f64| significant(100.0 * share, 3);
    let _ = writeln!(
        html,
        "<p>{}</p>\n<p class=\"faint\">{} % of the samples in the 95 % band of predictions, {} % more than four standard \
         deviations off; autocorrelation {}; p-value of the shape {}.</p>",
        escape(&check.message),
        share(inside),
        share(gross),
        significant(autocorrelation, 2),
        significant(p_value, 2)
    );
}

fn write_verdicts(html: &mut String, estimate: &Estimate, direction: Direction) {
    html.push_str("<table class=\"stack\">\n<tr><th>Quantity</th><th>Value</th><th>95 % interval</th><th>Verdict</th><th>Why</th></tr>\n");
    for name in Quantity::ALL.into_iter().filter(|name| estimate.mean.contains_key(name)) {
        let number = |map: &PerQuantity| map.get(&name).copied().unwrap_or(f64::NAN);
        let interval = estimate.interval.get(&name).copied().unwrap_or([f64::NAN; 2]);
        let places = decimals(number(&estimate.mean), number(&estimate.std));
        let plain = |end: f64| match end.is_finite() {
            true => format!("{end:.places$}"),
            false => "–".to_owned(),
        };
        let verdict = estimate.identified.get(&name).copied();
        let held = if estimate.is_held(name) { " (held at the prior)" } else { "" };
        let _ = writeln!(
            html,
            "<tr><td>{name} <span class=\"faint\">{}</span></td><td class=\"number\" data-label=\"value\">{}{held}</td>\
             <td class=\"number\" data-label=\"95 %\">{} … {}</td><td class=\"verdict {}\">{}</td><td>{}</td></tr>",
            describe(name, direction),
            with_std(number(&estimate.mean), number(&estimate.std)),
            plain(interval[0]),
            plain(interval[1]),
            verdict.map_or("", class),
            verdict.map_or("–", words),
            escape(estimate.reason.get(&name).map_or("", String::as_str))
        );
    }
    html.push_str("</table>\n");
}

fn write_methods(html: &mut String, section: &Section) {
    write_values(html, section);
    write_ends(html, section);
    for variational in section.methods.iter().filter_map(|method| method.estimate.svi.as_ref()) {
        let warning = variational.warning.as_deref().map_or_else(
            || {
                "The normal distribution is close to the posterior; weights make up for the rest."
                    .to_owned()
            },
            |warning| format!("{warning} The values shown are those of the posterior."),
        );
        let _ = writeln!(html, "<p>{}</p>", escape(&warning));
    }
}

/// What each method found.
fn write_values(html: &mut String, section: &Section) {
    let names = [Quantity::B, Quantity::C, Quantity::D, Quantity::E, Quantity::K];
    let head: String = names.iter().map(|name| format!("<th>{name}</th>")).collect();
    let _ = writeln!(html, "<table>\n<tr><th>Method</th>{head}<th>At a bound</th></tr>");
    let values = |mean: &PerQuantity, std: &PerQuantity| -> String {
        let number =
            |map: &PerQuantity, name: &Quantity| map.get(name).copied().unwrap_or(f64::NAN);
        let cell = |name: &Quantity| with_std(number(mean, name), number(std, name));
        names.iter().map(|it| format!("<td class=\"number\">{}</td>", cell(it))).collect()
    };
    for MethodSection { name, estimate, .. } in &section.methods {
        let bounds = match estimate.at_bound.is_empty() {
            true => "none".to_owned(),
            false => estimate.at_bound.iter().map(|it| it.name()).collect::<Vec<_>>().join(", "),
        };
        let cells = values(&estimate.mean, &estimate.std);
        let (name, bounds) = (escape(name), escape(&bounds));
        let _ = writeln!(html, "<tr><td>{name}</td>{cells}<td>{bounds}</td></tr>");
        if let Some(own) = &estimate.svi {
            let cells = values(&own.mean, &own.std);
            let _ = writeln!(
                html,
                "<tr class=\"faint\"><td>its normal distribution</td>{cells}<td></td></tr>"
            );
        }
    }
    html.push_str("</table>\n");
}

/// How each method ended.
fn write_ends(html: &mut String, section: &Section) {
    html.push_str(
        "<table>\n<tr><th>Method</th><th>Noise</th><th>End</th><th>Iterations</th><th>Optima</th><th>Time</th>\
         <th>Uncertainty of</th></tr>\n",
    );
    for MethodSection { name, estimate, .. } in &section.methods {
        let convergence = &estimate.convergence;
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td class=\"number\">{}</td><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td>\
             <td class=\"number\">{} s</td><td>{}</td></tr>",
            escape(name),
            significant(estimate.noise_std, 3),
            end(convergence.status),
            convergence.iterations,
            convergence.optima,
            significant(estimate.seconds, 2),
            match estimate.source {
                UncertaintySource::Likelihood => "likelihood",
                UncertaintySource::Svi => "posterior (weighted draws)",
                UncertaintySource::Grid => "posterior (grid)",
                UncertaintySource::Tempered => "posterior (tempered)",
                UncertaintySource::Importance => "posterior (importance)",
            }
        );
        if let Some(own) = &estimate.svi {
            let _ = writeln!(
                html,
                "<tr class=\"faint\"><td>its normal distribution</td><td class=\"number\">{}</td><td>{}</td>\
                 <td class=\"number\">{}</td><td></td><td></td><td>k-hat {}</td></tr>",
                significant(own.noise_std, 3),
                end(own.status),
                own.steps,
                significant(own.diagnosis.k_hat, 2)
            );
        }
    }
    html.push_str("</table>\n");
}

fn end(status: Status) -> &'static str {
    match status {
        Status::Converged => "converged",
        Status::Stalled => "stalled",
        Status::IterationLimit => "limit of iterations",
    }
}

#[cfg(test)]
mod tests;
