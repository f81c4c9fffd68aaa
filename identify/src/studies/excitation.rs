//! Tells from which excitation on each parameter is identified: the paper's Figures 2 and 3.

use preparation::direction::ForceDirection;
use serde::{Serialize, Serializer};
use tire_inference::bounds::Bounds;
use tire_inference::estimate::identify_tire;
use tire_inference::fit::{FitError, FitOptions, SlipNoise};
use tire_inference::parameters::{Theta, by_parameter};
use tire_inference::quantity::PerQuantity;
use tire_inference::settings::{FitMethod, IdentificationSettings};
use tire_inference::synthetic::{SyntheticExcitation, synthetic_samples};
use tire_inference::verdict::QuantityIdentifiability;

/// What was found at all levels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExcitationStudy {
    /// The data.
    pub excitation: SyntheticExcitation,
    /// One result for each level.
    pub levels: Vec<ExcitationLevel>,
}

/// What was found at one level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExcitationLevel {
    /// Largest slip.
    pub level: f64,
    /// Least squares, all parameters free.
    #[serde(serialize_with = "by_parameter")]
    pub least_squares: Theta,
    /// Nelder-Mead, all parameters free.
    #[serde(serialize_with = "by_parameter")]
    pub nelder_mead: Theta,
    /// Variational inference, all parameters free.
    pub svi: VariationalMoments,
    /// What the data can tell.
    #[serde(serialize_with = "by_quantity")]
    pub judgements: Vec<QuantityIdentifiability>,
}

/// Means and standard deviations of the normal distribution that variational inference finds.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct VariationalMoments {
    /// Means.
    pub mean: PerQuantity,
    /// Standard deviations.
    pub std: PerQuantity,
}

fn by_quantity<S: Serializer>(judgements: &[QuantityIdentifiability], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(judgements.iter().map(|judgement| (judgement.quantity.name(), judgement)))
}

/// The study, over all levels. `go_on` is reported which level comes next; the study ends with `None` when it says no.
///
/// # Errors
/// If a level has no samples to fit.
pub fn run_excitation_study(
    excitation: &SyntheticExcitation,
    go_on: &mut dyn FnMut(usize) -> bool,
) -> Result<Option<ExcitationStudy>, FitError> {
    let mut levels = Vec::new();
    for (index, &level) in excitation.levels.iter().enumerate() {
        if !go_on(index) {
            return Ok(None);
        }
        levels.push(assess_level(excitation, level)?);
    }
    Ok(Some(ExcitationStudy { excitation: excitation.clone(), levels }))
}

const METHODS: [FitMethod; 3] = [FitMethod::LeastSquares, FitMethod::NelderMead, FitMethod::Svi];

fn assess_level(excitation: &SyntheticExcitation, level: f64) -> Result<ExcitationLevel, FitError> {
    let samples = synthetic_samples(excitation, level);
    let usual = IdentificationSettings::new(ForceDirection::Longitudinal);
    let settings = IdentificationSettings {
        slip_noise: (excitation.slip_std > 0.0).then(|| SlipNoise::new(excitation.slip_std)),
        prior: usual.prior.with_bounds(Bounds::GOBLIRSCH),
        options: FitOptions { seed: excitation.seed, ..usual.options },
        ..usual
    };
    let answer = identify_tire(&samples, &settings, &METHODS)?;
    let [least_squares, nelder_mead] = [0, 1].map(|index| answer.unrestricted[index].1.theta);
    let svi = answer.estimates.into_iter().find_map(|(_, estimate)| estimate.svi);
    let svi = svi.map(|it| VariationalMoments { mean: it.mean, std: it.std }).unwrap_or_default();
    Ok(ExcitationLevel { level, least_squares, nelder_mead, svi, judgements: answer.judgements })
}

#[cfg(test)]
mod tests {
    use tire_inference::verdict::Identifiability;

    use super::*;

    fn at(levels: &[f64]) -> ExcitationStudy {
        let excitation = SyntheticExcitation { levels: levels.to_vec(), ..SyntheticExcitation::default() };
        run_excitation_study(&excitation, &mut |_| true).expect("samples").expect("not cancelled")
    }

    fn judgement<'a>(level: &'a ExcitationLevel, name: &str) -> &'a QuantityIdentifiability {
        level.judgements.iter().find(|judgement| judgement.quantity.name() == name).expect("judged")
    }

    #[test]
    fn the_peak_is_known_once_it_was_covered() {
        for level in at(&[0.08, 0.12, 0.3]).levels {
            assert!((level.least_squares[2] / 1.5 - 1.0).abs() < 0.01, "{level:?}");
            assert_eq!(judgement(&level, "D").verdict, Identifiability::Identified);
        }
    }

    #[test]
    fn shape_and_curvature_need_the_falling_branch_and_stiffness_next_to_nothing() {
        let study = at(&[0.02, 0.08, 0.75]);
        for level in &study.levels[..2] {
            for name in ["C", "E"] {
                let judgement = judgement(level, name);
                assert_eq!(judgement.verdict, Identifiability::NotIdentifiable, "{}", judgement.reason);
                assert!(judgement.reason.contains("drive slips near"), "{}", judgement.reason);
            }
            assert_ne!(judgement(level, "B").verdict, Identifiability::Identified);
            let stiffness = judgement(level, "K");
            assert_eq!(stiffness.verdict, Identifiability::Identified, "{}", stiffness.reason);
        }
        assert_eq!(judgement(&study.levels[0], "B").verdict, Identifiability::NotIdentifiable);
        for judgement in &study.levels[2].judgements {
            assert_eq!(judgement.verdict, Identifiability::Identified, "{}", judgement.reason);
        }
    }
}
