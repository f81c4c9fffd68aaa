//! Asks the plugin for tires from closed-loop drives as the program does, and looks at all that it leaves.

#[path = "../../../../crates/drive-inference/tests/support/drive.rs"]
mod drive;

use std::collections::BTreeMap;
use std::sync::LazyLock;

use drive_inference::{Drive, FitFormulation, Tires};
use plugin::{Analysis, AnalysisRequest, AnalysisServices, Signal};
use serde_json::Value;
use tire_inference::parameters::TireParameters;
use vehicle::SingleTrackCar;

use crate::plugin::{CANCELLED, Identify};

const UNEQUAL: Tires = Tires {
    front: TireParameters { B: 18.0, C: 1.6, D: 1.5, E: 0.5 },
    rear: TireParameters { B: 25.0, C: 1.9, D: 1.7, E: 0.9 },
};

/// 30 s at one speed, past the peaks of both axles.
static LIMIT: LazyLock<Drive> = LazyLock::new(|| {
    let car = drive::on_tires(&SingleTrackCar::default(), &UNEQUAL);
    drive::drive(&car, &drive::limit(&[25.0], 9.0), &drive::USUAL, 1)
});

/// The car of the drives, exactly known.
const CAR: &str = "car.body = { m = 780.0, I_zz = 1000.0, l_f = 1.4, l_r = 1.6, h = 0.35 }
car.aero = { rho = 1.225, area = 1.5, C_d = 0.3, C_lf = 0.0, C_lr = 0.0 }
car.brake_front_share = 0.6
car.exact = true";

/// Keeps what an analysis leaves, and calls it off after a number of questions.
#[derive(Default)]
struct Log {
    groups: BTreeMap<String, Vec<String>>,
    rows: BTreeMap<String, usize>,
    files: BTreeMap<String, String>,
    diagrams: BTreeMap<String, Vec<String>>,
    questions: Option<usize>,
}

impl AnalysisServices for Log {
    fn report_progress(&mut self, share: f64, _what: &str) -> bool {
        assert!((0.0..=1.0).contains(&share));
        match &mut self.questions {
            Some(0) => false,
            Some(left) => {
                *left -= 1;
                true
            }
            None => true,
        }
    }

    fn record_signals(&mut self, group: &str, signals: &[Signal]) {
        for signal in signals {
            assert_eq!(signal.time.len(), signal.values.len(), "{group} {}", signal.name);
            assert!(signal.values.iter().all(|value| value.is_finite()), "{group} {}", signal.name);
        }
        let names = signals.iter().map(|signal| signal.name.to_owned()).collect();
        assert!(self.groups.insert(group.to_owned(), names).is_none(), "{group} twice");
        self.rows.insert(group.to_owned(), signals[0].time.len());
    }

    fn add_diagram(&mut self, group: &str, diagram: &plugin::Diagram) {
        for layer in &diagram.layers {
            assert_eq!(layer.x.len(), layer.y.len(), "{group} {}", diagram.title);
        }
        self.diagrams.entry(group.to_owned()).or_default().push(diagram.title.to_owned());
    }

    fn write_file(&mut self, name: &str, text: &str) {
        self.files.insert(name.to_owned(), text.to_owned());
    }
}

fn request<'a>(recording: &'a Drive, config: &'a str) -> AnalysisRequest<'a> {
    let columns = recording.named_columns().into_iter().filter(|(name, _)| *name != "t");
    let signal = |(name, values)| Signal { name, unit: "", time: &recording.t, values };
    AnalysisRequest { config, signals: columns.map(signal).collect() }
}

fn run(recording: &Drive, config: &str, log: &mut Log) -> Result<Value, String> {
    let config = format!("task = \"closed_loop\"\n{CAR}\n{config}");
    let request = request(recording, &config);
    Identify::check_request(&request).map_err(|error| error.to_string())?;
    let text = Identify::run(&request, log).map_err(|error| error.to_string())?;
    Ok(serde_json::from_str(&text).expect("JSON"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("expected a number, found {value}"))
}

#[test]
fn calibrated_errors_are_told_with_verdicts_in_the_result_and_on_the_page() {
    let mut recording = LIMIT.clone();
    recording.delta.iter_mut().for_each(|delta| *delta += 0.01);
    let mut log = Log::default();
    let config = "calibrate = [\"steering_offset\"]\nem_passes = 0";
    let found = run(&recording, config, &mut log).expect("tires");
    let offset = &found["calibration"]["steering_offset"];
    let [low, high] = [0, 1].map(|k| number(&offset["interval"][k]));
    assert!(low < 0.01 && 0.01 < high && high - low < 0.005, "{offset}");
    assert!(offset["reason"].as_str().is_some_and(|it| !it.is_empty()), "{offset}");
    let said = found["summary"].to_string();
    assert!(said.contains("By itself, offset of the steering angle is 0.5"), "{said}");
    let page = log.files.values().find(|text| text.contains("<html")).expect("a page");
    assert!(page.contains("Errors of sensors by themselves"));
}

#[test]
fn slip_far_below_the_peak_is_told_to_be_too_little() {
    let car = SingleTrackCar::default();
    let recording = drive::drive(&car, &drive::chirp(15.0), &drive::CLEAN, 2);
    let [v_x, v_y, r, a_y] = drive::CLEAN;
    let config = format!("em_passes = 0\nnoise = {{ v_x = {v_x}, v_y = {v_y}, r = {r}, a_y = {a_y} }}");
    let found = run(&recording, &config, &mut Log::default()).expect("tires");
    for axle in ["front", "rear"] {
        let axle = &found["pem"][axle];
        for name in ["B", "C", "D", "E"] {
            assert_eq!(axle["identified"][name], "not_identifiable", "{name} {axle}");
            let reason = axle["reason"][name].as_str().expect("words");
            assert!(reason.contains("slip reached 0.00"), "{reason}");
            assert!(reason.contains("% of the peak slip"), "{reason}");
        }
    }
}

#[test]
fn every_formulation_can_be_asked_for() {
    // 6 s around the limit.
    let part = LIMIT.slice(1300..1900);
    for formulation in FitFormulation::ALL.into_iter().skip(1) {
        let name = formulation.name();
        let mut log = Log::default();
        let config = format!("method = {name:?}\nem_passes = 0");
        let found = run(&part, &config, &mut log).expect(name);
        assert!(number(&found[name]["front"]["mean"]["B"]) > 0.0);
        let last = &found["formulations"][name]["theta"]["rear"]["D"];
        assert_eq!(last, &found[name]["rear"]["mean"]["D"]);
        assert!(log.files["tires.html"].contains(formulation.title()));
    }
    let all = FitFormulation::ALL.map(|formulation| format!("{:?}", formulation.name())).join(", ");
    let config = format!("method = \"axle_forces\"\ncompare = [{all}]\nem_passes = 0\nodd_terms = true");
    let found = run(&part, &config, &mut Log::default()).expect("tires");
    assert_eq!(found["formulations"].as_object().expect("a table").len(), 5);
    assert!(found["axle_forces"]["front"]["mean"]["B"].is_number());
    assert_ne!(number(&found["formulations"]["acceleration"]["odd"][0]), 0.0);
}

#[test]
fn what_was_kept_is_predicted_and_everything_is_told() {
    let mut log = Log::default();
    let config = "compare = [\"smoothed_acceleration\"]\nsvi = true\nwindows = [[0.0, 12.0], [14.0, 30.0]]\nem_passes = 30\n\
                  [[validate]]\nname = \"weave\"\nfrom = 8.0\nuntil = 11.0";
    let found = run(&LIMIT, config, &mut log).expect("tires");
    let windows: Vec<_> =
        found["recordings"].as_array().expect("a list").iter().map(|used| &used["window"]).collect();
    for (window, expected) in windows.iter().zip([[0.0, 7.99], [11.01, 12.0], [14.0, 29.99]]) {
        for i in 0..2 {
            assert!((number(&window[i]) - expected[i]).abs() < 1e-9, "{window} {expected:?}");
        }
    }
    assert_eq!(windows.len(), 3);
    for used in found["recordings"].as_array().expect("a list") {
        let smoothing = &used["smoothing"];
        let trace = smoothing["em"]["log_likelihood"].as_array().expect("a trace");
        let rises = trace.windows(2).all(|pair| number(&pair[1]) >= number(&pair[0]) - 1e-5);
        assert!(rises && trace.len() > 3, "{trace:?}");
        assert_eq!(smoothing["em"]["violations"].as_array().map(Vec::len), Some(0));
        let variances = ["Q", "R"].iter().flat_map(|name| smoothing[name].as_array().expect("a list"));
        assert!(variances.map(number).all(|variance| variance > 0.0), "{smoothing}");
        assert!(number(&smoothing["a_y_rmse"]) < 0.1);
    }
    for axle in ["front", "rear"] {
        let [svi, posterior] = ["svi", "posterior"].map(|from| &found["pem"][axle][from]);
        assert_eq!(svi["status"], "converged", "{svi}");
        assert_eq!(svi["correction"]["k_hat"], posterior["k_hat"]);
        assert!(number(&svi["std"]["peak_slip"]) > 0.0);
    }
    let weave = &found["validate"]["weave"];
    for (name, sensor) in [("a_y", 0.1), ("r", 0.01)] {
        let in_noise = number(&weave["in_noise"][name]);
        assert!((0.8..1.5).contains(&in_noise), "{weave}");
        assert!(number(&weave["normalised"][name]) < 2.0 * number(&weave["floor"][name]), "{weave}");
        assert!((number(&weave["rmse"][name]) / sensor - in_noise).abs() < 0.1 * in_noise);
    }
    let used = 800 + 100 + 1600;
    let groups = ["states", "slip angles", "smoothed states", "smoothed slip angles"];
    for group in groups.into_iter().chain(["lateral acceleration"]) {
        assert_eq!(log.rows[group], used, "{group}");
    }
    assert_eq!(log.groups["smoothed states"][8..], ["xi_y", "std_xi_y", "xi_psi", "std_xi_psi"]);
    assert!(log.groups["lateral acceleration"].contains(&"a_y_reconstructed".to_owned()));
    assert_eq!(log.rows["validation weave"], 301);
    let page = &log.files["tires.html"];
    for said in [
        "smoothed acceleration",
        "How the drives are explained",
        "Autocorrelation",
        "weave",
        "EM finds",
        "its normal distribution",
    ] {
        assert!(page.contains(said), "{said}");
    }
    // That of each axle, its values and its end, and none for what is compared.
    assert_eq!(page.matches("its normal distribution").count(), 4);
    assert!(log.files["tires.toml"].contains("\"plant.tire_f.B\""));
    the_draws_are_those_of_the_report(&log.files["tires_draws.csv"], &found["pem"]);
    // For each axle its curve, seven densities and the trace of the fits.
    assert_eq!(log.diagrams.values().map(Vec::len).collect::<Vec<_>>(), [9, 9]);
}

/// Means and covariances within what a thousand draws of two thousand allow.
fn the_draws_are_those_of_the_report(draws: &str, axles: &Value) {
    let (heads, lines) = draws.split_once('\n').expect("a first line");
    let heads: Vec<_> = heads.split(',').collect();
    let number = |text: &str| text.parse::<f64>().expect("a number");
    let rows: Vec<Vec<f64>> = lines.lines().map(|line| line.split(',').map(number).collect()).collect();
    assert_eq!(rows.len(), 1000);
    let count = rows.len() as f64;
    let mean = |of: &dyn Fn(&Vec<f64>) -> f64| rows.iter().map(of).sum::<f64>() / count;
    for (axle, tire) in [("front", "tire_f"), ("rear", "tire_r")] {
        let parameters = ["B", "C", "D", "E"];
        let place = |name: &str| {
            let head = format!("plant.{tire}.{name}");
            heads.iter().position(|it| **it == head).expect("a column")
        };
        let places = parameters.map(place);
        let means = places.map(|column| mean(&|row| row[column]));
        let entry = |a: usize, b: usize| self::number(&axles[axle]["covariance"][a][b]);
        for (a, name) in parameters.into_iter().enumerate() {
            let std = entry(a, a).sqrt();
            let expected = self::number(&axles[axle]["posterior"]["mean"][name]);
            assert!((means[a] - expected).abs() < 0.1 * std, "{axle} {name}: {} {expected}", means[a]);
            for b in 0..4 {
                let product = |row: &Vec<f64>| (row[places[a]] - means[a]) * (row[places[b]] - means[b]);
                let off = (mean(&product) - entry(a, b)) / (std * entry(b, b).sqrt());
                assert!(off.abs() < 0.15, "{axle} {name} {}: off by {off}", parameters[b]);
            }
        }
    }
}

#[test]
fn noises_bounds_and_coupling_are_those_that_were_asked_for() {
    let part = LIMIT.slice(0..1000);
    let config = "em_passes = 0\nbounds = { C = [1.7, 1.75] }\naxle_coupling = 1e7\n\
                  noise = { v_x = 0.05, v_y = 0.01, r = 0.01, a_y = 0.1, process = { v_x = 1e-3, v_y = 2e-3, r = 3e-3, xi_x = 4.0 } }";
    let found = run(&part, config, &mut Log::default()).expect("tires");
    assert_eq!(found["noise"]["sensor"].to_string(), "[0.05,0.01,0.01,0.1]");
    assert_eq!(found["noise"]["process"].to_string(), "[0.001,0.002,0.003,4.0]");
    let of = |axle: &str, name: &str| number(&found["pem"][axle]["mean"][name]);
    assert!((1.7..=1.75).contains(&of("front", "C")) && (1.7..=1.75).contains(&of("rear", "C")));
    for name in ["B", "C", "D", "E"] {
        assert!((of("front", name) / of("rear", name) - 1.0).abs() < 0.02, "{name}");
    }
}

#[test]
fn nothing_is_integrated_over_a_gap() {
    let without = |from: f64, until: f64| {
        let inside = |k: &usize| !(from..until).contains(&LIMIT.t[*k]);
        LIMIT.select_rows(&(0..LIMIT.len()).filter(inside).collect::<Vec<_>>())
    };
    let gap = without(10.0, 15.0);
    let config = "em_passes = 0\nposterior = false\n[[validate]]\nname = \"weave\"\nfrom = 8.0\nuntil = 17.0";
    let mut log = Log::default();
    let found = run(&gap, config, &mut log).expect("tires");
    assert!(!log.files.contains_key("tires_draws.csv"), "there is no posterior");
    assert!(found["summary"].to_string().contains("No draws are left for a sweep"));
    assert_eq!(found["recordings"].as_array().map(Vec::len), Some(2));
    let [from, until] = [0, 1].map(|end| number(&found["sampling"]["gaps"][0][end]));
    assert!((from - 9.99).abs() < 1e-9 && (until - 15.0).abs() < 1e-9, "{}", found["sampling"]);
    // The car starts anew behind the gap, else it is metres off.
    let weave = &found["validate"]["weave"];
    assert!(number(&weave["in_noise"]["r"]) < 1.5, "{weave}");
    for (axle, truth) in [("front", 1.5), ("rear", 1.7)] {
        let axle = &found["pem"][axle];
        let (D, std) = (number(&axle["mean"]["D"]), number(&axle["std"]["D"]));
        assert!((D - truth).abs() < 4.0 * std, "D {D} ± {std}, truth {truth}");
    }
    let error = run(&gap, "gap = 0.005", &mut Log::default()).expect_err("all are gaps");
    assert!(error.contains("2499 gaps: steps of more than 0.00500 s"), "{error}");
}

#[test]
fn it_can_be_called_off() {
    for questions in [0, 2] {
        let mut log = Log { questions: Some(questions), ..Log::default() };
        let ended = run(&LIMIT, "profile = true", &mut log);
        assert_eq!(ended.err().as_deref(), Some(CANCELLED));
        assert!(log.files.is_empty());
    }
}

#[test]
fn a_mistake_is_named_by_its_key() {
    #[rustfmt::skip]
    let cases = [
        ("methd = \"pem\"", "unknown field `methd`"),
        ("method = \"svi\"", "unknown variant `svi`, expected one of `pem`, `acceleration_and_yaw`, `axle_forces`"),
        ("compare = [\"a_y\"]", "unknown variant `a_y`"),
        ("svi = true\nposterior = false", "svi: expected false, as it fits the posterior of method = \"pem\", found true"),
        ("svi = true\nmethod = \"axle_forces\"", "svi: expected false"),
        ("starts = 0", "starts: expected 1 or more, found 0"),
        ("regularisation = -1.0", "regularisation: expected 0 or above, found -1"),
        ("axle_coupling = inf", "axle_coupling: expected 0 or above, found inf"),
        ("weights = { kind = \"variance\", clamp = 0.0 }", "weights.clamp: expected a number above 0, found 0"),
        ("weights = { kind = \"huber\" }", "unknown variant `huber`"),
        ("bounds = { B = [9.0, 2.0] }", "bounds.B: expected two rising numbers, found 9 and 2"),
        ("bounds = { D = [-1.0, 2.0] }", "bounds.D: expected bounds above 0, found -1"),
        ("bounds = { S_h = [-0.1, 0.1] }", "`S_h` is not fitted to drives"),
        ("typical = { E = nan }", "typical.E: expected a finite typical value, found NaN"),
        ("noise = { v_x = 0.1, v_y = 0.1, r = 0.1 }", "missing field `a_y`"),
        ("noise = { v_x = 0.1, v_y = 0.1, r = 0.1, a_y = 0.0 }", "noise.a_y: expected a number above 0, found 0"),
        ("windows = [[5.0, 2.0]]", "windows.0: expected two rising numbers, found 5 and 2"),
        ("[[validate]]\nname = \"lap\"\nfrom = 3.0\nuntil = 3.0", "validate.0.until: expected a time after from = 3, found 3"),
        ("method = \"axle_forces\"\nprofile = true", "profile: expected false, as only method = \"pem\" has a likelihood"),
        ("car.body = { m = 0.0, I_zz = 1.0, l_f = 1.0, l_r = 1.0, h = 0.3 }", "car.body.m: expected a number above 0, found 0"),
    ];
    let part = LIMIT.slice(0..200);
    for (config, says) in cases {
        let car = if config.starts_with("car") { "" } else { CAR };
        let text = format!("task = \"closed_loop\"\n{car}\n{config}");
        let error = Identify::check_request(&request(&part, &text)).expect_err(config).to_string();
        assert!(error.contains(says), "{config}: {error}");
    }
    for (config, says) in [
        ("windows = [[100.0, 200.0]]", "the recording goes from 0 to 1.9900 s"),
        (
            "[[validate]]\nname = \"lap\"\nfrom = 1.9\nuntil = 9.0",
            "`lap`: expected 50 successive rows or more from 1.9 to 9 s",
        ),
    ] {
        let error = run(&part, config, &mut Log::default()).expect_err(config);
        assert!(error.contains(says), "{config}: {error}");
    }
}
