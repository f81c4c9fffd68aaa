//! Writes files: new ones with all keys, and changed ones that keep every other letter.

use std::fmt::Write as _;

use tire::{CoefficientKey, Coefficients, KEYS, MagicFormulaVersion};

use crate::keys::{key_in_file, key_offset};
use crate::syntax::{TirFile, TirValue};

/// Column of the sign of an assignment.
const WIDTH: usize = 25;

/// The text of a new file: all keys of the version with what they are, in SI units and ISO-W axes, for the left side. `about` are
/// lines of comment at its beginning.
pub fn write_tir_text(coefficients: &Coefficients, about: &[String]) -> String {
    let mut text = String::new();
    for line in about {
        let line: String = line.chars().filter(|it| !it.is_control()).collect();
        let _ = writeln!(text, "$ {line}");
    }
    let kind = match coefficients.version {
        MagicFormulaVersion::Mf52 => "PROPERTY_FILE_FORMAT = 'MF52'\nFITTYP = 52",
        MagicFormulaVersion::Pac2002 => "PROPERTY_FILE_FORMAT = 'PAC2002'",
        MagicFormulaVersion::Mf61 => "PROPERTY_FILE_FORMAT = 'MF61'\nFITTYP = 61",
        MagicFormulaVersion::Mf62 => "PROPERTY_FILE_FORMAT = 'MF62'\nFITTYP = 62",
    };
    text += "[MDI_HEADER]\nFILE_TYPE = 'tir'\nFILE_VERSION = 3.0\nFILE_FORMAT = 'ASCII'\n";
    text += "[UNITS]\nLENGTH = 'meter'\nFORCE = 'newton'\nANGLE = 'radian'\nMASS = 'kg'\nTIME = 'second'\nPRESSURE = 'pascal'\n";
    let mut section = "";
    let used =
        |key: &&CoefficientKey| key.versions.is_empty() || key.versions.contains(&coefficients.version);
    for key in KEYS.iter().filter(used) {
        if key.section != section {
            section = key.section;
            let _ = writeln!(text, "[{section}]");
            if section == "MODEL" {
                let _ = writeln!(text, "{kind}\nTYRESIDE = 'LEFT'");
            }
        }
        let value = key.get(coefficients) - key_offset(coefficients.version, key.name);
        let name = key_in_file(coefficients.version, key);
        let _ = writeln!(text, "{name:<WIDTH$}= {value:<22} ${}", key.doc);
    }
    text
}

impl TirFile {
    /// Sets a key to a value in the file's own units; a key that the file does not have is added to its section. Everything else stays
    /// as it is.
    pub fn set_key(&mut self, section: &str, key: &str, value: f64) {
        if let Some(entry) = self.entries.iter_mut().rfind(|it| it.section == section && it.key == key) {
            let written = value.to_string();
            let line = &mut self.lines[entry.line - 1];
            // An empty value has no blank before it that could be kept.
            let begin = entry.place.start.min(line.len());
            line.replace_range(begin..entry.place.end.min(line.len()), &written);
            entry.place = begin..begin + written.len();
            entry.value = TirValue::Number(value);
            return;
        }
        let last = self.entries.iter().rfind(|it| it.section == section).map(|it| it.line);
        let at = last.unwrap_or_else(|| {
            self.lines.push(format!("[{section}]"));
            self.lines.len()
        });
        self.lines.insert(at, format!("{key:<WIDTH$}= {value}"));
        let changed = Self::parse(&self.to_text());
        let line_end = self.line_end;
        *self = Self { line_end, ..changed };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_tir;

    #[test]
    fn what_is_written_reads_back_the_same() {
        for version in [
            MagicFormulaVersion::Mf52,
            MagicFormulaVersion::Pac2002,
            MagicFormulaVersion::Mf61,
            MagicFormulaVersion::Mf62,
        ] {
            let mut tire = Coefficients { version, ..Coefficients::sports_tire() };
            tire.PHY1 = 1.0 / 3.0 * 1e-7;
            tire.PDX2 = -0.1 - 0.2;
            let text = write_tir_text(&tire, &["A tire".to_owned()]);
            let (found, messages) = read_tir(&text, "a.tir").expect("a tire");
            let used = |key: &&CoefficientKey| key.versions.contains(&version);
            for key in KEYS.iter().filter(used) {
                assert_eq!(key.get(&found), key.get(&tire), "{}", key.name);
            }
            assert!(messages.is_empty(), "{messages:?}");
        }
    }

    #[test]
    fn a_change_keeps_every_other_letter() {
        let text = "$ made by\r\n[MODEL]\r\nFITTYP = 61\t$ kind\r\n[X]\r\nODD = 'a = b' $ c\r\n[VERTICAL]\r\nFNOMIN =4e3$load\r\nVERTICAL_STIFFNESS =\r\n";
        let mut file = TirFile::parse(text);
        assert_eq!(file.to_text(), text);
        file.set_key("VERTICAL", "FNOMIN", 4100.5);
        file.set_key("VERTICAL", "VERTICAL_STIFFNESS", 2e5);
        file.set_key("LATERAL_COEFFICIENTS", "PKY1", -20.0);
        let expected = text.replace("4e3", "4100.5").replace("STIFFNESS =", "STIFFNESS =200000");
        let added = format!("{expected}[LATERAL_COEFFICIENTS]\r\n{:<25}= -20\r\n", "PKY1");
        assert_eq!(file.to_text(), added);
    }
}
