//! Draws the track from above: its edges, its line, and the driven line by what the tires do.

use html_page::{EqualScale, Plot, ScaledPlot};
use lap::{Corner, LapNode};

use crate::LapPage;
use crate::curves::LOG_CLASS;
use crate::phase::{DrivingPhase, add_phase_line};

const SIZE: EqualScale = EqualScale { width: 800.0, heights: [180.0, 560.0], space: 36.0 };

/// From the edge of the road to the middle of a corner's number, and from there down to the point that the number stands above [px].
const NUMBER_DISTANCE: f64 = 16.0;
const NUMBER_DROP: f64 = 12.0;

/// The map of a lap.
pub(crate) fn track_map(page: &LapPage) -> Plot {
    let nodes = &page.optimum.nodes;
    let close = |mut points: Vec<(f64, f64)>| {
        let first = points.first().copied();
        points.extend(first.filter(|_| page.line.is_closed()));
        points
    };
    let beside_line = |deviation: &dyn Fn(&LapNode) -> f64| {
        close(nodes.iter().map(|node| point_beside_line(page, node, deviation(node))).collect())
    };
    let [right, left] = [0, 1].map(|side| beside_line(&|node| edge_deviations(page, node)[side]));
    let driven = close(nodes.iter().map(|node| (node.position[0], node.position[1])).collect());
    let all = [&right[..], &left, &driven].concat();
    let ScaledPlot { mut plot, scale } = SIZE.plot_around(["X [m]", "Y [m]"], &all);
    let has_widths = page.line.widths_at(0.0).is_some();
    plot.add_line(
        &right,
        "truth hair",
        if has_widths { "edges of the road" } else { "room for the centre of gravity" },
    );
    plot.add_line(&left, "truth hair", "");
    plot.add_dashed_line(&beside_line(&|_| 0.0), "truth hair", "line of the track");
    add_phase_line(&mut plot, &driven, &DrivingPhase::of_nodes(nodes));
    if let Some(logged) = page.driven {
        let positions = logged.lap.nodes.iter().chain([&logged.lap.end]).map(|node| node.position);
        plot.add_dashed_line(&positions.map(|[x, y]| (x, y)).collect::<Vec<_>>(), LOG_CLASS, "log");
    }
    if let Some(first) = driven.first() {
        plot.add_dots(&[*first], 5.0, "truth", "start");
    }
    for (number, corner) in (1..).zip(page.corners) {
        plot.add_label(number_position(page, corner, scale), &number.to_string());
    }
    plot
}

/// A point of the road at the station of a node.
fn point_beside_line(page: &LapPage, node: &LapNode, deviation: f64) -> (f64, f64) {
    let on_line = page.line.point_at(node.s);
    let (sin, cos) = on_line.psi.sin_cos();
    (on_line.point[0] - deviation * sin, on_line.point[1] + deviation * cos)
}

/// Lateral deviations of the right and the left edge [m]; where the road has none, of the bounds of the lap.
fn edge_deviations(page: &LapPage, node: &LapNode) -> [f64; 2] {
    page.line.widths_at(node.s).map_or(node.deviation_bounds, |[left, right]| [-right, left])
}

/// Where the number of a corner stands: outside of the road, on the outer side of the turn.
fn number_position(page: &LapPage, corner: &Corner, scale: f64) -> (f64, f64) {
    let node = &page.optimum.nodes[corner.apex];
    let [right, left] = edge_deviations(page, node);
    let distance = NUMBER_DISTANCE / scale;
    let deviation = if node.variables.a_y > 0.0 { right - distance } else { left + distance };
    let (x, y) = point_beside_line(page, node, deviation);
    (x, y - NUMBER_DROP / scale)
}
