//! Describes paths on the ground by the distance of points from them.

/// A path that begins at the origin and leads along x there [m].
#[derive(Debug, Clone, PartialEq)]
pub enum GroundPath {
    /// The x axis.
    Straight,
    /// A circle to the left, with this radius [m].
    Circle(f64),
    /// Points with growing x, joined by half waves of a cosine; level before the first one and after the last one.
    Gates(Vec<[f64; 2]>),
}

/// Distance of points along a path [m].
const SAMPLING: f64 = 1.0;

impl GroundPath {
    /// Points of the path from its beginning on, where it is more than a straight line: a whole circle, or up to the last gate.
    #[must_use]
    pub fn sampled_points(&self) -> Vec<[f64; 2]> {
        match self {
            GroundPath::Straight => Vec::new(),
            GroundPath::Circle(radius) => {
                let point = |degree: i32| {
                    let (sin, cos) = f64::from(degree).to_radians().sin_cos();
                    [radius * sin, radius * (1.0 - cos)]
                };
                (0..=360).step_by(3).map(point).collect()
            }
            GroundPath::Gates(points) => {
                let end = points.last().map_or(0.0, |point| point[0]);
                let count = (end / SAMPLING).ceil() as u32;
                let along = (0..=count).map(|k| (f64::from(k) * SAMPLING).min(end));
                along.map(|x| [x, center_line(points, x).y]).collect()
            }
        }
    }

    /// How far the path is to the left of a point [m].
    #[must_use]
    pub fn lateral_offset(&self, x: f64, y: f64) -> f64 {
        match self {
            GroundPath::Straight => -y,
            GroundPath::Circle(radius) => x.hypot(y - radius) - radius,
            GroundPath::Gates(points) => {
                let line = center_line(points, x);
                (line.y - y) / line.slope.hypot(1.0)
            }
        }
    }
}

/// The center line through gates at one x.
struct CenterLine {
    /// [m]
    y: f64,
    /// dy/dx [-]
    slope: f64,
}

fn center_line(points: &[[f64; 2]], x: f64) -> CenterLine {
    let after = points.iter().position(|point| point[0] > x);
    match after {
        Some(0) => CenterLine { y: points[0][1], slope: 0.0 },
        None => CenterLine { y: points.last().map_or(0.0, |point| point[1]), slope: 0.0 },
        Some(next) => {
            let ([x0, y0], [x1, y1]) = (points[next - 1], points[next]);
            let turn = std::f64::consts::PI * (x - x0) / (x1 - x0);
            let half = 0.5 * (y1 - y0);
            let slope = half * turn.sin() * std::f64::consts::PI / (x1 - x0);
            CenterLine { y: y0 + half * (1.0 - turn.cos()), slope }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::GroundPath;

    #[test]
    fn the_path_is_to_the_left_of_points_on_its_right() {
        assert_eq!(GroundPath::Straight.lateral_offset(3.0, -2.0), 2.0);
        assert_eq!(GroundPath::Circle(10.0).lateral_offset(0.0, 0.0), 0.0);
        assert_eq!(GroundPath::Circle(10.0).lateral_offset(0.0, 2.0), -2.0);
        let gates = GroundPath::Gates(vec![[0.0, 0.0], [10.0, 4.0], [20.0, 4.0]]);
        for (x, y) in [(-5.0, 0.0), (0.0, 0.0), (5.0, 2.0), (10.0, 4.0), (15.0, 4.0), (99.0, 4.0)] {
            assert!(gates.lateral_offset(x, y).abs() < 1e-12, "{x}");
        }
        assert!(gates.lateral_offset(5.0, 1.0) > 0.0 && gates.lateral_offset(5.0, 1.0) < 1.0);
    }
}
