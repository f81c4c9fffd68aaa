//! Buffers the lines that a script prints until they are taken.

use std::collections::VecDeque;

/// Lines that are kept between two calls, and the longest of them [bytes].
const MOST: usize = 10_000;
const LONGEST: usize = 1 << 16;

/// The last lines, for the message about a process that ended.
const LAST: usize = 50;

/// What a script printed.
#[derive(Debug, Default)]
pub(crate) struct PrintedLines {
    /// The line that is not complete.
    open: Vec<u8>,
    lines: Vec<String>,
    left_out: usize,
    last: VecDeque<String>,
    count: usize,
    over: bool,
}

impl PrintedLines {
    /// Takes bytes.
    pub fn add_bytes(&mut self, bytes: &[u8]) {
        for part in bytes.split_inclusive(|byte| *byte == b'\n') {
            self.open.extend(part);
            if part.ends_with(b"\n") || self.open.len() > LONGEST {
                self.finish_line();
            }
        }
    }

    /// Nothing follows.
    pub fn mark_finished(&mut self) {
        self.finish_line();
        self.over = true;
    }

    /// Whether nothing follows.
    pub fn is_finished(&self) -> bool {
        self.over
    }

    /// All lines since the last time.
    pub fn take_lines(&mut self) -> Vec<String> {
        let mut lines = std::mem::take(&mut self.lines);
        if self.left_out > 0 {
            lines.push(format!("... and {} more lines", self.left_out));
            self.left_out = 0;
        }
        lines
    }

    /// The last line with something in it.
    pub fn last_line(&self) -> &str {
        self.last.back().map_or("", String::as_str)
    }

    /// Lines in all.
    pub fn line_count(&self) -> usize {
        self.count
    }

    /// The place in the script that Python names, in a line after so many.
    pub fn traceback_location_after(&self, count: usize) -> Option<String> {
        let new = self.last.iter().rev().take(self.count - count).rev();
        // `  File "/folder/script.py", line 12 in step`, the innermost first; that of a package says less than who called it.
        let places = new.filter_map(|line| {
            let (path, rest) = line.trim().strip_prefix("File \"")?.split_once("\", line ")?;
            let (line, function) = rest.split_once(" in ")?;
            let file = path.rsplit('/').next()?;
            let own = !path.contains("/lib/python") && !path.contains("site-packages");
            Some((own, format!("{file}:{line}, in {function}")))
        });
        let mut places: Vec<_> = places.collect();
        // Stable: the innermost one of the script comes first.
        places.sort_by_key(|(own, _)| !own);
        places.into_iter().next().map(|(_, place)| place)
    }

    fn finish_line(&mut self) {
        let line = String::from_utf8_lossy(&std::mem::take(&mut self.open)).trim_end().to_owned();
        if line.is_empty() {
            return;
        }
        self.count += 1;
        if self.last.len() == LAST {
            self.last.pop_front();
        }
        self.last.push_back(line.clone());
        if self.lines.len() < MOST {
            self.lines.push(line);
        } else {
            self.left_out += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_whole_and_not_too_many_of_them_are_kept() {
        let mut said = PrintedLines::default();
        said.add_bytes(b"one\ntw");
        assert_eq!(said.take_lines(), ["one"]);
        said.add_bytes(b"o\n\n\xff\n");
        assert_eq!(said.take_lines(), ["two", "\u{fffd}"]);
        (0..MOST + 3).for_each(|_| said.add_bytes(b"x\n"));
        let lines = said.take_lines();
        assert_eq!((lines.len(), lines.last().expect("a line").as_str()), (MOST + 1, "... and 3 more lines"));
        said.add_bytes(b"last");
        said.mark_finished();
        assert_eq!((said.take_lines(), said.last_line()), (vec!["last".to_owned()], "last"));
    }

    #[test]
    fn the_place_of_a_script_is_read_from_what_python_says() {
        let mut said = PrintedLines::default();
        said.add_bytes(b"  File \"/a/old.py\", line 1 in f\n");
        let before = said.line_count();
        assert_eq!(said.traceback_location_after(before), None);
        said.add_bytes(b"Current thread 0x1 (most recent call first):\n");
        said.add_bytes(b"  File \"/usr/lib/python3.11/queue.py\", line 7 in get\n");
        assert_eq!(said.traceback_location_after(before).expect("a place"), "queue.py:7, in get");
        said.add_bytes(b"  File \"/b/c.py\", line 12 in step\n  File \"/b/fmu.py\", line 3 in x\n");
        assert_eq!(said.traceback_location_after(before).expect("a place"), "c.py:12, in step");
    }
}
