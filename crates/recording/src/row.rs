//! Says what a row of a run holds: numbers and texts, a column for each.

/// Which side of its node a recorded variable is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Direction {
    /// What the node was given for the step that ended at the row's time, sensor effects included.
    Input,
    /// What the node showed at the row's time.
    Output,
}

/// The type of a recorded variable. Numbers travel as `f64`, which holds each of them exactly; texts
/// travel beside them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A floating-point number.
    Real,
    /// A 32-bit integer, or the value of an enumeration item.
    Integer,
    /// 0 or 1.
    Boolean,
    /// A text.
    String,
}

/// The values of a run at a communication point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Row {
    /// The numbers, one for each column.
    pub numbers: Vec<f64>,
    /// The texts, one for each column of texts.
    pub texts: Vec<String>,
}

impl Row {
    /// Zeros and empty texts.
    #[must_use]
    pub fn new(numbers: usize, texts: usize) -> Self {
        Row { numbers: vec![0.0; numbers], texts: vec![String::new(); texts] }
    }

    /// Takes over the values of a row of the same size, without allocating for numbers.
    pub fn copy_from(&mut self, other: &Row) {
        self.numbers.copy_from_slice(&other.numbers);
        self.texts.clone_from_slice(&other.texts);
    }

    /// Takes over the values of another row that are at these places, numbers and texts.
    pub fn pick_from(&mut self, other: &Row, numbers: &[usize], texts: &[usize]) {
        self.numbers.clear();
        self.numbers.extend(numbers.iter().map(|&place| other.numbers[place]));
        self.texts.resize_with(texts.len(), String::new);
        for (text, &place) in self.texts.iter_mut().zip(texts) {
            text.clone_from(&other.texts[place]);
        }
    }
}

/// One recorded variable: a place among the numbers or the texts of every row.
#[derive(Debug, Clone)]
pub struct Column {
    /// The node's name in the scenario.
    pub node: String,
    /// The variable's name in the node.
    pub variable: String,
    /// The side of the node that it is on.
    pub direction: Direction,
    /// Its type.
    pub kind: Kind,
    /// Its unit, as the node states it.
    pub unit: Option<String>,
    /// One line about it, as the node states it.
    pub description: Option<String>,
}

impl Column {
    /// The name that scenarios, CSV headers and reports use: `node.variable`.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}.{}", self.node, self.variable)
    }
}
