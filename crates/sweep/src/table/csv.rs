//! Writes a table as CSV: a line for each variant, all columns of the Parquet file, the unit of each in brackets behind its name, none
//! behind that of plain numbers.

use super::{SweepColumn, SweepColumnValues, SweepTable};

/// The table as CSV, with all digits; what is missing is empty.
///
/// # Errors
/// When it has fewer values in one column than in another.
pub fn table_to_csv(table: &SweepTable) -> Result<Vec<u8>, String> {
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    let head = table.columns.iter().map(|SweepColumn { name, unit, .. }| match unit {
        Some(unit) if unit != "1" => format!("{name} [{unit}]"),
        _ => name.clone(),
    });
    writer.write_record(head).map_err(|error| error.to_string())?;
    for row in 0..table.row_count() {
        let cells = table.columns.iter().map(|column| cell_text(&column.values, row));
        writer.write_record(cells).map_err(|error| error.to_string())?;
    }
    writer.into_inner().map_err(|error| error.to_string())
}

fn cell_text(values: &SweepColumnValues, row: usize) -> String {
    match values {
        SweepColumnValues::Integers(all) => all[row].to_string(),
        SweepColumnValues::Numbers(all) if all[row].is_nan() => String::new(),
        SweepColumnValues::Numbers(all) => format!("{:?}", all[row]),
        SweepColumnValues::Booleans(all) => all[row].map(|it| it.to_string()).unwrap_or_default(),
        SweepColumnValues::Texts(all) => all[row].clone().unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::SweepColumnRole;
    use super::*;

    #[test]
    fn all_digits_and_units_are_written() {
        let texts = vec![Some("stock, wet".to_owned()), None];
        let columns = vec![
            SweepColumn::new("name", SweepColumnRole::Name, SweepColumnValues::Texts(texts)),
            SweepColumn::new(
                "a.x",
                SweepColumnRole::Parameter,
                SweepColumnValues::Numbers(vec![0.1 + 0.2, f64::NAN]),
            )
            .with_unit(Some("m/s")),
        ];
        let text = table_to_csv(&SweepTable { columns }).expect("a table");
        assert_eq!(String::from_utf8_lossy(&text), "name,a.x [m/s]\n\"stock, wet\",0.30000000000000004\n,\n");
    }
}
