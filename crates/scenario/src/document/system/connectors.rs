//! Writes the connectors of an SSP system, which the scenario around it connects.

use diagnostics::Error;
use fmu_import::Causality;
use fmu_import::description::{EnumerationItem, FmiType, Variable};
use ssp::{Connector, ConnectorKind, FmuPort, SignalConversion, SystemInput, SystemOutput};
use units::Unit;

use super::{ScenarioWriter, SubsystemSettings, conversion_keys, error_at, toml_string, unit_from_ssp};

impl ScenarioWriter<'_> {
    /// Writes all connectors of the system that a scenario can connect. What is left out is noted.
    pub(super) fn write_connectors(&mut self, settings: &SubsystemSettings) -> Result<(), Error> {
        let system = self.system;
        system.inputs.iter().try_for_each(|input| self.write_input_connector(settings, input))?;
        system.outputs.iter().try_for_each(|output| self.write_output_connector(settings, output))
    }

    fn write_input_connector(
        &mut self,
        settings: &SubsystemSettings,
        SystemInput { connector, to }: &SystemInput,
    ) -> Result<(), Error> {
        if matches!(connector.kind, ConnectorKind::Parameter | ConnectorKind::StructuralParameter) {
            return Ok(());
        }
        let mut targets = Vec::new();
        for (port, way) in to {
            let target = self.require_variable(port, way)?.clone();
            match target.causality {
                Causality::Input => targets.push((port, way, target)),
                _ => self.note_omitted_connector(settings, connector, "it leads to a parameter"),
            }
        }
        let Some((_, _, first)) = targets.first() else {
            if to.is_empty() {
                self.note_omitted_connector(settings, connector, "it leads to nothing in the system");
            }
            return Ok(());
        };
        let Some((own, has_unit)) = self.connector_variable(settings, connector, first) else {
            return Ok(());
        };
        self.write_connector(settings, connector, "input", has_unit);
        if settings.unconnected {
            self.write_line(format_args!("unconnected = \"start\""));
        }
        let from = toml_string(&format!("{}.{}", settings.name, connector.name));
        for (port, way, target) in &targets {
            let way = SignalConversion { units: (None, way.units.1.clone()), ..SignalConversion::clone(way) };
            let words = conversion_keys(&way, &own, target)?;
            let to = toml_string(&format!("{}.{}", self.names[port.component], port.variable));
            self.write_line(format_args!("\n[[connect]]\nfrom = {from}\nto = {to}{words}"));
        }
        Ok(())
    }

    fn write_output_connector(
        &mut self,
        settings: &SubsystemSettings,
        SystemOutput { connector, from }: &SystemOutput,
    ) -> Result<(), Error> {
        let Some((port, way)) = from else {
            self.note_omitted_connector(settings, connector, "no component of the system leads to it");
            return Ok(());
        };
        let source = self.require_variable(port, way)?.clone();
        if source.causality != Causality::Output {
            self.note_omitted_connector(settings, connector, "it does not come from an output");
            return Ok(());
        }
        let Some((own, has_unit)) = self.connector_variable(settings, connector, &source) else {
            return Ok(());
        };
        self.write_connector(settings, connector, "output", has_unit);
        let way = SignalConversion { units: (way.units.0.clone(), None), ..SignalConversion::clone(way) };
        let words = conversion_keys(&way, &source, &own)?;
        let from = toml_string(&format!("{}.{}", self.names[port.component], port.variable));
        let to = toml_string(&format!("{}.{}", settings.name, connector.name));
        self.write_line(format_args!("\n[[connect]]\nfrom = {from}\nto = {to}{words}"));
        Ok(())
    }

    /// The variable of a component at the end of a way.
    pub(super) fn require_variable(
        &self,
        port: &FmuPort,
        way: &SignalConversion,
    ) -> Result<&Variable, Error> {
        self.find_port_variable(port).ok_or_else(|| {
            let component = &self.system.components[port.component];
            let message = format!(
                "expected a variable of `{}`, found `{}`, which its FMU does not have",
                component.name, port.variable
            );
            error_at(&way.position, message)
        })
    }

    fn note_omitted_connector(&mut self, settings: &SubsystemSettings, connector: &Connector, reason: &str) {
        let Connector { name, position: place, .. } = connector;
        self.notes.push(format!("{place}: the connector `{}.{name}` is left out: {reason}", settings.name));
    }

    /// The connector as a variable, and whether it has a unit of its own. What it leaves open is as in the variable that it is
    /// wired to.
    fn connector_variable(
        &mut self,
        settings: &SubsystemSettings,
        connector: &Connector,
        inner: &Variable,
    ) -> Option<(Variable, bool)> {
        if !connector.dimensions.is_empty() {
            self.note_omitted_connector(
                settings,
                connector,
                "it is an array; connect the nodes of the system",
            );
            return None;
        }
        let mut own = Variable { name: connector.name.clone(), ..inner.clone() };
        if let Some(ssp::SspType::Enumeration(Some(named))) = &connector.data_type {
            let item = |(name, value): &(String, i64)| EnumerationItem { name: name.clone(), value: *value };
            own.items = named.items.iter().map(item).collect();
        }
        let Some(unit) = connector.unit.as_deref().filter(|_| inner.kind == FmiType::Real) else {
            return Some((own, false));
        };
        match (unit_from_ssp(unit), Unit::parse(&unit.name)) {
            (Some(defined), Ok(read)) if Unit::conversion(&defined, &read) == Some((1.0, 0.0)) => {
                own.unit = Some(unit.name.clone());
                own.set_unit(defined);
                Some((own, true))
            }
            _ => {
                let (place, name) = (&connector.position, &connector.name);
                self.notes.push(format!(
                    "{place}: `{}.{name}` is in [{}], the unit of the FMU, since its own unit [{}] is none that this program knows by this name",
                    settings.name,
                    inner.unit.as_deref().unwrap_or("1"),
                    unit.name
                ));
                Some((own, false))
            }
        }
    }

    fn write_connector(
        &mut self,
        settings: &SubsystemSettings,
        connector: &Connector,
        kind: &str,
        has_unit: bool,
    ) {
        self.mark_text_origin(&connector.position);
        let name = toml_string(&format!("{}.{}", settings.name, connector.name));
        self.write_line(format_args!("\n[[connector]]\nname = {name}\nkind = \"{kind}\""));
        if let Some(unit) = connector.unit.as_deref().filter(|_| has_unit) {
            self.write_line(format_args!("unit = {}", toml_string(&unit.name)));
        }
    }
}
