//! Makes channels of the arrays of a MAT file: vectors, columns of matrices, and what Simulink saves (`.time` and `.signals.values`, `.Time`
//! and `.Data`).
//!
//! Arrays beside a `time` or `t` of the same struct and length have it as their time. All others of one length share a clock, that of such an
//! array outside of structs where there is one of this length.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use mat_file::{LIMIT, MatFile, MatValue, NumericArray};

use crate::{
    CHUNK_ROWS, ChannelKind, ChannelValues, ChunkCallback, ClockTime, Error, LogChannel, LogClock, LogReader,
};

/// A MAT file.
pub struct MatLog {
    channels: Vec<LogChannel>,
    clocks: Vec<LogClock>,
    arrays: Vec<Vec<f64>>,
    columns: Vec<ArrayColumn>,
    left_out: Vec<String>,
}

/// Where the values of a channel are.
#[derive(Clone, Copy)]
struct ArrayColumn {
    array: usize,
    first: usize,
    stride: usize,
}

/// A struct that has a time: its name, and the channel and the length of that.
type StructTimes = BTreeMap<String, (usize, usize)>;

impl MatLog {
    /// Reads the file.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let mut bytes = Vec::new();
        File::open(path)?.take(LIMIT as u64 + 1).read_to_end(&mut bytes)?;
        if bytes.len() > LIMIT {
            let what = "expected a MAT file of at most";
            let cure = "save fewer variables, or write Parquet";
            return Err(Error::new(format!("{what} {LIMIT} bytes, found a larger one: {cure}")));
        }
        let found = mat_file::read_mat_file(&bytes).map_err(|error| Error::new(error.to_string()))?;
        drop(bytes);
        let left_out = |(name, why): &(String, String)| format!("`{name}` is left out: {why}");
        let left_out = found.skipped.iter().filter(|it| !it.0.is_empty()).map(left_out).collect();
        let mut mat = MatLog { channels: vec![], clocks: vec![], arrays: vec![], columns: vec![], left_out };
        let timed = mat.add_time_channels(&found);
        mat.add_value_channels(&found, &timed);
        match mat.channels.is_empty() {
            false => {
                mat.take_arrays(found);
                Ok(mat)
            }
            true => {
                let what = "expected arrays of two or more numbers in the MAT file, found none";
                Err(Error::new(what))
            }
        }
    }

    /// Adds the channels of time.
    fn add_time_channels(&mut self, found: &MatFile) -> StructTimes {
        let mut timed = StructTimes::new();
        for (index, variable) in found.variables.iter().enumerate() {
            let MatValue::Numbers(array) = &variable.value else { continue };
            let (base, leaf) = split_struct_name(&variable.name);
            let is_time = ["time", "t"].contains(&leaf.to_ascii_lowercase().as_str());
            if !is_time || !array.is_vector() || array.values.len() < 2 || timed.contains_key(base) {
                continue;
            }
            let (channel, rows) = (self.channels.len(), array.values.len());
            let unit = find_unit(found, &variable.name, base);
            let clock = self.clocks.len();
            let column = ArrayColumn { array: index, first: 0, stride: 1 };
            self.add_channel(leaf, base, unit, column, clock);
            let rows_told = u64::try_from(rows).ok();
            self.clocks.push(LogClock { time: ClockTime::Channel(channel), rows: rows_told });
            timed.insert(base.to_owned(), (channel, rows));
        }
        timed
    }

    fn add_value_channels(&mut self, found: &MatFile, timed: &StructTimes) {
        let mut untimed: BTreeMap<usize, usize> = BTreeMap::new();
        for (index, variable) in found.variables.iter().enumerate() {
            let MatValue::Numbers(array) = &variable.value else { continue };
            let (base, leaf) = split_struct_name(&variable.name);
            let time = timed.get(base);
            if array.values.len() < 2
                || time.is_some_and(|it| self.channels[it.0].name == leaf && array.is_vector())
            {
                continue;
            }
            // Outside of structs, a time is that of all of its length.
            let top = timed.get("");
            let own = |rows: usize| time.or(top).filter(|it| it.1 == rows);
            let Some((rows, first)) =
                row_count_and_axis(array, [time, top].into_iter().flatten().map(|it| it.1))
            else {
                continue;
            };
            let clock = match own(rows).or(top.filter(|it| it.1 == rows)) {
                Some((time, _)) => self.channels[*time].clock,
                None => *untimed.entry(rows).or_insert_with(|| {
                    self.clocks.push(LogClock { time: ClockTime::Unknown, rows: rows.try_into().ok() });
                    self.clocks.len() - 1
                }),
            };
            let (name, group) = channel_name(found, &variable.name, time.is_some());
            let unit = find_unit(found, &variable.name, base);
            let count = array.values.len() / rows;
            for k in 0..count {
                let name = if count == 1 { name.clone() } else { format!("{name}[{}]", k + 1) };
                let (first, stride) = if first { (k * rows, 1) } else { (k, count) };
                let column = ArrayColumn { array: index, first, stride };
                self.add_channel(&name, &group, unit.clone(), column, clock);
            }
        }
    }

    fn add_channel(
        &mut self,
        name: &str,
        group: &str,
        unit: Option<String>,
        column: ArrayColumn,
        clock: usize,
    ) {
        let (name, group) = (name.to_owned(), group.to_owned());
        self.channels.push(LogChannel { name, group, unit, clock, kind: ChannelKind::Number });
        self.columns.push(column);
    }

    /// Takes the numbers.
    fn take_arrays(&mut self, found: MatFile) {
        let numbers = |value| match value {
            MatValue::Numbers(array) => array.values,
            MatValue::Texts(_) => Vec::new(),
        };
        self.arrays = found.variables.into_iter().map(|it| numbers(it.value)).collect();
    }
}

/// The struct that an array stands in, and its own name; that of Simulink's signals is the one that has the time.
fn split_struct_name(name: &str) -> (&str, &str) {
    let signals = name.find(".signals.").or_else(|| name.find(".signals("));
    let (base, leaf) = match signals {
        Some(at) => (&name[..at], &name[at + 1..]),
        None => name.rsplit_once('.').unwrap_or(("", name)),
    };
    (base, leaf)
}

/// The number of rows of an array, and whether they are its first dimension: that of a time where one fits.
fn row_count_and_axis(array: &NumericArray, times: impl Iterator<Item = usize>) -> Option<(usize, bool)> {
    let (count, shape) = (array.values.len(), &array.shape);
    if array.is_vector() {
        return Some((count, true));
    }
    let (first, last) = (*shape.first()?, *shape.last()?);
    for rows in times {
        if rows == first || rows == last {
            return Some((rows, rows == first));
        }
    }
    (first > 1).then_some((first, true))
}

/// The name and the group of a channel: what Simulink calls `x.Data` or `x.signals.values` is `x`, or has the name of its label.
fn channel_name(found: &MatFile, name: &str, timed: bool) -> (String, String) {
    let (base, leaf) = split_struct_name(name);
    let outer = || {
        let (group, name) = base.rsplit_once('.').unwrap_or(("", base));
        (name.to_owned(), group.to_owned())
    };
    let of_signals = leaf.starts_with("signals").then(|| leaf.strip_suffix(".values")).flatten();
    if let Some(signals) = of_signals {
        let label = found.text_rows(&format!("{base}.{signals}.label")).and_then(|it| it.first());
        return match label.filter(|it| !it.trim().is_empty()) {
            Some(label) => (label.trim().to_owned(), base.to_owned()),
            None if signals == "signals" => outer(),
            None => (signals.to_owned(), base.to_owned()),
        };
    }
    match timed && leaf == "Data" && !base.is_empty() {
        true => outer(),
        false => (leaf.to_owned(), base.to_owned()),
    }
}

/// The unit that stands beside an array.
fn find_unit(found: &MatFile, name: &str, base: &str) -> Option<String> {
    let (beside, leaf) = name.rsplit_once('.').unwrap_or(("", name));
    let mut places = vec![format!("{name}_unit"), format!("{name}_units")];
    if ["Data", "values"].contains(&leaf) {
        places.extend(["unit", "units", "Unit", "Units"].map(|it| format!("{beside}.{it}")));
        places.push(format!("{base}.DataInfo.Units"));
    }
    let text = places.iter().find_map(|place| found.text_rows(place)?.first());
    text.and_then(|text| crate::parse_logger_unit(text))
}

impl LogReader for MatLog {
    fn channels(&self) -> &[LogChannel] {
        &self.channels
    }

    fn clocks(&self) -> &[LogClock] {
        &self.clocks
    }

    fn read_chunks(&mut self, clock: usize, wanted: &[usize], take: ChunkCallback) -> Result<(), Error> {
        let rows = self.clocks[clock].rows.and_then(|it| it.try_into().ok()).unwrap_or(0);
        for begin in (0..rows).step_by(CHUNK_ROWS) {
            let end = rows.min(begin + CHUNK_ROWS);
            let values = |channel: &usize| {
                let ArrayColumn { array, first, stride } = self.columns[*channel];
                let array = &self.arrays[array];
                let value = |row| array.get(first + row * stride).copied().unwrap_or(f64::NAN);
                ChannelValues::Numbers((begin..end).map(value).collect())
            };
            if !take(&wanted.iter().map(values).collect::<Vec<_>>()) {
                break;
            }
        }
        Ok(())
    }

    fn skipped_contents(&self) -> Vec<String> {
        self.left_out.clone()
    }

    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }
}
