//! Finds a plugin in a dynamic library and calls it: the program's side of the boundary.
#![allow(unsafe_code, reason = "a library is loaded, and its pointers become slices here")]

use std::ffi::c_void;
use std::path::{Path, PathBuf};

use libloading::Library;

use crate::abi::{
    self, Call, Callbacks, Column, Need, SYMBOL, Text, VERSION, Vtable, slice, with_signals,
};
use crate::diagram::with_diagram;
use crate::export::column;
use crate::{Host, Request};

/// Why a library is no plugin for this program.
#[derive(Debug)]
pub enum LoadError {
    /// It does not load.
    Open(PathBuf, libloading::Error),
    /// It exports no plugin.
    NoPlugin(PathBuf),
    /// It was built for another version of the interface.
    Version {
        /// The library.
        path: PathBuf,
        /// The version that it was built for.
        found: u32,
    },
}

impl std::fmt::Display for LoadError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Self::Open(path, error) => {
                write!(f, "cannot load the plugin {}: {error}", path.display())
            }
            Self::NoPlugin(path) => {
                write!(f, "{} is no plugin: it exports no `trackside_plugin`", path.display())
            }
            Self::Version { path, found } => write!(
                f,
                "the plugin {} was built for version {found} of the plugin interface, this program has version {VERSION}: \
                 build it again with this program's crate `plugin`",
                path.display()
            ),
        }
    }
}

impl std::error::Error for LoadError {}

/// A signal that a plugin can be given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// Its name.
    pub name: String,
    /// The unit that it is wanted in; empty when any will do.
    pub unit: String,
    /// One line about it.
    pub description: String,
    /// Whether the plugin cannot do without.
    pub required: bool,
}

/// A loaded plugin.
#[derive(Debug)]
pub struct Plugin {
    vtable: &'static Vtable,
    needs: Vec<Wanted>,
    /// Where the table is: it must stay as long as the table is used. `None` for one of this very program.
    _library: Option<Library>,
}

impl std::fmt::Debug for Vtable {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "Vtable {{ version: {} }}", self.version)
    }
}

impl Plugin {
    /// Loads the library at `path`.
    ///
    /// # Errors
    /// When it is no plugin for this version of the interface.
    pub fn load(path: &Path) -> Result<Self, LoadError> {
        // SAFETY: loading runs the library's initialisers, which is what a user asks for who names a plugin.
        let library = unsafe { Library::new(path) };
        let library = library.map_err(|error| LoadError::Open(path.to_owned(), error))?;
        // SAFETY: a library that exports this name exports this function, in every version of the interface.
        let entry = unsafe { library.get::<unsafe extern "C" fn() -> *const Vtable>(SYMBOL) };
        let entry = entry.map_err(|_| LoadError::NoPlugin(path.to_owned()))?;
        // SAFETY: the same.
        let vtable = unsafe { entry() };
        if vtable.is_null() {
            return Err(LoadError::NoPlugin(path.to_owned()));
        }
        // SAFETY: every version's table begins with the version, so no more than that may be read yet.
        let found = unsafe { vtable.cast::<u32>().read() };
        if found != VERSION {
            return Err(LoadError::Version { path: path.to_owned(), found });
        }
        // SAFETY: the table is of this version, and lives as long as the library, which is kept with it.
        Ok(Self::of(unsafe { &*vtable }, Some(library)))
    }

    fn of(vtable: &'static Vtable, library: Option<Library>) -> Self {
        let mut needs = Vec::new();
        // SAFETY: the function takes the context back to `take_needs`, which expects this vector.
        unsafe { (vtable.needs)((&raw mut needs).cast(), take_needs) };
        Self { vtable, needs, _library: library }
    }

    /// The signals that it can be given.
    #[must_use]
    pub fn needs(&self) -> &[Wanted] {
        &self.needs
    }

    /// Whether a configuration makes sense to it, with these signals, which need no samples.
    ///
    /// # Errors
    /// With its own words.
    pub fn check(&self, request: &Request) -> Result<(), String> {
        self.call(self.vtable.check, request, &mut crate::Silent).map(drop)
    }

    /// Analyses.
    ///
    /// # Errors
    /// With its own words; also when it panicked, and when it broke the rules.
    pub fn run(&self, request: &Request, host: &mut dyn Host) -> Result<String, String> {
        self.call(self.vtable.run, request, host)
    }

    fn call(
        &self,
        function: Call,
        request: &Request,
        host: &mut dyn Host,
    ) -> Result<String, String> {
        let mut call = Called { host, outcome: None };
        let context = (&raw mut call).cast();
        let callbacks = Callbacks { context, progress, record, diagram, file, done };
        let columns: Vec<_> = request.signals.iter().map(column).collect();
        // SAFETY: everything lives until the call is over, and the callbacks expect this context.
        unsafe {
            function(
                Text::new(request.config),
                columns.as_ptr(),
                columns.len(),
                &raw const callbacks,
            )
        };
        call.outcome.unwrap_or_else(|| Err("returned without a result".to_owned()))
    }
}

/// What the callbacks work on.
struct Called<'a> {
    host: &'a mut dyn Host,
    outcome: Option<Result<String, String>>,
}

/// # Safety
/// `context` is the `Called` of the call that is going on, and nothing else uses it.
unsafe fn called<'a>(context: *mut c_void) -> &'a mut Called<'a> {
    // SAFETY: as the caller promises.
    unsafe { &mut *context.cast() }
}

unsafe extern "C" fn take_needs(context: *mut c_void, needs: *const Need, count: usize) {
    // SAFETY: `load` passed this vector, and the plugin lends its needs for the duration of the call.
    let (all, needs) = unsafe { (&mut *context.cast::<Vec<Wanted>>(), slice(needs, count)) };
    all.extend(needs.iter().map(|need| {
        // SAFETY: the same.
        let text = |text: Text| unsafe { text.get() }.into_owned();
        Wanted {
            name: text(need.name),
            unit: text(need.unit),
            description: text(need.description),
            required: need.required,
        }
    }));
}

unsafe extern "C" fn progress(context: *mut c_void, share: f64, what: Text) -> bool {
    // SAFETY: the plugin hands back the context of its call, and lends the text; so below.
    let (called, what) = unsafe { (called(context), what.get()) };
    called.host.progress(share, &what)
}

unsafe extern "C" fn record(
    context: *mut c_void,
    group: Text,
    columns: *const Column,
    count: usize,
) {
    // SAFETY: see above.
    let (called, group) = unsafe { (called(context), group.get()) };
    // SAFETY: see above.
    unsafe { with_signals(columns, count, |signals| called.host.record(&group, &signals)) }
}

unsafe extern "C" fn diagram(context: *mut c_void, group: Text, diagram: *const abi::Diagram) {
    // SAFETY: see above; a diagram is there.
    let (called, group, diagram) = unsafe { (called(context), group.get(), &*diagram) };
    // SAFETY: see above.
    unsafe { with_diagram(diagram, |diagram| called.host.diagram(&group, diagram)) }
}

unsafe extern "C" fn file(context: *mut c_void, name: Text, text: Text) {
    // SAFETY: see above.
    let (called, name, text) = unsafe { (called(context), name.get(), text.get()) };
    called.host.file(&name, &text);
}

unsafe extern "C" fn done(context: *mut c_void, well: bool, text: Text) {
    // SAFETY: see above.
    let (called, text) = unsafe { (called(context), text.get().into_owned()) };
    called.outcome = Some(if well { Ok(text) } else { Err(text) });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Analysis, Diagram, Layer, Role, Shape, Signal};

    /// Does what its configuration says.
    struct Obedient;

    impl Analysis for Obedient {
        const NEEDS: &'static [crate::Need] = &[
            crate::Need::required("x", "m/s", "a speed"),
            crate::Need::optional("ü", "", "anything"),
        ];

        fn check(request: &Request) -> Result<(), String> {
            if request.config == "bad" { Err("`bad` is wrong".to_owned()) } else { Ok(()) }
        }

        fn run(request: &Request, host: &mut dyn Host) -> Result<String, String> {
            match request.config {
                "panic" => panic!("no {}", "way"),
                "work" => {}
                other => return Err(format!("expected `work`, found `{other}`")),
            }
            if !host.progress(0.5, "half") {
                return Err("cancelled".to_owned());
            }
            let x = request.signal("x").ok_or("no x")?;
            host.record(
                "double",
                &[Signal { name: "xx", values: &[x.values[0] * 2.0, f64::NAN], ..x }],
            );
            let layer = Layer {
                name: "ä",
                shape: Shape::Line,
                role: Role::Limit,
                x: &[0.0, 1.0],
                y: &[2.0, f64::INFINITY],
                upper: &[3.0],
            };
            let layers = vec![layer, Layer { shape: Shape::Band, role: Role::Other, ..layer }];
            let (axes, ranges) = (["x [m]", "y"], [[0.0, 1.0], [2.0, 3.0]]);
            host.diagram("both", &Diagram { title: "t", axes, ranges, layers });
            host.file("note.txt", "written");
            Ok(format!("{x:?} of {}", request.signals.len()))
        }
    }

    /// Writes down what it is told, and wants to go on or not.
    struct Told(Vec<String>, bool);

    impl Host for Told {
        fn progress(&mut self, share: f64, what: &str) -> bool {
            self.0.push(format!("{share} {what}"));
            self.1
        }
        fn record(&mut self, group: &str, signals: &[Signal]) {
            self.0.push(format!("{group} {signals:?}"));
        }
        fn diagram(&mut self, group: &str, diagram: &Diagram) {
            self.0.push(format!("{group} {diagram:?}"));
        }
        fn file(&mut self, name: &str, text: &str) {
            self.0.push(format!("{name}: {text}"));
        }
    }

    fn plugin() -> Plugin {
        // SAFETY: the table is a constant of this program.
        Plugin::of(unsafe { &*crate::vtable::<Obedient>() }, None)
    }

    fn run(config: &str, go_on: bool) -> (Result<String, String>, Vec<String>) {
        let signals = vec![
            Signal { name: "x", unit: "m/s", time: &[0.0, 0.5], values: &[1.5, 2.5] },
            Signal { name: "ü", unit: "", time: &[], values: &[] },
        ];
        let mut told = Told(Vec::new(), go_on);
        let result = plugin().run(&Request { config, signals }, &mut told);
        (result, told.0)
    }

    #[test]
    fn columns_go_in_and_text_files_and_columns_come_out() {
        let (result, told) = run("work", true);
        let x = r#"Signal { name: "x", unit: "m/s", time: [0.0, 0.5], values: [1.5, 2.5] }"#;
        assert_eq!(result, Ok(format!("{x} of 2")));
        let double = r#"Signal { name: "xx", unit: "m/s", time: [0.0, 0.5], values: [3.0, NaN] }"#;
        let line = r#"Layer { name: "ä", shape: Line, role: Limit, x: [0.0, 1.0], y: [2.0, inf], upper: [] }"#;
        // A band without an upper end for each point is as long as it has them.
        let band =
            r#"Layer { name: "ä", shape: Band, role: Other, x: [0.0], y: [2.0], upper: [3.0] }"#;
        let diagram = format!(
            r#"both Diagram {{ title: "t", axes: ["x [m]", "y"], ranges: [[0.0, 1.0], [2.0, 3.0]], layers: [{line}, {band}] }}"#
        );
        let expected = ["0.5 half", &format!("double [{double}]"), &diagram, "note.txt: written"];
        assert_eq!(told, expected);
    }

    #[test]
    fn a_panic_an_error_and_a_cancelled_analysis_are_told() {
        assert_eq!(run("panic", true).0, Err("panicked: no way".to_owned()));
        assert_eq!(run("rest", true).0, Err("expected `work`, found `rest`".to_owned()));
        assert_eq!(run("work", false), (Err("cancelled".to_owned()), vec!["0.5 half".to_owned()]));
    }

    #[test]
    fn needs_and_the_opinion_on_a_configuration_are_asked_for() {
        let plugin = plugin();
        let [x, any] = plugin.needs() else { panic!("{:?}", plugin.needs()) };
        assert_eq!((x.name.as_str(), x.unit.as_str(), x.required), ("x", "m/s", true));
        assert_eq!(
            (any.name.as_str(), any.description.as_str(), any.required),
            ("ü", "anything", false)
        );
        let check = |config| plugin.check(&Request { config, signals: Vec::new() });
        assert_eq!(check("good"), Ok(()));
        assert_eq!(check("bad"), Err("`bad` is wrong".to_owned()));
    }
}
