//! Makes files of MDF 4 block by block, also such as few tools write.
#![allow(dead_code)]

use std::io::Write as _;

/// A file that grows.
pub struct Made {
    pub bytes: Vec<u8>,
}

/// A block CN: what a test says of a channel; the rest is zero.
#[derive(Clone, Copy, Default)]
pub struct Channel<'t> {
    pub next: u64,
    pub composed: u64,
    pub name: &'t str,
    pub conversion: u64,
    pub data: u64,
    pub unit: &'t str,
    /// XML.
    pub comment: &'t str,
    pub kind: u8,
    pub sync: u8,
    pub data_type: u8,
    pub bit: u8,
    pub byte: u32,
    pub bits: u32,
    pub flags: u32,
    pub invalid: u32,
}

/// A block CG.
#[derive(Clone, Copy, Default)]
pub struct Group<'t> {
    pub next: u64,
    pub first: u64,
    pub name: &'t str,
    /// The group that has the master.
    pub remote: u64,
    pub number: u64,
    pub rows: u64,
    pub flags: u16,
    pub values: u32,
    pub invalid: u32,
}

impl Made {
    pub fn new(version: u16) -> Self {
        let mut bytes = b"MDF     ".to_vec();
        bytes.extend(format!("{}.{:02}    ", version / 100, version % 100).bytes());
        bytes.extend(b"made    ");
        bytes.resize(28, 0);
        bytes.extend(version.to_le_bytes());
        bytes.resize(64, 0);
        let mut made = Self { bytes };
        made.block(b"##HD", &[0; 6], &[0; 32]);
        let comment = made.xml("<FHcomment><TX>made</TX><tool_id>made</tool_id><tool_vendor>made</tool_vendor><tool_version>1</tool_version></FHcomment>");
        let history = made.block(b"##FH", &[0, comment], &[0; 16]);
        made.put(64 + 24 + 8, history);
        made
    }

    pub fn put(&mut self, at: u64, number: u64) {
        self.bytes[at as usize..][..8].copy_from_slice(&number.to_le_bytes());
    }

    pub fn block(&mut self, id: &[u8; 4], links: &[u64], data: &[u8]) -> u64 {
        let at = self.bytes.len() as u64;
        let length = 24 + 8 * links.len() + data.len();
        self.bytes.extend(id);
        self.bytes.extend([0; 4]);
        self.bytes.extend((length as u64).to_le_bytes());
        self.bytes.extend((links.len() as u64).to_le_bytes());
        self.bytes.extend(links.iter().flat_map(|it| it.to_le_bytes()));
        self.bytes.extend(data);
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
        at
    }

    pub fn text(&mut self, text: &str) -> u64 {
        if text.is_empty() {
            return 0;
        }
        self.block(b"##TX", &[], &[text.as_bytes(), &[0]].concat())
    }

    pub fn xml(&mut self, text: &str) -> u64 {
        if text.is_empty() {
            return 0;
        }
        self.block(b"##MD", &[], &[text.as_bytes(), &[0]].concat())
    }

    pub fn channel(&mut self, it: Channel) -> u64 {
        let texts = [self.text(it.name), self.text(it.unit), self.xml(it.comment)];
        let mut data = vec![it.kind, it.sync, it.data_type, it.bit];
        for number in [it.byte, it.bits, it.flags, it.invalid] {
            data.extend(number.to_le_bytes());
        }
        data.resize(72, 0);
        let links = [it.next, it.composed, texts[0], 0, it.conversion, it.data, texts[1], texts[2]];
        self.block(b"##CN", &links, &data)
    }

    /// Channels of one group; says where the first is.
    pub fn channels(&mut self, all: &[Channel]) -> u64 {
        all.iter().rev().fold(0, |next, it| self.channel(Channel { next, ..*it }))
    }

    /// A block CC with its references and numbers.
    pub fn conversion(&mut self, kind: u8, references: &[u64], numbers: &[f64]) -> u64 {
        let numbers: Vec<_> = numbers.iter().map(|it| it.to_bits()).collect();
        self.named_conversion("", kind, references, &numbers)
    }

    pub fn named_conversion(&mut self, name: &str, kind: u8, references: &[u64], numbers: &[u64]) -> u64 {
        let name = self.text(name);
        let mut data = vec![kind, 0, 0, 0];
        data.extend((references.len() as u16).to_le_bytes());
        data.extend((numbers.len() as u16).to_le_bytes());
        data.extend([0; 16]);
        data.extend(numbers.iter().flat_map(|it| it.to_le_bytes()));
        self.block(b"##CC", &[&[name, 0, 0, 0], references].concat(), &data)
    }

    pub fn group(&mut self, it: Group) -> u64 {
        let name = self.text(it.name);
        let mut data = [it.number, it.rows].iter().flat_map(|it| it.to_le_bytes()).collect::<Vec<_>>();
        data.extend(it.flags.to_le_bytes());
        data.extend([0; 6]);
        data.extend(it.values.to_le_bytes());
        data.extend(it.invalid.to_le_bytes());
        let links = [it.next, it.first, name, 0, 0, 0, it.remote];
        let count = if it.remote == 0 { 6 } else { 7 };
        self.block(b"##CG", &links[..count], &data)
    }

    /// A block DG; the first one is that of the file.
    pub fn data_group(&mut self, next: u64, group: u64, data: u64, number_bytes: u8) -> u64 {
        let at = self.block(b"##DG", &[next, group, data, 0], &[number_bytes, 0, 0, 0, 0, 0, 0, 0]);
        self.put(64 + 24, at);
        at
    }

    /// A packed block.
    pub fn packed(&mut self, kind: &[u8; 2], row: u32, contents: &[u8]) -> u64 {
        let turned: Vec<u8> = match row as usize {
            0 => contents.to_vec(),
            row => {
                let (whole, rest) = contents.split_at(contents.len() / row * row);
                let column = |at: usize| whole[at..].iter().step_by(row).copied();
                (0..row).flat_map(column).chain(rest.iter().copied()).collect()
            }
        };
        let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        packer.write_all(&turned).expect("memory");
        let packed = packer.finish().expect("memory");
        let mut data = [&kind[..], &[(row > 0).into(), 0], &row.to_le_bytes()].concat();
        data.extend((contents.len() as u64).to_le_bytes());
        data.extend((packed.len() as u64).to_le_bytes());
        data.extend(packed);
        self.block(b"##DZ", &[], &data)
    }

    /// A block DL of blocks with their offsets.
    pub fn list(&mut self, next: u64, blocks: &[(u64, u64)]) -> u64 {
        let links: Vec<_> = [next].into_iter().chain(blocks.iter().map(|it| it.0)).collect();
        let mut data = vec![0; 4];
        data.extend((blocks.len() as u32).to_le_bytes());
        data.extend(blocks.iter().flat_map(|it| it.1.to_le_bytes()));
        self.block(b"##DL", &links, &data)
    }

    /// A block of texts: each with its length in front.
    pub fn texts(&mut self, texts: &[&str]) -> (u64, Vec<u64>) {
        let (mut data, mut offsets) = (Vec::new(), Vec::new());
        for text in texts {
            offsets.push(data.len() as u64);
            data.extend((text.len() as u32 + 1).to_le_bytes());
            data.extend(text.bytes().chain([0]));
        }
        (self.block(b"##SD", &[], &data), offsets)
    }

    /// One group with one block of rows: the channels, and the bytes of each row without the time, which is a tenth of a second each.
    pub fn rows(&mut self, channels: &[Channel], invalid: u32, rows: &[Vec<u8>]) {
        let time =
            Channel { name: "t", unit: "s", kind: 2, sync: 1, data_type: 4, bits: 64, ..Channel::default() };
        let all: Vec<_> = std::iter::once(time).chain(channels.iter().copied()).collect();
        let first = self.channels(&all);
        let values = 8 + rows[0].len() as u32 - invalid;
        let count = rows.len() as u64;
        let group =
            self.group(Group { first, rows: count, values, invalid, name: "made", ..Group::default() });
        let row = |(row, it): (usize, &Vec<u8>)| [&(row as f64 / 10.0).to_le_bytes()[..], it].concat();
        let data: Vec<u8> = rows.iter().enumerate().flat_map(row).collect();
        let data = self.block(b"##DT", &[], &data);
        self.data_group(0, group, data, 0);
    }
}
