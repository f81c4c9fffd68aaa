//! Asserts what the task tells of loads, longitudinal forces and laps of a car that weaves for a few seconds.

use plugin::{Analysis as _, AnalysisRequest, AnalysisServices, Signal};
use serde_json::Value;

use crate::plugin::Identify;
use crate::plugin::hostile::{CAR, STEP, weaving_drive};

/// Keeps the page.
#[derive(Default)]
struct Reader(String);

impl AnalysisServices for Reader {
    fn report_progress(&mut self, _: f64, _: &str) -> bool {
        true
    }
    fn record_signals(&mut self, _: &str, _: &[Signal]) {}
    fn add_diagram(&mut self, _: &str, _: &plugin::Diagram) {}
    fn write_file(&mut self, name: &str, text: &str) {
        if name.ends_with(".html") {
            text.clone_into(&mut self.0);
        }
    }
}

fn found(more: &str, also: &[(&'static str, Vec<f64>)]) -> Result<(Value, String), String> {
    let config = format!(
        "task = \"tires\"\nmethods = [\"least_squares\"]\n{more}\n[car]\n{CAR}drive_front_share = 0.0\nwheel_r = {{ radius = 0.3 }}\n"
    );
    let signals = [weaving_drive(), also.to_vec()].concat();
    let time: Vec<f64> = (0..signals[0].1.len()).map(|row| row as f64 * STEP).collect();
    let lent = signals.iter().map(|(name, values)| Signal { name, unit: "", time: &time, values });
    let request = AnalysisRequest { config: &config, signals: lent.collect() };
    Identify::check_request(&request).map_err(|error| format!("{}: {error}", error.key_path()))?;
    let mut page = Reader::default();
    let text = Identify::run(&request, &mut page).map_err(|error| error.to_string())?;
    Ok((serde_json::from_str(&text).expect("JSON"), page.0))
}

#[test]
fn what_a_steady_drive_cannot_tell_says_what_is_missing() {
    let (result, page) = found("", &[]).expect("tires");
    for axle in ["front", "rear"] {
        for quantity in ["K", "D"] {
            let told = &result["load_sensitivity"][axle][quantity];
            assert_eq!(told["verdict"], "not_identifiable", "{told}");
            assert_eq!(told["obstacle"], "still", "{told}");
        }
        let combined = &result["combined_slip"][axle];
        assert_eq!(combined["mu_x"]["verdict"], "not_identifiable", "{combined}");
        let stiffness = &result["combined_slip"][axle]["slip_stiffness"];
        assert_eq!(stiffness["verdict"], "not_identifiable");
        let wheel = format!("omega_{}l", &axle[..1]);
        let reason = stiffness["reason"].as_str().unwrap_or_default();
        assert!(reason.contains(&format!("`{wheel}`")), "{reason}");
        let is_named = page.contains(&format!("<code>{wheel}</code>"));
        assert!(is_named, "the page does not say what is missing");
    }
    assert!(page.contains("longitudinal friction μ_x of the ellipse"));
    assert!(!page.contains("NaN"));
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    roxmltree::Document::parse_with_options(&page, options).expect("well-formed");
}

#[test]
fn a_longitudinal_curve_has_a_verdict_of_its_stiffness() {
    let speed: Vec<f64> = weaving_drive()[0].1.iter().map(|v_x| v_x / 0.3 * 1.001).collect();
    let wheels = ["omega_rl", "omega_rr"].map(|name| (name, speed.clone()));
    let (result, _) = found("", &wheels).expect("tires");
    let stiffness = &result["combined_slip"]["rear"]["slip_stiffness"];
    assert_eq!(stiffness["verdict"], result["least_squares"]["rear_x"]["identified"]["K"]);
    assert!(stiffness["value"].is_number() && stiffness["reason"].is_string(), "{stiffness}");
}

#[test]
fn laps_need_their_signal() {
    let error = found("drift = { laps = true }", &[]).expect_err("no laps");
    assert!(error.starts_with("drift.laps: ") && error.contains("`lap`"), "{error}");
    let lap = (0..weaving_drive()[0].1.len()).map(|row| (row / 100) as f64).collect();
    let (result, _) = found("drift = { laps = true }", &[("lap", lap)]).expect("tires");
    assert_eq!(result["drift"]["rear"]["K"]["verdict"], "not_identifiable");
}
