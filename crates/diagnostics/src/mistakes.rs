//! Collects mistakes, so that one does not hide the next.

use crate::error::Error;

/// Mistakes that are found one after the other. What cannot be judged because of one of them is left out.
#[derive(Debug, Default)]
pub struct ErrorCollector {
    errors: Vec<Error>,
    /// Names that something has that is wrong itself.
    hidden: Vec<String>,
    /// Whether something is wrong, be it told here or elsewhere.
    any: bool,
}

impl ErrorCollector {
    /// Notes the error, if it is one.
    pub fn ok_or_record<T>(&mut self, result: Result<T, Error>) -> Option<T> {
        result.map_err(|error| self.push(error)).ok()
    }

    /// Notes an error.
    pub fn push(&mut self, error: Error) {
        self.any = true;
        self.errors.extend(error.into_single_errors());
    }

    /// Notes the error, if it is one, of something called `name`. That nothing else has this name, or one below it, is then no
    /// mistake of its own.
    pub fn ok_or_record_named<T>(&mut self, name: &str, result: Result<T, Error>) -> Option<T> {
        if result.is_err() {
            self.hidden.push(name.to_owned());
        }
        self.ok_or_record(result)
    }

    /// All values, or all errors.
    ///
    /// # Errors
    /// When one of the results is an error.
    pub fn collect_all<T>(results: impl IntoIterator<Item = Result<T, Error>>) -> Result<Vec<T>, Error> {
        let mut mistakes = ErrorCollector::default();
        let values = results.into_iter().filter_map(|result| mistakes.ok_or_record(result)).collect();
        mistakes.into_result().map(|()| values)
    }

    /// Both values, or the errors of both.
    ///
    /// # Errors
    /// When one of the results is an error.
    pub fn collect_both<A, B>(a: Result<A, Error>, b: Result<B, Error>) -> Result<(A, B), Error> {
        match (a, b) {
            (Ok(a), Ok(b)) => Ok((a, b)),
            (a, b) => Err(Error::Several(a.err().into_iter().chain(b.err()).collect())),
        }
    }

    /// The end of the search.
    ///
    /// # Errors
    /// When something is wrong: the mistakes, each of them once, in the order of their files.
    pub fn into_result(mut self) -> Result<(), Error> {
        let hidden = std::mem::take(&mut self.hidden);
        self.errors.retain(|error| !is_consequent_error(error, &hidden));
        let mut files: Vec<String> = Vec::new();
        for (file, _) in self.errors.iter().filter_map(|error| error.as_input()?.file_name_and_offset()) {
            if !files.iter().any(|known| known == file) {
                files.push(file.to_owned());
            }
        }
        let place = |error: &Error| {
            let (file, offset) = error.as_input()?.file_name_and_offset()?;
            Some((files.iter().position(|known| known == file), offset))
        };
        self.errors.sort_by_key(place);
        self.errors.dedup_by(|a, b| place(a) == place(b) && a.to_string() == b.to_string());
        match (self.errors.pop(), self.errors.is_empty()) {
            (None, _) if !self.any => Ok(()),
            (None, _) => Err(Error::already_reported()),
            (Some(only), true) => Err(only),
            (Some(last), false) => {
                self.errors.push(last);
                Err(Error::Several(self.errors))
            }
        }
    }
}

impl FromIterator<Error> for ErrorCollector {
    fn from_iter<I: IntoIterator<Item = Error>>(errors: I) -> Self {
        let mut mistakes = ErrorCollector::default();
        errors.into_iter().for_each(|error| mistakes.push(error));
        mistakes
    }
}

/// Whether an error says that a name is unknown that a hidden one stands for. A pattern may stand for any of them.
fn is_consequent_error(error: &Error, hidden: &[String]) -> bool {
    let Some(name) = error.as_input().and_then(|input| input.unknown_name()) else { return false };
    let is_below = |one: &str, other: &str| {
        one.strip_prefix(other).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    let stands_for = |known: &String| is_below(name, known) || is_below(known, name);
    hidden.iter().any(|known| name.contains('*') || stands_for(known))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::SourceFiles;
    use crate::text_file::TextFile;

    fn told(mistakes: ErrorCollector) -> Vec<String> {
        let error = mistakes.into_result().expect_err("mistakes");
        error.into_single_errors().iter().map(ToString::to_string).collect()
    }

    #[test]
    fn mistakes_come_once_each_and_in_the_order_of_the_file() {
        let file = TextFile::new("case.toml", "one two three");
        let source = SourceFiles::from_recording(file, Vec::new(), Vec::new());
        let error = |place, message| source.error_at(place, message, "");
        let several = Error::Several(vec![error(8..13, "c"), error(4..7, "b")]);
        let errors = [error(8..13, "c"), error(0..3, "a"), several, Error::invalid_input("an argument")];
        let mut mistakes = ErrorCollector::from_iter(errors);
        assert_eq!(mistakes.ok_or_record(Ok(1)), Some(1));
        assert_eq!(told(mistakes), ["an argument", "a", "b", "c"]);
        assert!(ErrorCollector::default().into_result().is_ok());
        assert_eq!(ErrorCollector::collect_all([Ok(1), Ok(2)]).ok(), Some(vec![1, 2]));
    }

    #[test]
    fn a_mistake_hides_the_names_below_it_and_no_others() {
        let unknown = |name: &str| Error::invalid_input(name).with_unknown_name(name.to_owned());
        let names = ["plant", "plant.v_x", "*.v_x", "plan", "plants.v_x", "driver", "driver.steer"];
        let mut mistakes = ErrorCollector::from_iter(names.map(unknown));
        mistakes.ok_or_record_named::<()>("plant", Err(Error::invalid_input("no file")));
        mistakes.ok_or_record_named::<()>("driver.v", Err(Error::invalid_input("no shape")));
        assert_eq!(told(mistakes), ["plan", "plants.v_x", "driver.steer", "no file", "no shape"]);
        // What is told elsewhere is still no success.
        assert_eq!(told(ErrorCollector { any: true, ..ErrorCollector::default() }), [""; 0]);
    }
}
