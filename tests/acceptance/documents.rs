//! Runs the examples of the documents, compares their quotations with the files, and follows their links.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::harness::{Ended, Lab, ROOT, trackside};
use super::python::{Python, python};

tests! {
    commands_and_scenarios_of_the_documents_run,
    python_recipes_of_the_documents_run: Python,
    every_page_has_a_tested_example,
    quotations_match_their_files,
    links_resolve,
}

/// Pages in `docs` that may show nothing that runs.
const EXEMPT: [&str; 2] = ["docs/glossary.md", "docs/reference/"];
/// Pages at a time: as many as the machines of most CI services have cores.
const THREADS: usize = 2;
/// Stands for any text in the output that a document shows.
const ANYTHING: char = '…';

/// A document.
struct Page {
    /// Its path from the root of the repository.
    name: String,
    text: String,
}

/// A fenced block.
struct Block {
    /// Line of its opening fence.
    line: usize,
    /// Language and further words.
    info: Vec<String>,
    text: String,
}

/// A command that a document shows.
struct Shown {
    words: Vec<String>,
    code: i32,
    output: Vec<String>,
}

impl Page {
    fn read(path: &Path) -> Self {
        let name = path.strip_prefix(ROOT).expect("a path in the repository");
        let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
        Page { name: name.to_string_lossy().into_owned(), text }
    }

    fn blocks(&self) -> Vec<Block> {
        let mut blocks = Vec::new();
        let mut open: Option<Block> = None;
        for (index, line) in self.text.lines().enumerate() {
            match (open.take(), line.strip_prefix("```")) {
                (None, Some(info)) => {
                    let info = info.split_whitespace().map(str::to_owned).collect();
                    open = Some(Block { line: index + 1, info, text: String::new() });
                }
                (Some(block), Some(_)) => blocks.push(block),
                (Some(mut block), None) => {
                    block.text += line;
                    block.text.push('\n');
                    open = Some(block);
                }
                (None, None) => {}
            }
        }
        assert!(open.is_none(), "{}: a fence is not closed", self.name);
        blocks
    }
}

impl Block {
    /// Whether its info string begins with these words.
    fn is(&self, words: &[&str]) -> bool {
        self.info.len() >= words.len() && self.info.iter().zip(words).all(|(a, b)| a == b)
    }

    /// The file that it is a part of.
    fn file(&self) -> Option<&str> {
        self.info.iter().find_map(|word| word.strip_prefix("file="))
    }

    /// Whether the suite runs it, here or elsewhere.
    fn runs(&self) -> bool {
        [&["toml", "scenario"][..], &["console"], &["python", "run"]].iter().any(|it| self.is(it))
    }

    /// The name under which a scenario is saved, if it has one.
    fn scenario_name(&self) -> Option<&str> {
        self.info
            .iter()
            .skip(2)
            .find(|word| word.ends_with(".toml") && !word.contains('='))
            .map(String::as_str)
    }

    fn commands(&self) -> Result<Vec<Shown>, String> {
        let mut commands: Vec<Shown> = Vec::new();
        for line in self.text.lines() {
            match (line.strip_prefix("$ "), commands.last_mut()) {
                (Some(command), _) => commands.push(Shown::read(command)?),
                (None, Some(command)) => command.output.push(line.to_owned()),
                (None, None) => return Err(format!("expected a command, found {line:?}")),
            }
        }
        Ok(commands)
    }
}

impl Shown {
    fn read(line: &str) -> Result<Self, String> {
        let (command, comment) = line.split_once(" #").unwrap_or((line, ""));
        let code = comment.trim().strip_prefix("exit code ").map_or(Ok(0), str::parse);
        let code = code.map_err(|error| format!("{line}: {error}"))?;
        let program = ["trackside ", "cargo run -- "].iter().find_map(|it| command.strip_prefix(it));
        let words = program.ok_or_else(|| format!("`{line}` is no command of the program"))?;
        let words = words.split_whitespace().map(str::to_owned).collect();
        Ok(Shown { words, code, output: Vec::new() })
    }
}

/// Where the blocks of one page run: a folder that looks like the root of the repository.
struct Session<'a> {
    page: &'a Page,
    lab: Lab,
    python: Option<&'static Python>,
}

impl<'a> Session<'a> {
    fn new(page: &'a Page, python: Option<&'static Python>) -> Self {
        let lab = Lab::new();
        let scenarios = Path::new(ROOT).join("scenarios");
        std::os::unix::fs::symlink(scenarios, lab.path("scenarios")).expect("a link");
        Session { page, lab, python }
    }

    /// Runs all blocks in their order; ends at the first one that fails.
    fn run(&self) -> Result<(), String> {
        let at = |block: &Block, error| format!("{}:{}: {error}", self.page.name, block.line);
        self.page.blocks().iter().try_for_each(|block| self.block(block).map_err(|error| at(block, error)))
    }

    fn block(&self, block: &Block) -> Result<(), String> {
        if block.is(&["toml", "scenario"]) {
            self.scenario(block)
        } else if block.is(&["console", "suite"]) {
            block.commands()?.iter().try_for_each(in_suite)
        } else if block.is(&["console"]) {
            block.commands()?.iter().try_for_each(|command| self.command(command))
        } else {
            self.recipe(block);
            Ok(())
        }
    }

    /// Saves a scenario, and runs it unless a command of the page does.
    fn scenario(&self, block: &Block) -> Result<(), String> {
        let name = block.scenario_name().unwrap_or("scenario.toml");
        self.lab.write(name, &block.text);
        if self.page.text.contains(&format!("$ trackside run {name}")) {
            return Ok(());
        }
        let words = ["run", name].map(str::to_owned).to_vec();
        self.command(&Shown { words, code: 0, output: Vec::new() })
    }

    fn command(&self, shown: &Shown) -> Result<(), String> {
        if shown.words[0] == "view" && !cfg!(feature = "rerun") {
            return Ok(());
        }
        // `test` has no argument for its folder. All others look for the workspace around the current one.
        let folder = if shown.words[0] == "test" { self.lab.path("") } else { ROOT.into() };
        let output = trackside(&folder).args(self.arguments(&shown.words)).output();
        let ended = Ended::of(output.expect("it starts"));
        let (command, code) = (shown.words.join(" "), ended.code());
        if code != Some(shown.code) {
            let (expected, stdout, stderr) = (shown.code, &ended.stdout, &ended.stderr);
            return Err(format!(
                "`{command}`: expected exit code {expected}, found {code:?}\n{stdout}{stderr}"
            ));
        }
        let printed = format!("{} {}", squeezed(&ended.stdout), ended.message());
        match shown.output.iter().find(|line| !occurs(line, &printed)) {
            None => Ok(()),
            Some(line) => Err(format!("`{command}` does not print {line:?}:\n{printed}")),
        }
    }

    /// The words of a command, with files in the session's folder. What it writes goes there, too.
    fn arguments(&self, words: &[String]) -> Vec<String> {
        let mut arguments: Vec<String> = Vec::new();
        for (index, word) in words.iter().enumerate() {
            let written = index > 0 && ["--out", "--junit", "--save"].contains(&words[index - 1].as_str());
            let (mark, name) = word.strip_prefix('@').map_or(("", word.as_str()), |name| ("@", name));
            let path = self.lab.path(name);
            let here = written || path.exists();
            arguments.push(if here { format!("{mark}{}", path.display()) } else { word.clone() });
        }
        let folder = match words[0].as_str() {
            _ if words.iter().any(|word| word == "--out") => None,
            "run" => {
                Some(PathBuf::from("target/runs").join(Path::new(&words[1]).file_stem().unwrap_or_default()))
            }
            "pack" => Some("target/fmu".into()),
            _ => None,
        };
        if let Some(folder) = folder {
            let folder = self.lab.path("").join(folder);
            arguments.extend(["--out".to_owned(), folder.to_string_lossy().into_owned()]);
        }
        arguments
    }

    /// Runs a Python script, if the block is one.
    fn recipe(&self, block: &Block) {
        let Some(python) = self.python.filter(|_| block.is(&["python", "run"])) else { return };
        let folder = self.lab.path("");
        let script = format!("import os\nos.chdir({:?})\n{}", folder.display().to_string(), block.text);
        let script = self.lab.write("recipe.py", script);
        python.run(&script.to_string_lossy(), &[] as &[&str]);
    }
}

/// Whether a command runs a scenario that the suite runs as a test of its own.
fn in_suite(shown: &Shown) -> Result<(), String> {
    let known = |name: &String| {
        let path = Path::new(name);
        path.parent() == Some(Path::new("scenarios")) && Path::new(ROOT).join(path).is_file()
    };
    match &shown.words[..] {
        [run, scenario] if run == "run" && known(scenario) => Ok(()),
        words => Err(format!("`{}` runs no scenario of the suite", words.join(" "))),
    }
}

fn squeezed(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Whether the parts of a line occur one after the other.
fn occurs(line: &str, printed: &str) -> bool {
    let mut rest = printed;
    line.split(ANYTHING).map(squeezed).all(|part| match rest.find(&part) {
        Some(at) => {
            rest = &rest[at + part.len()..];
            true
        }
        None => false,
    })
}

/// All documents: those at the root, and those in `docs`.
fn pages() -> Vec<Page> {
    let root = Path::new(ROOT);
    let mut pages: Vec<Page> = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md"]
        .iter()
        .map(|name| Page::read(&root.join(name)))
        .collect();
    let mut folders = vec![root.join("docs")];
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{folder:?}: {error}"));
        for path in entries.map(|entry| entry.expect("an entry").path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                pages.push(Page::read(&path));
            }
        }
    }
    pages.sort_by(|a, b| a.name.cmp(&b.name));
    pages
}

/// Runs the blocks of pages, several at a time, and insists that all succeed.
fn run_all(pages: &[&Page], python: Option<&'static Python>) {
    let next = Mutex::new(pages.iter());
    let failures = Mutex::new(Vec::new());
    let work = || {
        loop {
            let Some(page) = next.lock().expect("no panic").next() else { return };
            if let Err(failure) = Session::new(page, python).run() {
                failures.lock().expect("no panic").push(failure);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..THREADS {
            scope.spawn(work);
        }
    });
    let failures = failures.into_inner().expect("no panic");
    assert!(failures.is_empty(), "{}", failures.join("\n\n"));
}

fn commands_and_scenarios_of_the_documents_run() {
    let pages = pages();
    run_all(&pages.iter().collect::<Vec<_>>(), None);
}

fn python_recipes_of_the_documents_run() {
    let pages = pages();
    let has_recipe = |page: &&Page| page.blocks().iter().any(|block| block.is(&["python", "run"]));
    let pages: Vec<&Page> = pages.iter().filter(has_recipe).collect();
    assert!(!pages.is_empty(), "there is a recipe for recordings");
    run_all(&pages, Some(python()));
}

fn every_page_has_a_tested_example() {
    let exempt = |page: &Page| {
        !page.name.starts_with("docs/") || EXEMPT.iter().any(|start| page.name.starts_with(start))
    };
    for page in pages().iter().filter(|page| !exempt(page)) {
        assert!(page.blocks().iter().any(Block::runs), "{} shows nothing that runs", page.name);
    }
}

fn quotations_match_their_files() {
    for page in pages() {
        for block in page.blocks() {
            let Some(file) = block.file() else { continue };
            let text = std::fs::read_to_string(Path::new(ROOT).join(file));
            let text = text.unwrap_or_else(|error| panic!("{}:{}: {file}: {error}", page.name, block.line));
            assert!(text.contains(&block.text), "{}:{} is not in {file}", page.name, block.line);
        }
    }
}

fn links_resolve() {
    let pages = pages();
    let mut broken = Vec::new();
    for page in &pages {
        let folder = Path::new(ROOT).join(&page.name);
        let folder = folder.parent().expect("a folder");
        for link in links(&prose(&page.text)) {
            let (file, heading) = link.split_once('#').unwrap_or((&link, ""));
            let path = if file.is_empty() { Path::new(ROOT).join(&page.name) } else { folder.join(file) };
            let text = std::fs::read_to_string(&path).unwrap_or_default();
            let there = || headings(&text).iter().any(|known| known == heading);
            if !(path.exists() && (heading.is_empty() || there())) {
                broken.push(format!("{}: {link}", page.name));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// A text without fenced blocks.
fn prose(text: &str) -> String {
    text.split("\n```").step_by(2).collect::<Vec<_>>().join("\n")
}

/// The targets of links and images, but for those of the web.
fn links(prose: &str) -> Vec<String> {
    let targets = prose.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0));
    targets.filter(|target| !target.contains("://")).map(str::to_owned).collect()
}

/// The anchors of a page's headings, as Git hosts make them.
fn headings(text: &str) -> Vec<String> {
    let prose = prose(text);
    let headings = prose.lines().filter(|line| line.starts_with('#'));
    let anchor = |line: &str| -> String {
        let kept = |c: char| match c {
            ' ' => Some('-'),
            '-' | '_' => Some(c),
            c if c.is_alphanumeric() => Some(c),
            _ => None,
        };
        line.trim_start_matches('#').trim().to_lowercase().chars().filter_map(kept).collect()
    };
    headings.map(anchor).collect()
}
