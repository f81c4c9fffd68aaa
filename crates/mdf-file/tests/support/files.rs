//! The hand-made files that tests read: each shows what a standard allows and tools seldom write.
#![allow(dead_code)]

use super::made::{Channel, Group, Made};
use super::old::old;

/// A channel of a name, type of data, first byte, first bit and bits.
pub fn plain(name: &str, data_type: u8, byte: u32, bit: u8, bits: u32) -> Channel<'_> {
    Channel { name, data_type, byte, bit, bits, ..Channel::default() }
}

/// The names of all files, and their bytes.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("bits", bits()),
        ("mixed", mixed()),
        ("rows", virtual_master()),
        ("ticks", ticks()),
        ("lists", lists()),
        ("conversions", conversions()),
        ("array", array()),
        ("structure", structure()),
        ("strings", strings()),
        ("columns", columns()),
        ("open", unfinalised()),
        ("old", old(false)),
        ("old_big", old(true)),
    ]
}

/// Values of any bits, of both orders of bytes, and invalidation bits.
pub fn bits() -> Vec<u8> {
    let mut made = Made::new(410);
    let channels = [
        plain("u3", 0, 8, 2, 3),
        plain("i5", 2, 8, 5, 5),
        plain("u1", 0, 9, 2, 1),
        plain("u12", 0, 9, 3, 12),
        plain("be16", 1, 11, 0, 16),
        plain("be32", 3, 13, 0, 32),
        plain("bef64", 5, 17, 0, 64),
        plain("u64", 0, 25, 0, 64),
        plain("i64", 2, 33, 0, 64),
        plain("f16", 4, 41, 0, 16),
        Channel { flags: 2, invalid: 3, unit: "°C", ..plain("f32", 4, 43, 0, 32) },
        Channel { flags: 1, ..plain("never", 4, 43, 0, 32) },
        plain("u24", 0, 47, 0, 24),
        plain("be64", 1, 50, 0, 64),
    ];
    let row = |row: u64| {
        let mut all = Vec::new();
        all.extend((0x005a_3c91_u32.wrapping_mul(row as u32 * 7 + 1)).to_le_bytes()[..3].iter());
        all.extend((row as u16 * 1000 + 1).to_be_bytes());
        all.extend((-70_000 * (row as i32 + 1)).to_be_bytes());
        all.extend((row as f64 * 0.1 - 1.0).to_be_bytes());
        all.extend((u64::MAX - row).to_le_bytes());
        all.extend((i64::MIN + row as i64).to_le_bytes());
        all.extend((0x3c00 + row as u16).to_le_bytes());
        all.extend((row as f32 / 3.0).to_le_bytes());
        all.extend(&(0x0012_3456 + row as u32).to_le_bytes()[..3]);
        all.extend(((1u64 << 60) + row).to_be_bytes());
        all.push(if row % 4 == 1 { 0b1000 } else { 0 });
        all
    };
    made.rows(&channels, 1, &(0..20).map(row).collect::<Vec<_>>());
    made.bytes
}

/// Two groups and texts of any length in one stream.
pub fn mixed() -> Vec<u8> {
    let mut made = Made::new(410);
    let texts = made.group(Group { number: 3, rows: 5, flags: 1, ..Group::default() });
    let word = Channel { kind: 1, data: texts, ..plain("word", 7, 8, 0, 64) };
    let first = |made: &mut Made, channel: Channel| {
        let time = Channel { kind: 2, sync: 1, unit: "s", ..plain("t", 4, 0, 0, 64) };
        made.channels(&[time, channel])
    };
    let slow = first(&mut made, word);
    let fast = first(&mut made, plain("count", 0, 8, 0, 16));
    let slow =
        made.group(Group { number: 2, first: slow, rows: 5, values: 16, name: "slow", ..Group::default() });
    let fast = made.group(Group {
        next: slow,
        number: 1,
        first: fast,
        rows: 50,
        values: 10,
        name: "fast",
        ..Group::default()
    });
    made.put(slow + 24, texts);
    let (mut data, mut offset) = (Vec::new(), 0u64);
    for row in 0..50u16 {
        data.push(1);
        data.extend((f64::from(row) * 0.01).to_le_bytes());
        data.extend((row * 3).to_le_bytes());
        if row % 10 == 4 {
            let text = format!("row {row} {}", "é".repeat(row.into()));
            data.push(3);
            data.extend((text.len() as u32 + 1).to_le_bytes());
            data.extend(text.bytes().chain([0]));
            data.push(2);
            data.extend((f64::from(row) * 0.01).to_le_bytes());
            data.extend(offset.to_le_bytes());
            offset += 4 + text.len() as u64 + 1;
        }
    }
    // The count of bytes of the texts.
    let at = texts as usize + 24 + 6 * 8 + 24;
    made.bytes[at..at + 8].copy_from_slice(&offset.to_le_bytes());
    let data = made.block(b"##DT", &[], &data);
    made.data_group(0, fast, data, 1);
    made.bytes
}

/// The number of the row as master, converted to a time; and a group without a master.
pub fn virtual_master() -> Vec<u8> {
    let mut made = Made::new(410);
    let alone = made.channels(&[plain("alone", 2, 0, 0, 8)]);
    let group = made.group(Group { first: alone, rows: 3, values: 1, ..Group::default() });
    let data = made.block(b"##DT", &[], &[1, 2, 0xff]);
    let next = made.data_group(0, group, data, 0);
    let conversion = made.conversion(1, &[], &[5.0, 0.01]);
    let time = Channel { kind: 3, sync: 1, conversion, unit: "s", ..plain("t", 0, 0, 0, 0) };
    let first = made.channels(&[time, plain("v", 0, 0, 0, 8)]);
    let group = made.group(Group { first, rows: 4, values: 1, ..Group::default() });
    let data = made.block(b"##DT", &[], &[9, 8, 7, 6]);
    made.data_group(next, group, data, 0);
    made.bytes
}

/// A time in nanoseconds as integers, which its conversion makes seconds; in a second group milliseconds that nothing converts.
pub fn ticks() -> Vec<u8> {
    let mut made = Made::new(410);
    let time = Channel { kind: 2, sync: 1, unit: "ms", ..plain("t_ms", 0, 0, 0, 32) };
    let first = made.channels(&[time, plain("slow", 0, 4, 0, 8)]);
    let group = made.group(Group { first, rows: 2, values: 5, ..Group::default() });
    let data = made.block(b"##DT", &[], &[0, 0, 0, 0, 1, 0xf4, 1, 0, 0, 2]);
    let next = made.data_group(0, group, data, 0);
    let conversion = made.conversion(1, &[], &[0.0, 1e-9]);
    let time = Channel { kind: 2, sync: 1, conversion, unit: "s", ..plain("t", 0, 0, 0, 64) };
    let first = made.channels(&[time, plain("fast", 0, 8, 0, 8)]);
    let group = made.group(Group { first, rows: 3, values: 9, ..Group::default() });
    let row = |row: u8| [&(1_700_000_000 + 1_000_000 * u64::from(row)).to_le_bytes()[..], &[row]].concat();
    let data = made.block(b"##DT", &[], &[row(0), row(1), row(2)].concat());
    made.data_group(next, group, data, 0);
    // The start of the measurement.
    made.put(64 + 72, 1_600_000_000_123_456_789);
    made.bytes
}

/// A list of plain and packed blocks, within which rows begin and end, with texts in a list of their own.
pub fn lists() -> Vec<u8> {
    let mut made = Made::new(410);
    let texts: Vec<_> = (0..30).map(|row| "x".repeat(row % 7)).collect();
    let (mut all, mut offsets) = (Vec::new(), Vec::new());
    for text in &texts {
        offsets.push(all.len() as u64);
        all.extend((text.len() as u32 + 1).to_le_bytes());
        all.extend(text.bytes().chain([0]));
    }
    let (begin, end) = all.split_at(offsets[11] as usize);
    let parts = [made.packed(b"SD", 0, begin), made.packed(b"SD", 0, end)];
    let list = made.list(0, &[(parts[0], 0), (parts[1], begin.len() as u64)]);
    let texts = made.block(b"##HL", &[list], &[0; 8]);
    let row = |row: u64| {
        let numbers = [(row as f64 * 0.1).to_bits(), offsets[row as usize], row * row];
        numbers.iter().flat_map(|it| it.to_le_bytes()).collect::<Vec<_>>()
    };
    let data: Vec<u8> = (0..30).flat_map(row).collect();
    let cuts = [0, 100, 100 + 24 * 9 + 5, 500, data.len()];
    let blocks = [
        made.block(b"##DT", &[], &data[..cuts[1]]),
        made.packed(b"DT", 24, &data[cuts[1]..cuts[2]]),
        made.packed(b"DT", 0, &data[cuts[2]..cuts[3]]),
        made.block(b"##DT", &[], &data[cuts[3]..]),
    ];
    let [a, b, c, d] = [0, 1, 2, 3].map(|it| (blocks[it], cuts[it] as u64));
    let second = made.list(0, &[c, d]);
    let first = made.list(second, &[a, b]);
    let list = made.block(b"##HL", &[first], &[0, 0, 1, 0, 0, 0, 0, 0]);
    let time = Channel { kind: 2, sync: 1, unit: "s", ..plain("t", 4, 0, 0, 64) };
    let word = Channel { kind: 1, data: texts, ..plain("word", 7, 8, 0, 64) };
    let first = made.channels(&[time, word, plain("square", 0, 16, 0, 64)]);
    let group = made.group(Group { first, rows: 30, values: 24, ..Group::default() });
    made.data_group(0, group, list, 0);
    made.bytes
}

/// A channel of each conversion.
pub fn conversions() -> Vec<u8> {
    let mut made = Made::new(410);
    let text = |made: &mut Made, text: &str| made.text(text);
    let [low, high, other, neutral] = ["low", "high", "other", "neutral"].map(|it| text(&mut made, it));
    let formula = made.text("X1*2 + 1.5*(X-1)/4");
    let scale = made.conversion(1, &[], &[-40.0, 0.5]);
    let gear = made.named_conversion("gear", 7, &[neutral, high, other], &[0f64.to_bits(), 2f64.to_bits()]);
    let all = [
        ("none", made.conversion(0, &[], &[])),
        ("linear", made.conversion(1, &[], &[0.1, 0.3])),
        ("rational", made.conversion(2, &[], &[0.5, 2.0, 3.0, 0.0, 0.25, 7.0])),
        ("formula", made.conversion(3, &[formula], &[])),
        ("lines", made.conversion(4, &[], &[1.0, 0.1, 4.0, 0.7, 9.0, -3.0])),
        ("steps", made.conversion(5, &[], &[1.0, 0.1, 4.0, 0.7, 9.0, -3.0])),
        ("ranges", made.conversion(6, &[], &[0.0, 3.0, 0.25, 5.0, 7.0, 0.5, -1.0])),
        ("keys", made.conversion(7, &[low, high, other], &[0.0, 5.0])),
        ("spans", made.conversion(8, &[low, high, other], &[0.0, 3.0, 4.0, 9.0])),
        ("mixed", made.conversion(7, &[other, scale], &[11.0])),
        ("bits", made.named_conversion("", 11, &[gear], &[0b10])),
    ];
    let channel = |(name, conversion): &(&'static str, u64)| {
        let conversion = *conversion;
        Channel { conversion, ..plain(name, 0, 8, 0, 8) }
    };
    let mut channels: Vec<_> = all.iter().map(channel).collect();
    let number = made.conversion(9, &[low, high], &[-1.5, 2.5, 99.0]);
    let word = made.conversion(10, &[low, neutral, high, other, other], &[]);
    channels.push(Channel { conversion: number, ..plain("from text", 7, 9, 0, 40) });
    channels.push(Channel { conversion: word, ..plain("translated", 7, 9, 0, 40) });
    let row = |row: u8| {
        let text = [b"low\0\0", b"high\0", b"else\0"][usize::from(row) % 3];
        [&[row][..], text].concat()
    };
    made.rows(&channels, 0, &(0..12).map(row).collect::<Vec<_>>());
    made.bytes
}

/// An array of two rows and three columns of 16 bits.
pub fn array() -> Vec<u8> {
    let mut made = Made::new(410);
    let mut data = vec![0, 0, 2, 0, 0, 0, 0, 0];
    data.extend(2u32.to_le_bytes());
    data.extend(0u32.to_le_bytes());
    data.extend([2u64, 3].iter().flat_map(|it| it.to_le_bytes()));
    let composed = made.block(b"##CA", &[0], &data);
    let channels = [Channel { composed, unit: "kPa", ..plain("map", 0, 8, 0, 16) }];
    let row = |row: u16| (0..6).flat_map(|it| (row * 100 + it).to_le_bytes()).collect();
    made.rows(&channels, 0, &(0..4).map(row).collect::<Vec<_>>());
    made.bytes
}

/// A structure with two members, one of which has the name of the structure in front.
pub fn structure() -> Vec<u8> {
    let mut made = Made::new(410);
    let composed = made.channels(&[plain("Frame.id", 0, 8, 0, 16), plain("length", 0, 10, 0, 8)]);
    let channels = [Channel { composed, ..plain("Frame", 10, 8, 0, 24) }];
    made.rows(&channels, 0, &[vec![1, 2, 3], vec![4, 5, 6]]);
    made.bytes
}

/// Texts of all codings, of fixed length, up to a length and of any length.
pub fn strings() -> Vec<u8> {
    let mut made = Made::new(410);
    let (texts, offsets) = made.texts(&["", "ä", "a longer text", "z"]);
    let size = made.channel(plain("size", 0, 8, 0, 8));
    let channels = [
        Channel { kind: 5, data: size, ..plain("bounded", 7, 9, 0, 32) },
        plain("latin", 6, 13, 0, 24),
        plain("wide", 8, 16, 0, 48),
        plain("wide big", 9, 22, 0, 48),
        Channel {
            kind: 1,
            data: texts,
            comment: "<CNcomment><TX>a &lt; b</TX></CNcomment>",
            ..plain("any", 7, 28, 0, 64)
        },
    ];
    let row = |row: usize| {
        let text = format!("a{row}°");
        let wide: Vec<_> = text.encode_utf16().collect();
        let mut all = vec![row as u8];
        all.extend(b"abcd");
        all.extend([b'b', 0xb0, b'0' + row as u8]);
        all.extend(wide.iter().flat_map(|it| it.to_le_bytes()));
        all.extend(wide.iter().flat_map(|it| it.to_be_bytes()));
        all.extend(offsets[row].to_le_bytes());
        all
    };
    made.rows(&channels, 0, &(0..4).map(row).collect::<Vec<_>>());
    made.bytes
}

/// Columns of their own with the master in another group, and invalidation bits in blocks of their own (4.20).
pub fn columns() -> Vec<u8> {
    let mut made = Made::new(420);
    let time = Channel { kind: 2, sync: 1, unit: "s", ..plain("t", 4, 0, 0, 64) };
    let first = made.channels(&[time]);
    let master = made.group(Group { first, rows: 6, values: 8, ..Group::default() });
    let first = made.channels(&[Channel { flags: 2, invalid: 1, ..plain("v", 2, 0, 0, 16) }]);
    let group = made.group(Group {
        first,
        rows: 6,
        values: 2,
        invalid: 1,
        flags: 8,
        remote: master,
        ..Group::default()
    });
    let column: Vec<u8> = (0..6i16).flat_map(|it| (it * -7).to_le_bytes()).collect();
    let blocks = [made.block(b"##DV", &[], &column[..8]), made.block(b"##DV", &[], &column[8..])];
    // The second block has no invalid value, so it has no bits.
    let bits = made.block(b"##DI", &[], &[0, 2, 0, 2]);
    let mut data = (1u32 << 31).to_le_bytes().to_vec();
    data.extend(2u32.to_le_bytes());
    data.extend([0u64, 8].iter().flat_map(|it| it.to_le_bytes()));
    let list = made.block(b"##LD", &[0, blocks[0], blocks[1], bits, 0], &data);
    let next = made.data_group(0, group, list, 0);
    let times: Vec<u8> = (0..6).flat_map(|it| (f64::from(it) * 0.5).to_le_bytes()).collect();
    let data = made.block(b"##DV", &[], &times);
    made.data_group(next, master, data, 0);
    made.bytes
}

/// A file whose measurement was cut off: no count of rows, no length of the data, half a row at the end.
pub fn unfinalised() -> Vec<u8> {
    let mut made = Made::new(410);
    let time = Channel { kind: 2, sync: 1, unit: "s", ..plain("t", 4, 0, 0, 64) };
    let first = made.channels(&[time, plain("v", 0, 8, 0, 8)]);
    let group = made.group(Group { first, values: 9, ..Group::default() });
    let at = made.data_group(0, group, 0, 0);
    let data = made.block(b"##DT", &[], &[]);
    made.put(at + 24 + 16, data);
    for row in 0..5u8 {
        made.bytes.extend(f64::from(row).to_le_bytes());
        made.bytes.push(row + 10);
    }
    made.bytes.extend([1, 2, 3]);
    made.bytes[..8].copy_from_slice(b"UnFinMF ");
    made.bytes[60] = 0b101;
    made.bytes
}
