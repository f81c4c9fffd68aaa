//! Values of a channel over some rows.

/// Values of a channel over some rows.
#[derive(Clone, Debug, PartialEq)]
pub enum ChannelValues {
    /// Numbers; NaN where there is none.
    Numbers(Vec<f64>),
    /// Integers of up to 64 bits, exactly.
    Integers(Vec<Option<i128>>),
    /// Texts.
    Texts(Vec<Option<String>>),
}

impl ChannelValues {
    /// The number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            ChannelValues::Numbers(all) => all.len(),
            ChannelValues::Integers(all) => all.len(),
            ChannelValues::Texts(all) => all.len(),
        }
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The number of a row; NaN where there is none, nothing where it is a text.
    #[must_use]
    pub fn number_at(&self, row: usize) -> Option<f64> {
        match self {
            ChannelValues::Numbers(all) => all.get(row).copied(),
            ChannelValues::Integers(all) => Some(all.get(row)?.map_or(f64::NAN, |it| it as f64)),
            ChannelValues::Texts(_) => None,
        }
    }

    /// Adds rows behind the others. A channel keeps its form, but one of numbers may follow one of integers.
    pub fn append(&mut self, more: &ChannelValues) {
        match (&mut *self, more) {
            (ChannelValues::Numbers(all), ChannelValues::Numbers(more)) => all.extend(more),
            (ChannelValues::Integers(all), ChannelValues::Integers(more)) => all.extend(more),
            (ChannelValues::Texts(all), ChannelValues::Texts(more)) => all.extend(more.iter().cloned()),
            (ChannelValues::Texts(all), more) => all.extend((0..more.len()).map(|_| None)),
            (_, more) => {
                let numbers = |it: &ChannelValues| -> Vec<f64> {
                    (0..it.len()).map(|row| it.number_at(row).unwrap_or(f64::NAN)).collect()
                };
                let all = [numbers(self), numbers(more)].concat();
                *self = ChannelValues::Numbers(all);
            }
        }
    }
}
