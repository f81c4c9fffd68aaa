//! Makes a file of MDF 3 block by block: mixed groups with a number at both ends of each record, all types, all conversions.
#![allow(dead_code)]

/// A file that grows.
struct Made {
    bytes: Vec<u8>,
    /// Whether the highest byte of a number comes first, in blocks and in values of no order of their own.
    big: bool,
}

/// A field of a block or of a record.
enum Field<'t> {
    U16(u16),
    U32(u32),
    F64(f64),
    /// A text in so many bytes.
    Text(&'t str, usize),
}
use Field::{F64, Text, U16, U32};

/// A channel: name, first bit, bits, type of data, conversion; a link CD and a rate, both mostly 0.
struct Channel(&'static str, u16, u16, u16, u32, u32, f64);

impl Made {
    fn number<const N: usize>(&self, mut bytes: [u8; N]) -> Vec<u8> {
        if self.big {
            bytes.reverse();
        }
        bytes.to_vec()
    }

    fn fields(&self, fields: &[Field]) -> Vec<u8> {
        let field = |it: &Field| match it {
            U16(it) => self.number(it.to_le_bytes()),
            U32(it) => self.number(it.to_le_bytes()),
            F64(it) => self.number(it.to_le_bytes()),
            Text(text, length) => {
                let mut bytes: Vec<u8> = text.chars().map(|it| it as u8).collect();
                bytes.resize(*length, 0);
                bytes
            }
        };
        fields.iter().flat_map(field).collect()
    }

    fn block(&mut self, id: &str, fields: &[Field]) -> u32 {
        let at = self.bytes.len() as u32;
        let fields = self.fields(fields);
        let length = self.number((fields.len() as u16 + 4).to_le_bytes());
        self.bytes.extend([id.as_bytes(), &length, &fields].concat());
        at
    }

    fn text(&mut self, text: &str) -> u32 {
        self.block("TX", &[Text(text, text.chars().count() + 1)])
    }

    fn conversion(&mut self, kind: u16, count: u16, parameters: &[Field]) -> u32 {
        let head = self.fields(&[U16(0), F64(0.0), F64(0.0), Text("°C", 20), U16(kind), U16(count)]);
        let at = self.block("CC", &[]);
        let body = self.fields(parameters);
        let length = self.number((4 + head.len() as u16 + body.len() as u16).to_le_bytes());
        self.bytes[at as usize + 2..].copy_from_slice(&length);
        self.bytes.extend([head, body].concat());
        at
    }

    /// Channels of a group, the first one as its time.
    fn channels(&mut self, all: &[Channel]) -> u32 {
        let mut next = 0;
        for (place, it) in all.iter().enumerate().rev() {
            let name = self.text(it.0);
            // A name and a start that are too long for their fields: the rest is in a text, and in an offset of bytes.
            let (bits, bytes) = if it.1 > 32 { (it.1 % 8, it.1 / 8) } else { (it.1, 0) };
            next = self.block(
                "CN",
                &[
                    U32(next),
                    U32(it.4),
                    U32(0),
                    U32(it.5),
                    U32(0),
                    U16((place == 0).into()),
                    Text(it.0, 32),
                    Text("what it is", 128),
                    U16(bits),
                    U16(it.2),
                    U16(it.3),
                    U16(0),
                    F64(0.0),
                    F64(0.0),
                    F64(it.6),
                    U32(name),
                    U32(0),
                    U16(bytes),
                ],
            );
        }
        next
    }
}

/// The bits of a raw value of 1 byte through each conversion of MDF 3, and what the file has around them.
pub fn old(big: bool) -> Vec<u8> {
    let mut made = Made { bytes: b"MDF     3.30    made    ".to_vec(), big };
    let head = made.fields(&[U16(big.into()), U16(0), U16(330), U16(0)]);
    made.bytes.extend(head);
    made.bytes.resize(64, 0);
    let fields = [
        U32(0),
        U32(0),
        U32(0),
        U16(2),
        Text("29:02:2020", 10),
        Text("12:30:15", 8),
        Text("me", 32),
        Text("", 32),
        Text("", 32),
        Text("", 32),
    ];
    made.block("HD", &fields);
    let converted = converted(&mut made);
    let mixed = mixed(&mut made, converted);
    let comment = made.text("a file\nof MDF 3");
    for (at, link) in [(68, mixed), (72, comment)] {
        let link = made.number(link.to_le_bytes());
        made.bytes[at..at + 4].copy_from_slice(&link);
    }
    made.bytes
}

/// One group with all conversions of raw values 0 to 5, over times that are in no record.
fn converted(made: &mut Made) -> u32 {
    let texts: Vec<_> = ["other", "low", "high"].map(|it| made.text(it)).into();
    let scale = made.text("\"0.5*{X}+1\"");
    let seven = |all: [f64; 7]| all.map(F64);
    let points = [0.0, 10.0, 2.0, 20.0, 4.0, 0.0].map(F64);
    let conversions = [
        ("linear", made.conversion(0, 2, &[F64(-1.5), F64(0.25)])),
        ("lines", made.conversion(1, 3, &points)),
        ("steps", made.conversion(2, 3, &points)),
        ("polynomial", made.conversion(6, 6, &seven([-7.0, 2.0, 0.5, 3.0, 0.25, 0.5, 0.0])[..6])),
        ("exponential", made.conversion(7, 7, &seven([4.0, 2.0, 1.0, 0.0, 0.0, 3.0, 0.5]))),
        ("logarithmic", made.conversion(8, 7, &seven([0.0, 0.0, 9.0, -2.0, 0.5, 30.0, -1.0]))),
        ("rational", made.conversion(9, 6, &seven([0.5, 2.0, 3.0, 0.0, 1.0, 7.0, 0.0])[..6])),
        ("formula", made.conversion(10, 256, &[Text("X1*2.5-3/(X1+1)", 256)])),
        ("keys", made.conversion(11, 2, &[F64(3.0), Text("drei°", 32), F64(1.0), Text("one", 32)])),
        (
            "spans",
            made.conversion(
                12,
                3,
                &[
                    F64(0.0),
                    F64(0.0),
                    U32(texts[0]),
                    F64(1.0),
                    F64(2.0),
                    U32(texts[1]),
                    F64(4.0),
                    F64(4.0),
                    U32(texts[2]),
                ],
            ),
        ),
        (
            "scaled",
            made.conversion(12, 2, &[F64(0.0), F64(0.0), U32(scale), F64(5.0), F64(5.0), U32(texts[1])]),
        ),
        ("none", made.conversion(0xffff, 0, &[])),
    ];
    let mut channels = vec![Channel("t", 0, 0, 0, 0, 0, 0.5)];
    channels.extend(conversions.map(|(name, at)| Channel(name, 0, 8, 0, at, 0, 0.0)));
    channels.push(Channel("beyond", 8, 8, 0, 0, 0, 0.0));
    let first = made.channels(&channels);
    let group = made.block("CG", &[U32(0), U32(first), U32(0), U16(0), U16(14), U16(1), U32(6)]);
    let data = made.bytes.len() as u32;
    made.bytes.extend(0..6u8);
    made.block("DG", &[U32(0), U32(group), U32(0), U32(data), U16(1), U16(0), U32(0)])
}

/// Two groups in one piece of data: values of all types with their order of bytes, and a slower text.
fn mixed(made: &mut Made, next: u32) -> u32 {
    let array = made.block("CD", &[U16(1), U16(0)]);
    let time = || Channel("t", 0, 64, 3, 0, 0, 0.0);
    let fast = made.channels(&[
        time(),
        Channel("u5 with a name of more than 32 letters", 67, 5, 0, 0, 0, 0.0),
        Channel("i11", 72, 11, 14, 0, 0, 0.0),
        Channel("be u16", 88, 16, 9, 0, 0, 0.0),
        Channel("be i32", 104, 32, 10, 0, 0, 0.0),
        Channel("float", 136, 32, 2, 0, 0, 0.0),
        Channel("be double", 168, 64, 12, 0, 0, 0.0),
        Channel("bytes", 168, 64, 8, 0, 0, 0.0),
        Channel("array", 168, 64, 0, 0, array, 0.0),
    ]);
    let slow = made.channels(&[time(), Channel("word", 64, 48, 7, 0, 0, 0.0)]);
    let slow = made.block("CG", &[U32(0), U32(slow), U32(0), U16(9), U16(2), U16(14), U32(3)]);
    let name = made.text("fast\nSource: made");
    let fast = made.block("CG", &[U32(slow), U32(fast), U32(name), U16(4), U16(9), U16(29), U32(6)]);
    let data = made.bytes.len() as u32;
    for row in 0..6u8 {
        let time = made.fields(&[F64(f64::from(row) / 10.0)]);
        if row % 2 == 0 {
            let word = [b'w', b'0' + row, 0xb0, 0, b'x', b'x'];
            made.bytes.extend([&[9][..], &time, &word, &[9]].concat());
        }
        let float = made.number((f32::from(row) / 3.0).to_le_bytes());
        made.bytes.extend([&[4][..], &time].concat());
        made.bytes.push((row + 1) << 3 | 5);
        made.bytes.extend((-1i16 - i16::from(row)).to_le_bytes());
        made.bytes.extend((u16::from(row) * 1000).to_be_bytes());
        made.bytes.extend((-70_000 * i32::from(row)).to_be_bytes());
        made.bytes.extend(float);
        made.bytes.extend((f64::from(row) * 0.1 - 1.0).to_be_bytes());
        made.bytes.push(4);
    }
    made.block("DG", &[U32(next), U32(fast), U32(0), U32(data), U16(2), U16(2), U32(0)])
}
