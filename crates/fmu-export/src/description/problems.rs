//! Finds mistakes in a table that is known only when a program runs.

use std::collections::BTreeSet;

use super::{DescribedVariable, DescriptionTable};
use crate::table::{
    dependency_problems, info_problems, input_names, row_problems, start_outside_limits, unit_problem,
};
use crate::variable::VariableKind;

impl DescriptionTable {
    /// Mistakes, each with the number of the variable that it is about, if it is one. FMI allows a table without them.
    #[must_use]
    pub fn description_problems(&self) -> Vec<(Option<usize>, String)> {
        let mut problems: Vec<_> = info_problems(&self.info).into_iter().map(|it| (None, it)).collect();
        if self.variables.is_empty() {
            problems.push((None, "there is no variable".to_owned()));
        }
        let inputs = input_names(self.variables.iter().map(|it| &it.row));
        let mut names = BTreeSet::new();
        for (place, DescribedVariable { row, kind, start }) in self.variables.iter().enumerate() {
            let new = names.insert(row.name);
            let twice = (!new).then(|| "another variable has this name".to_owned());
            let start = start.as_ref().filter(|_| matches!(kind, VariableKind::Real | VariableKind::Integer));
            let start = start.and_then(|it| it.parse().ok()).and_then(|it| start_outside_limits(row, it));
            let found = row_problems(row, *kind).chain(unit_problem(row)).chain(start);
            let found = found.chain(twice).chain(dependency_problems(&inputs, row));
            problems.extend(found.map(|problem| (Some(place), problem)));
        }
        problems
    }
}
