//! Draws the legend of a time plot in a view beside it, where it hides no curve.

use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::Points2D;
use re_sdk_types::components::{Color, Radius};

use super::palette::CurvePalette;
use super::signals::{ChartCurve, TimeChart};

/// Entries in a column; more of them would overlap in a plot of usual height.
const ROWS: usize = 5;
/// Width of a view of height 1, for each column.
const WIDTH: f32 = 1.0;
/// Width of a letter, and of the space around an entry [px].
const LETTER: f32 = 6.3;
const SPACE: f32 = 22.0;

/// The names of the curves of a plot, with their colours.
pub(super) struct ChartLegend(Vec<(Color, String)>);

impl ChartLegend {
    pub fn of_chart(chart: &TimeChart) -> Self {
        let mut palette = CurvePalette::default();
        let mut entries: Vec<(Color, String)> = Vec::new();
        for line in &chart.lines {
            let color = line.slot.run_color(palette.curve_color(line.role, &line.label));
            let same = |it: &ChartCurve| it.bound && it.label == line.label;
            let band = if chart.lines.iter().any(same) { " ± 2σ" } else { "" };
            let entry = (color, line.slot.run_label(&format!("{}{band}", line.label)));
            if !entries.contains(&entry) {
                entries.push(entry);
            }
        }
        Self(entries)
    }

    fn column_count(&self) -> usize {
        self.0.len().div_ceil(ROWS).max(1)
    }

    /// The width of the view that the longest entry needs [px].
    pub fn width_in_pixels(&self) -> f32 {
        let longest = self.0.iter().map(|(_, label)| label.chars().count()).max().unwrap_or(0);
        self.column_count() as f32 * (LETTER * longest as f32 + SPACE)
    }

    /// Width of the view, whose height is 1.
    pub fn relative_width(&self) -> f64 {
        f64::from(WIDTH) * self.column_count() as f64
    }

    /// Sends the entries from top to bottom, in columns.
    pub fn send_entries(&self, stream: &RecordingStream, path: &EntityPath) -> RecordingStreamResult<()> {
        let rows = self.0.len().div_ceil(self.column_count());
        let spacing = 1.0 / rows.max(4) as f32;
        let position = |index: usize| {
            let (column, row) = (index / rows.max(1), index % rows.max(1));
            // The text stands a little below its point.
            [WIDTH * (column as f32 + 0.5), spacing * (row as f32 + 0.15)]
        };
        let points = Points2D::new((0..self.0.len()).map(position))
            .with_labels(self.0.iter().map(|(_, label)| label.as_str()))
            .with_show_labels(true)
            .with_colors(self.0.iter().map(|(color, _)| *color))
            .with_radii([Radius::new_ui_points(0.0)]);
        stream.log_static(path.clone(), &points)
    }
}
