//! Writes the table of variants for a terminal.

use units::display::shorten_end;

use super::VariantTable;

/// Letters of a name or a text in a cell.
const MOST_LETTERS: usize = 24;
/// Space between columns.
const APART: usize = 2;

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
            let marked = |(text, row): (&String, usize)| {
                let text = shorten_end(text, MOST_LETTERS);
                match (column.extremes, column.is_extreme(row)) {
                    (None, _) => text,
                    (_, [true, _]) => format!("{text} ↓"),
                    (_, [_, true]) => format!("{text} ↑"),
                    _ => format!("{text}  "),
                }
            };
            let texts = column.texts.iter().zip(self.rows.iter().map(|it| it.row));
            let column = TextColumn {
                head: [shorten_end(&column.name, MOST_LETTERS), unit],
                cells: texts.map(marked).collect(),
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
        let line = |cells: Vec<String>| {
            format!("{}{}\n", " ".repeat(APART), cells.join("  ")).trim_end().to_owned() + "\n"
        };
        let head = |place: usize| line(columns.iter().map(|it| it.padded(&it.head[place])).collect());
        let mut text = head(0);
        if columns.iter().any(|it| !it.head[1].is_empty()) {
            text += &head(1);
        }
        for place in 0..self.rows.len() {
            text += &line(columns.iter().map(|it| it.padded(&it.cells[place])).collect());
        }
        if left_out > 0 {
            let columns = if left_out == 1 { "column" } else { "columns" };
            text += &format!("  and {left_out} more {columns}, on the page\n");
        }
        text
    }
}
