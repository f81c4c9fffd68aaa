//! Opens a file and reads the values of its channels.

use std::io::{Read, Seek};
use std::path::Path;

use crate::bytes::Bytes;
use crate::conversion::{Conversion, Physical};
use crate::cursor::{AllTexts, Cursor, Texts};
use crate::error::Error;
use crate::layout::{
    Axis, Channel, ChannelStorage, Clock, Group, Kind, Start, Store, Structure, Validity,
};
use crate::structure;
use crate::values::Values;

/// Rows that are handed over at once, or fewer where records are long.
pub const STRETCH: usize = 1 << 14;
/// Bytes of records that are held at once.
const HELD: usize = 8 << 20;

/// A file that is open.
pub struct File {
    bytes: Bytes,
    structure: Structure,
}

/// All rows of some channels of one clock.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// Their clock, an index into [`File::clocks`].
    pub clock: usize,
    /// The master in seconds, radians or metres; the number of the row, from 0 on, where there is none.
    pub times: Vec<f64>,
    /// The channels, indices into [`File::channels`].
    pub channels: Vec<usize>,
    /// The values of each of them.
    pub values: Vec<Values>,
}

impl File {
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
        let mut bytes = Bytes::new(source)?;
        let mut structure = structure::read(&mut bytes)?;
        for clock in &structure.clocks {
            let master = clock.master.map(|it| &structure.channels[it]);
            let Some(unit) = master.and_then(|it| it.unit.as_deref()) else { continue };
            if factor(clock.axis, unit) != 1.0 {
                let note =
                    format!("a master channel is in {unit}, not in the unit of the standard");
                structure.notes.push(note);
            }
        }
        Ok(Self { bytes, structure })
    }

    /// The channels, in the order of the file.
    #[must_use]
    pub fn channels(&self) -> &[Channel] {
        &self.structure.channels
    }

    /// The clocks of the channels.
    #[must_use]
    pub fn clocks(&self) -> &[Clock] {
        &self.structure.clocks
    }

    /// The major version of the format: 2, 3 or 4.
    #[must_use]
    pub fn version(&self) -> u16 {
        self.structure.version / 100
    }

    /// When the measurement began, where the file tells it.
    #[must_use]
    pub fn start(&self) -> Option<Start> {
        self.structure.start
    }

    /// What the file says about itself.
    #[must_use]
    pub fn comment(&self) -> Option<&str> {
        self.structure.comment.as_deref()
    }

    /// Oddities and channels that are left out, for people: one sentence each.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.structure.notes
    }

    /// What makes seconds, radians or metres of the values of a clock's master: 1 in files that follow the standard.
    #[must_use]
    pub fn master_factor(&self, clock: usize) -> f64 {
        let Some(clock) = self.clocks().get(clock) else { return 1.0 };
        let unit = clock.master.and_then(|it| self.channels()[it].unit.as_deref());
        unit.map_or(1.0, |unit| factor(clock.axis, unit))
    }

    /// Hands over the rows of some channels, all of one clock, in stretches of at most [`STRETCH`] rows, until `take` is false.
    /// Integers of [`Kind::Integer`] come as integers, other numbers as doubles.
    ///
    /// # Errors
    /// When the file is damaged where these channels are, or a channel is not there or has another clock.
    pub fn visit(
        &mut self,
        clock: usize,
        wanted: &[usize],
        take: &mut dyn FnMut(&mut [Values]) -> bool,
    ) -> Result<(), Error> {
        let Self { bytes, structure } = self;
        if let Some(wrong) =
            wanted.iter().find(|it| structure.channels.get(**it).is_none_or(|it| it.clock != clock))
        {
            return Err(Error::general(format!(
                "expected channels of clock {clock}, found {wrong}"
            )));
        }
        let mut sources = sources(bytes, structure, wanted)?;
        let longest = sources.iter().map(|it| it.group.record()).max().unwrap_or(0);
        let most = (HELD / longest.max(1)).clamp(1, STRETCH);
        let mut row = 0;
        loop {
            let mut counts = Vec::new();
            for source in &mut sources {
                counts.push(source.cursor.next(bytes, most, &mut source.records)?);
            }
            let count = counts.first().copied().unwrap_or(0);
            if counts.iter().any(|it| *it != count) {
                let text = "expected as many rows in all groups of one clock, found fewer in some";
                return Err(Error::general(text));
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
                values.push(source.values(
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
    /// As [`Self::visit`].
    pub fn read(&mut self, wanted: &[usize]) -> Result<Vec<Columns>, Error> {
        let mut all: Vec<Columns> = Vec::new();
        for index in wanted {
            let channel = self.channels().get(*index);
            let channel = channel.ok_or_else(|| Error::general(format!("no channel {index}")))?;
            let (clock, values) = (channel.clock, none(channel.kind));
            let place = all.iter().position(|it| it.clock == clock).unwrap_or_else(|| {
                all.push(Columns { clock, times: vec![], channels: vec![], values: vec![] });
                all.len() - 1
            });
            all[place].channels.push(*index);
            all[place].values.push(values);
        }
        for columns in &mut all {
            let master = self.clocks()[columns.clock].master;
            let factor = self.master_factor(columns.clock);
            let wanted: Vec<_> = columns.channels.iter().copied().chain(master).collect();
            let Columns { times, values, .. } = columns;
            self.visit(columns.clock, &wanted, &mut |stretch| {
                let rows = times.len()..times.len() + stretch.first().map_or(0, Values::len);
                // The master stands behind the wanted channels.
                match stretch.get(values.len()) {
                    Some(master) => {
                        let time = |row| master.number(row).unwrap_or(f64::NAN) * factor;
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
fn none(kind: Kind) -> Values {
    match kind {
        Kind::Number => Values::Numbers(Vec::new()),
        Kind::Integer => Values::Integers(Vec::new()),
        Kind::Text => Values::Texts(Vec::new()),
    }
}

/// What makes the unit of the standard of another one.
fn factor(axis: Axis, unit: &str) -> f64 {
    match (axis, unit.trim()) {
        (Axis::Time, "ms") => 1e-3,
        (Axis::Time, "us" | "µs" | "μs") => 1e-6,
        (Axis::Time, "ns") => 1e-9,
        (Axis::Time, "min") => 60.0,
        (Axis::Time, "h") => 3600.0,
        (Axis::Angle, "deg" | "°") => std::f64::consts::PI / 180.0,
        (Axis::Distance, "mm") => 1e-3,
        (Axis::Distance, "km") => 1e3,
        _ => 1.0,
    }
}

/// A group whose records are read.
struct Source {
    index: usize,
    group: Group,
    cursor: Cursor,
    records: Vec<u8>,
    /// The texts of channels of any length.
    texts: AllTexts,
}

/// The groups of the wanted channels.
fn sources(
    bytes: &mut Bytes,
    structure: &Structure,
    wanted: &[usize],
) -> Result<Vec<Source>, Error> {
    let mut all: Vec<Source> = Vec::new();
    for channel in wanted {
        let place = &structure.storages[*channel];
        let group = &structure.groups[place.group];
        let at = match all.iter().position(|it| it.index == place.group) {
            Some(at) => at,
            None => {
                let cursor = Cursor::open(bytes, group, structure.open_end)?;
                let (index, group) = (place.group, group.clone());
                let (records, texts) = (Vec::new(), AllTexts::new());
                all.push(Source { index, group, cursor, records, texts });
                all.len() - 1
            }
        };
        if let Store::Variable(variable) = &place.store {
            let texts = Texts::open(bytes, variable, group, structure.open_end)?;
            all[at].texts.insert(*channel, texts);
        }
    }
    Ok(all)
}

impl Source {
    /// The values of a channel in the records at hand, which are these rows.
    fn values(
        &mut self,
        bytes: &mut Bytes,
        channel: usize,
        place: &ChannelStorage,
        kind: Kind,
        rows: std::ops::Range<u64>,
    ) -> Result<Values, Error> {
        let (record, values) = (self.group.record(), self.group.values);
        let records = &self.records;
        let of = |row: u64| {
            let begin = (row - rows.start) as usize * record;
            &records[begin..begin + record]
        };
        let valid = |record: &[u8]| match place.valid {
            Validity::All => true,
            Validity::None => false,
            Validity::Unless(bit) => record[values + bit as usize / 8] >> (bit % 8) & 1 == 0,
        };
        let conversion = &*place.conversion;
        let mut texts = self.texts.get_mut(&channel);
        Ok(match kind {
            Kind::Integer => Values::Integers(match &place.store {
                Store::Fixed(field) => {
                    rows.clone().map(|it| valid(of(it)).then(|| field.integer(of(it)))).collect()
                }
                _ => Vec::new(),
            }),
            Kind::Number => {
                let mut all = Vec::with_capacity((rows.end - rows.start) as usize);
                for row in rows.clone() {
                    let record = of(row);
                    all.push(match valid(record) {
                        true => number(bytes, &place.store, conversion, record, row, &mut texts)?,
                        false => f64::NAN,
                    });
                }
                Values::Numbers(all)
            }
            Kind::Text => {
                let mut all = Vec::with_capacity((rows.end - rows.start) as usize);
                for row in rows.clone() {
                    let record = of(row);
                    all.push(match valid(record) {
                        true => {
                            Some(text(bytes, &place.store, conversion, record, row, &mut texts)?)
                        }
                        false => None,
                    });
                }
                Values::Texts(all)
            }
        })
    }
}

/// The number of a row.
fn number(
    bytes: &mut Bytes,
    store: &Store,
    conversion: &Conversion,
    record: &[u8],
    row: u64,
    texts: &mut Option<&mut Texts>,
) -> Result<f64, Error> {
    Ok(match store {
        Store::Fixed(field) if !field.is_text() => match conversion {
            Conversion::Identity => field.number(record),
            _ => conversion.number(field.number(record), field.is_whole()),
        },
        Store::Row => conversion.number(row as f64, true),
        _ => conversion.number_of(&raw_text(bytes, store, record, texts)?),
    })
}

/// The text of a row.
fn text(
    bytes: &mut Bytes,
    store: &Store,
    conversion: &Conversion,
    record: &[u8],
    row: u64,
    texts: &mut Option<&mut Texts>,
) -> Result<String, Error> {
    let physical = match store {
        Store::Fixed(field) if !field.is_text() => {
            conversion.apply(field.number(record), field.is_whole())
        }
        Store::Row => conversion.apply(row as f64, true),
        _ => return Ok(conversion.text_of(raw_text(bytes, store, record, texts)?)),
    };
    Ok(match physical {
        Physical::Text(text) => text.into_owned(),
        Physical::Number(number) => number.to_string(),
    })
}

/// A text before its conversion.
fn raw_text(
    bytes: &mut Bytes,
    store: &Store,
    record: &[u8],
    texts: &mut Option<&mut Texts>,
) -> Result<String, Error> {
    Ok(match (store, texts) {
        (Store::Fixed(field), _) => field.text(record, usize::MAX),
        (Store::Bounded(field, size), _) => {
            field.text(record, size.integer(record).clamp(0, u32::MAX.into()) as usize)
        }
        (Store::Variable(_), Some(texts)) => texts.text(bytes, record)?,
        _ => String::new(),
    })
}
