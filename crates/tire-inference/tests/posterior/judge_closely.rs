//! Computes moments of a posterior by brute force on cells that are split where it is: where narrow modes are far apart, an even grid
//! over both sees next to nothing of them.
#![allow(non_snake_case, reason = "symbols as in Pacejka, Tire and Vehicle Dynamics")]

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use tire_inference::compressed::CompressedSamples;
use tire_inference::prior::Prior;

use super::judge::{Moments, Sum, line, moments};

/// Column and row of a cell.
type Cell = (i64, i64);

/// B, C, D and E free, no shifts. Takes half a minute of processor time.
pub fn judge(data: &CompressedSamples, prior: &Prior, above: f64) -> Moments {
    /// Cells across at first, and cells from which on no more are split.
    const ACROSS: i64 = 48;
    const MOST: usize = 20_000;
    /// Difference of neighbours that is resolved [nat].
    const SMOOTH: f64 = 4.0;
    let [low, high] = [prior.bounds.lower[1], prior.bounds.upper[1]];
    let around = |(i, k): Cell| (-1..=1).flat_map(move |a| (-1..=1).map(move |b| (i + a, k + b)));
    let all_of = |cells: &BTreeSet<Cell>, size: i64, rough: bool| -> BTreeMap<Cell, Sum> {
        let one = |&(i, k): &Cell| {
            let [C, s] = [i, k].map(|index| (index as f64 + 0.5) / size as f64);
            ((i, k), line(data, prior, [low + (high - low) * C, s], above, rough))
        };
        cells.par_iter().map(one).collect()
    };
    let mut size = ACROSS;
    let mut cells: BTreeSet<Cell> = (0..size).flat_map(|i| (0..size).map(move |k| (i, k))).collect();
    // By how much a narrow mode may be higher than the centre of its cell says [nat].
    let mut hidden = 1000.0;
    loop {
        let lines = all_of(&cells, size, true);
        let best = lines.values().map(|line| line.log).fold(f64::NEG_INFINITY, f64::max);
        let is_steep = |(&cell, line): (&Cell, &Sum)| {
            let differs = |next: &Sum| (next.log - line.log).abs() > SMOOTH;
            line.log > best - 10.0 && around(cell).filter_map(|next| lines.get(&next)).any(differs)
        };
        let resolved = hidden == 0.0 && !lines.iter().any(is_steep);
        let counts = lines.iter().filter(|(_, line)| line.log > best - 22.0 - hidden);
        let near = counts.flat_map(|(&cell, _)| around(cell));
        cells = near.filter(|(i, k)| (0..size).contains(i) && (0..size).contains(k)).collect();
        if resolved || cells.len() > MOST {
            return moments(&all_of(&cells, size, false).into_values().collect::<Vec<_>>());
        }
        let parts = |(i, k): Cell| [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(a, b)| (2 * i + a, 2 * k + b));
        cells = cells.into_iter().flat_map(parts).collect();
        size *= 2;
        hidden = if hidden > 10.0 { hidden / 4.0 } else { 0.0 };
    }
}
