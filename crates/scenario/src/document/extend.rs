//! Merges the TOML tables of a scenario into those of the scenario that it extends, and keeps the span of each value.

use std::collections::HashMap;
use std::ops::Range;

use diagnostics::suggest;
use toml::Spanned;
use toml::de::{DeArray, DeString, DeTable, DeValue};

use super::manoeuvre::Manoeuvre;
use crate::pattern::matches_wildcard;
use crate::text_of;

/// Keys that name an entry of a list.
const NAMES: [&str; 6] = ["name", "to", "title", "input", "label", "node"];

/// A mistake at a word.
#[derive(Debug)]
pub(super) struct MergeError {
    pub span: Range<usize>,
    pub message: String,
    pub help: Option<String>,
}

/// Merges `changes` into `base`. Tables are merged key by key. In lists at the top level and in `[view]` an entry with the
/// name of an inherited one changes that one, others are added; all other values replace the inherited ones.
pub(super) fn merge_into_base<'a>(
    base: Spanned<DeTable<'a>>,
    changes: Spanned<DeTable<'a>>,
    errors: &mut Vec<MergeError>,
) -> Spanned<DeTable<'a>> {
    let mut merged = base.into_inner();
    for key in ["extends", "variant", "without"] {
        merged.remove(key);
    }
    let (span, changes) = (changes.span(), changes.into_inner());
    if let Some(DeValue::Table(without)) = changes.get("without").map(Spanned::get_ref) {
        remove_entries(&mut merged, without, errors);
    }
    merge_tables(&mut merged, changes, &mut |key, old, new| match (key, old, new) {
        ("view", DeValue::Table(mut old), DeValue::Table(new)) => {
            merge_tables(&mut old, new, &mut |key, old, new| merge_value(key, old, new, errors));
            DeValue::Table(old)
        }
        (_, old, new) => merge_value(key, old, new, errors),
    });
    Spanned::new(span, merged)
}

/// Merges key by key; `both` says what becomes of a key that both have.
fn merge_tables<'a>(
    old: &mut DeTable<'a>,
    new: DeTable<'a>,
    both: &mut dyn FnMut(&str, DeValue<'a>, DeValue<'a>) -> DeValue<'a>,
) {
    for (key, value) in new {
        // The key goes, too: its span is that of the new one from now on.
        let merged = match old.remove(key.get_ref().as_ref()) {
            Some(inherited) => {
                let span = value.span();
                let merged = both(key.get_ref(), inherited.into_inner(), value.into_inner());
                Spanned::new(span, merged)
            }
            None => value,
        };
        old.insert(key, merged);
    }
}

/// Merges a value that lists are merged in, too.
fn merge_value<'a>(
    key: &str,
    old: DeValue<'a>,
    new: DeValue<'a>,
    errors: &mut Vec<MergeError>,
) -> DeValue<'a> {
    match (old, new) {
        (DeValue::Array(old), DeValue::Array(new)) => DeValue::Array(merge_list(key, old, new, errors)),
        (old, new) => merge_or_replace(key, old, new),
    }
}

/// Merges tables; any other value is replaced.
fn merge_or_replace<'a>(_: &str, old: DeValue<'a>, new: DeValue<'a>) -> DeValue<'a> {
    match (old, new) {
        (DeValue::Table(mut old), DeValue::Table(new)) => {
            merge_tables(&mut old, new, &mut merge_or_replace);
            DeValue::Table(old)
        }
        (_, new) => new,
    }
}

fn merge_list<'a>(
    list: &str,
    old: DeArray<'a>,
    new: DeArray<'a>,
    errors: &mut Vec<MergeError>,
) -> DeArray<'a> {
    let mut all: Vec<_> = old.into_iter().collect();
    let mut inherited: HashMap<String, Vec<usize>> = HashMap::new();
    // An input may have several faults.
    if list != "fault" {
        for (place, entry) in all.iter().enumerate() {
            if let Some((name, _)) = entry_name(entry) {
                inherited.entry(name.to_owned()).or_default().push(place);
            }
        }
    }
    for entry in new {
        let places = entry_name(&entry).and_then(|(name, _)| inherited.get(name));
        match places.map(Vec::as_slice).unwrap_or_default() {
            [] => all.push(entry),
            // Of a signal's shapes only one can hold.
            [place] if list == "signal" => all[*place] = entry,
            [place] => change_entry(&mut all[*place], entry),
            places => {
                let message = format!(
                    "the extended scenario has {} [[{list}]] of this name, so it is open which one is changed",
                    places.len()
                );
                let span = entry_name(&entry).map_or(entry.span(), |(_, span)| span);
                errors.push(MergeError { span, message, help: None });
            }
        }
    }
    all.into_iter().collect()
}

/// Changes an entry of a list key by key.
fn change_entry<'a>(entry: &mut Spanned<DeValue<'a>>, changes: Spanned<DeValue<'a>>) {
    let span = changes.span();
    let mut merged = std::mem::replace(entry, Spanned::new(span, DeValue::Boolean(false)));
    match (merged.get_mut(), changes.into_inner()) {
        (DeValue::Table(old), DeValue::Table(mut new)) => {
            // An FMU or a plugin comes from one place.
            if new.contains_key("path") || new.contains_key("crate") {
                ["path", "crate", "example"].iter().for_each(|key| drop(old.remove(*key)));
            }
            // And a manoeuvre is of one kind.
            if Manoeuvre::KINDS.iter().any(|kind| new.contains_key(*kind)) {
                let others = Manoeuvre::KINDS.iter().filter(|kind| !new.contains_key(**kind));
                others.for_each(|kind| drop(old.remove(*kind)));
            }
            for table in [&mut *old, &mut new] {
                if let Some(DeValue::Table(start)) = table.get_mut("start").map(Spanned::get_mut) {
                    *start = flatten_keys(std::mem::take(start), "");
                }
            }
            merge_tables(old, new, &mut merge_or_replace);
        }
        (old, new) => *old = new,
    }
    *entry = Spanned::new(entry.span(), merged.into_inner());
}

/// The table with the keys of nested ones joined by dots, so that `tire_f.B` and `"tire_f.B"` are the same.
fn flatten_keys<'a>(table: DeTable<'a>, prefix: &str) -> DeTable<'a> {
    let mut flattened = DeTable::new();
    for (key, value) in table {
        let (key_span, name) = (key.span(), format!("{prefix}{}", key.get_ref()));
        match (value.span(), value.into_inner()) {
            (_, DeValue::Table(inner)) if !text_of::is_text_file_reference(&inner) => {
                flattened.extend(flatten_keys(inner, &format!("{name}.")))
            }
            (span, value) => {
                let key = Spanned::new(key_span, DeString::from(name));
                flattened.insert(key, Spanned::new(span, value));
            }
        }
    }
    flattened
}

/// Takes the entries out of lists that `without` names.
fn remove_entries(base: &mut DeTable, without: &DeTable, errors: &mut Vec<MergeError>) {
    for (kind, names) in without {
        let DeValue::Array(names) = names.get_ref() else { continue };
        match find_list(base, kind) {
            Ok(list) => {
                names.iter().for_each(|name| errors.extend(remove_named_entries(list, kind, name).err()))
            }
            Err(wrong) => errors.push(wrong),
        }
    }
}

/// Takes the entries of this name out of a list.
fn remove_named_entries(
    list: &mut DeArray,
    kind: &Spanned<DeString>,
    name: &Spanned<DeValue>,
) -> Result<(), MergeError> {
    let Some(pattern) = name.get_ref().as_str() else { return Ok(()) };
    let named = |entry: &Spanned<DeValue>| {
        entry_name(entry).is_some_and(|(known, _)| matches_wildcard(pattern, known))
    };
    let (gone, kept): (Vec<_>, Vec<_>) = std::mem::replace(list, DeArray::new()).into_iter().partition(named);
    let known = kept.iter().filter_map(|entry| Some(entry_name(entry)?.0));
    let unknown = suggest::unknown_name(&format!("inherited [[{}]]", kind.get_ref()), pattern, known);
    *list = kept.into_iter().collect();
    match gone.is_empty() {
        true => Err(MergeError { span: name.span(), message: unknown.message, help: unknown.help }),
        false => Ok(()),
    }
}

/// The names of the lists at the top level and in `[view]`.
fn list_names(base: &DeTable) -> Vec<String> {
    let view = base.get("view").and_then(|view| view.get_ref().as_table());
    let all = base.iter().chain(view.into_iter().flatten());
    let lists = all.filter(|(_, value)| value.get_ref().is_array());
    lists.map(|(key, _)| key.get_ref().to_string()).collect()
}

/// The list of this name at the top level or in `[view]`.
fn find_list<'t, 'a>(
    base: &'t mut DeTable<'a>,
    name: &Spanned<DeString>,
) -> Result<&'t mut DeArray<'a>, MergeError> {
    let key = name.get_ref().as_ref();
    let known = list_names(base);
    let table = match base.contains_key(key) {
        true => Some(base),
        false => match base.get_mut("view").map(Spanned::get_mut) {
            Some(DeValue::Table(view)) => Some(view),
            _ => None,
        },
    };
    match table.and_then(|table| table.get_mut(key)).map(Spanned::get_mut) {
        Some(DeValue::Array(list)) => Ok(list),
        _ => {
            let message = format!("the extended scenario has no [[{key}]]");
            let help = suggest::suggest_name(key, known.iter().map(String::as_str));
            Err(MergeError { span: name.span(), message, help })
        }
    }
}

/// The name of an entry of a list, and its span.
pub(super) fn entry_name<'t>(entry: &'t Spanned<DeValue>) -> Option<(&'t str, Range<usize>)> {
    let DeValue::Table(table) = entry.get_ref() else { return None };
    let name = NAMES.iter().find_map(|key| table.get(*key))?;
    Some((name.get_ref().as_str()?, name.span()))
}
