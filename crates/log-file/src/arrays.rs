//! Converts Arrow arrays to values, and Arrow schemas to channels; also for Parquet.

use arrow_array::cast::AsArray as _;
use arrow_array::types::{
    ArrowPrimitiveType, Date32Type, Date64Type, Decimal32Type, Decimal64Type, Decimal128Type,
    DurationMicrosecondType, DurationMillisecondType, DurationNanosecondType, DurationSecondType,
    Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, Time32MillisecondType,
    Time32SecondType, Time64MicrosecondType, Time64NanosecondType, TimestampMicrosecondType,
    TimestampMillisecondType, TimestampNanosecondType, TimestampSecondType, UInt8Type, UInt16Type,
    UInt32Type, UInt64Type,
};
use arrow_array::{Array, RecordBatch};
use arrow_schema::{DataType, Field, Schema, TimeUnit};

use crate::{CHUNK_ROWS, ChannelKind, ChannelValues, ChunkCallback, ClockTime, LogChannel, LogClock};

/// The channels of a schema, those of its fields that it can have: each with the place of its field.
pub struct SchemaChannels {
    pub channels: Vec<LogChannel>,
    pub clocks: Vec<LogClock>,
    pub places: Vec<usize>,
    pub left_out: Vec<String>,
}

impl SchemaChannels {
    /// Takes the fields of numbers, texts and points of time. The only column of points of time is the time of the others.
    pub fn new(schema: &Schema, rows: Option<u64>) -> Self {
        let (mut channels, mut places, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        for (place, field) in schema.fields().iter().enumerate() {
            let name = field.name().clone();
            match channel_kind(field.data_type()) {
                None => left_out
                    .push(format!("`{name}` is left out: it has values of type {}", field.data_type())),
                Some(kind) => {
                    let (unit, group) = (field_unit(field, kind), String::new());
                    channels.push(LogChannel { name, group, unit, clock: 0, kind });
                    places.push(place);
                }
            }
        }
        let is_stamp = |(place, channel): (usize, &LogChannel)| match channel.kind {
            ChannelKind::Stamp(_) => Some(place),
            _ => None,
        };
        let stamps: Vec<usize> = channels.iter().enumerate().filter_map(is_stamp).collect();
        let time = match stamps[..] {
            [only] => ClockTime::Channel(only),
            _ => ClockTime::Unknown,
        };
        Self { channels, clocks: vec![LogClock { time, rows }], places, left_out }
    }

    /// Hands over the rows of a batch that has the fields of these channels, by their places in it, until `take` wants no more.
    pub fn emit_batch(batch: &RecordBatch, columns: &[usize], take: ChunkCallback) -> bool {
        let starts = (0..batch.num_rows()).step_by(CHUNK_ROWS);
        starts.into_iter().all(|start| {
            let part = batch.slice(start, CHUNK_ROWS.min(batch.num_rows() - start));
            let of = |column: &usize| array_values(part.column(*column));
            take(&columns.iter().map(of).collect::<Vec<_>>())
        })
    }
}

/// The unit that the metadata of a field say, under the key that pandas-like tools and this program use; an empty one where a run of
/// this program says that there is none.
fn field_unit(field: &Field, kind: ChannelKind) -> Option<String> {
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
fn channel_kind(of: &DataType) -> Option<ChannelKind> {
    Some(match of {
        DataType::Timestamp(unit, _) | DataType::Duration(unit) => ChannelKind::Stamp(per_second(*unit)),
        DataType::Date64 => ChannelKind::Stamp(1000),
        DataType::Time32(unit) | DataType::Time64(unit) => ChannelKind::Stamp(per_second(*unit)),
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => ChannelKind::Text,
        DataType::Dictionary(_, values) => channel_kind(values)?,
        DataType::Boolean | DataType::Null | DataType::Date32 => ChannelKind::Number,
        DataType::Decimal32(..) | DataType::Decimal64(..) | DataType::Decimal128(..) => ChannelKind::Number,
        other if other.is_numeric() && !matches!(other, DataType::Decimal256(..)) => ChannelKind::Number,
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

fn number_values<T: ArrowPrimitiveType>(
    array: &dyn Array,
    number: impl Fn(T::Native) -> f64,
) -> ChannelValues {
    let all = array.as_primitive::<T>().iter();
    ChannelValues::Numbers(all.map(|it| it.map_or(f64::NAN, &number)).collect())
}

fn integer_values<T: ArrowPrimitiveType>(array: &dyn Array) -> ChannelValues
where
    T::Native: Into<i128>,
{
    ChannelValues::Integers(array.as_primitive::<T>().iter().map(|it| it.map(Into::into)).collect())
}

/// The values of an array of a type that has a [`channel_kind`].
fn array_values(array: &dyn Array) -> ChannelValues {
    let nothing = || ChannelValues::Numbers(vec![f64::NAN; array.len()]);
    let tenth = |scale: i8| 10f64.powi(-i32::from(scale));
    match array.data_type() {
        DataType::Float64 => number_values::<Float64Type>(array, |it| it),
        DataType::Float32 => number_values::<Float32Type>(array, f64::from),
        DataType::Float16 => number_values::<Float16Type>(array, f64::from),
        DataType::Int8 => number_values::<Int8Type>(array, f64::from),
        DataType::Int16 => number_values::<Int16Type>(array, f64::from),
        DataType::Int32 => number_values::<Int32Type>(array, f64::from),
        DataType::UInt8 => number_values::<UInt8Type>(array, f64::from),
        DataType::UInt16 => number_values::<UInt16Type>(array, f64::from),
        DataType::UInt32 => number_values::<UInt32Type>(array, f64::from),
        DataType::Int64 => integer_values::<Int64Type>(array),
        DataType::UInt64 => integer_values::<UInt64Type>(array),
        DataType::Decimal32(_, scale) => {
            number_values::<Decimal32Type>(array, |it| f64::from(it) * tenth(*scale))
        }
        DataType::Decimal64(_, scale) => {
            number_values::<Decimal64Type>(array, |it| it as f64 * tenth(*scale))
        }
        DataType::Decimal128(_, scale) => {
            number_values::<Decimal128Type>(array, |it| it as f64 * tenth(*scale))
        }
        DataType::Date32 => number_values::<Date32Type>(array, f64::from),
        DataType::Date64 => integer_values::<Date64Type>(array),
        DataType::Timestamp(TimeUnit::Second, _) => integer_values::<TimestampSecondType>(array),
        DataType::Timestamp(TimeUnit::Millisecond, _) => integer_values::<TimestampMillisecondType>(array),
        DataType::Timestamp(TimeUnit::Microsecond, _) => integer_values::<TimestampMicrosecondType>(array),
        DataType::Timestamp(TimeUnit::Nanosecond, _) => integer_values::<TimestampNanosecondType>(array),
        DataType::Duration(TimeUnit::Second) => integer_values::<DurationSecondType>(array),
        DataType::Duration(TimeUnit::Millisecond) => integer_values::<DurationMillisecondType>(array),
        DataType::Duration(TimeUnit::Microsecond) => integer_values::<DurationMicrosecondType>(array),
        DataType::Duration(TimeUnit::Nanosecond) => integer_values::<DurationNanosecondType>(array),
        DataType::Time32(TimeUnit::Second) => integer_values::<Time32SecondType>(array),
        DataType::Time32(_) => integer_values::<Time32MillisecondType>(array),
        DataType::Time64(TimeUnit::Microsecond) => integer_values::<Time64MicrosecondType>(array),
        DataType::Time64(_) => integer_values::<Time64NanosecondType>(array),
        DataType::Boolean => ChannelValues::Numbers(
            array.as_boolean().iter().map(|it| it.map_or(f64::NAN, f64::from)).collect(),
        ),
        DataType::Utf8 => text_values(array.as_string::<i32>().iter()),
        DataType::LargeUtf8 => text_values(array.as_string::<i64>().iter()),
        DataType::Utf8View => text_values(array.as_string_view().iter()),
        DataType::Dictionary(..) => dictionary_values(array),
        _ => nothing(),
    }
}

fn text_values<'a>(all: impl Iterator<Item = Option<&'a str>>) -> ChannelValues {
    ChannelValues::Texts(all.map(|it| it.map(str::to_owned)).collect())
}

/// The values that the keys of a dictionary stand for.
fn dictionary_values(array: &dyn Array) -> ChannelValues {
    let array = array.as_any_dictionary();
    let (known, keys) = (array_values(array.values()), array_values(array.keys()));
    let key = |row: usize| match keys.number_at(row) {
        Some(key) if key >= 0.0 => Some(key as usize),
        _ => None,
    };
    let keys = (0..keys.len()).map(key);
    match &known {
        ChannelValues::Numbers(all) => ChannelValues::Numbers(
            keys.map(|it| it.and_then(|it| all.get(it).copied()).unwrap_or(f64::NAN)).collect(),
        ),
        ChannelValues::Integers(all) => {
            ChannelValues::Integers(keys.map(|it| it.and_then(|it| *all.get(it)?)).collect())
        }
        ChannelValues::Texts(all) => {
            ChannelValues::Texts(keys.map(|it| it.and_then(|it| all.get(it)?.clone())).collect())
        }
    }
}
