//! Makes the points of Sobol's sequence, plain or scrambled, in any order.

use std::sync::LazyLock;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Dimensions that there are direction numbers for.
pub const DIMENSIONS: usize = 256;
const BITS: usize = 32;
/// Points of the sequence: one for each number of 32 bits.
pub const POINTS: u64 = 1 << BITS;

/// Primitive polynomials, without their first and last coefficient, and first direction numbers: Joe and Kuo, "Constructing
/// Sobol sequences with better two-dimensional projections", SIAM J. Sci. Comput. 30 (2008).
const TABLE: &str = include_str!("joe_kuo.txt");

static DIRECTIONS: LazyLock<Vec<[u32; BITS]>> = LazyLock::new(|| {
    let first = std::array::from_fn(|bit| 1 << (BITS - 1 - bit));
    let lines = TABLE.lines().filter(|line| !line.starts_with('#'));
    let numbers =
        lines.map(|line| line.split(' ').map(|word| word.parse().unwrap_or_default()).collect::<Vec<u32>>());
    std::iter::once(first).chain(numbers.map(|row| direction_numbers(row[2], &row[3..]))).collect()
});

/// Sobol's sequence in some dimensions.
#[derive(Clone, Debug)]
pub struct Sobol {
    dimensions: usize,
}

/// Sobol's sequence with the nested uniform scrambling of Owen: each point is uniform in the unit cube, and all together keep the
/// evenness of the sequence.
#[derive(Clone, Debug)]
pub struct ScrambledSobol {
    seeds: Vec<u32>,
}

impl Sobol {
    /// The sequence in so many dimensions; `None` beyond [`DIMENSIONS`].
    pub fn new(dimensions: usize) -> Option<Self> {
        (dimensions <= DIMENSIONS).then_some(Self { dimensions })
    }

    /// The sequence in a number of dimensions that is known when this is compiled.
    pub const fn with_const_dimensions<const N: usize>() -> Self {
        const { assert!(N <= DIMENSIONS) };
        Self { dimensions: N }
    }

    /// A coordinate of a point as a number of 32 bits. There are as many dimensions as the sequence was asked for.
    #[inline]
    pub fn coordinate_bits(&self, index: u32, dimension: usize) -> u32 {
        debug_assert!(dimension < self.dimensions);
        let numbers = &DIRECTIONS[dimension];
        let (mut left, mut sum) = (index, 0);
        while left != 0 {
            sum ^= numbers[left.trailing_zeros() as usize];
            left &= left - 1;
        }
        sum
    }
}

impl ScrambledSobol {
    /// The sequence in so many dimensions; `None` beyond [`DIMENSIONS`].
    pub fn new(dimensions: usize, seed: u64) -> Option<Self> {
        let mut stream = Pcg64::seed_from_u64(seed);
        let seeds = (0..dimensions).map(|_| stream.random()).collect();
        (dimensions <= DIMENSIONS).then_some(Self { seeds })
    }

    /// A point of the open unit cube, one coordinate for each place of `point`, which has as many as there are dimensions.
    pub fn write_point(&self, index: u32, point: &mut [f64]) {
        let sequence = Sobol { dimensions: self.seeds.len() };
        for (dimension, (place, &seed)) in point.iter_mut().zip(&self.seeds).enumerate() {
            *place = cell_midpoint(owen_scramble(sequence.coordinate_bits(index, dimension), seed));
        }
    }
}

/// The middle of the cell that a number of 32 bits stands for, in the open unit interval.
#[inline]
pub fn cell_midpoint(number: u32) -> f64 {
    (f64::from(number) + 0.5) / POINTS as f64
}

/// Turns each bit over by a hash of those above it: Burley, "Practical hash-based Owen scrambling", JCGT 9 (2020), with the
/// hash of Vegdahl (2021), whose bits depend on each other more evenly.
#[inline]
fn owen_scramble(number: u32, seed: u32) -> u32 {
    let mut bits = number.reverse_bits();
    bits ^= bits.wrapping_mul(0x3d20_adea);
    bits = bits.wrapping_add(seed);
    bits = bits.wrapping_mul((seed >> 16) | 1);
    bits ^= bits.wrapping_mul(0x0552_6c56);
    bits ^= bits.wrapping_mul(0x53a2_2864);
    bits.reverse_bits()
}

/// Direction numbers by the recurrence of Bratley and Fox (1988).
fn direction_numbers(polynomial: u32, first: &[u32]) -> [u32; BITS] {
    let degree = first.len();
    let mut numbers = [0; BITS];
    for bit in 0..BITS {
        numbers[bit] = if bit < degree {
            first[bit] << (BITS - 1 - bit)
        } else {
            let last = numbers[bit - degree];
            let taps = (1..degree).filter(|tap| polynomial >> (degree - 1 - tap) & 1 == 1);
            taps.fold(last ^ (last >> degree), |sum, tap| sum ^ numbers[bit - tap])
        };
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_points_are_those_of_the_tables() {
        assert_eq!(DIRECTIONS.len(), DIMENSIONS);
        let sequence = Sobol::new(3).expect("three dimensions");
        // Points 1 to 3 in their natural order, as in Joe and Kuo's notes.
        for (index, first) in [(1, [0.5; 3]), (2, [0.25, 0.75, 0.75]), (3, [0.75, 0.25, 0.25])] {
            for (dimension, expected) in first.into_iter().enumerate() {
                let own = f64::from(sequence.coordinate_bits(index, dimension)) / POINTS as f64;
                assert_eq!(own, expected);
            }
        }
        assert!(Sobol::new(DIMENSIONS + 1).is_none());
        assert!(ScrambledSobol::new(DIMENSIONS + 1, 0).is_none());
    }

    #[test]
    fn each_power_of_two_of_points_fills_each_axis_evenly() {
        let sequence = ScrambledSobol::new(DIMENSIONS, 5).expect("the most dimensions");
        let mut points = vec![vec![0.0; DIMENSIONS]; 1024];
        (0..1024).for_each(|k| sequence.write_point(k, &mut points[k as usize]));
        for dimension in 0..DIMENSIONS {
            let mut cells: Vec<usize> =
                points.iter().map(|point| (1024.0 * point[dimension]) as usize).collect();
            cells.sort_unstable();
            assert!(cells.into_iter().eq(0..1024), "dimension {dimension}");
        }
        // Of the first two, 1,024 points are a net: one in each of 32 by 32 cells, scrambled as well.
        let cell = |point: &Vec<f64>| 32 * (32.0 * point[0]) as usize + (32.0 * point[1]) as usize;
        let mut cells: Vec<usize> = points.iter().map(cell).collect();
        cells.sort_unstable();
        assert!(cells.into_iter().eq(0..1024));
    }

    #[test]
    fn seeds_scramble_otherwise_and_each_point_is_uniform() {
        let mut cells = [0; 16];
        for seed in 0..1600 {
            let mut point = [0.0; 1];
            ScrambledSobol::new(1, seed).expect("one dimension").write_point(3, &mut point);
            cells[(16.0 * point[0]) as usize] += 1;
        }
        // 100 in each, with a standard deviation of 10.
        assert!(cells.iter().all(|count| (60..140).contains(count)), "{cells:?}");
    }
}
