//! Turns tables into record batches of Arrow and back.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::{Array, ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray};
use arrow_schema::{DataType, Field, Schema};

use super::{SweepColumn, SweepColumnRole, SweepColumnValues, SweepTable};

/// The keys of a field's metadata.
const ROLE: &str = "role";
const UNIT: &str = "unit";

/// The fields of a table.
pub fn table_schema(table: &SweepTable) -> Arc<Schema> {
    let fields = table.columns.iter().map(|column| {
        let kind = match column.values {
            SweepColumnValues::Integers(_) => DataType::Int64,
            SweepColumnValues::Numbers(_) => DataType::Float64,
            SweepColumnValues::Booleans(_) => DataType::Boolean,
            SweepColumnValues::Texts(_) => DataType::Utf8,
        };
        let optional = kind != DataType::Int64;
        let unit = column.unit.iter().map(|unit| (UNIT.to_owned(), unit.clone()));
        let role = (ROLE.to_owned(), column.role.metadata_name().to_owned());
        let about = HashMap::from_iter(unit.chain([role]));
        Field::new(&column.name, kind, optional).with_metadata(about)
    });
    Arc::new(Schema::new(fields.collect::<Vec<_>>()))
}

/// The rows of a table.
///
/// # Errors
/// When the columns do not fit together.
pub fn table_to_record_batch(table: &SweepTable, schema: &Arc<Schema>) -> Result<RecordBatch, String> {
    let arrays = table.columns.iter().map(|column| -> ArrayRef {
        match &column.values {
            SweepColumnValues::Integers(values) => Arc::new(Int64Array::from(values.clone())),
            SweepColumnValues::Numbers(values) => Arc::new(Float64Array::from_iter(
                values.iter().map(|value| (!value.is_nan()).then_some(*value)),
            )),
            SweepColumnValues::Booleans(values) => Arc::new(BooleanArray::from(values.clone())),
            SweepColumnValues::Texts(values) => Arc::new(StringArray::from_iter(values)),
        }
    });
    RecordBatch::try_new(schema.clone(), arrays.collect()).map_err(|error| error.to_string())
}

/// Columns without rows for the fields of a file.
///
/// # Errors
/// A sentence about the first field that no table of a sweep has.
pub fn columns_of_schema(schema: &Schema) -> Result<SweepTable, String> {
    let columns = schema.fields().iter().map(|field| {
        let name = field.name();
        let values = match field.data_type() {
            DataType::Int64 => SweepColumnValues::Integers(Vec::new()),
            DataType::Float64 => SweepColumnValues::Numbers(Vec::new()),
            DataType::Boolean => SweepColumnValues::Booleans(Vec::new()),
            DataType::Utf8 => SweepColumnValues::Texts(Vec::new()),
            other => {
                return Err(format!(
                    "expected integers of 64 bits, doubles, booleans or texts in column `{name}`, found {other}"
                ));
            }
        };
        let found = field.metadata().get(ROLE).map(String::as_str).unwrap_or_default();
        let role = SweepColumnRole::ALL.into_iter().find(|role| role.metadata_name() == found);
        let role = role.ok_or_else(|| {
            let known = SweepColumnRole::ALL.map(SweepColumnRole::metadata_name).join(", ");
            format!("expected one of {known} as `{ROLE}` in the metadata of column `{name}`, found `{found}`")
        })?;
        let unit = field.metadata().get(UNIT).cloned();
        Ok(SweepColumn { name: name.clone(), unit, role, values })
    });
    Ok(SweepTable { columns: columns.collect::<Result<_, _>>()? })
}

/// Takes the rows of a batch behind those of a table that [`columns_of_schema`] made for the same file.
///
/// # Errors
/// A sentence about the first column that has other values than its field says, or lacks one that cannot be missing.
pub fn append_record_batch(table: &mut SweepTable, batch: &RecordBatch) -> Result<(), String> {
    for (column, array) in table.columns.iter_mut().zip(batch.columns()) {
        let array = array.as_any();
        let taken = match &mut column.values {
            SweepColumnValues::Integers(own) => array
                .downcast_ref::<Int64Array>()
                .filter(|it| it.null_count() == 0)
                .map(|it| own.extend(it.values())),
            SweepColumnValues::Numbers(own) => array
                .downcast_ref::<Float64Array>()
                .map(|it| own.extend(it.iter().map(|value| value.unwrap_or(f64::NAN)))),
            SweepColumnValues::Booleans(own) => {
                array.downcast_ref::<BooleanArray>().map(|it| own.extend(it.iter()))
            }
            SweepColumnValues::Texts(own) => array
                .downcast_ref::<StringArray>()
                .map(|it| own.extend(it.iter().map(|text| text.map(str::to_owned)))),
        };
        taken.ok_or_else(|| format!("column `{}` lacks values", column.name))?;
    }
    Ok(())
}
