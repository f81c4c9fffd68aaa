//! Gives each random stream of a scenario a number of its own, and knows how far it is.

use std::convert::Infallible;

use rand::{SeedableRng, TryRng};
use rand_pcg::Pcg64;

/// A random stream that knows how many numbers were drawn from it: with its seed that is all of its state.
#[derive(Debug, Clone)]
pub struct RandomStream {
    seed: u64,
    random: Pcg64,
    drawn: u64,
}

impl RandomStream {
    /// The stream of this seed, from its beginning.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        RandomStream { seed, random: Pcg64::seed_from_u64(seed), drawn: 0 }
    }

    /// How many numbers were drawn.
    #[must_use]
    pub fn drawn_count(&self) -> u64 {
        self.drawn
    }

    /// Goes to where so many numbers were drawn.
    pub fn skip_to(&mut self, drawn: u64) {
        *self = RandomStream::new(self.seed);
        self.random.advance(drawn.into());
        self.drawn = drawn;
    }
}

impl TryRng for RandomStream {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        self.drawn += 1;
        self.random.try_next_u32()
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        self.drawn += 1;
        self.random.try_next_u64()
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        // The generator draws a number for each eight bytes, and one for the rest.
        self.drawn += bytes.len().div_ceil(8) as u64;
        self.random.try_fill_bytes(bytes)
    }
}

/// The number of the random stream that belongs to a name: it depends on the scenario's seed and
/// the name alone, so that streams stay as they are when others are added.
#[must_use]
pub fn stream_seed(seed: u64, name: &str) -> u64 {
    // FNV-1a over the name, then SplitMix64's finaliser so that similar seeds share no bits.
    let offset_basis = 0xcbf2_9ce4_8422_2325;
    let hash = name
        .bytes()
        .fold(offset_basis, |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
    let mut mixed = hash ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}
