//! Gives each column of a file a unique name.

use std::collections::HashMap;

/// What a file says of a column.
#[derive(Debug, Clone, Copy)]
pub(super) struct ColumnHeading<'a> {
    /// The whole title.
    pub text: &'a str,
    /// The title without its unit.
    pub plain: &'a str,
    /// Its sensor, or its group.
    pub source: Option<&'a str>,
}

/// The names of columns: whole titles, titles without their units, and for those that occur more than once
/// `title [source]` and `title #2`, which counts from 1.
#[derive(Debug, Default)]
pub(super) struct UniqueColumnNames {
    /// The columns of each name; an earlier list goes first.
    by_name: [HashMap<String, Vec<usize>>; 4],
    /// The shortest name of each column that is no other one's.
    own: Vec<String>,
}

impl UniqueColumnNames {
    pub fn new(columns: &[ColumnHeading]) -> Self {
        let mut numbers: HashMap<&str, usize> = HashMap::new();
        let mut each = Vec::new();
        for ColumnHeading { text, plain, source } in columns {
            let number = numbers.entry(plain).or_default();
            *number += 1;
            let sourced = source.map(|source| format!("{plain} [{source}]"));
            let names = [Some((*text).to_owned()), Some((*plain).to_owned()), sourced];
            each.push((names, format!("{plain} #{number}")));
        }
        let mut names = UniqueColumnNames::default();
        for (place, (titles, numbered)) in each.iter().enumerate() {
            let all = titles.iter().cloned().chain([Some(numbered.clone())]);
            for (of, name) in names.by_name.iter_mut().zip(all) {
                if let Some(name) = name {
                    of.entry(name).or_default().push(place);
                }
            }
        }
        let own = |([text, plain, sourced], numbered): &([Option<String>; 3], String)| {
            let mut short = [plain, sourced, text].into_iter().flatten();
            let is_own = |name: &&String| names.columns_named(name).len() == 1;
            short.find(is_own).unwrap_or(numbered).clone()
        };
        names.own = each.iter().map(own).collect();
        names
    }

    /// The columns of a name.
    pub fn columns_named(&self, name: &str) -> &[usize] {
        self.by_name.iter().find_map(|of| of.get(name)).map_or(&[], Vec::as_slice)
    }

    /// A name of a column that is no other one's.
    pub fn unique_name(&self, place: usize) -> &str {
        self.own.get(place).map_or("", String::as_str)
    }
}
