//! Puts a fit, its verdicts and its posterior together into what is told of a tire.
//!
//! What the data cannot tell is held at the prior and the rest is fitted again, as Goblirsch et al. (IV 2025) advise. The
//! values are those of this second fit: the curve to use where data are. Standard deviations, intervals and covariance are
//! those of the posterior with everything free: holding a parameter teaches nothing about it.

use crate::parameters::{Parameter, Theta};
use crate::posterior::Posterior;
use crate::prior::Prior;
use crate::quantity::Quantity;
use crate::result::{Convergence, Estimate, Verdict};
use crate::verdict::Judgement;

/// The end of a fit, for [`assemble`].
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Best values.
    pub theta: Theta,
    /// Standard deviation of the noise of the friction coefficient [-].
    pub noise_std: f64,
    /// Parameters that stand on a bound.
    pub at_bound: Vec<Parameter>,
    /// How the method got there.
    pub convergence: Convergence,
}

/// Parameters to hold at the prior. B is never held: with the others at their prior it carries the stiffness, which low
/// slip tells.
pub fn to_hold(judgements: &[Judgement]) -> Vec<Parameter> {
    let held = |judgement: &Judgement| match judgement.quantity {
        Quantity::Parameter(parameter) if parameter != Parameter::B => {
            (judgement.verdict == Verdict::NotIdentifiable).then_some(parameter)
        }
        _ => None,
    };
    judgements.iter().filter_map(held).collect()
}

/// The prior with some parameters held at its centre.
pub fn hold(prior: &Prior, parameters: &[Parameter]) -> Prior {
    let mut held = *prior;
    for &parameter in parameters {
        held.free[parameter as usize] = false;
    }
    held
}

/// What is told of a tire whose second fit, with `fixed` held, ended with `fitted`. The time is left to the caller.
pub fn assemble(
    fitted: Fitted,
    fixed: &[Parameter],
    judgements: &[Judgement],
    posterior: &Posterior,
    slip_range: [f64; 2],
    samples: usize,
) -> Estimate {
    let free: Vec<Parameter> = judgements
        .iter()
        .filter_map(|judgement| match judgement.quantity {
            Quantity::Parameter(parameter) => Some(parameter),
            _ => None,
        })
        .collect();
    let names = |parameters: &[Parameter]| {
        parameters.iter().map(|parameter| parameter.name().to_owned()).collect()
    };
    fn by_name<T>(
        judgements: &[Judgement],
        of: impl Fn(&Judgement) -> T,
    ) -> crate::result::ByName<T> {
        judgements
            .iter()
            .map(|judgement| (judgement.quantity.name().to_owned(), of(judgement)))
            .collect()
    }
    Estimate {
        mean: by_name(judgements, |judgement| judgement.quantity.value(&fitted.theta)),
        std: by_name(judgements, |judgement| judgement.std),
        interval: by_name(judgements, |judgement| judgement.interval),
        parameters: names(&free),
        covariance: posterior.covariance(&free),
        at_bound: names(&fitted.at_bound),
        fixed: names(fixed),
        identified: by_name(judgements, |judgement| judgement.verdict),
        reason: by_name(judgements, |judgement| judgement.reason.clone()),
        slip_range,
        samples,
        noise_std: fitted.noise_std,
        convergence: fitted.convergence,
        seconds: 0.0,
    }
}
