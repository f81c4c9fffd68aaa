//! Parses the header row of a table: the quantity and the unit of each column.

use units::Unit;

/// A column that a table may have.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ColumnSpec {
    /// Its name, and how else it is written.
    pub names: &'static [&'static str],
    /// The SI unit of its values; `1` for plain numbers, which need none.
    pub unit: &'static str,
}

impl ColumnSpec {
    pub(crate) fn name(&self) -> &'static str {
        self.names[0]
    }
}

/// A column of a table.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HeaderColumn {
    /// Index of what it means.
    pub meaning: usize,
    /// SI value = scale * value + offset.
    pub scale: f64,
    pub offset: f64,
}

/// The columns of a head, in its order.
///
/// # Errors
/// In words: unknown columns, those that are there twice, units that are missing or of another kind.
pub(crate) fn parse_header(fields: &[String], specs: &[ColumnSpec]) -> Result<Vec<HeaderColumn>, String> {
    let mut columns: Vec<HeaderColumn> = Vec::new();
    for field in fields {
        let column = parse_column(field, specs)?;
        if columns.iter().any(|it| it.meaning == column.meaning) {
            let name = specs[column.meaning].name();
            return Err(format!("expected one column `{name}`, found another one in `{field}`"));
        }
        columns.push(column);
    }
    Ok(columns)
}

fn parse_column(field: &str, specs: &[ColumnSpec]) -> Result<HeaderColumn, String> {
    let field = field.trim();
    let (name, unit) = match field.find(['[', '(']) {
        Some(at) => {
            let unit = field[at + 1..].trim_end().strip_suffix([']', ')']);
            let unit =
                unit.ok_or_else(|| format!("expected a unit in brackets, such as `[mm]`, found `{field}`"))?;
            (field[..at].trim(), Some(unit.trim()).filter(|unit| !matches!(*unit, "" | "-")))
        }
        None => (field, None),
    };
    let meaning = specs.iter().position(|it| it.names.iter().any(|known| same_name(known, name)));
    let meaning = meaning.ok_or_else(|| unknown_column_message(name, specs))?;
    let ColumnSpec { unit: si, .. } = specs[meaning];
    let Some(unit) = unit else {
        if si == "1" {
            return Ok(HeaderColumn { meaning, scale: 1.0, offset: 0.0 });
        }
        return Err(format!("expected a unit of `{name}`, such as `{name} [{si}]`"));
    };
    let wrong = |what: &str| format!("expected a unit of `{name}` such as [{si}], found [{unit}]: {what}");
    let from = Unit::parse(unit).map_err(|error| wrong(&error.to_string()))?;
    let to = Unit::parse(si).map_err(|error| wrong(&error.to_string()))?;
    let (scale, offset) = Unit::conversion(&from, &to)
        .ok_or_else(|| wrong(&format!("{} is not {}", from.dimension_text(), to.dimension_text())))?;
    Ok(HeaderColumn { meaning, scale, offset })
}

/// Whether two names are equal but for capitals, blanks, hyphens and underscores.
fn same_name(a: &str, b: &str) -> bool {
    normalize_name(a) == normalize_name(b)
}

fn normalize_name(name: &str) -> String {
    let letters = name.chars().filter(|c| !matches!(c, ' ' | '_' | '-' | '.'));
    letters.flat_map(char::to_lowercase).collect()
}

fn unknown_column_message(name: &str, specs: &[ColumnSpec]) -> String {
    let near = |it: &'static str| strsim::levenshtein(&normalize_name(it), &normalize_name(name));
    let all = specs.iter().flat_map(|it| it.names.iter().map(move |known| (near(known), it)));
    let closest = all.min_by_key(|(misses, _)| *misses);
    let (misses, closest) = closest.map_or((usize::MAX, ""), |(misses, it)| (misses, it.name()));
    if misses.saturating_mul(3) <= name.chars().count().max(3) {
        return format!("unknown column `{name}`, did you mean `{closest}`?");
    }
    let names: Vec<_> = specs.iter().map(|it| format!("`{}`", it.name())).collect();
    format!("unknown column `{name}`, expected some of {}", names.join(", "))
}
