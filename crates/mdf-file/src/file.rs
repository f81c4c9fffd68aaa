//! Opens a file and reads the values of its channels.

use std::io::{Read, Seek};
use std::path::Path;

use crate::bytes::FileByteReader;
use crate::conversion::{PhysicalValue, ValueConversion};
use crate::cursor::{RecordCursor, TextsByChannel, VariableLengthTexts};
use crate::error::Error;
use crate::layout::{
    ChannelGroup, ChannelStorage, ChannelValueKind, FileStructure, MasterAxis, MdfChannel, MdfClock,
    StartTime, ValueLocation, ValueValidity,
};
use crate::structure;
use crate::values::ChannelValues;

/// Rows that are handed over at once, or fewer where records are long.
pub const STRETCH: usize = 1 << 14;
/// Bytes of records that are held at once.
const HELD: usize = 8 << 20;

/// A file that is open.
pub struct MdfFile {
    bytes: FileByteReader,
    structure: FileStructure,
}

/// All rows of some channels of one clock.
#[derive(Clone, Debug, PartialEq)]
pub struct ClockColumns {
    /// Their clock, an index into [`MdfFile::clocks`].
    pub clock: usize,
    /// The master in seconds, radians or metres; the number of the row, from 0 on, where there is none.
    pub times: Vec<f64>,
    /// The channels, indices into [`MdfFile::channels`].
    pub channels: Vec<usize>,
    /// The values of each of them.
    pub values: Vec<ChannelValues>,
}

impl MdfFile {
    /// Opens a file and reads what it says of itself, not its values.
    ///
    /// # Errors
    /// When it cannot be read, is no MDF 2 to 4 or is damaged where it describes its channels.
    pub fn open(path: &Path) -> Result<Self, Error> {
        Self::new(std::fs::File::open(path)?)
    }

    /// Does the same with a file that is open, or in memory.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn new(source: impl Read + Seek + Send + 'static) -> Result<Self, Error> {
        let mut bytes = FileByteReader::new(source)?;
        let mut structure = structure::read_file_structure(&mut bytes)?;
        for clock in &structure.clocks {
            let master = clock.master.map(|it| &structure.channels[it]);
            let Some(unit) = master.and_then(|it| it.unit.as_deref()) else { continue };
            if axis_unit_factor(clock.axis, unit) != 1.0 {
                let note = format!("a master channel is in {unit}, not in the unit of the standard");
                structure.notes.push(note);
            }
        }
        Ok(Self { bytes, structure })
    }

    /// The channels, in the order of the file.
    #[must_use]
    pub fn channels(&self) -> &[MdfChannel] {
        &self.structure.channels
    }

    /// The clocks of the channels.
    #[must_use]
    pub fn clocks(&self) -> &[MdfClock] {
        &self.structure.clocks
    }

    /// The major version of the format: 2, 3 or 4.
    #[must_use]
    pub fn version(&self) -> u16 {
        self.structure.version / 100
    }

    /// When the measurement began, where the file tells it.
    #[must_use]
    pub fn start_time(&self) -> Option<StartTime> {
        self.structure.start
    }

    /// What the file says about itself.
    #[must_use]
    pub fn file_comment(&self) -> Option<&str> {
        self.structure.comment.as_deref()
    }

    /// Oddities and channels that are left out, for people: one sentence each.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.structure.notes
    }

    /// What makes seconds, radians or metres of the values of a clock's master: 1 in files that follow the standard.
    #[must_use]
    pub fn master_factor(&self, clock: usize) -> f64 {
        let Some(clock) = self.clocks().get(clock) else { return 1.0 };
        let unit = clock.master.and_then(|it| self.channels()[it].unit.as_deref());
        unit.map_or(1.0, |unit| axis_unit_factor(clock.axis, unit))
    }

    /// Hands over the rows of some channels, all of one clock, in stretches of at most [`STRETCH`] rows, until `take` is false.
    /// Integers of [`ChannelValueKind::Integer`] come as integers, other numbers as doubles.
    ///
    /// # Errors
    /// When the file is damaged where these channels are, or a channel is not there or has another clock.
    pub fn visit_rows(
        &mut self,
        clock: usize,
        wanted: &[usize],
        take: &mut dyn FnMut(&mut [ChannelValues]) -> bool,
    ) -> Result<(), Error> {
        let Self { bytes, structure } = self;
        if let Some(wrong) =
            wanted.iter().find(|it| structure.channels.get(**it).is_none_or(|it| it.clock != clock))
        {
            return Err(Error::without_offset(format!("expected channels of clock {clock}, found {wrong}")));
        }
        let mut sources = open_group_readers(bytes, structure, wanted)?;
        let longest = sources.iter().map(|it| it.group.record_bytes()).max().unwrap_or(0);
        let most = (HELD / longest.max(1)).clamp(1, STRETCH);
        let mut row = 0;
        loop {
            let mut counts = Vec::new();
            for source in &mut sources {
                counts.push(source.cursor.read_next_records(bytes, most, &mut source.records)?);
            }
            let count = counts.first().copied().unwrap_or(0);
            if counts.iter().any(|it| *it != count) {
                let text = "expected as many rows in all groups of one clock, found fewer in some";
                return Err(Error::without_offset(text));
            }
            if count == 0 {
                return Ok(());
            }
            let mut values = Vec::new();
            for channel in wanted {
                let place = &structure.storages[*channel];
                let kind = structure.channels[*channel].kind;
                let Some(source) = sources.iter_mut().find(|it| it.index == place.group) else {
                    continue;
                };
                values.push(source.read_channel_values(
                    bytes,
                    *channel,
                    place,
                    kind,
                    row..row + count as u64,
                )?);
            }
            row += count as u64;
            if !take(&mut values) {
                return Ok(());
            }
        }
    }

    /// All rows of some channels, with their times: for each clock what there is of it, in the order of `wanted`.
    ///
    /// # Errors
    /// As [`Self::visit_rows`].
    pub fn read_columns(&mut self, wanted: &[usize]) -> Result<Vec<ClockColumns>, Error> {
        let mut all: Vec<ClockColumns> = Vec::new();
        for index in wanted {
            let channel = self.channels().get(*index);
            let channel = channel.ok_or_else(|| Error::without_offset(format!("no channel {index}")))?;
            let (clock, values) = (channel.clock, empty_values(channel.kind));
            let place = all.iter().position(|it| it.clock == clock).unwrap_or_else(|| {
                all.push(ClockColumns { clock, times: vec![], channels: vec![], values: vec![] });
                all.len() - 1
            });
            all[place].channels.push(*index);
            all[place].values.push(values);
        }
        for columns in &mut all {
            let master = self.clocks()[columns.clock].master;
            let factor = self.master_factor(columns.clock);
            let wanted: Vec<_> = columns.channels.iter().copied().chain(master).collect();
            let ClockColumns { times, values, .. } = columns;
            self.visit_rows(columns.clock, &wanted, &mut |stretch| {
                let rows = times.len()..times.len() + stretch.first().map_or(0, ChannelValues::len);
                // The master stands behind the wanted channels.
                match stretch.get(values.len()) {
                    Some(master) => {
                        let time = |row| master.number_at(row).unwrap_or(f64::NAN) * factor;
                        times.extend((0..master.len()).map(time));
                    }
                    None => times.extend(rows.map(|it| it as f64)),
                }
                for (all, more) in values.iter_mut().zip(stretch) {
                    all.append(more);
                }
                true
            })?;
        }
        Ok(all)
    }
}

/// No values of a kind.
fn empty_values(kind: ChannelValueKind) -> ChannelValues {
    match kind {
        ChannelValueKind::Number => ChannelValues::Numbers(Vec::new()),
        ChannelValueKind::Integer => ChannelValues::Integers(Vec::new()),
        ChannelValueKind::Text => ChannelValues::Texts(Vec::new()),
    }
}

/// What makes the unit of the standard of another one.
fn axis_unit_factor(axis: MasterAxis, unit: &str) -> f64 {
    match (axis, unit.trim()) {
        (MasterAxis::Time, "ms") => 1e-3,
        (MasterAxis::Time, "us" | "µs" | "μs") => 1e-6,
        (MasterAxis::Time, "ns") => 1e-9,
        (MasterAxis::Time, "min") => 60.0,
        (MasterAxis::Time, "h") => 3600.0,
        (MasterAxis::Angle, "deg" | "°") => std::f64::consts::PI / 180.0,
        (MasterAxis::Distance, "mm") => 1e-3,
        (MasterAxis::Distance, "km") => 1e3,
        _ => 1.0,
    }
}

/// A group whose records are read.
struct GroupReader {
    index: usize,
    group: ChannelGroup,
    cursor: RecordCursor,
    records: Vec<u8>,
    /// The texts of channels of any length.
    texts: TextsByChannel,
}

/// The groups of the wanted channels.
fn open_group_readers(
    bytes: &mut FileByteReader,
    structure: &FileStructure,
    wanted: &[usize],
) -> Result<Vec<GroupReader>, Error> {
    let mut all: Vec<GroupReader> = Vec::new();
    for channel in wanted {
        let place = &structure.storages[*channel];
        let group = &structure.groups[place.group];
        let at = match all.iter().position(|it| it.index == place.group) {
            Some(at) => at,
            None => {
                let cursor = RecordCursor::open(bytes, group, structure.open_end)?;
                let (index, group) = (place.group, group.clone());
                let (records, texts) = (Vec::new(), TextsByChannel::new());
                all.push(GroupReader { index, group, cursor, records, texts });
                all.len() - 1
            }
        };
        if let ValueLocation::Variable(variable) = &place.store {
            let texts = VariableLengthTexts::open(bytes, variable, group, structure.open_end)?;
            all[at].texts.insert(*channel, texts);
        }
    }
    Ok(all)
}

impl GroupReader {
    /// The values of a channel in the records at hand, which are these rows.
    fn read_channel_values(
        &mut self,
        bytes: &mut FileByteReader,
        channel: usize,
        place: &ChannelStorage,
        kind: ChannelValueKind,
        rows: std::ops::Range<u64>,
    ) -> Result<ChannelValues, Error> {
        let (record, values) = (self.group.record_bytes(), self.group.values);
        let records = &self.records;
        let of = |row: u64| {
            let begin = (row - rows.start) as usize * record;
            &records[begin..begin + record]
        };
        let valid = |record: &[u8]| match place.valid {
            ValueValidity::All => true,
            ValueValidity::None => false,
            ValueValidity::Unless(bit) => record[values + bit as usize / 8] >> (bit % 8) & 1 == 0,
        };
        let conversion = &*place.conversion;
        let mut texts = self.texts.get_mut(&channel);
        Ok(match kind {
            ChannelValueKind::Integer => ChannelValues::Integers(match &place.store {
                ValueLocation::Fixed(field) => {
                    rows.clone().map(|it| valid(of(it)).then(|| field.decode_integer(of(it)))).collect()
                }
                _ => Vec::new(),
            }),
            ChannelValueKind::Number => {
                let mut all = Vec::with_capacity((rows.end - rows.start) as usize);
                for row in rows.clone() {
                    let record = of(row);
                    all.push(match valid(record) {
                        true => read_number_value(bytes, &place.store, conversion, record, row, &mut texts)?,
                        false => f64::NAN,
                    });
                }
                ChannelValues::Numbers(all)
            }
            ChannelValueKind::Text => {
                let mut all = Vec::with_capacity((rows.end - rows.start) as usize);
                for row in rows.clone() {
                    let record = of(row);
                    all.push(match valid(record) {
                        true => {
                            Some(read_text_value(bytes, &place.store, conversion, record, row, &mut texts)?)
                        }
                        false => None,
                    });
                }
                ChannelValues::Texts(all)
            }
        })
    }
}

/// The number of a row.
fn read_number_value(
    bytes: &mut FileByteReader,
    store: &ValueLocation,
    conversion: &ValueConversion,
    record: &[u8],
    row: u64,
    texts: &mut Option<&mut VariableLengthTexts>,
) -> Result<f64, Error> {
    Ok(match store {
        ValueLocation::Fixed(field) if !field.is_text() => match conversion {
            ValueConversion::Identity => field.decode_number(record),
            _ => conversion.convert_to_number(field.decode_number(record), field.is_integer()),
        },
        ValueLocation::Row => conversion.convert_to_number(row as f64, true),
        _ => conversion.text_to_number(&raw_text(bytes, store, record, texts)?),
    })
}

/// The text of a row.
fn read_text_value(
    bytes: &mut FileByteReader,
    store: &ValueLocation,
    conversion: &ValueConversion,
    record: &[u8],
    row: u64,
    texts: &mut Option<&mut VariableLengthTexts>,
) -> Result<String, Error> {
    let physical = match store {
        ValueLocation::Fixed(field) if !field.is_text() => {
            conversion.convert(field.decode_number(record), field.is_integer())
        }
        ValueLocation::Row => conversion.convert(row as f64, true),
        _ => return Ok(conversion.text_to_text(raw_text(bytes, store, record, texts)?)),
    };
    Ok(match physical {
        PhysicalValue::Text(text) => text.into_owned(),
        PhysicalValue::Number(number) => number.to_string(),
    })
}

/// A text before its conversion.
fn raw_text(
    bytes: &mut FileByteReader,
    store: &ValueLocation,
    record: &[u8],
    texts: &mut Option<&mut VariableLengthTexts>,
) -> Result<String, Error> {
    Ok(match (store, texts) {
        (ValueLocation::Fixed(field), _) => field.decode_text(record, usize::MAX),
        (ValueLocation::Bounded(field, size), _) => {
            field.decode_text(record, size.decode_integer(record).clamp(0, u32::MAX.into()) as usize)
        }
        (ValueLocation::Variable(_), Some(texts)) => texts.read_text(bytes, record)?,
        _ => String::new(),
    })
}
