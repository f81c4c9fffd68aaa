//! Averages a signal: the smallest plugin.

use plugin::{Analysis, AnalysisError, AnalysisRequest, AnalysisServices, InputSignal, Signal};

struct Mean;

impl Analysis for Mean {
    const INPUTS: &'static [InputSignal] = &[InputSignal::required("x", "", "the averaged signal")];

    fn run(request: &AnalysisRequest, host: &mut dyn AnalysisServices) -> Result<String, AnalysisError> {
        let x = request.find_signal("x").ok_or("expected a signal `x`")?;
        let mean = x.values.iter().sum::<f64>() / x.values.len() as f64;
        let deviation: Vec<f64> = x.values.iter().map(|value| value - mean).collect();
        host.record_signals("deviation", &[Signal { values: &deviation, ..x }]);
        Ok(format!(r#"{{"mean": {mean}}}"#))
    }
}

plugin::export!(Mean);
