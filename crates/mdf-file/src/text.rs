//! Reads the texts of a file: plain ones, and the text in a piece of XML.

use crate::bytes::{FileByteReader, HEAD};
use crate::error::Error;

/// The longest text that is kept [B]; many channels may refer to the same one.
const KEPT: usize = 4096;
/// Where the text of a piece of XML is looked for [B].
const SEARCHED: u64 = 1 << 16;

/// The text that a link leads to; nothing where it leads nowhere or the text is empty. Of XML it is the content of the first `TX`.
pub(crate) fn read_text_block(bytes: &mut FileByteReader, at: u64) -> Result<Option<String>, Error> {
    if at == 0 {
        return Ok(None);
    }
    let head = bytes.read_block_header(at)?;
    if !matches!(&head.id, b"##TX" | b"##MD") {
        let text =
            format!("expected a text, block ##TX or ##MD, found {}", crate::bytes::block_id_text(head.id));
        return Err(Error::new(at, text));
    }
    let length = head.length.saturating_sub(HEAD);
    if length > bytes.size {
        return Err(Error::new(at, format!("expected a text in the file, found {length} bytes")));
    }
    let mut all = vec![0; length.min(SEARCHED) as usize];
    bytes.read_at(at + HEAD, &mut all)?;
    let all = decode_utf8_or_latin1(all.split(|it| *it == 0).next().unwrap_or_default());
    let found = if &head.id == b"##MD" { xml_text_content(&all) } else { all };
    let found = truncate_text(found.trim());
    Ok((!found.is_empty()).then(|| found.to_owned()))
}

/// UTF-8 as the standard wants it, or Latin-1 as some tools write it.
pub(crate) fn decode_utf8_or_latin1(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        // A text that was cut within a character is UTF-8 up to there.
        Err(error) if error.error_len().is_none() => {
            String::from_utf8_lossy(&bytes[..error.valid_up_to()]).into_owned()
        }
        Err(_) => decode_latin1(bytes),
    }
}

/// Latin-1: each byte is the character of its number.
pub(crate) fn decode_latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|it| char::from(*it)).collect()
}

/// The text up to the longest length that is kept.
pub(crate) fn truncate_text(text: &str) -> &str {
    let end = (0..=KEPT.min(text.len())).rev().find(|end| text.is_char_boundary(*end));
    &text[..end.unwrap_or(0)]
}

/// The content of the first element `TX`; all of it if it is no XML.
fn xml_text_content(xml: &str) -> String {
    let Some(begin) = xml
        .match_indices("<TX")
        .find(|(at, _)| xml[at + 3..].starts_with(|it: char| it == '>' || it == '/' || it.is_whitespace()))
    else {
        return if xml.trim_start().starts_with('<') { String::new() } else { xml.to_owned() };
    };
    let behind = &xml[begin.0..];
    let Some((opening, inside)) = behind.split_once('>').filter(|it| !it.0.ends_with('/')) else {
        return String::new();
    };
    debug_assert!(opening.starts_with("<TX"));
    xml_unescaped(inside.split("</TX").next().unwrap_or_default())
}

/// Replaces the entities that XML knows by itself.
fn xml_unescaped(text: &str) -> String {
    let mut parts = text.split('&');
    let mut all = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let known = part.split_once(';').and_then(|(name, rest)| Some((xml_entity_char(name)?, rest)));
        match known {
            Some((character, rest)) => {
                all.push(character);
                all.push_str(rest);
            }
            None => {
                all.push('&');
                all.push_str(part);
            }
        }
    }
    all
}

fn xml_entity_char(name: &str) -> Option<char> {
    Some(match name {
        "amp" => '&',
        "lt" => '<',
        "gt" => '>',
        "quot" => '"',
        "apos" => '\'',
        _ => {
            let number = name.strip_prefix('#')?;
            let code = match number.strip_prefix(['x', 'X']) {
                Some(digits) => u32::from_str_radix(digits, 16).ok()?,
                None => number.parse().ok()?,
            };
            char::from_u32(code)?
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_of_xml_is_that_of_its_first_tx() {
        let comment =
            "<CNcomment><TX xml:space=\"preserve\">a &lt; b &amp; c &#xB0; &x</TX><names/></CNcomment>";
        assert_eq!(xml_text_content(comment), "a < b & c ° &x");
        assert_eq!(xml_text_content("<CNcomment><TXT>no</TXT><TX/></CNcomment>"), "");
        assert_eq!(xml_text_content("plain"), "plain");
        assert_eq!(xml_text_content("<CNunit><TX"), "");
    }

    #[test]
    fn bytes_that_are_no_utf_8_are_latin_1() {
        assert_eq!(decode_utf8_or_latin1(b"\xb0C"), "°C");
        assert_eq!(decode_utf8_or_latin1("°C".as_bytes()), "°C");
        assert_eq!(decode_utf8_or_latin1(b"ab\xc2"), "ab");
    }
}
