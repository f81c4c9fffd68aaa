//! Chooses whether a column of a `[[table]]` is read as number, integer or text, by the inputs that it is connected to.

use fmu_import::description::{FmiType, StorageType};
use recording::table::ColumnType;

use super::node_draft::NodeDraft;
use super::ports::Port;
use crate::document::{Column, Connect, Scenario, Table};

/// The form of a column: texts for an input of texts or bytes; integers for one of 64 bits that gets them as they are.
pub(super) fn column_type_for_inputs(
    scenario: &Scenario,
    table: &Table,
    column: &str,
    keys: &Column,
    fmus: &[NodeDraft],
) -> ColumnType {
    let name = format!("{}.{column}", table.name.get_ref());
    let connects = scenario.document.connect.iter().filter(|it| *it.from.get_ref() == name);
    let wanted = connects.filter_map(|connect| {
        let input = input_port(fmus, connect.to.get_ref())?;
        Some(match (input.kind, input.storage) {
            (FmiType::String | FmiType::Binary, _) => ColumnType::Text,
            (_, StorageType::Int64 | StorageType::UInt64)
                if is_unmodified_connection(scenario, connect) && !is_scaled(keys) =>
            {
                ColumnType::Integer
            }
            _ => ColumnType::Number,
        })
    });
    wanted.max_by_key(|reading| *reading as u8).unwrap_or_default()
}

fn input_port<'a>(fmus: &'a [NodeDraft], full: &str) -> Option<&'a Port> {
    let (node, variable) = full.split_once('.')?;
    let fmu = fmus.iter().find(|fmu| fmu.name == node)?;
    fmu.inputs.iter().find(|port| port.name == variable)
}

/// Whether the connection changes no value.
fn is_unmodified_connection(scenario: &Scenario, connect: &Connect) -> bool {
    let mut faults = scenario.document.fault.iter();
    connect.effects().is_empty()
        && connect.transform.is_none()
        && connect.convert.is_none()
        && !faults.any(|fault| fault.input.as_ref().is_some_and(|it| it.get_ref() == connect.to.get_ref()))
}

fn is_scaled(column: &Column) -> bool {
    column.gain.is_some() || column.offset.is_some() || column.sign.is_some()
}
