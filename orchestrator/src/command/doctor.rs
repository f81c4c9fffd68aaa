//! `trackside doctor`: looks for errors in the log of a drive, and prints the lines that correct them.

mod columns;
mod corrections;
mod titles;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use diagnostics::Error;
use orchestrator::{ReplayOutput, RunContext, RunOptions};
use recording::table;
use serde_json::Value;

use self::columns::ColumnChoice;
use self::corrections::{CorrectedColumn, CorrectedTable, toml_string};
use super::{print_text, print_to_stderr, progress};

/// Arguments of `trackside doctor`. A column is its title, with a unit behind a colon where that of the file is not the one of the
/// signal: `--v_x "Speed:km/h"`.
#[derive(Args)]
pub struct DoctorArguments {
    /// The log: CSV, MDF, MoTeC, VBOX, Parquet, Arrow, MAT or HDF5, a bag of ROS 2; or MCAP with all columns given.
    log: PathBuf,
    #[command(flatten)]
    columns: ColumnArguments,
    #[command(flatten)]
    car: CarArguments,
    /// The folder for the page, the result and the scenario that made them [default: target/runs/doctor].
    #[arg(long)]
    out: Option<PathBuf>,
}

/// The columns of the log. Those that are not given are looked for by usual titles.
#[derive(Args)]
#[allow(non_snake_case, reason = "symbols as in vehicle dynamics")]
struct ColumnArguments {
    /// Time [s].
    #[arg(long, value_name = "COLUMN")]
    time: Option<String>,
    /// Forward velocity [m/s].
    #[arg(long = "v_x", value_name = "COLUMN")]
    v_x: Option<String>,
    /// Velocity to the left [m/s].
    #[arg(long = "v_y", value_name = "COLUMN")]
    v_y: Option<String>,
    /// Yaw rate [rad/s].
    #[arg(long, value_name = "COLUMN")]
    r: Option<String>,
    /// Forward acceleration [m/s2].
    #[arg(long = "a_x", value_name = "COLUMN")]
    a_x: Option<String>,
    /// Acceleration to the left [m/s2].
    #[arg(long = "a_y", value_name = "COLUMN")]
    a_y: Option<String>,
    /// Steering angle of the front wheels [rad].
    #[arg(long, value_name = "COLUMN")]
    delta: Option<String>,
    /// Longitudinal force [N].
    #[arg(long = "F_x", value_name = "COLUMN")]
    F_x: Option<String>,
    /// Speed of the front left wheel [rad/s].
    #[arg(long = "omega_fl", value_name = "COLUMN")]
    omega_fl: Option<String>,
    /// Speed of the front right wheel [rad/s].
    #[arg(long = "omega_fr", value_name = "COLUMN")]
    omega_fr: Option<String>,
    /// Speed of the rear left wheel [rad/s].
    #[arg(long = "omega_rl", value_name = "COLUMN")]
    omega_rl: Option<String>,
    /// Speed of the rear right wheel [rad/s].
    #[arg(long = "omega_rr", value_name = "COLUMN")]
    omega_rr: Option<String>,
    /// Roll angle of the body, road included; positive when its left side is up [rad].
    #[arg(long, value_name = "COLUMN")]
    roll: Option<String>,
    /// Direction of travel over ground, as of GNSS; positive to the left [rad].
    #[arg(long, value_name = "COLUMN")]
    course: Option<String>,
    /// Place on the ground along any axis, as of GNSS [m]; with `y` it stands for the course.
    #[arg(long, value_name = "COLUMN")]
    x: Option<String>,
    /// Place on the ground across that axis, to its left [m].
    #[arg(long, value_name = "COLUMN")]
    y: Option<String>,
}

/// What is known of the car; none of it is needed.
#[derive(Args)]
struct CarArguments {
    /// Distance between the axles [m].
    #[arg(long, value_name = "METRES")]
    wheelbase: Option<f64>,
    /// Distance from the centre of gravity to the front axle [m].
    #[arg(long = "l_f", value_name = "METRES")]
    l_f: Option<f64>,
    /// Distance from the centre of gravity to the rear axle [m].
    #[arg(long = "l_r", value_name = "METRES")]
    l_r: Option<f64>,
    /// Mass [kg].
    #[arg(long, value_name = "KG")]
    mass: Option<f64>,
    /// Drag and downforce as in a file of a car: "{ rho = 1.2, area = 1.5, C_d = 0.9, C_lf = 1.1, C_lr = 1.4 }"; or none.
    #[arg(long, value_name = "TABLE")]
    aero: Option<String>,
}

impl ColumnArguments {
    fn columns_by_signal(&self) -> [(&'static str, &Option<String>); 16] {
        let Self { time, v_x, v_y, r, a_x, a_y, delta, F_x, omega_fl, .. } = self;
        let Self { omega_fr, omega_rl, omega_rr, roll, course, x, y, .. } = self;
        [
            ("time", time),
            ("v_x", v_x),
            ("v_y", v_y),
            ("r", r),
            ("a_x", a_x),
            ("a_y", a_y),
            ("delta", delta),
            ("F_x", F_x),
            ("omega_fl", omega_fl),
            ("omega_fr", omega_fr),
            ("omega_rl", omega_rl),
            ("omega_rr", omega_rr),
            ("roll", roll),
            ("course", course),
            ("x", x),
            ("y", y),
        ]
    }
}

/// Examines the log; exit code 1 when something certain or likely is wrong with it.
///
/// # Errors
/// When the log cannot be read, lacks a column, or the plugin does not build.
pub fn run_doctor_command(arguments: &DoctorArguments) -> Result<u8, Error> {
    let titles =
        table::read_titles(&arguments.log).map_err(|error| Error::invalid_input(error.to_string()))?;
    let chosen = columns::choose_columns(&arguments.log, &titles, &arguments.columns.columns_by_signal())?;
    let out = arguments.out.clone().unwrap_or_else(|| Path::new("target/runs/doctor").into());
    let scenario = out.join("doctor.toml");
    let columns: Vec<CorrectedColumn> =
        chosen.iter().filter(|it| it.name != "time").map(CorrectedColumn::from_choice).collect();
    write_file_in_new_folder(
        &scenario,
        &doctor_scenario_text(arguments, &chosen, &columns, &toml::Table::new())?,
    )?;
    let options = RunOptions { out: Some(out.clone()), replay: ReplayOutput::Off, ..RunOptions::default() };
    let report =
        progress::run_with_progress_bar(&scenario, &options, &mut RunContext::default(), |_, _| ())?.report;
    report.warnings.iter().for_each(|warning| print_to_stderr(&format!("warning: {warning}")));
    let result = &report.analyses[NAME];
    print_text(&format!("the log is read as {}\n{}", titles.format, describe_doctor_result(&chosen, result)));
    let findings = result["doctor"]["findings"].as_array().map_or(&[][..], Vec::as_slice);
    if let Some(CorrectedTable { columns, table }) =
        corrections::apply_corrections_to_table(&chosen, findings)
    {
        let path = out.join("corrected.toml");
        write_file_in_new_folder(&path, &doctor_scenario_text(arguments, &chosen, &columns, &table)?)?;
        let keys = table.iter().map(|(key, value)| format!("{key} = {value}"));
        let lines: Vec<String> = keys.chain(columns.iter().map(CorrectedColumn::toml_line)).collect();
        let (path, lines) = (path.display(), lines.join("\n  "));
        print_text(&format!("\nwith these corrections, to run again: {path}\n  {lines}\n"));
    }
    print_text(&format!("\npage: {}\n", report.folder.join("doctor.html").display()));
    Ok(report.exit_code())
}

fn write_file_in_new_folder(path: &Path, text: &str) -> Result<(), Error> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let write = || {
        std::fs::create_dir_all(folder)?;
        std::fs::write(path, text)
    };
    write().map_err(|error| Error::output_failure(path, error))
}

/// The name of the analysis.
const NAME: &str = "doctor";

/// The scenario that examines the log; `table` are further keys of its table.
///
/// # Errors
/// When the system does not say where the log is.
fn doctor_scenario_text(
    arguments: &DoctorArguments,
    chosen: &[ColumnChoice],
    columns: &[CorrectedColumn],
    table: &toml::Table,
) -> Result<String, Error> {
    let path = std::path::absolute(&arguments.log)
        .map_err(|error| Error::invalid_input(format!("{}: {error}", arguments.log.display())))?;
    let path = toml_string(&path.display().to_string());
    let mut text = format!(
        "title = \"What is wrong with a log\"\n\n[[analysis]]\nname = \"{NAME}\"\ncrate = \"identify\"\n\n[analysis.table]\npath = {path}\n",
    );
    for it in chosen.iter().filter(|it| it.name == "time") {
        // Writing into a string cannot fail.
        let _ = writeln!(text, "time = {}", toml_string(&it.column));
        if let Some(unit) = it.unit.as_deref().filter(|_| !table.contains_key("time_unit")) {
            let _ = writeln!(text, "time_unit = {}", toml_string(unit));
        }
    }
    for (key, value) in table {
        let _ = writeln!(text, "{key} = {value}");
    }
    // What is missing is for the doctor to see.
    text += "gaps = \"drop\"\n\n[analysis.table.columns]\n";
    for it in columns {
        text += &it.toml_line();
        text.push('\n');
    }
    text += "\n[analysis.config]\ntask = \"doctor\"\n";
    let CarArguments { wheelbase, l_f, l_r, mass, aero } = &arguments.car;
    for (key, value) in [("wheelbase", wheelbase), ("l_f", l_f), ("l_r", l_r), ("m", mass)] {
        if let Some(value) = value {
            let _ = writeln!(text, "{key} = {value:?}");
        }
    }
    if let Some(aero) = aero {
        let _ = match aero.starts_with('{') {
            true => writeln!(text, "aero = {aero}"),
            false => writeln!(text, "aero = {}", toml_string(aero)),
        };
    }
    text += "\n[[check]]\nname = \"nothing certain or likely is wrong with the log\"\nthat = \"'nothing' == doctor.verdict\"\n";
    Ok(text)
}

/// What was looked at and what was found, for people.
fn describe_doctor_result(chosen: &[ColumnChoice], result: &Value) -> String {
    let mut lines = String::new();
    for it in chosen {
        let unit = it.unit.as_ref().map(|unit| format!(" [{unit}]")).unwrap_or_default();
        let how = if it.guessed { "  (by its title)" } else { "" };
        let _ = writeln!(lines, "{:8} is column `{}`{unit}{how}", it.name, it.column);
    }
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let all = |key: &str| result["doctor"][key].as_array().cloned().unwrap_or_default();
    let findings = all("findings");
    if findings.is_empty() && result["verdict"] == "nothing" {
        lines += "\nNothing is wrong with the log, as far as can be told.\n";
    }
    for it in findings {
        let _ = writeln!(lines, "\n{:8} {}", text(&it["sure"]), text(&it["sentence"]));
        let _ = writeln!(lines, "         ignored: {}", text(&it["consequence"]));
        let channels = it["channels"].as_array().into_iter().flatten().map(text);
        let channels = channels.collect::<Vec<_>>().join(", ");
        let place = match it["correct_in"].as_str() {
            Some("table") => "the table".to_owned(),
            _ => channels,
        };
        let _ = writeln!(lines, "         {place}: {}", text(&it["correction"]));
        if let Some(note) = it["correction_note"].as_str() {
            let _ = writeln!(lines, "         ({note})");
        }
    }
    if let Some(sentence) = result["doctor"]["understeer"]["sentence"].as_str() {
        let _ = writeln!(lines, "\n{sentence}");
    }
    for it in all("not_told") {
        let [check, reason, advice] = ["check", "reason", "advice"].map(|key| text(&it[key]));
        let _ = writeln!(lines, "\nnot told {check}, as {reason}. {advice}");
    }
    lines
}
