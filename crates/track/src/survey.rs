//! Reads tables of the points of a centre line, as track databases and loggers write them.

use std::fmt::Write as _;

use crate::{Error, LocalPlane};

/// Points of a line as they stand in a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrackSurvey {
    /// Positions [m].
    pub points: Vec<[f64; 2]>,
    /// Whether the first point follows the last one.
    pub closed: bool,
    /// Distances from the line to the left and the right edge [m], for each point.
    pub widths: Option<Vec<[f64; 2]>>,
    /// Bank angle [rad], for each point; positive where the left side is higher.
    pub bank: Option<Vec<f64>>,
    /// Height [m], for each point.
    pub height: Option<Vec<f64>>,
    /// Grade [rad], for each point; positive uphill. It goes before the heights.
    pub grade: Option<Vec<f64>>,
    /// Speed of somebody who drove or planned the line [m/s], for each point; NaN where the table has no number.
    pub speed: Option<Vec<f64>>,
    /// Where on the Earth the origin is, with x to the east and y to the north.
    pub plane: Option<LocalPlane>,
}

/// What a column is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ColumnMeaning {
    X,
    Y,
    Z,
    Left,
    Right,
    Width,
    HalfWidth,
    Bank,
    Grade,
    Speed,
}

/// Spellings of the columns, without their units.
const NAMES: [(ColumnMeaning, &[&str]); 10] = [
    (ColumnMeaning::X, &["x", "x_ref", "east", "easting", "pos_x", "center_x", "x_center"]),
    (ColumnMeaning::Y, &["y", "y_ref", "north", "northing", "pos_y", "center_y", "y_center"]),
    (ColumnMeaning::Z, &["z", "height", "elevation", "altitude"]),
    (ColumnMeaning::Left, &["left", "w_left", "w_tr_left", "width_left", "left_width"]),
    (ColumnMeaning::Right, &["right", "w_right", "w_tr_right", "width_right", "right_width"]),
    (ColumnMeaning::Width, &["width", "w"]),
    (ColumnMeaning::HalfWidth, &["half_width"]),
    (ColumnMeaning::Bank, &["bank", "banking", "cross_slope"]),
    (ColumnMeaning::Grade, &["grade", "slope", "gradient"]),
    (ColumnMeaning::Speed, &["v_x", "vx", "v", "speed", "velocity"]),
];

/// How the numbers of a column become SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ColumnScale {
    Factor(f64),
    /// A slope in percent becomes an angle.
    Percent,
}

impl ColumnScale {
    fn to_si(self, value: f64) -> f64 {
        match self {
            ColumnScale::Factor(factor) => factor * value,
            ColumnScale::Percent => (0.01 * value).atan(),
        }
    }
}

/// Ends of names that are units.
const UNITS: [(&str, ColumnScale); 12] = [
    ("_m/s", ColumnScale::Factor(1.0)),
    ("_mps", ColumnScale::Factor(1.0)),
    ("_km/h", ColumnScale::Factor(1.0 / 3.6)),
    ("_kmh", ColumnScale::Factor(1.0 / 3.6)),
    ("_kph", ColumnScale::Factor(1.0 / 3.6)),
    ("_m", ColumnScale::Factor(1.0)),
    ("_km", ColumnScale::Factor(1e3)),
    ("_rad", ColumnScale::Factor(1.0)),
    ("_deg", ColumnScale::Factor(std::f64::consts::PI / 180.0)),
    ("_percent", ColumnScale::Percent),
    ("_pct", ColumnScale::Percent),
    ("_%", ColumnScale::Percent),
];

/// A column that means something here.
#[derive(Debug, Clone, Copy)]
struct SurveyColumn {
    meaning: ColumnMeaning,
    scale: ColumnScale,
}

/// Two consecutive points closer than this are one [m].
const SAME: f64 = 1e-3;

/// A line without a word about it is closed when the way from its last point to the first one is at most this often as
/// long as the median way between two points.
const CLOSING_GAP: f64 = 2.0;

impl TrackSurvey {
    /// Reads a table: a row for each point, with fields between commas, semicolons, tabs or blanks.
    ///
    /// Columns are named by a first row, which may be a comment: `x`, `y`, and, where known, `left` and `right` (or
    /// `width`, `half_width`), `bank`, `grade`, `z`, `v_x`, each also with a unit (`x_m`, `bank [deg]`, `grade_percent`,
    /// `vx_mps`) and as public track databases spell them (`w_tr_left_m`). Other columns are skipped. Without names there
    /// are two columns, x and y. Comments start with `#` or `//`; the comments `# closed` and `# open` say how the line
    /// ends. Without one it is closed when the way from the last point to the first is at most twice the median way
    /// between two points. A comment `# origin 43.8 -88.0` has the latitude and longitude [deg] of the origin.
    ///
    /// # Errors
    /// With the line of the text: columns that are missing or there twice, fields that are no numbers, points that repeat
    /// the one before, widths below zero; fewer than four points.
    pub fn from_table_text(text: &str) -> Result<Self, Error> {
        let mut rows = SurveyReader::default();
        for (number, line) in text.lines().enumerate() {
            rows.read_line(number + 1, line.trim().trim_start_matches('\u{feff}'))?;
        }
        rows.into_survey()
    }

    /// The points with widths, bank and height as a table that [`Self::from_table_text`] reads, to a tenth of a millimetre.
    #[must_use]
    pub fn table_text(&self) -> String {
        let mut text = format!("# {}\n", if self.closed { "closed" } else { "open" });
        if let Some(plane) = &self.plane {
            text += &plane.comment();
        }
        text += "x_m,y_m";
        text += if self.widths.is_some() { ",left_m,right_m" } else { "" };
        text += if self.height.is_some() { ",z_m" } else { "" };
        text += if self.bank.is_some() { ",bank_rad" } else { "" };
        for (i, [x, y]) in self.points.iter().enumerate() {
            let _ = write!(text, "\n{x:.4},{y:.4}");
            if let Some(widths) = &self.widths {
                let [left, right] = widths[i];
                let _ = write!(text, ",{left:.3},{right:.3}");
            }
            if let Some(height) = &self.height {
                let _ = write!(text, ",{:.4}", height[i]);
            }
            if let Some(bank) = &self.bank {
                let _ = write!(text, ",{:.5}", bank[i]);
            }
        }
        text + "\n"
    }
}

/// What was read so far.
#[derive(Default)]
struct SurveyReader {
    columns: Option<Vec<Option<SurveyColumn>>>,
    /// Names, as written.
    header: Vec<String>,
    closed: Option<bool>,
    survey: TrackSurvey,
    /// Line of the last point.
    last: usize,
}

impl SurveyReader {
    fn read_line(&mut self, number: usize, line: &str) -> Result<(), Error> {
        let wrong = |message: String| Error::Line { line: number, message };
        let comment = line.strip_prefix('#').or_else(|| line.strip_prefix("//"));
        if let Some(comment) = comment {
            let words = comment.trim().to_lowercase();
            if let Some(plane) = LocalPlane::parse(&words) {
                self.survey.plane = Some(plane);
                return Ok(());
            }
            match words.as_str() {
                "closed" => self.closed = Some(true),
                "open" => self.closed = Some(false),
                _ if !self.survey.points.is_empty() => {}
                _ => {
                    let names = split_on_separator_or_whitespace(comment);
                    let columns: Vec<_> = names.iter().map(|it| parse_column_name(it)).collect();
                    if has_column(&columns, ColumnMeaning::X) && has_column(&columns, ColumnMeaning::Y) {
                        self.set_columns(columns, names).map_err(wrong)?;
                    }
                }
            }
            return Ok(());
        }
        let found = split_on_separator_or_whitespace(line);
        if found.is_empty() {
            return Ok(());
        }
        let first = self.survey.points.is_empty();
        if first && found.iter().all(|it| it.parse::<f64>().is_err()) {
            let columns: Vec<_> = found.iter().map(|it| parse_column_name(it)).collect();
            return self.set_columns(columns, found).map_err(wrong);
        }
        if self.columns.is_none() {
            if found.len() != 2 {
                let count = found.len();
                return Err(wrong(format!(
                    "expected x and y, found {count} numbers; name the columns in a first row, such as x, y, left, right"
                )));
            }
            let columns = ["x", "y"].map(parse_column_name).to_vec();
            self.set_columns(columns, vec!["x".to_owned(), "y".to_owned()]).map_err(wrong)?;
        }
        self.push_point(number, &found)
    }

    fn set_columns(&mut self, columns: Vec<Option<SurveyColumn>>, names: Vec<String>) -> Result<(), String> {
        let count = |of| columns.iter().flatten().filter(|it: &&SurveyColumn| it.meaning == of).count();
        for (meaning, spellings) in NAMES {
            let (name, found) = (spellings[0], count(meaning));
            // A log has speeds of several sensors: the first one counts.
            if found > 1 && meaning != ColumnMeaning::Speed {
                return Err(format!("expected one column `{name}`, found {found} in {names:?}"));
            }
            if found == 0 && matches!(meaning, ColumnMeaning::X | ColumnMeaning::Y) {
                return Err(format!("expected a column `{name}`, found {names:?}"));
            }
        }
        if count(ColumnMeaning::Left) != count(ColumnMeaning::Right) {
            return Err("expected `left` and `right`, found one of them".to_owned());
        }
        if count(ColumnMeaning::Left) + count(ColumnMeaning::Width) + count(ColumnMeaning::HalfWidth) > 1 {
            return Err("expected `left` and `right`, `width` or `half_width`, found more".to_owned());
        }
        (self.columns, self.header) = (Some(columns), names);
        Ok(())
    }

    fn push_point(&mut self, number: usize, found: &[String]) -> Result<(), Error> {
        let wrong = |message: String| Error::Line { line: number, message };
        let columns = self.columns.as_deref().unwrap_or_default();
        if found.len() < columns.len() {
            let (wanted, count) = (columns.len(), found.len());
            return Err(wrong(format!("expected {wanted} numbers, found {count}")));
        }
        let mut values = [None; NAMES.len()];
        for ((field, column), name) in found.iter().zip(columns).zip(&self.header) {
            let Some(SurveyColumn { meaning, scale }) = column else { continue };
            let number = field.parse::<f64>().ok().filter(|it| it.is_finite());
            if *meaning == ColumnMeaning::Speed {
                values[*meaning as usize].get_or_insert(number.map_or(f64::NAN, |it| scale.to_si(it)));
                continue;
            }
            let number = number
                .ok_or_else(|| wrong(format!("expected a number in column `{name}`, found `{field}`")))?;
            values[*meaning as usize] = Some(scale.to_si(number));
        }
        let of = |meaning: ColumnMeaning| values[meaning as usize];
        let point = [ColumnMeaning::X, ColumnMeaning::Y].map(|it| of(it).unwrap_or_default());
        let sides = of(ColumnMeaning::Left).zip(of(ColumnMeaning::Right)).map(|(left, right)| [left, right]);
        let half = of(ColumnMeaning::HalfWidth).or(of(ColumnMeaning::Width).map(|width| 0.5 * width));
        let widths = sides.or(half.map(|half| [half; 2]));
        if let Some([left, right]) = widths.filter(|it| it.iter().any(|it| *it < 0.0)) {
            let message = format!("expected widths of at least 0 m, found {left} and {right} m");
            return Err(wrong(message));
        }
        let survey = &mut self.survey;
        if survey.points.last().is_some_and(|last| point_distance(*last, point) < SAME) {
            let last = self.last;
            return Err(wrong(format!("expected another point than that of line {last}")));
        }
        survey.points.push(point);
        self.last = number;
        let keep = |list: &mut Option<Vec<f64>>, value: Option<f64>| {
            if let Some(value) = value {
                list.get_or_insert_default().push(value);
            }
        };
        keep(&mut survey.bank, of(ColumnMeaning::Bank));
        keep(&mut survey.grade, of(ColumnMeaning::Grade));
        keep(&mut survey.height, of(ColumnMeaning::Z));
        keep(&mut survey.speed, of(ColumnMeaning::Speed));
        if let Some(widths) = widths {
            survey.widths.get_or_insert_default().push(widths);
        }
        Ok(())
    }

    fn into_survey(self) -> Result<TrackSurvey, Error> {
        let mut survey = self.survey;
        let ends = survey.points.first().copied().zip(survey.points.last().copied());
        let gap = ends.map_or(0.0, |(first, last)| point_distance(first, last));
        let ways = survey.points.windows(2).map(|it| point_distance(it[0], it[1]));
        let mut ways: Vec<f64> = ways.collect();
        ways.sort_unstable_by(f64::total_cmp);
        let median = ways.get(ways.len() / 2).copied().unwrap_or_default();
        survey.closed = self.closed.unwrap_or(gap <= CLOSING_GAP * median);
        if survey.closed && gap < SAME {
            // The file repeats its first point as the last one.
            survey.points.pop();
            survey.widths.as_mut().map(Vec::pop);
            for list in [&mut survey.bank, &mut survey.grade, &mut survey.height, &mut survey.speed] {
                list.as_mut().map(Vec::pop);
            }
        }
        let count = survey.points.len();
        if count < 4 {
            return Err(Error::Table(format!("expected at least 4 points of a line, found {count}")));
        }
        Ok(survey)
    }
}

/// Parts of a row.
fn split_on_separator_or_whitespace(line: &str) -> Vec<String> {
    let separated = line.contains([',', ';', '\t']);
    let split: Vec<&str> = match separated {
        true => line.split([',', ';', '\t']).collect(),
        false => line.split_whitespace().collect(),
    };
    let mut fields: Vec<String> = split.iter().map(|it| it.trim().trim_matches('"').to_owned()).collect();
    // A separator at the end of the row starts no field.
    if fields.last().is_some_and(String::is_empty) {
        fields.pop();
    }
    fields
}

/// What a name means.
fn parse_column_name(name: &str) -> Option<SurveyColumn> {
    let name = name.trim().to_lowercase();
    let plain = name.replace(['[', '('], "_").replace([']', ')', ' '], "").replace("__", "_");
    let unit = UNITS.iter().find_map(|(end, scale)| Some((plain.strip_suffix(end)?, *scale)));
    let (plain, scale) = unit.unwrap_or((&plain, ColumnScale::Factor(1.0)));
    let meaning = NAMES.iter().find(|(_, spellings)| spellings.contains(&plain))?.0;
    Some(SurveyColumn { meaning, scale })
}

fn has_column(columns: &[Option<SurveyColumn>], meaning: ColumnMeaning) -> bool {
    columns.iter().flatten().any(|it| it.meaning == meaning)
}

/// Distance of two points [m].
#[must_use]
pub fn point_distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests;
