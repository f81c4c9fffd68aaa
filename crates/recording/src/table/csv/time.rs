//! Finds the time columns of a CSV file.

use super::file::CsvFile;
use crate::table::TableError;

/// The columns of the time.
#[derive(Debug)]
pub(super) struct TimeColumns {
    /// The time, or its whole seconds.
    pub place: usize,
    /// The nanoseconds beyond these.
    pub nanoseconds: Option<usize>,
}

/// The ends of the names of a time in two columns, as ROS 1 and ROS 2 have it.
const SPLIT: [(&str, &str); 4] =
    [("sec", "nanosec"), ("secs", "nsecs"), ("sec", "nsec"), ("secs", "nanosecs")];

impl CsvFile<'_> {
    /// The columns of a time that is named, or of the one that the file has itself. `header.stamp` and `header.stamp.sec` are the
    /// time of both `header.stamp.sec` and `header.stamp.nanosec`.
    pub fn find_time_columns(&self, named: Option<&str>) -> Result<TimeColumns, TableError> {
        let Some(name) = named else {
            let (path, format) = (self.path.to_owned(), "CSV");
            let missing = || TableError::NoTime { path, format, present: self.unique_column_names() };
            let place = self.default_time_column().ok_or_else(missing)?;
            return Ok(TimeColumns { place, nanoseconds: None });
        };
        let place = |whole: &str, end: &str, joint: &str| self.column_index(&format!("{whole}{joint}{end}"));
        for (seconds, nanoseconds) in SPLIT {
            for joint in [".", "_", "/"] {
                let end = format!("{joint}{seconds}");
                let whole = name.strip_suffix(&end).unwrap_or(name);
                let both = (place(whole, seconds, joint), place(whole, nanoseconds, joint));
                if let (Ok(place), Ok(nanoseconds)) = both {
                    return Ok(TimeColumns { place, nanoseconds: Some(nanoseconds) });
                }
            }
        }
        let place = self.column_index(name)?;
        Ok(TimeColumns { place, nanoseconds: None })
    }
}
