//! Draws how a difference spreads: nodes below each other in the order in which they differ, connections in lanes beside them.

use std::fmt::Write as _;

use html_page::escape_xml;
use units::display::shorten_end;

use crate::explanation::SpreadArrow;
use crate::trajectory::SignalDeviation;

/// Size of a box, space between two of them, distance of two lanes, and the bend between lane and box [px].
const BOX: [f64; 2] = [250.0, 46.0];
const GAP: f64 = 28.0;
const LANE: f64 = 16.0;
const BEND: f64 = 6.0;
/// Space around the drawing [px].
const MARGIN: f64 = 4.0;
/// Letters that a box has room for: of the name of its node, and of what stands below it.
const MOST_LETTERS: [usize; 2] = [28, 40];
const ARROW_STYLE: &str = "fill:none;stroke:currentColor;stroke-width:1.3";

/// A connection beside the boxes.
#[derive(Clone, Copy)]
struct LaneArrow {
    from: usize,
    to: usize,
    /// Its lane, from 0 on at the boxes.
    lane: usize,
}

impl LaneArrow {
    fn ends(self) -> [usize; 2] {
        [self.from.min(self.to), self.from.max(self.to)]
    }
}

/// The nodes and connections as SVG. Connections to later nodes run on the right, those back to earlier ones on the left: none crosses a
/// box.
pub(crate) fn draw_spread_graph(spread: &[SignalDeviation], arrows: &[SpreadArrow]) -> String {
    let place = |node: &str| spread.iter().position(|it| it.signal.node == node);
    let places: Vec<[usize; 2]> =
        arrows.iter().filter_map(|it| Some([place(&it.from)?, place(&it.to)?])).collect();
    let forward = assign_lanes(places.iter().copied().filter(|[from, to]| *to > from + 1));
    let back = assign_lanes(places.iter().copied().filter(|[from, to]| to < from));
    let lanes = |arrows: &[LaneArrow]| arrows.iter().map(|it| it.lane + 1).max().unwrap_or(0) as f64;
    let left = MARGIN + lanes(&back) * LANE + BEND;
    let width = left + BOX[0] + lanes(&forward) * LANE + BEND + MARGIN;
    let height = 2.0 * MARGIN + spread.len() as f64 * (BOX[1] + GAP) - GAP;
    let mut svg = format!(
        "<svg viewBox=\"0 0 {width:.0} {height:.0}\" style=\"max-width:{width:.0}px\" role=\"img\" aria-label=\"how the difference spreads\"><defs><marker id=\"tip\" viewBox=\"0 0 8 8\" refX=\"8\" refY=\"4\" markerWidth=\"7\" markerHeight=\"7\" orient=\"auto\"><path d=\"M0 0 L8 4 L0 8 z\" style=\"fill:currentColor;stroke:none\"/></marker></defs>"
    );
    let top = |place: usize| MARGIN + place as f64 * (BOX[1] + GAP);
    for (place, deviation) in spread.iter().enumerate() {
        write_box(&mut svg, left, top(place), deviation);
    }
    for [from, _] in places.iter().filter(|[from, to]| *to == from + 1) {
        let x = left + 0.5 * BOX[0];
        write_arrow(&mut svg, &format!("M{x:.1} {:.1}V{:.1}", top(*from) + BOX[1], top(from + 1)));
    }
    for (side, arrows) in [(1.0, &forward), (-1.0, &back)] {
        let edge = if side > 0.0 { left + BOX[0] } else { left };
        for arrow in arrows {
            let lane = edge + side * (BEND + (arrow.lane + 1) as f64 * LANE - 0.5 * LANE);
            let [y, end] =
                [arrow.from, arrow.to].map(|place| top(place) + BOX[1] * port(arrows, *arrow, place));
            let bend = side * BEND;
            let down = BEND * (end - y).signum();
            let path = format!(
                "M{edge:.1} {y:.1}H{:.1}Q{lane:.1} {y:.1} {lane:.1} {:.1}V{:.1}Q{lane:.1} {end:.1} {:.1} {end:.1}H{edge:.1}",
                lane - bend,
                y + down,
                end - down,
                lane - bend
            );
            write_arrow(&mut svg, &path);
        }
    }
    svg + "</svg>"
}

/// Puts connections into lanes: the shortest next to the boxes, and none on another.
fn assign_lanes(places: impl Iterator<Item = [usize; 2]>) -> Vec<LaneArrow> {
    let mut open: Vec<_> = places.map(|[from, to]| LaneArrow { from, to, lane: 0 }).collect();
    open.sort_by_key(|it| (it.ends()[1] - it.ends()[0], it.ends()[0]));
    let mut laid: Vec<LaneArrow> = Vec::new();
    for arrow in open {
        let [low, high] = arrow.ends();
        let meets = |it: &LaneArrow| it.ends()[0] <= high && low <= it.ends()[1];
        // A lane outside of all that it passes, so that no end of a shorter one crosses it.
        let lane = laid.iter().filter(|it| meets(it)).map(|it| it.lane + 1).max().unwrap_or(0);
        laid.push(LaneArrow { lane, ..arrow });
    }
    laid
}

/// Where a connection meets the side of a box, from 0 at its top to 1: above those that come from above, the inner ones first; below those
/// that come from below, the outer ones first, so that they do not cross.
fn port(arrows: &[LaneArrow], arrow: LaneArrow, place: usize) -> f64 {
    let rank = |it: &LaneArrow| {
        let is_from_below = it.ends()[0] == place;
        let lane = it.lane as isize;
        (is_from_below, if is_from_below { -lane } else { lane })
    };
    let here: Vec<_> = arrows.iter().filter(|it| it.ends().contains(&place)).map(rank).collect();
    let before = here.iter().filter(|it| **it < rank(&arrow)).count();
    (before + 1) as f64 / (here.len() + 1) as f64
}

// Writing into a string cannot fail.
fn write_arrow(svg: &mut String, path: &str) {
    let _ = write!(svg, "<path d=\"{path}\" style=\"{ARROW_STYLE}\" marker-end=\"url(#tip)\"/>");
}

fn write_box(svg: &mut String, x: f64, y: f64, deviation: &SignalDeviation) {
    let [width, height] = BOX;
    let middle = x + 0.5 * width;
    let [node_room, signal_room] = MOST_LETTERS;
    let node = escape_xml(&shorten_end(&deviation.signal.node, node_room));
    let signal =
        format!("from {} s: {}", diagnostics::rounded_time(deviation.time), deviation.signal.variable);
    let signal = escape_xml(&shorten_end(&signal, signal_room));
    let _ = write!(
        svg,
        "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width}\" height=\"{height}\" rx=\"6\" style=\"fill:none;stroke:currentColor\"/><text x=\"{middle:.1}\" y=\"{:.1}\" style=\"fill:currentColor;font-size:14px\">{node}</text><text x=\"{middle:.1}\" y=\"{:.1}\">{signal}</text>",
        y + 19.0,
        y + 37.0
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn connections_keep_lanes_of_their_own() {
        let laid = assign_lanes([[0, 3], [0, 2], [1, 3], [4, 6]].into_iter());
        for (place, one) in laid.iter().enumerate() {
            for other in &laid[place + 1..] {
                let apart = one.ends()[1] < other.ends()[0] || other.ends()[1] < one.ends()[0];
                assert!(apart || one.lane != other.lane);
            }
        }
        let ports: Vec<f64> =
            laid.iter().filter(|it| it.ends().contains(&0)).map(|it| port(&laid, *it, 0)).collect();
        assert!(ports.len() == 2 && ports[0] != ports[1] && ports.iter().all(|it| (0.0..1.0).contains(it)));
    }
}
