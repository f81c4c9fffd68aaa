//! A folder with a scenario and its files, which is read and resolved as the program does before the first step.

use std::path::{Path, PathBuf};

use diagnostics::{Error, PrintableError};

use super::fmus;
use crate::BuildArtifacts;
use crate::document::Scenario;
use crate::plan::RunPlan;
use crate::resolve::{self, Override, Overrides};

pub struct Lab(tempfile::TempDir);

impl Lab {
    pub fn new() -> Self {
        Lab(tempfile::tempdir().expect("a temporary folder"))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, bytes).expect("it can be written");
    }

    /// Writes an FMU with this modelDescription.xml.
    pub fn fmu(&self, name: &str, description: &str) {
        self.write(name, fmus::archive(description));
    }

    fn read(&self, text: &str) -> Result<Scenario, Error> {
        self.write("case.toml", text);
        Scenario::read(&self.path("case.toml"))
    }

    /// Resolves the scenario `case.toml` of this text.
    pub fn resolve(&self, text: &str) -> Result<RunPlan, Error> {
        self.resolve_with(text, &[])
    }

    /// The same with values of `--set`.
    pub fn resolve_with(&self, text: &str, set: &[&str]) -> Result<RunPlan, Error> {
        let starts = set.iter().map(|entry| Override::parse(entry, |file| Path::new(file).to_owned()));
        let starts = starts.collect::<Result<Vec<_>, _>>().map_err(Error::invalid_input)?.concat();
        let overrides = Overrides { starts, ..Overrides::default() };
        let scenario = self.read(text)?;
        RunPlan::resolve(&scenario, &BuildArtifacts::default(), &overrides, self.path("out"))
    }

    /// What is wrong with the scenario of this text.
    #[track_caller]
    pub fn message(&self, text: &str) -> Message {
        self.message_of(self.resolve(text).err(), text)
    }

    /// What is wrong with the sweep of the scenario of this text, or with the scenario.
    #[track_caller]
    pub fn sweep_message(&self, text: &str) -> Message {
        let sweep = self.read(text).and_then(|scenario| resolve::resolve_sweep(&scenario));
        self.message_of(sweep.and_then(|_| self.resolve(text)).err(), text)
    }

    #[track_caller]
    pub fn message_of(&self, error: Option<Error>, text: &str) -> Message {
        let error = error.unwrap_or_else(|| panic!("nothing is wrong with:\n{text}"));
        assert_eq!(error.exit_code(), 2, "{error}");
        let errors = error.into_single_errors();
        let shown: Vec<String> = errors
            .iter()
            .map(|error| format!("{:?}", miette::Report::new(PrintableError::from_error(error))))
            .collect();
        let frame = |c: char| "│╭╰─┬▲×·".contains(c);
        let words = shown.iter().flat_map(|shown| shown.split_whitespace());
        let words = words.map(|word| word.trim_matches(frame)).filter(|word| !word.is_empty());
        let folder = format!("{}/", self.0.path().display());
        let text = words.collect::<Vec<_>>().join(" ").replace(&folder, "");
        // A line may have ended behind the folder.
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        Message { text, count: errors.len() }
    }
}

/// The errors of a scenario as a terminal shows them, without frames and breaks of lines, with paths as from the folder.
pub struct Message {
    pub text: String,
    /// The number of mistakes.
    pub count: usize,
}

impl Message {
    /// Insists on parts of the message.
    #[track_caller]
    pub fn says(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(self.text.contains(part), "expected {part:?} in:\n{}", self.text);
        }
        self
    }
}

/// A mistake: the replaced text, its replacement, a text on the line of the error, and parts of the message.
pub type Mistake = (&'static str, &'static str, &'static str, &'static [&'static str]);

/// Makes each mistake in a scenario without one, and insists on its message and its line.
#[track_caller]
pub fn check_mistakes(lab: &Lab, good: &str, mistakes: &[Mistake]) {
    if let Err(error) = lab.resolve(good) {
        panic!("{}", lab.message_of(Some(error), good).text);
    }
    let mut deviations = Vec::new();
    for (old, new, at, parts) in mistakes {
        let text = good.replacen(old, new, 1);
        assert_ne!(text, good, "the edit of {old:?} changes nothing");
        let offset = text.find(at).unwrap_or_else(|| panic!("no {at:?} in the edited scenario"));
        let line = format!("case.toml:{}:", 1 + text[..offset].matches('\n').count());
        let message = match lab.resolve(&text) {
            Ok(_) => "nothing is wrong".to_owned(),
            Err(error) => lab.message_of(Some(error), &text).text,
        };
        let parts = parts.iter().copied().chain([line.as_str()]);
        let missing: Vec<_> = parts.filter(|part| !message.contains(part)).collect();
        if !missing.is_empty() {
            deviations.push(format!("{old:?} -> {new:?}: not said: {missing:?}\n{message}"));
        }
    }
    assert!(deviations.is_empty(), "{} mistakes:\n\n{}", deviations.len(), deviations.join("\n\n"));
}
