//! Writes small logs by the published layouts, independently of the readers.
#![allow(dead_code, reason = "each test takes some of it")]

use std::sync::Arc;

use arrow_array::types::Int32Type;
use arrow_array::{
    Array, ArrayRef, BooleanArray, Decimal128Array, DictionaryArray, Float16Array, Float32Array,
    Float64Array, Int64Array, RecordBatch, StringArray, TimestampMillisecondArray, UInt8Array, UInt64Array,
};
use arrow_schema::{DataType, Field, Schema};

/// A VBOX file.
pub const VBO: &str = "File created on 15/12/2023 @ 23:59:59\r\n\r\n[header]\r\nsatellites\r\ntime\r\nlatitude\r\nlongitude\r\nvelocity kmh\r\n\
heading\r\nheight\r\nYaw_Rate\r\nLat Acc\r\n\r\n[channel units]\r\ndeg/s\r\ng\r\n\r\n[comments]\r\n(c) 2023\r\nLog Rate (Hz) : 10.00\r\n\r\n\
[column names]\r\nsats time lat long velocity heading height Yaw_Rate Lat_Acc\r\n\r\n[data]\r\n\
008 235959.90 +03119.09973 +00058.86180 036.000 129.00 +00102.50 +1.5E+00 -2.5E-01\r\n\
008 000000.00 +03119.10000 +00058.86200 037.000 130.00 +00102.50 null +0.0\r\n\
008 000000.1\r\n\
008 000000.20 +03119.10000 -00060.00000 x 130.00 +00102.50 1 1\r\n\r\n\
[laptiming]\r\nStart 1 2 3 4\r\n";

/// A batch with fields of all types, and rows without values.
pub fn batch() -> RecordBatch {
    let texts = ["rain", "dry"];
    let keys = arrow_array::Int32Array::from(vec![Some(1), None, Some(0)]);
    let known: ArrayRef = Arc::new(StringArray::from(texts.to_vec()));
    let words = DictionaryArray::<Int32Type>::try_new(keys, known).expect("a dictionary");
    let halves = [1.5, -2.0, 0.0].map(half::f16::from_f64);
    let times = [1_700_000_000_000, 1_700_000_000_010, 1_700_000_000_020];
    let price = Decimal128Array::from(vec![Some(12345), None, Some(-5)]);
    let columns: Vec<(&str, ArrayRef)> = vec![
        ("v_x", Arc::new(Float64Array::from(vec![Some(1.25), None, Some(-3.5)]))),
        ("f", Arc::new(Float32Array::from(vec![0.5, 1.0, 2.0]))),
        ("h", Arc::new(Float16Array::from(halves.to_vec()))),
        ("gear", Arc::new(UInt8Array::from(vec![1, 2, 255]))),
        ("count", Arc::new(Int64Array::from(vec![Some(i64::MAX), None, Some(-1)]))),
        ("id", Arc::new(UInt64Array::from(vec![u64::MAX, 0, 1]))),
        ("wet", Arc::new(BooleanArray::from(vec![Some(true), Some(false), None]))),
        ("weather", Arc::new(words)),
        ("note", Arc::new(StringArray::from(vec![Some("a"), None, Some("c")]))),
        ("price", Arc::new(price.with_precision_and_scale(10, 2).expect("it fits"))),
        ("stamp", Arc::new(TimestampMillisecondArray::from(times.to_vec()).with_timezone("UTC"))),
    ];
    let field = |(name, array): &(&str, ArrayRef)| {
        let field = Field::new(*name, array.data_type().clone(), true);
        match *name {
            "v_x" => field.with_metadata([("unit".to_owned(), "m/s".to_owned())].into()),
            _ => field,
        }
    };
    let mut fields: Vec<Field> = columns.iter().map(field).collect();
    let mut arrays: Vec<ArrayRef> = columns.into_iter().map(|it| it.1).collect();
    // A list is no channel.
    let list = arrow_array::ListArray::from_iter_primitive::<Int32Type, _, _>(vec![
        Some(vec![Some(1)]),
        None,
        Some(vec![]),
    ]);
    fields.insert(1, Field::new("list", DataType::new_list(DataType::Int32, true), true));
    arrays.insert(1, Arc::new(list));
    RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays).expect("a batch")
}

/// The batch twice, as Parquet.
pub fn parquet() -> Vec<u8> {
    let batch = batch();
    let properties = parquet::file::properties::WriterProperties::builder()
        .set_compression(parquet::basic::Compression::SNAPPY)
        .build();
    let mut file = Vec::new();
    let writer = parquet::arrow::ArrowWriter::try_new(&mut file, batch.schema(), Some(properties));
    let mut writer = writer.expect("a writer");
    writer.write(&batch).expect("it is written");
    writer.flush().expect("a group of rows ends");
    writer.write(&batch).expect("it is written");
    writer.close().expect("it is written");
    file
}

/// The batch twice as a file of Arrow, or as a stream.
pub fn arrow(stream: bool, packed: Option<arrow_ipc::CompressionType>) -> Vec<u8> {
    let batch = batch();
    let options = arrow_ipc::writer::IpcWriteOptions::default().try_with_compression(packed);
    let options = options.expect("it is known");
    let mut file = Vec::new();
    if stream {
        let writer =
            arrow_ipc::writer::StreamWriter::try_new_with_options(&mut file, &batch.schema(), options);
        let mut writer = writer.expect("a writer");
        (0..2).for_each(|_| writer.write(&batch).expect("it is written"));
        writer.finish().expect("it is written");
    } else {
        let writer = arrow_ipc::writer::FileWriter::try_new_with_options(&mut file, &batch.schema(), options);
        let mut writer = writer.expect("a writer");
        (0..2).for_each(|_| writer.write(&batch).expect("it is written"));
        writer.finish().expect("it is written");
    }
    file
}

/// The same file as polars writes it: the first message, the schema, has no length in front. So only the footer tells where the others are.
pub fn by_footer(file: &[u8]) -> Vec<u8> {
    let mut file = file.to_vec();
    let begin = file.windows(4).position(|it| it == [0xff; 4]).expect("a message");
    let length = file[begin + 4..begin + 8].try_into().map(u32::from_le_bytes).expect("a length");
    let end = begin + 8 + length as usize;
    file.copy_within(begin + 8..end, begin);
    file[end - 8..end].fill(0);
    file
}
