//! Converts Arrow arrays to values, and Arrow schemas to channels; also for Parquet.

use arrow_array::cast::AsArray as _;
use arrow_array::types::{
    ArrowPrimitiveType, Date32Type, Date64Type, Decimal32Type, Decimal64Type, Decimal128Type,
    DurationMicrosecondType, DurationMillisecondType, DurationNanosecondType, DurationSecondType,
    Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type,
    Time32MillisecondType, Time32SecondType, Time64MicrosecondType, Time64NanosecondType,
    TimestampMicrosecondType, TimestampMillisecondType, TimestampNanosecondType,
    TimestampSecondType, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, RecordBatch};
use arrow_schema::{DataType, Field, Schema, TimeUnit};

use crate::{CHUNK_ROWS, Channel, ChannelKind, ChunkCallback, Clock, Time, Values};

/// The channels of a schema, those of its fields that it can have: each with the place of its field.
pub struct SchemaChannels {
    pub channels: Vec<Channel>,
    pub clocks: Vec<Clock>,
    pub places: Vec<usize>,
    pub left_out: Vec<String>,
}

impl SchemaChannels {
    /// Takes the fields of numbers, texts and points of time. The only column of points of time is the time of the others.
    pub fn new(schema: &Schema, rows: Option<u64>) -> Self {
        let (mut channels, mut places, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        for (place, field) in schema.fields().iter().enumerate() {
            let name = field.name().clone();
            match kind(field.data_type()) {
                None => left_out.push(format!(
                    "`{name}` is left out: it has values of type {}",
                    field.data_type()
                )),
                Some(kind) => {
                    let (unit, group) = (unit(field, kind), String::new());
                    channels.push(Channel { name, group, unit, clock: 0, kind });
                    places.push(place);
                }
            }
        }
        let is_stamp = |(place, channel): (usize, &Channel)| match channel.kind {
            ChannelKind::Stamp(_) => Some(place),
            _ => None,
        };
        let stamps: Vec<usize> = channels.iter().enumerate().filter_map(is_stamp).collect();
        let time = match stamps[..] {
            [only] => Time::Channel(only),
            _ => Time::Unknown,
        };
        Self { channels, clocks: vec![Clock { time, rows }], places, left_out }
    }

    /// Hands over the rows of a batch that has the fields of these channels, by their places in it, until `take` wants no more.
    pub fn emit(batch: &RecordBatch, columns: &[usize], take: ChunkCallback) -> bool {
        let starts = (0..batch.num_rows()).step_by(CHUNK_ROWS);
        starts.into_iter().all(|start| {
            let part = batch.slice(start, CHUNK_ROWS.min(batch.num_rows() - start));
            let of = |column: &usize| values(part.column(*column));
            take(&columns.iter().map(of).collect::<Vec<_>>())
        })
    }
}

/// The unit that the metadata of a field say, under the key that pandas-like tools and this program use; an empty one where a run of
/// this program says that there is none.
fn unit(field: &Field, kind: ChannelKind) -> Option<String> {
    let keys = ["unit", "units", "Unit", "Units"];
    let said = keys.iter().find_map(|key| field.metadata().get(*key));
    match (said, kind) {
        (_, ChannelKind::Stamp(_)) => Some("s".to_owned()),
        (Some(said), _) if !said.trim().is_empty() => Some(said.trim().to_owned()),
        (Some(_), _) if field.metadata().contains_key("direction") => Some(String::new()),
        _ => None,
    }
}

/// What the values of a type are; nothing for lists, structs and bytes.
fn kind(of: &DataType) -> Option<ChannelKind> {
    Some(match of {
        DataType::Timestamp(unit, _) | DataType::Duration(unit) => {
            ChannelKind::Stamp(per_second(*unit))
        }
        DataType::Date64 => ChannelKind::Stamp(1000),
        DataType::Time32(unit) | DataType::Time64(unit) => ChannelKind::Stamp(per_second(*unit)),
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => ChannelKind::Text,
        DataType::Dictionary(_, values) => kind(values)?,
        DataType::Boolean | DataType::Null | DataType::Date32 => ChannelKind::Number,
        DataType::Decimal32(..) | DataType::Decimal64(..) | DataType::Decimal128(..) => {
            ChannelKind::Number
        }
        other if other.is_numeric() && !matches!(other, DataType::Decimal256(..)) => {
            ChannelKind::Number
        }
        _ => return None,
    })
}

fn per_second(unit: TimeUnit) -> i64 {
    match unit {
        TimeUnit::Second => 1,
        TimeUnit::Millisecond => 1000,
        TimeUnit::Microsecond => 1_000_000,
        TimeUnit::Nanosecond => 1_000_000_000,
    }
}

fn numbers<T: ArrowPrimitiveType>(array: &dyn Array, number: impl Fn(T::Native) -> f64) -> Values {
    let all = array.as_primitive::<T>().iter();
    Values::Numbers(all.map(|it| it.map_or(f64::NAN, &number)).collect())
}

fn integers<T: ArrowPrimitiveType>(array: &dyn Array) -> Values
where
    T::Native: Into<i128>,
{
    Values::Integers(array.as_primitive::<T>().iter().map(|it| it.map(Into::into)).collect())
}

/// The values of an array of a type that has a [`kind`].
fn values(array: &dyn Array) -> Values {
    let nothing = || Values::Numbers(vec![f64::NAN; array.len()]);
    let tenth = |scale: i8| 10f64.powi(-i32::from(scale));
    match array.data_type() {
        DataType::Float64 => numbers::<Float64Type>(array, |it| it),
        DataType::Float32 => numbers::<Float32Type>(array, f64::from),
        DataType::Float16 => numbers::<Float16Type>(array, f64::from),
        DataType::Int8 => numbers::<Int8Type>(array, f64::from),
        DataType::Int16 => numbers::<Int16Type>(array, f64::from),
        DataType::Int32 => numbers::<Int32Type>(array, f64::from),
        DataType::UInt8 => numbers::<UInt8Type>(array, f64::from),
        DataType::UInt16 => numbers::<UInt16Type>(array, f64::from),
        DataType::UInt32 => numbers::<UInt32Type>(array, f64::from),
        DataType::Int64 => integers::<Int64Type>(array),
        DataType::UInt64 => integers::<UInt64Type>(array),
        DataType::Decimal32(_, scale) => {
            numbers::<Decimal32Type>(array, |it| f64::from(it) * tenth(*scale))
        }
        DataType::Decimal64(_, scale) => {
            numbers::<Decimal64Type>(array, |it| it as f64 * tenth(*scale))
        }
        DataType::Decimal128(_, scale) => {
            numbers::<Decimal128Type>(array, |it| it as f64 * tenth(*scale))
        }
        DataType::Date32 => numbers::<Date32Type>(array, f64::from),
        DataType::Date64 => integers::<Date64Type>(array),
        DataType::Timestamp(TimeUnit::Second, _) => integers::<TimestampSecondType>(array),
        DataType::Timestamp(TimeUnit::Millisecond, _) => {
            integers::<TimestampMillisecondType>(array)
        }
        DataType::Timestamp(TimeUnit::Microsecond, _) => {
            integers::<TimestampMicrosecondType>(array)
        }
        DataType::Timestamp(TimeUnit::Nanosecond, _) => integers::<TimestampNanosecondType>(array),
        DataType::Duration(TimeUnit::Second) => integers::<DurationSecondType>(array),
        DataType::Duration(TimeUnit::Millisecond) => integers::<DurationMillisecondType>(array),
        DataType::Duration(TimeUnit::Microsecond) => integers::<DurationMicrosecondType>(array),
        DataType::Duration(TimeUnit::Nanosecond) => integers::<DurationNanosecondType>(array),
        DataType::Time32(TimeUnit::Second) => integers::<Time32SecondType>(array),
        DataType::Time32(_) => integers::<Time32MillisecondType>(array),
        DataType::Time64(TimeUnit::Microsecond) => integers::<Time64MicrosecondType>(array),
        DataType::Time64(_) => integers::<Time64NanosecondType>(array),
        DataType::Boolean => Values::Numbers(
            array.as_boolean().iter().map(|it| it.map_or(f64::NAN, f64::from)).collect(),
        ),
        DataType::Utf8 => texts(array.as_string::<i32>().iter()),
        DataType::LargeUtf8 => texts(array.as_string::<i64>().iter()),
        DataType::Utf8View => texts(array.as_string_view().iter()),
        DataType::Dictionary(..) => dictionary(array),
        _ => nothing(),
    }
}

fn texts<'a>(all: impl Iterator<Item = Option<&'a str>>) -> Values {
    Values::Texts(all.map(|it| it.map(str::to_owned)).collect())
}

/// The values that the keys of a dictionary stand for.
fn dictionary(array: &dyn Array) -> Values {
    let array = array.as_any_dictionary();
    let (known, keys) = (values(array.values()), values(array.keys()));
    let key = |row: usize| match keys.number(row) {
        Some(key) if key >= 0.0 => Some(key as usize),
        _ => None,
    };
    let keys = (0..keys.len()).map(key);
    match &known {
        Values::Numbers(all) => Values::Numbers(
            keys.map(|it| it.and_then(|it| all.get(it).copied()).unwrap_or(f64::NAN)).collect(),
        ),
        Values::Integers(all) => {
            Values::Integers(keys.map(|it| it.and_then(|it| *all.get(it)?)).collect())
        }
        Values::Texts(all) => {
            Values::Texts(keys.map(|it| it.and_then(|it| all.get(it)?.clone())).collect())
        }
    }
}
