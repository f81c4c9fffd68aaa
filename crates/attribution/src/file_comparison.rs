//! Says in a few words what differs between two versions of a file: values of TOML and of `.tir` files, cells of tables, or bytes.

use std::collections::BTreeMap;

use crate::toml_difference::{display_value, table_differences};

/// Differences that are told one by one; the rest is counted.
const MOST: usize = 8;

/// What differs between two contents, a line for each of the first differences.
#[must_use]
pub fn describe_content_change(a: &[u8], b: &[u8]) -> Vec<String> {
    match (std::str::from_utf8(a), std::str::from_utf8(b)) {
        (Ok(a), Ok(b)) => describe_text_change(a, b),
        _ => vec![describe_byte_change(a, b)],
    }
}

/// The same of texts.
#[must_use]
pub fn describe_text_change(a: &str, b: &str) -> Vec<String> {
    if let (Ok(a), Ok(b)) = (a.parse::<toml::Table>(), b.parse::<toml::Table>()) {
        let cell = |value: &Option<toml::Value>| value.as_ref().map_or("nothing".to_owned(), display_value);
        let found = table_differences(&a, &b);
        let lines = found.iter().map(|it| format!("{}: {} -> {}", it.path, cell(&it.a), cell(&it.b)));
        return first_lines(lines.collect());
    }
    let (of_a, of_b) = (assignments(a), assignments(b));
    if !of_a.is_empty() && !of_b.is_empty() {
        let names = of_a.keys().chain(of_b.keys().filter(|name| !of_a.contains_key(*name)));
        let value = |all: &BTreeMap<String, String>, name: &String| {
            all.get(name).map_or("nothing".to_owned(), String::clone)
        };
        let differing = names.filter(|name| of_a.get(*name) != of_b.get(*name));
        let lines: Vec<_> = differing
            .map(|name| format!("{name}: {} -> {}", value(&of_a, name), value(&of_b, name)))
            .collect();
        if !lines.is_empty() {
            return first_lines(lines);
        }
    }
    let pairs = a.lines().zip(b.lines()).enumerate().filter(|(_, (a, b))| a != b);
    let short = |line: &str| line.chars().take(80).collect::<String>();
    let mut lines: Vec<_> =
        pairs.map(|(place, (a, b))| format!("line {}: {} -> {}", place + 1, short(a), short(b))).collect();
    let [count_a, count_b] = [a, b].map(|text| text.lines().count());
    if count_a != count_b {
        lines.push(format!("{count_a} -> {count_b} lines"));
    }
    first_lines(lines)
}

/// The values of a text of lines `NAME = value`, as `.tir` files are; nothing of another text.
fn assignments(text: &str) -> BTreeMap<String, String> {
    let mut section = String::new();
    let mut values = BTreeMap::new();
    for line in text.lines() {
        let line = line.split(['$', '!']).next().unwrap_or_default().trim();
        if let Some(name) = line.strip_prefix('[') {
            section = name.trim_end_matches(']').to_owned();
        } else if let Some((name, value)) = line.split_once('=') {
            values.insert(format!("[{section}] {}", name.trim()), value.trim().to_owned());
        }
    }
    values
}

fn first_lines(mut lines: Vec<String>) -> Vec<String> {
    let more = lines.len().saturating_sub(MOST);
    lines.truncate(MOST);
    if more > 0 {
        lines.push(format!("and {more} more"));
    }
    lines
}

/// How many bytes differ, and where the first one is.
#[must_use]
pub fn describe_byte_change(a: &[u8], b: &[u8]) -> String {
    if a.len() != b.len() {
        return format!("{} -> {} bytes", a.len(), b.len());
    }
    let differing = a.iter().zip(b).filter(|(a, b)| a != b).count();
    match a.iter().zip(b).position(|(a, b)| a != b) {
        Some(first) => format!("{differing} of {} bytes differ, the first at {first:#x}", a.len()),
        None => "the same bytes".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_told_in_the_words_of_the_file() {
        let car = ["[body]\nl_f = 1.2\nm = 780.0\n", "[body]\nl_f = 1.4\nm = 780\n"];
        assert_eq!(describe_text_change(car[0], car[1]), ["body.l_f: 1.2 -> 1.4"]);
        let tire = ["[SCALING]\nLMUY = 1.0 $ friction\n", "[SCALING]\nLMUY = 0.9 $ friction\n"];
        assert_eq!(describe_text_change(tire[0], tire[1]), ["[SCALING] LMUY: 1.0 -> 0.9"]);
        let log = ["time,v\n0,1\n0.1,2\n", "time,v\n0,1\n0.1,3\n"];
        assert_eq!(describe_text_change(log[0], log[1]), ["line 3: 0.1,2 -> 0.1,3"]);
        assert_eq!(
            describe_content_change(&[0xff, 1, 2], &[0xff, 1, 3]),
            ["1 of 3 bytes differ, the first at 0x2"]
        );
    }
}
