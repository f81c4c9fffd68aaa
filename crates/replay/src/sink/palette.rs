//! Gives each role its colour, the same in every view.

use re_sdk_types::components::Color;
use recording::view::CurveRole;

use super::{ESTIMATE, LIMIT, MEASUREMENT, PLANT, REFERENCE, WHITE};

/// Colours of curves without a role: Okabe and Ito's purple and yellow, and two more; all are distinct
/// without red-green vision.
const OTHERS: [[u8; 3]; 4] = [[204, 121, 167], [240, 228, 66], [136, 136, 238], WHITE];

/// Gives every curve of one view its own colour.
#[derive(Default)]
pub(super) struct CurvePalette<'a> {
    used: Vec<(CurveRole, &'a str)>,
}

impl<'a> CurvePalette<'a> {
    /// Curves of one role and one name, such as two sides of a limit, share their colour and
    /// their entry in the legend.
    pub fn curve_color(&mut self, role: CurveRole, label: &'a str) -> Color {
        if !self.used.contains(&(role, label)) {
            self.used.push((role, label));
        }
        let same_role = self.used.iter().filter(|it| it.0 == role);
        let before = same_role.take_while(|it| it.1 != label).count();
        let (color, rounds) = match role {
            CurveRole::Other => (OTHERS[before % OTHERS.len()], before / OTHERS.len()),
            CurveRole::Reference => (REFERENCE, before),
            CurveRole::Plant => (PLANT, before),
            CurveRole::Measurement => (MEASUREMENT, before),
            CurveRole::Estimate => (ESTIMATE, before),
            CurveRole::Limit => (LIMIT, before),
        };
        Color::from(shade_color(color, rounds))
    }
}

/// The second curve of a role is lighter, the third darker.
fn shade_color(color: [u8; 3], round: usize) -> [u8; 3] {
    let (toward, share) = match round % 3 {
        0 => return color,
        1 => (255.0, 0.5),
        _ => (0.0, 0.4),
    };
    color.map(|it| (f32::from(it) * (1.0 - share) + toward * share) as u8)
}

/// The colour of an area behind lines of this colour, on the viewer's dark background.
pub(super) fn dimmed_color(color: Color) -> Color {
    let [red, green, blue, _] = color.to_array();
    Color::from([red, green, blue].map(|it| (0.3 * f32::from(it) + 10.0) as u8))
}

/// The colour with an opacity from 0 to 255.
pub(super) fn with_opacity(color: Color, opacity: u8) -> Color {
    let [red, green, blue, _] = color.to_array();
    Color::from_unmultiplied_rgba(red, green, blue, opacity)
}
