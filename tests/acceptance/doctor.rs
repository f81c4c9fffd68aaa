//! Checks `trackside doctor`: errors of a log are named, with the line that corrects them, and a right log has none.

use std::fmt::Write as _;
use std::path::Path;

use super::harness::{Ended, Lab, ROOT, trackside};

tests! {
    a_right_log_has_no_errors: Compiler,
    the_logs_of_loggers_are_read_by_their_own_titles: Compiler,
    a_speed_in_km_h_and_a_mirrored_channel_are_named: Compiler,
    a_delay_in_the_column_corrects_a_late_channel: Compiler,
    what_is_corrected_is_sound: Compiler,
    missing_values_are_seen: Compiler,
    three_rows_are_not_called_right: Compiler,
    an_unknown_column_gets_a_suggestion,
}

/// Columns of 80 s: time, v_x, v_y, r, a_y, delta of a linear single-track car of 1.2 m + 1.4 m in a slalom at changing speed,
/// each row changed by `wrong`.
fn log(wrong: impl Fn(&mut [f64; 6])) -> String {
    const STEP: f64 = 0.001;
    let (mut v_y, mut r) = (0.0_f64, 0.0_f64);
    let mut text = "t_s,vx_mps,vy_mps,yaw_rate_radps,ay_mps2,delta_rad\n".to_owned();
    // Sensors are a little noisy, alike in each run.
    let noise = |row: usize, column: usize| ((row * 7 + column * 131) as f64 * 78.233).sin() * 1e-3;
    for row in 0..80_000_usize {
        let t = row as f64 * STEP;
        let v_x = 22.0 + 8.0 * (0.2 * t).sin();
        let delta = 0.02 * ((2.1 * t).sin() + (3.7 * t).sin() + 0.7 * (0.6 * t).sin());
        let front = 90.0 * (delta - (v_y + 1.2 * r) / v_x);
        let rear = 100.0 * (1.4 * r - v_y) / v_x;
        let a_y = front + rear;
        if row % 10 == 0 {
            let mut cells = [t, v_x, v_y, r, a_y, delta];
            cells.iter_mut().enumerate().skip(1).for_each(|(k, cell)| *cell += noise(row, k));
            wrong(&mut cells);
            let cells = cells.map(|cell| format!("{cell:.6}"));
            writeln!(text, "{}", cells.join(",")).expect("a string");
        }
        v_y += STEP * (a_y - v_x * r);
        r += STEP * (1.2 * front - 1.4 * rear) / 1.6;
    }
    text
}

/// From the workspace, whose packages the program builds.
fn run(arguments: &[&str]) -> Ended {
    let mut command = trackside(Path::new(ROOT));
    Ended::of(command.args(arguments).output().expect("the program"))
}

fn doctor(lab: &Lab, more: &[&str]) -> Ended {
    let [log, out] = ["log.csv", "out"].map(|name| lab.path(name).display().to_string());
    let usual = ["doctor", &log, "--l_f", "1.2", "--l_r", "1.4", "--out", &out];
    run(&[&usual[..], more].concat())
}

fn a_right_log_has_no_errors() {
    let lab = Lab::new();
    lab.write("log.csv", log(|_| ()));
    let ended = doctor(&lab, &[]).expect(0);
    assert!(ended.stdout.contains("v_x      is column `vx_mps` [m/s]  (by its title)"), "{}", ended.stdout);
    assert!(!ended.stdout.contains("likely"), "{}", ended.stdout);
    assert!(lab.has("out/doctor.html") && lab.has("out/doctor.toml"));
}

fn the_logs_of_loggers_are_read_by_their_own_titles() {
    let (_, rows) = log(|_| ()).split_once('\n').map(|(a, b)| (a.to_owned(), b.to_owned())).expect("rows");
    let racechrono = "This file is created using RaceChrono Pro v9.1.3 ( http://racechrono.com/ ).\nFormat,3\n\n\
        timestamp,speed,slip,rate_of_rotation_z,lateral_acc,steering_angle\nunix time,m/s,m/s,rad/s,m/s/s,rad\n\
        ,100: gps,calc,101: gyro,calc,200: canbus\n";
    let motec = "\"Format\",\"MoTeC CSV File\",,,\"Workbook\",\"\"\n\"Sample Rate\",\"100.000\",\"Hz\"\n\n\
        \"Time\",\"Ground Speed\",\"Slip\",\"Gyro Yaw Velocity\",\"G Force Lat\",\"Steered Angle\"\n\
        \"s\",\"m/s\",\"m/s\",\"rad/s\",\"m/s^2\",\"rad\"\n\n";
    for (head, says) in [
        (
            racechrono,
            ["RaceChrono CSV v3: titles in line 4, units in line 5, sources in line 6", "`lateral_acc`"],
        ),
        (motec, ["MoTeC i2 CSV: titles in line 4, units in line 5", "`G Force Lat`"]),
    ] {
        let lab = Lab::new();
        lab.write("log.csv", format!("{head}{rows}"));
        let ended = doctor(&lab, &[]).expect(0);
        let says = says.iter().all(|it| ended.stdout.contains(it));
        assert!(says && !ended.stdout.contains("likely"), "{}", ended.stdout);
    }
}

fn a_speed_in_km_h_and_a_mirrored_channel_are_named() {
    let lab = Lab::new();
    lab.write("log.csv", log(|cells| cells[1] *= 3.6));
    let ended = doctor(&lab, &[]).expect(1);
    assert!(ended.stdout.contains("certain  `v_x` is in km/h, not m/s"), "{}", ended.stdout);
    assert!(ended.stdout.contains("v_x: unit = \"km/h\""), "{}", ended.stdout);
    doctor(&lab, &["--v_x", "vx_mps:km/h"]).expect(0);
    lab.write("log.csv", log(|cells| cells[4] = -cells[4]));
    let ended = doctor(&lab, &[]).expect(1);
    assert!(ended.stdout.contains("`a_y` is mirrored"), "{}", ended.stdout);
    let report = lab.report("out");
    let first = &report["analyses"]["doctor"]["doctor"]["findings"][0];
    assert_eq!((&first["check"], &first["correction"]), (&"a_y_sign".into(), &"sign = -1".into()));
}

fn a_delay_in_the_column_corrects_a_late_channel() {
    let lab = Lab::new();
    let late = std::cell::RefCell::new(std::collections::VecDeque::from([0.0; 3]));
    lab.write(
        "log.csv",
        log(|cells| {
            late.borrow_mut().push_back(cells[4]);
            cells[4] = late.borrow_mut().pop_front().unwrap_or_default();
        }),
    );
    let ended = doctor(&lab, &[]).expect(1);
    assert!(ended.stdout.contains("`a_y` is 3") && ended.stdout.contains("ms"), "{}", ended.stdout);
    let scenario = lab.read("out/doctor.toml");
    let unit = "unit = \"m/s2\"";
    let corrected = scenario.replace(unit, &format!("{unit}, delay = 0.03"));
    let corrected = lab.write("corrected.toml", corrected).display().to_string();
    let again = lab.path("again").display().to_string();
    run(&["run", &corrected, "--rerun", "off", "--out", &again]).expect(0);
}

/// What is wrong with a row of a log.
type Wrong = fn(&mut [f64; 6]);

fn what_is_corrected_is_sound() {
    let lab = Lab::new();
    let again = lab.path("again").display().to_string();
    let titles = ["vx_mps", "delta_rad", "time"];
    let cases: [(&str, [&str; 3], Wrong); 5] = [
        ("unit = \"km/h\"", titles, |cells| cells[1] *= 3.6),
        // The file says a unit itself, which a unit cannot contradict.
        ("gain = 0.277778", ["vx [m/s]", "delta_rad", "time"], |cells| cells[1] *= 3.6),
        ("unit = \"deg\", sign = -1", titles, |cells| cells[5] = -cells[5].to_degrees()),
        // An offset is in the unit of the column.
        ("offset = -0.", ["vx_mps", "delta_deg", "time"], |cells| {
            cells[5] = cells[5].to_degrees() + 0.5;
        }),
        ("time_unit = \"ms\"", titles, |cells| cells[0] *= 1e3),
    ];
    for (line, [v_x, delta, time], wrong) in cases {
        let text = log(wrong).replace("vx_mps", v_x).replace("delta_rad", delta);
        lab.write("log.csv", text.replace("t_s", time));
        doctor(&lab, &[]).expect(1);
        let corrected = lab.read("out/corrected.toml");
        assert!(corrected.contains(line), "{line}: {corrected}");
        let corrected = lab.path("out/corrected.toml").display().to_string();
        run(&["run", &corrected, "--rerun", "off", "--out", &again]).expect(0);
    }
}

fn missing_values_are_seen() {
    let lab = Lab::new();
    let mut row = 0;
    let text: String = log(|_| ()).lines().fold(String::new(), |text, line| {
        row += 1;
        let kept = line.rsplit_once(',').filter(|_| row % 17 == 5 && row > 9);
        text + &kept.map_or(line.to_owned(), |(cells, _)| format!("{cells},")) + "\n"
    });
    lab.write("log.csv", text);
    let ended = doctor(&lab, &[]).expect(1);
    assert!(ended.stdout.contains("rows without a value (5.9 %)"), "{}", ended.stdout);
    assert!(ended.stdout.contains("delta: gaps = \"interpolate\""), "{}", ended.stdout);
}

fn three_rows_are_not_called_right() {
    let lab = Lab::new();
    let text = log(|_| ());
    let few: Vec<&str> = text.lines().take(4).collect();
    lab.write("log.csv", few.join("\n") + "\n");
    let ended = doctor(&lab, &[]).expect(1);
    assert!(ended.stdout.contains("it has 3 rows with values"), "{}", ended.stdout);
    assert!(!ended.stdout.contains("Nothing is wrong"), "{}", ended.stdout);
}

fn an_unknown_column_gets_a_suggestion() {
    let lab = Lab::new();
    lab.write("log.csv", "time,v_x,r\n0,1,0\n1,1,0\n");
    let ended = doctor(&lab, &["--a_y", "v_xx"]).expect(2);
    ended.says(&["unknown column of", "for --a_y", "`v_xx`", "did you mean `v_x`?"]);
}
