//! Tests of aliases of columns, and of logs that follow one another.

use std::path::Path;

use diagnostics::{Error, PrintableError, SourceFiles};
use plugin::OwnedInputSignal;

use super::{AliasRequest, RecordedLog, read_aliases, read_for_playback, read_log_numbers};
use crate::document::Scenario;

const ALIASES: &str = "# of the season
time = [\"Time\", \"t_s\"]
v_x = [\"Ground Speed\", { column = \"VehSpd\", unit = \"km/h\", gain = 0.5 }, \"vx_mps\"]
a_y = { column = \"G Lat\", sign = -1 }
r = \"Yaw\"
";

/// Files in a folder of their own.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for (name, text) in files.iter().chain(&[("aliases.toml", ALIASES)]) {
            std::fs::write(folder.path().join(name), text).expect("it can be written");
        }
        Folder(folder)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    /// A scenario with these words of `[analysis.table]`.
    fn scenario(&self, words: &str) -> Scenario {
        let text = format!("[[analysis]]\nname = \"a\"\ncrate = \"c\"\n[analysis.table]\n{words}\n");
        let path = self.path().join("case.toml");
        std::fs::write(&path, text).expect("it can be written");
        let source = SourceFiles::read_main_file(&path).expect("it is there");
        Scenario::from_recording("case", source).expect("a scenario")
    }

    fn read(&self, words: &str) -> Result<(RecordedLog, Vec<String>), Error> {
        let scenario = self.scenario(words);
        let table = scenario.document.analysis[0].table.as_ref().expect("a table");
        let known = read_aliases(&scenario, table.file())?;
        let mut warnings = Vec::new();
        let log = read_log_numbers(
            &scenario,
            table.file(),
            known.as_ref(),
            AliasRequest::Needs(&needs()),
            &mut warnings,
        )?;
        Ok((log, warnings))
    }

    fn error(&self, words: &str) -> String {
        let error = self.read(words).err().expect("it is wrong");
        let shown = format!("{:?}", miette::Report::new(PrintableError::from_error(&error)));
        // Without the breaks of its lines.
        shown.replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ")
    }
}

fn needs() -> Vec<OwnedInputSignal> {
    let need = |(name, required): (&str, bool)| OwnedInputSignal {
        name: name.to_owned(),
        unit: String::new(),
        description: String::new(),
        required,
    };
    [("v_x", true), ("a_y", false), ("x", false)].map(need).into()
}

/// Names, units and values.
fn shown(log: &RecordedLog) -> Vec<(String, Option<String>, Vec<f64>)> {
    let columns = log.columns.iter().enumerate();
    columns.map(|(k, it)| (it.name.clone(), it.unit.clone(), log.table.column_values(k).to_vec())).collect()
}

#[test]
fn one_scenario_serves_the_logs_of_several_loggers() {
    let folder = Folder::new(&[
        ("a.csv", "Time,Ground Speed [km/h],G Lat [g0]\n0,36,1\n1,72,-1\n"),
        ("b.csv", "t_s,VehSpd,Yaw\n0,36,1\n1,72,-1\n"),
    ]);
    let text = Some("km/h".to_owned());
    let (log, _) = folder.read("path = \"a.csv\"\naliases = \"aliases.toml\"").expect("a log");
    let v_x = |values: [f64; 2]| ("v_x".to_owned(), text.clone(), values.to_vec());
    let a_y = ("a_y".to_owned(), Some("g0".to_owned()), vec![-1.0, 1.0]);
    assert_eq!(shown(&log), [a_y, v_x([36.0, 72.0])]);
    // What the analysis can do without is not there, and its gain is that of the alias.
    let (log, _) = folder.read("path = \"b.csv\"\naliases = \"aliases.toml\"").expect("a log");
    assert_eq!(shown(&log), [v_x([18.0, 36.0])]);
    // What the scenario says goes first: a column of the file, or words besides the name of an alias.
    let words = "path = \"b.csv\"\naliases = \"aliases.toml\"\ncolumns = { v_x = ";
    let of_file = folder.read(&format!("{words}{{ column = \"Yaw\", unit = \"m/s\" }} }}"));
    let of_file = of_file.expect("a column");
    assert_eq!(shown(&of_file.0), [("v_x".into(), Some("m/s".into()), vec![1.0, -1.0])]);
    let besides = folder.read(&format!("{words}{{ column = \"v_x\", gain = 2.0 }}, x = \"r\" }}"));
    let besides = shown(&besides.expect("an alias").0);
    assert_eq!(besides, [v_x([72.0, 144.0]), ("x".into(), None, vec![1.0, -1.0])]);
}

#[test]
fn a_missing_alias_points_into_its_file_and_names_all_that_was_tried() {
    let folder = Folder::new(&[("c.csv", "Time,Ground Sped,w\n0,1,2\n1,2,3\n")]);
    let error = folder.error("path = \"c.csv\"\naliases = \"aliases.toml\"");
    for part in [
        "c.csv has none of the columns of `v_x`: `Ground Speed`, `VehSpd`, `vx_mps`",
        "aliases.toml:3:1",
        "did you mean `Ground Sped`?",
    ] {
        assert!(error.contains(part), "{part}: {error}");
    }
    let none = folder.error("path = \"c.csv\"\ntime = \"Time\"");
    assert!(none.contains("expected `columns`, or a file of `aliases`"), "{none}");
    for (text, part) in [
        ("v_x = []", "expected at least one column for `v_x`"),
        ("v_x = [1]", "the name of a column, or a table with `column`"),
        ("v_x = [{ column = \"w\", unit = \"furlong\" }]", "furlong"),
        ("v_x = [{ column = \"w\", gain = 0.0 }]", "expected a gain other than 0"),
        ("v_x = [{ colum = \"w\" }]", "unknown field `colum`"),
        ("v_x = ", "aliases.toml:1"),
    ] {
        std::fs::write(folder.path().join("aliases.toml"), text).expect("it can be written");
        let error = folder.error("path = \"c.csv\"\naliases = \"aliases.toml\"");
        assert!(error.contains(part) && error.contains("aliases.toml:1"), "{text}: {error}");
    }
    let absent = folder.error("path = \"c.csv\"\naliases = \"other.toml\"");
    assert!(absent.contains("case.toml:6"), "{absent}");
}

#[test]
fn logs_follow_one_another_in_the_units_of_the_first_one() {
    let folder = Folder::new(&[
        ("a.csv", "Time,Ground Speed [km/h],G Lat [g0]\n5,36,1\n6,72,-1\n"),
        ("b.csv", "t_s,vx_mps [m/s]\n100,10\n100.5,20\n"),
        ("c.csv", "t_s,Ground Speed [N]\n100,10\n"),
    ]);
    let words = "path = [\"a.csv\", \"b.csv\", \"a.csv\"]\naliases = \"aliases.toml\"";
    let (mut log, warnings) = folder.read(words).expect("a log");
    assert_eq!(shown(&log).len(), 1);
    assert_eq!(log.table.column_values(0), [36.0, 72.0, 36.0, 72.0, 36.0, 72.0]);
    assert_eq!(log.table.clock_times(), [[0.0, 1.0, 11.0, 11.5, 21.5, 22.5]]);
    assert!(warnings[0].contains("`a_y` is left out: b.csv has no column for it"), "{warnings:?}");
    log.table.add_log_number_column("log");
    assert_eq!(log.table.column_values(1), [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
    let error = folder.error("path = [\"a.csv\", \"c.csv\"]\naliases = \"aliases.toml\"");
    assert!(error.contains("`v_x` is in [km/h] in a.csv and in [N] in c.csv"), "{error}");
    let empty = folder.error("path = []\ncolumns = { v_x = \"v\" }");
    assert!(empty.contains("expected at least one log"), "{empty}");
    let origin = folder.read(&format!("{words}\norigin = 4.0")).expect("a log").0;
    assert_eq!(origin.table.clock_times()[0][..3], [1.0, 2.0, 12.0]);
}

#[test]
fn a_table_that_is_played_back_takes_all_aliases_of_its_file() {
    let folder = Folder::new(&[("b.csv", "t_s,VehSpd,Yaw\n0,36,1\n1,72,-1\n")]);
    let text = "[[table]]\nname = \"t\"\npath = PATH\naliases = \"aliases.toml\"\n";
    let played = |path: &str| {
        let file = folder.path().join("case.toml");
        std::fs::write(&file, text.replace("PATH", path)).expect("it can be written");
        let source = SourceFiles::read_main_file(&file).expect("it is there");
        let scenario = Scenario::from_recording("case", source).expect("a scenario");
        let words = scenario.document.table[0].file();
        read_for_playback(&scenario, words, &|_, _| recording::table::ColumnType::Number, &mut Vec::new())
    };
    let log = played("\"b.csv\"").expect("a log");
    let names: Vec<String> = shown(&log).into_iter().map(|it| it.0).collect();
    assert_eq!(names, ["r", "v_x"]);
    let error = played("[\"b.csv\", \"b.csv\"]").err().expect("two").to_string();
    assert!(error.contains("several logs one after another are for analyses"), "{error}");
}
