//! Suggests the name that was probably meant when a name is unknown.

/// The candidate that differs from `name` by the fewest typing errors (letter case is not one),
/// or nothing when even that one takes more than a third of the letters, or all of them; of equals
/// the first.
#[must_use]
pub fn closest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted = letters(name);
    let (distance, best) = candidates
        .into_iter()
        .map(|candidate| (distance(&wanted, &letters(candidate)), candidate))
        .min_by_key(|(distance, _)| *distance)?;
    let likely =
        distance <= (wanted.len() / 3).max(1) && (distance == 0 || distance < wanted.len());
    likely.then_some(best)
}

fn letters(text: &str) -> Vec<char> {
    text.chars().flat_map(char::to_lowercase).collect()
}

/// Insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`
/// (optimal string alignment).
fn distance(a: &[char], b: &[char]) -> usize {
    let mut before = vec![0; b.len() + 1];
    let mut above: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let replaced = above[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replaced.min(above[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut above, row);
    }
    above[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_likely_name_is_found_and_an_unlikely_one_is_not() {
        let candidates = ["plant.a_y", "plant.a_x", "plant.v_x", "estimator.slip_angle", "t"];
        for (name, expected) in [
            ("plant.a_y", Some("plant.a_y")),
            ("Plant.A_Y", Some("plant.a_y")),
            ("plnt.v_x", Some("plant.v_x")),
            ("estimator.slipangle", Some("estimator.slip_angle")),
            ("estimator.slip_anlge", Some("estimator.slip_angle")),
            ("T", Some("t")),
            ("controller.torque", None),
            ("zz", None),
            ("v", None),
        ] {
            assert_eq!(closest(name, candidates), expected, "{name}");
        }
        assert_eq!(closest("anything", []), None);
    }

    #[test]
    fn the_distance_counts_typing_errors_in_both_directions() {
        for (a, b, expected) in [
            ("", "", 0),
            ("", "abc", 3),
            ("kitten", "sitting", 3),
            ("abcd", "abdc", 1),
            ("ab", "ba", 1),
        ] {
            assert_eq!(distance(&letters(a), &letters(b)), expected, "{a} {b}");
            assert_eq!(distance(&letters(b), &letters(a)), expected, "{b} {a}");
        }
    }
}
