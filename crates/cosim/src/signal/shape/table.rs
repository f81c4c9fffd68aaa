//! Has given values at given times.

use std::sync::Arc;

use recording::table::Interpolation;
use schemars::JsonSchema;
use serde::Deserialize;

use super::{ShapeParameters, SignalShape};
use crate::signal::window::SignalWindow;
use crate::signal::{EDGE, rules};

/// Shape: values at given times, `table = { time = [0.0, 1.0, 4.0], value = [0.0, 2.0, 0.0] }`. Before the first and after the
/// last time it has their values.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampledSignal {
    /// Times after the beginning of the window, increasing [s].
    #[schemars(example = [0.0, 1.0, 4.0])]
    pub time: Vec<f64>,
    /// One value per time.
    #[schemars(example = [0.0, 2.0, 0.0], extend("x-unit" = "of the table"))]
    pub value: Vec<f64>,
    /// Values between the times.
    #[serde(default)]
    #[schemars(example = &"hold")]
    pub interpolation: Interpolation,
}

impl ShapeParameters for SampledSignal {
    fn build_shape(&self, _: &SignalWindow, _: u64) -> Result<Arc<dyn SignalShape>, String> {
        rules::check_equal_lengths("value", self.value.len(), "time", self.time.len())?;
        if self.time.is_empty() {
            return Err("expected at least one time and value, found none".to_owned());
        }
        rules::check_finite_list("time", &self.time)?;
        rules::check_finite_list("value", &self.value)?;
        if let Some(pair) = self.time.windows(2).find(|pair| pair[1] <= pair[0]) {
            let (before, found) = (pair[0], pair[1]);
            return Err(format!("expected increasing numbers in `time`, found {found} after {before}"));
        }
        Ok(Arc::new(self.clone()))
    }
}

impl SignalShape for SampledSignal {
    fn value_at(&self, time: f64) -> f64 {
        let after = self.time.partition_point(|t| *t <= time + EDGE);
        let here = after.saturating_sub(1);
        let is_outside = after == 0 || after == self.time.len();
        if is_outside || self.interpolation == Interpolation::Hold {
            return self.value[here];
        }
        let share = (time - self.time[here]) / (self.time[after] - self.time[here]);
        self.value[here] + share.max(0.0) * (self.value[after] - self.value[here])
    }
}
