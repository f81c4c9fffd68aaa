//! Tells braking, cornering and accelerating apart, as the forces of the tires do.

use html_page::{CssClass, Plot};
use lap::LapNode;

/// What the tires do at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum DrivingPhase {
    /// They brake the car.
    Brake,
    /// They do little but to turn it.
    Corner,
    /// They drive it.
    Drive,
}

/// Largest acceleration along the car in a corner, and least one to its side, over the largest one to the side [-].
const ALONG: f64 = 0.1;
const ASIDE: f64 = 0.3;

/// Dots of a node [px].
const DOT: f64 = 2.5;

/// A break in a line.
const BREAK: (f64, f64) = (f64::NAN, f64::NAN);

impl DrivingPhase {
    pub const ALL: [DrivingPhase; 3] = [DrivingPhase::Brake, DrivingPhase::Corner, DrivingPhase::Drive];

    /// The phase of each node.
    pub fn of_nodes(nodes: &[LapNode]) -> Vec<DrivingPhase> {
        let largest = nodes.iter().map(|node| node.variables.a_y.abs()).fold(0.0, f64::max);
        let phase = |node: &LapNode| match node.variables.F_x {
            _ if node.a_x.abs() < ALONG * largest && node.variables.a_y.abs() > ASIDE * largest => {
                DrivingPhase::Corner
            }
            force if force < 0.0 => DrivingPhase::Brake,
            _ => DrivingPhase::Drive,
        };
        nodes.iter().map(phase).collect()
    }

    fn class(self) -> CssClass {
        match self {
            DrivingPhase::Brake => "poor",
            DrivingPhase::Corner => "c0",
            DrivingPhase::Drive => "c2",
        }
    }

    fn name(self) -> &'static str {
        match self {
            DrivingPhase::Brake => "braking",
            DrivingPhase::Corner => "cornering",
            DrivingPhase::Drive => "accelerating",
        }
    }
}

/// Adds a line whose colours are the phases; each piece has the one of the node where it begins.
pub(crate) fn add_phase_line(plot: &mut Plot, points: &[(f64, f64)], phases: &[DrivingPhase]) {
    for phase in DrivingPhase::ALL {
        let mut line = Vec::new();
        for (piece, of_piece) in points.windows(2).zip(phases) {
            if *of_piece == phase {
                if line.last() != Some(&piece[0]) {
                    line.extend([BREAK, piece[0]]);
                }
                line.push(piece[1]);
            }
        }
        plot.add_line(&line, phase.class(), phase.name());
    }
}

/// Adds dots whose colours are the phases.
pub(crate) fn add_phase_dots(plot: &mut Plot, points: &[(f64, f64)], phases: &[DrivingPhase]) {
    for phase in DrivingPhase::ALL {
        let of_phase = points.iter().zip(phases).filter(|(_, of_point)| **of_point == phase);
        let dots: Vec<_> = of_phase.map(|(point, _)| *point).collect();
        plot.add_dots(&dots, DOT, phase.class(), phase.name());
    }
}

#[cfg(test)]
mod tests {
    use html_page::PlotAxis;

    use super::*;

    #[test]
    fn pieces_of_a_line_have_the_phase_of_their_begin() {
        let axis = || PlotAxis::linear("", 0.0, 4.0);
        let mut plot = Plot::new([300.0, 200.0], axis(), axis());
        let points: Vec<_> = (0..5).map(|k| (f64::from(k), 0.0)).collect();
        let [brake, corner, drive] = DrivingPhase::ALL;
        add_phase_line(&mut plot, &points, &[brake, corner, corner, brake, drive]);
        let stations = |layer: usize| -> Vec<f64> {
            plot.layers[layer].points.iter().map(|point| point.0).filter(|x| x.is_finite()).collect()
        };
        assert_eq!(stations(0), [0.0, 1.0, 3.0, 4.0]);
        assert_eq!(stations(1), [1.0, 2.0, 3.0]);
        assert!(stations(2).is_empty());
    }
}
