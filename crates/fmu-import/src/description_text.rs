//! Decodes the text of a model description: UTF-8, which FMI asks for, or what a byte order mark or the XML declaration says.

use std::path::Path;

use text_encoding::{ByteOrder, UTF8_MARK, strict_utf16, windows1252_char};

use crate::{DESCRIPTION, LONGEST};

/// The first line of a document is looked for within so many bytes.
const FIRST_LINE: usize = 256;

/// An encoding of descriptions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TextEncoding {
    Utf8,
    Utf16(ByteOrder),
    Windows1252,
}

/// A text, and what to tell of its encoding.
#[derive(Debug)]
pub(crate) struct DecodedDescription {
    pub text: String,
    /// It was read otherwise than FMI asks for.
    pub correction: Option<String>,
    /// It declares what FMI does not allow, and reads the same.
    pub problem: Option<String>,
}

/// The text of the description in the folder of an unpacked archive.
///
/// # Errors
/// When there is none, it is too long, or it is not in the encoding that it declares.
pub(crate) fn load_description_text(folder: &Path) -> Result<DecodedDescription, String> {
    let path = folder.join(DESCRIPTION);
    let length = std::fs::metadata(&path)
        .map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => "expected this file in the archive, found none".to_owned(),
            _ => error.to_string(),
        })?
        .len();
    if length > LONGEST {
        return Err(format!("expected at most {LONGEST} bytes, found {length}"));
    }
    decode_description(&std::fs::read(&path).map_err(|error| error.to_string())?)
}

/// # Errors
/// When the bytes are not in the encoding that they declare, or in one that is not known.
pub(crate) fn decode_description(bytes: &[u8]) -> Result<DecodedDescription, String> {
    let declared = declared_encoding_label(bytes);
    let (encoding, label) = match (detect_encoding(bytes), &declared) {
        (Some(encoding), _) => (encoding, encoding.encoding_name()),
        (None, Some(label)) => (encoding_by_label(label)?, label.as_str()),
        (None, None) => (TextEncoding::Utf8, "UTF-8"),
    };
    let text = match encoding {
        TextEncoding::Utf8 => decode_utf8(bytes.strip_prefix(UTF8_MARK).unwrap_or(bytes))?.to_owned(),
        TextEncoding::Windows1252 => bytes.iter().copied().map(windows1252_char).collect(),
        TextEncoding::Utf16(order) => decode_utf16(bytes, order)?,
    };
    let found = format!("line 1: expected the encoding UTF-8, found {label}");
    let (correction, problem) = match encoding {
        TextEncoding::Utf8 if label.to_lowercase().starts_with("utf-16") => {
            (Some(format!("line 1: it declares {label}, and its bytes are UTF-8: read as UTF-8")), None)
        }
        TextEncoding::Utf8 => (None, None),
        // Most tools that declare it write letters of ASCII alone.
        TextEncoding::Windows1252 if bytes.is_ascii() => (None, Some(found)),
        _ => (Some(format!("{found}: read as {label}")), None),
    };
    Ok(DecodedDescription { text, correction, problem })
}

impl TextEncoding {
    fn encoding_name(self) -> &'static str {
        match self {
            TextEncoding::Utf8 => "UTF-8",
            TextEncoding::Utf16(_) => "UTF-16",
            TextEncoding::Windows1252 => "windows-1252",
        }
    }
}

/// The encoding that the first bytes show: by a byte order mark, or in UTF-16 by the zero beside the first `<`.
fn detect_encoding(bytes: &[u8]) -> Option<TextEncoding> {
    match bytes {
        [0xef, 0xbb, 0xbf, ..] => Some(TextEncoding::Utf8),
        [0xff, 0xfe, ..] | [b'<', 0, ..] => Some(TextEncoding::Utf16(ByteOrder::LittleEndian)),
        [0xfe, 0xff, ..] | [0, b'<', ..] => Some(TextEncoding::Utf16(ByteOrder::BigEndian)),
        _ => None,
    }
}

/// The encoding of this name in a text whose first line can be read byte by byte: that has no wide letters, whatever it says.
fn encoding_by_label(label: &str) -> Result<TextEncoding, String> {
    match label.to_lowercase().as_str() {
        "utf-8" | "utf8" | "utf-16" | "utf-16le" | "utf-16be" => Ok(TextEncoding::Utf8),
        "iso-8859-1" | "iso8859-1" | "latin1" | "latin-1" | "us-ascii" | "ascii" | "windows-1252"
        | "cp1252" => Ok(TextEncoding::Windows1252),
        _ => Err(format!(
            "line 1: expected the encoding UTF-8, found {label}, which is not read here: export the FMU with UTF-8"
        )),
    }
}

/// The encoding that the first line of a text of single bytes declares.
fn declared_encoding_label(bytes: &[u8]) -> Option<String> {
    let start = String::from_utf8_lossy(&bytes[..bytes.len().min(FIRST_LINE)]);
    let (line, _) = start.strip_prefix("<?xml")?.split_once("?>")?;
    let (_, value) = line.split_once("encoding")?;
    let value = value.trim_start().strip_prefix('=')?.trim_start();
    let quote = value.chars().next().filter(|it| matches!(it, '"' | '\''))?;
    value[1..].split_once(quote).map(|(label, _)| label.trim().to_owned())
}

/// Says which byte is no UTF-8, and what an old exporter will have meant by it.
fn decode_utf8(bytes: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(bytes).map_err(|error| {
        let place = error.valid_up_to();
        let line = 1 + bytes[..place].iter().filter(|byte| **byte == b'\n').count();
        let (byte, meant) = (bytes[place], windows1252_char(bytes[place]));
        format!(
            "line {line}: expected UTF-8, found the byte 0x{byte:02X}, which is `{meant}` in ISO-8859-1: export the FMU with UTF-8, \
             or declare the encoding in the first line, <?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>"
        )
    })
}

fn decode_utf16(bytes: &[u8], order: ByteOrder) -> Result<String, String> {
    let text = strict_utf16(bytes, order).ok_or_else(|| {
        "expected a text in UTF-16, as its first bytes show, found half a letter: export the FMU with UTF-8".to_owned()
    })?;
    Ok(text.trim_start_matches('\u{feff}').to_owned())
}
