//! Writes the tubes that would hold a run: as lines of TOML to paste, or into the scenario file, whose comments and layout stay.

use std::fmt::Write as _;

use assessment::baseline::{BaselineOutcome, RequiredTube, SignalOutcome};
use scenario::document::toml_string;
use scenario::pattern::matches_wildcard;
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value};

/// The lines that let a run pass which left a baseline, for a person to paste; none of one that passed.
#[must_use]
pub fn tube_toml(outcome: &BaselineOutcome) -> Option<String> {
    if let Some(reason) = &outcome.reason {
        return Some(format!("# no tube lets this run pass: {}\n", comment_text(reason)));
    }
    let failed: Vec<_> = outcome.signals.iter().filter(|signal| !signal.passed).collect();
    if failed.is_empty() {
        return None;
    }
    let (mut entries, mut others) = (String::new(), String::new());
    for signal in failed {
        let name = comment_text(&signal.signal);
        let reason = comment_text(signal.reason.as_deref().unwrap_or_default());
        // Writing into a string cannot fail.
        let _ = match signal.tube {
            Some(tube) => {
                let (keys, why) = (tube_keys(tube), comment_text(&reason_of_size(signal)));
                writeln!(entries, "  {{ signals = [{}], {keys} }}, # {why}", toml_string(&signal.signal))
            }
            None => writeln!(others, "# no tube holds {name}: {reason}"),
        };
    }
    let name = comment_text(&outcome.name);
    Some(match (entries.is_empty(), outcome.has_tubes) {
        (true, _) => others,
        (false, false) => format!("# in the [[baseline]] called {name}\ntubes = [\n{entries}]\n{others}"),
        (false, true) => {
            format!("# at the end of `tubes` of the [[baseline]] called {name}\n{entries}{others}")
        }
    })
}

fn tube_keys(tube: RequiredTube) -> String {
    let RequiredTube { absolute, time } = tube;
    let keys = [("absolute", absolute), ("time", time)];
    let keys = keys.into_iter().filter_map(|(key, value)| Some(format!("{key} = {:?}", value?)));
    keys.collect::<Vec<_>>().join(", ")
}

/// Why a size is what it is: unit, and the largest deviation.
fn reason_of_size(signal: &SignalOutcome) -> String {
    match (signal.tube.and_then(|tube| tube.time), signal.distance.and_then(|it| Some((it.largest?, it.at))))
    {
        (None, Some((largest, at))) => {
            let largest = units::display::quantity_text(largest, signal.unit.as_deref());
            format!("largest deviation {largest} at {} s", diagnostics::rounded_time(at))
        }
        _ => "s; values that are equal or not may change earlier or later by this much".to_owned(),
    }
}

/// A text of others inside a comment, which ends with the line.
fn comment_text(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// The text of a scenario file with the tubes that hold what left this baseline, and the number of these tubes; all else stays as it is.
///
/// # Errors
/// In words, when the text has no such baseline in a form that can be edited.
pub fn with_required_tubes(text: &str, outcome: &BaselineOutcome) -> Result<(String, usize), String> {
    let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| error.to_string())?;
    let name = &outcome.name;
    let absent = || format!("it has no [[baseline]] called `{name}`");
    let baseline = find_baseline(&mut document, name).ok_or_else(absent)?;
    let mut written = 0;
    for signal in &outcome.signals {
        let Some(tube) = signal.tube.filter(|_| !signal.passed) else { continue };
        write_tube(baseline, &signal.signal, tube)?;
        written += 1;
    }
    Ok((document.to_string(), written))
}

fn find_baseline<'d>(document: &'d mut DocumentMut, name: &str) -> Option<&'d mut dyn TableLike> {
    fn is_named(table: &dyn TableLike, name: &str) -> bool {
        table.get("name").and_then(Item::as_str) == Some(name)
    }
    match document.get_mut("baseline")? {
        Item::ArrayOfTables(list) => {
            let found = list.iter_mut().find(|it| is_named(*it, name));
            found.map(|it| it as &mut dyn TableLike)
        }
        Item::Value(Value::Array(list)) => {
            let mut tables = list.iter_mut().filter_map(Value::as_inline_table_mut);
            tables.find(|it| is_named(*it, name)).map(|it| it as &mut dyn TableLike)
        }
        _ => None,
    }
}

/// Writes the sizes of a signal: into its own tube if that counts, or else into a new one behind the others.
fn write_tube(baseline: &mut dyn TableLike, signal: &str, tube: RequiredTube) -> Result<(), String> {
    match baseline.entry("tubes").or_insert_with(|| Item::Value(Value::Array(Array::new()))) {
        Item::Value(Value::Array(list)) => {
            let tubes = list.iter().map(|it| it.as_inline_table().map(|it| it as &dyn TableLike));
            let own =
                counting_tube(tubes, signal).and_then(|place| list.get_mut(place)?.as_inline_table_mut());
            match own.filter(|it| signal_patterns(*it).eq([signal])) {
                Some(own) => write_sizes(own, tube),
                None => push_inline_tube(list, signal, tube),
            }
        }
        Item::ArrayOfTables(list) => write_table_tube(list, signal, tube),
        _ => return Err("`tubes` of the baseline is no list".to_owned()),
    }
    Ok(())
}

/// The index of the tube that counts for a signal: the last one that names it.
fn counting_tube<'t>(tubes: impl Iterator<Item = Option<&'t dyn TableLike>>, signal: &str) -> Option<usize> {
    let names = |tube: &dyn TableLike| signal_patterns(tube).any(|pattern| matches_wildcard(pattern, signal));
    let naming = tubes.enumerate().filter(|(_, tube)| tube.is_some_and(names));
    naming.map(|(place, _)| place).last()
}

fn write_table_tube(list: &mut ArrayOfTables, signal: &str, tube: RequiredTube) {
    let tubes = list.iter().map(|it| Some(it as &dyn TableLike));
    let own = counting_tube(tubes, signal).and_then(|place| list.get_mut(place));
    match own.filter(|it| signal_patterns(*it).eq([signal])) {
        Some(own) => write_sizes(own, tube),
        None => {
            let mut table = Table::new();
            table.insert("signals", Item::Value(Value::Array(Array::from_iter([signal]))));
            write_sizes(&mut table, tube);
            list.push(table);
        }
    }
}

/// Adds a tube on a line of its own.
fn push_inline_tube(list: &mut Array, signal: &str, tube: RequiredTube) {
    let mut table = InlineTable::new();
    table.insert("signals", Value::Array(Array::from_iter([signal])));
    write_sizes(&mut table, tube);
    let mut value = Value::InlineTable(table);
    value.decor_mut().set_prefix("\n  ");
    list.push_formatted(value);
    list.set_trailing_comma(true);
    if !list.trailing().as_str().is_some_and(|it| it.contains('\n')) {
        list.set_trailing("\n");
    }
}

fn write_sizes(table: &mut dyn TableLike, tube: RequiredTube) {
    for (key, value) in [("absolute", tube.absolute), ("time", tube.time)] {
        let Some(value) = value else { continue };
        match table.get_mut(key).and_then(Item::as_value_mut) {
            Some(old) => {
                let decor = old.decor().clone();
                *old = Value::from(value);
                *old.decor_mut() = decor;
            }
            None => drop(table.insert(key, Item::Value(Value::from(value)))),
        }
    }
}

/// The patterns of the signals of a tube.
fn signal_patterns(table: &dyn TableLike) -> impl Iterator<Item = &str> {
    let list = table.get("signals").and_then(Item::as_array);
    list.into_iter().flatten().filter_map(Value::as_str)
}

#[cfg(test)]
mod tests {
    use assessment::baseline::{CurveDistance, TubeDeviation};

    use super::*;

    fn outcome(has_tubes: bool) -> BaselineOutcome {
        let signal = |name: &str, tube: Option<RequiredTube>| SignalOutcome {
            signal: name.to_owned(),
            unit: Some("rad/s".to_owned()),
            passed: false,
            reason: Some("1 instead of 2 at 0.750 s".to_owned()),
            first: Some(TubeDeviation { time: 0.5, value: 1.0, lower: 0.0, upper: 0.5 }),
            worst: None,
            distance: Some(CurveDistance { first: 0.5, largest: Some(0.01234), at: 0.75, half_height: 0.01 }),
            tube,
        };
        BaselineOutcome {
            name: "as before".to_owned(),
            recording: "golden.mcap".into(),
            reason: None,
            signals: vec![
                signal("plant.r", Some(RequiredTube { absolute: Some(0.013), time: None })),
                signal("plant.gear", Some(RequiredTube { absolute: None, time: Some(0.02) })),
                signal("plant.mode", None),
            ],
            picture: None,
            during: [0.0, 1.0],
            place: Default::default(),
            warnings: Vec::new(),
            has_tubes,
        }
    }

    #[test]
    fn lines_to_paste_have_the_sizes_with_their_reasons() {
        let lines = tube_toml(&outcome(false)).expect("lines");
        let entries = "  { signals = [\"plant.r\"], absolute = 0.013 }, # largest deviation 0.01234 rad/s at 0.75 s\n  \
                       { signals = [\"plant.gear\"], time = 0.02 }, # s; values that are equal or not may change earlier or later by this much\n";
        let rest = "# no tube holds plant.mode: 1 instead of 2 at 0.750 s\n";
        assert_eq!(lines, format!("# in the [[baseline]] called as before\ntubes = [\n{entries}]\n{rest}"));
        let more = tube_toml(&outcome(true)).expect("lines");
        assert_eq!(
            more,
            format!("# at the end of `tubes` of the [[baseline]] called as before\n{entries}{rest}")
        );
        let mut short = outcome(false);
        short.reason = Some("the run ends at 1 s".to_owned());
        assert_eq!(tube_toml(&short).as_deref(), Some("# no tube lets this run pass: the run ends at 1 s\n"));
        // What is pasted is TOML.
        toml::from_str::<toml::Table>(&lines).expect("TOML");
    }

    #[test]
    fn tubes_are_written_and_all_else_stays() {
        let head = "# A comment\ntitle   = \"x\"   # odd\n\n[[baseline]]\nname = \"other\"\n\n[[baseline]] # this one\nname = 'as before'\n";
        let tail = "relative = 0.002 # kept\n\n[view]\n# the end\n";
        for (tubes, expected) in [
            (
                "",
                "relative = 0.002 # kept\ntubes = [\n  { signals = [\"plant.r\"], absolute = 0.013 },\n  { signals = [\"plant.gear\"], time = 0.02 },\n]\n",
            ),
            (
                "tubes = [{ signals = [\"plant.*\"], absolute = 0.01 }] # mine\n",
                "tubes = [{ signals = [\"plant.*\"], absolute = 0.01 },\n  { signals = [\"plant.r\"], absolute = 0.013 },\n  { signals = [\"plant.gear\"], time = 0.02 },\n] # mine\n",
            ),
            (
                "tubes = [\n  # yaw\n  { signals = [\"plant.r\"], absolute = 0.01, relative = 0 },\n]\n",
                "tubes = [\n  # yaw\n  { signals = [\"plant.r\"], absolute = 0.013, relative = 0 },\n  { signals = [\"plant.gear\"], time = 0.02 },\n]\n",
            ),
            (
                "tubes = [{ signals = [\"plant.r\"], absolute = 0.01 }, { signals = [\"*\"], absolute = 0.02 }]\n",
                "tubes = [{ signals = [\"plant.r\"], absolute = 0.01 }, { signals = [\"*\"], absolute = 0.02 },\n  { signals = [\"plant.r\"], absolute = 0.013 },\n",
            ),
        ] {
            let text = format!("{head}{tubes}{tail}");
            let (edited, count) = with_required_tubes(&text, &outcome(false)).expect("it is edited");
            assert_eq!(count, 2);
            assert!(edited.starts_with(head) && edited.contains(expected), "{edited}");
            assert!(edited.contains("relative = 0.002 # kept\n") && edited.ends_with("[view]\n# the end\n"));
            toml::from_str::<toml::Table>(&edited).expect("TOML");
        }
        let tables = format!("{head}\n[[baseline.tubes]]\nsignals = [\"plant.r\"]\nabsolute = 0.01\n");
        let (edited, _) = with_required_tubes(&tables, &outcome(false)).expect("it is edited");
        assert!(
            edited.contains("absolute = 0.013\n")
                && edited.contains("[[baseline.tubes]]\nsignals = [\"plant.gear\"]")
        );
        let absent = with_required_tubes("title = \"x\"\n", &outcome(false));
        assert_eq!(absent, Err("it has no [[baseline]] called `as before`".to_owned()));
    }
}
