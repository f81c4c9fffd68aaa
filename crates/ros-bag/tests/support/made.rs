//! Makes messages and bags by the published layouts, independently of the reader.
#![allow(dead_code, reason = "each test takes some of it")]

use std::path::Path;

use rusqlite::Connection;

/// A message in CDR.
pub struct Cdr {
    pub bytes: Vec<u8>,
    big: bool,
    most: usize,
}

impl Cdr {
    /// By the second byte of the header: 0 and 1 are plain, 6 and 7 of the second version, 8 and 9 delimited.
    pub fn new(kind: u8) -> Self {
        Cdr { bytes: vec![0, kind, 0, 0], big: kind & 1 == 0, most: if kind < 6 { 8 } else { 4 } }
    }

    /// A number of these bytes, the lowest first.
    pub fn put<const N: usize>(&mut self, little: [u8; N]) -> &mut Self {
        while !(self.bytes.len() - 4).is_multiple_of(N.min(self.most)) {
            self.bytes.push(0xee);
        }
        let mut bytes = little;
        if self.big {
            bytes.reverse();
        }
        self.bytes.extend(bytes);
        self
    }

    pub fn count(&mut self, count: u32) -> &mut Self {
        self.put(count.to_le_bytes())
    }

    pub fn double(&mut self, value: f64) -> &mut Self {
        self.put(value.to_le_bytes())
    }

    pub fn text(&mut self, text: &str) -> &mut Self {
        self.count(text.len() as u32 + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
        self
    }
}

/// The definition of the messages of [`bag`].
pub const WHEELS: &str = "std_msgs/Header header\nWheel[] wheels\nfloat64[2] speed\nstring<=8 name\n\
================================================================================\n\
MSG: demo/Wheel\nuint8 FRONT=1\nint16 side  # left or right\nfloat32 slip\n";

/// One of these messages.
pub fn wheels(second: u32) -> Vec<u8> {
    let mut cdr = Cdr::new(1);
    cdr.count(second).count(500_000_000).text("base").count(2);
    for side in [1i16, -2] {
        cdr.put(side.to_le_bytes()).put(0.25f32.to_le_bytes());
    }
    cdr.double(1.5).double(f64::from(second)).text("wet");
    cdr.bytes
}

/// The database of a bag with some messages, with definitions and without.
pub fn bag(path: &Path, defined: bool) -> rusqlite::Result<()> {
    let bag = Connection::open(path)?;
    bag.execute_batch(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
         CREATE INDEX timestamp_idx ON messages (timestamp ASC);",
    )?;
    if defined {
        bag.execute_batch(
            "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL, \
             encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);",
        )?;
        let add = "INSERT INTO message_definitions VALUES (1, 'demo/msg/Wheels', 'ros2msg', ?1, '')";
        bag.execute(add, [WHEELS])?;
        bag.execute("INSERT INTO topics VALUES (1, '/wheels', 'demo/msg/Wheels', 'cdr')", [])?;
    }
    bag.execute("INSERT INTO topics VALUES (2, '/steer', 'std_msgs/msg/Float64', 'cdr')", [])?;
    for second in 0..20u32 {
        let add = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
        let time = i64::from(second) * 1_000_000_000 + 500_000_700;
        if defined {
            bag.execute(add, (1, time, wheels(second)))?;
        }
        let mut steer = Cdr::new(1);
        bag.execute(add, (2, time, &steer.double(0.1 * f64::from(second)).bytes))?;
    }
    bag.close().map_err(|(_, error)| error)
}

/// The definition of a wheel in IDL.
pub const IDL: &str = "#include \"x.idl\"\nmodule demo {\n  module msg {\n    typedef double double__2[2];\n    enum Side { LEFT, RIGHT };\n    \
    const unsigned long N = 0x3;\n    @verbatim (language=\"comment\", text=\"a } ; comment\")\n    struct Wheel {\n      @default (value=1.0)\n      double__2 slip;\n      \
    demo::msg::Side side; // which\n      sequence<long long, N> counts;\n      octet raw[N][2];\n      string<4> name;\n    };\n  };\n};\n";
