//! Checks the parameters of a shape and says which one breaks a rule.

pub(super) fn check_finite(numbers: &[(&str, f64)]) -> Result<(), String> {
    check_all(numbers, "a finite number", |_| true)
}

pub(super) fn check_positive(key: &str, number: f64) -> Result<(), String> {
    check_all(&[(key, number)], "a number above 0", |x| x > 0.0)
}

pub(super) fn check_frequencies(numbers: &[(&str, f64)]) -> Result<(), String> {
    check_all(numbers, "a frequency [Hz] of at least 0", |x| x >= 0.0)
}

fn check_all(numbers: &[(&str, f64)], what: &str, rule: fn(f64) -> bool) -> Result<(), String> {
    match numbers.iter().find(|(_, x)| !(x.is_finite() && rule(*x))) {
        Some((key, x)) => Err(format!("expected {what} for `{key}`, found {x}")),
        None => Ok(()),
    }
}

pub(super) fn check_finite_list(key: &str, numbers: &[f64]) -> Result<(), String> {
    numbers.iter().try_for_each(|x| check_finite(&[(key, *x)]))
}

pub(super) fn check_equal_lengths(
    key: &str,
    found: usize,
    other: &str,
    expected: usize,
) -> Result<(), String> {
    if found == expected {
        return Ok(());
    }
    Err(format!("expected as many numbers in `{key}` as in `{other}`, found {found} and {expected}"))
}
