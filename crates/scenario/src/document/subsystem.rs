//! The keys of `[[system]]`, a system of SSP as a part of the scenario, and of `[[connector]]`.

use std::ops::Range;
use std::path::Path;

use diagnostics::Spanned;
use schemars::JsonSchema;
use serde::Deserialize;

use super::UnconnectedInputs;

/// A system of SSP as a part of the scenario. Its FMUs are nodes whose names begin with that of the system: `rig_motor`. Its own
/// connectors are connected, checked, disturbed and drawn by their names: `rig.torque`.
///
/// ```toml
/// [[system]]
/// name = "rig"
/// path = "rig.ssp"
///
/// [[connect]]
/// from = "driver.torque"
/// to = "rig.torque"
/// noise = { std = 0.1 }
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Subsystem {
    /// Name of the system; without it that of the file, without its ending.
    #[schemars(example = &"rig")]
    pub name: Option<Spanned<String>>,
    /// Archive, its folder or its `.ssd` file, relative to the scenario file.
    #[schemars(example = &"rig.ssp")]
    pub path: Spanned<String>,
    /// The description of the system that counts, by its file or its name; `SystemStructure.ssd` without it.
    #[schemars(example = &"winter.ssd")]
    pub variant: Option<Spanned<String>>,
    /// What becomes of input connectors of the system without a connection and a start value. Without a word they are refused.
    #[schemars(example = &"start")]
    pub unconnected: Option<UnconnectedInputs>,
}

impl Subsystem {
    /// The name that the names of its nodes begin with.
    #[must_use]
    pub fn subsystem_name(&self) -> String {
        subsystem_name_or_stem(self.name.as_ref().map(|name| name.get_ref().as_str()), self.path.get_ref())
    }

    /// The place of its name, or else that of its path.
    #[must_use]
    pub fn name_or_path_span(&self) -> Range<usize> {
        self.name.as_ref().unwrap_or(&self.path).span()
    }
}

/// The name of a system that may have none of its own.
pub(super) fn subsystem_name_or_stem(name: Option<&str>, path: &str) -> String {
    let stem = || Path::new(path).file_stem().unwrap_or_default().to_string_lossy();
    // A dot ends the name of a node.
    name.map_or_else(|| stem().replace(['.', '"', '\\'], "_"), str::to_owned)
}

/// A name for a value on its way from an output to one or more inputs, with its own sensor effects and faults. `[[system]]` makes
/// those of the system; a scenario may have others, such as a measurement that two controllers get with the same noise.
///
/// ```toml
/// [[connector]]
/// name = "sensor.speed"
/// kind = "input"
///
/// [[connect]]
/// from = "plant.v_x"
/// to = "sensor.speed"
/// noise = { std = 0.1 }
///
/// [[connect]]
/// from = "sensor.speed"
/// to = "controller.v_x"
///
/// [[connect]]
/// from = "sensor.speed"
/// to = "estimator.v_x"
/// ```
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Connector {
    /// Name, `node.variable`. The node has nothing but connectors.
    #[schemars(example = &"sensor.speed")]
    pub name: Spanned<String>,
    /// When it takes its value.
    #[schemars(example = &"input")]
    pub kind: ConnectorKind,
    /// Its unit; without a word that of the inputs that it leads to, and of an output that of its source.
    #[schemars(example = &"m/s")]
    pub unit: Option<Spanned<String>>,
    /// What becomes of inputs that it leads to, when it has no connection and they have no start value. Without a word they are
    /// refused.
    #[schemars(example = &"start")]
    pub unconnected: Option<UnconnectedInputs>,
}

/// When a connector takes its value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConnectorKind {
    /// Before the nodes that it leads to step, as their inputs do.
    Input,
    /// After the node that it comes from has stepped, as its outputs do.
    Output,
}
