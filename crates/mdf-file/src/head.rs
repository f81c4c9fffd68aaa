//! Makes what stands in front of the rows of a file that is written: who wrote it, and what its channels are.

use crate::column::{About, Column, Type};

/// The beginning of a file.
pub(crate) struct Head {
    pub bytes: Vec<u8>,
    pub offsets: FileOffsets,
    /// Bytes of a row.
    pub record: u32,
}

/// Where numbers are that change with the rows.
pub(crate) struct FileOffsets {
    /// The count of rows.
    pub rows: u64,
    /// Where the link to the rows is, and the head of their list, which it leads to when there are rows.
    pub data: (u64, u64),
    /// The same for each column of texts.
    pub texts: Vec<(u64, u64)>,
}

/// Adds a block, which begins at a multiple of 8 bytes, and says where.
pub(crate) fn block(all: &mut Vec<u8>, id: &[u8; 4], links: &[u64], data: &[u8]) -> u64 {
    let at = all.len() as u64;
    let length = 24 + 8 * links.len() + data.len();
    all.extend(id);
    all.extend([0; 4]);
    all.extend((length as u64).to_le_bytes());
    all.extend((links.len() as u64).to_le_bytes());
    all.extend(links.iter().flat_map(|it| it.to_le_bytes()));
    all.extend(data);
    all.resize(all.len().next_multiple_of(8), 0);
    at
}

/// Adds a text, `TX` or `MD`; an empty one is no text.
fn text(all: &mut Vec<u8>, id: &[u8; 4], text: &str) -> u64 {
    if text.is_empty() {
        return 0;
    }
    // A zero would end it.
    let text: Vec<u8> = text.bytes().filter(|it| *it != 0).chain([0]).collect();
    block(all, id, &[], &text)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A channel as a block CN knows it.
struct ChannelDescription<'c> {
    name: &'c str,
    unit: &'c str,
    comment: &'c str,
    /// Its kind, what it is a master of, its type of data, its first bit.
    kinds: [u8; 4],
    /// Its first byte.
    byte: u32,
    bits: u32,
}

impl ChannelDescription<'_> {
    fn add(&self, all: &mut Vec<u8>, next: u64) -> u64 {
        let texts = [self.name, self.unit, self.comment].map(|it| text(all, b"##TX", it));
        let mut data = self.kinds.to_vec();
        data.extend(self.byte.to_le_bytes());
        data.extend(self.bits.to_le_bytes());
        // Flags, invalidation bit, precision, attachments and limits: none.
        data.resize(24 + 6 * 8, 0);
        block(all, b"##CN", &[next, 0, texts[0], 0, 0, 0, texts[1], texts[2]], &data)
    }
}

impl Head {
    pub fn new(about: &About, columns: &[Column]) -> Self {
        let mut all = identification(about);
        let header = block(&mut all, b"##HD", &[0; 6], &[0; 32]);
        let mut byte = 8;
        let descriptions: Vec<_> = columns
            .iter()
            .map(|column| {
                let description = describe(column, byte);
                byte += column.kind.bytes();
                description
            })
            .collect();
        // From the last to the first, since each has a link to the next.
        let (mut next, mut texts) = (0, Vec::new());
        for (column, description) in columns.iter().zip(&descriptions).rev() {
            let list = (column.kind == Type::Text).then(|| list(&mut all, 0));
            next = description.add(&mut all, next);
            // The sixth link of the channel.
            texts.extend(list.map(|list| (next + 24 + 5 * 8, list)));
        }
        texts.reverse();
        let kinds = [2, 1, 4, 0];
        let time =
            ChannelDescription { name: "time", unit: "s", comment: "", kinds, byte: 0, bits: 64 };
        let first = time.add(&mut all, next);
        let name = text(&mut all, b"##TX", about.group.as_deref().unwrap_or_default());
        let mut data = [0; 32];
        data[24..28].copy_from_slice(&byte.to_le_bytes());
        let group = block(&mut all, b"##CG", &[0, first, name, 0, 0, 0], &data);
        let rows = list(&mut all, 1);
        let data = block(&mut all, b"##DG", &[0, group, 0, 0], &[0; 8]);
        let history = history(&mut all, about);
        let comment = text(&mut all, b"##MD", &comment(about));
        for (place, link) in [(0, data), (1, history), (5, comment)] {
            put(&mut all, header + 24 + 8 * place, &link.to_le_bytes());
        }
        if let Some(start) = about.start {
            put(&mut all, header + 72, &start.nanoseconds.to_le_bytes());
            put(&mut all, header + 84, &[start.is_local.into()]);
        }
        // Behind the number of records; the third link of the data.
        let offsets =
            FileOffsets { rows: group + 24 + 6 * 8 + 8, data: (data + 24 + 2 * 8, rows), texts };
        Self { bytes: all, offsets, record: byte }
    }
}

fn put(all: &mut [u8], at: u64, bytes: &[u8]) {
    all[at as usize..][..bytes.len()].copy_from_slice(bytes);
}

fn identification(about: &About) -> Vec<u8> {
    let mut all = b"MDF     4.10    ".to_vec();
    let tool = about.tool.as_ref().map_or("", |it| &it.0);
    all.extend(tool.bytes().filter(u8::is_ascii_graphic).chain([b' '; 8]).take(8));
    all.resize(28, 0);
    all.extend(410u16.to_le_bytes());
    all.resize(64, 0);
    all
}

/// The head of a list without blocks, of transposed rows (1) or of texts (0).
fn list(all: &mut Vec<u8>, packing: u8) -> u64 {
    block(all, b"##HL", &[0], &[0, 0, packing, 0, 0, 0, 0, 0])
}

/// Who wrote the file, which the standard wants to know.
fn history(all: &mut Vec<u8>, about: &About) -> u64 {
    let (tool, version) = about.tool.as_ref().map_or(("mdf-file", ""), |it| (&it.0, &it.1));
    let written = format!(
        "<FHcomment><TX>written</TX><tool_id>{0}</tool_id><tool_vendor>{0}</tool_vendor>\
         <tool_version>{1}</tool_version></FHcomment>",
        escaped(tool),
        escaped(version)
    );
    let written = text(all, b"##MD", &written);
    let mut data = about.start.map_or(0, |it| it.nanoseconds).to_le_bytes().to_vec();
    data.resize(16, 0);
    block(all, b"##FH", &[0, written], &data)
}

/// What the file is, as XML.
fn comment(about: &About) -> String {
    let property = |(name, value): &(String, String)| {
        format!("<e name=\"{}\">{}</e>", escaped(name), escaped(value))
    };
    let properties: String = about.properties.iter().map(property).collect();
    let comment = escaped(about.comment.as_deref().unwrap_or_default());
    format!(
        "<HDcomment><TX>{comment}</TX><common_properties>{properties}</common_properties></HDcomment>"
    )
}

fn describe(column: &Column, byte: u32) -> ChannelDescription<'_> {
    let kinds = match column.kind {
        Type::Real => [0, 0, 4, 0],
        Type::Signed => [0, 0, 2, 0],
        Type::Unsigned | Type::Boolean => [0, 0, 0, 0],
        Type::Text => [1, 0, 7, 0],
    };
    ChannelDescription {
        name: &column.name,
        unit: column.unit.as_deref().unwrap_or_default(),
        comment: column.comment.as_deref().unwrap_or_default(),
        kinds,
        byte,
        bits: 8 * column.kind.bytes(),
    }
}
