//! Draws the nodes of a run and their connections.

use std::f32::consts::TAU;

use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{GraphEdges, GraphNodes};
use re_sdk_types::components::Color;
use recording::view::NodeGraph;

/// The entity of the graph.
pub(super) const PATH: &str = "coupling";

/// Distance of neighbours on the circle [px]: names have about twenty letters.
const APART: f32 = 180.0;
/// Nodes of loops, and the others.
const COLORS: [(u8, u8, u8); 2] = [(230, 159, 0), (86, 180, 233)];

/// Draws the nodes on a circle, clockwise in the order in which they step, from the top on.
pub(super) fn draw_node_graph(graph: &NodeGraph, stream: &RecordingStream) -> RecordingStreamResult<()> {
    if graph.nodes.is_empty() {
        return Ok(());
    }
    let count = graph.nodes.len() as f32;
    let radius = (APART * count / TAU).max(0.7 * APART);
    let position = |place: usize| {
        let (sine, cosine) = (TAU * place as f32 / count).sin_cos();
        [radius * sine, -radius * cosine]
    };
    let id = |place: usize| place.to_string();
    let color = |is_looped: bool| {
        let (r, g, b) = COLORS[usize::from(!is_looped)];
        Color::from_rgb(r, g, b)
    };
    let nodes = graph.nodes.iter().enumerate();
    let labels = nodes.map(|(place, node)| format!("{}. {}", place + 1, node.name));
    let drawn = GraphNodes::new((0..graph.nodes.len()).map(id))
        .with_labels(labels)
        .with_positions((0..graph.nodes.len()).map(position))
        .with_colors(graph.nodes.iter().map(|node| color(node.is_looped)));
    let edges = graph.edges.iter().map(|(from, to)| (id(*from), id(*to)));
    let edges = GraphEdges::new(edges).with_directed_edges();
    stream.log_static(PATH, &[&drawn as &dyn re_sdk::AsComponents, &edges])
}
