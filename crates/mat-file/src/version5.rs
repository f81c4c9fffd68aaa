//! Reads version 5: elements, packed or plain, each a tag of type and size before its data.

use std::io::Read as _;

use flate2::read::ZlibDecoder;

use crate::bytes::{
    ByteOrder, MemoryBudget, NumberFormat, character_rows, decode_numbers, element_count, u32_at,
};
use crate::cell::CellStart;
use crate::{
    Error, MatFile, MatValue, MatVariable, NumericArray, OBJECT as UNREAD_OBJECT, SPARSE as UNREAD_SPARSE,
};

/// Bytes before the first element.
const HEAD: usize = 128;

/// Structs and cells within each other, at most.
const DEPTH: usize = 32;

// Types of elements.
const INT32: u32 = 5;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

// Classes of arrays.
const CELL: u32 = 1;
const STRUCT: u32 = 2;
const OBJECT: u32 = 3;
const CHAR: u32 = 4;
const SPARSE: u32 = 5;
const FUNCTION: u32 = 16;
const OPAQUE: u32 = 17;

/// The flag of numbers with an imaginary part.
const COMPLEX: u32 = 0x0800;

/// The order of bytes that the head states; `None` when it is none.
pub(crate) fn header_byte_order(bytes: &[u8]) -> Option<ByteOrder> {
    match (bytes.get(124..126)?, bytes.get(126..HEAD)?) {
        ([0, 1], b"IM") => Some(ByteOrder::Little),
        ([1, 0], b"MI") => Some(ByteOrder::Big),
        _ => None,
    }
}

/// Elements that are still to be read.
#[derive(Clone, Copy)]
struct ElementReader<'a> {
    bytes: &'a [u8],
    /// Where the next one begins.
    at: usize,
    order: ByteOrder,
}

/// One element.
#[derive(Clone, Copy)]
struct DataElement<'a> {
    kind: u32,
    data: &'a [u8],
    /// Where its data begin.
    at: usize,
}

impl<'a> ElementReader<'a> {
    fn is_empty(&self) -> bool {
        self.at >= self.bytes.len()
    }

    fn next(&mut self) -> Result<DataElement<'a>, Error> {
        let early = |at| Error::new(at, "expected an element, found the end: was the file copied whole?");
        let at = self.at;
        let first = u32_at(self.bytes, at, self.order).ok_or_else(|| early(at))?;
        // Up to four bytes of data stand in the tag, whose upper half is then their number.
        let short = first >> 16;
        let (kind, size, begin) = if short != 0 {
            (first & 0xffff, short as usize, at + 4)
        } else {
            let size = u32_at(self.bytes, at + 4, self.order).ok_or_else(|| early(at))?;
            (first, size as usize, at + 8)
        };
        if short > 4 {
            return Err(Error::new(
                at,
                format!("expected at most 4 bytes in a short element, found {short}"),
            ));
        }
        let end = begin.checked_add(size).filter(|end| *end <= self.bytes.len());
        let data = end.and_then(|end| self.bytes.get(begin..end)).ok_or_else(|| {
            let left = self.bytes.len().saturating_sub(begin);
            Error::new(
                at,
                format!("expected {size} bytes of an element, found {left}: was the file copied whole?"),
            )
        })?;
        let padded = if kind == COMPRESSED { size } else { size.next_multiple_of(8) };
        self.at = if short != 0 { at + 8 } else { begin + padded };
        Ok(DataElement { kind, data, at: begin })
    }
}

pub(crate) fn read_version5(bytes: &[u8], order: ByteOrder) -> Result<MatFile, Error> {
    let mut reader = Version5Reader { found: MatFile::default(), budget: MemoryBudget::new(), order };
    let mut elements = ElementReader { bytes, at: HEAD, order };
    while !elements.is_empty() {
        let element = elements.next()?;
        match element.kind {
            COMPRESSED => {
                let unpacked = reader.inflate_element(element)?;
                let mut inner = ElementReader { bytes: &unpacked, at: 0, order };
                let inner = inner.next()?;
                reader.read_variable(inner)?;
            }
            _ => reader.read_variable(element)?,
        }
    }
    Ok(reader.found)
}

struct Version5Reader {
    found: MatFile,
    budget: MemoryBudget,
    order: ByteOrder,
}

impl Version5Reader {
    fn inflate_element(&mut self, element: DataElement) -> Result<Vec<u8>, Error> {
        let (mut unpacked, most) = (Vec::new(), self.budget.remaining_bytes() as u64 + 1);
        let mut decoder = ZlibDecoder::new(element.data).take(most);
        decoder.read_to_end(&mut unpacked).map_err(|error| {
            Error::new(element.at, format!("a packed variable cannot be unpacked: {error}"))
        })?;
        self.budget.reserve(unpacked.len(), Some(element.at))?;
        Ok(unpacked)
    }

    /// A variable of the file.
    fn read_variable(&mut self, element: DataElement) -> Result<(), Error> {
        if element.kind != MATRIX {
            // Data of newer programs, which readers may leave out.
            self.found.skipped.push((String::new(), format!("an element of type {}", element.kind)));
            return Ok(());
        }
        self.read_array(element, None, 0)
    }

    /// An array with what it holds. It has its own name, or that of its place in a struct or cell.
    fn read_array(&mut self, element: DataElement, place: Option<String>, depth: usize) -> Result<(), Error> {
        if depth > DEPTH {
            return Err(Error::new(
                element.at,
                format!("expected at most {DEPTH} structs within each other, found more"),
            ));
        }
        let mut parts = ElementReader { bytes: element.data, at: 0, order: self.order };
        if parts.is_empty() {
            // MATLAB's way to write [] within a cell or struct.
            let empty = NumericArray { shape: vec![0, 0], values: Vec::new() };
            return self.add_variable(place.unwrap_or_default(), MatValue::Numbers(empty), element.at);
        }
        let flags = u32_at(parts.next()?.data, 0, self.order)
            .ok_or_else(|| Error::new(element.at, "expected the flags of an array, found none"))?;
        let (class, complex) = (flags & 0xff, flags & COMPLEX != 0);
        let shape = if class == OPAQUE { Vec::new() } else { self.read_shape(parts.next()?)? };
        let own = parts.next()?.data;
        let name = place.unwrap_or_else(|| own.iter().map(|it| char::from(*it)).collect());
        let elements = element_count(&shape).ok_or_else(|| {
            Error::new(element.at, format!("`{name}` states more elements than can be counted"))
        })?;
        let unread = match class {
            CELL => return self.read_cell_array(parts, name, elements, depth),
            STRUCT => return self.read_struct_fields(parts, name, elements, depth),
            CHAR => {
                let value = MatValue::Texts(self.read_text(parts.next()?, &shape, elements)?);
                return self.add_variable(name, value, element.at);
            }
            6..=15 if !complex => {
                let values = self.read_numbers(parts.next()?, &name, elements)?;
                return self.add_variable(
                    name,
                    MatValue::Numbers(NumericArray { shape, values }),
                    element.at,
                );
            }
            6..=15 => "complex numbers",
            SPARSE => UNREAD_SPARSE,
            FUNCTION => "a function",
            OBJECT | OPAQUE => UNREAD_OBJECT,
            _ => "an array of an unknown class",
        };
        // The data of objects stand in a variable without a name.
        if !name.is_empty() {
            self.found.skipped.push((name, unread.to_owned()));
        }
        Ok(())
    }

    fn add_variable(&mut self, name: String, value: MatValue, at: usize) -> Result<(), Error> {
        self.budget.reserve(name.len() + 64, Some(at))?;
        self.found.variables.push(MatVariable { name, value });
        Ok(())
    }

    fn read_shape(&self, element: DataElement) -> Result<Vec<usize>, Error> {
        let lengths: Vec<_> = element
            .data
            .chunks_exact(4)
            .filter_map(|it| u32_at(it, 0, self.order).and_then(|it| i32::try_from(it).ok()))
            .map(|it| it as usize)
            .collect();
        let whole = element.kind == INT32 && lengths.len() * 4 == element.data.len();
        if !whole || !(2..=32).contains(&lengths.len()) {
            return Err(Error::new(
                element.at,
                "expected the 2 to 32 dimensions of an array, found something else",
            ));
        }
        Ok(lengths)
    }

    fn read_numbers(&mut self, element: DataElement, name: &str, elements: usize) -> Result<Vec<f64>, Error> {
        let kind = match element.kind {
            1 => NumberFormat::I8,
            2 => NumberFormat::U8,
            3 => NumberFormat::I16,
            4 => NumberFormat::U16,
            INT32 => NumberFormat::I32,
            6 => NumberFormat::U32,
            7 => NumberFormat::F32,
            9 => NumberFormat::F64,
            12 => NumberFormat::I64,
            13 => NumberFormat::U64,
            other => {
                return Err(Error::new(
                    element.at,
                    format!("`{name}`: expected numbers, found type {other}"),
                ));
            }
        };
        let there = element.data.len() / kind.size_in_bytes();
        if there != elements {
            return Err(Error::new(
                element.at,
                format!("`{name}`: expected {elements} numbers, found {there}"),
            ));
        }
        self.budget.reserve(elements.saturating_mul(8), Some(element.at))?;
        Ok(decode_numbers(element.data, kind, self.order).collect())
    }

    fn read_text(
        &mut self,
        element: DataElement,
        shape: &[usize],
        elements: usize,
    ) -> Result<Vec<String>, Error> {
        let codes = |kind| decode_numbers(element.data, kind, self.order).map(|it| it as u32);
        let characters: Vec<char> = match element.kind {
            1 | 2 => codes(NumberFormat::U8).filter_map(char::from_u32).collect(),
            4 | 17 => {
                let units = codes(NumberFormat::U16).map(|it| it as u16);
                text_encoding::utf16_units(units).chars().collect()
            }
            16 => String::from_utf8_lossy(element.data).chars().collect(),
            18 => codes(NumberFormat::U32).map(|it| char::from_u32(it).unwrap_or('\u{fffd}')).collect(),
            other => {
                return Err(Error::new(element.at, format!("expected characters, found type {other}")));
            }
        };
        self.budget.reserve(characters.len().saturating_mul(4), Some(element.at))?;
        if characters.len() > elements {
            return Err(Error::new(
                element.at,
                format!("expected {elements} characters, found {}", characters.len()),
            ));
        }
        Ok(character_rows(&characters, shape))
    }

    /// A cell of texts is one value; other cells are made flat.
    fn read_cell_array(
        &mut self,
        mut parts: ElementReader,
        name: String,
        elements: usize,
        depth: usize,
    ) -> Result<(), Error> {
        let begin = CellStart::at_end_of(&self.found);
        for k in 1..=elements {
            let part = parts.next()?;
            self.read_array(part, Some(format!("{name}{{{k}}}")), depth + 1)?;
        }
        begin.join_texts(&mut self.found, &name, elements);
        Ok(())
    }

    /// The fields of a struct, or of each element of an array of structs.
    fn read_struct_fields(
        &mut self,
        mut parts: ElementReader,
        name: String,
        elements: usize,
        depth: usize,
    ) -> Result<(), Error> {
        let length = parts.next()?;
        let long = u32_at(length.data, 0, self.order).unwrap_or(0) as usize;
        let names = parts.next()?;
        if long == 0 || names.data.len() % long != 0 {
            return Err(Error::new(
                names.at,
                format!(
                    "`{name}`: expected names of fields of {long} bytes, found {} bytes",
                    names.data.len()
                ),
            ));
        }
        let field = |it: &[u8]| -> String {
            it.iter().take_while(|byte| **byte != 0).map(|byte| char::from(*byte)).collect()
        };
        let names: Vec<_> = names.data.chunks_exact(long).map(field).collect();
        // Without fields there is nothing to read, whatever the number of elements.
        for k in 1..=if names.is_empty() { 0 } else { elements } {
            let of = if elements == 1 { name.clone() } else { format!("{name}({k})") };
            for field in &names {
                let part = parts.next()?;
                if part.kind != MATRIX {
                    return Err(Error::new(
                        part.at,
                        format!("`{of}.{field}`: expected an array, found type {}", part.kind),
                    ));
                }
                self.read_array(part, Some(format!("{of}.{field}")), depth + 1)?;
            }
        }
        Ok(())
    }
}
