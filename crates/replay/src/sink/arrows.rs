//! Draws vectors as arrows on the moving body.

use recording::view::Arrow;
use recording::{Recorded, Row};
use rerun::{Arrows3D, EntityPath, Radius, RecordingStream, RecordingStreamResult, TimeColumn};

use super::palette::Palette;

/// What the arrows are below.
pub(super) const ROOT: &str = "world/car/arrows";

/// The arrows, with the vectors that were not sent yet.
pub(super) struct Arrows(Vec<(Arrow, Vec<[f32; 3]>)>);

impl Arrows {
    pub fn new(arrows: Vec<Arrow>) -> Self {
        Self(arrows.into_iter().map(|arrow| (arrow, Vec::new())).collect())
    }

    /// Sends where they start and their colours.
    pub fn describe(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let mut palette = Palette::default();
        for (number, (arrow, _)) in self.0.iter().enumerate() {
            let look = Arrows3D::update_fields()
                .with_origins([arrow.at.map(|it| it as f32)])
                .with_colors([palette.color(arrow.role, &arrow.label)])
                .with_radii([Radius::new_scene_units(0.07)]);
            stream.log_static(path(number), &look)?;
        }
        Ok(())
    }

    pub fn push(&mut self, time: f64, row: &Row<Recorded>) {
        for (arrow, vectors) in &mut self.0 {
            let [x, y] = arrow.vector.each_ref().map(|component| {
                arrow.scale * component.as_ref().map_or(0.0, |it| it.value(time, row))
            });
            let turn = arrow.turn.as_ref().map_or(0.0, |it| it.value(time, row));
            let (sin, cos) = turn.sin_cos();
            let vector = [cos * x - sin * y, sin * x + cos * y, 0.0];
            // What cannot be computed, such as a share of no load, has no arrow.
            vectors.push(vector.map(|it| if it.is_finite() { it as f32 } else { 0.0 }));
        }
    }

    /// Sends the vectors and forgets them.
    pub fn send(
        &mut self,
        stream: &RecordingStream,
        axes: &[TimeColumn],
    ) -> RecordingStreamResult<()> {
        for (number, (_, vectors)) in self.0.iter_mut().enumerate() {
            let arrows = Arrows3D::update_fields().with_vectors(vectors.drain(..));
            stream.send_columns(path(number), axes.to_vec(), arrows.columns_of_unit_batches()?)?;
        }
        Ok(())
    }
}

fn path(number: usize) -> EntityPath {
    EntityPath::from(format!("{ROOT}/{}", number + 1))
}
