//! Averages a signal: the smallest plugin.

use plugin::{Analysis, Host, Need, Request};

struct Mean;

impl Analysis for Mean {
    const NEEDS: &'static [Need] = &[Need::required("x", "", "what is averaged")];

    fn run(request: &Request, host: &mut dyn Host) -> Result<String, String> {
        let x = request.signal("x").ok_or("expected a signal `x`")?;
        let mean = x.values.iter().sum::<f64>() / x.values.len() as f64;
        let deviation: Vec<f64> = x.values.iter().map(|value| value - mean).collect();
        host.record("deviation", &[plugin::Signal { values: &deviation, ..x }]);
        Ok(format!(r#"{{"mean": {mean}}}"#))
    }
}

plugin::export!(Mean);
