//! Parses causality, variability and initial of variables of FMI 3.0, with their defaults.

use roxmltree::Node;

use crate::attributes::{Causality, Initial, Variability};
use crate::definitions;
use crate::description::FmiType;

fn unknown_word_error<T>(node: Node, name: &str, word: &str) -> Result<T, String> {
    Err(format!("{}: {name}=\"{word}\" is no word of FMI 3.0", definitions::describe_node_place(node)))
}

pub(super) fn parse_causality(node: Node) -> Result<Causality, String> {
    Ok(match node.attribute("causality").unwrap_or("local") {
        "parameter" => Causality::Parameter,
        "structuralParameter" => Causality::StructuralParameter,
        "calculatedParameter" => Causality::CalculatedParameter,
        "input" => Causality::Input,
        "output" => Causality::Output,
        "local" => Causality::Local,
        "independent" => Causality::Independent,
        // Relates a model to its system of equations; like a local variable for a caller.
        "dependent" => Causality::Local,
        word => return unknown_word_error(node, "causality", word),
    })
}

pub(super) fn parse_variability(
    node: Node,
    kind: FmiType,
    causality: Causality,
) -> Result<Variability, String> {
    Ok(match node.attribute("variability") {
        Some("constant") => Variability::Constant,
        Some("fixed") => Variability::Fixed,
        Some("tunable") => Variability::Tunable,
        Some("discrete") => Variability::Discrete,
        Some("continuous") => Variability::Continuous,
        Some(word) => return unknown_word_error(node, "variability", word),
        None => match causality {
            Causality::Parameter | Causality::StructuralParameter | Causality::CalculatedParameter => {
                Variability::Fixed
            }
            _ if kind == FmiType::Real => Variability::Continuous,
            _ => Variability::Discrete,
        },
    })
}

/// As written, or else by the table of defaults (FMI 3.0, section 2.4.7.5); a clock has none.
pub(super) fn parse_initial(
    node: Node,
    kind: FmiType,
    causality: Causality,
    variability: Variability,
) -> Result<Option<Initial>, String> {
    Ok(match node.attribute("initial") {
        None => match causality {
            _ if kind == FmiType::Clock => None,
            Causality::Independent => None,
            Causality::Parameter | Causality::StructuralParameter | Causality::Input => Some(Initial::Exact),
            _ if variability == Variability::Constant => Some(Initial::Exact),
            _ => Some(Initial::Calculated),
        },
        Some("exact") => Some(Initial::Exact),
        Some("approx") => Some(Initial::Approx),
        Some("calculated") => Some(Initial::Calculated),
        Some(word) => return unknown_word_error(node, "initial", word),
    })
}
