//! Decodes numbers of either byte order, and limits the memory that a file may take.

use crate::{Error, LIMIT};

/// Which byte of a number comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ByteOrder {
    Little,
    Big,
}

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NumberFormat {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl NumberFormat {
    /// Bytes of one.
    pub fn size_in_bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}

/// The first bytes in the order of the machine that wrote them, as those of a number that begins with the lowest.
fn to_little_endian<const N: usize>(bytes: &[u8], order: ByteOrder) -> [u8; N] {
    let mut found = [0; N];
    for (to, from) in found.iter_mut().zip(bytes) {
        *to = *from;
    }
    if order == ByteOrder::Big {
        found.reverse();
    }
    found
}

/// A number of `kind.size()` bytes.
fn decode_number(bytes: &[u8], kind: NumberFormat, order: ByteOrder) -> f64 {
    match kind {
        NumberFormat::I8 => f64::from(i8::from_le_bytes(to_little_endian(bytes, order))),
        NumberFormat::U8 => f64::from(u8::from_le_bytes(to_little_endian(bytes, order))),
        NumberFormat::I16 => f64::from(i16::from_le_bytes(to_little_endian(bytes, order))),
        NumberFormat::U16 => f64::from(u16::from_le_bytes(to_little_endian(bytes, order))),
        NumberFormat::I32 => f64::from(i32::from_le_bytes(to_little_endian(bytes, order))),
        NumberFormat::U32 => f64::from(u32::from_le_bytes(to_little_endian(bytes, order))),
        NumberFormat::I64 => i64::from_le_bytes(to_little_endian(bytes, order)) as f64,
        NumberFormat::U64 => u64::from_le_bytes(to_little_endian(bytes, order)) as f64,
        NumberFormat::F32 => f64::from(f32::from_le_bytes(to_little_endian(bytes, order))),
        NumberFormat::F64 => f64::from_le_bytes(to_little_endian(bytes, order)),
    }
}

/// All numbers that the bytes hold.
pub(crate) fn decode_numbers(
    bytes: &[u8],
    kind: NumberFormat,
    order: ByteOrder,
) -> impl Iterator<Item = f64> {
    bytes.chunks_exact(kind.size_in_bytes()).map(move |it| decode_number(it, kind, order))
}

/// A word of 32 bits at a place.
pub(crate) fn u32_at(bytes: &[u8], at: usize, order: ByteOrder) -> Option<u32> {
    Some(u32::from_le_bytes(to_little_endian(bytes.get(at..at.checked_add(4)?)?, order)))
}

/// How many more bytes a file may take, so that a small one cannot fill the memory.
pub(crate) struct MemoryBudget(usize);

impl MemoryBudget {
    pub fn new() -> Self {
        Self(LIMIT)
    }

    /// Bytes that are left.
    pub fn remaining_bytes(&self) -> usize {
        self.0
    }

    /// Takes some of them, for what stands at a byte.
    pub fn reserve(&mut self, bytes: usize, at: Option<usize>) -> Result<(), Error> {
        self.0 = self.0.checked_sub(bytes).ok_or_else(|| {
            let text = format!("expected at most {LIMIT} bytes of numbers and texts, found more");
            Error { at, text }
        })?;
        Ok(())
    }
}

/// The number of elements of a shape, if it can be counted.
pub(crate) fn element_count(shape: &[usize]) -> Option<usize> {
    shape.iter().try_fold(1usize, |count, length| count.checked_mul(*length))
}

/// The rows of characters that are stored column after column.
pub(crate) fn character_rows(characters: &[char], shape: &[usize]) -> Vec<String> {
    let rows = shape.first().copied().unwrap_or(0);
    let row = |first: usize| {
        let text: String = characters.iter().skip(first).step_by(rows).collect();
        text.trim_end_matches([' ', '\0']).to_owned()
    };
    // A text without characters has no rows, but is a text.
    if characters.is_empty() {
        vec![String::new()]
    } else {
        (0..rows.min(characters.len())).map(row).collect()
    }
}
