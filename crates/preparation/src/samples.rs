//! Holds the points of one axle in one direction: slip, friction coefficient, weight.

/// Points of a tire curve. All columns are of the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveSamples {
    /// Slip angle [rad] or slip ratio [-].
    pub slip: Vec<f64>,
    /// Force over axle load F / F_z [-].
    pub force: Vec<f64>,
    /// Relative weight of the squared residual [-]; 1 for all points unless the noise is known to differ.
    pub weight: Vec<f64>,
}

impl CurveSamples {
    /// Points of equal weight.
    pub fn new(slip: Vec<f64>, force: Vec<f64>) -> Self {
        debug_assert_eq!(slip.len(), force.len());
        let weight = vec![1.0; slip.len()];
        Self { slip, force, weight }
    }

    /// Adds a point.
    pub fn push(&mut self, slip: f64, force: f64, weight: f64) {
        self.slip.push(slip);
        self.force.push(force);
        self.weight.push(weight);
    }

    /// The points of some rows, in their order.
    pub fn select_rows(&self, rows: &[usize]) -> Self {
        let of = |column: &[f64]| rows.iter().map(|&row| column[row]).collect();
        Self { slip: of(&self.slip), force: of(&self.force), weight: of(&self.weight) }
    }

    /// At most so many rows, at even steps in the order of the slip, the smallest one included.
    pub fn rows_by_slip(&self, most: usize) -> Vec<usize> {
        let count = self.len();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&i, &j| {
            let by_force = || self.force[i].total_cmp(&self.force[j]);
            self.slip[i].total_cmp(&self.slip[j]).then_with(by_force)
        });
        let wanted = count.min(most);
        (0..wanted).map(|k| order[k * count / wanted]).collect()
    }

    /// How many points there are.
    pub fn len(&self) -> usize {
        self.slip.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.slip.is_empty()
    }

    /// Smallest and largest slip: where the curve is supported by data. `None` without points.
    pub fn slip_range(&self) -> Option<[f64; 2]> {
        let low = self.slip.iter().copied().min_by(f64::total_cmp)?;
        let high = self.slip.iter().copied().max_by(f64::total_cmp)?;
        Some([low, high])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_rows_cover_the_slips_evenly() {
        let slip: Vec<f64> = (0..1000).rev().map(f64::from).collect();
        let samples = CurveSamples::new(slip.clone(), slip);
        let some = samples.select_rows(&samples.rows_by_slip(4));
        assert_eq!((some.slip, some.weight), (vec![0.0, 250.0, 500.0, 750.0], vec![1.0; 4]));
        assert_eq!(samples.rows_by_slip(5000).len(), 1000);
        assert!(CurveSamples::default().rows_by_slip(5).is_empty());
    }
}
