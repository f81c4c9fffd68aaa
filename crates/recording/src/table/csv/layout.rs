//! Detects the layout of a CSV file: lines of titles, units and rows.

use super::explanation::{has_only_units, is_sensor_line, is_types, is_units};
use super::line::{CsvLine, count_requested_titles, split_into_lines};
use super::profile::{HeaderLine, LoggerProfile, detect_logger_profile};
use super::region::NumericRegion;
use crate::table::read_request::{CsvDialect, Separator, UnitRow};
use crate::table::title::{ParsedTitle, parse_title_unit, unit_in_cell};

/// Where titles, units and rows stand.
#[derive(Debug)]
pub(super) struct CsvLayout {
    pub separator: Separator,
    pub profile: Option<&'static LoggerProfile>,
    pub titles: Vec<ParsedTitle>,
    /// The units of the line of units.
    pub units: Vec<Option<String>>,
    /// The sensors of the columns.
    pub sources: Vec<String>,
    /// The first byte of the rows.
    pub rows_begin: usize,
    /// Whether there are numbers where the titles should be.
    pub is_numbers: bool,
    /// The numbers of the lines.
    pub titles_line: usize,
    pub units_line: Option<usize>,
    pub sources_line: Option<usize>,
    /// Lines between titles and rows that are none of these.
    pub left_out: Vec<usize>,
}

/// The layout of a file that begins like this; nothing of an empty one.
///
/// The titles are in the line that the dialect says. Without one they are in the line that is followed by rows of numbers, or in
/// another one that has more of the wanted titles.
pub(super) fn detect_csv_layout(head: &[u8], wanted: &[&str], dialect: &CsvDialect) -> Option<CsvLayout> {
    let lines = split_into_lines(head);
    let all = [&Separator::ALL[..], &[Separator::Blank]].concat();
    let separators = dialect.separator.map_or(all, |separator| vec![separator]);
    let region = widest_numeric_region(&lines, &separators);
    let regular = region.as_ref().map(|it| (it.titles, it.separator));
    let said = dialect.title_row.and_then(|row| lines.iter().position(|it| it.number == row));
    let place = match (said, regular) {
        (Some(said), regular) => {
            (said, regular.map_or_else(|| widest_cell_split(&lines[said..=said], &separators).1, |it| it.1))
        }
        (None, None) => line_with_most_titles(&lines, &separators, wanted, 0)
            .or_else(|| (!lines.is_empty()).then(|| first_widest_line(&lines, &separators)))?,
        (None, Some(regular)) => {
            let found = count_requested_titles(&lines[regular.0].parse_titles(regular.1), wanted);
            line_with_most_titles(&lines, &separators, wanted, found).unwrap_or(regular)
        }
    };
    let mut layout = CsvLayout::from_title_line(&lines, place.0, place.1, wanted);
    layout.profile = detect_logger_profile(head);
    let region = region.filter(|it| it.separator == place.1);
    layout.read_lines_below_titles(&lines[place.0..], region.as_ref(), dialect.unit_row);
    Some(layout)
}

/// The rows with the most columns of numbers. Blanks separate only where nothing else does: there are blanks in titles.
fn widest_numeric_region(lines: &[CsvLine], separators: &[Separator]) -> Option<NumericRegion> {
    let (blank, signs): (Vec<_>, Vec<_>) = separators.iter().partition(|it| **it == Separator::Blank);
    let best = |separators: Vec<Separator>| {
        let regions = separators.into_iter().filter_map(|it| NumericRegion::detect(lines, it));
        regions
            .reduce(|best, it| if it.number_column_count() > best.number_column_count() { it } else { best })
    };
    best(signs).or_else(|| best(blank))
}

/// The first of the lines with the most wanted titles, if these are more than so many.
fn line_with_most_titles(
    lines: &[CsvLine],
    separators: &[Separator],
    wanted: &[&str],
    more_than: usize,
) -> Option<(usize, Separator)> {
    let mut best = None;
    let mut most = more_than;
    for (place, line) in lines.iter().enumerate() {
        for separator in separators {
            let found = count_requested_titles(&line.parse_titles(*separator), wanted);
            if found > most {
                (best, most) = (Some((place, *separator)), found);
            }
        }
    }
    best
}

/// The first of the widest lines without comments, or with them where there are no others.
fn first_widest_line(lines: &[CsvLine], separators: &[Separator]) -> (usize, Separator) {
    let rows: Vec<usize> = (0..lines.len()).filter(|it| !lines[*it].is_comment()).collect();
    let all: Vec<usize> = (0..lines.len()).collect();
    let places = if rows.is_empty() { all } else { rows };
    let signs: Vec<Separator> = separators.iter().copied().filter(|it| *it != Separator::Blank).collect();
    let signs = if signs.is_empty() { separators } else { &signs };
    let wide = |place: usize| {
        let (width, separator) = widest_cell_split(&lines[place..=place], signs);
        (width, (place, separator))
    };
    let widths = places.into_iter().map(wide);
    let best = widths.reduce(|best, it| if it.0 > best.0 { it } else { best });
    best.map_or((0, Separator::Comma), |(_, place)| place)
}

/// The most cells of a line, and the separator that makes them.
fn widest_cell_split(line: &[CsvLine], separators: &[Separator]) -> (usize, Separator) {
    let cells = |it: &Separator| (line.first().map_or(0, |line| line.split_cells(*it).len()), *it);
    let each = separators.iter().map(cells);
    let best = each.reduce(|best, it| if it.0 > best.0 { it } else { best });
    best.unwrap_or((0, Separator::Comma))
}

impl CsvLayout {
    /// With the titles of a line, and rows below it.
    fn from_title_line(lines: &[CsvLine], place: usize, separator: Separator, wanted: &[&str]) -> Self {
        let line = &lines[place];
        let titles = line.parse_titles(separator);
        let mut cells = titles.iter().map(|it| it.text.trim());
        // Numbers between blanks are one cell where nothing makes columns of them.
        let is_number = |cell: &str| cell.split_whitespace().all(|it| it.parse::<f64>().is_ok());
        // Titles may be numbers, if these are wanted.
        let is_numbers = count_requested_titles(&titles, wanted) == 0 && cells.all(is_number);
        CsvLayout {
            separator,
            profile: None,
            units: Vec::new(),
            sources: Vec::new(),
            rows_begin: line.end,
            is_numbers,
            titles_line: line.number,
            units_line: None,
            sources_line: None,
            left_out: Vec::new(),
            titles,
        }
    }

    /// Takes the lines between the titles and the rows.
    fn read_lines_below_titles(
        &mut self,
        from: &[CsvLine],
        region: Option<&NumericRegion>,
        said: Option<UnitRow>,
    ) {
        let Some((titles, below)) = from.split_first() else { return };
        let cells = below.iter().map(|line| (line, line.split_cells(self.separator)));
        // Below titles in a comment, units may be in one.
        let counts = |(line, cells): &(&CsvLine, Vec<String>)| {
            !line.is_comment() || (titles.is_comment() && is_units(cells))
        };
        let lines: Vec<(&CsvLine, Vec<String>)> = cells.filter(counts).collect();
        let rows = match region {
            Some(region) => lines.iter().position(|(_, cells)| region.is_row(cells)),
            None => lines.iter().position(|(_, cells)| !has_only_units(cells)).map(|it| it.min(1)),
        };
        let mut rows = rows.unwrap_or_else(|| lines.len().min(usize::from(region.is_none())));
        let said_units = match said {
            Some(UnitRow::Line(number)) => lines.iter().position(|it| it.0.number == number),
            Some(UnitRow::Below(true)) => Some(0),
            _ => None,
        };
        rows = rows.max(said_units.map_or(0, |it| (it + 1).min(lines.len())));
        let known = self.profile.map_or(&[][..], |it| it.below);
        let known = if known.len() == rows { known } else { &[] };
        for (place, (line, cells)) in lines[..rows].iter().enumerate() {
            let may_be_units = said.is_none() && self.units_line.is_none();
            let kind = match known.get(place) {
                _ if said_units == Some(place) => Some(HeaderLine::Units),
                Some(HeaderLine::Units) if said.is_some() => None,
                Some(kind) => Some(*kind),
                None if may_be_units && is_units(cells) => Some(HeaderLine::Units),
                None if self.sources_line.is_none() && is_sensor_line(cells) => Some(HeaderLine::Sources),
                None => is_types(cells).then_some(HeaderLine::Types),
            };
            match kind {
                Some(HeaderLine::Units) => self.set_column_units(line.number, cells),
                Some(HeaderLine::Sources) => {
                    self.sources = cells.iter().map(|it| it.trim().to_owned()).collect();
                    self.sources_line = Some(line.number);
                }
                Some(HeaderLine::Types) => {}
                None => self.left_out.push(line.number),
            }
        }
        if let Some((line, _)) = lines.get(rows) {
            self.rows_begin = line.begin;
        } else if let Some((line, _)) = lines[..rows].last() {
            self.rows_begin = line.end;
        }
    }

    fn set_column_units(&mut self, number: usize, cells: &[String]) {
        self.units_line = Some(number);
        let titles = self.titles.iter().map(|it| it.plain.as_str()).chain(std::iter::repeat(""));
        let of = |(cell, title): (&String, &str)| {
            let word = unit_in_cell(cell)?;
            Some(parse_title_unit(word, title).unwrap_or_else(|| word.to_owned()))
        };
        self.units = cells.iter().zip(titles).map(of).collect();
    }

    /// As which format it is read, and what stands in which line.
    pub fn describe_layout(&self) -> String {
        let name = self.profile.map_or("CSV", |it| it.name);
        let lines = [("units", self.units_line), ("sources", self.sources_line)];
        let mut text = format!("titles in line {}", self.titles_line);
        for (what, line) in lines {
            text += &line.map_or_else(String::new, |line| format!(", {what} in line {line}"));
        }
        match (self.profile, self.titles_line, self.units_line) {
            (None, 1, None) => name.to_owned(),
            _ => format!("{name}: {text}"),
        }
    }
}
