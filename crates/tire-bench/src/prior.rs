//! Lists what a fit may move, with what is known before: values of usual road and racing tires, wide, in ISO-W axes.

use tire::CoefficientKey;

use crate::model::{FittedChannel, TERMS};

/// Something that a fit may move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FreeParameterPrior {
    pub what: FittedParameter,
    pub mean: f64,
    pub std: f64,
}

/// A coefficient of the formula, or a term by its place in [`TERMS`].
#[derive(Clone, Copy, Debug)]
pub(crate) enum FittedParameter {
    Key(&'static CoefficientKey),
    Term(usize),
}

impl PartialEq for FittedParameter {
    fn eq(&self, other: &Self) -> bool {
        self.target_name() == other.target_name()
    }
}

impl FittedParameter {
    pub fn target_name(&self) -> &'static str {
        match self {
            Self::Key(key) => key.name,
            Self::Term(place) => TERMS[*place].name,
        }
    }
}

type PriorRow = (&'static str, f64, f64);

#[rustfmt::skip]
const ALONG: &[PriorRow] = &[
    ("PCX1", 1.5, 0.3), ("PDX1", 1.2, 0.4), ("PDX2", -0.15, 0.2), ("PDX3", 2.0, 8.0), ("PEX1", 0.0, 0.6),
    ("PEX2", 0.0, 0.5), ("PEX3", 0.0, 0.3), ("PEX4", 0.0, 0.3), ("PKX1", 22.0, 8.0), ("PKX2", 0.0, 5.0),
    ("PKX3", -0.1, 0.3), ("PHX1", 0.0, 0.003), ("PHX2", 0.0, 0.003), ("PVX1", 0.0, 0.03), ("PVX2", 0.0, 0.03),
    ("PPX1", -0.4, 0.5), ("PPX2", 0.0, 0.5), ("PPX3", -0.1, 0.3), ("PPX4", 0.0, 0.3), ("RBX1", 13.0, 6.0),
    ("RBX2", 10.0, 6.0), ("RBX3", 0.0, 200.0), ("RCX1", 1.05, 0.15), ("REX1", 0.0, 0.4), ("REX2", 0.0, 0.3),
    ("RHX1", 0.0, 0.005),
];

#[rustfmt::skip]
const ACROSS: &[PriorRow] = &[
    ("PCY1", 1.4, 0.3), ("PDY1", 1.2, 0.4), ("PDY2", -0.15, 0.2), ("PDY3", 2.0, 5.0), ("PEY1", 0.0, 0.6),
    ("PEY2", 0.0, 0.5), ("PEY3", 0.0, 0.2), ("PEY4", 0.0, 3.0), ("PEY5", 0.0, 10.0), ("PKY1", -22.0, 10.0),
    ("PKY2", 1.8, 0.6), ("PKY3", 0.5, 0.5), ("PKY4", 2.0, 0.3), ("PKY5", 0.0, 10.0), ("PKY6", -1.0, 1.0),
    ("PKY7", 0.0, 0.5), ("PHY1", 0.0, 0.005), ("PHY2", 0.0, 0.005), ("PVY1", 0.0, 0.05), ("PVY2", 0.0, 0.05),
    ("PVY3", 0.0, 0.5), ("PVY4", 0.0, 0.5), ("PPY1", 0.3, 0.5), ("PPY2", 0.8, 0.8), ("PPY3", -0.1, 0.3),
    ("PPY4", 0.0, 0.3), ("PPY5", -0.5, 0.5), ("RBY1", 12.0, 5.0), ("RBY2", 10.0, 6.0), ("RBY3", 0.0, 0.02),
    ("RBY4", 0.0, 50.0), ("RCY1", 1.05, 0.15), ("REY1", 0.0, 0.4), ("REY2", 0.0, 0.3), ("RHY1", 0.0, 0.01),
    ("RHY2", 0.0, 0.01), ("RVY1", 0.0, 0.05), ("RVY2", 0.0, 0.05), ("RVY3", 0.0, 0.5), ("RVY4", 10.0, 5.0),
    ("RVY5", 1.5, 0.4), ("RVY6", 15.0, 8.0),
];

#[rustfmt::skip]
const ALIGNING: &[PriorRow] = &[
    ("QBZ1", 11.0, 5.0), ("QBZ2", -1.5, 3.0), ("QBZ4", 0.0, 1.0), ("QBZ5", 0.0, 1.0), ("QBZ9", 15.0, 8.0),
    ("QBZ10", 0.0, 0.5), ("QCZ1", 1.15, 0.2), ("QDZ1", 0.1, 0.05), ("QDZ2", 0.0, 0.05), ("QDZ3", 0.0, 1.0),
    ("QDZ4", 0.0, 5.0), ("QDZ6", 0.0, 0.01), ("QDZ7", 0.0, 0.01), ("QDZ8", -0.1, 0.3), ("QDZ9", 0.0, 0.2),
    ("QDZ10", 0.0, 1.0), ("QDZ11", 0.0, 1.0), ("QEZ1", -1.5, 1.5), ("QEZ2", 0.5, 1.0), ("QEZ4", 0.0, 0.3),
    ("QEZ5", 0.0, 2.0), ("QHZ1", 0.0, 0.01), ("QHZ2", 0.0, 0.01), ("QHZ3", 0.0, 0.2), ("QHZ4", 0.0, 0.2),
    ("PPZ1", 0.0, 0.5), ("PPZ2", 0.0, 0.5), ("SSZ1", 0.0, 0.05), ("SSZ2", 0.0, 0.05), ("SSZ3", 0.0, 0.5),
    ("SSZ4", 0.0, 0.5),
];

/// What the fit of a channel moves; terms beyond the formula and temperature only with `extended`.
pub(crate) fn free_coefficients(channel: FittedChannel, extended: bool) -> Vec<FreeParameterPrior> {
    let rows = match channel {
        FittedChannel::Longitudinal => ALONG,
        FittedChannel::Lateral => ACROSS,
        FittedChannel::Aligning => ALIGNING,
    };
    let keys = rows.iter().filter_map(|(name, mean, std)| {
        CoefficientKey::from_name(name).map(|key| FreeParameterPrior {
            what: FittedParameter::Key(key),
            mean: *mean,
            std: *std,
        })
    });
    let terms =
        TERMS.iter().enumerate().filter(|(_, it)| it.channel == channel && (extended || !it.extended));
    keys.chain(terms.map(|(place, it)| FreeParameterPrior {
        what: FittedParameter::Term(place),
        mean: 0.0,
        std: it.std,
    }))
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_a_key_of_the_formula() {
        for (name, _, std) in ALONG.iter().chain(ACROSS).chain(ALIGNING) {
            assert!(CoefficientKey::from_name(name).is_some() && *std > 0.0, "{name}");
        }
    }
}
