//! Builds interpolation curves and maps from the rows of a table.

use vehicle::{BilinearMap, PiecewiseLinearCurve};

use crate::Error;
use crate::table::CarTable;

/// The curve of one column over another one, whose numbers rise from row to row.
///
/// # Errors
/// When they do not rise, or are fewer than two.
pub(crate) fn curve_from_table(
    table: &CarTable,
    over: usize,
    values: &[f64],
) -> Result<PiecewiseLinearCurve, Error> {
    let points = table.required_column(over)?;
    let (name, unit) = (table.column_name(over), table.column_unit(over));
    if points.len() < 2 {
        return Err(table.header_error(format!("expected at least two rows, found {}", points.len())));
    }
    if let Some(row) = (1..points.len()).find(|row| points[*row] <= points[row - 1]) {
        let (before, after) = (points[row - 1], points[row]);
        let message = format!("expected `{name}` to rise, found {after} after {before} [{unit}]");
        return Err(Error { line: table.lines[row], message });
    }
    PiecewiseLinearCurve::new(points.to_vec(), values.to_vec())
        .map_err(|bad| table.header_error(bad.to_string()))
}

/// The map of N columns over two others. A row for each pair of their numbers, in any order; a column that is missing over which the
/// map could be changes nothing.
///
/// # Errors
/// When pairs are missing or there twice, or a column has one number only.
pub(crate) fn map_from_table<const N: usize>(
    table: &CarTable,
    over: [usize; 2],
    values: [&[f64]; N],
) -> Result<BilinearMap<N>, Error> {
    let rows = table.lines.len();
    let none = vec![0.0; rows];
    let axes = over.map(|column| table.optional_column(column).unwrap_or(&none));
    let mut order: Vec<usize> = (0..rows).collect();
    let by = |row: usize| [axes[0][row], axes[1][row]];
    order.sort_by(|a, b| {
        let (a, b) = (by(*a), by(*b));
        a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
    });
    let points = [0, 1].map(|axis| distinct_values(axes[axis]));
    for axis in [0, 1] {
        if table.optional_column(over[axis]).is_some() && points[axis].len() < 2 {
            let name = table.column_name(over[axis]);
            let message = format!(
                "expected at least two different numbers of `{name}`, or a table without this column"
            );
            return Err(table.header_error(message));
        }
    }
    // The rows in their order are the pairs in theirs, or the first difference is the mistake.
    let mut sorted = order.iter().copied().peekable();
    for &x in &points[0] {
        for &y in &points[1] {
            match sorted.next_if(|row| by(*row) == [x, y]) {
                None => return Err(missing_grid_point_error(table, over, [x, y])),
                Some(first) => {
                    if let Some(second) = sorted.next_if(|row| by(*row) == [x, y]) {
                        let (line, last) = (table.lines[second], table.lines[first]);
                        let message = format!("expected other points than those of line {last}");
                        return Err(Error { line, message });
                    }
                }
            }
        }
    }
    let z = order.iter().flat_map(|row| values.map(|values| values[*row])).collect();
    let [x, y] = points;
    BilinearMap::new(x, y, z).map_err(|bad| table.header_error(bad.to_string()))
}

fn distinct_values(values: &[f64]) -> Vec<f64> {
    // No number is both 0 and -0.
    let mut values: Vec<f64> = values.iter().map(|value| value + 0.0).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

fn missing_grid_point_error(table: &CarTable, over: [usize; 2], point: [f64; 2]) -> Error {
    let name = |i: usize| {
        let unit = table.column_unit(over[i]);
        format!("{} = {} {unit}", table.column_name(over[i]), point[i])
    };
    table.header_error(format!("expected a row for each pair, found none for {} and {}", name(0), name(1)))
}
