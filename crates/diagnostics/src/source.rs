//! The text files of a scenario as one address space of bytes, so that errors can point into them.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Component, Path, PathBuf};
use std::sync::OnceLock;

use crate::error::Error;
use crate::span::Spanned;
use crate::text_file::{TextFile, read_scenario_file, read_text_file};

/// Text files, one behind the other: a place in any of them is a range of bytes of them all.
#[derive(Debug, Clone, Default)]
pub struct SourceFiles {
    first: TextFile,
    others: Vec<TextFile>,
    /// Files that these name, as they were when a run was recorded.
    attachments: Vec<TextFile>,
    /// Paths that the user wrote in the place of some in these files.
    user_paths: BTreeSet<String>,
    /// The places of all ends of lines, once somebody asked for a line.
    line_ends: OnceLock<Vec<usize>>,
}

impl SourceFiles {
    /// Reads the file that the user named.
    ///
    /// # Errors
    /// In words, when it cannot be read.
    pub fn read_main_file(path: &Path) -> Result<Self, String> {
        Ok(SourceFiles { first: read_scenario_file(path)?, ..SourceFiles::default() })
    }

    /// A text that was made of the file that the user named.
    #[must_use]
    pub fn from_generated(first: TextFile) -> Self {
        SourceFiles { first, ..SourceFiles::default() }
    }

    /// Adds a text that was made of a file.
    pub fn add_generated(&mut self, file: TextFile) {
        self.add(file);
    }

    fn add(&mut self, file: TextFile) {
        self.line_ends.take();
        self.others.push(file);
    }

    /// The files that were kept with a recording: that of the user, those that it extends, and those that they name.
    #[must_use]
    pub fn from_recording(first: TextFile, others: Vec<TextFile>, attachments: Vec<TextFile>) -> Self {
        SourceFiles { first, others, attachments, ..SourceFiles::default() }
    }

    /// Keeps the text of another file, if it is one, for recordings.
    pub fn attach_file(&mut self, path: &Path) {
        self.attachments.extend(read_text_file(path));
    }

    /// The contents of an attached file.
    #[must_use]
    pub fn attached_text(&self, path: &Path) -> Option<&str> {
        self.attachments.iter().find(|file| file.path == path).map(|file| file.text.as_str())
    }

    /// All files that recordings keep, under their names in the folder of the first one: those of the scenario, and those that
    /// they name.
    #[must_use]
    pub fn files_for_recording(&self) -> [Vec<TextFile>; 2] {
        let folder = self.first.path.parent().unwrap_or(Path::new(""));
        let named = |file: &TextFile| {
            let path = file.path.strip_prefix(folder).unwrap_or(&file.path);
            TextFile::new(path, file.text.clone())
        };
        [self.files().map(named).collect(), self.attachments.iter().map(named).collect()]
    }

    /// Reads another file, which the word at `place` names.
    ///
    /// # Errors
    /// At that word, when it cannot be read.
    pub fn add_file(&mut self, path: &Path, place: Range<usize>) -> Result<(), Error> {
        self.add(read_scenario_file(path).map_err(|message| self.error_at(place, message, ""))?);
        Ok(())
    }

    /// The files, that of the user first.
    pub fn files(&self) -> impl Iterator<Item = &TextFile> {
        std::iter::once(&self.first).chain(&self.others)
    }

    /// The file that the user named.
    #[must_use]
    pub fn main_path(&self) -> &Path {
        &self.first.path
    }

    /// The files, each with the place of its first byte. The place behind its last byte is its own, too.
    fn with_offsets(&self) -> impl Iterator<Item = (usize, &TextFile)> {
        self.files().scan(0, |next, file| {
            let begin = *next;
            *next += file.text.len() + 1;
            Some((begin, file))
        })
    }

    fn file_at(&self, place: usize) -> (usize, &TextFile) {
        let before = self.with_offsets().take_while(|(begin, _)| *begin <= place);
        before.last().unwrap_or((0, &self.first))
    }

    /// The texts of the files behind so many blanks that a parser finds each place where it is here.
    #[must_use]
    pub fn padded_texts(&self) -> Vec<String> {
        self.with_offsets().map(|(begin, file)| " ".repeat(begin) + &file.text).collect()
    }

    /// The file that a place is in, and its line in it, from 1 on.
    #[must_use]
    pub fn file_and_line(&self, place: usize) -> (&Path, usize) {
        let (begin, file) = self.file_at(place);
        let ends = self.line_ends.get_or_init(|| self.find_line_ends());
        let ends_before = |place: usize| ends.partition_point(|end| *end < place);
        (&file.path, 1 + ends_before(place) - ends_before(begin))
    }

    fn find_line_ends(&self) -> Vec<usize> {
        let files = self.with_offsets();
        files.flat_map(|(begin, file)| file.text.match_indices('\n').map(move |it| begin + it.0)).collect()
    }

    /// The file and the line of a place, for sentences; of a text that was made, the place that it was made of.
    #[must_use]
    pub fn describe_position(&self, place: usize) -> String {
        let (begin, file) = self.file_at(place);
        let (path, line) = self.file_and_line(place);
        file.source_map
            .original_position(place - begin)
            .unwrap_or_else(|| format!("{}:{line}", path.display()))
    }

    /// The letters at a place.
    #[must_use]
    pub fn text_at(&self, place: Range<usize>) -> &str {
        let (begin, file) = self.file_at(place.start);
        file.text.get(place.start - begin..place.end - begin).unwrap_or_default()
    }

    /// The texts of all files, under their names if there are several.
    #[must_use]
    pub fn concatenated_text(&self) -> String {
        if self.others.is_empty() {
            return self.first.text.clone();
        }
        let named = |file: &TextFile| format!("# {}\n\n{}", file.path.display(), file.text);
        self.files().map(named).collect::<Vec<_>>().join("\n")
    }

    /// A path that a word names, which is relative to the file that the word stands in. In a text out of an archive the folder of the archive
    /// is the root of all paths, so that none leads out of it.
    #[must_use]
    pub fn resolve_path(&self, word: &Spanned<String>) -> PathBuf {
        let folder = self.base_folder(word.span());
        match self.is_archived(word.span()) && !self.user_paths.contains(word.get_ref()) {
            true => folder.join(path_below_root(Path::new(word.get_ref()))),
            false => folder.join(word.get_ref()),
        }
    }

    /// The same files, with paths that the user wrote in the place of some: these may lead anywhere.
    #[must_use]
    pub fn with_user_paths(self, user_paths: BTreeSet<String>) -> Self {
        SourceFiles { user_paths, ..self }
    }

    /// The folder that paths are relative to in the file that a place is in.
    #[must_use]
    pub fn base_folder(&self, place: Range<usize>) -> &Path {
        let file = self.file_at(place.start).1;
        let own = || file.path.parent().unwrap_or(Path::new(""));
        file.folder.as_deref().unwrap_or_else(own)
    }

    /// Whether the place is in a text out of an archive, whose folder others have filled.
    #[must_use]
    pub fn is_archived(&self, place: Range<usize>) -> bool {
        self.file_at(place.start).1.folder.is_some()
    }

    /// An error at a place, with `label` under it.
    #[must_use]
    pub fn error_at(&self, place: Range<usize>, message: impl Into<String>, label: &str) -> Error {
        let (begin, file) = self.file_at(place.start);
        let lines = self.file_and_line(place.start).1 - 1;
        let place = place.start - begin..place.end - begin;
        let message = file.source_map.with_renamed_paths(message.into());
        match file.source_map.original_position(place.start) {
            // The user does not have the text.
            Some(origin) => Error::invalid_input(format!("{origin}: {message}")),
            None => Error::at_span(file, place, lines, message, label),
        }
    }
}

/// A path as it is below a folder that is its root.
fn path_below_root(path: &Path) -> PathBuf {
    let mut below = PathBuf::new();
    for part in path.components() {
        match part {
            Component::Normal(name) => below.push(name),
            Component::ParentDir => drop(below.pop()),
            Component::Prefix(_) | Component::RootDir | Component::CurDir => {}
        }
    }
    below
}
