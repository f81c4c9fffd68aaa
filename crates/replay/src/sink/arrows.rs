//! Draws vectors as arrows on the moving body.

use re_sdk::log::TimeColumn;
use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::Arrows3D;
use re_sdk_types::components::Radius;
use recording::view::BodyArrow;
use recording::{RecordedVariables, Row};

use super::palette::CurvePalette;

/// The root of the arrows.
pub(super) const ROOT: &str = "world/car/arrows";

/// The arrows, with their unsent vectors.
pub(super) struct VectorArrows(Vec<(BodyArrow, Vec<[f32; 3]>)>);

impl VectorArrows {
    pub fn new(arrows: Vec<BodyArrow>) -> Self {
        Self(arrows.into_iter().map(|arrow| (arrow, Vec::new())).collect())
    }

    /// Sends their origins and colours.
    pub fn send_static(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let mut palette = CurvePalette::default();
        for (number, (arrow, _)) in self.0.iter().enumerate() {
            let look = Arrows3D::update_fields()
                .with_origins([arrow.at.map(|it| it as f32)])
                .with_colors([palette.curve_color(arrow.role, &arrow.label)])
                .with_radii([Radius::new_scene_units(0.07)]);
            stream.log_static(arrow_path(number), &look)?;
        }
        Ok(())
    }

    pub fn push_row(&mut self, time: f64, row: &Row<RecordedVariables>) {
        for (arrow, vectors) in &mut self.0 {
            let [x, y] = arrow
                .vector
                .each_ref()
                .map(|component| arrow.scale * component.as_ref().map_or(0.0, |it| it.evaluate(time, row)));
            let turn = arrow.turn.as_ref().map_or(0.0, |it| it.evaluate(time, row));
            let (sin, cos) = turn.sin_cos();
            let vector = [cos * x - sin * y, sin * x + cos * y, 0.0];
            // A value that is no number has no arrow.
            vectors.push(vector.map(|it| if it.is_finite() { it as f32 } else { 0.0 }));
        }
    }

    /// Sends the vectors and forgets them.
    pub fn send(&mut self, stream: &RecordingStream, axes: &[TimeColumn]) -> RecordingStreamResult<()> {
        for (number, (_, vectors)) in self.0.iter_mut().enumerate() {
            let arrows = Arrows3D::update_fields().with_vectors(vectors.drain(..));
            stream.send_columns(arrow_path(number), axes.to_vec(), arrows.columns_of_unit_batches()?)?;
        }
        Ok(())
    }
}

fn arrow_path(number: usize) -> EntityPath {
    EntityPath::from(format!("{ROOT}/{}", number + 1))
}
