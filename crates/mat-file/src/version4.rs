//! Reads version 4: matrices one after the other, each with a head of five words.

use crate::bytes::{
    ByteOrder, MemoryBudget, NumberFormat, character_rows, decode_numbers, element_count, u32_at,
};
use crate::{Error, MatFile, MatValue, MatVariable, NumericArray};

/// Bytes of a head.
const HEAD: usize = 20;

/// The longest name that is taken as one [B].
const NAME: usize = 256;

/// The head of a matrix.
struct MatrixHeader {
    order: ByteOrder,
    kind: NumberFormat,
    /// 0: numbers, 1: text, 2: sparse.
    class: u32,
    shape: [usize; 2],
    complex: bool,
    name: usize,
}

/// The head at a place, if it can be one.
fn parse_matrix_header(bytes: &[u8], at: usize) -> Option<MatrixHeader> {
    let of = |order: ByteOrder| {
        let words: Vec<_> = (0..5).map(|k| u32_at(bytes, at + 4 * k, order)).collect::<Option<_>>()?;
        let [kind, rows, columns, complex, name] = words[..] else { return None };
        let machine = if order == ByteOrder::Little { 0 } else { 1 };
        let digits = [kind / 1000, kind / 100 % 10, kind / 10 % 10, kind % 10];
        let number = match digits[2] {
            0 => NumberFormat::F64,
            1 => NumberFormat::F32,
            2 => NumberFormat::I32,
            3 => NumberFormat::I16,
            4 => NumberFormat::U16,
            5 => NumberFormat::U8,
            _ => return None,
        };
        let sound = digits[0] == machine && digits[1] == 0 && digits[3] < 3 && complex < 2;
        let named = (2..=NAME as u32).contains(&name);
        (sound && named).then_some(MatrixHeader {
            order,
            kind: number,
            class: digits[3],
            shape: [rows as usize, columns as usize],
            complex: complex == 1,
            name: name as usize,
        })
    };
    of(ByteOrder::Little).or_else(|| of(ByteOrder::Big))
}

/// Whether the bytes begin with the head and the name of a matrix.
pub(crate) fn is_version4(bytes: &[u8]) -> bool {
    let named = |head: MatrixHeader| {
        let name = bytes.get(HEAD..HEAD + head.name)?;
        let (last, letters) = name.split_last()?;
        let letter = |it: &u8| it.is_ascii_alphanumeric() || *it == b'_';
        Some(*last == 0 && letters.iter().all(letter) && letters[0].is_ascii_alphabetic())
    };
    parse_matrix_header(bytes, 0).and_then(named).unwrap_or(false)
}

pub(crate) fn read_version4(bytes: &[u8]) -> Result<MatFile, Error> {
    let (mut found, mut at, mut budget) = (MatFile::default(), 0, MemoryBudget::new());
    while at < bytes.len() {
        let head = parse_matrix_header(bytes, at).ok_or_else(|| {
            Error::new(at, "expected the head of a matrix of version 4, found something else")
        })?;
        let name = bytes.get(at + HEAD..at + HEAD + head.name);
        let early =
            || Error::new(at, "expected a whole matrix, found the end of the file: was it copied whole?");
        let name = name.ok_or_else(early)?;
        let name: String = name.iter().take_while(|it| **it != 0).map(|it| char::from(*it)).collect();
        let elements = element_count(&head.shape).ok_or_else(early)?;
        let size = elements.checked_mul(head.kind.size_in_bytes()).ok_or_else(early)?;
        let size = size.checked_mul(if head.complex { 2 } else { 1 }).ok_or_else(early)?;
        let begin = at + HEAD + head.name;
        let end = begin.checked_add(size).ok_or_else(early)?;
        let data = bytes.get(begin..end).ok_or_else(early)?;
        budget.reserve(elements.saturating_mul(8), Some(at))?;
        at = end;
        let shape = head.shape.to_vec();
        let reason = match (head.complex, head.class) {
            (true, _) => "complex numbers",
            (_, 2) => "a sparse matrix",
            _ => {
                let values = decode_numbers(data, head.kind, head.order);
                let value = if head.class == 1 {
                    // Characters are stored as their codes.
                    let characters: Vec<_> =
                        values.map(|it| char::from_u32(it as u32).unwrap_or('?')).collect();
                    MatValue::Texts(character_rows(&characters, &shape))
                } else {
                    MatValue::Numbers(NumericArray { shape, values: values.collect() })
                };
                found.variables.push(MatVariable { name, value });
                continue;
            }
        };
        found.skipped.push((name, reason.to_owned()));
    }
    Ok(found)
}
