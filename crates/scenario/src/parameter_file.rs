//! Reads a file of parameters: dotted names with numbers, texts, and texts of other files.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cosim::quantity::convert_quantity;
use diagnostics::{Error, ErrorCollector, SourceFiles, TextFile};
use serde::Deserialize as _;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use crate::document::split_number_and_unit;
use crate::text_of::{self, TextCache};

/// The largest file of parameters [B].
const LARGEST: u64 = 64 << 20;

/// A value of a file of parameters.
pub struct FileParameter {
    /// The keys that lead to it, with dots in between.
    pub name: String,
    /// The span of its last key.
    pub key: Range<usize>,
    /// The value.
    pub value: toml::Value,
    /// The span of the value.
    pub span: Range<usize>,
    /// The file that the value is the text of, if it is one.
    pub text_file: Option<PathBuf>,
}

impl FileParameter {
    /// The number that this value is in a unit: a number without one is in it.
    ///
    /// # Errors
    /// In words, when it is no number, or has a unit of another dimension.
    pub fn number_in(&self, unit: &str) -> Result<f64, String> {
        number_in_unit(&self.value, unit)
    }
}

/// The number that a value is in a unit: a number, or a text of a number with a unit of its own.
///
/// # Errors
/// In words, when it is no number, or has a unit of another dimension.
pub fn number_in_unit(value: &toml::Value, unit: &str) -> Result<f64, String> {
    let no_number = || format!("expected a number, or a text of a number with a unit, found {value}");
    match value {
        toml::Value::Float(number) => Ok(*number),
        toml::Value::Integer(number) => Ok(*number as f64),
        toml::Value::String(text) => {
            let (number, own) = split_number_and_unit(text).ok_or_else(no_number)?;
            convert_quantity(number, own, Some(unit), None, false)
        }
        _ => Err(no_number()),
    }
}

/// A file of parameters.
pub struct ParameterFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its text, for messages.
    pub source: Arc<SourceFiles>,
    /// Its values, in their order; the text of a file stands for `{ text_of = "..." }`.
    pub values: Vec<FileParameter>,
}

/// The text of a file of parameters.
///
/// # Errors
/// In words, when it cannot be read or is too large.
pub(crate) fn read_parameter_text(path: &Path) -> Result<String, String> {
    diagnostics::read_text_bounded(path, LARGEST)
        .map_err(|error| format!("the parameters {} cannot be read: {error}", path.display()))
}

impl ParameterFile {
    /// Reads a file by itself.
    ///
    /// # Errors
    /// When it or a file that it names cannot be read, or is no TOML: with its line.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = read_parameter_text(path).map_err(Error::invalid_input)?;
        let mut mistakes = ErrorCollector::default();
        let file = Self::parse(path.to_owned(), text, &TextCache::default(), &mut mistakes)?;
        mistakes.into_result().map(|()| file)
    }

    /// The values of a text, each with the places of its key and of itself.
    pub(crate) fn parse(
        path: PathBuf,
        text: String,
        texts: &TextCache,
        mistakes: &mut ErrorCollector,
    ) -> Result<Self, Error> {
        // A byte order mark is as long as three blanks.
        let text = text.replacen('\u{feff}', "   ", 1);
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let source = SourceFiles::from_generated(TextFile::new(path.clone(), text.clone()));
        let (table, errors) = DeTable::parse_recoverable(&text);
        let end = text.len();
        if let Some(error) = errors.first() {
            return Err(source.error_at(error.span().unwrap_or(end..end), error.message(), "here"));
        }
        let mut values = Vec::new();
        visit_dotted_entries(table.get_ref(), "", &mut |name, key, value| {
            let span = value.span();
            let read = toml::Value::deserialize(ValueDeserializer::from(value.clone()));
            let read = read.map_err(|error| error.message().to_owned()).and_then(|value| {
                let text_file = text_of::text_file_path(&value).map(|file| folder.join(file));
                let value = match &text_file {
                    Some(file) => texts.read_text(file).map(toml::Value::String)?,
                    None => value,
                };
                Ok(FileParameter { name, key, value, span: span.clone(), text_file })
            });
            let read = read.map_err(|message| source.error_at(span, message, ""));
            values.extend(mistakes.ok_or_record(read));
        });
        Ok(ParameterFile { path, source: Arc::new(source), values })
    }
}

/// Takes the name of a value, the span of its key, and the value.
type ParameterVisitor<'v, 'a> = &'v mut dyn FnMut(String, Range<usize>, &toml::Spanned<DeValue<'a>>);

/// Calls `take` for each value with its name and the span of its key.
fn visit_dotted_entries<'a>(table: &DeTable<'a>, prefix: &str, take: ParameterVisitor<'_, 'a>) {
    for (key, value) in table {
        let name = format!("{prefix}{}", key.get_ref());
        match value.get_ref() {
            DeValue::Table(inner) if !text_of::is_text_file_reference(inner) => {
                visit_dotted_entries(inner, &format!("{name}."), take);
            }
            _ => take(name, key.span(), value),
        }
    }
}
