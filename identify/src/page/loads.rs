//! Lists how stiffness and friction change with the load, and what longitudinal forces and slips say.

use tire_inference::load::LoadEffect;
use tire_inference::verdict::Identifiability;

use crate::loads::{AxleLoadEffects, TOO_FEW};

/// What is known of one quantity of an axle.
pub struct LoadEffectRow<'a> {
    pub axle: &'static str,
    pub name: &'static str,
    pub value: Option<f64>,
    pub interval: [Option<f64>; 2],
    pub verdict: Identifiability,
    pub reason: &'a str,
}

/// The rows of both axles.
pub fn rows(loads: &[AxleLoadEffects]) -> Vec<LoadEffectRow<'_>> {
    loads.iter().flat_map(rows_of_axle).collect()
}

fn rows_of_axle(
    AxleLoadEffects { axle, effects, slip_stiffness }: &AxleLoadEffects,
) -> [LoadEffectRow<'_>; 4] {
    let effects = effects.as_ref();
    [
        effect_row(axle, "change of stiffness K with load", effects.map(|it| &it.K)),
        effect_row(axle, "change of friction D with load", effects.map(|it| &it.D)),
        effect_row(axle, "longitudinal friction μ_x of the ellipse", effects.map(|it| &it.mu_x)),
        LoadEffectRow {
            axle,
            name: "stiffness over longitudinal slip",
            value: slip_stiffness.found.map(|it| it.0),
            interval: slip_stiffness.found.map(|it| it.1.map(Some)).unwrap_or_default(),
            verdict: slip_stiffness.verdict,
            reason: &slip_stiffness.reason,
        },
    ]
}

fn effect_row<'a>(
    axle: &'static str,
    name: &'static str,
    effect: Option<&'a LoadEffect>,
) -> LoadEffectRow<'a> {
    LoadEffectRow {
        axle,
        name,
        value: effect.map(|it| it.value),
        interval: effect.map(|it| it.interval).unwrap_or_default(),
        verdict: effect.map_or(Identifiability::NotIdentifiable, |it| it.verdict),
        reason: effect.map_or(TOO_FEW, |it| &it.reason),
    }
}
