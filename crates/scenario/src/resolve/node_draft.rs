//! Holds a node before its inputs are connected, and finds its ports by their names.

use std::cell::OnceCell;
use std::collections::HashMap;
use std::ops::Range;

use cosim::system::NodeBody;

use super::ports::{Port, PortSide};

/// A node before its inputs are connected and its values have columns in the row.
#[derive(Debug)]
pub(super) struct NodeDraft {
    pub name: String,
    pub body: NodeBody,
    pub outputs: Vec<Port>,
    pub inputs: Vec<Port>,
    /// Inputs that have a start value in the scenario.
    pub started_inputs: Vec<String>,
    /// Place of the node's name in the file.
    pub span: Range<usize>,
    pub port_names: PortNames,
}

/// The ports of a node by their names, and the elements of arrays by those of the arrays; made when somebody asks first.
#[derive(Debug, Default)]
pub(super) struct PortNames([OnceCell<HashMap<String, Vec<usize>>>; 2]);

impl NodeDraft {
    /// Whether it hands on a value and does nothing else.
    pub fn is_connector(&self) -> bool {
        matches!(self.body, NodeBody::Inlet | NodeBody::Outlet)
    }

    /// The ports of a side.
    pub fn ports(&self, side: PortSide) -> &[Port] {
        match side {
            PortSide::Input => &self.inputs,
            PortSide::Output => &self.outputs,
        }
    }

    /// The index of the port of this name on a side.
    pub fn find_port_index(&self, side: PortSide, name: &str) -> Option<usize> {
        let indices = self.ports_by_name(side).get(name)?;
        indices.iter().copied().find(|index| self.ports(side)[*index].name == name)
    }

    /// The indices of the elements of an array on a side, row by row.
    pub fn array_element_indices(&self, side: PortSide, array: &str) -> impl Iterator<Item = usize> {
        let indices = self.ports_by_name(side).get(array).into_iter().flatten().copied();
        indices.filter(move |index| self.ports(side)[*index].name != array)
    }

    fn ports_by_name(&self, side: PortSide) -> &HashMap<String, Vec<usize>> {
        self.port_names.0[side as usize].get_or_init(|| {
            let mut named = HashMap::<String, Vec<usize>>::new();
            for (index, port) in self.ports(side).iter().enumerate() {
                named.entry(port.name.clone()).or_default().push(index);
                let array = port.name.rsplit_once('[').filter(|_| port.element.1 > 1);
                if let Some((array, _)) = array {
                    named.entry(array.to_owned()).or_default().push(index);
                }
            }
            named
        })
    }
}
