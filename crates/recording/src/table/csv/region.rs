//! Detects the region of numeric rows of a CSV file, and the header lines above it.
//!
//! The titles are not known by their words but by what follows them: the last lines are rows, and what stands above all of these, as
//! wide as they are, are titles and what explains them. Notes about the drive stand apart, or are narrower.

use super::explanation::{is_explanation, is_units};
use super::line::{CsvLine, filled_cell_count, is_gap, is_number};
use crate::table::read_request::Separator;

/// So many lines at the end are looked at for the last row; others are footers.
const FOOTERS: usize = 50;

/// The rows that a separator makes.
pub(super) struct NumericRegion {
    pub separator: Separator,
    /// Of each column, the cells that are numbers, and those that are other texts.
    counts: Vec<[usize; 2]>,
    rows: usize,
    /// The place of the line of titles.
    pub titles: usize,
}

impl NumericRegion {
    /// The rows among lines, with titles above them; nothing where this separator makes none.
    pub fn detect(lines: &[CsvLine], separator: Separator) -> Option<Self> {
        let cells: Vec<Vec<String>> = lines.iter().map(|it| it.split_cells(separator)).collect();
        let places: Vec<usize> = (0..lines.len()).filter(|it| !lines[*it].is_comment()).collect();
        let numbers = |place: &usize| cells[*place].iter().filter(|it| is_number(it)).count();
        let most = places.iter().rev().take(FOOTERS).map(numbers).max().filter(|it| *it > 0)?;
        let last = places.iter().rposition(|place| 2 * numbers(place) >= most)?;
        let mut region = NumericRegion { separator, counts: Vec::new(), rows: 0, titles: 0 };
        let mut above = last + 1;
        while above > 0 && region.is_row(&cells[places[above - 1]]) {
            above -= 1;
            region.add_row(&cells[places[above]]);
        }
        let widest = places[above..=last].iter().map(|it| filled_cell_count(&cells[*it])).max()?;
        let block = title_block_above(lines, &cells, &places[..above], widest);
        // numpy writes the titles as a comment, others their units below it.
        let mut comments = (0..*places.get(above)?).rev().filter(|it| lines[*it].is_comment());
        let nearest = comments.next().filter(|_| block.is_empty());
        let nearest = nearest.and_then(|it| match is_units(&cells[it]) {
            true => comments.next(),
            false => Some(it),
        });
        let is_title = |place: &&usize| {
            let numbers = cells[**place].iter().filter(|it| is_number(it)).count();
            filled_cell_count(&cells[**place]) >= widest && 2 * numbers < filled_cell_count(&cells[**place])
        };
        // The lowest line that explains no other one; titles such as `t,V,A` look as if they did.
        let mut titles = block.iter().chain(&nearest).filter(is_title);
        let lowest = titles.clone().find(|place| !is_explanation(&cells[**place]));
        let found = *lowest.or_else(|| titles.next_back())?;
        // A logger that began anew wrote them again.
        region.titles = cells.iter().position(|it| *it == cells[found])?;
        (region.has_number_column() && widest > 1).then_some(region)
    }

    /// Whether it has a column of numbers.
    fn has_number_column(&self) -> bool {
        self.number_column_count() > 0
    }

    /// The number of columns with numbers.
    pub fn number_column_count(&self) -> usize {
        self.counts.iter().filter(|[numbers, others]| numbers > others).count()
    }

    fn add_row(&mut self, cells: &[String]) {
        self.rows += 1;
        self.counts.resize(self.counts.len().max(cells.len()), [0; 2]);
        for (cell, counts) in cells.iter().zip(&mut self.counts) {
            if !is_gap(cell) {
                counts[usize::from(!is_number(cell))] += 1;
            }
        }
    }

    /// Whether a line continues the rows: the first column that has a number in each of them has one here, or, with a gap there,
    /// half of the other ones.
    pub fn is_row(&self, cells: &[String]) -> bool {
        if self.rows == 0 {
            return true;
        }
        let leading = self.counts.iter().position(|[numbers, _]| *numbers == self.rows);
        match leading.and_then(|place| cells.get(place)).filter(|cell| !is_gap(cell)) {
            Some(cell) => is_number(cell),
            None => {
                let of_numbers = cells.iter().zip(&self.counts);
                let of_numbers = of_numbers.filter(|(_, [numbers, others])| numbers > others);
                let cells = of_numbers.map(|(cell, _)| cell).filter(|cell| !is_gap(cell));
                let (numbers, others): (Vec<_>, Vec<_>) = cells.partition(|cell| is_number(cell));
                !numbers.is_empty() && numbers.len() >= others.len()
            }
        }
    }
}

/// The lines directly above the rows that are as wide as these, from below; an empty line ends them once there is one that can
/// have titles.
fn title_block_above(lines: &[CsvLine], cells: &[Vec<String>], above: &[usize], widest: usize) -> Vec<usize> {
    let (mut block, mut is_apart, mut has_titles) = (Vec::new(), false, false);
    for place in above.iter().rev() {
        if (is_apart && has_titles) || cells[*place].len() < widest {
            break;
        }
        has_titles |= !is_explanation(&cells[*place]) && filled_cell_count(&cells[*place]) >= widest;
        is_apart = lines[*place].is_apart;
        block.push(*place);
    }
    block
}
