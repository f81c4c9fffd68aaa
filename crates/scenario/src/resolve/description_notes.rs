//! Notes corrections that reading a modelDescription.xml made, and default start times that the run does not use.

use std::collections::BTreeSet;

use cosim::clock::CommunicationClock;
use cosim::system::NodeBody;

use super::node_draft::NodeDraft;

/// Start times that differ by less are the same [s].
const SAME: f64 = 1e-9;

/// What to tell of the descriptions of these nodes, once for each archive.
pub(super) fn description_notes(nodes: &[NodeDraft], clock: Option<CommunicationClock>) -> Vec<String> {
    let (mut known, mut notes) = (BTreeSet::new(), Vec::new());
    for node in nodes {
        let NodeBody::Fmu { fmu, .. } = &node.body else { continue };
        if !known.insert(&fmu.path) {
            continue;
        }
        let (file, about) = (fmu.path.display(), &fmu.description);
        let corrections = about.corrections.iter();
        notes.extend(corrections.map(|it| format!("{file}: modelDescription.xml: {it}")));
        let own = about.default_start;
        let differs = |clock: &CommunicationClock| own != 0.0 && (own - clock.start).abs() > SAME;
        if let Some(CommunicationClock { start, .. }) = clock.filter(differs) {
            // Recordings have no times before 0.
            let cure = match own > 0.0 {
                true => {
                    format!(": write `start = {own}` in [time], with a `stop` after it, to start there")
                }
                false => String::new(),
            };
            let name = &node.name;
            notes.push(format!(
                "`{name}`: the run starts at {start} s, and the description of {file} at {own} s{cure}"
            ));
        }
    }
    notes
}
