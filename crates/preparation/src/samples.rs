//! Holds the points of one axle in one direction: slip, friction coefficient, weight.

/// Points of a tire curve. All columns are of the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// Slip angle [rad] or slip ratio [-].
    pub slip: Vec<f64>,
    /// Force over axle load F / F_z [-].
    pub force: Vec<f64>,
    /// Relative weight of the squared residual [-]; 1 for all points unless the noise is known to differ.
    pub weight: Vec<f64>,
}

impl Samples {
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
