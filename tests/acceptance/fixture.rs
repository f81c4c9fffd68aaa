//! Builds scenario files section by section.

/// A scenario in the making. Sections keep the order of the calls, with a blank line between them.
#[derive(Clone, Default)]
pub struct Scenario(String);

impl Scenario {
    pub fn new() -> Self {
        Scenario::default()
    }

    /// A scenario that opens with these keys, one per line.
    pub fn headed(keys: &str) -> Self {
        Scenario::new().section(keys)
    }

    /// Step and stop time [s].
    pub fn time(self, step: f64, stop: f64) -> Self {
        self.section(&format!("[time]\nstep = {step:?}\nstop = {stop:?}"))
    }

    /// A node of the archive `path`, with start values in TOML if there are any.
    pub fn fmu(self, name: &str, path: &str, start: &str) -> Self {
        let start = match start {
            "" => String::new(),
            values => format!("\nstart = {{ {values} }}"),
        };
        self.section(&format!("[[fmu]]\nname = \"{name}\"\npath = \"{path}\"{start}"))
    }

    /// A signal with its unit and shape as keys.
    pub fn signal(self, name: &str, keys: &str) -> Self {
        self.section(&format!("[[signal]]\nname = \"{name}\"\n{keys}"))
    }

    /// A table with the time in column `t`, and the inner text of `columns`.
    pub fn table(self, name: &str, path: &str, columns: &str) -> Self {
        self.section(&format!(
            "[[table]]\nname = \"{name}\"\npath = \"{path}\"\ntime = \"t\"\ncolumns = {{ {columns} }}"
        ))
    }

    pub fn connect(self, from: &str, to: &str) -> Self {
        self.section(&format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\""))
    }

    pub fn check(self, name: &str, that: &str) -> Self {
        self.section(&format!("[[check]]\nname = \"{name}\"\nthat = \"{that}\""))
    }

    /// The pose of a vehicle node for the replay.
    pub fn pose(self, node: &str) -> Self {
        self.section(&format!("[view.pose]\nx = \"{node}.X\"\ny = \"{node}.Y\"\nheading = \"{node}.psi\""))
    }

    /// One more key of the last section, or several lines of them.
    pub fn key(mut self, key: &str) -> Self {
        self.0 += key.trim_end();
        self.0.push('\n');
        self
    }

    /// Any other section.
    pub fn section(mut self, text: &str) -> Self {
        if !self.0.is_empty() {
            self.0.push('\n');
        }
        self.key(text)
    }

    /// The text of the file.
    pub fn text(self) -> String {
        self.0
    }
}
