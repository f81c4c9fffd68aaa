//! Writes the table of variants for a terminal.

use units::display::shorten_end;

use super::{VariantColumn, VariantTable};

/// Letters of a name or a text in a cell.
const MOST_LETTERS: usize = 24;
/// Space between columns.
const APART: usize = 2;
/// Set-ups that have room beside each other, and letters of the names of their values.
const MOST_BESIDE: usize = 6;
const MOST_NAME_LETTERS: usize = 40;

/// A column of texts, with two lines of head.
struct TextColumn {
    head: [String; 2],
    cells: Vec<String>,
    is_number: bool,
}

impl TextColumn {
    fn width(&self) -> usize {
        let letters = |text: &String| text.chars().count();
        self.head.iter().chain(&self.cells).map(letters).max().unwrap_or(0)
    }

    /// A text as wide as the column.
    fn padded(&self, text: &str) -> String {
        let width = self.width();
        if self.is_number { format!("{text:>width$}") } else { format!("{text:<width$}") }
    }
}

impl VariantTable<'_> {
    /// The table in lines of at most `width` letters; columns that have no room are counted below it.
    #[must_use]
    pub fn to_text(&self, width: usize) -> String {
        let rows = self.rows.iter();
        let plain = |head: &str, cells: Vec<String>| TextColumn {
            head: [head.to_owned(), String::new()],
            cells,
            is_number: false,
        };
        let numbers = rows.clone().map(|row| row.variant.to_string()).collect();
        let mut columns = vec![TextColumn { is_number: true, ..plain("#", numbers) }];
        if self.has_names {
            let name = |name: &Option<String>| {
                name.as_deref().map(|name| shorten_end(name, MOST_LETTERS)).unwrap_or_default()
            };
            columns.push(plain("name", rows.clone().map(|row| name(&row.name)).collect()));
        }
        columns.push(plain("verdict", rows.map(|row| row.ending.word().to_owned()).collect()));
        let mut used: usize = columns.iter().map(|column| column.width() + APART).sum();
        let mut left_out = self.left_out_columns;
        for column in &self.columns {
            let unit = if column.unit.is_empty() { String::new() } else { format!("[{}]", column.unit) };
            let column = TextColumn {
                head: [shorten_end(&column.name, MOST_LETTERS), unit],
                cells: (0..self.rows.len()).map(|place| self.marked_text(column, place)).collect(),
                is_number: column.column.as_texts().is_none(),
            };
            // Columns stay in their order; what is too wide is left out, and narrower ones behind it are not.
            if used + APART + column.width() > width {
                left_out += 1;
                continue;
            }
            used += APART + column.width();
            columns.push(column);
        }
        if let Some(beside) = self.text_beside_each_other(width).filter(|_| left_out > self.left_out_columns)
        {
            return beside + self.legend();
        }
        let mut text = lines_of_columns(&columns) + self.legend();
        if left_out > 0 {
            let columns = if left_out == 1 { "column" } else { "columns" };
            text += &format!("  and {left_out} more {columns}, on the page\n");
        }
        text
    }

    /// A few variants beside each other, a line for each value; nothing of more, and of those that have no room.
    fn text_beside_each_other(&self, width: usize) -> Option<String> {
        if self.rows.len() > MOST_BESIDE || !self.selection.is_complete() {
            return None;
        }
        let name = |column: &VariantColumn| shorten_end(&column.name_with_unit(), MOST_NAME_LETTERS);
        let names = std::iter::once("verdict".to_owned()).chain(self.columns.iter().map(name));
        let names = TextColumn { head: Default::default(), cells: names.collect(), is_number: false };
        let variants = self.rows.iter().enumerate().map(|(place, row)| {
            // Marks stand in line.
            let verdict = format!("{}  ", row.ending.word());
            let values = self.columns.iter().map(|column| match column.extremes {
                Some(_) => self.marked_text(column, place),
                None => self.marked_text(column, place) + "  ",
            });
            let head = row.name.as_deref().map_or_else(|| format!("#{}", row.variant), str::to_owned);
            TextColumn {
                head: [format!("{}  ", shorten_end(&head, MOST_LETTERS)), String::new()],
                cells: std::iter::once(verdict).chain(values).collect(),
                is_number: true,
            }
        });
        let columns: Vec<TextColumn> = std::iter::once(names).chain(variants).collect();
        let used: usize = columns.iter().map(|column| column.width() + APART).sum();
        (used <= width).then(|| lines_of_columns(&columns))
    }

    /// The value of a column at a place in the table: with the mark of the lowest or the highest one, in brackets if it is that of the
    /// scenario.
    fn marked_text(&self, column: &VariantColumn, place: usize) -> String {
        let text = column.texts.get(place).map_or("", String::as_str);
        let text = shorten_end(text, MOST_LETTERS);
        let text = if column.is_as_in_scenario(place) { format!("({text})") } else { text };
        let Some(row) = self.rows.get(place).filter(|_| column.extremes.is_some()) else { return text };
        match column.is_extreme(row.row) {
            [true, _] => format!("{text} ↓"),
            [_, true] => format!("{text} ↑"),
            _ => format!("{text}  "),
        }
    }

    /// What the brackets say, where there are any.
    fn legend(&self) -> &'static str {
        match self.has_scenario_values() {
            true => "  (in brackets): as in the scenario\n",
            false => "",
        }
    }
}

/// The lines of columns, below their heads.
fn lines_of_columns(columns: &[TextColumn]) -> String {
    let line = |cells: Vec<String>| {
        format!("{}{}", " ".repeat(APART), cells.join("  ")).trim_end().to_owned() + "\n"
    };
    let head = |place: usize| line(columns.iter().map(|it| it.padded(&it.head[place])).collect());
    let mut text = head(0);
    if columns.iter().any(|it| !it.head[1].is_empty()) {
        text += &head(1);
    }
    for place in 0..columns.first().map_or(0, |column| column.cells.len()) {
        text += &line(columns.iter().map(|it| it.padded(&it.cells[place])).collect());
    }
    text
}
