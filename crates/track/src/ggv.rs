//! Tabulates what accelerations a car can reach at each speed, its g-g-v diagram, and evaluates it on banked and sloping roads.

use serde::{Deserialize, Serialize};
use vehicle::G;

use crate::Error;

/// What a car can do at one speed on a level road. Tires and engine first; drag comes on top of all of them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AccelerationLimits {
    /// Speed [m/s].
    pub v: f64,
    /// Largest lateral acceleration by the tires [m/s²].
    pub lateral: f64,
    /// Largest forward acceleration that the driven tires transfer [m/s²], without drag.
    pub drive: f64,
    /// Largest deceleration that the tires transfer [m/s²], positive, without drag.
    pub brake: f64,
    /// Largest forward acceleration that the engine gives [m/s²], without drag.
    pub engine: f64,
    /// Deceleration by drag [m/s²].
    pub drag: f64,
    /// Downforce over the mass [m/s²].
    pub downforce: f64,
}

impl AccelerationLimits {
    /// No grip, an engine without limit, no drag and no downforce at this speed [m/s]: a beginning for others.
    #[must_use]
    pub const fn at_speed(v: f64) -> Self {
        let (lateral, drive, brake, drag, downforce) = (0.0, 0.0, 0.0, 0.0, 0.0);
        AccelerationLimits { v, lateral, drive, brake, engine: f64::INFINITY, drag, downforce }
    }

    /// What presses the car onto this road at this speed, over what presses it onto a level one [-].
    #[must_use]
    pub fn normal_load_factor(&self, road: &RoadGeometry) -> f64 {
        (road.normal_acceleration(self.v) + self.downforce).max(0.0) / (G + self.downforce)
    }
}

/// The road under a station of a line.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RoadGeometry {
    /// Curvature [1/m], positive in left turns.
    pub kappa: f64,
    /// Bank angle φ [rad], positive where the left side is higher.
    pub bank: f64,
    /// Grade θ [rad], positive uphill.
    pub grade: f64,
}

impl RoadGeometry {
    /// Lateral acceleration that the tires have to give at a speed [m/s] for the line to be followed [m/s²]:
    /// v² κ cos φ + g sin φ.
    #[must_use]
    pub fn lateral_acceleration(&self, v: f64) -> f64 {
        let (sin, cos) = self.bank.sin_cos();
        v * v * self.kappa * cos + G * sin
    }

    /// What presses the car onto the road at a speed [m/s], without downforce [m/s²]: g cos θ cos φ − v² κ sin φ.
    #[must_use]
    pub fn normal_acceleration(&self, v: f64) -> f64 {
        let (sin, cos) = self.bank.sin_cos();
        (G * self.grade.cos() * cos - v * v * self.kappa * sin).max(0.0)
    }
}

/// A g-g-v diagram: limits over the speed, and the form of the diagram between its axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GgvDiagram {
    rows: Vec<AccelerationLimits>,
    exponent: f64,
}

impl GgvDiagram {
    /// The diagram with these rows, linear between their speeds and constant beyond. At one speed, longitudinal and lateral
    /// acceleration by the tires share (|a_x| / a_x0)^n + (|a_y| / a_y0)^n ≤ 1 with the exponent n: 2 is an ellipse.
    ///
    /// # Errors
    /// Without rows, when speeds do not rise, when a limit is negative or not a number, or when the exponent is below 1.
    pub fn new(rows: Vec<AccelerationLimits>, exponent: f64) -> Result<Self, Error> {
        let wrong = |message| Err(Error::Limits(message));
        if rows.is_empty() {
            return wrong("expected limits at one speed at least, found none".to_owned());
        }
        if !(1.0..=100.0).contains(&exponent) {
            return wrong(format!("expected an exponent from 1 to 100, found {exponent}"));
        }
        for row in &rows {
            let AccelerationLimits { v, lateral, drive, brake, engine, drag, downforce } = *row;
            let finite = [v, lateral, drive, brake, drag].iter().all(|it| it.is_finite() && *it >= 0.0);
            if !(finite && engine >= 0.0 && downforce.is_finite()) {
                return wrong(format!("expected limits of at least 0, found {row:?}"));
            }
        }
        if let Some(pair) = rows.windows(2).find(|it| it[0].v >= it[1].v) {
            let [before, after] = [pair[0].v, pair[1].v];
            return wrong(format!("expected speeds that rise, found {after} m/s after {before} m/s"));
        }
        Ok(GgvDiagram { rows, exponent })
    }

    /// The same diagram with this share of the grip of the tires; engine, drag and downforce stay.
    #[must_use]
    pub fn with_grip(&self, share: f64) -> Self {
        let mut scaled = self.clone();
        for row in &mut scaled.rows {
            row.lateral *= share;
            row.drive *= share;
            row.brake *= share;
        }
        scaled
    }

    /// Highest speed of the diagram [m/s].
    #[must_use]
    pub fn top_speed(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.v)
    }

    /// The limits at a speed [m/s].
    #[must_use]
    pub fn limits_at_speed(&self, v: f64) -> AccelerationLimits {
        let above = self.rows.partition_point(|row| row.v <= v);
        let (Some(a), Some(b)) = (self.rows.get(above.saturating_sub(1)), self.rows.get(above)) else {
            return AccelerationLimits { v, ..self.rows[self.rows.len() - 1] };
        };
        if above == 0 {
            return AccelerationLimits { v, ..*b };
        }
        let t = (v - a.v) / (b.v - a.v);
        let mix = |a: f64, b: f64| if a == b { a } else { a + t * (b - a) };
        AccelerationLimits {
            v,
            lateral: mix(a.lateral, b.lateral),
            drive: mix(a.drive, b.drive),
            brake: mix(a.brake, b.brake),
            engine: mix(a.engine, b.engine),
            drag: mix(a.drag, b.drag),
            downforce: mix(a.downforce, b.downforce),
        }
    }

    /// The lowest and the highest acceleration along the line that the car can reach at a speed [m/s] while its tires hold it
    /// on the line [m/s²].
    ///
    /// The grip of the tires grows with what presses them onto the road; what the line takes of it laterally is lost along the line. Drag
    /// and grade act besides.
    #[must_use]
    pub fn acceleration_range(&self, v: f64, road: &RoadGeometry) -> [f64; 2] {
        self.range_with_lateral_acceleration(v, road, road.lateral_acceleration(v))
    }

    /// The same, while the tires give a lateral acceleration [m/s²] that need not be that of the line.
    #[must_use]
    pub fn range_with_lateral_acceleration(&self, v: f64, road: &RoadGeometry, lateral: f64) -> [f64; 2] {
        let limits = self.limits_at_speed(v);
        let pressed = limits.normal_load_factor(road);
        let used = lateral.abs() / (limits.lateral * pressed);
        let share = match self.exponent {
            _ if used.is_nan() || used >= 1.0 => 0.0,
            2.0 => (1.0 - used * used).sqrt(),
            n => (1.0 - used.powf(n)).powf(1.0 / n),
        } * pressed;
        let against = limits.drag + G * road.grade.sin();
        [-limits.brake * share - against, (limits.drive * share).min(limits.engine) - against]
    }

    /// What is left of the lateral grip at a speed [m/s] on the line [m/s²]; negative where the car cannot follow it.
    fn lateral_grip_reserve(&self, v: f64, road: &RoadGeometry) -> f64 {
        let limits = self.limits_at_speed(v);
        let pressed = limits.normal_load_factor(road);
        limits.lateral * pressed - road.lateral_acceleration(v).abs()
    }

    /// Highest speed up to `most` [m/s] up to which the tires hold the car on the line at every speed; none where they do not hold it at
    /// rest.
    #[must_use]
    pub fn max_cornering_speed(&self, road: &RoadGeometry, most: f64) -> Option<f64> {
        /// Speeds that are tried before the limit is narrowed down.
        const PARTS: i32 = 64;
        let speed = |i: i32| most * f64::from(i) / f64::from(PARTS);
        if self.lateral_grip_reserve(0.0, road) < 0.0 {
            return None;
        }
        let Some(over) = (1..=PARTS).find(|i| self.lateral_grip_reserve(speed(*i), road) < 0.0) else {
            return Some(most);
        };
        let (mut low, mut high) = (speed(over - 1), speed(over));
        while high - low > 1e-12 * high {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            match self.lateral_grip_reserve(middle, road) < 0.0 {
                true => high = middle,
                false => low = middle,
            }
        }
        Some(low)
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn ggv() -> GgvDiagram {
        let row = |v, lateral, downforce| AccelerationLimits {
            lateral,
            downforce,
            drive: 5.0,
            brake: 10.0,
            engine: 8.0 - 0.1 * v,
            drag: 0.001 * v * v,
            ..AccelerationLimits::at_speed(v)
        };
        GgvDiagram::new(vec![row(0.0, 9.0, 0.0), row(50.0, 14.0, 5.0)], 2.0).expect("limits")
    }

    #[test]
    fn tires_share_their_grip_along_an_ellipse() {
        let ggv = ggv();
        let limits = ggv.limits_at_speed(25.0);
        assert_relative_eq!(limits.lateral, 11.5);
        // Three fifths laterally leave four fifths along the line.
        let road = RoadGeometry { kappa: 0.6 * 11.5 / 625.0, ..RoadGeometry::default() };
        let [brake, drive] = ggv.acceleration_range(25.0, &road);
        assert_relative_eq!(brake, -8.0 - limits.drag, max_relative = 1e-12);
        assert_relative_eq!(drive, 4.0 - limits.drag, max_relative = 1e-12);
        // The engine is the limit at 45 m/s.
        let [_, drive] = ggv.acceleration_range(45.0, &RoadGeometry::default());
        assert_relative_eq!(drive, 3.5 - ggv.limits_at_speed(45.0).drag, max_relative = 1e-12);
        let half = ggv.with_grip(0.5).acceleration_range(25.0, &RoadGeometry::default());
        assert_relative_eq!(half[0], -5.0 - limits.drag, max_relative = 1e-12);
    }

    #[test]
    fn the_speed_of_a_bend_is_that_of_its_grip() {
        let flat = GgvDiagram::new(
            vec![AccelerationLimits { lateral: 9.0, ..AccelerationLimits::at_speed(80.0) }],
            2.0,
        );
        let flat = flat.expect("limits");
        let road = RoadGeometry { kappa: 0.01, ..RoadGeometry::default() };
        assert_relative_eq!(
            flat.max_cornering_speed(&road, 80.0).expect("a speed"),
            30.0,
            max_relative = 1e-10
        );
        assert_eq!(flat.max_cornering_speed(&RoadGeometry::default(), 80.0), Some(80.0));
        // On a bank that leans into the bend by φ: v² κ = g (μ + tan φ) / (1 − μ tan φ).
        let (mu, tan): (f64, f64) = (9.0 / G, 0.3);
        let banked = RoadGeometry { bank: -tan.atan(), ..road };
        let wanted = (G * (mu + tan) / (1.0 - mu * tan) / 0.01).sqrt();
        assert_relative_eq!(
            flat.max_cornering_speed(&banked, 80.0).expect("a speed"),
            wanted,
            max_relative = 1e-10
        );
        // The same bank in a bend to the right leans out of it.
        let mirrored = RoadGeometry { kappa: -0.01, bank: tan.atan(), ..road };
        assert_eq!(flat.max_cornering_speed(&mirrored, 80.0), flat.max_cornering_speed(&banked, 80.0));
        assert_eq!(flat.max_cornering_speed(&RoadGeometry { bank: 0.8, ..road }, 80.0), None);
    }

    #[test]
    fn wrong_limits_are_told() {
        let row = AccelerationLimits::at_speed(1.0);
        for (rows, exponent, wanted) in [
            (vec![], 2.0, "at one speed at least"),
            (vec![row, row], 2.0, "speeds that rise, found 1 m/s after 1 m/s"),
            (vec![row], 0.5, "from 1 to 100, found 0.5"),
            (vec![AccelerationLimits { brake: -1.0, ..row }], 2.0, "of at least 0"),
            (vec![AccelerationLimits { drag: f64::NAN, ..row }], 2.0, "of at least 0"),
        ] {
            let message = GgvDiagram::new(rows, exponent).expect_err("a mistake").to_string();
            assert!(message.contains(wanted), "{message}");
        }
    }
}
