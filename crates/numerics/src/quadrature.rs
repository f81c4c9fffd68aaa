//! Gives nodes and weights of Gauss-Legendre quadrature.

use std::f64::consts::PI;

/// `count` nodes in (−1, 1) with weights that sum to 1: the mean of a function over that interval.
///
/// Exact for polynomials up to degree 2 `count` − 1. Newton's method on the Legendre polynomial, from the asymptotic
/// position of its roots.
pub fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    (0..count).map(|i| legendre_node(count, (PI * (i as f64 + 0.75) / (count as f64 + 0.5)).cos())).collect()
}

fn legendre_node(count: usize, start: f64) -> (f64, f64) {
    let mut x = start;
    let mut slope = 1.0;
    for _ in 0..50 {
        let (value, derivative) = legendre_polynomial(count, x);
        slope = derivative;
        let step = value / derivative;
        x -= step;
        if step.abs() < 1e-16 {
            break;
        }
    }
    (x, 1.0 / ((1.0 - x * x) * slope * slope))
}

/// Legendre polynomial of a degree and its derivative, by the recurrence of three terms.
fn legendre_polynomial(degree: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for k in 2..=degree {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
    }
    (value, degree as f64 * (x * value - before) / (x * x - 1.0))
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn polynomials_are_averaged_exactly_up_to_twice_the_number_of_nodes() {
        for count in 2..=16 {
            let rule = gauss_legendre(count);
            for power in (0..2 * count as i32 - 1).step_by(2) {
                let mean: f64 = rule.iter().map(|(x, w)| w * x.powi(power)).sum();
                assert_relative_eq!(mean, 1.0 / f64::from(power + 1), max_relative = 1e-13);
            }
            let odd: f64 = rule.iter().map(|(x, w)| w * x.powi(3)).sum();
            assert!(odd.abs() < 1e-15);
        }
    }
}
