//! Names the two directions of a tire force, with the units of their slips.

use numerics::text::format_significant;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Direction of a tire force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceDirection {
    /// Lateral force over slip angle.
    Lateral,
    /// Longitudinal force over slip ratio.
    Longitudinal,
}

impl ForceDirection {
    /// Label of an axis of slip.
    pub fn slip_label(self) -> &'static str {
        match self {
            Self::Lateral => "slip angle α [rad]",
            Self::Longitudinal => "slip ratio λ [–]",
        }
    }

    /// Label of an axis of friction coefficients.
    pub fn force_label(self) -> &'static str {
        match self {
            Self::Lateral => "F_y / F_z [–]",
            Self::Longitudinal => "F_x / F_z [–]",
        }
    }

    /// A slip in a sentence.
    pub fn format_slip(self, slip: f64) -> String {
        match self {
            Self::Lateral => {
                format!("{} rad ({}°)", format_significant(slip, 2), format_significant(slip.to_degrees(), 2))
            }
            Self::Longitudinal => format!("{} %", format_significant(100.0 * slip, 2)),
        }
    }
}
