//! Aligns two signals by dynamic time warping (Sakoe and Chiba, Dynamic programming algorithm optimization for spoken word
//! recognition, 1978), as ISO/TS 18571 wants it for the magnitude score.

/// Where the best path into a cell comes from. Of equal costs the first in this order is taken; the standard leaves it open.
#[derive(Clone, Copy)]
enum PathPredecessor {
    First,
    Second,
    Both,
}

/// The pairs of samples along the path of least summed squared distance from the first pair to the last one, from its end to its
/// start. Both signals have one length, and partners are at most `width` samples apart.
///
/// Takes time and memory in proportion to the length times the width.
pub(crate) fn warping_path(first: &[f64], second: &[f64], width: usize) -> Vec<[f64; 2]> {
    let count = first.len();
    // A row has the cells i - width ..= i + width of the second signal.
    let cells = 2 * width + 1;
    let mut origins = vec![PathPredecessor::Both; count * cells];
    let mut above = vec![f64::INFINITY; cells];
    let mut row = above.clone();
    for i in 0..count {
        row.fill(f64::INFINITY);
        for cell in width.saturating_sub(i)..cells.min(count + width - i) {
            let j = i + cell - width;
            // The row above begins one sample earlier.
            let up = above.get(cell + 1).copied().unwrap_or(f64::INFINITY);
            let left = if cell == 0 { f64::INFINITY } else { row[cell - 1] };
            let mut best = (up, PathPredecessor::First);
            for other in [(left, PathPredecessor::Second), (above[cell], PathPredecessor::Both)] {
                if other.0 < best.0 {
                    best = other;
                }
            }
            let before = if (i, j) == (0, 0) { 0.0 } else { best.0 };
            row[cell] = (first[i] - second[j]).powi(2) + before;
            origins[i * cells + cell] = best.1;
        }
        std::mem::swap(&mut above, &mut row);
    }
    let (mut i, mut j) = (count - 1, count - 1);
    let mut path = vec![[first[i], second[j]]];
    while (i, j) != (0, 0) {
        match origins[i * cells + j + width - i] {
            PathPredecessor::First => i -= 1,
            PathPredecessor::Second => j -= 1,
            PathPredecessor::Both => (i, j) = (i - 1, j - 1),
        }
        path.push([first[i], second[j]]);
    }
    path
}
