//! Opens many systems with random damage; none may panic or hang.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use super::*;

fn damage(cases: usize) {
    let mut random = Pcg64::seed_from_u64(11);
    let text = super::refusals::sample();
    let whole = archive(&[("SystemStructure.ssd", text.as_bytes()), ("a.fmu", b"")]);
    let folder = folder(&[]);
    let mut survived = 0;
    for case in 0..cases {
        // Archives cost files, so they get a tenth of the cases.
        let packed = case % 10 == 0;
        let mut bytes = if packed { whole.clone() } else { text.as_bytes().to_vec() };
        for _ in 0..random.random_range(1..8) {
            let offset = random.random_range(0..bytes.len());
            match random.random_range(0..5) {
                0 => bytes[offset] = random.random(),
                1 => drop(bytes.drain(offset..(offset + 20).min(bytes.len() - 1))),
                2 => bytes.insert(offset, random.random()),
                3 => bytes.extend_from_within(offset..(offset + 30).min(bytes.len())),
                // A line of the text once more, which leaves it well-formed.
                _ => repeat(&mut bytes, offset),
            }
        }
        let path = written(folder.path(), if packed { "x.ssp" } else { "x.ssd" }, &bytes);
        match open_system(&path, None) {
            Ok(_) => survived += 1,
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
    // Some damage is no damage, or nothing would be read of the later stages.
    assert!(survived > 0);
}

/// Doubles the line around an offset.
fn repeat(bytes: &mut Vec<u8>, offset: usize) {
    let end = |x: &u8| *x == b'\n';
    let start = bytes[..offset].iter().rposition(end).map_or(0, |at| at + 1);
    let stop = bytes[offset..].iter().position(end).map_or(bytes.len(), |at| offset + at + 1);
    let line = bytes[start..stop].to_vec();
    bytes.splice(start..start, line);
}

#[test]
fn random_damage_is_survived() {
    damage(5_000);
}

/// Changes names and numbers in a well-formed text, which reaches what is behind the reading.
#[test]
fn random_words_are_survived() {
    let mut random = Pcg64::seed_from_u64(5);
    let text = super::refusals::sample();
    let words: Vec<&str> = text.split('"').skip(1).step_by(2).collect();
    let folder = folder(&[]);
    let mut survived = 0;
    for _ in 0..2_000 {
        let mut parts: Vec<&str> = text.split('"').collect();
        for _ in 0..random.random_range(1..5) {
            let at = 2 * random.random_range(0..parts.len() / 2) + 1;
            parts[at] = words[random.random_range(0..words.len())];
        }
        let path = written(folder.path(), "x.ssd", parts.join("\"").as_bytes());
        survived += usize::from(open_system(&path, None).is_ok());
    }
    assert!(survived > 20, "{survived}");
}
