//! Reads VBOX `.vbo` files: sections of lines, of which `[data]` has a row in each.
//!
//! The time of day `hhmmss.ss` becomes seconds since midnight, and goes on behind 86400 s when it passes midnight. Latitude and longitude, in
//! minutes with longitude positive to the west, become degrees, positive to the north and the east.

use std::fs::File;
use std::io::{BufRead, BufReader, Seek as _, SeekFrom};
use std::path::Path;

use crate::{Channel, Clock, Error, Kind, STRETCH, Source, Take, Time, Values, text, unit};

/// Whether a file begins like this: a section of titles within its first lines.
pub fn is(head: &[u8]) -> bool {
    let lines = head.split(|byte| matches!(byte, b'\n' | b'\r'));
    let sections = ["[header]", "[column names]", "[data]"];
    let is = |line: &[u8]| sections.iter().any(|it| text(line).eq_ignore_ascii_case(it));
    !head.contains(&0) && lines.into_iter().any(is)
}

/// The longest line [B].
const LINE: u64 = 1 << 20;

/// What the numbers of a column are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Meaning {
    Plain,
    /// Time of day as `hhmmss.ss`.
    Time,
    /// Minutes of an angle, with the sign that makes them positive to the north and the east.
    Minutes(f64),
}

/// A VBOX file.
pub struct Vbo {
    file: BufReader<File>,
    /// The first byte of the rows, and the number of their first line.
    begin: (u64, usize),
    channels: Vec<Channel>,
    meanings: Vec<Meaning>,
    clocks: Vec<Clock>,
    damaged: Damaged,
}

/// Lines that are no rows, and cells that are no numbers.
#[derive(Clone, Copy, Default)]
struct Damaged {
    lines: Lines,
    cells: Lines,
}

/// How many lines, and which one is the first and the last of them.
#[derive(Clone, Copy, Default)]
struct Lines {
    count: usize,
    first: usize,
    last: usize,
}

impl Lines {
    fn add(&mut self, line: usize) {
        if self.count == 0 || self.last != line {
            self.count += 1;
        }
        self.last = line;
        self.first = if self.count == 1 { line } else { self.first };
    }

    /// What there is to tell of them, if there are any.
    fn told(self, what: &str) -> Option<String> {
        let Lines { count, first, .. } = self;
        let lines = if count == 1 { "line" } else { "lines" };
        (count > 0).then(|| format!("{count} {lines} {what}; the first one is line {first}"))
    }
}

/// The sections above the rows.
#[derive(Default)]
struct Head {
    titles: Vec<String>,
    units: Vec<String>,
    names: Vec<String>,
}

impl Vbo {
    /// Reads the sections above the rows.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut file = BufReader::new(File::open(path)?);
        let (mut head, mut section, mut line, mut count) =
            (Head::default(), String::new(), Vec::new(), 0);
        while next(&mut file, &mut line)? {
            count += 1;
            let text = text(line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&line));
            if let Some(name) = text.strip_prefix('[').and_then(|it| it.strip_suffix(']')) {
                section = name.trim().to_ascii_lowercase();
            } else if !text.is_empty() {
                match section.as_str() {
                    "header" => head.titles.push(text),
                    "channel units" => head.units.push(text),
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
        let (channels, meanings) = head.channels();
        if channels.is_empty() {
            let what = "expected the names of the columns in [column names] or [header]";
            return Err(Error::new(format!("{what} of the VBOX file, found none")));
        }
        let time = meanings.iter().position(|it| *it == Meaning::Time);
        let time = time.map_or(Time::Unknown, Time::Channel);
        let clocks = vec![Clock { time, rows: None }];
        Ok(Vbo { file, begin, channels, meanings, clocks, damaged: Damaged::default() })
    }
}

/// The next line; false at the end of the file.
fn next(file: &mut BufReader<File>, line: &mut Vec<u8>) -> Result<bool, Error> {
    line.clear();
    std::io::Read::take(&mut *file, LINE).read_until(b'\n', line)?;
    match line.len() as u64 {
        LINE => Err(Error::new(format!("expected lines below {LINE} bytes, found a longer one"))),
        length => Ok(length > 0),
    }
}

impl Head {
    fn channels(&self) -> (Vec<Channel>, Vec<Meaning>) {
        let paired = self.names.len() == self.titles.len();
        let names = if self.names.is_empty() { &self.titles } else { &self.names };
        // Units of all columns, or of those that VBOX does not have itself.
        let all = self.units.len() == names.len();
        let mut others = self.units.iter();
        let channel = |(place, name): (usize, &String)| {
            let title = if paired { &self.titles[place] } else { name };
            let (meaning, own) = known(name, title);
            let of_file = match all {
                true => unit(&self.units[place]),
                false if own.is_none() => others.next().and_then(|it| unit(it)),
                false => None,
            };
            // What this reader converts has its own unit.
            let own = own.flatten().map(str::to_owned);
            let unit = match meaning {
                Meaning::Plain => title_unit(title).map(str::to_owned).or(of_file).or(own),
                _ => own,
            };
            let (name, group) = (name.clone(), String::new());
            (Channel { name, group, unit, clock: 0, kind: Kind::Number }, meaning)
        };
        names.iter().enumerate().map(channel).unzip()
    }
}

/// What VBOX itself means by a column, and its unit; no unit entry at all for the columns of others.
fn known(name: &str, title: &str) -> (Meaning, Option<Option<&'static str>>) {
    let word = |it: &str| it.to_ascii_lowercase().replace(['_', '-'], " ");
    match (word(name).as_str(), word(title).as_str()) {
        ("time", _) => (Meaning::Time, Some(Some("s"))),
        ("lat" | "latitude", _) => (Meaning::Minutes(1.0), Some(Some("deg"))),
        ("long" | "longitude", _) => (Meaning::Minutes(-1.0), Some(Some("deg"))),
        ("velocity", _) => (Meaning::Plain, Some(Some("km/h"))),
        ("heading", _) => (Meaning::Plain, Some(Some("deg"))),
        ("height", _) => (Meaning::Plain, Some(Some("m"))),
        ("sats" | "satellites" | "avifileindex" | "solution type", _) => {
            (Meaning::Plain, Some(None))
        }
        ("tsample" | "sampleperiod", _) => (Meaning::Plain, Some(Some("s"))),
        // In ms or in s, which the file does not tell.
        ("avisynctime" | "avitime", _) => (Meaning::Plain, Some(None)),
        (_, title) if title.starts_with("velocity ") || title.starts_with("vertical velocity") => {
            (Meaning::Plain, Some(None))
        }
        _ => (Meaning::Plain, None),
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
    ];
    let last = title.split_whitespace().next_back()?;
    units.iter().find(|(word, _)| last.eq_ignore_ascii_case(word)).map(|(_, unit)| *unit)
}

/// The seconds since midnight of `hhmmss.ss`.
fn seconds(number: f64) -> Option<f64> {
    let (hours, rest) = ((number / 1e4).floor(), number % 1e4);
    let (minutes, seconds) = ((rest / 100.0).floor(), rest % 100.0);
    let sound = (0.0..24.0).contains(&hours) && minutes < 60.0 && seconds < 61.0;
    // To a tenth of a microsecond, so that the digits are those of the file.
    let round = |it: f64| (it * 1e7).round() / 1e7;
    sound.then(|| round(hours * 3600.0 + minutes * 60.0 + seconds))
}

const DAY: f64 = 86_400.0;

impl Vbo {
    /// The numbers of a line, or nothing when it is no row.
    fn row(
        &mut self,
        line: &str,
        number_of_line: usize,
        clock: &mut (f64, f64),
    ) -> Option<Vec<f64>> {
        let mut row = Vec::with_capacity(self.meanings.len());
        for cell in line.split_whitespace() {
            let number: Result<f64, _> =
                cell.parse().or_else(|_| cell.replacen(',', ".", 1).parse());
            if number.is_err() && !["null", "(null)", "-"].contains(&cell) {
                self.damaged.cells.add(number_of_line);
            }
            row.push(number.unwrap_or(f64::NAN));
        }
        if row.len() != self.meanings.len() {
            return None;
        }
        for (value, meaning) in row.iter_mut().zip(&self.meanings) {
            match meaning {
                Meaning::Plain => {}
                Meaning::Minutes(sign) => *value *= sign / 60.0,
                Meaning::Time => {
                    let (days, last) = clock;
                    let seconds = seconds(*value)?;
                    if seconds + *days < *last - DAY / 2.0 {
                        *days += DAY;
                    }
                    *value = seconds + *days;
                    *last = *value;
                }
            }
        }
        Some(row)
    }
}

impl Source for Vbo {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn clocks(&self) -> &[Clock] {
        &self.clocks
    }

    fn visit(&mut self, _clock: usize, wanted: &[usize], take: Take) -> Result<(), Error> {
        let (begin, mut number) = self.begin;
        self.file.seek(SeekFrom::Start(begin))?;
        self.damaged = Damaged::default();
        let (mut clock, mut line) = ((0.0, f64::NEG_INFINITY), Vec::new());
        let mut stretch: Vec<Vec<f64>> = vec![Vec::new(); wanted.len()];
        let mut flush = |stretch: &mut Vec<Vec<f64>>| {
            let values = stretch.iter_mut().map(|it| Values::Numbers(std::mem::take(it)));
            take(&values.collect::<Vec<_>>())
        };
        let mut rows = 0;
        while next(&mut self.file, &mut line)? {
            let text = text(&line);
            if text.starts_with('[') {
                break;
            }
            match self.row(&text, number, &mut clock) {
                Some(row) => {
                    let columns = stretch.iter_mut().zip(wanted);
                    columns.for_each(|(column, place)| column.push(row[*place]));
                    rows += 1;
                }
                None if text.is_empty() => {}
                None => self.damaged.lines.add(number),
            }
            number += 1;
            if rows == STRETCH {
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

    fn left_out(&self) -> Vec<String> {
        Vec::new()
    }

    fn warnings(&self) -> Vec<String> {
        let expected = self.channels.len();
        let lines = format!("left out: expected {expected} numbers and a time of day in each");
        let cells = "with cells that are no numbers, which are gaps";
        let Damaged { lines: left_out, cells: gaps } = self.damaged;
        left_out.told(&lines).into_iter().chain(gaps.told(cells)).collect()
    }
}
