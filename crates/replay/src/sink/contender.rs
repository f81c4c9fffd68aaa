//! Tells the runs of a recording apart: under which entities each is, how its curves are called and coloured.

use re_sdk::{EntityPath, EntityPathPart};
use re_sdk_types::components::Color;

/// What the entities of the other run are below. The viewer paints and lists curves in the order of their paths, so that
/// those of the other run come last.
pub(super) const OTHER: &str = "versus";

/// One of the runs of a recording: the one that it is about, or, with a name, one that it is compared with.
#[derive(Debug, Clone, Default)]
pub(super) struct Contender(pub Option<String>);

impl Contender {
    /// Whether it is the one that the recording is about.
    pub fn is_first(&self) -> bool {
        self.0.is_none()
    }

    /// The entity of this run that is at `path` for the first one.
    pub fn path(&self, path: impl Into<EntityPath>) -> EntityPath {
        match self.is_first() {
            true => path.into(),
            false => EntityPath::from(OTHER).join(&path.into()),
        }
    }

    /// The entity that is below `root` for the first one; what shares a view has the same root.
    pub fn below(&self, root: &str, path: &str) -> EntityPath {
        let root = EntityPath::from(root);
        let root = if self.is_first() { root } else { root / EntityPathPart::from(OTHER) };
        root.join(&EntityPath::from(path))
    }

    /// What is called `label` in the first run.
    pub fn label(&self, label: &str) -> String {
        match &self.0 {
            None => label.to_owned(),
            Some(name) => format!("{label} ({name})"),
        }
    }

    /// The colour of what has this colour in the first run: lighter, so that roles are still told.
    pub fn color(&self, color: Color) -> Color {
        if self.is_first() {
            return color;
        }
        let [red, green, blue, opacity] = color.to_array();
        let [red, green, blue] =
            [red, green, blue].map(|it| ((11 * u16::from(it) + 9 * 255) / 20) as u8);
        Color::from_unmultiplied_rgba(red, green, blue, opacity)
    }
}
