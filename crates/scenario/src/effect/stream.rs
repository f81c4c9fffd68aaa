//! Gives each random stream of a scenario a number of its own.

/// The number of the random stream that belongs to a name: it depends on the scenario's seed and
/// the name alone, so that streams stay as they are when others are added.
#[must_use]
pub fn stream_seed(seed: u64, name: &str) -> u64 {
    // FNV-1a over the name, then SplitMix64's finaliser so that similar seeds share no bits.
    let offset_basis = 0xcbf2_9ce4_8422_2325;
    let hash = name.bytes().fold(offset_basis, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    let mut mixed = hash ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}
