//! Finds the modes among cells: summits with a valley between them and any higher one.

use std::collections::BTreeMap;

use crate::posterior::grid::plane::{CellIndex, PosteriorGrid};

/// How far below a summit the way to a higher one must lead, in nats, for the two to be apart.
const VALLEY: f64 = 2.0;

/// A number of its mode for each cell.
pub fn label_modes(plane: &PosteriorGrid) -> BTreeMap<CellIndex, usize> {
    let mut order: Vec<(CellIndex, f64)> =
        plane.cells.iter().map(|(&index, cell)| (index, cell.log)).collect();
    order.sort_by(|a, b| b.1.total_cmp(&a.1));
    // The water level falls; islands that meet before they have risen far enough are one.
    let mut islands: Vec<SummitRegion> = Vec::new();
    let mut owner: BTreeMap<CellIndex, usize> = BTreeMap::new();
    for (index, log) in order {
        let mut near: Vec<usize> = plane
            .evaluated_neighbours(index)
            .filter_map(|(index, _)| owner.get(&index))
            .map(|&island| root_region(&islands, island))
            .collect();
        near.sort_unstable();
        near.dedup();
        let Some(&highest) = near.first() else {
            owner.insert(index, islands.len());
            islands.push(SummitRegion { summit: log, part_of: None });
            continue;
        };
        owner.insert(index, highest);
        for &island in &near[1..] {
            if islands[island].summit - log < VALLEY {
                islands[island].part_of = Some(highest);
            }
        }
    }
    owner.into_iter().map(|(index, island)| (index, root_region(&islands, island))).collect()
}

struct SummitRegion {
    summit: f64,
    part_of: Option<usize>,
}

fn root_region(islands: &[SummitRegion], mut island: usize) -> usize {
    while let Some(whole) = islands.get(island).and_then(|island| island.part_of) {
        island = whole;
    }
    island
}
