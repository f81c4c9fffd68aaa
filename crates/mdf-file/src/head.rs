//! Makes what stands in front of the rows of a file that is written: who wrote it, and what its channels are.

use crate::column::{MdfColumn, MdfColumnType, MdfDescription};

/// The beginning of a file.
pub(crate) struct FileHead {
    pub bytes: Vec<u8>,
    pub offsets: PatchOffsets,
    /// Bytes of a row.
    pub record: u32,
}

/// Where numbers are that change with the rows.
pub(crate) struct PatchOffsets {
    /// The count of rows.
    pub rows: u64,
    /// Where the link to the rows is, and the head of their list, which it leads to when there are rows.
    pub data: (u64, u64),
    /// The same for each column of texts.
    pub texts: Vec<(u64, u64)>,
}

/// Adds a block, which begins at a multiple of 8 bytes, and says where.
pub(crate) fn append_block(all: &mut Vec<u8>, id: &[u8; 4], links: &[u64], data: &[u8]) -> u64 {
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
fn append_text_block(all: &mut Vec<u8>, id: &[u8; 4], text: &str) -> u64 {
    if text.is_empty() {
        return 0;
    }
    // A zero would end it.
    let text: Vec<u8> = text.bytes().filter(|it| *it != 0).chain([0]).collect();
    append_block(all, id, &[], &text)
}

fn xml_escaped(text: &str) -> String {
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
    fn append_channel_block(&self, all: &mut Vec<u8>, next: u64) -> u64 {
        let texts = [self.name, self.unit, self.comment].map(|it| append_text_block(all, b"##TX", it));
        let mut data = self.kinds.to_vec();
        data.extend(self.byte.to_le_bytes());
        data.extend(self.bits.to_le_bytes());
        // Flags, invalidation bit, precision, attachments and limits: none.
        data.resize(24 + 6 * 8, 0);
        append_block(all, b"##CN", &[next, 0, texts[0], 0, 0, 0, texts[1], texts[2]], &data)
    }
}

impl FileHead {
    pub fn new(about: &MdfDescription, columns: &[MdfColumn]) -> Self {
        let mut all = identification_block(about);
        let header = append_block(&mut all, b"##HD", &[0; 6], &[0; 32]);
        let mut byte = 8;
        let descriptions: Vec<_> = columns
            .iter()
            .map(|column| {
                let description = describe_column(column, byte);
                byte += column.kind.record_bytes();
                description
            })
            .collect();
        // From the last to the first, since each has a link to the next.
        let (mut next, mut texts) = (0, Vec::new());
        for (column, description) in columns.iter().zip(&descriptions).rev() {
            let list = (column.kind == MdfColumnType::Text).then(|| append_list_header(&mut all, 0));
            next = description.append_channel_block(&mut all, next);
            // The sixth link of the channel.
            texts.extend(list.map(|list| (next + 24 + 5 * 8, list)));
        }
        texts.reverse();
        let kinds = [2, 1, 4, 0];
        let time = ChannelDescription { name: "time", unit: "s", comment: "", kinds, byte: 0, bits: 64 };
        let first = time.append_channel_block(&mut all, next);
        let name = append_text_block(&mut all, b"##TX", about.group.as_deref().unwrap_or_default());
        let mut data = [0; 32];
        data[24..28].copy_from_slice(&byte.to_le_bytes());
        let group = append_block(&mut all, b"##CG", &[0, first, name, 0, 0, 0], &data);
        let rows = append_list_header(&mut all, 1);
        let data = append_block(&mut all, b"##DG", &[0, group, 0, 0], &[0; 8]);
        let history = append_file_history(&mut all, about);
        let comment = append_text_block(&mut all, b"##MD", &xml_file_comment(about));
        for (place, link) in [(0, data), (1, history), (5, comment)] {
            overwrite_bytes(&mut all, header + 24 + 8 * place, &link.to_le_bytes());
        }
        if let Some(start) = about.start {
            overwrite_bytes(&mut all, header + 72, &start.nanoseconds.to_le_bytes());
            overwrite_bytes(&mut all, header + 84, &[start.is_local.into()]);
        }
        // Behind the number of records; the third link of the data.
        let offsets = PatchOffsets { rows: group + 24 + 6 * 8 + 8, data: (data + 24 + 2 * 8, rows), texts };
        Self { bytes: all, offsets, record: byte }
    }
}

fn overwrite_bytes(all: &mut [u8], at: u64, bytes: &[u8]) {
    all[at as usize..][..bytes.len()].copy_from_slice(bytes);
}

fn identification_block(about: &MdfDescription) -> Vec<u8> {
    let mut all = b"MDF     4.10    ".to_vec();
    let tool = about.tool.as_ref().map_or("", |it| &it.0);
    all.extend(tool.bytes().filter(u8::is_ascii_graphic).chain([b' '; 8]).take(8));
    all.resize(28, 0);
    all.extend(410u16.to_le_bytes());
    all.resize(64, 0);
    all
}

/// The head of a list without blocks, of transposed rows (1) or of texts (0).
fn append_list_header(all: &mut Vec<u8>, packing: u8) -> u64 {
    append_block(all, b"##HL", &[0], &[0, 0, packing, 0, 0, 0, 0, 0])
}

/// Who wrote the file, which the standard wants to know.
fn append_file_history(all: &mut Vec<u8>, about: &MdfDescription) -> u64 {
    let (tool, version) = about.tool.as_ref().map_or(("mdf-file", ""), |it| (&it.0, &it.1));
    let written = format!(
        "<FHcomment><TX>written</TX><tool_id>{0}</tool_id><tool_vendor>{0}</tool_vendor>\
         <tool_version>{1}</tool_version></FHcomment>",
        xml_escaped(tool),
        xml_escaped(version)
    );
    let written = append_text_block(all, b"##MD", &written);
    let mut data = about.start.map_or(0, |it| it.nanoseconds).to_le_bytes().to_vec();
    data.resize(16, 0);
    append_block(all, b"##FH", &[0, written], &data)
}

/// What the file is, as XML.
fn xml_file_comment(about: &MdfDescription) -> String {
    let property = |(name, value): &(String, String)| {
        format!("<e name=\"{}\">{}</e>", xml_escaped(name), xml_escaped(value))
    };
    let properties: String = about.properties.iter().map(property).collect();
    let comment = xml_escaped(about.comment.as_deref().unwrap_or_default());
    format!("<HDcomment><TX>{comment}</TX><common_properties>{properties}</common_properties></HDcomment>")
}

fn describe_column(column: &MdfColumn, byte: u32) -> ChannelDescription<'_> {
    let kinds = match column.kind {
        MdfColumnType::Real => [0, 0, 4, 0],
        MdfColumnType::Signed => [0, 0, 2, 0],
        MdfColumnType::Unsigned | MdfColumnType::Boolean => [0, 0, 0, 0],
        MdfColumnType::Text => [1, 0, 7, 0],
    };
    ChannelDescription {
        name: &column.name,
        unit: column.unit.as_deref().unwrap_or_default(),
        comment: column.comment.as_deref().unwrap_or_default(),
        kinds,
        byte,
        bits: 8 * column.kind.record_bytes(),
    }
}
