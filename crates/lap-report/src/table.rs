//! Writes the nodes of a fastest lap as a table.

use lap::LapNode;

/// A column of the table.
struct LapColumn {
    name: &'static str,
    value: fn(&LapNode) -> f64,
}

/// Columns that a track without widths has not.
const EDGE_COLUMNS: [&str; 2] = ["left_m", "right_m"];
/// Columns that a lap without transients has not.
const BODY_COLUMNS: [&str; 3] = ["z [m]", "phi [rad]", "theta [rad]"];

const fn column(name: &'static str, value: fn(&LapNode) -> f64) -> LapColumn {
    LapColumn { name, value }
}

/// The first four make the table a track of its own: the driven line, with the road beside it.
const COLUMNS: [LapColumn; 27] = [
    column("x_m", |it| it.position[0]),
    column("y_m", |it| it.position[1]),
    column("left_m", |it| it.edges.map_or(f64::NAN, |edges| edges[0])),
    column("right_m", |it| it.edges.map_or(f64::NAN, |edges| edges[1])),
    column("s [m]", |it| it.s),
    column("t [s]", |it| it.t),
    column("psi [rad]", |it| it.psi),
    column("n [m]", |it| it.variables.n),
    column("xi [rad]", |it| it.variables.xi),
    column("v_x [m/s]", |it| it.variables.v_x),
    column("v_y [m/s]", |it| it.variables.v_y),
    column("r [rad/s]", |it| it.variables.r),
    column("delta [rad]", |it| it.variables.delta),
    column("F_x [N]", |it| it.variables.F_x),
    column("delta_rate [rad/s]", |it| it.variables.delta_rate),
    column("F_x_rate [N/s]", |it| it.variables.F_x_rate),
    column("kappa_fl [1]", |it| it.variables.kappas[0]),
    column("kappa_fr [1]", |it| it.variables.kappas[1]),
    column("kappa_rl [1]", |it| it.variables.kappas[2]),
    column("kappa_rr [1]", |it| it.variables.kappas[3]),
    column("alpha_f [rad]", |it| it.alphas[0]),
    column("alpha_r [rad]", |it| it.alphas[1]),
    column("a_x [m/s2]", |it| it.a_x),
    column("a_y [m/s2]", |it| it.variables.a_y),
    column(BODY_COLUMNS[0], |it| it.variables.body.map_or(f64::NAN, |body| body.attitude.z)),
    column(BODY_COLUMNS[1], |it| it.variables.body.map_or(f64::NAN, |body| body.attitude.phi)),
    column(BODY_COLUMNS[2], |it| it.variables.body.map_or(f64::NAN, |body| body.attitude.theta)),
];

/// The nodes as CSV, a row for each. The first columns are those of a track.
pub fn lap_table(nodes: &[LapNode]) -> String {
    let has_edges = nodes.iter().all(|node| node.edges.is_some());
    let has_body = nodes.iter().all(|node| node.variables.body.is_some());
    let is_there = |column: &&LapColumn| {
        (has_edges || !EDGE_COLUMNS.contains(&column.name))
            && (has_body || !BODY_COLUMNS.contains(&column.name))
    };
    let columns: Vec<&LapColumn> = COLUMNS.iter().filter(is_there).collect();
    let names: Vec<&str> = columns.iter().map(|column| column.name).collect();
    let mut text = names.join(",") + "\n";
    for node in nodes {
        let fields: Vec<String> =
            columns.iter().map(|column| format!("{:?}", (column.value)(node))).collect();
        text += &(fields.join(",") + "\n");
    }
    text
}
