//! Prints how well v_y is estimated that neither fit nor estimator saw: `cargo run --release -p drive-prediction --example hidden_v_y -- FOLDER`.

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use drive_prediction::hidden::{
    BankMap, EstimatorSetup, SensorChannel, SensorSignals, SideslipEstimate, SideslipFit, filter_sideslip,
    fit_sideslip_model, smooth_sideslip,
};
use drive_prediction::zero_phase::low_pass;
use vehicle::VehicleBody;

/// The columns of a CSV file by their titles.
fn columns(path: &Path) -> Result<impl Fn(&str) -> Vec<f64> + use<>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut lines = text.lines();
    let titles = lines.next().unwrap_or_default().trim_start_matches("# ");
    let titles: Vec<String> = titles.split(',').map(|title| title.trim().to_owned()).collect();
    let number = |cell: &str| cell.parse().unwrap_or(f64::NAN);
    let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(number).collect()).collect();
    Ok(move |title: &str| {
        let place = titles.iter().position(|it| it == title).unwrap_or(usize::MAX);
        rows.iter().map(|row| row.get(place).copied().unwrap_or(f64::NAN)).collect()
    })
}

/// Errors of an estimate: RMS of v_y [m/s] and of sideslip [deg], share inside the 95 % band, mean standard deviation [m/s].
fn score(name: &str, estimate: &SideslipEstimate, truth: [&[f64]; 2], counts: impl Fn(usize) -> bool) {
    let [v_x, v_y] = truth;
    let (mut squares, mut angles, mut inside, mut std, mut sum, mut n) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for row in (0..v_x.len()).filter(|row| counts(*row)) {
        let error = estimate.v_y[row] - v_y[row];
        let angle = estimate.v_y[row].atan2(v_x[row]) - v_y[row].atan2(v_x[row]);
        squares += error * error;
        sum += error;
        angles += angle.to_degrees().powi(2);
        inside += f64::from(u8::from(error.abs() < 1.96 * estimate.v_y_std[row]));
        std += estimate.v_y_std[row];
        n += 1.0;
    }
    println!(
        "{name:42} v_y {:.4} m/s, sideslip {:.3} deg, 95 % band holds {:.3}, its std {:.3}, mean error {:+.3}",
        f64::sqrt(squares / n),
        f64::sqrt(angles / n),
        inside / n,
        std / n,
        sum / n
    );
}

fn compare(hidden: &SideslipFit, seen: &SideslipFit) {
    let ratio = |a: f64, b: f64| 100.0 * (a / b - 1.0);
    for (axle, name) in ["front", "rear"].iter().enumerate() {
        let [a, b] = [hidden, seen].map(|fit| fit.stiffness[axle].value);
        let [c, d] = [hidden, seen].map(|fit| fit.parameters.axle_tires()[axle].D);
        println!(
            "  {name}: K {a:.2} ({:+.1} % from the fit with v_y), D {c:.3} ({:+.1} %)",
            ratio(a, b),
            ratio(c, d)
        );
    }
}

fn lm(folder: &Path, judge: bool) -> Result<(), Box<dyn Error>> {
    let column = columns(&folder.join("revs_250lm.csv"))?;
    let smooth = |title: &str| low_pass(&column(title), 5.0, 0.01);
    let (v_x, v_y, time) = (smooth("vx_mps"), smooth("vy_mps"), column("t_s"));
    let rows = v_x.len();
    let signals = SensorSignals::new(0.01, &column("delta_rad"))
        .with_a_x(&column("ax_mps2"))
        .with_channel(SensorChannel::Speed, &column("vx_mps"))
        .with_channel(SensorChannel::YawRate, &column("yaw_rate_radps"))
        .with_channel(SensorChannel::LateralAcceleration, &column("ay_mps2"))
        .without_repeats();
    let setup =
        EstimatorSetup::road_car(VehicleBody { m: 982.0, I_zz: 1605.0, l_f: 1.33, l_r: 1.07, h: 0.45 });
    let first = time.iter().filter(|t| **t < time[0] + 220.0).count();
    let training = signals.first_rows(first);
    let clock = Instant::now();
    let plain = fit_sideslip_model(&setup, std::slice::from_ref(&training), None, &mut |_| true)?;
    println!(
        "250 LM, 0 to 220 s without v_y ({:.1} s, converged {}):\n{plain}",
        clock.elapsed().as_secs_f64(),
        plain.converged
    );
    let map = BankMap::learn(&setup, &plain, &training);
    println!("lap {:?} m", map.as_ref().map(|map| map.lap));
    let shown = training.clone().with_channel(SensorChannel::LateralSpeed, &column("vy_mps")[..first]);
    compare(&plain, &fit_sideslip_model(&setup, &[shown], None, &mut |_| true)?);
    let counts = |row: usize| v_x[row] > 12.0 && (50..rows - 50).contains(&row);
    let truth = [v_x.as_slice(), v_y.as_slice()];
    for (name, map) in [("no map of the bank", None), ("a map of the bank", map.as_ref())] {
        let causal = filter_sideslip(&setup, &plain, &signals, map);
        score(&format!("0 to 220 s, {name}"), &causal, truth, |row| row < first && counts(row));
        if !judge {
            continue;
        }
        let back = smooth_sideslip(&setup, &plain, &signals, map);
        for (kind, it) in [("causal", &causal), ("smoothed", &back)] {
            let title = format!("220 to 330 s, {name}, {kind}");
            score(&title, it, truth, |row| row >= first && counts(row));
        }
    }
    Ok(())
}

/// The 1:10 car: fitted to the other logs on rubber with v_y, judged without.
fn dart(folder: &Path, judged: &str) -> Result<(), Box<dyn Error>> {
    let wheelbase = 0.1735;
    let (front, rear) = (0.847 / 1.58, 0.733 / 1.58);
    let body = VehicleBody { m: 1.58, I_zz: 0.00481, l_f: wheelbase * rear, l_r: wheelbase * front, h: 0.03 };
    let setup = EstimatorSetup { steering_lag: 0.06, ..EstimatorSetup::small_car(body) };
    let load = |name: &str, seen: bool| -> Result<_, Box<dyn Error>> {
        let column = columns(&folder.join(format!("dart_{name}.csv")))?;
        let new = column("sensor_new");
        let fresh = |values: Vec<f64>| -> Vec<f64> {
            let keep = |(value, new): (f64, &f64)| if *new > 0.0 { value } else { f64::NAN };
            values.into_iter().zip(&new).map(keep).collect()
        };
        let (v_x, v_y) = (column("v_x"), column("v_y"));
        let scaled = |title: &str, by: f64| column(title).iter().map(|it| it / by).collect();
        let signals = SensorSignals::new(0.01, &column("steering_angle_rad"))
            .with_channel(SensorChannel::Speed, &fresh(scaled("wheel_speed", 1.03)))
            .with_channel(SensorChannel::YawRate, &fresh(scaled("yaw_rate_imu", 1.028)))
            .with_channel(SensorChannel::LateralAcceleration, &fresh(column("a_y_imu")));
        let signals = if seen { signals.with_channel(SensorChannel::LateralSpeed, &v_y) } else { signals };
        Ok((signals, [v_x, v_y]))
    };
    let logs = [
        "circles_rubber_left",
        "circles_rubber_right",
        "ramp_rubber_left",
        "ramp_rubber_right",
        "free_fast",
        "free_moderate",
    ];
    let mut training = Vec::new();
    for name in logs.into_iter().filter(|name| *name != judged) {
        training.push(load(name, true)?.0);
    }
    let fitted = fit_sideslip_model(&setup, &training, None, &mut |_| true)?;
    println!("DART, all logs but {judged}, with v_y (converged {}):\n{fitted}", fitted.converged);
    let (signals, [v_x, v_y]) = load(judged, false)?;
    let truth = [v_x.as_slice(), v_y.as_slice()];
    let gap = columns(&folder.join(format!("dart_{judged}.csv")))?("gap");
    let counts = |row: usize| v_x[row] > 0.6 && gap[row] == 0.0;
    for (kind, it) in [
        ("causal", filter_sideslip(&setup, &fitted, &signals, None)),
        ("smoothed", smooth_sideslip(&setup, &fitted, &signals, None)),
    ] {
        score(&format!("{judged}, {kind}"), &it, truth, counts);
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("expected the folder of the data")?;
    // Settings are chosen before anyone looks at what judges them.
    let judge = std::env::args().nth(2).is_none_or(|word| word != "training");
    lm(Path::new(&folder), judge)?;
    ["free_moderate", "free_fast"].into_iter().try_for_each(|log| dart(Path::new(&folder), log))
}
