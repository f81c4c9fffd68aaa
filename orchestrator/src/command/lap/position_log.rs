//! Reads the positions of a log or a recorded run, in metres or in degrees of latitude and longitude.

use std::path::{Path, PathBuf};

use cosim::quantity::convert_quantity;
use diagnostics::Error;
use lap::PositionSample;
use recording::table::{
    ColumnRequest, CsvDialect, FileTitles, GapRule, ReadRequest, TableError, TimeSeriesTable,
    check_columns_exist, read_titles,
};
use track::LocalPlane;

/// Columns of a position that need no mention.
const POSITIONS: [[&str; 2]; 3] = [["plant.X", "plant.Y"], ["X", "Y"], ["x", "y"]];
/// Columns of a time that need no mention.
const TIMES: [&str; 4] = ["t", "time", "Time", "timestamp"];
/// How columns of a latitude are called, in small letters without anything but letters.
const LATITUDES: [&str; 4] = ["latitude", "lat", "gpslatitude", "gpslat"];
/// How columns of a longitude are called.
const LONGITUDES: [&str; 8] =
    ["longitude", "long", "lon", "lng", "gpslongitude", "gpslong", "gpslon", "gpslng"];

/// Which columns of a log are read.
pub struct PositionColumns<'a> {
    /// Those of the position, with a comma in between, if they are told.
    pub position: Option<&'a str>,
    /// That of the time, if it is told.
    pub time: Option<&'a str>,
    /// The options that tell them.
    pub options: [&'static str; 2],
}

/// Positions of a log.
pub struct PositionLog {
    /// Its file.
    pub path: PathBuf,
    /// The positions, in the order of the log.
    pub samples: Vec<PositionSample>,
    /// The plane of the positions, of a log in degrees.
    pub plane: Option<LocalPlane>,
}

impl PositionLog {
    /// Reads a log, or `run.mcap` of the folder of a run. Degrees become positions on the plane, or on that of the first one.
    ///
    /// # Errors
    /// When it cannot be read or has no such columns.
    pub fn read(path: &Path, columns: &PositionColumns, plane: Option<LocalPlane>) -> Result<Self, Error> {
        let path = if path.is_dir() { path.join("run.mcap") } else { path.to_owned() };
        let titles = read_titles(&path).map_err(table_error)?;
        let names = columns.position_columns(&path, &titles)?;
        let time = columns.time_column(&path, &titles)?;
        let column = |column: String| ColumnRequest {
            name: column.clone(),
            column,
            gaps: GapRule::Drop,
            ..ColumnRequest::default()
        };
        let request =
            ReadRequest { time, columns: names.clone().map(column).to_vec(), ..ReadRequest::default() };
        let mut table = TimeSeriesTable::read(&path, &request).map_err(table_error)?;
        let has_degrees =
            |column| table.column_unit(column).is_some_and(|unit| unit.eq_ignore_ascii_case("deg"));
        let are_degrees = (has_degrees(0) && has_degrees(1)) || are_coordinates(&names);
        let unit = if are_degrees { "deg" } else { "m" };
        let factors = [unit_factor(&path, &table, 0, unit)?, unit_factor(&path, &table, 1, unit)?];
        let times = table.clock_times().swap_remove(table.column_clock(0));
        let sample = |t: f64| PositionSample {
            t,
            position: [0, 1].map(|axis| factors[axis] * table.value_at(axis, t)),
        };
        let mut samples: Vec<PositionSample> = times.into_iter().map(sample).collect();
        if !are_degrees {
            return Ok(PositionLog { path, samples, plane: None });
        }
        // Receivers without a position write zero.
        samples.retain(|sample| is_on_the_earth(sample.position) && sample.position != [0.0; 2]);
        let plane = plane.or_else(|| {
            let [latitude, longitude] = samples.first()?.position;
            Some(LocalPlane { latitude, longitude })
        });
        for sample in &mut samples {
            let [latitude, longitude] = sample.position;
            sample.position = plane.map_or([0.0; 2], |plane| plane.position(latitude, longitude));
        }
        Ok(PositionLog { path, samples, plane })
    }
}

impl PositionColumns<'_> {
    fn position_columns(&self, path: &Path, titles: &FileTitles) -> Result<[String; 2], Error> {
        let option = self.options[0];
        if let Some(told) = self.position {
            let parts: Vec<&str> = told.split(',').map(str::trim).collect();
            let [first, second] = parts[..] else {
                let message = format!("{option} {told}: expected two columns with a comma in between");
                return Err(Error::invalid_input(message));
            };
            // Some say longitude and latitude, as x and y.
            let names = [first, second].map(str::to_owned);
            let swapped = [second, first].map(str::to_owned);
            return Ok(if are_coordinates(&swapped) { swapped } else { names });
        }
        for names in POSITIONS {
            let found = check_columns_exist(path, &names, &CsvDialect::default());
            if found.map_err(table_error)?.iter().all(Result::is_ok) {
                return Ok(names.map(str::to_owned));
            }
        }
        let find = |known: &[&str]| titles.columns.iter().find(|title| is_called(&title.name, known));
        if let Some((latitude, longitude)) = find(&LATITUDES).zip(find(&LONGITUDES)) {
            return Ok([latitude.name.clone(), longitude.name.clone()]);
        }
        let known = POSITIONS.map(|names| names.join(" and ")).join(", ");
        let message = format!("{}: expected columns {known}, or latitude and longitude", path.display());
        Err(Error::invalid_input(message).with_help(format!(
            "tell the columns of the position: {option} X,Y or {option} LATITUDE,LONGITUDE"
        )))
    }

    fn time_column(&self, path: &Path, titles: &FileTitles) -> Result<Option<String>, Error> {
        let is_there = |name: &&&str| titles.columns.iter().any(|title| title.name == **name);
        let found = || TIMES.iter().find(is_there).map(|name| (*name).to_owned());
        // Of a recording of ours, only reading it tells its columns; it has times of its own.
        let needs_one = !titles.has_time && !titles.columns.is_empty();
        match self.time.map(str::to_owned).or_else(|| needs_one.then(found).flatten()) {
            None if needs_one => {
                let message = format!("{}: expected a time in a column {}", path.display(), TIMES.join(", "));
                let help = format!("tell the column of the time: {} COLUMN", self.options[1]);
                Err(Error::invalid_input(message).with_help(help))
            }
            time => Ok(time),
        }
    }
}

fn is_called(name: &str, known: &[&str]) -> bool {
    known.contains(&letters(name).as_str())
}

/// Whether columns that are told are a latitude and a longitude by their names, such as `GPS_Lat` and `lon_deg`.
fn are_coordinates([latitude, longitude]: &[String; 2]) -> bool {
    let [latitude, longitude] = [letters(latitude), letters(longitude)];
    let is_direction = latitude.contains("lateral") || longitude.contains("longitudinal");
    !is_direction && latitude.contains("lat") && (longitude.contains("lon") || longitude.contains("lng"))
}

fn letters(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphabetic).map(|letter| letter.to_ascii_lowercase()).collect()
}

fn is_on_the_earth([latitude, longitude]: [f64; 2]) -> bool {
    latitude.abs() <= 90.0 && longitude.abs() <= 360.0
}

/// What makes this unit of a column.
fn unit_factor(path: &Path, table: &TimeSeriesTable, column: usize, unit: &str) -> Result<f64, Error> {
    let Some(found) = table.column_unit(column) else { return Ok(1.0) };
    convert_quantity(1.0, found, Some(unit), None, false).map_err(|error| {
        let name = table.column_names().nth(column).unwrap_or_default().to_owned();
        Error::invalid_input(format!("{}: column {name}: {error}", path.display()))
    })
}

fn table_error(error: TableError) -> Error {
    Error::invalid_input(error.to_string())
}
