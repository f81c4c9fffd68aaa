//! Decides in which form the columns of a table are read: as the inputs that they are connected to want them.

use fmu_import::description::{Storage, Type};
use recording::table::ColumnType;

use super::nodes::UnplacedNode;
use super::ports::Port;
use crate::words::{Column, Connect, Scenario, Table};

/// The form of a column: texts for an input of texts or bytes; integers for one of 64 bits that gets them as they are.
pub(super) fn wanted(
    scenario: &Scenario,
    table: &Table,
    (column, words): (&str, &Column),
    fmus: &[UnplacedNode],
) -> ColumnType {
    let name = format!("{}.{column}", table.name.get_ref());
    let connects = scenario.document.connect.iter().filter(|it| *it.from.get_ref() == name);
    let wanted = connects.filter_map(|connect| {
        let input = input(fmus, connect.to.get_ref())?;
        Some(match (input.kind, input.storage) {
            (Type::String | Type::Binary, _) => ColumnType::Text,
            (_, Storage::Int64 | Storage::UInt64)
                if is_plain(scenario, connect) && !is_scaled(words) =>
            {
                ColumnType::Integer
            }
            _ => ColumnType::Number,
        })
    });
    wanted.max_by_key(|reading| *reading as u8).unwrap_or_default()
}

fn input<'a>(fmus: &'a [UnplacedNode], full: &str) -> Option<&'a Port> {
    let (node, variable) = full.split_once('.')?;
    let fmu = fmus.iter().find(|fmu| fmu.name == node)?;
    fmu.inputs.iter().find(|port| port.name == variable)
}

/// Whether the connection changes no value.
fn is_plain(scenario: &Scenario, connect: &Connect) -> bool {
    let mut faults = scenario.document.fault.iter();
    connect.effects().is_empty()
        && connect.transform.is_none()
        && connect.convert.is_none()
        && !faults.any(|fault| {
            fault.input.as_ref().is_some_and(|it| it.get_ref() == connect.to.get_ref())
        })
}

fn is_scaled(words: &Column) -> bool {
    words.gain.is_some() || words.offset.is_some() || words.sign.is_some()
}
