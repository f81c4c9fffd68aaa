//! Draws cubic splines through points: twice continuously differentiable, periodic or with ends.

/// Second derivatives of the cubic spline at its knots. `spacing` are the distances between them; a periodic spline has one
/// more, from the last knot to the first.
///
/// Ends are parabolic (M_0 = M_1), so a line that starts in a bend keeps the curvature of the bend.
pub(crate) fn spline_moments(spacing: &[f64], values: &[f64]) -> Vec<f64> {
    let count = values.len();
    let slope = |i: usize| (values[(i + 1) % count] - values[i]) / spacing[i];
    if spacing.len() == count {
        let before = |i: usize| (i + count - 1) % count;
        let rows: Vec<_> = (0..count)
            .map(|i| {
                let (h, next) = (spacing[before(i)], spacing[i]);
                [h, 2.0 * (h + next), next, 6.0 * (slope(i) - slope(before(i)))]
            })
            .collect();
        return solve_cyclic_tridiagonal(&rows);
    }
    let mut rows = vec![[0.0, 1.0, -1.0, 0.0]; count];
    for i in 1..count - 1 {
        let (h, next) = (spacing[i - 1], spacing[i]);
        rows[i] = [h, 2.0 * (h + next), next, 6.0 * (slope(i) - slope(i - 1))];
    }
    rows[count - 1] = [-1.0, 1.0, 0.0, 0.0];
    solve_tridiagonal(&rows)
}

/// Solves a system whose rows are [lower, diagonal, upper, right side], by elimination without pivots: the rows of splines
/// are diagonally dominant.
fn solve_tridiagonal(rows: &[[f64; 4]]) -> Vec<f64> {
    let mut eliminated: Vec<[f64; 2]> = Vec::with_capacity(rows.len());
    for &[lower, diagonal, upper, right] in rows {
        let [c, d] = eliminated.last().copied().unwrap_or_default();
        let pivot = diagonal - lower * c;
        eliminated.push([upper / pivot, (right - lower * d) / pivot]);
    }
    let mut solution = vec![0.0; rows.len()];
    let mut next = 0.0;
    for (at, [c, d]) in solution.iter_mut().zip(&eliminated).rev() {
        next = d - c * next;
        *at = next;
    }
    solution
}

/// Solves the same with the lower entry of the first row in the last column and the upper one of the last row in the first
/// column, by the formula of Sherman and Morrison.
fn solve_cyclic_tridiagonal(rows: &[[f64; 4]]) -> Vec<f64> {
    let last = rows.len() - 1;
    let (corner_up, corner_down) = (rows[0][0], rows[last][2]);
    let gamma = -rows[0][1];
    let mut inner = rows.to_vec();
    inner[0][1] -= gamma;
    inner[last][1] -= corner_down * corner_up / gamma;
    let first = solve_tridiagonal(&inner);
    for (i, row) in inner.iter_mut().enumerate() {
        row[3] = match i {
            0 => gamma,
            i if i == last => corner_down,
            _ => 0.0,
        };
    }
    let second = solve_tridiagonal(&inner);
    let along = |of: &[f64]| of[0] + corner_up / gamma * of[last];
    let factor = along(&first) / (1.0 + along(&second));
    first.iter().zip(&second).map(|(a, b)| a - factor * b).collect()
}

/// Value and first two derivatives on the segment of length `h` between two knots with values and moments, at the share
/// `t` of it, from 0 to 1.
#[inline]
pub(crate) fn evaluate_segment(h: f64, t: f64, values: [f64; 2], moments: [f64; 2]) -> [f64; 3] {
    let a = 1.0 - t;
    let [y0, y1] = values;
    let [m0, m1] = moments;
    [
        a * y0 + t * y1 + h * h / 6.0 * ((a * a * a - a) * m0 + (t * t * t - t) * m1),
        (y1 - y0) / h + h / 6.0 * ((1.0 - 3.0 * a * a) * m0 + (3.0 * t * t - 1.0) * m1),
        a * m0 + t * m1,
    ]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn a_periodic_spline_of_a_sine_has_its_derivatives() {
        let count = 40;
        // Unequal knots on purpose.
        let knot = |i: usize| TAU * (i as f64 + 0.2 * (i as f64).sin()) / count as f64;
        let knots: Vec<f64> = (0..count).map(knot).collect();
        let mut spacing: Vec<f64> = knots.windows(2).map(|it| it[1] - it[0]).collect();
        spacing.push(knots[0] + TAU - knots[count - 1]);
        let values: Vec<f64> = knots.iter().map(|it| it.sin()).collect();
        let m = spline_moments(&spacing, &values);
        for i in 0..count {
            let j = (i + 1) % count;
            let at = knots[i] + 0.4 * spacing[i];
            let [y, dy, ddy] = evaluate_segment(spacing[i], 0.4, [values[i], values[j]], [m[i], m[j]]);
            assert_relative_eq!(y, at.sin(), epsilon = 1e-5);
            assert_relative_eq!(dy, at.cos(), epsilon = 2e-4);
            assert_relative_eq!(ddy, -at.sin(), epsilon = 1e-2);
        }
    }

    #[test]
    fn a_parabola_is_its_own_spline() {
        let knots = [0.0_f64, 0.5, 2.0, 3.0, 3.5];
        let spacing: Vec<f64> = knots.windows(2).map(|it| it[1] - it[0]).collect();
        let m = spline_moments(&spacing, &knots.map(|it| 1.5 * it * it - it));
        for it in m {
            assert_relative_eq!(it, 3.0, max_relative = 1e-12);
        }
    }
}
