//! Draws the axes and the legend of a diagram, and maps coordinates to its view.

use re_sdk::{EntityPath, RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{LineStrips2D, Points2D};
use re_sdk_types::components::{Color, Radius};

use super::round_up_to_1_2_5;

const GRID: [u8; 3] = [58, 58, 64];
const AXIS: [u8; 3] = [120, 120, 126];
const TEXT: [u8; 3] = [190, 190, 195];

/// The axes of a diagram of height 1.
#[derive(Clone)]
pub(super) struct DiagramFrame {
    /// The root entity of the diagram.
    pub root: String,
    /// What the axes show, x and y, with units.
    pub labels: [String; 2],
    /// The ends of the axes, x and y; the first one is at the left or at the bottom.
    pub ranges: [[f64; 2]; 2],
    /// Width.
    pub width: f64,
    /// Height of a line of text, which the viewer draws in the same size whatever the size of the diagram.
    pub line: f32,
    /// Spaces between ticks of an axis at most.
    pub ticks: f64,
}

/// The points of a line.
pub(super) type LineStrip = Vec<[f32; 2]>;

impl DiagramFrame {
    /// Position between the ends of both axes, 0 to 1 inside.
    pub fn relative_position(&self, coordinates: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let [from, to] = self.ranges[axis];
            (coordinates[axis] - from) / (to - from)
        })
    }

    /// The position of shares in the view, whose y points down.
    pub fn view_position_of_relative(&self, [x, y]: [f64; 2]) -> [f32; 2] {
        [(x * self.width) as f32, (1.0 - y) as f32]
    }

    /// The position of coordinates in the view.
    pub fn view_position(&self, coordinates: [f64; 2]) -> [f32; 2] {
        self.view_position_of_relative(self.relative_position(coordinates))
    }

    /// Sends the grid with its numbers and the labels of the axes.
    pub fn send_grid_and_labels(&self, stream: &RecordingStream) -> RecordingStreamResult<()> {
        let (mut lines, mut colors, mut positions, mut labels) = (vec![], vec![], vec![], vec![]);
        for axis in [0, 1] {
            let [from, to] = self.ranges[axis];
            let spacing = round_up_to_1_2_5((to - from).abs() / self.ticks);
            let across = self.ranges[1 - axis];
            let point = |along: f64, across: f64| {
                self.view_position(if axis == 0 { [along, across] } else { [across, along] })
            };
            let (first, last) = (from.min(to) / spacing, from.max(to) / spacing);
            for tick in (first - 1e-9).ceil() as i64..=(last + 1e-9).floor() as i64 {
                let value = tick as f64 * spacing;
                lines.push(across.map(|end| point(value, end)).to_vec());
                colors.push(if tick == 0 { AXIS } else { GRID });
                let [x, y] = point(value, across[0]);
                positions.push(match axis {
                    0 => [x, y + self.line],
                    _ => [x - 1.6 * self.line, y - 0.4 * self.line],
                });
                labels.push(tick_label(value, spacing));
            }
        }
        let middle = 0.5 * self.width as f32;
        positions.extend([[middle, 1.0 + 2.6 * self.line], [middle, -1.8 * self.line]]);
        labels.extend([format!("→ {}", self.labels[0]), format!("↑ {}", self.labels[1])]);
        let grid = LineStrips2D::new(lines)
            .with_colors(colors)
            .with_radii([Radius::new_ui_points(0.5)])
            .with_draw_order(0.0);
        stream.log_static(format!("{}/grid", self.root), &grid)?;
        let labels = Points2D::new(positions)
            .with_labels(labels)
            .with_show_labels(true)
            .with_colors([TEXT])
            .with_radii([Radius::new_ui_points(0.0)]);
        stream.log_static(format!("{}/labels", self.root), &labels)
    }

    /// Sends a legend to `path`, below `above` other entries.
    pub fn send_legend<L: AsRef<str>>(
        &self,
        stream: &RecordingStream,
        path: EntityPath,
        above: usize,
        entries: &[(Color, L)],
    ) -> RecordingStreamResult<()> {
        let position =
            |(row, _): (usize, _)| [0.2 * self.width as f32, self.line * (0.6 + 1.6 * (above + row) as f32)];
        let legend = Points2D::new(entries.iter().enumerate().map(position))
            .with_labels(entries.iter().map(|(_, label)| label.as_ref()))
            .with_show_labels(true)
            .with_colors(entries.iter().map(|(color, _)| *color))
            .with_radii([Radius::new_ui_points(0.0)]);
        stream.log_static(path, &legend)
    }
}

/// Just enough digits to tell ticks at this distance apart.
fn tick_label(value: f64, spacing: f64) -> String {
    let digits = (-spacing.log10().floor()).max(0.0) as usize;
    format!("{value:.digits$}")
}
