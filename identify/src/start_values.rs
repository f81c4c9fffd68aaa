//! Writes `tires.toml`: what was found, as start values for the plant of the next run.

use std::fmt::Write;

use numerics::text::with_std;
use preparation::direction::ForceDirection;
use tire_inference::estimate::TireEstimate;
use tire_inference::parameters::Parameter;
use tire_inference::quantity::{PerQuantity, Quantity};

/// A tire of the plant and what was found of it.
#[derive(Clone, Copy, Debug)]
pub struct IdentifiedTire<'a> {
    /// Name of the node in the scenario, as "plant".
    pub node: &'a str,
    /// Name of the tire among its variables, as "tire_f".
    pub tire: &'a str,
    /// What was found.
    pub estimate: &'a TireEstimate,
    /// Which force: it says what the slip range is in.
    pub direction: ForceDirection,
}

/// The verdict on the whole, and one line `"node.tire.B" = value` for each parameter, with its verdict in a comment. Parameters without a finite value are
/// left out, with a comment that says so.
pub fn start_values_toml(tires: &[IdentifiedTire], verdict: &str) -> String {
    let mut text =
        String::from("# Tire parameters that were identified, for `trackside run --set @tires.toml`.\n");
    let _ = writeln!(text, "# {}", toml_comment(verdict));
    for tire in tires {
        let estimate = tire.estimate;
        let [low, high] = estimate.slip_range.map(|slip| tire.direction.format_slip(slip));
        let _ = writeln!(
            text,
            "\n# {}: {} samples with slip from {low} to {high}.",
            toml_comment(tire.tire),
            estimate.samples
        );
        for parameter in Parameter::ALL {
            let Some(&value) = estimate.mean.get(&Quantity::from(parameter)) else { continue };
            let (name, remark) = (parameter.symbol(), verdict_remark(estimate, parameter.into()));
            if value.is_finite() {
                let key = toml_string(&parameter_key(tire, name));
                // Debug writes a point or an exponent always: TOML then reads a float, never an integer.
                let _ = writeln!(text, "{key} = {value:?} # {remark}");
            } else {
                let _ = writeln!(text, "# {name} has no finite value. {remark}");
            }
        }
    }
    text
}

/// The name of a parameter as `--set` takes it, such as `plant.tire_f.B`.
pub fn parameter_key(tire: &IdentifiedTire, parameter: &str) -> String {
    format!("{}.{}.{parameter}", tire.node, tire.tire)
}

fn verdict_remark(estimate: &TireEstimate, quantity: Quantity) -> String {
    let verdict = estimate.identified.get(&quantity).map_or("not judged", |it| it.to_display_text());
    let held = if estimate.is_held(quantity) { ", held at the prior" } else { "" };
    let number = |map: &PerQuantity| map.get(&quantity).copied().unwrap_or(f64::NAN);
    format!("{verdict}{held}: {}", with_std(number(&estimate.mean), number(&estimate.std)))
}

/// A comment ends with its line.
fn toml_comment(text: &str) -> String {
    text.chars().map(|character| if character.is_control() { ' ' } else { character }).collect()
}

/// A basic string of TOML.
fn toml_string(text: &str) -> String {
    let mut quoted = String::from("\"");
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            other if other.is_control() => {
                let _ = write!(quoted, "\\u{:04x}", u32::from(other));
            }
            other => quoted.push(other),
        }
    }
    quoted.push('"');
    quoted
}

#[cfg(test)]
mod tests {
    use numerics::convergence::{ConvergenceReport, OptimisationStatus};
    use tire_inference::posterior::report::UncertaintySource;
    use tire_inference::verdict::Identifiability;

    use super::*;

    fn estimate() -> TireEstimate {
        let mean = [
            (Quantity::B, 15.1),
            (Quantity::C, 2.0),
            (Quantity::D, f64::NAN),
            (Quantity::E, 1e-7),
            (Quantity::K, 45.0),
        ];
        TireEstimate {
            mean: mean.into(),
            std: [(Quantity::B, 0.25)].into(),
            interval: [].into(),
            parameters: vec![],
            covariance: vec![],
            at_bound: vec![],
            fixed: vec![Parameter::C],
            identified: [
                (Quantity::B, Identifiability::Identified),
                (Quantity::C, Identifiability::NotIdentifiable),
            ]
            .into(),
            reason: [].into(),
            slip_range: [-0.1, 0.08],
            samples: 7,
            noise_std: 0.1,
            convergence: ConvergenceReport {
                status: OptimisationStatus::Converged,
                iterations: 1,
                evaluations: 1,
                kkt_residual: None,
                starts: 1,
                optima: 1,
                cost: 0.0,
                trace: Vec::new(),
            },
            seconds: 0.0,
            source: UncertaintySource::Likelihood,
            posterior: None,
            svi: None,
        }
    }

    #[test]
    fn the_table_is_flat_and_reads_back() {
        let estimate = estimate();
        let front = IdentifiedTire {
            node: "plant",
            tire: "tire_f",
            estimate: &estimate,
            direction: ForceDirection::Lateral,
        };
        let odd = IdentifiedTire { node: "my \"plant\"\n", tire: "tire\nr", ..front };
        let text = start_values_toml(&[front, odd], "The model\ndoes not fit.");
        let table: toml::Table = toml::from_str(&text).expect("TOML");
        assert_eq!(table["plant.tire_f.B"].as_float(), Some(15.1));
        assert_eq!(table["plant.tire_f.C"].as_float(), Some(2.0), "a whole number is a float too");
        assert_eq!(table["plant.tire_f.E"].as_float(), Some(1e-7));
        assert_eq!(table["my \"plant\"\n.tire\nr.B"].as_float(), Some(15.1));
        assert_eq!(
            table.len(),
            6,
            "neither D, which is no number, nor K, which the plant does not have: {text}"
        );
        assert!(text.contains("\"plant.tire_f.B\" = 15.1 # identified: 15.10 ± 0.25"));
        assert!(text.contains("# not identifiable, held at the prior: 2.000"));
        assert!(text.contains("\n# The model does not fit.\n"));
        assert!(text.contains("# D has no finite value."));
    }
}
