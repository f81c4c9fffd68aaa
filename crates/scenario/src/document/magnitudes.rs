//! Refuses numbers of a size that overflows: their squares and inverses are 0 or infinite.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Keys whose values are judged by those who take them: FMUs, plugins, and a time limit that may be as long as anybody likes.
const OTHERS: [&[&str]; 3] = [&["fmu", "start"], &["analysis", "config"], &["time", "limit"]];

/// Parts that have no other check of what is no finite number.
const UNCHECKED: [&str; 2] = ["fault", "view"];

/// The places of such numbers, each with what is wrong there.
pub(super) fn out_of_range(table: &DeTable) -> Vec<(Range<usize>, String)> {
    let mut found = Vec::new();
    for (key, value) in table {
        collect_out_of_range(&mut vec![key.get_ref()], value, &mut found);
    }
    found
}

fn collect_out_of_range<'t>(
    path: &mut Vec<&'t str>,
    value: &'t Spanned<DeValue>,
    found: &mut Vec<(Range<usize>, String)>,
) {
    if OTHERS.contains(&&path[..]) {
        return;
    }
    match value.get_ref() {
        DeValue::Table(table) => {
            for (key, value) in table {
                path.push(key.get_ref());
                collect_out_of_range(path, value, found);
                path.pop();
            }
        }
        DeValue::Array(list) => list.iter().for_each(|value| collect_out_of_range(path, value, found)),
        DeValue::Float(number) => {
            let number = number.as_str().parse().unwrap_or(0.0);
            found.extend(out_of_range_message(path, number).map(|message| (value.span(), message)));
        }
        _ => {}
    }
}

fn out_of_range_message(path: &[&str], number: f64) -> Option<String> {
    let key = path.last().copied().unwrap_or_default();
    if !number.is_finite() {
        let endless = key == "until" && number > 0.0;
        let part = path.first().is_some_and(|part| UNCHECKED.contains(part));
        let unchecked = part || path.ends_with(&["transform", "map"]);
        return (unchecked && !endless)
            .then(|| format!("expected a finite number for `{key}`, found {number}"));
    }
    let usual = number == 0.0 || (1e-150..=1e150).contains(&number.abs());
    (!usual)
        .then(|| format!("expected 0 or a number of 1e-150 to 1e150 in size for `{key}`, found {number:e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_beyond_all_sizes_are_found_where_nobody_else_looks() {
        let out_of_range = |text: &str| {
            let table = DeTable::parse(text).expect("TOML");
            let found = out_of_range(table.get_ref()).into_iter();
            found.map(|(span, _)| text[span].to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(out_of_range("[time]\nstep = 1e-320\nstop = 1e308\nlimit = 1e308"), ["1e-320", "1e308"]);
        assert_eq!(out_of_range("[[fault]]\nfrom = nan\nuntil = inf\nvalue = -inf"), ["nan", "-inf"]);
        assert_eq!(out_of_range("[[connect]]\ntransform = { map = [[0.0, nan]] }"), ["nan"]);
        assert_eq!(out_of_range("[view]\nplot = [{ range = [0.0, inf] }]"), ["inf"]);
        assert_eq!(out_of_range("[[signal]]\nmultisine = { frequencies = [1e-9, -1e200] }"), ["-1e200"]);
        assert_eq!(out_of_range("[[fmu]]\nstart = { x = 1e308 }\n[[analysis]]\nconfig.a = inf"), [""; 0]);
        assert_eq!(out_of_range("[[signal]]\nconstant = 1_0e1_49\nuntil = 0.0\nseed = 7"), [""; 0]);
    }
}
