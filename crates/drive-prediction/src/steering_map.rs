//! Turns commands of a steering into angles of the road wheels: a map of points, and the play of the linkage.

/// The angle [rad] of a command on the lines between points (command, angle) in rising order of their commands; the outer lines go on.
/// Fewer than two points leave the command as it is.
#[must_use]
pub fn road_wheel_angle(points: &[[f64; 2]], command: f64) -> f64 {
    let Some(last) = points.len().checked_sub(2) else { return command };
    let behind = points.partition_point(|point| point[0] <= command);
    let [[c0, a0], [c1, a1]] = [0, 1].map(|k| points[behind.saturating_sub(1).min(last) + k]);
    a0 + (a1 - a0) * (command - c0) / (c1 - c0)
}

/// The angles [rad] that follow others with a play of this half width [rad]: they move only where the play is used up.
#[must_use]
pub fn apply_steering_play(angles: &[f64], play: f64) -> Vec<f64> {
    let mut wheels: Option<f64> = None;
    let follow = |angle: &f64| {
        let before = wheels.unwrap_or(*angle);
        // What is no number moves nothing.
        let now = if angle.is_finite() && before.is_finite() {
            before.clamp(angle - play, angle + play)
        } else {
            *angle
        };
        wheels = now.is_finite().then_some(now).or(wheels);
        now
    };
    angles.iter().map(follow).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_lie_on_lines_that_go_on() {
        let points = [[-1.0, -0.4], [0.0, -0.01], [1.0, 0.3]];
        assert_eq!(road_wheel_angle(&points, 0.0), -0.01);
        assert!((road_wheel_angle(&points, 0.5) - 0.145).abs() < 1e-12);
        assert!((road_wheel_angle(&points, -2.0) + 0.79).abs() < 1e-12);
        assert!((road_wheel_angle(&points, 2.0) - 0.61).abs() < 1e-12);
        assert_eq!((road_wheel_angle(&[], 0.7), road_wheel_angle(&points[..1], 0.7)), (0.7, 0.7));
    }

    #[test]
    fn wheels_wait_until_the_play_is_used_up() {
        let wheels = apply_steering_play(&[0.0, 0.1, 0.2, 0.19, 0.1, f64::NAN, 0.1], 0.02);
        let expected = [0.0, 0.08, 0.18, 0.18, 0.12];
        for (found, expected) in wheels.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{wheels:?}");
        }
        assert!(wheels[5].is_nan() && (wheels[6] - 0.12).abs() < 1e-12);
    }
}
