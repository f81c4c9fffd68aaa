//! Tells which derivatives depend on which states, and groups states whose derivatives have nothing in common: one evaluation is enough for
//! the columns of a group (A. R. Curtis, M. J. D. Powell, J. K. Reid: On the estimation of sparse Jacobian matrices, 1974).

/// The entries of a Jacobian that may differ from 0.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SparsityPattern {
    /// For each state the derivatives that depend on it; nothing where that is unknown, so that all may.
    rows: Option<Vec<Vec<usize>>>,
    /// The states of each group.
    groups: Vec<Vec<usize>>,
    count: usize,
}

impl SparsityPattern {
    /// All derivatives may depend on all states.
    pub fn dense(count: usize) -> Self {
        SparsityPattern { rows: None, groups: (0..count).map(|state| vec![state]).collect(), count }
    }

    /// The states that each derivative depends on, by their indices.
    pub fn from_dependencies(dependencies: &[Vec<usize>]) -> Self {
        let count = dependencies.len();
        let mut rows = vec![Vec::new(); count];
        for (row, states) in dependencies.iter().enumerate() {
            states.iter().for_each(|state| rows[*state].push(row));
        }
        let mut groups: Vec<Vec<usize>> = Vec::new();
        // The rows that the states of each group have.
        let mut taken: Vec<Vec<bool>> = Vec::new();
        for (state, own) in rows.iter().enumerate() {
            let is_free = |taken: &Vec<bool>| own.iter().all(|row| !taken[*row]);
            let group = taken.iter().position(is_free).unwrap_or_else(|| {
                groups.push(Vec::new());
                taken.push(vec![false; count]);
                groups.len() - 1
            });
            groups[group].push(state);
            own.iter().for_each(|row| taken[group][*row] = true);
        }
        SparsityPattern { rows: Some(rows), groups, count }
    }

    pub fn groups(&self) -> &[Vec<usize>] {
        &self.groups
    }

    /// The derivatives that may depend on a state.
    pub fn rows(&self, state: usize) -> impl Iterator<Item = usize> {
        let listed = self.rows.as_ref().map(|rows| rows[state].iter().copied());
        let all = if listed.is_none() { 0..self.count } else { 0..0 };
        listed.into_iter().flatten().chain(all)
    }
}

#[cfg(test)]
mod tests {
    use super::SparsityPattern;

    #[test]
    fn a_band_of_three_needs_three_evaluations() {
        let around = |row: usize| (row.saturating_sub(1)..(row + 2).min(50)).collect();
        let pattern = SparsityPattern::from_dependencies(&(0..50).map(around).collect::<Vec<_>>());
        assert_eq!(pattern.groups().len(), 3);
        assert_eq!(pattern.rows(7).collect::<Vec<_>>(), [6, 7, 8]);
    }
}
