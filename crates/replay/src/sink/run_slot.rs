//! Gives each of two runs in one recording its entities, labels and colours.

use re_sdk::{EntityPath, EntityPathPart};
use re_sdk_types::components::Color;

/// The root of the second run's entities. The viewer paints and lists curves in the order of their paths: those of the second
/// run come last.
pub(super) const OTHER: &str = "versus";

/// The slot of a run in a recording: the first run without a name, the second one with its name.
#[derive(Debug, Clone, Default)]
pub(super) struct RunNamespace(pub Option<String>);

impl RunNamespace {
    /// Whether it is the first run.
    pub fn is_first(&self) -> bool {
        self.0.is_none()
    }

    /// The entity of this run; the first run has it at `path`.
    pub fn entity_path(&self, path: impl Into<EntityPath>) -> EntityPath {
        match self.is_first() {
            true => path.into(),
            false => EntityPath::from(OTHER).join(&path.into()),
        }
    }

    /// The entity of this run; the first run has it at `path` below `root`. Entities of one view share their root.
    pub fn entity_path_below(&self, root: &str, path: &str) -> EntityPath {
        let root = EntityPath::from(root);
        let root = if self.is_first() { root } else { root / EntityPathPart::from(OTHER) };
        root.join(&EntityPath::from(path))
    }

    /// What is called `label` in the first run.
    pub fn run_label(&self, label: &str) -> String {
        match &self.0 {
            None => label.to_owned(),
            Some(name) => format!("{label} ({name})"),
        }
    }

    /// The colour of what has this colour in the first run: lighter, so that roles stay recognisable.
    pub fn run_color(&self, color: Color) -> Color {
        if self.is_first() {
            return color;
        }
        let [red, green, blue, opacity] = color.to_array();
        let [red, green, blue] = [red, green, blue].map(|it| ((11 * u16::from(it) + 9 * 255) / 20) as u8);
        Color::from_unmultiplied_rgba(red, green, blue, opacity)
    }
}
