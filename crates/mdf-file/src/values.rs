//! Values of a channel over some rows.

/// Values of a channel over some rows.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers; NaN where there is none.
    Numbers(Vec<f64>),
    /// Integers of up to 64 bits, exactly.
    Integers(Vec<Option<i128>>),
    /// Texts.
    Texts(Vec<Option<String>>),
}

impl Values {
    /// The number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Values::Numbers(all) => all.len(),
            Values::Integers(all) => all.len(),
            Values::Texts(all) => all.len(),
        }
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The number of a row; NaN where there is none, nothing where it is a text.
    #[must_use]
    pub fn number(&self, row: usize) -> Option<f64> {
        match self {
            Values::Numbers(all) => all.get(row).copied(),
            Values::Integers(all) => Some(all.get(row)?.map_or(f64::NAN, |it| it as f64)),
            Values::Texts(_) => None,
        }
    }

    /// Takes the rows of another stretch of the same channel.
    pub(crate) fn append(&mut self, more: &mut Values) {
        match (self, more) {
            (Values::Numbers(all), Values::Numbers(more)) => all.append(more),
            (Values::Integers(all), Values::Integers(more)) => all.append(more),
            (Values::Texts(all), Values::Texts(more)) => all.append(more),
            // A channel keeps its kind.
            _ => {}
        }
    }
}
