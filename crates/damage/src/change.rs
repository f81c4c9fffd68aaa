//! Changes an input at one place, as bad disks, careless tools and bad people do.

use std::ops::Range;

use rand::RngExt as _;
use rand_pcg::Pcg64;

/// Numbers that overflow something, or are none.
const NUMBERS: [&str; 26] = [
    "0",
    "-0",
    "1",
    "-1",
    "127",
    "128",
    "255",
    "65535",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "99999999999999999999999999",
    "1e-320",
    "1e-200",
    "1e13",
    "1e308",
    "-1e308",
    "1e999",
    "nan",
    "inf",
    "-inf",
];

/// Numbers of 64 bits at the edges of something.
const EDGES: [u64; 10] = [0, 1, 0x7f, 0xff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 1 << 40, 1 << 63, u64::MAX];

/// Changes the bytes once. `other` is a sound input, and `words` are words of the format.
pub fn mutate_bytes(random: &mut Pcg64, bytes: &mut Vec<u8>, other: &[u8], words: &[&str]) {
    if bytes.is_empty() {
        bytes.extend_from_slice(&other[..other.len().min(64)]);
        return;
    }
    let at = random.random_range(0..bytes.len());
    match random.random_range(0..18) {
        0 => bytes[at] ^= 1 << random.random_range(0..8),
        1 => bytes[at] = random.random(),
        2 => bytes.insert(at, random.random()),
        3 => drop(bytes.drain(random_block(random, bytes))),
        4 => {
            let copy = bytes[random_block(random, bytes)].to_vec();
            insert_bytes(bytes, at, &copy);
        }
        5 if !other.is_empty() => {
            let copy = &other[random_block(random, other)];
            let place = if random.random() { at..at } else { random_block(random, bytes) };
            bytes.splice(place, copy.iter().copied());
        }
        6 => write_boundary_number(random, bytes, at),
        7 | 8 => replace_decimal_number(random, bytes, at),
        9 | 10 => insert_word(random, bytes, at, words),
        11 | 12 => replace_quoted_value(random, bytes, at),
        13 => damage_line(random, bytes, at),
        14 => repeat_block(random, bytes),
        15 => insert_nested_brackets(random, bytes, at),
        16 => bytes.truncate(at),
        _ => {
            let place = random_block(random, bytes);
            bytes[place].fill(0);
        }
    }
}

/// A block of some bytes, short ones mostly.
fn random_block(random: &mut Pcg64, bytes: &[u8]) -> Range<usize> {
    let start = random.random_range(0..bytes.len());
    let most = 1_usize << random.random_range(0..10);
    start..(start + random.random_range(0..=most)).min(bytes.len())
}

fn insert_bytes(bytes: &mut Vec<u8>, at: usize, new: &[u8]) {
    drop(bytes.splice(at..at, new.iter().copied()));
}

/// A number of two, four or eight bytes.
fn write_boundary_number(random: &mut Pcg64, bytes: &mut [u8], at: usize) {
    let width = [2, 4, 8][random.random_range(0..3)];
    let edge = EDGES[random.random_range(0..EDGES.len())].to_le_bytes();
    if let Some(place) = bytes.get_mut(at..at + width) {
        place.copy_from_slice(&edge[..width]);
    }
}

/// The next run of such bytes at or after a place.
fn find_byte_run(bytes: &[u8], at: usize, is: impl Fn(u8) -> bool) -> Option<Range<usize>> {
    let start = at + bytes[at..].iter().position(|byte| is(*byte))?;
    let start = bytes[..start].iter().rposition(|byte| !is(*byte)).map_or(0, |last| last + 1);
    let length = bytes[start..].iter().position(|byte| !is(*byte));
    Some(start..length.map_or(bytes.len(), |length| start + length))
}

/// Another number in place of one that is written in digits.
fn replace_decimal_number(random: &mut Pcg64, bytes: &mut Vec<u8>, at: usize) {
    let Some(digit) = bytes[at..].iter().position(u8::is_ascii_digit) else { return };
    let is = |byte: u8| byte.is_ascii_digit() || b"+-.eE".contains(&byte);
    let Some(place) = find_byte_run(bytes, at + digit, is) else { return };
    drop(bytes.splice(place, NUMBERS[random.random_range(0..NUMBERS.len())].bytes()));
}

/// A word of the format before a place, or in place of a word.
fn insert_word(random: &mut Pcg64, bytes: &mut Vec<u8>, at: usize, words: &[&str]) {
    if words.is_empty() {
        return;
    }
    let word = words[random.random_range(0..words.len())].bytes();
    let is = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'.';
    let place = find_byte_run(bytes, at, is).filter(|_| random.random()).unwrap_or(at..at);
    drop(bytes.splice(place, word));
}

/// What stands between two quotation marks, in place of what stands between two others.
fn replace_quoted_value(random: &mut Pcg64, bytes: &mut Vec<u8>, at: usize) {
    let quoted = |from: usize| {
        let start = from + bytes[from..].iter().position(|byte| *byte == b'"')? + 1;
        let length = bytes[start..].iter().position(|byte| *byte == b'"')?;
        Some(start..start + length)
    };
    let from = random.random_range(0..bytes.len());
    let (Some(from), Some(to)) = (quoted(from), quoted(at)) else { return };
    let mut value = bytes[from].to_vec();
    if random.random_range(0..20) == 0 {
        // As long as a length of 16 bits does not hold.
        value = value.repeat((1 << 16) / value.len().max(1) + 1);
    }
    drop(bytes.splice(to, value));
}

/// A line twice, at another place, or no more.
fn damage_line(random: &mut Pcg64, bytes: &mut Vec<u8>, at: usize) {
    let Some(found) = find_byte_run(bytes, at, |byte| byte != b'\n') else { return };
    let found = found.start..(found.end + 1).min(bytes.len());
    let line = bytes[found.clone()].to_vec();
    match random.random_range(0..3) {
        0 => insert_bytes(bytes, found.end, &line),
        1 => drop(bytes.drain(found)),
        _ => {
            drop(bytes.drain(found));
            let to = random.random_range(0..=bytes.len());
            let start = bytes[..to].iter().rposition(|byte| *byte == b'\n').map_or(0, |it| it + 1);
            insert_bytes(bytes, start, &line);
        }
    }
}

/// A block very often.
fn repeat_block(random: &mut Pcg64, bytes: &mut Vec<u8>) {
    let place = random_block(random, bytes);
    let times = 1 << random.random_range(1..13);
    let times = times.min((1 << 16) / place.len().max(1)).max(1);
    let copies = bytes[place.clone()].repeat(times);
    insert_bytes(bytes, place.end, &copies);
}

/// Brackets within brackets.
fn insert_nested_brackets(random: &mut Pcg64, bytes: &mut Vec<u8>, at: usize) {
    let pairs = [("(", ")"), ("[", "]"), ("{", "}"), ("{\"a\":", "}"), ("<a>", "</a>"), ("-", ""), ("!", "")];
    let (open, close) = pairs[random.random_range(0..pairs.len())];
    let depth = [3, 100, 1_000, 30_000][random.random_range(0..4)];
    let end = random_block(random, bytes).end.max(at);
    if random.random() {
        insert_bytes(bytes, end, close.repeat(depth).as_bytes());
    }
    insert_bytes(bytes, at, open.repeat(depth).as_bytes());
}
