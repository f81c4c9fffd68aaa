//! Reads nested tables of TOML as values whose names have dots.

use crate::text_of;

/// Joins the keys of nested tables with dots, so that `tire_f.B = 22` and `"tire_f.B" = 22` are the same.
pub(super) fn flatten_dotted_keys<E>(
    name: &str,
    value: &toml::Value,
    take: &mut impl FnMut(&str, &toml::Value) -> Result<(), E>,
) -> Result<(), E> {
    match value {
        toml::Value::Table(table) if text_of::text_file_path(value).is_none() => table
            .iter()
            .try_for_each(|(key, value)| flatten_dotted_keys(&format!("{name}.{key}"), value, take)),
        value => take(name, value),
    }
}
