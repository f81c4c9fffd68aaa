//! Chooses the columns of a log: those that the user names, and for the others those with usual titles.

mod ros;

use std::path::Path;

use diagnostics::suggest::{join_shortened, unknown_name};
use diagnostics::{Error, ErrorCollector};
use recording::table::{ColumnTitle, FileTitles};
use units::Unit;

use super::titles::{USUAL, UsualTitles};

/// A column of the log.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnChoice {
    /// The signal, or `time`.
    pub name: &'static str,
    /// The title in the file.
    pub column: String,
    /// Its unit, where the file does not say it.
    pub unit: Option<String>,
    /// The unit that the file says.
    pub stated: Option<String>,
    /// Whether nobody named it.
    pub guessed: bool,
}

/// The unit of a signal.
pub fn unit_of_signal(name: &str) -> &'static str {
    USUAL.iter().find(|it| it.signal == name).map_or("", |it| it.unit)
}

/// Chooses columns; `given` are signals with what the user wrote for them.
///
/// # Errors
/// When the file has no such column, a unit is none, or time or any signal is missing.
pub fn choose_columns(
    log: &Path,
    titles: &FileTitles,
    given: &[(&'static str, &Option<String>)],
) -> Result<Vec<ColumnChoice>, Error> {
    let FileTitles { columns: titles, has_time, .. } = titles;
    let one = |(name, written): &(&'static str, &Option<String>)| match written {
        Some(written) => named_column(log, titles, name, written).map(Some),
        None => Ok(guessed_column(titles, name)),
    };
    let chosen: Vec<ColumnChoice> =
        ErrorCollector::collect_all(given.iter().map(one))?.into_iter().flatten().collect();
    let names: Vec<&str> = titles.iter().map(|title| title.name.as_str()).collect();
    let there = |name: &str| chosen.iter().any(|it| it.name == name);
    if !has_time && !there("time") {
        return Err(missing_column_error(log, "time", &names));
    }
    match chosen.iter().any(|it| it.name != "time") {
        true => Ok(chosen),
        false => Err(missing_column_error(log, "v_x", &names)),
    }
}

fn missing_column_error(log: &Path, name: &str, titles: &[&str]) -> Error {
    let known = join_shortened(titles);
    let message = format!("{}: no column has a usual title for `{name}`", log.display());
    Error::invalid_input(message).with_help(format!("name it: --{name} COLUMN; the file has {known}"))
}

fn is_title_match(title: &ColumnTitle, text: &str) -> bool {
    [&title.name, &title.text, &title.plain].iter().any(|it| *it == text)
}

/// The column that the user names, as `title` or `title:unit`.
fn named_column(
    log: &Path,
    titles: &[ColumnTitle],
    name: &'static str,
    written: &str,
) -> Result<ColumnChoice, Error> {
    let is_title = |text: &str| titles.is_empty() || titles.iter().any(|title| is_title_match(title, text));
    let (column, unit) = match written.rsplit_once(':') {
        Some((column, unit)) if !is_title(written) || titles.is_empty() => (column, Some(unit)),
        _ => (written, None),
    };
    if !is_title(column) {
        let names = titles.iter().map(|title| title.name.as_str());
        let kind = format!("column of {} for --{name}", log.display());
        return Err(unknown_name(&kind, column, names).into_error());
    }
    if let Some(Err(error)) = unit.map(Unit::parse) {
        return Err(Error::invalid_input(format!("--{name} {written}: {error}")));
    }
    let recorded = titles.iter().find(|it| is_title_match(it, column));
    let stated = recorded.and_then(|title| title.unit.clone());
    let unit = match unit {
        Some(unit) => Some(unit.to_owned()),
        // Of an MCAP recording, only reading it tells.
        None if stated.is_some() || titles.is_empty() => None,
        None => Some(unit_of(column, name)),
    };
    Ok(ColumnChoice { name, column: column.to_owned(), unit, stated, guessed: false })
}

/// The column with the most usual title whose unit fits, or which has none: a wheel in km/h is no angular speed, and a steering angle
/// in rpm is none.
fn guessed_column(titles: &[ColumnTitle], name: &'static str) -> Option<ColumnChoice> {
    let UsualTitles { unit: wanted, titles: usual, .. } = USUAL.iter().find(|it| it.signal == name)?;
    let is = |title: &ColumnTitle, usual: &str| {
        split_unit(&title.plain, wanted).0 == usual || normalized_title(&title.plain) == usual
    };
    let fits = |title: &&ColumnTitle| {
        title
            .unit
            .as_ref()
            .is_none_or(|unit| same_dimension(unit, wanted) || is_g_of_acceleration(unit, wanted))
    };
    let by_title =
        usual.iter().find_map(|(usual, _)| titles.iter().filter(|title| is(title, usual)).find(fits));
    let title = by_title.or_else(|| ros::usual_ros_column(titles, name).filter(fits))?;
    let unit = match &title.unit {
        Some(unit) if is_g_of_acceleration(unit, wanted) => Some("g0".to_owned()),
        Some(_) => None,
        None => Some(unit_of(&title.plain, name)),
    };
    let (column, stated) = (title.name.clone(), title.unit.clone());
    Some(ColumnChoice { name, column, unit, stated, guessed: true })
}

/// Whether `g` means an acceleration, which is a gram elsewhere.
fn is_g_of_acceleration(unit: &str, wanted: &str) -> bool {
    unit == "g" && wanted == "m/s2"
}

fn same_dimension(a: &str, b: &str) -> bool {
    match [a, b].map(|unit| Unit::parse(unit).ok()) {
        [Some(a), Some(b)] => a.same_dimension(&b),
        // A unit that is not known here: the reader says more.
        _ => true,
    }
}

/// The unit that the end of a title says, or else that of the signal.
fn unit_of(title: &str, name: &str) -> String {
    let usual = unit_of_signal(name);
    split_unit(title, usual).1.unwrap_or_else(|| usual.to_owned())
}

/// Small letters and digits alone.
fn normalized_title(title: &str) -> String {
    title.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase()
}

/// The plain title without a unit of the wanted dimension at its end, behind a sign, and that unit.
fn split_unit(title: &str, wanted: &str) -> (String, Option<String>) {
    let Some((rest, end)) = title.rsplit_once(['_', ' ', '.']) else {
        return (normalized_title(title), None);
    };
    let parsed = Unit::parse(end).is_ok().then_some(end);
    let gravities = (end.eq_ignore_ascii_case("g")).then_some("g0");
    let units = [gravities, units::unit_for_spelling(end), parsed].into_iter().flatten();
    match units.into_iter().find(|unit| same_dimension(unit, wanted)) {
        Some(unit) => (normalized_title(rest), Some(unit.to_owned())),
        None => (normalized_title(title), None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn titles(names: &[&str]) -> FileTitles {
        // `title [unit]`, or a title alone.
        let title = |name: &&str| {
            let parts = name.strip_suffix(']').and_then(|it| it.split_once(" ["));
            let (plain, unit) = parts.map_or((*name, None), |(plain, unit)| (plain, Some(unit)));
            let [text, plain, name] = [name, plain, plain].map(str::to_owned);
            ColumnTitle { text, plain, name, unit: unit.map(str::to_owned) }
        };
        let (columns, format) = (names.iter().map(title).collect(), "CSV".to_owned());
        FileTitles { columns, has_time: false, format }
    }

    fn all(names: &[&str], given: &[(&'static str, &Option<String>)]) -> Result<Vec<ColumnChoice>, Error> {
        choose_columns(Path::new("drive.csv"), &titles(names), given)
    }

    #[test]
    fn usual_titles_are_found_with_their_units() {
        let none = None;
        let given = ["time", "v_x", "r", "a_y", "delta"].map(|name| (name, &none));
        let found = all(&["t_s", "vx_kmh", "yaw_rate_degps", "ay_mps2", "delta_rad", "x"], &given);
        let found = found.expect("all are there");
        let of =
            |it: &ColumnChoice| format!("{} {} {}", it.name, it.column, it.unit.as_deref().unwrap_or("-"));
        let found: Vec<String> = found.iter().map(of).collect();
        assert_eq!(
            found,
            [
                "time t_s s",
                "v_x vx_kmh km/h",
                "r yaw_rate_degps deg/s",
                "a_y ay_mps2 m/s2",
                "delta delta_rad rad"
            ]
        );
    }

    #[test]
    fn of_several_usual_titles_the_one_whose_unit_fits_is_taken() {
        let none = None;
        let given = ["time", "v_x", "r", "a_y", "delta"].map(|name| (name, &none));
        for (titles, expected) in [
            (
                // VBOX with the CAN of a car.
                &[
                    "time [s]",
                    "velocity [km/h]",
                    "Vehicle_Speed [%]",
                    "Steering_Angle [rpm]",
                    "Yaw_Rate [deg/s]",
                ][..],
                "time, velocity, Yaw_Rate",
            ),
            (
                &["timestamp [s]", "speed [m/s]", "lateral_acc [g0]", "rate_of_rotation_z [deg/s]"],
                "timestamp, speed, rate_of_rotation_z, lateral_acc",
            ),
            (
                &[
                    "Time [s]",
                    "Ground Speed [km/h]",
                    "G Force Lat [g0]",
                    "Gyro Yaw Velocity [deg/s]",
                    "Steering Wheel Angle [deg]",
                ],
                "Time, Ground Speed, Gyro Yaw Velocity, G Force Lat, Steering Wheel Angle",
            ),
            (
                &["Time [s]", "GPS Speed [mph]", "LateralAcc [g0]", "Steering Pos [V]", "SteerAngle [deg]"],
                "Time, GPS Speed, LateralAcc, SteerAngle",
            ),
        ] {
            let found = all(titles, &given).expect("some are there");
            let columns: Vec<&str> = found.iter().map(|it| it.column.as_str()).collect();
            assert_eq!(columns.join(", "), expected);
        }
    }

    #[test]
    fn fields_of_ros_are_found_where_one_topic_has_them() {
        let none = None;
        let given = ["time", "v_x", "r", "a_y", "delta"].map(|name| (name, &none));
        let names = [
            "/odom.pose.pose.position.x",
            "/odom.twist.twist.linear.x",
            "/imu/data.angular_velocity.z",
            "/imu/data.linear_acceleration.y",
            "/other/imu.linear_acceleration.y",
            "/vehicle/status/steering_status.steering_tire_angle",
            "/control/command.lateral.steering_tire_angle",
        ];
        let titles = FileTitles { has_time: true, ..titles(&names) };
        let found = choose_columns(Path::new("drive.mcap"), &titles, &given).expect("some are there");
        let found: Vec<_> = found.iter().map(|it| (it.name, it.column.as_str())).collect();
        assert_eq!(found, [("v_x", names[1]), ("r", names[2]), ("delta", names[5])]);
    }

    #[test]
    fn what_the_user_names_must_be_there() {
        let (column, none) = (Some("Speed:km/h".to_owned()), None);
        let given = [("time", &none), ("v_x", &column)];
        let found = all(&["time", "Speed"], &given).expect("both are there");
        assert_eq!((found[1].column.as_str(), found[1].unit.as_deref()), ("Speed", Some("km/h")));
        let wrong = all(&["time", "Sped"], &given).expect_err("there is no such column");
        assert!(wrong.to_string().contains("unknown column of drive.csv for --v_x `Speed`"), "{wrong}");
        let no_time = all(&["Speed"], &given).expect_err("there is no time");
        assert!(no_time.to_string().contains("no column has a usual title for `time`"), "{no_time}");
    }
}
