//! Chooses the columns of a log: those that the user names, and for the others those with usual titles.

mod ros;

use std::path::Path;

use diagnostics::suggest::{shortened, unknown};
use diagnostics::{Error, Mistakes};
use recording::table::{ColumnTitle, Titles};
use units::Unit;

/// A column of the log.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
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

/// Signals with their units and usual titles, in small letters without signs between them.
const USUAL: [(&str, &str, &[&str]); 16] = [
    ("time", "s", &["t", "time", "timestamp", "elapsedtime", "logtime"]),
    (
        "v_x",
        "m/s",
        &[
            "vx",
            "velocityx",
            "longitudinalvelocity",
            "vlong",
            "vlon",
            "speed",
            "vehiclespeed",
            "gpsspeed",
            "groundspeed",
            "velocity",
            "v",
        ],
    ),
    ("v_y", "m/s", &["vy", "velocityy", "lateralvelocity", "vlat"]),
    ("r", "rad/s", &["r", "yawrate", "omegaz", "wz", "gyroz", "psidot", "omega"]),
    (
        "a_x",
        "m/s2",
        &["ax", "longitudinalacceleration", "along", "longacc", "accx", "accelx", "gforcelong"],
    ),
    (
        "a_y",
        "m/s2",
        &["ay", "lateralacceleration", "alat", "latacc", "accy", "accely", "gforcelat"],
    ),
    (
        "delta",
        "rad",
        &[
            "delta",
            "steer",
            "steering",
            "steeringangle",
            "steerangle",
            "roadwheelangle",
            "steeringwheelangle",
            "swa",
        ],
    ),
    ("F_x", "N", &["fx"]),
    ("omega_fl", "rad/s", &["omegafl", "wheelfl", "wheelspeedfl"]),
    ("omega_fr", "rad/s", &["omegafr", "wheelfr", "wheelspeedfr"]),
    ("omega_rl", "rad/s", &["omegarl", "wheelrl", "wheelspeedrl"]),
    ("omega_rr", "rad/s", &["omegarr", "wheelrr", "wheelspeedrr"]),
    ("roll", "rad", &["roll", "rollangle"]),
    ("course", "rad", &["course", "cog", "courseoverground", "gpscourse", "trackangle"]),
    ("x", "m", &["x", "posx", "positionx", "east", "easting"]),
    ("y", "m", &["y", "posy", "positiony", "north", "northing"]),
];

/// The unit of a signal.
pub fn unit_of_signal(name: &str) -> &'static str {
    USUAL.iter().find(|(of, ..)| *of == name).map_or("", |(_, unit, _)| unit)
}

/// Chooses columns; `given` are signals with what the user wrote for them.
///
/// # Errors
/// When the file has no such column, a unit is none, or time or any signal is missing.
pub fn choose(
    log: &Path,
    titles: &Titles,
    given: &[(&'static str, &Option<String>)],
) -> Result<Vec<Chosen>, Error> {
    let Titles { columns: titles, has_time } = titles;
    let one = |(name, written): &(&'static str, &Option<String>)| match written {
        Some(written) => named(log, titles, name, written).map(Some),
        None => Ok(guessed(titles, name)),
    };
    let chosen: Vec<Chosen> = Mistakes::all(given.iter().map(one))?.into_iter().flatten().collect();
    let names: Vec<&str> = titles.iter().map(|title| title.name.as_str()).collect();
    let there = |name: &str| chosen.iter().any(|it| it.name == name);
    if !has_time && !there("time") {
        return Err(missing(log, "time", &names));
    }
    match chosen.iter().any(|it| it.name != "time") {
        true => Ok(chosen),
        false => Err(missing(log, "v_x", &names)),
    }
}

fn missing(log: &Path, name: &str, titles: &[&str]) -> Error {
    let known = shortened(titles);
    let message = format!("{}: no column has a usual title for `{name}`", log.display());
    Error::input(message).help(format!("name it: --{name} COLUMN; the file has {known}"))
}

/// The column that the user names, as `title` or `title:unit`.
fn named(
    log: &Path,
    titles: &[ColumnTitle],
    name: &'static str,
    written: &str,
) -> Result<Chosen, Error> {
    let is_title = |text: &str| {
        titles.is_empty() || titles.iter().any(|title| title.name == text || title.text == text)
    };
    let (column, unit) = match written.rsplit_once(':') {
        Some((column, unit)) if !is_title(written) || titles.is_empty() => (column, Some(unit)),
        _ => (written, None),
    };
    if !is_title(column) {
        let names = titles.iter().map(|title| title.name.as_str());
        let kind = format!("column of {} for --{name}", log.display());
        return Err(unknown(&kind, column, names).input());
    }
    if let Some(Err(error)) = unit.map(Unit::parse) {
        return Err(Error::input(format!("--{name} {written}: {error}")));
    }
    let recorded = titles.iter().find(|it| it.name == column || it.text == column);
    let stated = recorded.and_then(|title| title.unit.clone());
    let unit = match unit {
        Some(unit) => Some(unit.to_owned()),
        // Of an MCAP recording, only reading it tells.
        None if stated.is_some() || titles.is_empty() => None,
        None => Some(unit_of(column, name)),
    };
    Ok(Chosen { name, column: column.to_owned(), unit, stated, guessed: false })
}

/// The column with the most usual title, unless the file says that it is something else: a wheel in km/h is no angular speed.
fn guessed(titles: &[ColumnTitle], name: &'static str) -> Option<Chosen> {
    let (_, wanted, usual) = USUAL.iter().find(|(of, ..)| *of == name)?;
    let by_title = usual.iter().find_map(|usual| {
        let fits = |title: &&ColumnTitle| {
            bare(&title.name, wanted).0 == *usual || plain(&title.name) == *usual
        };
        titles.iter().find(fits)
    });
    let title = by_title.or_else(|| ros::usual(titles, name))?;
    let other = |unit: &String| !same_dimension(unit, wanted);
    // Accelerations in g, which is a gram elsewhere.
    let gravities = |unit: &String| unit == "g" && *wanted == "m/s2";
    if title.unit.as_ref().is_some_and(|unit| other(unit) && !gravities(unit)) {
        return None;
    }
    let unit = match &title.unit {
        Some(unit) if gravities(unit) => Some("g0".to_owned()),
        Some(_) => None,
        None => Some(unit_of(&title.name, name)),
    };
    let (column, stated) = (title.name.clone(), title.unit.clone());
    Some(Chosen { name, column, unit, stated, guessed: true })
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
    bare(title, usual).1.unwrap_or_else(|| usual.to_owned())
}

/// Small letters and digits alone.
fn plain(title: &str) -> String {
    title.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase()
}

/// The plain title without a unit of the wanted dimension at its end, behind a sign, and that unit.
fn bare(title: &str, wanted: &str) -> (String, Option<String>) {
    let Some((rest, end)) = title.rsplit_once(['_', ' ', '.']) else { return (plain(title), None) };
    let parsed = Unit::parse(end).is_ok().then_some(end);
    let gravities = (end.eq_ignore_ascii_case("g")).then_some("g0");
    let units = [gravities, units::meant(end), parsed].into_iter().flatten();
    match units.into_iter().find(|unit| same_dimension(unit, wanted)) {
        Some(unit) => (plain(rest), Some(unit.to_owned())),
        None => (plain(title), None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn titles(names: &[&str]) -> Titles {
        let title = |name: &&str| ColumnTitle {
            text: (*name).to_owned(),
            name: (*name).to_owned(),
            unit: None,
        };
        Titles { columns: names.iter().map(title).collect(), has_time: false }
    }

    fn all(
        names: &[&str],
        given: &[(&'static str, &Option<String>)],
    ) -> Result<Vec<Chosen>, Error> {
        choose(Path::new("drive.csv"), &titles(names), given)
    }

    #[test]
    fn usual_titles_are_found_with_their_units() {
        let none = None;
        let given = ["time", "v_x", "r", "a_y", "delta"].map(|name| (name, &none));
        let found = all(&["t_s", "vx_kmh", "yaw_rate_degps", "ay_mps2", "delta_rad", "x"], &given);
        let found = found.expect("all are there");
        let of = |it: &Chosen| {
            format!("{} {} {}", it.name, it.column, it.unit.as_deref().unwrap_or("-"))
        };
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
        let titles = Titles { has_time: true, ..titles(&names) };
        let found = choose(Path::new("drive.mcap"), &titles, &given).expect("some are there");
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
        assert!(
            wrong.to_string().contains("unknown column of drive.csv for --v_x `Speed`"),
            "{wrong}"
        );
        let no_time = all(&["Speed"], &given).expect_err("there is no time");
        assert!(
            no_time.to_string().contains("no column has a usual title for `time`"),
            "{no_time}"
        );
    }
}
