//! Measures what a calculation costs, for examples that print it.

/// Processor time of this process [s], with a resolution of 0.01 s; not a number where the system does not tell.
pub fn processor() -> f64 {
    let Ok(text) = std::fs::read_to_string("/proc/self/stat") else { return f64::NAN };
    let after_name = text.rsplit(')').next().unwrap_or_default();
    let ticks = after_name.split_whitespace().skip(11).take(2);
    ticks.filter_map(|field| field.parse::<f64>().ok()).sum::<f64>() / 100.0
}
