//! Reads VBOX `.vbo` files: sections of lines, of which `[data]` has a row in each.
//!
//! The time of day `hhmmss.ss` becomes seconds since midnight, and goes on behind 86400 s when it passes midnight. Latitude and longitude, in
//! minutes with longitude positive to the west, become degrees, positive to the north and the east.

use std::fs::File;
use std::io::{BufRead, BufReader, Seek as _, SeekFrom};
use std::path::Path;

use crate::{
    CHUNK_ROWS, ChannelKind, ChannelValues, ChunkCallback, ClockTime, Error, LogChannel, LogClock, LogReader,
    decode_text, parse_logger_unit,
};

/// Whether a file begins like this: a section of titles within its first lines.
pub fn is_vbo(head: &[u8]) -> bool {
    let lines = head.split(|byte| matches!(byte, b'\n' | b'\r'));
    let sections = ["[header]", "[column names]", "[data]"];
    let is = |line: &[u8]| sections.iter().any(|it| decode_text(line).eq_ignore_ascii_case(it));
    !head.contains(&0) && lines.into_iter().any(is)
}

/// The longest line [B].
const LINE: u64 = 1 << 20;

/// What the numbers of a column are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ColumnMeaning {
    Plain,
    /// Time of day as `hhmmss.ss`.
    Time,
    /// Minutes of an angle, with the sign that makes them positive to the north and the east.
    Minutes(f64),
}

/// A VBOX file.
pub struct VboLog {
    file: BufReader<File>,
    /// The first byte of the rows, and the number of their first line.
    begin: (u64, usize),
    channels: Vec<LogChannel>,
    meanings: Vec<ColumnMeaning>,
    clocks: Vec<LogClock>,
    /// What is odd about the units.
    odd: Option<String>,
    damaged: DamagedLineCounts,
}

/// Lines that are no rows, rows that are written twice, and cells that are no numbers.
#[derive(Clone, Copy, Default)]
struct DamagedLineCounts {
    lines: LineOccurrences,
    repeated: LineOccurrences,
    cells: LineOccurrences,
}

/// How many lines, and which one is the first and the last of them.
#[derive(Clone, Copy, Default)]
struct LineOccurrences {
    count: usize,
    first: usize,
    last: usize,
}

impl LineOccurrences {
    fn count_line(&mut self, line: usize) {
        if self.count == 0 || self.last != line {
            self.count += 1;
        }
        self.last = line;
        self.first = if self.count == 1 { line } else { self.first };
    }

    /// What there is to tell of them, if there are any.
    fn line_warning(self, what: &str) -> Option<String> {
        let LineOccurrences { count, first, .. } = self;
        let lines = if count == 1 { "line" } else { "lines" };
        (count > 0).then(|| format!("{count} {lines} {what}; the first one is line {first}"))
    }
}

/// The sections above the rows.
#[derive(Default)]
struct VboSections {
    titles: Vec<String>,
    /// Lines, of which empty ones are columns without a unit; the last one or more of these may end the section.
    units: Vec<String>,
    names: Vec<String>,
}

impl VboLog {
    /// Reads the sections above the rows.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut file = BufReader::new(File::open(path)?);
        let (mut head, mut section, mut line, mut count) =
            (VboSections::default(), String::new(), Vec::new(), 0);
        while read_next_line(&mut file, &mut line)? {
            count += 1;
            let text = decode_text(line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&line));
            if let Some(name) = text.strip_prefix('[').and_then(|it| it.strip_suffix(']')) {
                section = name.trim().to_ascii_lowercase();
            } else if section == "channel units" {
                head.units.push(text);
            } else if !text.is_empty() {
                match section.as_str() {
                    "header" => head.titles.push(text),
                    "column names" => {
                        head.names.extend(text.split_whitespace().map(str::to_owned));
                    }
                    _ => {}
                }
            }
            if section == "data" {
                break;
            }
        }
        if section != "data" {
            return Err(Error::new("expected a section [data] in the VBOX file, found none"));
        }
        let begin = (file.stream_position()?, count + 1);
        let (channels, meanings, odd) = head.vbo_channels();
        if channels.is_empty() {
            let what = "expected the names of the columns in [column names] or [header]";
            return Err(Error::new(format!("{what} of the VBOX file, found none")));
        }
        let time = meanings.iter().position(|it| *it == ColumnMeaning::Time);
        let time = time.map_or(ClockTime::Unknown, ClockTime::Channel);
        let clocks = vec![LogClock { time, rows: None }];
        let damaged = DamagedLineCounts::default();
        Ok(VboLog { file, begin, channels, meanings, clocks, odd, damaged })
    }
}

/// The next line; false at the end of the file.
fn read_next_line(file: &mut BufReader<File>, line: &mut Vec<u8>) -> Result<bool, Error> {
    line.clear();
    std::io::Read::take(&mut *file, LINE).read_until(b'\n', line)?;
    match line.len() as u64 {
        LINE => Err(Error::new(format!("expected lines below {LINE} bytes, found a longer one"))),
        length => Ok(length > 0),
    }
}

impl VboSections {
    /// The channels, what their numbers are, and what is odd about the units.
    fn vbo_channels(&self) -> (Vec<LogChannel>, Vec<ColumnMeaning>, Option<String>) {
        let paired = self.names.len() == self.titles.len();
        let names = if self.names.is_empty() { &self.titles } else { &self.names };
        let titles = if paired { &self.titles } else { names };
        let known: Vec<_> = names.iter().zip(titles).map(|(name, title)| vbox_column(name, title)).collect();
        let (units, odd) = self.column_units(titles, &known);
        let channel = |(place, name): (usize, &String)| {
            let (meaning, own) = known[place];
            let own = own.flatten().map(str::to_owned);
            let of_file = units[place].and_then(parse_logger_unit);
            // What this reader converts has its own unit.
            let unit = match meaning {
                ColumnMeaning::Plain => title_unit(&titles[place]).map(str::to_owned).or(of_file).or(own),
                _ => own,
            };
            let (name, group) = (name.clone(), String::new());
            (LogChannel { name, group, unit, clock: 0, kind: ChannelKind::Number }, meaning)
        };
        let (channels, meanings) = names.iter().enumerate().map(channel).unzip();
        (channels, meanings, odd)
    }

    /// The entry of [channel units] of each column.
    ///
    /// There is one for each column that is none of VBOX's own, says Racelogic; but some devices list one for `avisynctime`, too, and
    /// others for all columns. Where the number of entries fits none of these, they are those of the last columns, since the columns of
    /// others follow those of VBOX.
    fn column_units(
        &self,
        titles: &[String],
        known: &[(ColumnMeaning, VboColumnUnit)],
    ) -> (Vec<Option<&str>>, Option<String>) {
        let all: Vec<usize> = (0..titles.len()).collect();
        let is_synchronous =
            |it: &usize| ["avisynctime", "avitime"].contains(&normalized_name(&titles[*it]).as_str());
        let is_other = |it: &usize| known[*it].1.is_none() && title_unit(&titles[*it]).is_none();
        let others: Vec<usize> = all.iter().copied().filter(is_other).collect();
        let with_videos = all.iter().copied().filter(|it| is_other(it) || is_synchronous(it));
        let with_videos: Vec<usize> = with_videos.collect();
        let stated = self.units.iter().rposition(|it| !it.is_empty()).map_or(0, |last| last + 1);
        // Of the empty lines at the end, one ends the section.
        let most = self.units.len().saturating_sub(1).max(stated);
        let counts = std::iter::once(most).chain(stated..most);
        let fits = |count: usize| [&others, &with_videos, &all].into_iter().find(|it| it.len() == count);
        let fitting = counts.filter_map(fits).next();
        let last = &all[titles.len().saturating_sub(stated)..];
        let columns = fitting.map_or(last, Vec::as_slice);
        let odd = (fitting.is_none() && stated > 0).then(|| {
            let (expected, columns) = (others.len(), titles.len());
            format!(
                "[channel units] has {stated} entries for {columns} columns, of which {expected} need one: they are taken for \
                 those of the last columns"
            )
        });
        let mut units = vec![None; titles.len()];
        for (place, unit) in columns.iter().zip(&self.units) {
            units[*place] = Some(unit.as_str());
        }
        (units, odd)
    }
}

/// The letters of a name in small ones, with blanks between words.
fn normalized_name(name: &str) -> String {
    name.to_ascii_lowercase().replace(['_', '-'], " ")
}

/// The unit that VBOX itself gives to a column, if it has one; nothing for the columns of others.
type VboColumnUnit = Option<Option<&'static str>>;

/// What VBOX itself means by a column, and its unit; no unit entry at all for the columns of others.
fn vbox_column(name: &str, title: &str) -> (ColumnMeaning, VboColumnUnit) {
    match (normalized_name(name).as_str(), normalized_name(title).as_str()) {
        ("time", _) => (ColumnMeaning::Time, Some(Some("s"))),
        ("lat" | "latitude", _) => (ColumnMeaning::Minutes(1.0), Some(Some("deg"))),
        ("long" | "longitude", _) => (ColumnMeaning::Minutes(-1.0), Some(Some("deg"))),
        ("velocity", _) => (ColumnMeaning::Plain, Some(Some("km/h"))),
        ("heading", _) => (ColumnMeaning::Plain, Some(Some("deg"))),
        ("height", _) => (ColumnMeaning::Plain, Some(Some("m"))),
        ("sats" | "satellites" | "avifileindex" | "solution type", _) => (ColumnMeaning::Plain, Some(None)),
        ("tsample" | "sampleperiod", _) => (ColumnMeaning::Plain, Some(Some("s"))),
        // In ms or in s, which the file does not tell.
        ("avisynctime" | "avitime", _) => (ColumnMeaning::Plain, Some(None)),
        (_, title) if title.starts_with("velocity ") || title.starts_with("vertical velocity") => {
            (ColumnMeaning::Plain, Some(None))
        }
        (_, title) if title.starts_with("trigger event") || title.ends_with("satellites") => {
            (ColumnMeaning::Plain, Some(None))
        }
        _ => (ColumnMeaning::Plain, None),
    }
}

/// The unit at the end of a title such as `velocity kmh`.
fn title_unit(title: &str) -> Option<&'static str> {
    let units = [
        ("kmh", "km/h"),
        ("km/h", "km/h"),
        ("mph", "mph"),
        ("m/s", "m/s"),
        ("m/s2", "m/s2"),
        ("knots", "kn"),
        ("g", "g0"),
        ("deg/s", "deg/s"),
    ];
    let last = title.split_whitespace().next_back()?;
    units.iter().find(|(word, _)| last.eq_ignore_ascii_case(word)).map(|(_, unit)| *unit)
}

/// The seconds since midnight of `hhmmss.ss`.
fn seconds_since_midnight(number: f64) -> Option<f64> {
    let (hours, rest) = ((number / 1e4).floor(), number % 1e4);
    let (minutes, seconds) = ((rest / 100.0).floor(), rest % 100.0);
    let sound = (0.0..24.0).contains(&hours) && minutes < 60.0 && seconds < 61.0;
    // To a tenth of a microsecond, so that the digits are those of the file.
    let round = |it: f64| (it * 1e7).round() / 1e7;
    sound.then(|| round(hours * 3600.0 + minutes * 60.0 + seconds))
}

const DAY: f64 = 86_400.0;

/// The time of day of the rows so far.
struct DayClock {
    /// The days that have passed [s].
    days: f64,
    /// The time of the last row [s].
    last: f64,
}

impl VboLog {
    /// The numbers of a line, or nothing when it is no row.
    fn parse_row(&mut self, line: &str, number_of_line: usize, clock: &mut DayClock) -> Option<Vec<f64>> {
        let mut row = Vec::with_capacity(self.meanings.len());
        for cell in line.split_whitespace() {
            let number: Result<f64, _> = cell.parse().or_else(|_| cell.replacen(',', ".", 1).parse());
            if number.is_err() && !["null", "(null)", "-"].contains(&cell) {
                self.damaged.cells.count_line(number_of_line);
            }
            row.push(number.unwrap_or(f64::NAN));
        }
        if row.len() != self.meanings.len() {
            return None;
        }
        for (value, meaning) in row.iter_mut().zip(&self.meanings) {
            match meaning {
                ColumnMeaning::Plain => {}
                ColumnMeaning::Minutes(sign) => *value *= sign / 60.0,
                ColumnMeaning::Time => {
                    let seconds = seconds_since_midnight(*value)?;
                    if seconds + clock.days < clock.last - DAY / 2.0 {
                        clock.days += DAY;
                    }
                    *value = seconds + clock.days;
                    clock.last = *value;
                }
            }
        }
        Some(row)
    }
}

impl LogReader for VboLog {
    fn channels(&self) -> &[LogChannel] {
        &self.channels
    }

    fn clocks(&self) -> &[LogClock] {
        &self.clocks
    }

    fn read_chunks(&mut self, _clock: usize, wanted: &[usize], take: ChunkCallback) -> Result<(), Error> {
        let (begin, mut number) = self.begin;
        self.file.seek(SeekFrom::Start(begin))?;
        self.damaged = DamagedLineCounts::default();
        let mut clock = DayClock { days: 0.0, last: f64::NEG_INFINITY };
        let mut line = Vec::new();
        let mut previous = String::new();
        let mut stretch: Vec<Vec<f64>> = vec![Vec::new(); wanted.len()];
        let mut flush = |stretch: &mut Vec<Vec<f64>>| {
            let values = stretch.iter_mut().map(|it| ChannelValues::Numbers(std::mem::take(it)));
            take(&values.collect::<Vec<_>>())
        };
        let mut rows = 0;
        while read_next_line(&mut self.file, &mut line)? {
            let text = decode_text(&line);
            if text.starts_with('[') {
                break;
            }
            if text == previous && !text.is_empty() {
                self.damaged.repeated.count_line(number);
                number += 1;
                continue;
            }
            match self.parse_row(&text, number, &mut clock) {
                Some(row) => {
                    let columns = stretch.iter_mut().zip(wanted);
                    columns.for_each(|(column, place)| column.push(row[*place]));
                    rows += 1;
                }
                None if text.is_empty() => {}
                None => self.damaged.lines.count_line(number),
            }
            previous = text;
            number += 1;
            if rows == CHUNK_ROWS {
                rows = 0;
                if !flush(&mut stretch) {
                    return Ok(());
                }
            }
        }
        if rows > 0 {
            flush(&mut stretch);
        }
        Ok(())
    }

    fn skipped_contents(&self) -> Vec<String> {
        Vec::new()
    }

    fn warnings(&self) -> Vec<String> {
        let expected = self.channels.len();
        let lines = format!("left out: expected {expected} numbers and a time of day in each");
        let cells = "with cells that are no numbers, which are gaps";
        let DamagedLineCounts { lines: left_out, repeated, cells: gaps } = self.damaged;
        let repeated = repeated.line_warning("left out: each is like the one before it");
        let damage = [left_out.line_warning(&lines), gaps.line_warning(cells), repeated, self.odd.clone()];
        damage.into_iter().flatten().collect()
    }
}
