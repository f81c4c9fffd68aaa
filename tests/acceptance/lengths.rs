//! Asserts that files and functions stay short.

use std::collections::BTreeSet;
use std::path::Path;

use super::architecture::sources;
use super::harness::ROOT;

tests! {
    files_and_functions_stay_short,
    lengths_of_functions_are_counted,
}

/// Most lines of a file and of a function.
const LIMITS: [usize; 2] = [400, 70];

/// The algorithms above the limit for functions: file, function, reason.
const ALGORITHMS: [(&str, &str, &str); 3] = [
    (
        "crates/scenario/src/resolve.rs",
        "resolve_cached",
        "the order in which the parts of a scenario are resolved, a line or two for each",
    ),
    ("crates/numerics/src/sqp.rs", "minimise", "the main loop of sequential quadratic programming"),
    (
        "crates/tire-inference/tests/posterior/judge.rs",
        "line",
        "reference quadrature over stiffness and peak, with its own scaling against underflow",
    ),
];

fn files_and_functions_stay_short() {
    let [most_of_file, most_of_function] = LIMITS;
    let (mut wrong, mut listed) = (Vec::new(), BTreeSet::new());
    for (path, text) in sources(Path::new(ROOT)) {
        let file = path.strip_prefix(ROOT).expect("a file of ours").to_string_lossy();
        let lines = text.lines().count();
        if lines > most_of_file {
            wrong.push(format!("{file}: {lines} lines"));
        }
        for (name, lines) in functions(&text).into_iter().filter(|it| it.1 > most_of_function) {
            match ALGORITHMS.iter().position(|it| (it.0, it.1) == (&*file, name)) {
                Some(index) => _ = listed.insert(index),
                None => wrong.push(format!("{file}: fn {name}: {lines} lines")),
            }
        }
    }
    let short = (0..ALGORITHMS.len()).filter(|index| !listed.contains(index));
    wrong.extend(short.map(|index| format!("no longer above the limit: {:?}", ALGORITHMS[index])));
    assert!(wrong.is_empty(), "at most {LIMITS:?} lines of file, function:\n{}", wrong.join("\n"));
}

/// Names of the functions in a formatted file, with their lines from `fn` to the closing brace.
fn functions<'a>(text: &'a str) -> Vec<(&'a str, usize)> {
    let lines: Vec<_> = text.lines().collect();
    let of = |(start, line): (usize, &&'a str)| {
        let line: &'a str = line;
        let code = line.trim_start();
        let words = code.split("fn ").next()?.split_whitespace();
        let qualifiers = ["pub", "const", "async", "default", "extern", concat!("un", "safe")];
        let is_qualifier = |word: &str| {
            word.starts_with("pub(") || word.starts_with('"') || qualifiers.contains(&word)
        };
        let (true, Some((_, rest))) = (words.clone().all(is_qualifier), code.split_once("fn "))
        else {
            return None;
        };
        let name = rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()?;
        let indentation = &line[..line.len() - code.len()];
        let ends = |line: &&str| {
            let end = line.strip_prefix(indentation).unwrap_or_default();
            end == "}" || end.starts_with(')') && end.ends_with(';')
        };
        let count = match code.ends_with(['}', ';']) {
            true => 1,
            false => 1 + lines[start..].iter().position(ends)?,
        };
        Some((name, count))
    };
    lines.iter().enumerate().filter_map(of).collect()
}

fn lengths_of_functions_are_counted() {
    let text = "impl A {\n    pub(crate) const fn a(\n        b: u8,\n    ) -> u8 {\n        if b {\n        }\n    }\n\n    fn c() {}\n}\n";
    assert_eq!(functions(text), [("a", 6), ("c", 1)]);
}
