//! What tries damaged configurations, and plugins whose answers are damaged.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use damage::FuzzTarget;
use plugin::{AnalysisError, AnalysisRequest, AnalysisServices, Diagram, Plugin, ResultSummary, Signal};
use serde::Deserialize;

pub const TARGET: FuzzTarget = FuzzTarget {
    name: "plugins",
    corpus: concat!(env!("CARGO_MANIFEST_DIR"), "/../plugin/tests/corpus/plugins"),
    sound,
    words: &[
        "axle",
        "front",
        "bounds",
        "levels",
        "method",
        "kind",
        "[[axle]]",
        "[a.b]",
        "=",
        "true",
        "1979-05-27",
        "'''",
        "\"\"\"",
        "summary",
        "sound",
        "tables",
        "head",
        "rows",
        "null",
        "[",
        "]",
        "{",
        "}",
        "\u{1f980}",
        "\t",
        "\x07",
    ],
    own: None,
    attempt,
};

/// Configurations, results, and what the plugin `hostile` is to do.
fn sound() -> Vec<Vec<u8>> {
    let texts = [
        "levels = [1, 2.5]\n[axle.front]\nbounds = [0.5, 2]\nmethod = { kind = \"grid\", points = 7 }\n[axle.rear]\nbounds = [1e-3, inf]\n",
        r#"{"summary": ["all is well", "7"], "sound": false, "tables": [{"head": ["a", "b"], "rows": [["1", "2"], ["3"]]}], "x": {"y": [1e3, null]}}"#,
        "\u{1}\u{5}group\u{2}\u{4}name\u{2}m/\u{3}\u{2}\u{2}\u{4}next\u{1}s\u{4}\u{3}\u{3}\u{4}\u{3}abc\u{1}\u{2}ab\u{4}\u{1}\u{1}\u{2}\u{2}\u{2}\u{3}abc\u{1}x\u{1}y\u{1}\u{2}\u{2}\u{7}\u{5}a.txt\u{4}text\u{a}\u{0}\u{0}\u{1}\u{9}{\"a\": 1.5}",
        "\u{0}\u{1}\u{4}half\u{a}\u{1}\u{2}\u{3}fit\u{5}start\u{1}\u{7}no good\u{b}\u{0}\u{0}\u{1}\u{2}ok",
    ];
    texts.map(|text| text.as_bytes().to_vec()).to_vec()
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Config {
    #[serde(default)]
    levels: Vec<f64>,
    #[serde(default)]
    axle: BTreeMap<String, Axle>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Axle {
    bounds: [f64; 2],
    #[serde(default)]
    method: Method,
}

#[derive(Debug, Default, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
enum Method {
    #[default]
    Plain,
    Grid {
        points: u32,
    },
}

/// Looks at all that is handed over.
#[derive(Default)]
struct Looks(usize);

impl AnalysisServices for Looks {
    fn report_progress(&mut self, share: f64, task: &str) -> bool {
        self.0 += task.len();
        !share.is_nan()
    }

    fn record_signals(&mut self, group: &str, signals: &[Signal]) {
        let numbers = signals.iter().flat_map(|it| it.time.iter().chain(it.values));
        let names = signals.iter().map(|it| it.name.chars().count() + it.unit.len());
        self.0 += group.len() + numbers.filter(|it| it.is_finite()).count() + names.sum::<usize>();
    }

    fn add_diagram(&mut self, group: &str, diagram: &Diagram) {
        let numbers = diagram.layers.iter().flat_map(|it| it.x.iter().chain(it.y).chain(it.upper));
        self.0 += group.len() + diagram.title.len() + numbers.filter(|it| it.is_finite()).count();
        self.0 += format!("{diagram:?}").len();
    }

    fn write_file(&mut self, name: &str, text: &str) {
        self.0 += name.len() + text.len();
    }
}

/// The example `hostile`, which cargo builds before this.
fn hostile() -> &'static Plugin {
    static HOSTILE: OnceLock<Plugin> = OnceLock::new();
    HOSTILE.get_or_init(|| {
        let program = std::env::current_exe().expect("this program");
        let folders = program.ancestors().skip(1).take(2).map(Path::to_owned);
        let places = folders.flat_map(|it| [it.clone(), it.join("examples")]);
        let name = format!("{}hostile{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        let found: Option<PathBuf> = places.map(|it| it.join(&name)).find(|it| it.is_file());
        Plugin::load(&found.expect("the example `hostile`")).expect("a plugin")
    })
}

/// Reads the text as a configuration and as a result, and lets a plugin do as it says.
fn attempt(bytes: &[u8], _: &Path) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let read = plugin::from_toml::<Config>(&text);
    match &read {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(Config { levels, axle }) => {
            let grid = |it: &Axle| matches!(it.method, Method::Grid { points } if points > 0);
            let grids = axle.values().filter(|it| grid(it)).count();
            let bounds = axle.values().flat_map(|it| it.bounds).count();
            assert!(grids + levels.len() + bounds <= bytes.len(), "more than was written");
        }
    }
    let words = serde_json::from_str::<ResultSummary>(&text);
    let mut looks = Looks::default();
    let signal = Signal { name: "x", unit: "m", time: &[0.0, 1.0], values: &[1.0, 2.0] };
    let request = AnalysisRequest { config: &text, signals: vec![signal] };
    let _ = hostile().check_request(&request).map_err(|error| error.to_string());
    match hostile().run(&request, &mut looks) {
        Ok(result) => {
            let _ = serde_json::from_str::<ResultSummary>(&result);
            true
        }
        Err(AnalysisError::Config(error)) => {
            assert!(error.path.len() <= 3, "{error:?}");
            true
        }
        Err(AnalysisError::Failed(_)) => read.is_ok() || words.is_ok(),
    }
}
