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

    /// Adds rows behind the others. A channel keeps its form, but one of numbers may follow one of integers.
    pub fn append(&mut self, more: &Values) {
        match (&mut *self, more) {
            (Values::Numbers(all), Values::Numbers(more)) => all.extend(more),
            (Values::Integers(all), Values::Integers(more)) => all.extend(more),
            (Values::Texts(all), Values::Texts(more)) => all.extend(more.iter().cloned()),
            (Values::Texts(all), more) => all.extend((0..more.len()).map(|_| None)),
            (_, more) => {
                let numbers = |it: &Values| -> Vec<f64> {
                    (0..it.len()).map(|row| it.number(row).unwrap_or(f64::NAN)).collect()
                };
                let all = [numbers(self), numbers(more)].concat();
                *self = Values::Numbers(all);
            }
        }
    }
}
