//! Decides what is recorded.

use crate::error::Error;
use crate::scenario::Scenario;
use crate::sink::Column;

/// The places of the numbers and of the texts that `[record]` does not except.
pub(super) fn places(
    scenario: &Scenario,
    columns: &[Column],
    texts: &[Column],
) -> Result<(Vec<usize>, Vec<usize>), Error> {
    let except = &scenario.document.record.except;
    for pattern in except {
        if !columns.iter().chain(texts).any(|column| matches(pattern.get_ref(), &column.name())) {
            let message = format!("nothing that is recorded is called `{}`", pattern.get_ref());
            return Err(scenario.error(pattern, message));
        }
    }
    let kept =
        |column: &Column| !except.iter().any(|pattern| matches(pattern.get_ref(), &column.name()));
    let those = |columns: &[Column]| -> Vec<usize> {
        (0..columns.len()).filter(|&place| kept(&columns[place])).collect()
    };
    Ok((those(columns), those(texts)))
}

/// Whether `name` fits `pattern`, in which `*` stands for any letters.
pub(crate) fn matches(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let Some(mut rest) = name.strip_prefix(parts.next().unwrap_or_default()) else { return false };
    let parts: Vec<_> = parts.collect();
    let Some((last, middle)) = parts.split_last() else { return rest.is_empty() };
    for part in middle {
        match rest.find(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::matches;

    #[test]
    fn a_star_stands_for_any_letters() {
        for (pattern, name, expected) in [
            ("plant.v_x", "plant.v_x", true),
            ("plant.v_x", "plant.v_xy", false),
            ("plant.*", "plant.v_x", true),
            ("*.v_x", "plant.v_x", true),
            ("plant*x", "plant.v_x", true),
            ("*", "anything", true),
            ("a*b*c", "a1b2c", true),
            ("a*b*c", "a1c2b", false),
            ("aa*aa", "aaa", false),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern} {name}");
        }
    }
}
