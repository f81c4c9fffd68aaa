//! Reads the scenario that an export left in the annotation of an SSP system.

use std::path::Path;

/// The scenario in the annotation of a system.
pub(crate) enum ScenarioAnnotation<'a> {
    /// It is of this system.
    Current(&'a str),
    /// It cannot be used, for this reason.
    Stale(String),
}

impl<'a> ScenarioAnnotation<'a> {
    /// The type of the annotation.
    pub const KIND: &'static str = "org.trackside.scenario";
    /// The namespace of the element in it.
    pub const NAMESPACE: &'static str = "urn:org.trackside:scenario";

    /// The scenario that belongs to the system at `path`.
    pub fn from_system(system: &'a ssp::SspSystem, path: &Path) -> Option<Self> {
        let found = system.annotations.iter().find(|it| it.kind == Self::KIND)?;
        let attribute = |name: &str| {
            let attribute = found.attributes.iter().find(|(known, _)| known == name);
            attribute.map_or("", |(_, value)| value.as_str())
        };
        let (path, kind) = (path.display(), Self::KIND);
        if attribute("version") != "1" {
            return Some(ScenarioAnnotation::Stale(format!(
                "{path}: the annotation {kind} is of version `{}`, this program reads 1: the system is used without it",
                attribute("version")
            )));
        }
        if attribute("system") != system.fingerprint() {
            return Some(ScenarioAnnotation::Stale(format!(
                "{path}: the system was changed after its annotation {kind} was written: the system counts, what the annotation says of signals, effects, checks and all else is left out"
            )));
        }
        Some(ScenarioAnnotation::Current(&found.text))
    }
}
