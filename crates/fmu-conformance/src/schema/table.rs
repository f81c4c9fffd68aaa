//! Reads a table of elements: which attributes and children each of them has, and which texts are values of a type.

/// An element: its name, its attributes, its children in order.
#[derive(Debug)]
pub(super) struct ElementRow(pub &'static str, pub &'static str, pub &'static str);

/// An attribute of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct AttributeRule {
    pub(super) name: &'static str,
    /// What its values are, as [`check_value_type`] reads it.
    pub(super) kind: &'static str,
    pub(super) required: bool,
}

/// What may come at one place among the children of an element.
#[derive(Debug)]
pub(super) struct ChildRule {
    /// The names of the elements, each with the name of its row.
    pub(super) choices: Vec<(&'static str, &'static str)>,
    pub(super) required: bool,
    pub(super) repeated: bool,
}

/// An element as the table has it.
#[derive(Debug)]
pub(super) struct ElementRule {
    pub(super) attributes: Vec<AttributeRule>,
    pub(super) places: Vec<ChildRule>,
    /// Whether other attributes may be there as well.
    pub(super) other_attributes: bool,
    /// Whether anything may be inside.
    pub(super) open: bool,
    /// Whether its children have names of their own.
    pub(super) unique: bool,
}

/// The element of this name.
pub(super) fn find_element_rule(rows: &'static [ElementRow], name: &str) -> Option<ElementRule> {
    let ElementRow(_, attributes, children) = rows.iter().find(|row| row.0 == name)?;
    let open = *children == "open";
    let mut found = ElementRule {
        attributes: Vec::new(),
        places: if open { Vec::new() } else { children.split_whitespace().map(parse_child_rule).collect() },
        other_attributes: false,
        open,
        unique: false,
    };
    for word in attributes.split_whitespace() {
        match word.strip_prefix('&') {
            Some(other) => {
                let other = find_element_rule(rows, other)?;
                found.attributes.extend(other.attributes);
                found.other_attributes |= other.other_attributes;
            }
            None if word == "unique" => found.unique = true,
            None if word == "+open" || word == "open" => found.other_attributes = true,
            None => {
                let (name, kind) = word.split_once(':')?;
                let required = kind.ends_with('!');
                let kind = kind.trim_end_matches('!');
                found.attributes.push(AttributeRule { name, kind, required });
            }
        }
    }
    Some(found)
}

/// `A`, `A?`, `A*`, `A+` or `(A|B)` with such an end; `A=B` is the element `A` by the row `B`.
fn parse_child_rule(word: &'static str) -> ChildRule {
    let bare = word.trim_end_matches(['?', '*', '+']);
    let names = bare.trim_start_matches('(').trim_end_matches(')');
    let choice = |name: &'static str| name.split_once('=').unwrap_or((name, name));
    ChildRule {
        choices: names.split('|').map(choice).collect(),
        required: !word.ends_with(['?', '*']),
        repeated: word.ends_with(['*', '+']),
    }
}

/// Whether a text is a value of the type, as XML Schema writes it (part 2, section 3), and what is expected otherwise.
pub(super) fn check_value_type(text: &str, kind: &str) -> Result<(), String> {
    if kind == "text" {
        return Ok(());
    }
    if let Some(item) = kind.strip_prefix('[').and_then(|kind| kind.strip_suffix(']')) {
        let wrong = text.split_whitespace().find_map(|word| check_value_type(word, item).err());
        return wrong.map_or(Ok(()), |what| Err(format!("a list of {what}")));
    }
    if let Some(words) = kind.strip_prefix('(').and_then(|kind| kind.strip_suffix(')')) {
        let known = words.split('|').any(|word| word == text.trim());
        return if known { Ok(()) } else { Err(format!("one of {}", words.replace('|', ", "))) };
    }
    let word = text.trim();
    let (fits, expected) = match kind {
        "bool" => (["true", "false", "1", "0"].contains(&word), "true or false"),
        "real" => (is_real_number(word), "a number"),
        "i8" => (word.parse::<i8>().is_ok(), "an integer of 8 bits"),
        "u8" => (word.parse::<u8>().is_ok(), "a natural number of 8 bits"),
        "i16" => (word.parse::<i16>().is_ok(), "an integer of 16 bits"),
        "u16" => (word.parse::<u16>().is_ok(), "a natural number of 16 bits"),
        "i32" => (word.parse::<i32>().is_ok(), "an integer of 32 bits"),
        "u32" => (word.parse::<u32>().is_ok(), "a natural number of 32 bits"),
        "i64" => (word.parse::<i64>().is_ok(), "an integer of 64 bits"),
        "u64" => (word.parse::<u64>().is_ok(), "a natural number of 64 bits"),
        "natural" => (is_digits(word.strip_prefix('+').unwrap_or(word)), "a natural number"),
        "bytes" => (is_hex_bytes(word), "two hexadecimal digits for each byte"),
        "date" => (is_date_time(word), "a date such as 2020-01-31T12:00:00Z"),
        "2.0" => (word == "2.0", "2.0"),
        "3.0" => (is_fmi3_version(word), "3.0"),
        _ => (false, "a type that the table has"),
    };
    if fits { Ok(()) } else { Err(expected.to_owned()) }
}

fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

fn is_hex_bytes(text: &str) -> bool {
    text.len().is_multiple_of(2) && text.bytes().all(|byte| byte.is_ascii_hexdigit())
}

fn is_real_number(text: &str) -> bool {
    let plain = text.bytes().all(|byte| byte.is_ascii_digit() || b"+-.eE".contains(&byte));
    ["INF", "-INF", "NaN"].contains(&text) || plain && text.parse::<f64>().is_ok()
}

/// `3.x`, `3.x.y`, and a text after a hyphen.
fn is_fmi3_version(text: &str) -> bool {
    let (numbers, rest) = text.split_once('-').map_or((text, None), |(a, b)| (a, Some(b)));
    let parts: Vec<_> = numbers.split('.').collect();
    let counted = |part: &&str| is_digits(part) && (*part == "0" || !part.starts_with('0'));
    parts.first() == Some(&"3")
        && (2..=3).contains(&parts.len())
        && parts.iter().all(counted)
        && rest.is_none_or(|rest| !rest.is_empty())
}

/// `YYYY-MM-DDThh:mm:ss`, with a fraction of a second and a time zone where they are given.
fn is_date_time(text: &str) -> bool {
    let Some((day, time)) = text.split_once('T') else { return false };
    let zone = time.find(['Z', '+', '-']).unwrap_or(time.len());
    let (clock, zone) = time.split_at(zone);
    let number = |part: Option<&str>, length: usize, range: std::ops::RangeInclusive<u32>| {
        part.is_some_and(|part| {
            part.len() == length && is_digits(part) && part.parse().is_ok_and(|it| range.contains(&it))
        })
    };
    let mut days = day.strip_prefix('-').unwrap_or(day).split('-');
    let whole = clock.split('.').next().unwrap_or_default();
    let fraction = clock.split_once('.').is_none_or(|(_, fraction)| is_digits(fraction));
    let mut hours = whole.split(':');
    let years = days.next().is_some_and(|year| year.len() >= 4 && is_digits(year));
    let zoned = match zone {
        "" | "Z" => true,
        zone => {
            let mut parts = zone[1..].split(':');
            number(parts.next(), 2, 0..=14) && number(parts.next(), 2, 0..=59) && parts.next().is_none()
        }
    };
    years
        && number(days.next(), 2, 1..=12)
        && number(days.next(), 2, 1..=31)
        && days.next().is_none()
        && number(hours.next(), 2, 0..=24)
        && number(hours.next(), 2, 0..=59)
        && number(hours.next(), 2, 0..=60)
        && hours.next().is_none()
        && fraction
        && zoned
}
