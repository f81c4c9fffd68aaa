//! Makes the damaged input of a seed.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::FuzzTarget;
use crate::change::mutate_bytes;

/// The largest input [B].
const LARGEST: usize = 1 << 20;

/// The input of a seed: one of the sound ones with some damage, most often little.
#[must_use]
pub fn make_damaged_input(target: &FuzzTarget, sound: &[Vec<u8>], seed: u64) -> Vec<u8> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut bytes = sound[random.random_range(0..sound.len())].clone();
    let mut left = 1;
    // One damage in half of the cases, two in a quarter...
    while left < 12 && random.random() {
        left += 1;
    }
    for _ in 0..left {
        match target.own {
            Some(own) if random.random_range(0..3) == 0 => own(&mut random, &mut bytes),
            _ => {
                let other = &sound[random.random_range(0..sound.len())];
                mutate_bytes(&mut random, &mut bytes, other, target.words);
            }
        }
        bytes.truncate(LARGEST);
    }
    bytes
}
