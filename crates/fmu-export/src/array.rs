//! Finds the arrays of FMI 3.0 in a table: rows `x[1]`, `x[2]`, ... one after the other, with the same attributes.

use crate::variable::{VariableKind, VariableRow};

/// Rows that are one variable of FMI 3.0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct VariableRowSpan {
    /// The first row, whose number is the value reference.
    pub first: usize,
    /// The number of rows; more than 1 for an array.
    pub elements: usize,
}

/// The variables of FMI 3.0 that the rows of a table make, in their order.
pub(crate) fn group_rows_into_variables<'a>(
    rows: impl Iterator<Item = (&'a VariableRow, VariableKind)>,
) -> Vec<VariableRowSpan> {
    let rows: Vec<_> = rows.collect();
    let mut spans = Vec::new();
    let mut first = 0;
    while let Some((row, kind)) = rows.get(first) {
        let next = |index: usize| {
            let (other, other_kind) = rows.get(first + index)?;
            let base = array_base_name(row.name, 1)?;
            let alike = VariableRow { name: row.name, description: row.description, ..**other } == **row;
            let belongs = self::array_base_name(other.name, index + 1) == Some(base);
            (alike && belongs && other_kind == kind).then_some(())
        };
        let elements = (1..).take_while(|index| next(*index).is_some()).count() + 1;
        spans.push(VariableRowSpan { first, elements });
        first += elements;
    }
    spans
}

/// The name of the array that `name` is the element `index` of.
pub(crate) fn array_base_name(name: &str, index: usize) -> Option<&str> {
    name.strip_suffix(&format!("[{index}]"))
}

impl VariableRowSpan {
    /// The name of the variable, by that of its first row.
    pub fn array_name<'a>(&self, name: &'a str) -> &'a str {
        if self.elements > 1 { array_base_name(name, 1).unwrap_or(name) } else { name }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::variable::{input, output};

    #[test]
    fn rows_of_one_array_follow_each_other_and_are_alike() {
        let rows = [
            output("x[1]", "m", "left"),
            output("x[2]", "m", "right"),
            output("x[3]", "N", "another unit"),
            output("y[1]", "m", "alone"),
            output("z[2]", "m", "does not begin with 1"),
            input("u[1]", "m", ""),
            input("u[2]", "m", ""),
            output("u[3]", "m", "no input"),
        ];
        let kinds = std::iter::repeat(VariableKind::Real);
        let spans = group_rows_into_variables(rows.iter().zip(kinds));
        let found: Vec<_> = spans.iter().map(|span| (span.first, span.elements)).collect();
        assert_eq!(found, [(0, 2), (2, 1), (3, 1), (4, 1), (5, 2), (7, 1)]);
        let names: Vec<_> = spans.iter().map(|span| span.array_name(rows[span.first].name)).collect();
        assert_eq!(names, ["x", "x[3]", "y[1]", "z[2]", "u", "u[3]"]);
    }
}
